//! The compose pass: the picture in its place in a window, and over it the panel.
//!
//! Shaders `shade.vert`, `compose.frag`; CPU twin [`crate::cpu::compose`].

use std::sync::Arc;

use ash::vk;

use super::shaders;
use crate::gpu::{
    self, Binding, Buffer, DescriptorSets, Device, GraphicsDesc, GraphicsPipeline, Image, Location,
    RenderPass, Sampler,
};

/// The block `Place` of `compose.frag`.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct Place {
    place: [f32; 4],
    backdrop: [f32; 4],
}

/// The pass that puts pictures into a window.
pub struct ComposePass {
    pipeline: GraphicsPipeline,
    // Of each frame slot.
    places: Vec<Buffer>,
    // Like those of every picture: pipelines are made for it.
    sets: DescriptorSets,
    samplers: [Sampler; 2],
    device: Arc<Device>,
}

/// A picture, as the pass reads it.
pub struct Shown {
    size: [u32; 2],
    // By whether it is read between pixels; of each a set a frame slot.
    sets: [DescriptorSets; 2],
}

impl Shown {
    /// Columns and rows of the picture.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }
}

impl ComposePass {
    /// Prepares to draw in passes such as `pass`, whose format encodes sRGB by itself if it `encodes`. `any` is some
    /// picture.
    pub fn new(
        device: &Arc<Device>,
        pass: &RenderPass,
        any: &Image,
        slots: usize,
        encodes: bool,
    ) -> gpu::Result<Self> {
        let size = size_of::<Place>() as u64;
        let usage = vk::BufferUsageFlags::UNIFORM_BUFFER;
        let places = (0..slots)
            .map(|k| Buffer::new(device, &format!("place {k}"), size, usage, Location::Upload))
            .collect::<gpu::Result<Vec<_>>>()?;
        let border = vk::BorderColor::FLOAT_TRANSPARENT_BLACK;
        let sampler = |name, filter| Sampler::new(device, name, filter, border, None);
        let samplers = [
            sampler("picture, pixel by pixel", vk::Filter::NEAREST)?,
            sampler("picture, between pixels", vk::Filter::LINEAR)?,
        ];
        let sets = sets(device, &places, any, &samplers[0])?;
        Ok(ComposePass {
            pipeline: pipeline(device, pass, &sets, encodes)?,
            places,
            sets,
            samplers,
            device: Arc::clone(device),
        })
    }

    /// Draws in passes such as `pass` from now on. The device must be done with all frames.
    pub fn retarget(&mut self, pass: &RenderPass, encodes: bool) -> gpu::Result<()> {
        self.pipeline = pipeline(&self.device, pass, &self.sets, encodes)?;
        Ok(())
    }

    /// Makes `picture` one that can be shown. It must outlive what is made, and be sampled whenever it is.
    pub fn shown(&self, picture: &Image) -> gpu::Result<Shown> {
        let [nearest, between] = &self.samplers;
        Ok(Shown {
            size: picture.size(),
            sets: [
                sets(&self.device, &self.places, picture, nearest)?,
                sets(&self.device, &self.places, picture, between)?,
            ],
        })
    }

    /// Says where the frame of `slot`, with which the device is done, has its picture: in columns and rows `place` (x, y,
    /// width, height) of the window, over `backdrop` (linear RGB).
    pub fn write(&mut self, slot: usize, place: [i32; 4], backdrop: [f32; 3]) -> gpu::Result<()> {
        let [r, g, b] = backdrop;
        let block = Place {
            place: place.map(|side| side as f32),
            backdrop: [r, g, b, 1.0],
        };
        self.places[slot].write(bytemuck::bytes_of(&block))
    }

    /// Draws columns and rows `clip` (x, y, width, height) of the window, of which the picture fills `place` pixels.
    pub fn record(
        &self,
        commands: vk::CommandBuffer,
        slot: usize,
        shown: &Shown,
        place: [i32; 2],
        clip: [u32; 4],
    ) {
        let between = shown.size.map(i64::from) != place.map(i64::from);
        let sets = &shown.sets[usize::from(between)];
        self.pipeline.bind(commands, sets, slot);
        self.pipeline.draw_clipped(commands, 0..3, clip);
    }
}

fn pipeline(
    device: &Arc<Device>,
    pass: &RenderPass,
    sets: &DescriptorSets,
    encodes: bool,
) -> gpu::Result<GraphicsPipeline> {
    let constants = [u32::from(encodes)];
    let desc = GraphicsDesc::flat(&shaders::SHADE_VERT, &shaders::COMPOSE_FRAG, &constants);
    GraphicsPipeline::new(device, &desc, pass, sets)
}

fn sets(
    device: &Arc<Device>,
    places: &[Buffer],
    picture: &Image,
    sampler: &Sampler,
) -> gpu::Result<DescriptorSets> {
    let bindings: Vec<_> = places
        .iter()
        .map(|place| vec![Binding::Uniform(place), Binding::Sampled(picture, sampler)])
        .collect();
    let stages = vk::ShaderStageFlags::FRAGMENT;
    DescriptorSets::new(device, "compose", stages, &bindings)
}
