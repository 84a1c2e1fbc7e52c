//! What the passes write and read: typed handles, so that signatures draw the graph.

use std::sync::Arc;

use ash::vk::{Format, ImageUsageFlags as U};

use crate::gpu::{self, Device, Image, ImageDesc};

/// The light map: what the light sees.
pub struct LightMap {
    /// D32 depth, nearest to the light wins.
    pub depth: Image,
    /// T0 = RGBA32F (w, w z, w z^2, w z^3), w = coverage * Ft, z normalised to [-1, 1].
    pub moments: Image,
}

impl LightMap {
    /// Makes a square map of `size` texels a side.
    pub fn new(device: &Arc<Device>, size: u32) -> gpu::Result<Self> {
        let image = |name, format, usage| {
            let usage = usage | U::SAMPLED | U::TRANSFER_SRC;
            Image::new(
                device,
                name,
                ImageDesc {
                    size: [size, size],
                    format,
                    usage,
                },
            )
        };
        Ok(LightMap {
            depth: image(
                "light depth",
                Format::D32_SFLOAT,
                U::DEPTH_STENCIL_ATTACHMENT,
            )?,
            moments: image(
                "light moments",
                Format::R32G32B32A32_SFLOAT,
                U::COLOR_ATTACHMENT,
            )?,
        })
    }
}

/// The box pyramid of the light map: level 0 is the map itself, MIP level k - 1 here is level k.
pub struct Boxes {
    /// RGBA32F means of 2x2 texels of the level above, down to 1x1.
    pub image: Image,
}

impl Boxes {
    /// Makes the pyramid over a map of `base` texels.
    pub fn new(device: &Arc<Device>, base: [u32; 2]) -> gpu::Result<Self> {
        let image = Image::with_all_levels(
            device,
            "light boxes",
            ImageDesc {
                size: base.map(|side| (side / 2).max(1)),
                format: Format::R32G32B32A32_SFLOAT,
                usage: U::STORAGE | U::SAMPLED | U::TRANSFER_SRC | U::TRANSFER_DST,
            },
        )?;
        Ok(Boxes { image })
    }
}

/// The G-buffer: what the camera sees.
pub struct GBuffer {
    /// D32 depth of the nearest back face: where the view ray first leaves the object.
    pub back: Image,
    /// D32 depth of the nearest surface; 1 where there is none.
    pub depth: Image,
    /// Octahedral shading normal, 16 bits a component.
    pub normal: Image,
}

impl GBuffer {
    /// Makes the G-buffer of a picture of `size` pixels.
    pub fn new(device: &Arc<Device>, size: [u32; 2]) -> gpu::Result<Self> {
        let image = |name, format, usage| {
            let usage = usage | U::INPUT_ATTACHMENT | U::SAMPLED | U::TRANSFER_SRC;
            Image::new(
                device,
                name,
                ImageDesc {
                    size,
                    format,
                    usage,
                },
            )
        };
        // SNORM keeps the normal to 2e-5 rad, half floats to 5e-4; the latter always exist.
        let normal = if device.candidate().snorm_normals {
            Format::R16G16_SNORM
        } else {
            Format::R16G16_SFLOAT
        };
        Ok(GBuffer {
            back: image(
                "back depth",
                Format::D32_SFLOAT,
                U::DEPTH_STENCIL_ATTACHMENT,
            )?,
            depth: image(
                "view depth",
                Format::D32_SFLOAT,
                U::DEPTH_STENCIL_ATTACHMENT,
            )?,
            normal: image("view normal", normal, U::COLOR_ATTACHMENT)?,
        })
    }
}

/// The picture on its way out.
pub struct Canvas {
    /// RGBA32F linear radiance of one frame, premultiplied by coverage.
    pub radiance: Image,
    /// RGBA32F running mean over the averaged frames.
    pub mean: Image,
    /// RGBA8, sRGB-encoded, straight alpha.
    pub display: Image,
}

impl Canvas {
    /// Makes the images of a picture of `size` pixels.
    pub fn new(device: &Arc<Device>, size: [u32; 2]) -> gpu::Result<Self> {
        let image = |name, format, usage| {
            let usage = usage | U::STORAGE | U::TRANSFER_SRC;
            Image::new(
                device,
                name,
                ImageDesc {
                    size,
                    format,
                    usage,
                },
            )
        };
        let float = Format::R32G32B32A32_SFLOAT;
        Ok(Canvas {
            radiance: image("radiance", float, U::COLOR_ATTACHMENT)?,
            mean: image("mean", float, U::empty())?,
            display: image("display", Format::R8G8B8A8_UNORM, U::empty())?,
        })
    }
}
