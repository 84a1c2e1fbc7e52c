//! Intermediate images, copied to the host for tests and captures.

use ash::vk;

use super::Renderer;
use crate::gpu::{self, Buffer, Image, Location, Slot, Use, barrier, submit};

/// An intermediate image, for tests and captures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// D32 depth of the light map.
    LightDepth,
    /// T0 moments of the light map.
    LightMoments,
    /// The whole image of the light moments: T0 at its corner, and the levels of its pyramid.
    LightPyramid,
    /// The pyramid smoothed; without a pyramid as [`Target::LightPyramid`].
    LightSmoothed,
    /// T1, the fourth moment of the light map, where the plan asks for one; else as
    /// [`Target::LightMoments`].
    LightFourth,
    /// The whole image of the fourth moment, as [`Target::LightPyramid`] is of T0.
    FourthPyramid,
    /// The fourth moment smoothed.
    FourthSmoothed,
    /// The volumes, slice by slice, where the plan asks for some; else as [`Target::LightMoments`].
    Volumes,
    /// D32 depth of the nearest back face.
    BackDepth,
    /// Octahedral normal of that face, turned to the viewer.
    BackNormal,
    /// D32 depth of the view.
    ViewDepth,
    /// Octahedral normal of the view.
    ViewNormal,
    /// Where the surface of a pixel was in the live frame before, minus where it is, pixels; of a renderer that draws none
    /// as [`Target::Radiance`].
    Motion,
    /// Radiance of the last frame.
    Radiance,
    /// As [`Target::BackDepth`], where scattering is shaded at half size; else the same.
    HalfBackDepth,
    /// As [`Target::BackNormal`], alike.
    HalfBackNormal,
    /// As [`Target::ViewDepth`], alike.
    HalfViewDepth,
    /// As [`Target::ViewNormal`], alike.
    HalfViewNormal,
    /// The radiance that is scattered at half size, and its distance along the optical axis; else as [`Target::Radiance`].
    HalfRadiance,
}

impl Renderer {
    /// Copies the vertices that the last frame drew to the host: position (mm, relative to [`Renderer::center`]) and
    /// normal of each. Empty of a mesh that does not move.
    ///
    /// # Errors
    /// What the driver says.
    pub fn vertices(&mut self) -> gpu::Result<Vec<[f32; 6]>> {
        let vertices = self.geometry.vertices();
        if self.deform.is_none() {
            return Ok(Vec::new());
        }
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        let readback = Buffer::new(
            &self.device,
            "vertices readback",
            vertices.size(),
            usage,
            Location::Readback,
        )?;
        let mut slot = Slot::new(&self.device, "vertices")?;
        let commands = slot.begin()?;
        barrier::buffer(
            &self.device,
            commands,
            c"RAW: the copy reads the vertices",
            vertices,
            Use::COMPUTE_STORAGE,
            Use::COPY_SOURCE,
        );
        submit::record_buffer_readback(&self.device, commands, vertices, &readback);
        slot.submit()?;
        slot.wait()?;
        Ok(bytemuck::pod_collect_to_vec(readback.read()?))
    }

