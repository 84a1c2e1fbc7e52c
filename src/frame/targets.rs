//! What the passes write and read: typed handles, so that signatures draw the graph.

use std::sync::Arc;

use std::ops::RangeInclusive;

use ash::vk::{self, Format, ImageUsageFlags as U};

use crate::gpu::{self, Buffer, Device, Image, ImageDesc, Location, RenderPass, Use, submit};
use crate::scene::pyramid::Atlas;
use crate::scene::volume::Volumes;

/// An image of `size` texels, of which nothing is known.
pub(super) fn image(
    device: &Arc<Device>,
    name: &str,
    size: [u32; 2],
    format: Format,
    usage: U,
) -> gpu::Result<Image> {
    let desc = ImageDesc {
        size,
        format,
        usage,
    };
    Image::new(device, name, desc)
}

/// The light map: what the light sees.
pub struct LightMap {
    /// D32 depth, nearest to the light wins.
    pub depth: Image,
    /// T0 = RGBA32F (w, w z, w z^2, w z^3), w = coverage * Ft, z normalised to [-1, 1].
    ///
    /// With a pyramid, T0 is level 0 at the corner of the image, and the others lie beside it.
    pub moments: Image,
    /// What else belongs to the pyramid of the moments.
    pub pyramid: Option<Pyramid>,
}

/// Which levels are made of a light map's moments.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PyramidDesc {
    /// The levels that are smoothed; the pyramid itself starts at level 0.
    pub levels: RangeInclusive<u32>,
    /// The levels of the fourth moment that are smoothed, if there is one.
    pub fourth: Option<RangeInclusive<u32>>,
}

/// The images of a pyramid besides the moments themselves, all laid out by one atlas.
///
/// They were cleared when they were made, and what lies between the levels stays 0: no barrier may
/// discard their contents.
pub struct Pyramid {
    /// Where the levels lie.
    pub atlas: Atlas,
    /// The levels that are smoothed.
    pub levels: RangeInclusive<u32>,
    /// RGBA32F, each level smoothed.
    pub smoothed: Image,
    /// The fourth moment, which has images of its own.
    pub fourth: Option<Fourth>,
}

/// The fourth moment w z^4 of a pyramid, R32F.
pub struct Fourth {
    /// The levels that are smoothed.
    pub levels: RangeInclusive<u32>,
    /// The pyramid.
    pub moments: Image,
    /// Each level smoothed.
    pub smoothed: Image,
}

impl LightMap {
    /// Makes a square map of `size` texels a side, with a pyramid if asked.
    pub fn new(
        device: &Arc<Device>,
        size: u32,
        pyramid: Option<&PyramidDesc>,
    ) -> gpu::Result<Self> {
        let own = |name, format, usage| {
            let usage = usage | U::SAMPLED | U::TRANSFER_SRC;
            image(device, name, [size, size], format, usage)
        };
        let (moments, pyramid) = match pyramid {
            None => {
                let format = Format::R32G32B32A32_SFLOAT;
                let usage = U::COLOR_ATTACHMENT | U::STORAGE;
                (own("light moments", format, usage)?, None)
            }
            Some(desc) => {
                let (moments, pyramid) = Self::with_levels(device, [size, size], desc)?;
                (moments, Some(pyramid))
            }
        };
        Ok(LightMap {
            depth: own(
                "light depth",
                Format::D32_SFLOAT,
                U::DEPTH_STENCIL_ATTACHMENT,
            )?,
            moments,
            pyramid,
        })
    }

