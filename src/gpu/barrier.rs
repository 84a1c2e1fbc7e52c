//! Barriers, one visible line each.

use std::ffi::CStr;
use std::ops::Range;

use ash::vk;

use super::{Buffer, Device, Image};

/// One way an image or buffer is used: by which stage, for what, in which layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Use {
    stage: vk::PipelineStageFlags2,
    access: vk::AccessFlags2,
    /// The layout the use needs.
    pub layout: vk::ImageLayout,
}

macro_rules! uses {
    ($($(#[$doc:meta])* $name:ident = $stage:expr, $access:expr, $layout:ident;)*) => {
        impl Use { $($(#[$doc])* pub const $name: Use = Use {
            stage: $stage, access: $access, layout: vk::ImageLayout::$layout,
        };)* }
    };
}

use vk::{AccessFlags2 as A, PipelineStageFlags2 as S};
uses! {
    /// Not used before, or the old contents may go.
    DISCARD = S::NONE, A::NONE, UNDEFINED;
    /// Written as a colour attachment.
    COLOR_WRITE = S::COLOR_ATTACHMENT_OUTPUT, A::COLOR_ATTACHMENT_WRITE, COLOR_ATTACHMENT_OPTIMAL;
    /// Tested and written as a depth attachment.
    DEPTH_WRITE = S::from_raw(S::EARLY_FRAGMENT_TESTS.as_raw() | S::LATE_FRAGMENT_TESTS.as_raw()),
        A::from_raw(A::DEPTH_STENCIL_ATTACHMENT_READ.as_raw() | A::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw()),
        DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
    /// Depth tested, and read as an input attachment or texture, by one render pass.
    DEPTH_INPUT = S::from_raw(S::EARLY_FRAGMENT_TESTS.as_raw() | S::LATE_FRAGMENT_TESTS.as_raw() | S::FRAGMENT_SHADER.as_raw()),
        A::from_raw(A::DEPTH_STENCIL_ATTACHMENT_READ.as_raw() | A::INPUT_ATTACHMENT_READ.as_raw()),
        DEPTH_STENCIL_READ_ONLY_OPTIMAL;
    /// Read as an input attachment.
    COLOR_INPUT = S::FRAGMENT_SHADER, A::INPUT_ATTACHMENT_READ, SHADER_READ_ONLY_OPTIMAL;
    /// Sampled by a fragment shader.
    FRAGMENT_SAMPLE = S::FRAGMENT_SHADER, A::SHADER_SAMPLED_READ, SHADER_READ_ONLY_OPTIMAL;
    /// A depth image sampled by a fragment shader.
    FRAGMENT_SAMPLE_DEPTH = S::FRAGMENT_SHADER, A::SHADER_SAMPLED_READ, DEPTH_STENCIL_READ_ONLY_OPTIMAL;
    /// Sampled by a compute shader.
    COMPUTE_SAMPLE = S::COMPUTE_SHADER, A::SHADER_SAMPLED_READ, SHADER_READ_ONLY_OPTIMAL;
    /// A depth image sampled by a compute shader.
    COMPUTE_SAMPLE_DEPTH = S::COMPUTE_SHADER, A::SHADER_SAMPLED_READ, DEPTH_STENCIL_READ_ONLY_OPTIMAL;
    /// A storage image or buffer read and written by a compute shader.
    COMPUTE_STORAGE = S::COMPUTE_SHADER,
        A::from_raw(A::SHADER_STORAGE_READ.as_raw() | A::SHADER_STORAGE_WRITE.as_raw()), GENERAL;
    /// A storage image or buffer read and written by a fragment shader.
    FRAGMENT_STORAGE = S::FRAGMENT_SHADER,
        A::from_raw(A::SHADER_STORAGE_READ.as_raw() | A::SHADER_STORAGE_WRITE.as_raw()), GENERAL;
    /// A storage image written by a compute shader.
    COMPUTE_WRITE = S::COMPUTE_SHADER, A::SHADER_STORAGE_WRITE, GENERAL;
    /// Cleared by a transfer command.
    CLEAR_TARGET = S::CLEAR, A::TRANSFER_WRITE, TRANSFER_DST_OPTIMAL;
    /// Copied from.
    COPY_SOURCE = S::COPY, A::TRANSFER_READ, TRANSFER_SRC_OPTIMAL;
    /// Copied to.
    COPY_TARGET = S::COPY, A::TRANSFER_WRITE, TRANSFER_DST_OPTIMAL;
    /// The source of a filtered copy.
    BLIT_SOURCE = S::BLIT, A::TRANSFER_READ, TRANSFER_SRC_OPTIMAL;
    /// The target of a filtered copy.
    BLIT_TARGET = S::BLIT, A::TRANSFER_WRITE, TRANSFER_DST_OPTIMAL;
    /// Read by the host after a fence.
    HOST_READ = S::HOST, A::HOST_READ, GENERAL;
    /// Handed over by the display: the semaphore of the acquisition waits at this stage, and orders it.
    ACQUIRED = S::COLOR_ATTACHMENT_OUTPUT, A::NONE, UNDEFINED;
    /// Handed to the display: the semaphore that signals with this stage orders it.
    PRESENTED = S::COLOR_ATTACHMENT_OUTPUT, A::NONE, PRESENT_SRC_KHR;
    /// Vertices and indices.
    VERTEX_INPUT = S::VERTEX_INPUT,
        A::from_raw(A::VERTEX_ATTRIBUTE_READ.as_raw() | A::INDEX_READ.as_raw()), UNDEFINED;
}

impl Use {
    /// Both uses at once, in the layout of this one.
    pub const fn and(self, other: Use) -> Use {
        Use {
            stage: S::from_raw(self.stage.as_raw() | other.stage.as_raw()),
            access: A::from_raw(self.access.as_raw() | other.access.as_raw()),
            layout: self.layout,
        }
    }

    /// The same use with the old contents given up: waits for it, but transitions from undefined.
    pub const fn discarding(self) -> Use {
        Use {
            layout: vk::ImageLayout::UNDEFINED,
            ..self
        }
    }

    /// The same use, whose render pass has left the image in the layout of `last`.
    pub const fn left_in(self, last: Use) -> Use {
        Use {
            layout: last.layout,
            ..self
        }
    }
}

/// Orders `before` and `after` on all of `image` and moves it to the layout of `after`.
///
/// `hazard` says what would go wrong without it; it shows as a label in a capture.
/// Scopes reach back over earlier submits of the queue, so a barrier also guards
/// against the previous frame in flight.
pub fn image(
    device: &Device,
    commands: vk::CommandBuffer,
    hazard: &CStr,
    image: &Image,
    before: Use,
    after: Use,
) {
    let all = 0..image.levels();
    levels(device, commands, hazard, image, all, before, after);
}

/// As [`image()`], for the MIP levels `levels` of `image` alone.
pub fn levels(
    device: &Device,
    commands: vk::CommandBuffer,
    hazard: &CStr,
    image: &Image,
    levels: Range<u32>,
    before: Use,
    after: Use,
) {
    device.insert_label(commands, hazard);
    let barrier = [vk::ImageMemoryBarrier2::default()
        .src_stage_mask(before.stage)
        .src_access_mask(before.access)
        .dst_stage_mask(after.stage)
        .dst_access_mask(after.access)
        .old_layout(before.layout)
        .new_layout(after.layout)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .image(image.raw)
        .subresource_range(image.levels_range(levels))];
    let info = vk::DependencyInfo::default().image_memory_barriers(&barrier);
    // SAFETY: `commands` is being recorded outside a render pass; the image is alive.
    unsafe { device.raw.cmd_pipeline_barrier2(commands, &info) };
}

/// Inside a subpass: waits until what it has drawn so far is in the attachments.
///
/// It resolves no hazard and is for measuring only: without it, the stamps of a subpass are
/// taken while a tiler, or a renderer that bins like one, still holds its work back. The subpass
/// must declare [`drain_dependency`].
pub fn drain(device: &Device, commands: vk::CommandBuffer) {
    let barrier = [vk::MemoryBarrier2::default()
        .src_stage_mask(DRAIN_STAGES)
        .src_access_mask(DRAIN_WRITES)
        .dst_stage_mask(DRAIN_STAGES)
        .dst_access_mask(DRAIN_WRITES)];
    let info = vk::DependencyInfo::default()
        .memory_barriers(&barrier)
        .dependency_flags(vk::DependencyFlags::BY_REGION);
    // SAFETY: `commands` is being recorded inside a subpass that declares the dependency.
    unsafe { device.raw.cmd_pipeline_barrier2(commands, &info) };
}

/// Outside a render pass: waits until all compute and blits so far are done and visible.
///
/// It resolves no hazard and is for measuring only, as [`drain`].
pub fn drain_compute(device: &Device, commands: vk::CommandBuffer) {
    let (stages, reads, writes) = (
        S::COMPUTE_SHADER | S::BLIT,
        A::SHADER_SAMPLED_READ | A::SHADER_STORAGE_READ | A::TRANSFER_READ,
        A::SHADER_STORAGE_WRITE | A::TRANSFER_WRITE,
    );
    let barrier = [vk::MemoryBarrier2::default()
        .src_stage_mask(stages)
        .src_access_mask(writes)
        .dst_stage_mask(stages)
        .dst_access_mask(reads | writes)];
    let info = vk::DependencyInfo::default().memory_barriers(&barrier);
    // SAFETY: `commands` is being recorded outside a render pass.
    unsafe { device.raw.cmd_pipeline_barrier2(commands, &info) };
}

const DRAIN_STAGES: S =
    S::from_raw(Use::DEPTH_WRITE.stage.as_raw() | S::COLOR_ATTACHMENT_OUTPUT.as_raw());
const DRAIN_WRITES: A =
    A::from_raw(A::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw() | A::COLOR_ATTACHMENT_WRITE.as_raw());

/// The dependency of subpass `subpass` on itself that [`drain`] needs.
pub fn drain_dependency(subpass: u32) -> vk::SubpassDependency {
    use vk::{AccessFlags as A, PipelineStageFlags as S};
    let stages = S::EARLY_FRAGMENT_TESTS | S::LATE_FRAGMENT_TESTS | S::COLOR_ATTACHMENT_OUTPUT;
    let writes = A::DEPTH_STENCIL_ATTACHMENT_WRITE | A::COLOR_ATTACHMENT_WRITE;
    vk::SubpassDependency::default()
        .src_subpass(subpass)
        .dst_subpass(subpass)
        .src_stage_mask(stages)
        .src_access_mask(writes)
        .dst_stage_mask(stages)
        .dst_access_mask(writes)
        .dependency_flags(vk::DependencyFlags::BY_REGION)
}

/// Orders `before` and `after` on `buffer`. Otherwise as [`image()`].
pub fn buffer(
    device: &Device,
    commands: vk::CommandBuffer,
    hazard: &CStr,
    buffer: &Buffer,
    before: Use,
    after: Use,
) {
    device.insert_label(commands, hazard);
    let barrier = [vk::BufferMemoryBarrier2::default()
        .src_stage_mask(before.stage)
        .src_access_mask(before.access)
        .dst_stage_mask(after.stage)
        .dst_access_mask(after.access)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .buffer(buffer.raw)
        .size(vk::WHOLE_SIZE)];
    let info = vk::DependencyInfo::default().buffer_memory_barriers(&barrier);
    // SAFETY: as in `image`.
    unsafe { device.raw.cmd_pipeline_barrier2(commands, &info) };
}