    /// Copies an intermediate image of the last frame to the host, as up to four floats a
    /// texel, row-major; missing components are 0.
    ///
    /// The G-buffer is there only if it was asked to be kept.
    ///
    /// # Errors
    /// What the driver says.
    pub fn read(&mut self, target: Target) -> gpu::Result<Vec<[f32; 4]>> {
        let exact = self.exact.is_some();
        // At half size a frame leaves all as it does at the picture's.
        let (gbuffer, radiance, target) = match (&self.half, target) {
            (Some(half), Target::HalfBackDepth) => {
                (&half.gbuffer, &half.radiance, Target::BackDepth)
            }
            (Some(half), Target::HalfBackNormal) => {
                (&half.gbuffer, &half.radiance, Target::BackNormal)
            }
            (Some(half), Target::HalfViewDepth) => {
                (&half.gbuffer, &half.radiance, Target::ViewDepth)
            }
            (Some(half), Target::HalfViewNormal) => {
                (&half.gbuffer, &half.radiance, Target::ViewNormal)
            }
            (Some(half), Target::HalfRadiance) => (&half.gbuffer, &half.radiance, Target::Radiance),
            _ => (&self.gbuffer, &self.canvas.radiance, target),
        };
        let pyramid = self.map.pyramid.as_ref();
        let fourth = pyramid.and_then(|p| p.fourth.as_ref());
        let (image, state): (&Image, Use) = match target {
            Target::LightDepth => (&self.map.depth, Use::FRAGMENT_SAMPLE_DEPTH),
            Target::LightMoments | Target::LightPyramid => {
                (&self.map.moments, Use::FRAGMENT_SAMPLE)
            }
            Target::LightSmoothed => {
                let image = pyramid.map_or(&self.map.moments, |p| &p.smoothed);
                (image, Use::FRAGMENT_SAMPLE)
            }
            Target::LightFourth | Target::FourthPyramid => {
                let image = fourth.map_or(&self.map.moments, |f| &f.moments);
                (image, Use::FRAGMENT_SAMPLE)
            }
            Target::FourthSmoothed => {
                let image = fourth.map_or(&self.map.moments, |f| &f.smoothed);
                (image, Use::FRAGMENT_SAMPLE)
            }
            Target::Volumes => {
                let image = self
                    .volumes
                    .as_ref()
                    .map_or(&self.map.moments, |l| &l.image);
                (image, Use::FRAGMENT_SAMPLE)
            }
            Target::BackDepth | Target::HalfBackDepth => {
                (&gbuffer.back, Use::DEPTH_WRITE.left_in(Use::DEPTH_INPUT))
            }
            Target::BackNormal | Target::HalfBackNormal => (
                &gbuffer.back_normal,
                Use::COLOR_WRITE.left_in(Use::COLOR_INPUT),
            ),
            Target::Motion => match &self.live {
                Some(live) => (&live.motion, Use::FRAGMENT_SAMPLE),
                None => (radiance, Use::FRAGMENT_SAMPLE),
            },
            Target::ViewDepth if !exact && self.live.is_some() => {
                (&gbuffer.depth, Use::FRAGMENT_SAMPLE_DEPTH)
            }
            Target::ViewDepth if exact => (&gbuffer.depth, Use::COMPUTE_SAMPLE_DEPTH),
            Target::ViewDepth | Target::HalfViewDepth => {
                (&gbuffer.depth, Use::DEPTH_WRITE.left_in(Use::DEPTH_INPUT))
            }
            Target::ViewNormal if exact => (&gbuffer.normal, Use::COMPUTE_SAMPLE),
            Target::ViewNormal | Target::HalfViewNormal => {
                (&gbuffer.normal, Use::COLOR_WRITE.left_in(Use::COLOR_INPUT))
            }
            Target::Radiance | Target::HalfRadiance => (radiance, Use::FRAGMENT_SAMPLE),
        };
        let [width, height] = image.size();
        let bytes = match image.format() {
            vk::Format::R32G32B32A32_SFLOAT => 16,
            vk::Format::R32G32_SFLOAT => 8,
            _ => 4,
        };
        let buffer = Buffer::new(
            &self.device,
            "capture",
            u64::from(width) * u64::from(height) * u64::from(image.depth()) * bytes,
            vk::BufferUsageFlags::TRANSFER_DST,
            Location::Readback,
        )?;
        let mut slot = Slot::new(&self.device, "capture")?;
        let commands = slot.begin()?;
        barrier::image(
            &self.device,
            commands,
            c"RAW: the copy reads what the frame has left",
            image,
            state,
            Use::COPY_SOURCE,
        );
        submit::record_readback(&self.device, commands, image, &buffer);
        barrier::image(
            &self.device,
            commands,
            c"WAR: the next frame finds the image as it was",
            image,
            Use::COPY_SOURCE,
            state,
        );
        slot.submit()?;
        slot.wait()?;
        let data = buffer.read()?;
        let pair = |c: &[u8; 4]| [[c[0], c[1]], [c[2], c[3]]];
        let mut texels: Vec<[f32; 4]> = match image.format() {
            vk::Format::R32G32B32A32_SFLOAT => bytemuck::pod_collect_to_vec(data),
            vk::Format::R32G32_SFLOAT => bytemuck::pod_collect_to_vec::<u8, [f32; 2]>(data)
                .iter()
                .map(|&[x, y]| [x, y, 0.0, 0.0])
                .collect(),
            vk::Format::R16G16_SNORM => bytemuck::pod_collect_to_vec::<u8, [u8; 4]>(data)
                .iter()
                .map(|c| {
                    let [x, y] =
                        pair(c).map(|c| (f32::from(i16::from_ne_bytes(c)) / 32767.0).max(-1.0));
                    [x, y, 0.0, 0.0]
                })
                .collect(),
            vk::Format::R16G16_SFLOAT => bytemuck::pod_collect_to_vec::<u8, [u8; 4]>(data)
                .iter()
                .map(|c| {
                    let [x, y] = pair(c).map(|c| half::f16::from_ne_bytes(c).to_f32());
                    [x, y, 0.0, 0.0]
                })
                .collect(),
            _ => bytemuck::pod_collect_to_vec::<u8, f32>(data)
                .iter()
                .map(|&x| [x, 0.0, 0.0, 0.0])
                .collect(),
        };
        if matches!(target, Target::LightMoments | Target::LightFourth) {
            // Level 0, without what lies beside and below it.
            let side = self.plan.light_map as usize;
            let rows = texels.chunks_exact(width as usize).take(side);
            texels = rows.flat_map(|row| &row[..side]).copied().collect();
        }
        Ok(texels)
    }
}
