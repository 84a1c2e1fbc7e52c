//! The reduce pass: the pyramid of the light map's moments, and each of its levels smoothed.
//!
//! Shaders `decimate.comp`, `smooth.comp`; CPU twin [`crate::cpu::reduce`].

use std::ops::RangeInclusive;
use std::sync::Arc;

use ash::vk;

use super::fetches::Build;
use super::shaders;
use super::targets::Pyramid;
use crate::gpu::{
    self, Binding, Buffer, ComputePipeline, DescriptorSets, Device, Image, Location, Shader,
};
use crate::scene::pyramid::{Atlas, Place};

/// How many levels the table of `smooth.comp` can hold: a base of 8192 texels has as many.
const MAX_LEVELS: usize = 14;

/// Texels that an invocation of `smooth.comp` makes.
pub const SMOOTH_OUTPUTS: u32 = 16;

/// Columns and rows of what a workgroup of `smooth.comp` makes: 8 x 8 invocations of 4 x 4.
const TILE: [u32; 2] = [32, 32];

/// Texels along each axis that an invocation of `decimate.comp` makes, and the invocations of a
/// workgroup, all in one row.
pub const HALVE_OUTPUTS: u32 = 2;
const HALVE_GROUP: u32 = 32;

/// Texels before and after an interior to which the pyramid itself spreads.
const SPREAD: u32 = 1;

/// The block `Levels` of `smooth.comp`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Table {
    /// First column and row, columns and rows of what is written.
    content: [[u32; 4]; MAX_LEVELS],
    /// First tile of the level, and tiles a row.
    tiles: [[u32; 4]; MAX_LEVELS],
}

/// The smoothing of one image, all levels at once.
struct Smoothing {
    sets: DescriptorSets,
    pipeline: ComputePipeline,
    /// Workgroups, one a tile.
    tiles: u32,
    // Referred to by the sets.
    _table: Buffer,
}

/// The pass that makes the pyramid and smooths it.
pub struct ReducePass {
    sets: DescriptorSets,
    halve: ComputePipeline,
    /// Of the first three moments, and of the fourth where there is one.
    smoothing: Vec<Smoothing>,
    atlas: Atlas,
}

impl ReducePass {
    /// Prepares making the levels of `pyramid` from level 0 of `moments`, and smoothing those that
    /// it asks for.
    pub fn new(
        device: &Arc<Device>,
        moments: &Image,
        pyramid: &Pyramid,
        build: Build<'_>,
    ) -> gpu::Result<Self> {
        let compute = vk::ShaderStageFlags::COMPUTE;
        let mut bindings = vec![Binding::Storage(moments)];
        bindings.extend(pyramid.fourth.iter().map(|f| Binding::Storage(&f.moments)));
        let shader = build.shader(halving(pyramid.fourth.is_some()));
        let bindings = build.bindings(&shader, bindings);
        let sets = DescriptorSets::new(device, "reduce, halving", compute, &[bindings])?;
        let halve = ComputePipeline::new(device, &shader, &sets, 24, &[])?;

        let smooth = |name, source, target, levels, shader| {
            Smoothing::new(
                device,
                name,
                source,
                target,
                tiles(&pyramid.atlas, levels),
                shader,
                build,
            )
        };
        let mut smoothing = vec![smooth(
            "reduce, smoothing",
            moments,
            &pyramid.smoothed,
            pyramid.levels.clone(),
            &shaders::SMOOTH_COMP,
        )?];
        if let Some(fourth) = &pyramid.fourth {
            smoothing.push(smooth(
                "reduce, smoothing of the fourth moment",
                &fourth.moments,
                &fourth.smoothed,
                fourth.levels.clone(),
                &shaders::SMOOTH_COMP_FOURTH,
            )?);
        }
        Ok(ReducePass {
            sets,
            halve,
            smoothing,
            atlas: pyramid.atlas.clone(),
        })
    }

    /// Makes level `level` from the one before it.
    pub fn decimate(&self, commands: vk::CommandBuffer, level: u32) {
        let from = self.atlas.places[level as usize - 1].origin;
        let to = self.atlas.places[level as usize].origin;
        let size = self.atlas.grown(level, SPREAD, SPREAD + 1).size;
        self.halve.bind(commands, &self.sets, 0);
        self.halve
            .push(commands, bytemuck::cast_slice(&[from, to, size]));
        let [x, y] = size.map(|n| n.div_ceil(HALVE_OUTPUTS));
        self.halve.dispatch(commands, [x.div_ceil(HALVE_GROUP), y]);
    }

    /// Smooths the levels: of the first three moments, and of the fourth.
    pub fn smooth(&self, commands: vk::CommandBuffer) {
        for smoothing in &self.smoothing {
            smoothing.pipeline.bind(commands, &smoothing.sets, 0);
            smoothing
                .pipeline
                .dispatch_groups(commands, smoothing.tiles);
        }
    }
}

/// The shader that halves, with or without the fourth moment.
pub fn halving(fourth: bool) -> &'static Shader {
    match fourth {
        false => &shaders::DECIMATE_COMP,
        true => &shaders::DECIMATE_COMP_FOURTH,
    }
}

impl Smoothing {
    fn new(
        device: &Arc<Device>,
        name: &str,
        source: &Image,
        target: &Image,
        (table, levels, tiles): (Table, u32, u32),
        shader: &Shader,
        build: Build<'_>,
    ) -> gpu::Result<Self> {
        let shader = build.shader(shader);
        let mut buffer = Buffer::new(
            device,
            name,
            size_of::<Table>() as u64,
            vk::BufferUsageFlags::UNIFORM_BUFFER,
            Location::Upload,
        )?;
        buffer.write(bytemuck::bytes_of(&table))?;
        let bindings = vec![
            Binding::Storage(source),
            Binding::Storage(target),
            Binding::Uniform(&buffer),
        ];
        let bindings = build.bindings(&shader, bindings);
        let stage = vk::ShaderStageFlags::COMPUTE;
        let sets = DescriptorSets::new(device, name, stage, &[bindings])?;
        let pipeline = ComputePipeline::new(device, &shader, &sets, 0, &[levels])?;
        Ok(Smoothing {
            sets,
            pipeline,
            tiles,
            _table: buffer,
        })
    }
}

/// Deals the content of `levels` out to tiles of [`TILE`] texels: the table, how many levels it
/// holds, and how many tiles there are.
fn tiles(atlas: &Atlas, levels: RangeInclusive<u32>) -> (Table, u32, u32) {
    let mut table: Table = bytemuck::Zeroable::zeroed();
    let (mut count, mut next) = (0, 0);
    debug_assert!(levels.clone().count() <= MAX_LEVELS);
    for (level, entry) in levels.zip(0..MAX_LEVELS) {
        let Place { origin, size } = atlas.content(level);
        let across = [0, 1].map(|axis| size[axis].div_ceil(TILE[axis]));
        table.content[entry] = [origin[0], origin[1], size[0], size[1]];
        table.tiles[entry] = [next, across[0], 0, 0];
        next += across[0] * across[1];
        count += 1;
    }
    (table, count, next)
}
