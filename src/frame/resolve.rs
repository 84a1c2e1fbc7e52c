//! The resolve pass: the running mean over jittered frames, tone mapped and encoded.
//!
//! Shader `resolve.comp`; CPU twin [`crate::cpu::resolve`].

use std::sync::Arc;

use ash::vk;

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
    /// Prepares the pass over `canvas`.
    pub fn new(device: &Arc<Device>, uniforms: &[Buffer], canvas: &Canvas) -> gpu::Result<Self> {
        let bindings: Vec<_> = uniforms
            .iter()
            .map(|u| {
                vec![
                    Binding::Uniform(u),
                    Binding::Storage(&canvas.radiance),
                    Binding::Storage(&canvas.mean),
                    Binding::Storage(&canvas.display),
                ]
            })
            .collect();
        let sets =
            DescriptorSets::new(device, "resolve", vk::ShaderStageFlags::COMPUTE, &bindings)?;
        let pipeline =
            |encode| ComputePipeline::new(device, &shaders::RESOLVE_COMP, &sets, 0, &[encode]);
        let pipelines = [pipeline(0)?, pipeline(1)?];
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
