//! Command buffers with their fences, and one-off transfers.

use std::sync::Arc;

use ash::vk;

use super::{Buffer, Device, Image, Location, Semaphore, Use, barrier, check, lock};

/// A command buffer and the fence that says when the device is done with it.
///
/// A frame in flight owns one.
pub struct Slot {
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    fence: vk::Fence,
    device: Arc<Device>,
}

impl Slot {
    /// Makes a slot; nothing is pending on it.
    ///
    /// # Errors
    /// What the driver says.
    pub fn new(device: &Arc<Device>, name: &str) -> super::Result<Self> {
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(device.queue_family);
        // SAFETY: the device is alive.
        let pool = check("vkCreateCommandPool", unsafe {
            device.raw.create_command_pool(&info, None)
        })?;
        let mut slot = Slot {
            pool,
            commands: vk::CommandBuffer::null(),
            fence: vk::Fence::null(),
            device: Arc::clone(device),
        };
        device.name(pool, name);
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(pool)
            .command_buffer_count(1);
        // SAFETY: the pool was made above.
        slot.commands = check("vkAllocateCommandBuffers", unsafe {
            device.raw.allocate_command_buffers(&info)
        })?[0];
        device.name(slot.commands, name);
        // Signalled: the first wait of a slot must not hang.
        let info = vk::FenceCreateInfo::default().flags(vk::FenceCreateFlags::SIGNALED);
        // SAFETY: the device is alive.
        slot.fence = check("vkCreateFence", unsafe {
            device.raw.create_fence(&info, None)
        })?;
        device.name(slot.fence, name);
        Ok(slot)
    }

    /// Waits until the device is done with the slot's last submit.
    ///
    /// # Errors
    /// [`super::Error::DeviceLost`] among others.
    pub fn wait(&self) -> super::Result<()> {
        // SAFETY: the fence is alive.
        check("vkWaitForFences", unsafe {
            self.device
                .raw
                .wait_for_fences(&[self.fence], true, u64::MAX)
        })
    }

    /// Waits as [`Slot::wait`], then starts recording anew.
    ///
    /// # Errors
    /// As [`Slot::wait`].
    pub fn begin(&mut self) -> super::Result<vk::CommandBuffer> {
        self.wait()?;
        let info = vk::CommandBufferBeginInfo::default()
            .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the fence says that the device no longer uses the pool's buffer.
        check("vkBeginCommandBuffer", unsafe {
            self.device
                .raw
                .reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty())
                .and_then(|()| self.device.raw.begin_command_buffer(self.commands, &info))
        })?;
        Ok(self.commands)
    }

    /// Ends recording and submits.
    ///
    /// # Errors
    /// [`super::Error::DeviceLost`] among others.
    pub fn submit(&mut self) -> super::Result<()> {
        self.submit_with(vk::SubmitInfo2::default())
    }

    /// As [`Slot::submit`]: what writes colour waits for `before`, and `after` signals when that is done.
    ///
    /// # Errors
    /// As [`Slot::submit`].
    pub fn submit_between(&mut self, before: &Semaphore, after: &Semaphore) -> super::Result<()> {
        let of = |semaphore: &Semaphore| {
            [vk::SemaphoreSubmitInfo::default()
                .semaphore(semaphore.raw)
                .stage_mask(vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT)]
        };
        let (wait, signal) = (of(before), of(after));
        let info = vk::SubmitInfo2::default()
            .wait_semaphore_infos(&wait)
            .signal_semaphore_infos(&signal);
        self.submit_with(info)
    }

    fn submit_with(&mut self, info: vk::SubmitInfo2<'_>) -> super::Result<()> {
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(self.commands)];
        let submit = [info.command_buffer_infos(&commands)];
        let queue = lock(&self.device.queue);
        // SAFETY: the buffer is being recorded, the fence is signalled and waited for, and the
        // queue's lock is held.
        unsafe {
            check(
                "vkEndCommandBuffer",
                self.device.raw.end_command_buffer(self.commands),
            )?;
            check("vkResetFences", self.device.raw.reset_fences(&[self.fence]))?;
            let submitted = self.device.raw.queue_submit2(*queue, &submit, self.fence);
            // The fence will never signal: nobody may go on as if there were just not enough memory.
            check("vkQueueSubmit2", submitted).map_err(|error| match error {
                super::Error::OutOfMemory { .. } => super::Error::Vulkan {
                    call: "vkQueueSubmit2",
                    result: vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
                },
                error => error,
            })
        }
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        // SAFETY: waiting for the queue leaves nothing pending. An error means that the
        // device is lost, and then nothing is pending either.
        unsafe {
            let _ = self.device.wait_for_queue();
            self.device.raw.destroy_fence(self.fence, None);
            self.device.raw.destroy_command_pool(self.pool, None);
        }
    }
}

