//! Three ways to build the box pyramid, each with its barriers, apart from the frame: for tests
//! and benchmarks. The frame uses [`Way::Levels`].

use std::sync::Arc;

use ash::vk;

use super::boxes::BoxesPass;
use super::fetches::Build;
use super::shaders;
use super::targets::Boxes;
use crate::gpu::{
    self, Binding, Buffer, ComputePipeline, DescriptorSets, Device, Image, ImageDesc, Location,
    Sampler, Slot, Use, barrier, submit,
};

/// How the box pyramid is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// One dispatch a level, with a barrier between them.
    Levels,
    /// One dispatch in all: tiles in shared memory, the last workgroup finishes. For bases of at
    /// most [`SHARED_SIDE`] texels a side.
    Shared,
    /// One filtered `vkCmdBlitImage` a level, with a barrier between them.
    Blit,
}

impl Way {
    /// Every way.
    pub const ALL: [Way; 3] = [Way::Levels, Way::Shared, Way::Blit];
}

/// The largest side of a base that [`Way::Shared`] takes: two passes over tiles of 64.
pub const SHARED_SIDE: u32 = 4096;

/// The levels that `boxes_shared.comp` names, 1 to 12.
const SHARED_LEVELS: u32 = 12;

/// A base and the pyramid over it, with what builds it in one of the ways.
pub(super) struct Chain {
    recorder: Recorder,
    base: Image,
    boxes: Boxes,
    device: Arc<Device>,
}

enum Recorder {
    Levels(BoxesPass),
    Shared(Shared),
    Blit,
}

impl Chain {
    /// Prepares `way` over `base`, which is `size` texels, row-major.
    ///
    /// Refused with [`gpu::Error::Unsupported`] where device or size do not suit the way.
    pub fn new(
        device: &Arc<Device>,
        way: Way,
        size: [u32; 2],
        base: &[[f32; 4]],
    ) -> gpu::Result<Self> {
        refuse(device, way, size, base)?;
        use vk::ImageUsageFlags as U;
        let image = Image::new(
            device,
            "base",
            ImageDesc {
                size,
                format: vk::Format::R32G32B32A32_SFLOAT,
                usage: U::SAMPLED | U::STORAGE | U::TRANSFER_SRC | U::TRANSFER_DST,
            },
        )?;
        let boxes = Boxes::new(device, size)?;
        let recorder = match way {
            Way::Levels => Recorder::Levels(BoxesPass::new(device, &image, &boxes, Build::Plain)?),
            Way::Shared => Recorder::Shared(Shared::new(device, &image, &boxes)?),
            Way::Blit => Recorder::Blit,
        };
        let read = match way {
            Way::Levels => Use::COMPUTE_STORAGE,
            Way::Shared => Use::COMPUTE_SAMPLE,
            Way::Blit => Use::BLIT_SOURCE,
        };
        submit::upload_image(device, &image, bytemuck::cast_slice(base), read)?;
        Ok(Chain {
            recorder,
            base: image,
            boxes,
            device: Arc::clone(device),
        })
    }

