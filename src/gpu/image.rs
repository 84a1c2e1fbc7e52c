//! Two-dimensional images and samplers.

use std::sync::Arc;

use ash::vk;
use gpu_allocator::{MemoryLocation, vulkan::Allocation};

use super::{Device, Result, check, memory};

/// What an image is made of.
#[derive(Clone, Copy, Debug)]
pub struct ImageDesc {
    /// Width and height in texels.
    pub size: [u32; 2],
    /// Texel format.
    pub format: vk::Format,
    /// Every way it will be used.
    pub usage: vk::ImageUsageFlags,
}

/// An image of one level with its view and memory.
pub struct Image {
    pub(crate) raw: vk::Image,
    pub(crate) view: vk::ImageView,
    allocation: Option<Allocation>,
    desc: ImageDesc,
    device: Arc<Device>,
}

impl Image {
    /// Makes an image; its contents and layout are undefined.
    ///
    /// # Errors
    /// [`super::Error::OutOfMemory`] naming the image, or what the driver says.
    pub fn new(device: &Arc<Device>, name: &str, desc: ImageDesc) -> Result<Self> {
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(desc.format)
            .extent(vk::Extent3D {
                width: desc.size[0],
                height: desc.size[1],
                depth: 1,
            })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(desc.usage);
        // SAFETY: the device is alive; format and usage were queried with the candidate.
        let raw = check("vkCreateImage", unsafe {
            device.raw.create_image(&info, None)
        })?;
        // SAFETY: `raw` was made above.
        let requirements = unsafe { device.raw.get_image_memory_requirements(raw) };
        let mut image = Image {
            raw,
            view: vk::ImageView::null(),
            allocation: None,
            desc,
            device: Arc::clone(device),
        };
        let allocation =
            memory::allocate(device, name, requirements, MemoryLocation::GpuOnly, false)?;
        // SAFETY: the range was allocated for this image, which has no memory yet.
        let bound = unsafe {
            device
                .raw
                .bind_image_memory(raw, allocation.memory(), allocation.offset())
        };
        image.allocation = Some(allocation);
        check("vkBindImageMemory", bound)?;
        let view = vk::ImageViewCreateInfo::default()
            .image(raw)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(desc.format)
            .subresource_range(image.range());
        // SAFETY: the image is bound, and the view covers what it has.
        image.view = check("vkCreateImageView", unsafe {
            device.raw.create_image_view(&view, None)
        })?;
        device.name(raw, name);
        device.name(image.view, name);
        Ok(image)
    }

    /// Width and height in texels.
    pub fn size(&self) -> [u32; 2] {
        self.desc.size
    }

    /// Texel format.
    pub fn format(&self) -> vk::Format {
        self.desc.format
    }

    /// Depth or colour.
    pub(crate) fn aspect(&self) -> vk::ImageAspectFlags {
        if self.desc.format == vk::Format::D32_SFLOAT {
            vk::ImageAspectFlags::DEPTH
        } else {
            vk::ImageAspectFlags::COLOR
        }
    }

    /// All of it.
    pub(crate) fn range(&self) -> vk::ImageSubresourceRange {
        vk::ImageSubresourceRange {
            aspect_mask: self.aspect(),
            base_mip_level: 0,
            level_count: 1,
            base_array_layer: 0,
            layer_count: 1,
        }
    }

    /// The region that copies between all of it and a tightly packed buffer.
    pub(crate) fn whole_copy(&self) -> vk::BufferImageCopy {
        self.corner_copy(self.desc.size)
    }

    /// The region that copies between its first `size` texels and a tightly packed buffer.
    pub(crate) fn corner_copy(&self, size: [u32; 2]) -> vk::BufferImageCopy {
        vk::BufferImageCopy {
            image_subresource: vk::ImageSubresourceLayers {
                aspect_mask: self.aspect(),
                mip_level: 0,
                base_array_layer: 0,
                layer_count: 1,
            },
            image_extent: vk::Extent3D {
                width: size[0],
                height: size[1],
                depth: 1,
            },
            ..Default::default()
        }
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        // SAFETY: owners wait for the device's last use before they drop the image.
        unsafe {
            self.device.raw.destroy_image_view(self.view, None);
            self.device.raw.destroy_image(self.raw, None);
        }
        if let Some(allocation) = self.allocation.take() {
            memory::free(&self.device, allocation);
        }
    }
}

/// A sampler with a clamp-to-border address mode.
pub struct Sampler {
    pub(crate) raw: vk::Sampler,
    device: Arc<Device>,
}

impl Sampler {
    /// Makes a sampler without MIP levels.
    ///
    /// With `compare`, a tap returns the share of its texels for which `reference op texel` holds.
    ///
    /// # Errors
    /// What the driver says.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        filter: vk::Filter,
        border: vk::BorderColor,
        compare: Option<vk::CompareOp>,
    ) -> Result<Self> {
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(filter)
            .min_filter(filter)
            .mipmap_mode(vk::SamplerMipmapMode::NEAREST)
            .address_mode_u(vk::SamplerAddressMode::CLAMP_TO_BORDER)
            .address_mode_v(vk::SamplerAddressMode::CLAMP_TO_BORDER)
            .address_mode_w(vk::SamplerAddressMode::CLAMP_TO_BORDER)
            .border_color(border)
            .compare_enable(compare.is_some())
            .compare_op(compare.unwrap_or(vk::CompareOp::NEVER));
        // SAFETY: the device is alive.
        let raw = check("vkCreateSampler", unsafe {
            device.raw.create_sampler(&info, None)
        })?;
        device.name(raw, name);
        Ok(Sampler {
            raw,
            device: Arc::clone(device),
        })
    }
}

impl Drop for Sampler {
    fn drop(&mut self) {
        // SAFETY: owners wait for the device's last use before they drop the sampler.
        unsafe { self.device.raw.destroy_sampler(self.raw, None) };
    }
}
