//! A small software renderer, to look at a model while carving it.

use std::io;
use std::path::Path;

use glam::{Mat3, Vec2, Vec3};
use rayon::prelude::*;

use crate::mesh::Mesh;

/// Where a picture is taken from.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Degrees round the vertical axis from +Z towards +X.
    pub azimuth: f32,
    /// Degrees above the horizon.
    pub elevation: f32,
    /// The point in the middle of the picture.
    pub target: Vec3,
    /// Height of the picture at the target, mm.
    pub height: f32,
    /// Lit from behind, with light seeping through thin stone.
    pub back_lit: bool,
}

/// What shading needs to know of a vertex.
#[derive(Clone, Debug)]
pub struct Shading {
    /// Its normal.
    pub normals: Vec<Vec3>,
    openness: Vec<f32>,
    thickness: Vec<f32>,
}

impl Shading {
    /// Measures a mesh in the field that it was carved from.
    pub fn new(mesh: &Mesh, normals: &[Vec3], field: &(impl Fn(Vec3) -> f32 + Sync)) -> Self {
        let at_vertices = |f: &(dyn Fn(Vec3, Vec3) -> f32 + Sync)| -> Vec<f32> {
            (0..normals.len())
                .into_par_iter()
                .map(|i| f(mesh.positions[i], normals[i]))
                .collect()
        };
        Self {
            normals: normals.to_vec(),
            openness: at_vertices(&|p, n| openness(field, p, n)),
            thickness: at_vertices(&|p, n| thickness(field, p, n)),
        }
    }
}

/// How open to the sky each vertex is (Quilez's ambient occlusion: compare
/// the field along the normal with the distance gone).
fn openness(field: &impl Fn(Vec3) -> f32, p: Vec3, n: Vec3) -> f32 {
    let mut hidden = 0.0;
    let mut weight = 1.0;
    for step in 1..=6 {
        let h = 0.35 * (step * step) as f32 * 0.5;
        hidden += weight * (h - field(p + n * h)).max(0.0) / h;
        weight *= 0.8;
    }
    (1.0 - 0.3 * hidden).clamp(0.0, 1.0)
}

/// Length of stone behind the surface point, mm, up to 12.
fn thickness(field: &impl Fn(Vec3) -> f32, p: Vec3, n: Vec3) -> f32 {
    let mut t = 0.3;
    while t < 12.0 {
        let d = field(p - n * t);
        if d > 0.0 {
            break;
        }
        t += (-d).max(0.15);
    }
    t
}

/// Renders `views` in a grid of `columns`, each `size` pixels square, to a
/// PNG file.
pub fn sheet(
    mesh: &Mesh,
    normals: &[Vec3],
    field: &(impl Fn(Vec3) -> f32 + Sync),
    views: &[View],
    columns: usize,
    size: usize,
    path: &Path,
) -> io::Result<()> {
    let shading = Shading::new(mesh, normals, field);
    let pictures: Vec<_> = views.iter().map(|&v| (mesh, &shading, v)).collect();
    poses(&pictures, columns, size, path)
}