/// Fills a new device buffer with `data` through a staging buffer, ready for the use `after`, and waits.
///
/// # Errors
/// [`super::Error::OutOfMemory`] naming the buffer, or what the driver says.
pub fn upload_buffer(
    device: &Arc<Device>,
    name: &str,
    data: &[u8],
    usage: vk::BufferUsageFlags,
    after: Use,
) -> super::Result<Buffer> {
    let size = data.len().max(4) as u64;
    let mut staging = Buffer::new(
        device,
        "staging",
        size,
        vk::BufferUsageFlags::TRANSFER_SRC,
        Location::Upload,
    )?;
    staging.write(data)?;
    let target = Buffer::new(
        device,
        name,
        size,
        usage | vk::BufferUsageFlags::TRANSFER_DST,
        Location::Device,
    )?;
    let mut slot = Slot::new(device, "upload")?;
    let commands = slot.begin()?;
    // SAFETY: both buffers are alive until the wait below and hold `size` bytes.
    unsafe {
        let region = [vk::BufferCopy {
            src_offset: 0,
            dst_offset: 0,
            size,
        }];
        device
            .raw
            .cmd_copy_buffer(commands, staging.raw, target.raw, &region);
    }
    barrier::buffer(
        device,
        commands,
        c"RAW: the buffer is read after the upload",
        &target,
        Use::COPY_TARGET,
        after,
    );
    slot.submit()?;
    slot.wait()?;
    Ok(target)
}

/// Fills the first MIP level of `image` with tightly packed texels through a staging buffer, leaves it in `after`, and waits.
///
/// # Errors
/// As [`upload_buffer`].
pub fn upload_image(
    device: &Arc<Device>,
    image: &Image,
    data: &[u8],
    after: Use,
) -> super::Result<()> {
    let mut staging = Buffer::new(
        device,
        "staging",
        data.len() as u64,
        vk::BufferUsageFlags::TRANSFER_SRC,
        Location::Upload,
    )?;
    staging.write(data)?;
    let mut slot = Slot::new(device, "upload")?;
    let commands = slot.begin()?;
    barrier::image(
        device,
        commands,
        c"layout: a new image becomes a copy target",
        image,
        Use::DISCARD,
        Use::COPY_TARGET,
    );
    record_upload(device, commands, &staging, image, image.size());
    barrier::image(
        device,
        commands,
        c"RAW: the texture is read after the upload",
        image,
        Use::COPY_TARGET,
        after,
    );
    slot.submit()?;
    slot.wait()
}

/// Clears each of the new `images` to 0, leaves it in the use beside it, and waits.
///
/// # Errors
/// What the driver says.
pub fn clear_images(device: &Arc<Device>, images: &[(&Image, Use)]) -> super::Result<()> {
    let mut slot = Slot::new(device, "clear")?;
    let commands = slot.begin()?;
    for &(image, after) in images {
        barrier::image(
            device,
            commands,
            c"layout: a new image is to be cleared",
            image,
            Use::DISCARD,
            Use::CLEAR_TARGET,
        );
        // SAFETY: `commands` is being recorded, and the image is alive until the wait below.
        unsafe {
            device.raw.cmd_clear_color_image(
                commands,
                image.raw,
                vk::ImageLayout::TRANSFER_DST_OPTIMAL,
                &vk::ClearColorValue::default(),
                &[image.range()],
            );
        }
        barrier::image(
            device,
            commands,
            c"RAW: the zeros are read after the clear",
            image,
            Use::CLEAR_TARGET,
            after,
        );
    }
    slot.submit()?;
    slot.wait()
}

/// Records the copy of `size` tightly packed texels from `buffer` to the corner of `image`, which
/// is in [`Use::COPY_TARGET`].
pub fn record_upload(
    device: &Device,
    commands: vk::CommandBuffer,
    buffer: &Buffer,
    image: &Image,
    size: [u32; 2],
) {
    // SAFETY: `commands` is being recorded; image and buffer are alive and hold that many texels.
    unsafe {
        device.raw.cmd_copy_buffer_to_image(
            commands,
            buffer.raw,
            image.raw,
            vk::ImageLayout::TRANSFER_DST_OPTIMAL,
            &[image.corner_copy(size)],
        );
    }
}

