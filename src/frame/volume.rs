//! The volume pass: grids of light made of the light map, and blurred to the volumes that the mixture taps.
//!
//! Between light map and image all lies in buffers: a storage image would want a store a cell and step,
//! which on llvmpipe takes as long as ten reads.
//!
//! Shaders `volume.comp`, `volume_halve.comp`, `volume_blur.comp`; CPU twin [`crate::cpu::volume`].

use std::sync::Arc;

use ash::vk;

use super::fetches::Build;
use super::shaders;
use super::targets::Light;
use crate::gpu::{self, Binding, ComputePipeline, DescriptorSets, Device, Image, Sampler};
use crate::scene::LightFrame;
use crate::scene::volume::{Grid, RADIUS_MAX, Volume};

/// Cells along each axis that an invocation of `volume_halve.comp` makes.
const HALVE_OUTPUTS: u32 = 2;
/// Cells along its axis that an invocation of `volume_blur.comp` makes.
const BLUR_OUTPUTS: u32 = 8;
/// Invocations of a workgroup of these two.
const GROUP: u64 = 64;

/// The block `Deposit` of `volume.comp`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Deposit {
    place: [f32; 4],
    size: [u32; 4],
    depth: f32,
    reach: u32,
}

/// The block `Halving` of `volume_halve.comp`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Halving {
    from: [u32; 4],
    to: [u32; 4],
}

/// The block `Blur` of `volume_blur.comp`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Blur {
    size: [u32; 4],
    first: [u32; 2],
    weights: [f32; RADIUS_MAX + 1],
}

/// The pass that makes the volumes.
pub struct VolumePass {
    deposit: (DescriptorSets, ComputePipeline),
    halve: (DescriptorSets, ComputePipeline),
    /// From the grids to the first of the steps, from there to the second, and back, with the radius of each
    /// volume.
    blur: [DescriptorSets; 3],
    of_radius: Vec<(usize, ComputePipeline)>,
    // Referred to by a set.
    _sampler: Sampler,
}

impl VolumePass {
    /// Prepares making `light` of `moments`.
    pub fn new(
        device: &Arc<Device>,
        moments: &Image,
        light: &Light,
        build: Build<'_>,
    ) -> gpu::Result<Self> {
        let stage = vk::ShaderStageFlags::COMPUTE;
        let border = vk::BorderColor::FLOAT_TRANSPARENT_BLACK;
        let sampler = Sampler::new(device, "texels", vk::Filter::NEAREST, border, None)?;
        let grids = Binding::StorageBuffer(&light.grids);
        let steps = light.steps.each_ref().map(Binding::StorageBuffer);
        let set = |name, bindings| DescriptorSets::new(device, name, stage, &[bindings]);

        let shader = build.shader(&shaders::VOLUME_COMP);
        let bindings = vec![Binding::Sampled(moments, &sampler), grids];
        let sets = set("volume, deposit", build.bindings(&shader, bindings))?;
        let bytes = size_of::<Deposit>() as u32;
        let pipeline = ComputePipeline::new(device, &shader, &sets, bytes, &[])?;
        let deposit = (sets, pipeline);

        let sets = set("volume, halving", vec![grids])?;
        let bytes = size_of::<Halving>() as u32;
        let pipeline =
            ComputePipeline::new(device, &shaders::VOLUME_HALVE_COMP, &sets, bytes, &[])?;
        let halve = (sets, pipeline);

        let blur = [
            set("volume, blur along columns", vec![grids, steps[0]])?,
            set("volume, blur along rows", vec![steps[0], steps[1]])?,
            set("volume, blur along the depth", vec![steps[1], steps[0]])?,
        ];
        let bytes = size_of::<Blur>() as u32;
        let mut of_radius: Vec<(usize, ComputePipeline)> = Vec::new();
        for volume in &light.desc.volumes {
            let radius = volume.weights.len() - 1;
            if of_radius.iter().all(|(of, _)| *of != radius) {
                let shader = &shaders::VOLUME_BLUR_COMP;
                let constants = [radius as u32];
                let pipeline = ComputePipeline::new(device, shader, &blur[0], bytes, &constants)?;
                of_radius.push((radius, pipeline));
            }
        }
        Ok(VolumePass {
            deposit,
            halve,
            blur,
            of_radius,
            _sampler: sampler,
        })
    }

    /// Makes the base grid of a map in `frame`.
    pub fn deposit(&self, commands: vk::CommandBuffer, grid: &Grid, frame: &LightFrame) {
        let (sets, pipeline) = &self.deposit;
        let [x, y, z] = grid.size;
        let push = Deposit {
            place: grid.shift.extend(grid.scale).as_vec4().to_array(),
            size: [x, y, z, frame.size],
            depth: (frame.z_half / frame.texel) as f32,
            reach: grid.reach(),
        };
        pipeline.bind(commands, sets, 0);
        pipeline.push(commands, bytemuck::bytes_of(&push));
        pipeline.dispatch_8x8(commands, [x, y]);
    }

    /// Makes the grid `to` of the one before it, `from`.
    pub fn halve(&self, commands: vk::CommandBuffer, from: &Grid, to: &Grid) {
        let (sets, pipeline) = &self.halve;
        let block = |grid: &Grid| {
            let [x, y, z] = grid.size;
            [x, y, z, grid.first]
        };
        let push = Halving {
            from: block(from),
            to: block(to),
        };
        pipeline.bind(commands, sets, 0);
        pipeline.push(commands, bytemuck::bytes_of(&push));
        dispatch(
            pipeline,
            commands,
            to.size.map(|n| n.div_ceil(HALVE_OUTPUTS)),
        );
    }

    /// Blurs `volume`, of `grid`, along `axis`: 0 from the grids, 1 and 2 from one step to the other.
    pub fn blur(&self, commands: vk::CommandBuffer, grid: &Grid, volume: &Volume, axis: usize) {
        let radius = volume.weights.len() - 1;
        let Some((_, pipeline)) = self.of_radius.iter().find(|(of, _)| *of == radius) else {
            return;
        };
        let [x, y, z] = grid.size;
        let factor = if axis == 2 { volume.factor } else { 1.0 };
        let mut weights = [0.0; RADIUS_MAX + 1];
        for (to, weight) in weights.iter_mut().zip(&volume.weights) {
            *to = (factor * weight) as f32;
        }
        let push = Blur {
            size: [x, y, z, axis as u32],
            first: [
                if axis == 0 { grid.first } else { volume.first },
                volume.first,
            ],
            weights,
        };
        pipeline.bind(commands, &self.blur[axis], 0);
        pipeline.push(commands, bytemuck::bytes_of(&push));
        let mut blocks = grid.size;
        blocks[axis] = blocks[axis].div_ceil(BLUR_OUTPUTS);
        dispatch(pipeline, commands, blocks);
    }
}

/// An invocation for each of `blocks`.
fn dispatch(pipeline: &ComputePipeline, commands: vk::CommandBuffer, blocks: [u32; 3]) {
    let invocations: u64 = blocks.iter().map(|&n| u64::from(n)).product();
    pipeline.dispatch_groups(commands, invocations.div_ceil(GROUP) as u32);
}
