//! The mesh on the device.

use std::sync::Arc;

use ash::vk;
use glam::DVec3;

use crate::gpu::{self, Buffer, Device, submit};
use crate::scene::Mesh;

/// Bytes of a vertex: position and normal, three floats each.
pub const VERTEX_STRIDE: u32 = 24;
/// Byte offsets of the attributes, by shader location.
pub const VERTEX_OFFSETS: [u32; 2] = [0, 12];

/// Vertex and index buffers of a mesh, in mm relative to the scene's centre.
pub struct Geometry {
    vertices: Buffer,
    indices: Buffer,
    count: u32,
    device: Arc<Device>,
}

impl Geometry {
    /// Bytes on the device that `mesh` needs, staging included.
    pub fn bytes(mesh: &Mesh) -> u64 {
        let vertices = mesh.positions.len() as u64 * u64::from(VERTEX_STRIDE);
        let indices = mesh.triangles.len() as u64 * 12;
        vertices + indices + vertices.max(indices)
    }

    /// Uploads `mesh`, moved so that `center` becomes the origin.
    pub fn new(device: &Arc<Device>, mesh: &Mesh, center: DVec3) -> gpu::Result<Self> {
        let vertices: Vec<[f32; 6]> = mesh
            .positions
            .iter()
            .zip(&mesh.normals)
            .map(|(p, n)| {
                let (p, n) = ((*p - center).as_vec3(), n.as_vec3());
                [p.x, p.y, p.z, n.x, n.y, n.z]
            })
            .collect();
        let upload = |name, data, usage| submit::upload_buffer(device, name, data, usage);
        Ok(Geometry {
            vertices: upload(
                "vertices",
                bytemuck::cast_slice(&vertices),
                vk::BufferUsageFlags::VERTEX_BUFFER,
            )?,
            indices: upload(
                "indices",
                bytemuck::cast_slice(&mesh.triangles),
                vk::BufferUsageFlags::INDEX_BUFFER,
            )?,
            count: 3 * mesh.triangles.len() as u32,
            device: Arc::clone(device),
        })
    }

    /// Draws all triangles with the pipeline that is bound.
    pub fn draw(&self, commands: vk::CommandBuffer) {
        let raw = &self.device.raw;
        // SAFETY: a pipeline with this vertex layout is bound inside its render pass;
        // every index was checked against the vertices when the mesh was loaded.
        unsafe {
            raw.cmd_bind_vertex_buffers(commands, 0, &[self.vertices.raw], &[0]);
            raw.cmd_bind_index_buffer(commands, self.indices.raw, 0, vk::IndexType::UINT32);
            raw.cmd_draw_indexed(commands, self.count, 1, 0, 0, 0);
        }
    }
}
