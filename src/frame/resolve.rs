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
    pipeline: ComputePipeline,
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
        let pipeline = ComputePipeline::new(device, &shaders::RESOLVE_COMP, &sets, 0, &[])?;
        Ok(ResolvePass {
            sets,
            pipeline,
            size: canvas.mean.size(),
        })
    }

    /// Adds the frame to the mean.
    pub fn record(&self, commands: vk::CommandBuffer, slot: usize) {
        self.pipeline.bind(commands, &self.sets, slot);
        self.pipeline.dispatch_8x8(commands, self.size);
    }
}
