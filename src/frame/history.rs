//! The resolve pass of live display: each frame joined with a history, tone mapped and encoded.
//!
//! Shaders `shade.vert`, `resolve.frag`; CPU twin [`crate::cpu::resolve`].

use std::sync::Arc;

use ash::vk;

use super::fetches::Build;
use super::shaders;
use super::targets::{Canvas, overwriting_pass};
use crate::gpu::{
    self, Binding, Buffer, DescriptorSets, Device, GraphicsDesc, GraphicsPipeline, Image,
    RenderPass, Sampler, Shader,
};
use crate::ledger::Filter;

/// The pass that joins a frame with those before it. The two means of the canvas hold the history in turn.
pub struct HistoryPass {
    /// By which of the means is written.
    targets: [RenderPass; 2],
    /// By which of the means is written; of each a set a frame slot.
    sets: [DescriptorSets; 2],
    pipeline: GraphicsPipeline,
    size: [u32; 2],
    // Referred to by the sets.
    _samplers: [Sampler; 2],
}

impl HistoryPass {
    /// Prepares the pass over `canvas`, for frames of this `motion` and `depth`.
    pub fn new(
        device: &Arc<Device>,
        uniforms: &[Buffer],
        canvas: &Canvas,
        motion: &Image,
        depth: &Image,
        filter: Filter,
        build: Build<'_>,
    ) -> gpu::Result<Self> {
        let border = vk::BorderColor::FLOAT_TRANSPARENT_BLACK;
        let nearest = Sampler::new(device, "nearest", vk::Filter::NEAREST, border, None)?;
        let between = match filter {
            Filter::Linear => vk::Filter::LINEAR,
            Filter::Texels => vk::Filter::NEAREST,
        };
        let between = Sampler::new(device, "history", between, border, None)?;
        let [first, second] = &canvas.means;
        let shader = build.shader(shader(filter));
        let of = |old: &Image| {
            let bindings: Vec<_> = uniforms
                .iter()
                .map(|u| {
                    let own = vec![
                        Binding::Uniform(u),
                        Binding::Sampled(&canvas.radiance, &nearest),
                        Binding::Sampled(old, &between),
                        Binding::Sampled(motion, &nearest),
                        Binding::Sampled(depth, &nearest),
                    ];
                    build.bindings(&shader, own)
                })
                .collect();
            let stages = vk::ShaderStageFlags::FRAGMENT;
            DescriptorSets::new(device, "history", stages, &bindings)
        };
        let sets = [of(second)?, of(first)?];
        let onto = |mean| overwriting_pass(device, "history", &[mean, &canvas.display]);
        let targets = [onto(first)?, onto(second)?];
        let desc = GraphicsDesc {
            colors: 2,
            ..GraphicsDesc::flat(&shaders::SHADE_VERT, &shader, &CONSTANTS)
        };
        // Passes onto either mean are compatible.
        let pipeline = GraphicsPipeline::new(device, &desc, &targets[0], &sets[0])?;
        Ok(HistoryPass {
            targets,
            sets,
            pipeline,
            size: canvas.display.size(),
            _samplers: [nearest, between],
        })
    }

    /// Writes mean `mean`, the other one and the frame joined, and the display image.
    pub fn record(&self, commands: vk::CommandBuffer, slot: usize, mean: usize) {
        let pass = &self.targets[mean];
        pass.begin(commands, &[]);
        self.pipeline.bind(commands, &self.sets[mean], slot);
        self.pipeline
            .draw_full_screen(commands, [0, self.size[0]], self.size[1]);
        pass.end(commands);
    }
}

/// Values of the shader's specialisation constants: no plain mean.
pub const CONSTANTS: [u32; 1] = [0];

/// The shader that joins, on a device that filters as `filter`.
pub fn shader(filter: Filter) -> &'static Shader {
    match filter {
        Filter::Linear => &shaders::RESOLVE_FRAG_LIVE,
        Filter::Texels => &shaders::RESOLVE_FRAG_LIVE_NEAREST,
    }
}
