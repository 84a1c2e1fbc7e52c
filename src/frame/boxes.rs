//! The boxes pass: the plain MIP pyramid of the light map, one dispatch a level.
//!
//! Shader `boxes.comp`; CPU twin [`crate::cpu::boxes`].

use std::sync::Arc;

use ash::vk;

use super::fetches::Build;
use super::shaders;
use super::targets::Boxes;
use crate::gpu::{self, Binding, ComputePipeline, DescriptorSets, Device, Image};

/// Texels that a workgroup makes, all in one row.
const GROUP: u32 = 64;

/// The pass that means 2x2 texels of each level into one of the next.
pub struct BoxesPass {
    // One for each level: no frame in flight has anything of its own here.
    sets: DescriptorSets,
    pipeline: ComputePipeline,
    sizes: Vec<[u32; 2]>,
}

impl BoxesPass {
    /// Prepares the pass from `base`, which is level 0 and a storage image, to `boxes`.
    ///
    /// Levels are read as storage images: on llvmpipe that takes three quarters of the time of
    /// four texel fetches, and five sixths of that of a bilinear tap.
    pub fn new(
        device: &Arc<Device>,
        base: &Image,
        boxes: &Boxes,
        build: Build<'_>,
    ) -> gpu::Result<Self> {
        let shader = build.shader(&shaders::BOXES_COMP);
        let image = &boxes.image;
        let bindings: Vec<_> = (0..image.levels())
            .map(|level| {
                let above = match level {
                    0 => Binding::Storage(base),
                    _ => Binding::StorageLevel(image, level - 1),
                };
                build.bindings(&shader, vec![above, Binding::StorageLevel(image, level)])
            })
            .collect();
        let sets = DescriptorSets::new(device, "boxes", vk::ShaderStageFlags::COMPUTE, &bindings)?;
        let pipeline = ComputePipeline::new(device, &shader, &sets, 0, &[])?;
        Ok(BoxesPass {
            sets,
            pipeline,
            sizes: (0..image.levels()).map(|l| image.level_size(l)).collect(),
        })
    }

    /// Makes MIP level `level` of the pyramid's image from the one before it, or the first from
    /// the base. All three are in [`gpu::Use::COMPUTE_STORAGE`] meanwhile.
    pub fn record_level(&self, commands: vk::CommandBuffer, level: u32) {
        let [width, height] = self.sizes[level as usize];
        self.pipeline.bind(commands, &self.sets, level as usize);
        self.pipeline
            .dispatch(commands, [width.div_ceil(GROUP), height]);
    }
}
