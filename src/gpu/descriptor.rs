//! Descriptor sets, written whole when they are made and never after.

use std::hash::Hash;
use std::sync::Arc;

use ash::vk;

use super::{Buffer, Device, Image, Sampler, check};

/// What one binding of a set refers to; its place in the list is its binding number.
#[derive(Clone, Copy)]
pub enum Binding<'a> {
    /// A uniform buffer, all of it.
    Uniform(&'a Buffer),
    /// An image read through a sampler.
    Sampled(&'a Image, &'a Sampler),
    /// A storage image of one level.
    Storage(&'a Image),
    /// One MIP level of an image as a storage image.
    StorageLevel(&'a Image, u32),
    /// A storage buffer, all of it.
    StorageBuffer(&'a Buffer),
    /// An input attachment.
    Input(&'a Image),
    /// Nothing: the number is left out.
    Unused,
}

impl Binding<'_> {
    fn kind(&self) -> Option<vk::DescriptorType> {
        Some(match self {
            Binding::Unused => return None,
            Binding::Uniform(_) => vk::DescriptorType::UNIFORM_BUFFER,
            Binding::Sampled(..) => vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
            Binding::Storage(_) | Binding::StorageLevel(..) => vk::DescriptorType::STORAGE_IMAGE,
            Binding::StorageBuffer(_) => vk::DescriptorType::STORAGE_BUFFER,
            Binding::Input(_) => vk::DescriptorType::INPUT_ATTACHMENT,
        })
    }

    fn image(&self) -> Option<vk::DescriptorImageInfo> {
        let read_only = |image: &Image| {
            if image.aspect() == vk::ImageAspectFlags::DEPTH {
                vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL
            } else {
                vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL
            }
        };
        let (none, general) = (vk::Sampler::null(), vk::ImageLayout::GENERAL);
        let (view, layout, sampler) = match self {
            Binding::Uniform(_) | Binding::StorageBuffer(_) | Binding::Unused => return None,
            Binding::Sampled(image, sampler) => (image.view, read_only(image), sampler.raw),
            Binding::Storage(image) => (image.view, general, none),
            Binding::StorageLevel(image, level) => (image.level_view(*level), general, none),
            Binding::Input(image) => (image.view, read_only(image), none),
        };
        Some(vk::DescriptorImageInfo {
            sampler,
            image_view: view,
            image_layout: layout,
        })
    }
}

/// Sets of one layout, one for each frame in flight.
pub struct DescriptorSets {
    pub(crate) layout: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
    sets: Vec<vk::DescriptorSet>,
    kinds: Vec<Option<vk::DescriptorType>>,
    stages: vk::ShaderStageFlags,
    device: Arc<Device>,
}

impl DescriptorSets {
    /// Makes and writes as many sets as `sets` lists; all must have bindings of the same kinds.
    ///
    /// # Errors
    /// What the driver says.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        stages: vk::ShaderStageFlags,
        sets: &[Vec<Binding<'_>>],
    ) -> super::Result<Self> {
        let kinds: Vec<_> = sets
            .first()
            .map(|set| set.iter().map(Binding::kind).collect())
            .unwrap_or_default();
        debug_assert!(
            sets.iter()
                .all(|s| s.iter().map(Binding::kind).eq(kinds.iter().copied()))
        );
        let bindings: Vec<_> = (0..)
            .zip(&kinds)
            .filter_map(|(i, &kind)| Some((i, kind?)))
            .map(|(i, kind)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(i)
                    .descriptor_type(kind)
                    .descriptor_count(1)
                    .stage_flags(stages)
            })
            .collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: the device is alive.
        let layout = check("vkCreateDescriptorSetLayout", unsafe {
            device.raw.create_descriptor_set_layout(&info, None)
        })?;
        // Owned from here on, so that an early return below leaks nothing.
        let mut made = DescriptorSets {
            layout,
            pool: vk::DescriptorPool::null(),
            sets: Vec::new(),
            kinds,
            stages,
            device: Arc::clone(device),
        };
        device.name(layout, name);

        let count = sets.len() as u32;
        let sizes: Vec<_> = made
            .kinds
            .iter()
            .flatten()
            .map(|&ty| vk::DescriptorPoolSize {
                ty,
                descriptor_count: count,
            })
            .collect();
        let info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(count)
            .pool_sizes(&sizes);
        // SAFETY: the device is alive.
        made.pool = check("vkCreateDescriptorPool", unsafe {
            device.raw.create_descriptor_pool(&info, None)
        })?;
        device.name(made.pool, name);
        let layouts = vec![layout; sets.len()];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(made.pool)
            .set_layouts(&layouts);
        // SAFETY: pool and layouts were made above.
        made.sets = check("vkAllocateDescriptorSets", unsafe {
            device.raw.allocate_descriptor_sets(&info)
        })?;
        for (&set, bindings) in made.sets.iter().zip(sets) {
            device.name(set, name);
            for (i, binding) in (0..).zip(bindings) {
                let Some(kind) = binding.kind() else {
                    continue;
                };
                let image = binding.image().map(|info| [info]);
                let buffer = match binding {
                    Binding::Uniform(buffer) | Binding::StorageBuffer(buffer) => {
                        Some([vk::DescriptorBufferInfo {
                            buffer: buffer.raw,
                            offset: 0,
                            range: vk::WHOLE_SIZE,
                        }])
                    }
                    _ => None,
                };
                let mut write = vk::WriteDescriptorSet::default()
                    .dst_set(set)
                    .dst_binding(i)
                    .descriptor_type(kind);
                if let Some(image) = &image {
                    write = write.image_info(image);
                }
                if let Some(buffer) = &buffer {
                    write = write.buffer_info(buffer);
                }
                // SAFETY: the set is new and unused; what it refers to is alive.
                unsafe { device.raw.update_descriptor_sets(&[write], &[]) };
            }
        }
        Ok(made)
    }

    /// Whether the sets have a binding of this number.
    pub(crate) fn has(&self, number: u32) -> bool {
        self.kinds.get(number as usize).copied().flatten().is_some()
    }

    /// What sets have in common whose pipelines can be used for each other: their layouts are defined identically.
    pub(super) fn signature(&self) -> impl Hash {
        (self.stages, &self.kinds)
    }

    /// The set of frame slot `slot`.
    pub fn set(&self, slot: usize) -> vk::DescriptorSet {
        self.sets[slot % self.sets.len()]
    }
}

impl Drop for DescriptorSets {
    fn drop(&mut self) {
        // SAFETY: owners wait for the device's last use; destroying the pool frees its sets.
        unsafe {
            self.device.raw.destroy_descriptor_pool(self.pool, None);
            self.device
                .raw
                .destroy_descriptor_set_layout(self.layout, None);
        }
    }
}
