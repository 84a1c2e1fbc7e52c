//! The resolve pass: the running mean over jittered frames, tone mapped and encoded.
//!
//! Shader `resolve.comp`; CPU twin [`crate::cpu::resolve`].

use std::sync::Arc;

use ash::vk;

use super::fetches::Build;
use super::shaders;
use super::targets::Canvas;
use crate::gpu::{self, Binding, Buffer, ComputePipeline, DescriptorSets, Device};

/// The pass that accumulates and encodes.
pub struct ResolvePass {
    sets: DescriptorSets,
    /// Without and with the encoding for display.
    pipelines: [ComputePipeline; 2],
    size: [u32; 2],
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
        let shader = build.shader(&shaders::RESOLVE_COMP);
        let bindings: Vec<_> = uniforms
            .iter()
            .map(|u| {
                build.bindings(
                    &shader,
                    vec![
                        Binding::Uniform(u),
                        Binding::Storage(&canvas.radiance),
                        Binding::Storage(&canvas.mean),
                        Binding::Storage(&canvas.display),
                    ],
                )
            })
            .collect();
        let sets =
            DescriptorSets::new(device, "resolve", vk::ShaderStageFlags::COMPUTE, &bindings)?;
        let pipeline =
            |encode| ComputePipeline::new(device, &shader, &sets, 0, &constants(encode, history));
        let pipelines = [pipeline(false)?, pipeline(true)?];
        Ok(ResolvePass {
            sets,
            pipelines,
            size: canvas.mean.size(),
        })
    }

    /// Adds the frame to the mean, and with `encode` writes the display image.
    pub fn record(&self, commands: vk::CommandBuffer, slot: usize, encode: bool) {
        let pipeline = &self.pipelines[usize::from(encode)];
        pipeline.bind(commands, &self.sets, slot);
        pipeline.dispatch_8x8(commands, self.size);
    }
}

/// The values of the specialisation constants of `resolve.comp`.
pub fn constants(encode: bool, history: bool) -> [u32; 2] {
    [u32::from(encode), u32::from(history)]
}
