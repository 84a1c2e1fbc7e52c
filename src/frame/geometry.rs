//! The mesh on the device.

use std::sync::Arc;

use ash::vk;
use glam::DVec3;

use crate::gpu::{self, Buffer, Device, Location, Use, submit};
use crate::scene::{Mesh, Model};

/// Bytes of a vertex: position and normal, three floats each.
pub const VERTEX_STRIDE: u32 = 24;
/// Byte offsets of the attributes, by shader location.
pub const VERTEX_OFFSETS: [u32; 2] = [0, 12];
/// The same of positions alone.
pub const POSITION_OFFSETS: [u32; 1] = [0];

/// Vertex and index buffers of a mesh, in mm relative to the scene's centre.
///
/// Of a mesh that moves the vertices are those of the last instant that the deform pass has posed.
pub struct Geometry {
    vertices: Buffer,
    /// The vertices of the frame before, where the mesh moves and a history asks for them.
    before: Option<Buffer>,
    indices: Buffer,
    /// First index and how many, of each shape.
    shapes: Vec<[u32; 2]>,
    /// Of each shape, the first one of the same triangles, whose vertices are its own: that of the first shape, or itself.
    kin: Vec<usize>,
    /// Which shape is drawn; a mesh that does not move has one.
    pub shape: usize,
    device: Arc<Device>,
}

/// Positions relative to `center`, and normals: what the vertex buffer holds.
pub fn vertices(mesh: &Mesh, center: DVec3) -> impl Iterator<Item = [f32; 6]> + '_ {
    mesh.positions.iter().zip(&mesh.normals).map(move |(p, n)| {
        let (p, n) = ((*p - center).as_vec3(), n.as_vec3());
        [p.x, p.y, p.z, n.x, n.y, n.z]
    })
}

/// Bytes of the triangles of `mesh`.
fn index_bytes(mesh: &Mesh) -> u64 {
    mesh.triangles.len() as u64 * 12
}

/// Bytes of the vertices of `mesh`.
fn vertex_bytes(mesh: &Mesh) -> u64 {
    mesh.positions.len() as u64 * u64::from(VERTEX_STRIDE)
}

impl Geometry {
    /// Bytes on the device that `mesh` needs, staging included.
    pub fn bytes(mesh: &Mesh) -> u64 {
        let (vertices, indices) = (vertex_bytes(mesh), index_bytes(mesh));
        vertices + indices + vertices.max(indices)
    }

    /// Bytes on the device that the shapes of `model` need, staging included, before anything poses them.
    pub fn moving_bytes(model: &Model) -> u64 {
        let vertices = model.shapes.iter().map(vertex_bytes).max().unwrap_or(0);
        2 * model.shapes.iter().map(index_bytes).sum::<u64>() + vertices
    }

    /// Uploads `mesh`, moved so that `center` becomes the origin.
    pub fn new(device: &Arc<Device>, mesh: &Mesh, center: DVec3) -> gpu::Result<Self> {
        let vertices: Vec<[f32; 6]> = vertices(mesh, center).collect();
        let vertices = submit::upload_buffer(
            device,
            "vertices",
            bytemuck::cast_slice(&vertices),
            vk::BufferUsageFlags::VERTEX_BUFFER,
            Use::VERTEX_INPUT,
        )?;
        Geometry::of(device, vertices, &[mesh])
    }

    /// Room for the vertices of `model`, which the deform pass will fill, and the triangles of all its shapes.
    pub fn moving(device: &Arc<Device>, model: &Model) -> gpu::Result<Self> {
        let bytes = model.shapes.iter().map(vertex_bytes).max().unwrap_or(0);
        let vertices = Buffer::new(
            device,
            "vertices",
            bytes.max(4),
            vk::BufferUsageFlags::VERTEX_BUFFER
                | vk::BufferUsageFlags::STORAGE_BUFFER
                | vk::BufferUsageFlags::TRANSFER_SRC,
            Location::Device,
        )?;
        let shapes: Vec<&Mesh> = model.shapes.iter().collect();
        Geometry::of(device, vertices, &shapes)
    }

    fn of(device: &Arc<Device>, vertices: Buffer, meshes: &[&Mesh]) -> gpu::Result<Self> {
        let mut shapes = Vec::new();
        let mut indices: Vec<u32> = Vec::new();
        for mesh in meshes {
            shapes.push([indices.len() as u32, 3 * mesh.triangles.len() as u32]);
            indices.extend(mesh.triangles.as_flattened());
        }
        let indices = submit::upload_buffer(
            device,
            "indices",
            bytemuck::cast_slice(&indices),
            vk::BufferUsageFlags::INDEX_BUFFER,
            Use::VERTEX_INPUT,
        )?;
        let first = meshes.first();
        let alike = |mesh: &Mesh| first.is_some_and(|first| first.triangles == mesh.triangles);
        let kin = (0..)
            .zip(meshes)
            .map(|(own, mesh)| if alike(mesh) { 0 } else { own });
        Ok(Geometry {
            vertices,
            before: None,
            indices,
            shapes,
            kin: kin.collect(),
            shape: 0,
            device: Arc::clone(device),
        })
    }

    /// Makes room for the vertices of the frame before.
    pub fn keep_before(&mut self) -> gpu::Result<()> {
        let usage = vk::BufferUsageFlags::VERTEX_BUFFER | vk::BufferUsageFlags::TRANSFER_DST;
        let size = self.vertices.size();
        let before = Buffer::new(
            &self.device,
            "previous vertices",
            size,
            usage,
            Location::Device,
        )?;
        self.before = Some(before);
        Ok(())
    }

    /// The vertices of the frame before, if they are kept.
    pub fn before(&self) -> Option<&Buffer> {
        self.before.as_ref()
    }

    /// Whether vertex by vertex one shape is the other, in another pose or not.
    pub fn same_vertices(&self, a: usize, b: usize) -> bool {
        a == b || (self.kin.get(a).is_some() && self.kin.get(a) == self.kin.get(b))
    }

    /// The vertex buffer.
    pub fn vertices(&self) -> &Buffer {
        &self.vertices
    }

    /// Draws all triangles of the shape with the pipeline that is bound.
    pub fn draw(&self, commands: vk::CommandBuffer) {
        self.draw_of(commands, &[self.vertices.raw]);
    }

    /// The same with a pipeline that also asks where each vertex was: where it is, unless it has `moved` since.
    pub fn draw_moved(&self, commands: vk::CommandBuffer, moved: bool) {
        let before = self.before.as_ref().filter(|_| moved);
        let before = before.unwrap_or(&self.vertices);
        self.draw_of(commands, &[self.vertices.raw, before.raw]);
    }

    fn draw_of(&self, commands: vk::CommandBuffer, buffers: &[vk::Buffer]) {
        let [first, count] = self.shapes.get(self.shape).copied().unwrap_or([0; 2]);
        let raw = &self.device.raw;
        // SAFETY: a pipeline with this vertex layout is bound inside its render pass;
        // every index was checked against the vertices when the mesh was loaded.
        unsafe {
            raw.cmd_bind_vertex_buffers(commands, 0, buffers, &[0; 2][..buffers.len()]);
            raw.cmd_bind_index_buffer(commands, self.indices.raw, 0, vk::IndexType::UINT32);
            raw.cmd_draw_indexed(commands, count, 1, first, 0, 0);
        }
    }
}