    /// Builds the pyramid anew and leaves all of it ready to be sampled by compute.
    #[rustfmt::skip] // A barrier is read as a sentence.
    pub fn record(&self, commands: vk::CommandBuffer) {
        let (device, boxes) = (&*self.device, &self.boxes.image);
        let all = boxes.levels();
        match &self.recorder {
            Recorder::Levels(pass) => {
                barrier::image(
                    device, commands, c"WAR: the pyramid before this one was read",
                    boxes, Use::COMPUTE_SAMPLE.discarding(), Use::COMPUTE_STORAGE,
                );
                for level in 0..all {
                    if level > 0 {
                        barrier::levels(
                            device, commands, c"RAW: each level is made from the one before",
                            boxes, level - 1..level, Use::COMPUTE_STORAGE, Use::COMPUTE_STORAGE,
                        );
                    }
                    pass.record_level(commands, level);
                }
                barrier::image(
                    device, commands, c"RAW: whoever samples reads the pyramid",
                    boxes, Use::COMPUTE_STORAGE, Use::COMPUTE_SAMPLE,
                );
            }
            Recorder::Shared(shared) => {
                barrier::image(
                    device, commands, c"WAR: the pyramid before this one was read",
                    boxes, Use::COMPUTE_SAMPLE.discarding(), Use::COMPUTE_STORAGE,
                );
                barrier::buffer(
                    device, commands, c"RAW, WAW: the build before this one has reset the count",
                    &shared.finished, Use::COPY_TARGET.and(Use::COMPUTE_STORAGE), Use::COMPUTE_STORAGE,
                );
                shared.record(commands);
                barrier::image(
                    device, commands, c"RAW: whoever samples reads the pyramid",
                    boxes, Use::COMPUTE_STORAGE, Use::COMPUTE_SAMPLE,
                );
            }
            Recorder::Blit => {
                barrier::image(
                    device, commands, c"WAR: the pyramid before this one was read",
                    boxes, Use::COMPUTE_SAMPLE.discarding(), Use::BLIT_TARGET,
                );
                let (mut source, mut size) = ((&self.base, 0), self.base.size());
                for level in 0..all {
                    let half = boxes.level_size(level);
                    // The even part: an odd last row or column would shift the taps.
                    let even = [0, 1].map(|axis| (2 * half[axis]).min(size[axis]));
                    submit::record_blit(device, commands, source, even, (boxes, level));
                    let next = if level + 1 < all { Use::BLIT_SOURCE } else { Use::COMPUTE_SAMPLE };
                    barrier::levels(
                        device, commands, c"RAW: the next level, or who samples, reads this one",
                        boxes, level..level + 1, Use::BLIT_TARGET, next,
                    );
                    (source, size) = ((boxes, level), half);
                }
                if all > 1 {
                    barrier::levels(
                        device, commands, c"RAW: whoever samples reads the levels that were blitted from",
                        boxes, 0..all - 1, Use::BLIT_SOURCE, Use::COMPUTE_SAMPLE,
                    );
                }
            }
        }
    }
}

/// Says why `way` cannot be used, where it cannot.
fn refuse(device: &Device, way: Way, size: [u32; 2], base: &[[f32; 4]]) -> gpu::Result<()> {
    let (candidate, [width, height]) = (device.candidate(), size);
    let refused = |message: String| Err(gpu::Error::Unsupported(message));
    if width == 0 || height == 0 || base.len() as u64 != u64::from(width) * u64::from(height) {
        return refused(format!(
            "a base of {width}x{height} texels cannot have {} of them",
            base.len()
        ));
    }
    let name = &candidate.name;
    match way {
        Way::Blit if !candidate.blit_float32 || !candidate.linear_floats => refused(format!(
            "{name} cannot blit RGBA32F images with a linear filter"
        )),
        Way::Shared if width.max(height) > SHARED_SIDE => refused(format!(
            "one dispatch reduces at most {SHARED_SIDE} texels a side, not {width}x{height}"
        )),
        Way::Shared if candidate.limits.max_per_stage_descriptor_storage_images < SHARED_LEVELS => {
            refused(format!(
                "{name} binds {} storage images at once, and the {SHARED_LEVELS} levels need \
                 {SHARED_LEVELS}",
                candidate.limits.max_per_stage_descriptor_storage_images
            ))
        }
        _ => Ok(()),
    }
}

/// The single dispatch. Shader `boxes_shared.comp`.
struct Shared {
    sets: DescriptorSets,
    pipeline: ComputePipeline,
    groups: [u32; 2],
    finished: Buffer,
    // Referred to by the set.
    _sampler: Sampler,
}