/// Records the copy of `size` tightly packed texels of 4 bytes, from texel `first` of `buffer`, to `origin` in
/// `image`, whose texels have 4 bytes and which is in [`Use::COPY_TARGET`].
pub fn record_part_upload(
    device: &Device,
    commands: vk::CommandBuffer,
    (buffer, first): (&Buffer, u64),
    image: &Image,
    (origin, size): ([u32; 3], [u32; 3]),
) {
    let [x, y, z] = origin.map(|at| at as i32);
    let region = vk::BufferImageCopy {
        buffer_offset: 4 * first,
        image_subresource: image.layers(0),
        image_offset: vk::Offset3D { x, y, z },
        image_extent: vk::Extent3D {
            width: size[0],
            height: size[1],
            depth: size[2],
        },
        ..Default::default()
    };
    // SAFETY: `commands` is being recorded; image and buffer are alive and hold that many texels.
    unsafe {
        device.raw.cmd_copy_buffer_to_image(
            commands,
            buffer.raw,
            image.raw,
            vk::ImageLayout::TRANSFER_DST_OPTIMAL,
            &[region],
        );
    }
}

/// Records the copy of the first MIP level of `image`, which is in [`Use::COPY_SOURCE`], to
/// `buffer`, and makes it visible to the host.
pub fn record_readback(
    device: &Device,
    commands: vk::CommandBuffer,
    image: &Image,
    buffer: &Buffer,
) {
    record_level_readback(device, commands, image, 0, buffer);
}

/// As [`record_readback`], for MIP level `level`.
pub fn record_level_readback(
    device: &Device,
    commands: vk::CommandBuffer,
    image: &Image,
    level: u32,
    buffer: &Buffer,
) {
    // SAFETY: `commands` is being recorded; level and buffer are alive and of one size.
    unsafe {
        device.raw.cmd_copy_image_to_buffer(
            commands,
            image.raw,
            vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
            buffer.raw,
            &[image.level_copy(level)],
        );
    }
    barrier::buffer(
        device,
        commands,
        c"RAW: the host reads after the copy",
        buffer,
        Use::COPY_TARGET,
        Use::HOST_READ,
    );
}

/// Records the copy of all of `from`, which was made visible to it, to `to`, which is as large.
pub fn record_buffer_copy(
    device: &Device,
    commands: vk::CommandBuffer,
    from: &Buffer,
    to: &Buffer,
) {
    let region = [vk::BufferCopy {
        src_offset: 0,
        dst_offset: 0,
        size: from.size().min(to.size()),
    }];
    // SAFETY: `commands` is being recorded; both buffers are alive and hold the region.
    unsafe {
        device
            .raw
            .cmd_copy_buffer(commands, from.raw, to.raw, &region);
    }
}

/// As [`record_buffer_copy`], and makes it visible to the host.
pub fn record_buffer_readback(
    device: &Device,
    commands: vk::CommandBuffer,
    from: &Buffer,
    to: &Buffer,
) {
    record_buffer_copy(device, commands, from, to);
    barrier::buffer(
        device,
        commands,
        c"RAW: the host reads after the copy",
        to,
        Use::COPY_TARGET,
        Use::HOST_READ,
    );
}

/// Records that every texel of `image`, a colour image in [`Use::CLEAR_TARGET`], becomes `value`.
pub fn record_clear(device: &Device, commands: vk::CommandBuffer, image: &Image, value: [f32; 4]) {
    let value = vk::ClearColorValue { float32: value };
    // SAFETY: `commands` is being recorded outside a render pass; the image is alive and in this
    // layout.
    unsafe {
        device.raw.cmd_clear_color_image(
            commands,
            image.raw,
            vk::ImageLayout::TRANSFER_DST_OPTIMAL,
            &value,
            &[image.range()],
        );
    }
}

/// Records the filtered copy of the first `extent` texels a side of MIP level `source.1` of
/// `source.0`, in [`Use::BLIT_SOURCE`], to all of level `target.1` of `target.0`, in
/// [`Use::BLIT_TARGET`].
///
/// A texel of the target is a bilinear tap of the source: where `extent` is twice the target's
/// size, the mean of 2x2 texels.
pub fn record_blit(
    device: &Device,
    commands: vk::CommandBuffer,
    source: (&Image, u32),
    extent: [u32; 2],
    target: (&Image, u32),
) {
    let corners = |[width, height]: [u32; 2]| {
        let end = vk::Offset3D {
            x: width as i32,
            y: height as i32,
            z: 1,
        };
        [vk::Offset3D::default(), end]
    };
    let region = vk::ImageBlit {
        src_subresource: source.0.layers(source.1),
        src_offsets: corners(extent),
        dst_subresource: target.0.layers(target.1),
        dst_offsets: corners(target.0.level_size(target.1)),
    };
    // SAFETY: `commands` is being recorded; both levels are alive, in these layouts, and of
    // formats that the caller has found to be fit for it.
    unsafe {
        device.raw.cmd_blit_image(
            commands,
            source.0.raw,
            vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
            target.0.raw,
            vk::ImageLayout::TRANSFER_DST_OPTIMAL,
            &[region],
            vk::Filter::LINEAR,
        );
    }
}
