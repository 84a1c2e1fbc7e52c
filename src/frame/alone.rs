//! Passes on their own, for tests and benchmarks.

use std::ops::RangeInclusive;
use std::sync::Arc;

use ash::vk;

use super::compose::ComposePass;
use super::fetches::Build;
use super::panel::{Panel, PanelPass};
use super::present::record_textures;
use super::record_reduce;
use super::reduce::ReducePass;
use super::targets::{LightMap, PyramidDesc, image, overwriting_pass};
use crate::gpu::{self, Buffer, Device, Image, Location, Slot, Use, barrier, submit};
use crate::scene::pyramid::Atlas;

/// What [`reduce_alone`] has made: whole images, row-major; the fifth component is the fourth
/// moment, and 0 without it.
pub struct Reduced {
    /// Where the levels lie in the images.
    pub atlas: Atlas,
    /// The pyramid.
    pub moments: Vec<[f32; 5]>,
    /// The pyramid smoothed.
    pub smoothed: Vec<[f32; 5]>,
}

/// Runs the reduce pass on a level 0 of `size` texels, row-major, in place of a light map;
/// for tests and benchmarks.
///
/// Records as many times as `times` says into one submit, so that the synchronisation checker sees
/// what may race between one frame and the next.
///
/// # Errors
/// [`gpu::Error::OutOfMemory`] naming what did not fit, or what the driver says.
pub fn reduce_alone(
    device: &Arc<Device>,
    size: [u32; 2],
    moments: &[[f32; 4]],
    fourth: Option<&[f32]>,
    levels: RangeInclusive<u32>,
    times: u32,
) -> gpu::Result<Reduced> {
    let desc = PyramidDesc {
        fourth: fourth.is_some().then(|| levels.clone()),
        levels,
    };
    let (target, pyramid) = LightMap::with_levels(device, size, &desc)?;
    let pass = ReducePass::new(device, &target, &pyramid, Build::Plain)?;

    let buffer = |bytes: &[u8]| {
        let usage = vk::BufferUsageFlags::TRANSFER_SRC;
        let mut buffer = Buffer::new(
            device,
            "level 0",
            bytes.len() as u64,
            usage,
            Location::Upload,
        )?;
        buffer.write(bytes)?;
        Ok::<_, gpu::Error>(buffer)
    };
    let mut uploads = vec![(buffer(bytemuck::cast_slice(moments))?, &target)];
    if let (Some(values), Some(fourth)) = (fourth, &pyramid.fourth) {
        uploads.push((buffer(bytemuck::cast_slice(values))?, &fourth.moments));
    }
    let mut slot = Slot::new(device, "reduce")?;
    let commands = slot.begin()?;
    for _ in 0..times.max(1) {
        for (data, image) in &uploads {
            barrier::image(
                device,
                commands,
                c"WAR: the previous frame samples the light moments",
                image,
                Use::FRAGMENT_SAMPLE,
                Use::COPY_TARGET,
            );
            submit::record_upload(device, commands, data, image, size);
        }
        record_reduce(
            device,
            commands,
            &target,
            &pyramid,
            &pass,
            None,
            [Use::COPY_TARGET, Use::FRAGMENT_SAMPLE],
        );
    }
    slot.submit()?;
    slot.wait()?;

    let read = |image: &Image, channels: u64| {
        let [width, height] = image.size().map(u64::from);
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        let bytes = width * height * channels * 4;
        let buffer = Buffer::new(device, "levels", bytes, usage, Location::Readback)?;
        let mut slot = Slot::new(device, "levels")?;
        let commands = slot.begin()?;
        barrier::image(
            device,
            commands,
            c"RAW: the copy reads the levels",
            image,
            Use::FRAGMENT_SAMPLE,
            Use::COPY_SOURCE,
        );
        submit::record_readback(device, commands, image, &buffer);
        slot.submit()?;
        slot.wait()?;
        Ok::<Vec<f32>, gpu::Error>(bytemuck::pod_collect_to_vec(buffer.read()?))
    };
    let joined = |image: &Image, fourth: Option<&Image>| {
        let fourth = fourth.map(|image| read(image, 1)).transpose()?;
        let texels = read(image, 4)?;
        let texel = |(at, t): (usize, &[f32])| {
            [
                t[0],
                t[1],
                t[2],
                t[3],
                fourth.as_ref().map_or(0.0, |f| f[at]),
            ]
        };
        Ok::<Vec<_>, gpu::Error>(texels.chunks_exact(4).enumerate().map(texel).collect())
    };
    let fourth = pyramid.fourth.as_ref();
    Ok(Reduced {
        moments: joined(&target, fourth.map(|f| &f.moments))?,
        smoothed: joined(&pyramid.smoothed, fourth.map(|f| &f.smoothed))?,
        atlas: pyramid.atlas.clone(),
    })
}

