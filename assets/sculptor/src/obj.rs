//! Wavefront OBJ text.

use std::f32::consts::TAU;
use std::fmt::Write;

use glam::{Vec2, Vec3};

use crate::mesh::Mesh;
use crate::sdf::gradient;

/// Shading normals: the field's gradient, or the mesh's own normal where the
/// two part by more than 60 degrees (a crease that the mesh has rounded off).
pub fn shading_normals(mesh: &Mesh, field: &impl Fn(Vec3) -> f32) -> Vec<Vec3> {
    mesh.normals()
        .into_iter()
        .zip(&mesh.positions)
        .map(|(flat, &p)| {
            let smooth = gradient(field, p, 0.12).normalize_or(flat);
            let agree = smooth.dot(flat);
            let keep = ((agree - 0.5) / 0.3).clamp(0.0, 1.0);
            flat.lerp(smooth, keep).normalize_or(flat)
        })
        .collect()
}

/// Cylindrical texture coordinates of a face: `u` round the vertical axis with
/// its seam at the back, `v` the height as a part of `height`. A face across
/// the seam is unrolled on one side of it, and the side is chosen, and the
/// range of `u` scaled, so that `u` stays in 0..=1.
fn unwrap_face(corners: [Vec3; 3], height: f32) -> [Vec2; 3] {
    const MARGIN: f32 = 0.1;
    let mut u = corners.map(|p| 0.5 + p.x.atan2(p.z) / TAU);
    let (lo, hi) = (u[0].min(u[1]).min(u[2]), u[0].max(u[1]).max(u[2]));
    if hi - lo > 0.5 {
        for x in &mut u {
            if *x < 0.5 {
                *x += 1.0;
            }
        }
    }
    let mut out = [Vec2::ZERO; 3];
    for k in 0..3 {
        let wrapped = (u[k] + MARGIN) / (1.0 + 2.0 * MARGIN);
        out[k] = Vec2::new(wrapped, corners[k].y / height).clamp(Vec2::ZERO, Vec2::ONE);
    }
    out
}

/// The mesh as OBJ text with `comment` on top. Faces across the texture seam
/// have coordinates of their own; positions stay shared, so the surface is
/// closed in the position index.
pub fn write(mesh: &Mesh, normals: &[Vec3], comment: &str) -> String {
    let mut text = String::new();
    for line in comment.lines() {
        let _ = writeln!(text, "# {line}");
    }
    let height = mesh.positions.iter().fold(1.0f32, |h, p| h.max(p.y));
    for p in &mesh.positions {
        let _ = writeln!(text, "v {:.4} {:.4} {:.4}", p.x, p.y, p.z);
    }
    let mut coordinates = std::collections::HashMap::new();
    let mut faces = String::new();
    for &t in &mesh.triangles {
        let uv = unwrap_face(mesh.corners(t), height);
        faces.push('f');
        for k in 0..3 {
            let key = (uv[k] * 1e4).round().as_uvec2();
            let fresh = coordinates.len() + 1;
            let vt = *coordinates.entry(key).or_insert_with(|| {
                let _ = writeln!(text, "vt {:.4} {:.4}", uv[k].x, uv[k].y);
                fresh
            });
            let v = t[k] + 1;
            let _ = write!(faces, " {v}/{vt}/{v}");
        }
        faces.push('\n');
    }
    for n in normals {
        let _ = writeln!(text, "vn {:.3} {:.3} {:.3}", n.x, n.y, n.z);
    }
    text + &faces
}