    /// Makes the moments of a map of `size` texels with room for levels, and what belongs to them;
    /// all 0, and as a frame leaves them.
    pub fn with_levels(
        device: &Arc<Device>,
        size: [u32; 2],
        desc: &PyramidDesc,
    ) -> gpu::Result<(Image, Pyramid)> {
        let atlas = Atlas::new(size, desc.levels.end() + 1);
        let own = |name, format, usage| {
            let usage = usage | U::SAMPLED | U::STORAGE | U::TRANSFER_SRC | U::TRANSFER_DST;
            image(device, name, atlas.size, format, usage)
        };
        let all = Format::R32G32B32A32_SFLOAT;
        let moments = own("light moments", all, U::COLOR_ATTACHMENT)?;
        let smoothed = own("light smoothed", all, U::empty())?;
        let one = Format::R32_SFLOAT;
        let fourth = match &desc.fourth {
            Some(levels) => Some(Fourth {
                levels: levels.clone(),
                moments: own("light fourth moment", one, U::COLOR_ATTACHMENT)?,
                smoothed: own("light fourth moment, smoothed", one, U::empty())?,
            }),
            None => None,
        };
        let mut states = vec![
            (&moments, Use::FRAGMENT_SAMPLE),
            (&smoothed, Use::FRAGMENT_SAMPLE),
        ];
        if let Some(fourth) = &fourth {
            states.push((&fourth.moments, Use::FRAGMENT_SAMPLE));
            states.push((&fourth.smoothed, Use::FRAGMENT_SAMPLE));
        }
        submit::clear_images(device, &states)?;
        let pyramid = Pyramid {
            atlas,
            levels: desc.levels.clone(),
            smoothed,
            fourth,
        };
        Ok((moments, pyramid))
    }
}

/// Light in space: its grids, and the volumes that are blurred from them.
pub struct Light {
    /// Where the cells lie.
    pub desc: Volumes,
    /// The cells of all grids, f32.
    pub grids: Buffer,
    /// Cells of all volumes between one axis of the blur and the next; the last leaves the volumes in the
    /// first of them.
    pub steps: [Buffer; 2],
    /// R32F: all volumes. What lies between them stays 0.
    pub image: Image,
}