impl Shared {
    fn new(device: &Arc<Device>, base: &Image, boxes: &Boxes) -> gpu::Result<Self> {
        let sampler = Sampler::new(
            device,
            "texels",
            vk::Filter::NEAREST,
            vk::BorderColor::FLOAT_TRANSPARENT_BLACK,
            None,
        )?;
        let finished = submit::upload_buffer(
            device,
            "finished",
            &[0; 4],
            vk::BufferUsageFlags::STORAGE_BUFFER,
            Use::COMPUTE_STORAGE,
        )?;
        let image = &boxes.image;
        let mut bindings = vec![
            Binding::Sampled(base, &sampler),
            Binding::StorageBuffer(&finished),
        ];
        // Levels that the pyramid has not are never written; their place is taken by the last.
        bindings.extend(
            (0..SHARED_LEVELS).map(|l| Binding::StorageLevel(image, l.min(image.levels() - 1))),
        );
        let sets = DescriptorSets::new(
            device,
            "boxes shared",
            vk::ShaderStageFlags::COMPUTE,
            &[bindings],
        )?;
        let shader = &shaders::BOXES_SHARED_COMP;
        let pipeline = ComputePipeline::new(device, shader, &sets, 0, &[image.levels()])?;
        Ok(Shared {
            sets,
            pipeline,
            // A workgroup makes 32x32 texels of the first level.
            groups: image.size().map(|side| side.div_ceil(32)),
            finished,
            _sampler: sampler,
        })
    }

    fn record(&self, commands: vk::CommandBuffer) {
        self.pipeline.bind(commands, &self.sets, 0);
        self.pipeline.dispatch(commands, self.groups);
    }
}

/// Size and texels of a level, row-major.
pub type LevelTexels = ([u32; 2], Vec<[f32; 4]>);

/// Builds the box pyramid over `base`, which is `size` texels, row-major, in one way; returns
/// levels 1 to the last. For tests and benchmarks: a frame does not go through the host.
///
/// It is the third of three builds in one submit. Between the first two the layer sees what may
/// race from one build to the next; before the third, what they have left is overwritten with
/// what is not a number, so that a test sees a texel that a build leaves out or takes too early.
///
/// # Errors
/// [`gpu::Error::Unsupported`] where device or size do not suit the way, or what the driver says.
pub fn boxes_alone(
    device: &Arc<Device>,
    way: Way,
    size: [u32; 2],
    base: &[[f32; 4]],
) -> gpu::Result<Vec<LevelTexels>> {
    let chain = Chain::new(device, way, size, base)?;
    let image = &chain.boxes.image;
    let buffers = (0..image.levels())
        .map(|level| {
            let [width, height] = image.level_size(level);
            Buffer::new(
                device,
                "level readback",
                16 * u64::from(width) * u64::from(height),
                vk::BufferUsageFlags::TRANSFER_DST,
                Location::Readback,
            )
        })
        .collect::<gpu::Result<Vec<_>>>()?;
    let mut slot = Slot::new(device, "boxes alone")?;
    let commands = slot.begin()?;
    chain.record(commands);
    chain.record(commands);
    barrier::image(
        device,
        commands,
        c"WAR: the pyramid is sampled before it is overwritten",
        image,
        Use::COMPUTE_SAMPLE.discarding(),
        Use::CLEAR_TARGET,
    );
    submit::record_clear(device, commands, image, [f32::NAN; 4]);
    barrier::image(
        device,
        commands,
        c"RAW: the next build finds what is not a number",
        image,
        Use::CLEAR_TARGET,
        Use::COMPUTE_SAMPLE,
    );
    chain.record(commands);
    barrier::image(
        device,
        commands,
        c"RAW: the copies read the pyramid",
        image,
        Use::COMPUTE_SAMPLE,
        Use::COPY_SOURCE,
    );
    for (level, buffer) in (0..).zip(&buffers) {
        submit::record_level_readback(device, commands, image, level, buffer);
    }
    slot.submit()?;
    slot.wait()?;
    (0..)
        .zip(&buffers)
        .map(|(level, buffer)| {
            let texels = bytemuck::pod_collect_to_vec(buffer.read()?);
            Ok((image.level_size(level), texels))
        })
        .collect()
}