/// A window that is drawn to an image, for [`compose_alone`].
pub struct Window<'a> {
    /// Columns and rows.
    pub size: [u32; 2],
    /// Whether its format encodes sRGB as it stores.
    pub encodes: bool,
    /// The picture: columns and rows, and sRGB with straight alpha, row-major.
    pub picture: ([u32; 2], &'a [[u8; 4]]),
    /// Columns and rows of the window that it fills: x, y, width, height.
    pub place: [i32; 4],
    /// Linear RGB behind it.
    pub backdrop: [f32; 3],
    /// What is drawn over both.
    pub panel: &'a Panel,
}

/// What the window shows: sRGB, row-major.
///
/// # Errors
/// As [`reduce_alone`].
pub fn compose_alone(device: &Arc<Device>, window: &Window<'_>) -> gpu::Result<Vec<[u8; 4]>> {
    let format = match window.encodes {
        true => vk::Format::B8G8R8A8_SRGB,
        false => vk::Format::B8G8R8A8_UNORM,
    };
    use vk::ImageUsageFlags as U;
    let usage = U::COLOR_ATTACHMENT | U::TRANSFER_SRC;
    let target = image(device, "window", window.size, format, usage)?;
    let (size, texels) = window.picture;
    let bytes = vk::Format::R8G8B8A8_UNORM;
    let usage = U::SAMPLED | U::TRANSFER_DST;
    let picture = image(device, "picture", size, bytes, usage)?;
    let data = bytemuck::cast_slice(texels);
    submit::upload_image(device, &picture, data, Use::FRAGMENT_SAMPLE)?;

    let pass = overwriting_pass(device, "compose", &[&target])?;
    let mut compose = ComposePass::new(device, &pass, &picture, 1, window.encodes)?;
    let mut panel = PanelPass::new(device, &pass, 1, window.encodes)?;
    let shown = compose.shown(&picture)?;
    compose.write(0, window.place, window.backdrop)?;
    panel.write(0, window.panel, window.size)?;
    let [width, height] = window.size.map(u64::from);
    let readback = Buffer::new(
        device,
        "window readback",
        4 * width * height,
        vk::BufferUsageFlags::TRANSFER_DST,
        Location::Readback,
    )?;
    let mut slot = Slot::new(device, "window")?;
    let commands = slot.begin()?;
    record_textures(device, commands, &panel, 0, window.panel);
    barrier::image(
        device,
        commands,
        c"layout: a new image is drawn",
        &target,
        Use::DISCARD,
        Use::COLOR_WRITE,
    );
    pass.begin(commands, &[]);
    let place = [window.place[2], window.place[3]];
    let [columns, rows] = window.size;
    compose.record(commands, 0, &shown, place, [0, 0, columns, rows]);
    panel.record(commands, 0, window.panel);
    pass.end(commands);
    barrier::image(
        device,
        commands,
        c"RAW: the copy reads what was drawn",
        &target,
        Use::COLOR_WRITE,
        Use::COPY_SOURCE,
    );
    submit::record_readback(device, commands, &target, &readback);
    slot.submit()?;
    slot.wait()?;
    let mut shown: Vec<[u8; 4]> = bytemuck::pod_collect_to_vec(readback.read()?);
    for pixel in &mut shown {
        pixel.swap(0, 2);
    }
    Ok(shown)
}
