//! Images of two and three dimensions, and samplers.

use std::ops::Range;
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

/// An image with its MIP levels, views and memory.
pub struct Image {
    pub(crate) raw: vk::Image,
    /// Of all levels.
    pub(crate) view: vk::ImageView,
    /// Of each level alone; empty where there is but one.
    level_views: Vec<vk::ImageView>,
    levels: u32,
    /// Slices of an image of three dimensions.
    depth: Option<u32>,
    allocation: Option<Allocation>,
    // Whether somebody else destroys it.
    borrowed: bool,
    desc: ImageDesc,
    device: Arc<Device>,
}

impl Image {
    /// Makes an image of one level; its contents and layout are undefined.
    ///
    /// # Errors
    /// [`super::Error::OutOfMemory`] naming the image, or what the driver says.
    pub fn new(device: &Arc<Device>, name: &str, desc: ImageDesc) -> Result<Self> {
        Self::with_levels(device, name, desc, 1, None)
    }

    /// Makes an image of three dimensions with `depth` slices, as [`Image::new`].
    ///
    /// # Errors
    /// As [`Image::new`].
    pub fn solid(device: &Arc<Device>, name: &str, desc: ImageDesc, depth: u32) -> Result<Self> {
        Self::with_levels(device, name, desc, 1, Some(depth))
    }

    /// Makes an image with every MIP level down to 1x1, as [`Image::new`].
    ///
    /// # Errors
    /// As [`Image::new`].
    pub fn with_all_levels(device: &Arc<Device>, name: &str, desc: ImageDesc) -> Result<Self> {
        let levels = 1 + desc.size[0].max(desc.size[1]).max(1).ilog2();
        Self::with_levels(device, name, desc, levels, None)
    }

    /// Makes a view of an image that belongs to somebody else, who keeps it for longer.
    ///
    /// # Errors
    /// What the driver says.
    pub(super) fn borrowed(
        device: &Arc<Device>,
        name: &str,
        raw: vk::Image,
        desc: ImageDesc,
    ) -> Result<Self> {
        let mut image = Image {
            raw,
            view: vk::ImageView::null(),
            level_views: Vec::new(),
            levels: 1,
            depth: None,
            allocation: None,
            borrowed: true,
            desc,
            device: Arc::clone(device),
        };
        device.name(raw, name);
        image.view = image.new_view(image.range())?;
        device.name(image.view, name);
        Ok(image)
    }

    fn with_levels(
        device: &Arc<Device>,
        name: &str,
        desc: ImageDesc,
        levels: u32,
        depth: Option<u32>,
    ) -> Result<Self> {
        let kind = match depth {
            Some(_) => vk::ImageType::TYPE_3D,
            None => vk::ImageType::TYPE_2D,
        };
        let info = vk::ImageCreateInfo::default()
            .image_type(kind)
            .format(desc.format)
            .extent(vk::Extent3D {
                width: desc.size[0],
                height: desc.size[1],
                depth: depth.unwrap_or(1),
            })
            .mip_levels(levels)
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
            level_views: Vec::new(),
            levels,
            depth,
            allocation: None,
            borrowed: false,
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
        device.name(raw, name);
        image.view = image.new_view(image.range())?;
        device.name(image.view, name);
        if levels > 1 {
            for level in 0..levels {
                let view = image.new_view(image.levels_range(level..level + 1))?;
                image.level_views.push(view);
                device.name(view, &format!("{name} {level}"));
            }
        }
        Ok(image)
    }

    fn new_view(&self, range: vk::ImageSubresourceRange) -> Result<vk::ImageView> {
        let view = vk::ImageViewCreateInfo::default()
            .image(self.raw)
            .view_type(match self.depth {
                Some(_) => vk::ImageViewType::TYPE_3D,
                None => vk::ImageViewType::TYPE_2D,
            })
            .format(self.desc.format)
            .subresource_range(range);
        // SAFETY: the image is bound, and the view covers levels that it has.
        check("vkCreateImageView", unsafe {
            self.device.raw.create_image_view(&view, None)
        })
    }

    /// Width and height in texels.
    pub fn size(&self) -> [u32; 2] {
        self.desc.size
    }

    /// How many slices it has, 1 where it has two dimensions.
    pub fn depth(&self) -> u32 {
        self.depth.unwrap_or(1)
    }

    /// How many MIP levels it has.
    pub fn levels(&self) -> u32 {
        self.levels
    }

    /// Width and height of MIP level `level`: halved and rounded down, but never below 1.
    pub fn level_size(&self, level: u32) -> [u32; 2] {
        self.desc.size.map(|side| (side >> level).max(1))
    }

    /// The view of MIP level `level` alone.
    pub(crate) fn level_view(&self, level: u32) -> vk::ImageView {
        self.level_views
            .get(level as usize)
            .copied()
            .unwrap_or(self.view)
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
        self.levels_range(0..self.levels)
    }

    /// Some of its MIP levels.
    pub(crate) fn levels_range(&self, levels: Range<u32>) -> vk::ImageSubresourceRange {
        vk::ImageSubresourceRange {
            aspect_mask: self.aspect(),
            base_mip_level: levels.start,
            level_count: levels.end - levels.start,
            base_array_layer: 0,
            layer_count: 1,
        }
    }

    /// One of its MIP levels, as copies and blits name it.
    pub(crate) fn layers(&self, level: u32) -> vk::ImageSubresourceLayers {
        vk::ImageSubresourceLayers {
            aspect_mask: self.aspect(),
            mip_level: level,
            base_array_layer: 0,
            layer_count: 1,
        }
    }

    /// The region that copies between all of a MIP level and a tightly packed buffer.
    pub(crate) fn level_copy(&self, level: u32) -> vk::BufferImageCopy {
        self.copy_of(level, self.level_size(level))
    }

    /// The region that copies between its first `size` texels and a tightly packed buffer.
    pub(crate) fn corner_copy(&self, size: [u32; 2]) -> vk::BufferImageCopy {
        self.copy_of(0, size)
    }

    fn copy_of(&self, level: u32, [width, height]: [u32; 2]) -> vk::BufferImageCopy {
        vk::BufferImageCopy {
            image_subresource: self.layers(level),
            image_extent: vk::Extent3D {
                width,
                height,
                depth: self.depth(),
            },
            ..Default::default()
        }
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        // SAFETY: owners wait for the device's last use before they drop the image.
        unsafe {
            for &view in self.level_views.iter().chain([&self.view]) {
                self.device.raw.destroy_image_view(view, None);
            }
            if !self.borrowed {
                self.device.raw.destroy_image(self.raw, None);
            }
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
    /// Makes a sampler that takes the nearest MIP level.
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
            .max_lod(vk::LOD_CLAMP_NONE)
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
