//! The deform pass: the vertices of a mesh that moves, for one instant.
//!
//! Shader `deform.comp`; CPU twin [`crate::cpu::deform`].

use std::sync::Arc;

use ash::vk;
use glam::{DAffine3, DVec3};

use super::geometry::{self, Geometry, VERTEX_STRIDE};
use super::shaders;
use crate::gpu::{
    self, Binding, Buffer, ComputePipeline, DescriptorSets, Device, Location, Use, submit,
};
use crate::scene::deformer::{Bend, DEFORMERS_MAX};
use crate::scene::model::Rig;
use crate::scene::{Model, Pose};

/// Invocations of a workgroup.
const GROUP: u32 = 64;

/// The block `Pose` of `deform.comp`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Block {
    counts: [u32; 4],
    bends: [[[f32; 4]; 4]; DEFORMERS_MAX],
}

/// What the host writes for one instant.
struct Instant {
    block: Buffer,
    palette: Buffer,
    weights: Buffer,
}

/// The pass that poses the mesh.
pub struct DeformPass {
    instants: Vec<Instant>,
    sets: DescriptorSets,
    pipeline: ComputePipeline,
    /// First vertex at rest and how many, of each shape.
    shapes: Vec<[u32; 2]>,
    /// What positions at rest are relative to, in the file's unit, lest a mesh far off lose its digits.
    middle: DVec3,
    // Referred to by the sets.
    _rest: [Buffer; 4],
}

impl DeformPass {
    /// Bytes on the device that posing `model` takes, beside the vertices that come out.
    pub fn bytes(model: &Model) -> u64 {
        let vertices: usize = model.shapes.iter().map(|s| s.positions.len()).sum();
        let rest = vertices as u64 * u64::from(VERTEX_STRIDE);
        let rig = model.rig.as_ref().map_or(0, |rig| {
            let influences = rig.vertex_joints.len() * 6;
            influences + rig.vertex_morphs.len() * 12 + rig.morphs.len() * 24
        });
        rest + rig as u64
    }

    /// Prepares posing `model` into the vertices of `geometry`, with `slots` instants in flight.
    pub fn new(
        device: &Arc<Device>,
        model: &Model,
        geometry: &Geometry,
        slots: usize,
    ) -> gpu::Result<Self> {
        let nothing = Rig::default();
        let rig = model.rig.as_ref().unwrap_or(&nothing);
        let boxes = model.shapes.iter().filter_map(|shape| shape.bounding_box());
        let all = boxes.reduce(|(a, b), (c, d)| (a.min(c), b.max(d)));
        let middle = all.map_or(DVec3::ZERO, |(lo, hi)| 0.5 * (lo + hi));
        let mut shapes = Vec::new();
        let mut rest: Vec<[f32; 6]> = Vec::new();
        for shape in &model.shapes {
            shapes.push([rest.len() as u32, shape.positions.len() as u32]);
            rest.extend(geometry::vertices(shape, middle));
        }
        let words = |pair: &[u16]| u32::from(pair[0]) | u32::from(pair[1]) << 16;
        let joints = rig.vertex_joints.chunks_exact(rig.influences.max(1));
        let weights = rig.vertex_weights.chunks_exact(rig.influences.max(1));
        let influences: Vec<u32> = joints
            .zip(weights)
            .flat_map(|(joints, weights)| {
                let joints = joints.chunks_exact(2).map(words);
                joints.chain(weights.iter().map(|w| w.to_bits()))
            })
            .collect();
        let triples = |v: DVec3| v.as_vec3().to_array();
        let morphs: Vec<[[f32; 3]; 2]> = rig.morphs.iter().map(|m| m.map(triples)).collect();

        let storage = vk::BufferUsageFlags::STORAGE_BUFFER;
        let upload = |name, data: &[u8]| {
            submit::upload_buffer(device, name, data, storage, Use::COMPUTE_STORAGE)
        };
        let rest = [
            upload("rest", bytemuck::cast_slice(&rest))?,
            upload("influences", bytemuck::cast_slice(&influences))?,
            upload("vertex morphs", bytemuck::cast_slice(&rig.vertex_morphs))?,
            upload("morphs", bytemuck::cast_slice(&morphs))?,
        ];
        let weights = rig.nodes.iter().map(|n| n.first_weight + n.weights.len());
        let weights = weights.max().unwrap_or(0).max(1) as u64;
        let joints = rig.joints.len().max(1) as u64;
        let instant = |slot: usize| {
            let make = |name: &str, size, usage| {
                Buffer::new(
                    device,
                    &format!("{name} {slot}"),
                    size,
                    usage,
                    Location::Upload,
                )
            };
            Ok(Instant {
                block: make(
                    "pose",
                    size_of::<Block>() as u64,
                    vk::BufferUsageFlags::UNIFORM_BUFFER,
                )?,
                palette: make("palette", joints * 48, storage)?,
                weights: make("morph weights", weights * 4, storage)?,
            })
        };
        let instants = (0..slots).map(instant).collect::<gpu::Result<Vec<_>>>()?;
        let bindings: Vec<_> = instants
            .iter()
            .map(|instant| {
                let [rest, influences, vertex_morphs, morphs] = &rest;
                vec![
                    Binding::Uniform(&instant.block),
                    Binding::StorageBuffer(&instant.palette),
                    Binding::StorageBuffer(&instant.weights),
                    Binding::StorageBuffer(rest),
                    Binding::StorageBuffer(influences),
                    Binding::StorageBuffer(vertex_morphs),
                    Binding::StorageBuffer(morphs),
                    Binding::StorageBuffer(geometry.vertices()),
                ]
            })
            .collect();
        let stage = vk::ShaderStageFlags::COMPUTE;
        let sets = DescriptorSets::new(device, "deform", stage, &bindings)?;
        let constants = [
            rig.influences as u32,
            u32::from(!rig.vertex_morphs.is_empty()),
        ];
        let pipeline = ComputePipeline::new(device, &shaders::DEFORM_COMP, &sets, 0, &constants)?;
        Ok(DeformPass {
            instants,
            sets,
            pipeline,
            shapes,
            middle,
            _rest: rest,
        })
    }