impl Light {
    /// Makes buffers and image for `desc`; the image is 0, and as a frame leaves it.
    pub fn new(device: &Arc<Device>, desc: &Volumes) -> gpu::Result<Self> {
        use ash::vk::BufferUsageFlags as B;
        let buffer = |name, cells: u64, usage| {
            let usage = B::STORAGE_BUFFER | usage;
            Buffer::new(device, name, 4 * cells, usage, Location::Device)
        };
        let [columns, rows, slices] = desc.image;
        let image = Image::solid(
            device,
            "volumes",
            ImageDesc {
                size: [columns, rows],
                format: Format::R32_SFLOAT,
                usage: U::SAMPLED | U::TRANSFER_SRC | U::TRANSFER_DST,
            },
            slices,
        )?;
        submit::clear_images(device, &[(&image, Use::FRAGMENT_SAMPLE)])?;
        Ok(Light {
            grids: buffer("light grids", desc.light_cells(), B::empty())?,
            steps: [
                buffer("volumes, first step", desc.cells(), B::TRANSFER_SRC)?,
                buffer("volumes, second step", desc.cells(), B::empty())?,
            ],
            image,
            desc: desc.clone(),
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
    /// Octahedral normal of that face, turned to the viewer, 16 bits a component.
    pub back_normal: Image,
    /// D32 depth of the nearest surface; 1 where there is none.
    pub depth: Image,
    /// Octahedral shading normal, 16 bits a component.
    pub normal: Image,
}

impl GBuffer {
    /// Makes the G-buffer of a picture of `size` pixels; `prefix` begins the names of its images.
    pub fn new(device: &Arc<Device>, prefix: &str, size: [u32; 2]) -> gpu::Result<Self> {
        let own = |name, format, usage| {
            let usage = usage | U::INPUT_ATTACHMENT | U::SAMPLED | U::TRANSFER_SRC;
            image(device, &format!("{prefix}{name}"), size, format, usage)
        };
        // SNORM keeps the normal to 2e-5 rad, half floats to 5e-4; the latter always exist.
        let normal = if device.candidate().snorm_normals {
            Format::R16G16_SNORM
        } else {
            Format::R16G16_SFLOAT
        };
        Ok(GBuffer {
            back: own(
                "back depth",
                Format::D32_SFLOAT,
                U::DEPTH_STENCIL_ATTACHMENT,
            )?,
            depth: own(
                "view depth",
                Format::D32_SFLOAT,
                U::DEPTH_STENCIL_ATTACHMENT,
            )?,
            back_normal: own("back normal", normal, U::COLOR_ATTACHMENT)?,
            normal: own("view normal", normal, U::COLOR_ATTACHMENT)?,
        })
    }
}

/// RG32F motion: where the surface of a pixel was in the frame before, minus where it is, pixels; 0 where there is none.
/// Half floats would be a quarter of a pixel off beyond 512 pixels, as things move in pictures 16384 wide.
pub fn motion(device: &Arc<Device>, size: [u32; 2]) -> gpu::Result<Image> {
    image(
        device,
        "motion",
        size,
        Format::R32G32_SFLOAT,
        U::COLOR_ATTACHMENT | U::SAMPLED | U::TRANSFER_SRC,
    )
}

/// The picture on its way out.
pub struct Canvas {
    /// RGBA32F linear radiance of one frame, premultiplied by coverage.
    pub radiance: Image,
    /// RGBA32F running mean over the averaged frames, which write them in turn.
    pub means: [Image; 2],
    /// RGBA8, sRGB-encoded, straight alpha.
    pub display: Image,
}

impl Canvas {
    /// Makes the images of a picture of `size` pixels.
    pub fn new(device: &Arc<Device>, size: [u32; 2]) -> gpu::Result<Self> {
        let own = |name, format, usage| {
            let usage = usage | U::COLOR_ATTACHMENT | U::TRANSFER_SRC;
            image(device, name, size, format, usage)
        };
        let float = Format::R32G32B32A32_SFLOAT;
        Ok(Canvas {
            // `exact` adds to it in compute.
            radiance: own("radiance", float, U::SAMPLED | U::STORAGE)?,
            means: [
                own("mean 0", float, U::SAMPLED)?,
                own("mean 1", float, U::SAMPLED)?,
            ],
            display: own("display", Format::R8G8B8A8_UNORM, U::SAMPLED)?,
        })
    }
}

/// RGBA32F linear radiance of what is scattered, and its distance along the optical axis, 0 where
/// nothing is seen, in a picture of `size` pixels.
pub fn scattered(device: &Arc<Device>, size: [u32; 2]) -> gpu::Result<Image> {
    image(
        device,
        "half radiance",
        size,
        Format::R32G32B32A32_SFLOAT,
        U::COLOR_ATTACHMENT | U::SAMPLED | U::TRANSFER_SRC,
    )
}

/// A pass that writes every pixel of `images`, whatever they held.
pub fn overwriting_pass(
    device: &Arc<Device>,
    name: &str,
    images: &[&Image],
) -> gpu::Result<RenderPass> {
    let layout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
    let attachments: Vec<_> = images
        .iter()
        .map(|image| {
            vk::AttachmentDescription::default()
                .format(image.format())
                .samples(vk::SampleCountFlags::TYPE_1)
                .load_op(vk::AttachmentLoadOp::DONT_CARE)
                .store_op(vk::AttachmentStoreOp::STORE)
                .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
                .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
                // The same before and after: transitions are barriers on the frame's page.
                .initial_layout(layout)
                .final_layout(layout)
        })
        .collect();
    let colors: Vec<_> = (0..images.len() as u32)
        .map(|attachment| vk::AttachmentReference { attachment, layout })
        .collect();
    let subpasses = [vk::SubpassDescription::default()
        .pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS)
        .color_attachments(&colors)];
    let info = vk::RenderPassCreateInfo::default()
        .attachments(&attachments)
        .subpasses(&subpasses);
    RenderPass::new(device, name, &info, images)
}