/// Renders a mesh of its own in each picture of the grid.
pub fn poses(
    pictures: &[(&Mesh, &Shading, View)],
    columns: usize,
    size: usize,
    path: &Path,
) -> io::Result<()> {
    let rows = pictures.len().div_ceil(columns);
    let (width, height) = (columns * size, rows * size);
    let mut picture = vec![0u8; width * height * 3];
    let tiles: Vec<_> = pictures
        .par_iter()
        .map(|(mesh, shading, view)| render(mesh, shading, view, size))
        .collect();
    for (k, tile) in tiles.iter().enumerate() {
        for y in 0..size {
            let from = y * size * 3;
            let to = ((k / columns * size + y) * width + k % columns * size) * 3;
            picture[to..to + size * 3].copy_from_slice(&tile[from..from + size * 3]);
        }
    }
    let file = io::BufWriter::new(std::fs::File::create(path)?);
    let mut encoder = png::Encoder::new(file, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder
        .write_header()
        .and_then(|mut w| w.write_image_data(&picture))
        .map_err(io::Error::other)
}

fn render(mesh: &Mesh, shading: &Shading, view: &View, size: usize) -> Vec<u8> {
    const FINER: usize = 2;
    let n = size * FINER;
    let turn = Mat3::from_rotation_x(view.elevation.to_radians())
        * Mat3::from_rotation_y(-view.azimuth.to_radians());
    let distance = 300.0;
    let project = |p: Vec3| -> Vec3 {
        let q = turn * (p - view.target);
        let zoom = n as f32 / view.height * distance / (distance - q.z);
        let half = n as f32 * 0.5;
        Vec3::new(half + q.x * zoom, half - q.y * zoom, q.z)
    };
    let screen: Vec<Vec3> = mesh.positions.iter().map(|&p| project(p)).collect();
    let colour: Vec<Vec3> = (0..screen.len())
        .map(|i| light(turn * shading.normals[i], shading, i, view.back_lit))
        .collect();
    let backdrop = if view.back_lit { 0.03 } else { 0.16 };
    let mut pixels = vec![(f32::MIN, Vec3::splat(backdrop)); n * n];
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| screen[i as usize]);
        let cross = |u: Vec2, v: Vec2| u.x * v.y - u.y * v.x;
        let (a2, b2, c2) = (a.truncate(), b.truncate(), c.truncate());
        let area = cross(b2 - a2, c2 - a2);
        if area >= 0.0 {
            continue;
        }
        let lo = a2.min(b2).min(c2).floor().max(Vec2::ZERO);
        let hi = a2.max(b2).max(c2).ceil().min(Vec2::splat(n as f32 - 1.0));
        for y in lo.y as usize..=hi.y.max(0.0) as usize {
            for x in lo.x as usize..=hi.x.max(0.0) as usize {
                let p = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let u = cross(c2 - b2, p - b2) / area;
                let v = cross(a2 - c2, p - c2) / area;
                let w = 1.0 - u - v;
                if u < 0.0 || v < 0.0 || w < 0.0 {
                    continue;
                }
                let z = u * a.z + v * b.z + w * c.z;
                let slot = &mut pixels[y * n + x];
                if z > slot.0 {
                    let [ca, cb, cc] = t.map(|i| colour[i as usize]);
                    *slot = (z, ca * u + cb * v + cc * w);
                }
            }
        }
    }
    let mut bytes = Vec::with_capacity(size * size * 3);
    for y in 0..size {
        for x in 0..size {
            let mut sum = Vec3::ZERO;
            for j in 0..FINER {
                for i in 0..FINER {
                    sum += pixels[(y * FINER + j) * n + x * FINER + i].1;
                }
            }
            let c = (sum / (FINER * FINER) as f32).powf(1.0 / 2.2) * 255.0;
            bytes.extend(c.to_array().map(|v| v.clamp(0.0, 255.0) as u8));
        }
    }
    bytes
}

/// Linear light leaving vertex `i`, whose normal in view space is `n`.
fn light(n: Vec3, shading: &Shading, i: usize, back_lit: bool) -> Vec3 {
    let open = shading.openness[i];
    let marble = Vec3::new(0.92, 0.9, 0.86);
    let lambert = |dir: Vec3| n.dot(dir.normalize()).max(0.0);
    if back_lit {
        let key = lambert(Vec3::new(-0.8, 0.4, -0.55));
        let glow =
            (-shading.thickness[i] / 2.2).exp() * (0.4 + 0.6 * lambert(Vec3::new(0.6, 0.0, 1.0)));
        let fill =
            0.05 * open * (0.5 + 0.5 * n.y) + 0.06 * open * lambert(Vec3::new(0.5, 0.3, 1.0));
        return marble * (0.9 * key + fill) + Vec3::new(1.0, 0.72, 0.48) * glow;
    }
    let key = lambert(Vec3::new(-0.7, 0.75, 0.55));
    let rim = lambert(Vec3::new(0.9, 0.2, -0.3));
    let sky = open * (0.6 + 0.4 * n.y);
    marble * (0.62 * key * (0.35 + 0.65 * open) + 0.16 * rim + 0.2 * sky)
}