    /// Sets the instant of a slot that the device is done with: `pose`, relative to `center` (mm).
    ///
    /// # Errors
    /// As [`Buffer::write`].
    pub fn write(&mut self, slot: usize, pose: &Pose, center: DVec3) -> gpu::Result<()> {
        let [first, count] = self.shapes.get(pose.shape).copied().unwrap_or([0; 2]);
        let mut block = Block {
            counts: [first, count, pose.bends.len() as u32, 0],
            ..bytemuck::Zeroable::zeroed()
        };
        for (to, bend) in block.bends.iter_mut().zip(&pose.bends) {
            *to = bend_block(bend, center);
        }
        // From positions relative to the rest's middle to positions relative to the scene's.
        let before = DAffine3::from_translation(self.middle);
        let palette: Vec<[[f32; 4]; 3]> = pose
            .palette
            .iter()
            .map(|matrix| {
                let matrix = *matrix * before;
                let (m, t) = (matrix.matrix3, matrix.translation - center);
                [0, 1, 2].map(|row| m.row(row).extend(t[row]).as_vec4().to_array())
            })
            .collect();
        let weights: Vec<f32> = pose.weights.iter().map(|&w| w as f32).collect();
        let instant = &mut self.instants[slot];
        instant.block.write(bytemuck::bytes_of(&block))?;
        instant.palette.write(bytemuck::cast_slice(&palette))?;
        instant.weights.write(bytemuck::cast_slice(&weights))
    }

    /// Poses the vertices of shape `shape`, as [`DeformPass::write`] has set `slot`.
    pub fn record(&self, commands: vk::CommandBuffer, slot: usize, shape: usize) {
        let count = self.shapes.get(shape).map_or(0, |shape| shape[1]);
        self.pipeline.bind(commands, &self.sets, slot);
        self.pipeline
            .dispatch_groups(commands, count.div_ceil(GROUP));
    }
}

/// `Bend` of `deform.comp`, relative to `center`.
fn bend_block(bend: &Bend, center: DVec3) -> [[f32; 4]; 4] {
    let vec4 = |v: DVec3, w: f64| v.extend(w).as_vec4().to_array();
    [
        vec4(bend.base - center, f64::from(bend.kind as u8)),
        vec4(bend.axis, bend.per_length),
        vec4(bend.towards, bend.amount),
        [bend.phase as f32, 0.0, 0.0, 0.0],
    ]
}
