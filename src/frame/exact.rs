//! The exact pass: multiple scattering summed over every texel of the light map, in bands
//! of rows, so that no submit lasts long.
//!
//! Shader `exact.comp`; CPU twin [`crate::cpu::shade`].

use std::sync::Arc;

use ash::vk;

use super::fetches::Build;
use super::shaders;
use super::targets::{Canvas, GBuffer, LightMap};
use crate::gpu::{self, Binding, Buffer, ComputePipeline, DescriptorSets, Device, Sampler};

/// The pass that adds the exact sum to the radiance of a range of columns.
pub struct ExactPass {
    sets: DescriptorSets,
    pipeline: ComputePipeline,
    columns: [u32; 2],
    // Referred to by the sets.
    _sampler: Sampler,
}

impl ExactPass {
    /// Prepares the pass for `columns` of the picture.
    pub fn new(
        device: &Arc<Device>,
        uniforms: &[Buffer],
        map: &LightMap,
        gbuffer: &GBuffer,
        canvas: &Canvas,
        columns: [u32; 2],
        build: Build<'_>,
    ) -> gpu::Result<Self> {
        let sampler = Sampler::new(
            device,
            "texels",
            vk::Filter::NEAREST,
            vk::BorderColor::FLOAT_TRANSPARENT_BLACK,
            None,
        )?;
        let shader = build.shader(&shaders::EXACT_COMP);
        let bindings: Vec<_> = uniforms
            .iter()
            .map(|u| {
                build.bindings(
                    &shader,
                    vec![
                        Binding::Uniform(u),
                        Binding::Sampled(&gbuffer.depth, &sampler),
                        Binding::Sampled(&gbuffer.normal, &sampler),
                        Binding::Sampled(&map.moments, &sampler),
                        Binding::Storage(&canvas.radiance),
                    ],
                )
            })
            .collect();
        let sets = DescriptorSets::new(device, "exact", vk::ShaderStageFlags::COMPUTE, &bindings)?;
        let pipeline = ComputePipeline::new(device, &shader, &sets, 24, &[])?;
        Ok(ExactPass {
            sets,
            pipeline,
            columns,
            _sampler: sampler,
        })
    }

    /// Has the pass add to `columns` of the picture, from the next frame that is recorded; there may be none.
    pub fn move_to(&mut self, columns: [u32; 2]) {
        self.columns = columns;
    }

    /// Adds rows `rows` of the light map to lines `lines` of the picture; both end before the
    /// second number.
    pub fn record(
        &self,
        commands: vk::CommandBuffer,
        slot: usize,
        rows: [u32; 2],
        lines: [u32; 2],
    ) {
        if self.columns[0] >= self.columns[1] {
            return;
        }
        self.pipeline.bind(commands, &self.sets, slot);
        self.pipeline
            .push(commands, bytemuck::cast_slice(&[self.columns, lines, rows]));
        self.pipeline.dispatch_8x8(
            commands,
            [self.columns[1] - self.columns[0], lines[1] - lines[0]],
        );
    }
}
