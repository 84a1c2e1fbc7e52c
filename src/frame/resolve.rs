//! The resolve pass: the running mean over jittered frames, tone mapped and encoded.
//!
//! Shaders `shade.vert`, `resolve.frag`; CPU twin [`crate::cpu::resolve`].

use std::sync::Arc;

use ash::vk;

use super::fetches::Build;
use super::shaders;
use super::targets::{Canvas, overwriting_pass};
use crate::gpu::{
    self, Binding, Buffer, DescriptorSets, Device, GraphicsDesc, GraphicsPipeline, RenderPass,
    Sampler, Shader,
};

/// The pass that accumulates and encodes.
///
/// It draws the whole screen: on llvmpipe in two thirds of the time of a compute shader that does the same.
pub struct ResolvePass {
    /// By which of the means is written, and whether for display, too.
    targets: [[RenderPass; 2]; 2],
    /// By which of the means is written; of each a set a frame slot.
    sets: [DescriptorSets; 2],
    /// Without and with the encoding for display.
    pipelines: [GraphicsPipeline; 2],
    size: [u32; 2],
    // Referred to by the sets.
    _sampler: Sampler,
}

impl ResolvePass {
    /// Prepares the pass over `canvas`; only with `history` is the mean of earlier frames read.
    pub fn new(
        device: &Arc<Device>,
        uniforms: &[Buffer],
        canvas: &Canvas,
        history: bool,
        build: Build<'_>,
    ) -> gpu::Result<Self> {
        let border = vk::BorderColor::FLOAT_TRANSPARENT_BLACK;
        let sampler = Sampler::new(device, "nearest", vk::Filter::NEAREST, border, None)?;
        let [first, second] = &canvas.means;
        let shader = |encode| build.shader(shader(encode));
        // Both read the same.
        let of = |old: &gpu::Image| {
            let bindings: Vec<_> = uniforms
                .iter()
                .map(|u| {
                    let own = vec![
                        Binding::Uniform(u),
                        Binding::Sampled(&canvas.radiance, &sampler),
                        Binding::Sampled(old, &sampler),
                    ];
                    build.bindings(&shader(true), own)
                })
                .collect();
            let stages = vk::ShaderStageFlags::FRAGMENT;
            DescriptorSets::new(device, "resolve", stages, &bindings)
        };
        let sets = [of(second)?, of(first)?];
        let onto = |mean| {
            let accumulate = overwriting_pass(device, "accumulate", &[mean])?;
            let encode =
                overwriting_pass(device, "accumulate and encode", &[mean, &canvas.display])?;
            Ok::<_, gpu::Error>([accumulate, encode])
        };
        let targets = [onto(first)?, onto(second)?];
        let pipeline = |encode: bool| {
            let (shader, constants) = (shader(encode), [u32::from(history)]);
            let desc = GraphicsDesc {
                colors: 1 + usize::from(encode),
                ..GraphicsDesc::flat(&shaders::SHADE_VERT, &shader, &constants)
            };
            // Passes onto either mean are compatible.
            GraphicsPipeline::new(device, &desc, &targets[0][usize::from(encode)], &sets[0])
        };
        let pipelines = [pipeline(false)?, pipeline(true)?];
        Ok(ResolvePass {
            targets,
            sets,
            pipelines,
            size: canvas.display.size(),
            _sampler: sampler,
        })
    }

    /// Writes mean `mean`, the other one and the frame taken together, and with `encode` the display image.
    pub fn record(&self, commands: vk::CommandBuffer, slot: usize, mean: usize, encode: bool) {
        let pass = &self.targets[mean][usize::from(encode)];
        let pipeline = &self.pipelines[usize::from(encode)];
        pass.begin(commands, &[]);
        pipeline.bind(commands, &self.sets[mean], slot);
        pipeline.draw_full_screen(commands, [0, self.size[0]], self.size[1]);
        pass.end(commands);
    }
}

/// The shader that accumulates, and encodes if asked.
pub fn shader(encode: bool) -> &'static Shader {
    match encode {
        false => &shaders::RESOLVE_FRAG,
        true => &shaders::RESOLVE_FRAG_ENCODE,
    }
}
