//! The reduce pass: the pyramid of the light map's moments, and each of its levels smoothed.
//!
//! Shaders `decimate.comp`, `smooth.comp`; CPU twin [`crate::cpu::reduce`].

use std::ops::RangeInclusive;
use std::sync::Arc;

use ash::vk;

use super::shaders;
use super::targets::Pyramid;
use crate::gpu::{
    self, Binding, Buffer, ComputePipeline, DescriptorSets, Device, Image, Location, Sampler,
    Shader,
};
use crate::scene::pyramid::{Atlas, Place};

/// How many levels the table of `smooth.comp` can hold: a base of 8192 texels has as many.
const MAX_LEVELS: usize = 14;

/// Texels of a workgroup of `smooth.comp`, which makes four neighbours an invocation.
const ROWS_TILE: [u32; 2] = [32, 8];
const COLUMNS_TILE: [u32; 2] = [64, 4];

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

/// One direction of smoothing, all levels at once.
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
    rows: Smoothing,
    columns: Smoothing,
    atlas: Atlas,
    // Referred to by the sets.
    _samplers: [Sampler; 2],
}

impl ReducePass {
    /// Prepares making the levels of `pyramid` from level 0 of `moments`, and smoothing those that
    /// it asks for.
    pub fn new(device: &Arc<Device>, moments: &Image, pyramid: &Pyramid) -> gpu::Result<Self> {
        let (levels, linear) = (pyramid.levels.clone(), pyramid.linear);
        let sampler = |name, filter| {
            let border = vk::BorderColor::FLOAT_TRANSPARENT_BLACK;
            Sampler::new(device, name, filter, border, None)
        };
        let nearest = sampler("levels, nearest", vk::Filter::NEAREST)?;
        let filter = if linear {
            vk::Filter::LINEAR
        } else {
            vk::Filter::NEAREST
        };
        let bilinear = sampler("levels, halving", filter)?;

        let compute = vk::ShaderStageFlags::COMPUTE;
        let mut bindings = vec![
            Binding::SampledGeneral(moments, &bilinear),
            Binding::Storage(moments),
        ];
        if let Some(fourth) = &pyramid.fourth {
            bindings.push(Binding::SampledGeneral(&fourth.moments, &bilinear));
            bindings.push(Binding::Storage(&fourth.moments));
        }
        let sets = DescriptorSets::new(device, "reduce, halving", compute, &[bindings])?;
        let shader = match (linear, &pyramid.fourth) {
            (true, None) => &shaders::DECIMATE_COMP,
            (true, Some(_)) => &shaders::DECIMATE_COMP_FOURTH,
            (false, None) => &shaders::DECIMATE_COMP_NEAREST,
            (false, Some(_)) => &shaders::DECIMATE_COMP_NEAREST_FOURTH,
        };
        let halve = ComputePipeline::new(device, shader, &sets, 24, &[])?;

        let fourth = pyramid.fourth.as_ref();
        let shaders = match fourth {
            None => [&shaders::SMOOTH_COMP_ROWS, &shaders::SMOOTH_COMP_COLUMNS],
            Some(_) => [
                &shaders::SMOOTH_COMP_ROWS_FOURTH,
                &shaders::SMOOTH_COMP_COLUMNS_FOURTH,
            ],
        };
        let rows = Smoothing::new(
            device,
            "reduce, rows",
            [moments, &pyramid.rows],
            fourth.map(|f| [&f.moments, &f.rows]),
            &nearest,
            tiles(&pyramid.atlas, levels.clone(), ROWS_TILE),
            shaders[0],
        )?;
        let columns = Smoothing::new(
            device,
            "reduce, columns",
            [&pyramid.rows, &pyramid.smoothed],
            fourth.map(|f| [&f.rows, &f.smoothed]),
            &nearest,
            tiles(&pyramid.atlas, levels, COLUMNS_TILE),
            shaders[1],
        )?;
        Ok(ReducePass {
            sets,
            halve,
            rows,
            columns,
            atlas: pyramid.atlas.clone(),
            _samplers: [nearest, bilinear],
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
        self.halve.dispatch_8x8(commands, size);
    }

    /// Smooths the rows of all levels.
    pub fn smooth_rows(&self, commands: vk::CommandBuffer) {
        self.rows.record(commands);
    }

    /// Smooths the columns of what [`ReducePass::smooth_rows`] has left.
    pub fn smooth_columns(&self, commands: vk::CommandBuffer) {
        self.columns.record(commands);
    }
}

impl Smoothing {
    #[allow(clippy::too_many_arguments, reason = "the graph's edges, each by name")]
    fn new(
        device: &Arc<Device>,
        name: &str,
        [source, target]: [&Image; 2],
        fourth: Option<[&Image; 2]>,
        sampler: &Sampler,
        (table, levels, tiles): (Table, u32, u32),
        shader: &Shader,
    ) -> gpu::Result<Self> {
        let mut buffer = Buffer::new(
            device,
            name,
            size_of::<Table>() as u64,
            vk::BufferUsageFlags::UNIFORM_BUFFER,
            Location::Upload,
        )?;
        buffer.write(bytemuck::bytes_of(&table))?;
        let mut bindings = vec![
            Binding::SampledGeneral(source, sampler),
            Binding::Storage(target),
            Binding::Uniform(&buffer),
        ];
        if let Some([source, target]) = fourth {
            bindings.push(Binding::SampledGeneral(source, sampler));
            bindings.push(Binding::Storage(target));
        }
        let stage = vk::ShaderStageFlags::COMPUTE;
        let sets = DescriptorSets::new(device, name, stage, &[bindings])?;
        let pipeline = ComputePipeline::new(device, shader, &sets, 0, &[levels])?;
        Ok(Smoothing {
            sets,
            pipeline,
            tiles,
            _table: buffer,
        })
    }

    fn record(&self, commands: vk::CommandBuffer) {
        self.pipeline.bind(commands, &self.sets, 0);
        self.pipeline.dispatch_groups(commands, self.tiles);
    }
}

/// Deals the content of `levels` out to tiles of `tile` texels: the table, how many levels it
/// holds, and how many tiles there are.
fn tiles(atlas: &Atlas, levels: RangeInclusive<u32>, tile: [u32; 2]) -> (Table, u32, u32) {
    let mut table: Table = bytemuck::Zeroable::zeroed();
    let (mut count, mut next) = (0, 0);
    debug_assert!(levels.clone().count() <= MAX_LEVELS);
    for (level, entry) in levels.zip(0..MAX_LEVELS) {
        let Place { origin, size } = atlas.content(level);
        let across = [size[0].div_ceil(tile[0]), size[1].div_ceil(tile[1])];
        table.content[entry] = [origin[0], origin[1], size[0], size[1]];
        table.tiles[entry] = [next, across[0], 0, 0];
        next += across[0] * across[1];
        count += 1;
    }
    (table, count, next)
}
