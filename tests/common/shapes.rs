//! Small meshes with exact normals.

use std::collections::HashMap;

use glam::DVec3;
use marmor::scene::Mesh;

/// Mesh of `positions` and `normals` without texture coordinates.
fn mesh(positions: Vec<DVec3>, normals: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Mesh {
    let uvs = vec![[0.0; 2]; positions.len()];
    Mesh {
        positions,
        normals,
        uvs,
        triangles,
    }
}

/// The parallelogram center +- a +- b, whose normal is a x b, as two triangles.
pub fn plane(center: DVec3, a: DVec3, b: DVec3) -> Mesh {
    let positions = vec![
        center - a - b,
        center + a - b,
        center + a + b,
        center - a + b,
    ];
    let normals = vec![a.cross(b).normalize(); 4];
    mesh(positions, normals, vec![[0, 1, 2], [0, 2, 3]])
}

/// The box of half the sides `half` around the origin, with the normals of its faces.
pub fn cuboid(half: DVec3) -> Mesh {
    let faces = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|n| {
        // a x b = n, and (-a) x b = -n.
        let (a, b) = (
            DVec3::new(n.z, n.x, n.y) * half,
            DVec3::new(n.y, n.z, n.x) * half,
        );
        [plane(n * half, a, b), plane(-n * half, -a, b)]
    });
    faces.fold(mesh(Vec::new(), Vec::new(), Vec::new()), joined)
}

/// Disc around the origin, whose normal is +Z, `sides` triangles.
pub fn disc(radius: f64, sides: u32) -> Mesh {
    let rim = (0..sides).map(|k| {
        let angle = std::f64::consts::TAU * f64::from(k) / f64::from(sides);
        DVec3::new(angle.cos(), angle.sin(), 0.0) * radius
    });
    let positions: Vec<DVec3> = std::iter::once(DVec3::ZERO).chain(rim).collect();
    let normals = vec![DVec3::Z; positions.len()];
    let triangles = (0..sides)
        .map(|k| [0, 1 + k, 1 + (k + 1) % sides])
        .collect();
    mesh(positions, normals, triangles)
}

/// Sphere around the origin, an icosahedron divided `levels` times.
pub fn sphere(radius: f64, levels: u32) -> Mesh {
    radial(levels, |d| (radius * d, d))
}

/// Sphere of mean radius `radius` (mm) with sine bumps of up to a third of it: it casts shadows
/// on itself.
pub fn bumpy(radius: f64, levels: u32) -> Mesh {
    // Frequency vector, phase and amplitude of each bump.
    let bumps = [
        (DVec3::new(5.0, 2.0, -1.0), 0.3, 0.16),
        (DVec3::new(-3.0, 6.0, 4.0), 1.9, 0.10),
        (DVec3::new(2.0, -5.0, 9.0), 4.1, 0.06),
    ];
    radial(levels, |d| {
        let (mut r, mut gradient) = (radius, DVec3::ZERO);
        for (frequency, phase, amplitude) in bumps {
            let angle = frequency.dot(d) + phase;
            r += radius * amplitude * angle.sin();
            gradient += radius * amplitude * angle.cos() * frequency;
        }
        // The surface is |x| - r(x/|x|) = 0; its normal is that function's gradient.
        let tangential = gradient - gradient.dot(d) * d;
        (r * d, (d - tangential / r).normalize())
    })
}

/// `extra` appended to `base`.
pub fn joined(base: Mesh, extra: Mesh) -> Mesh {
    let offset = base.positions.len() as u32;
    let mut all = base;
    all.positions.extend(extra.positions);
    all.normals.extend(extra.normals);
    all.uvs.extend(extra.uvs);
    all.triangles
        .extend(extra.triangles.iter().map(|t| t.map(|i| i + offset)));
    all
}

/// `mesh` moved by `offset` (mm).
pub fn moved(mesh: &Mesh, offset: DVec3) -> Mesh {
    let mut mesh = mesh.clone();
    for p in &mut mesh.positions {
        *p += offset;
    }
    mesh
}

/// Each triangle split into four at the middle of its edges, without rounding the shape.
///
/// New normals are means and not normalised, for only so do they interpolate to what they did
/// before.
pub fn subdivided(mesh: &Mesh) -> Mesh {
    let mut out = mesh.clone();
    let mut middles = HashMap::new();
    out.triangles = split(&mesh.triangles, |a, b| {
        *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            let (i, j) = (a as usize, b as usize);
            out.positions
                .push((mesh.positions[i] + mesh.positions[j]) * 0.5);
            out.normals.push((mesh.normals[i] + mesh.normals[j]) * 0.5);
            out.uvs.push([0.0; 2]);
            out.positions.len() as u32 - 1
        })
    });
    out
}

/// A star-shaped mesh: `surface` gives position and unit normal in each direction.
fn radial(levels: u32, surface: impl Fn(DVec3) -> (DVec3, DVec3)) -> Mesh {
    let (mut directions, mut triangles) = icosahedron();
    for _ in 0..levels {
        let mut middles = HashMap::new();
        triangles = split(&triangles, |a, b| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                let middle = directions[a as usize] + directions[b as usize];
                directions.push(middle.normalize());
                directions.len() as u32 - 1
            })
        });
    }
    let (positions, normals) = directions.into_iter().map(surface).unzip();
    mesh(positions, normals, triangles)
}

/// Four triangles for each one; `middle` returns the vertex between two.
fn split(triangles: &[[u32; 3]], mut middle: impl FnMut(u32, u32) -> u32) -> Vec<[u32; 3]> {
    let mut out = Vec::with_capacity(4 * triangles.len());
    for &[a, b, c] in triangles {
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        out.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    out
}

/// Unit vertices and outward counter-clockwise faces.
fn icosahedron() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let phi = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut vertices = Vec::new();
    for a in [-1.0, 1.0] {
        for b in [-phi, phi] {
            vertices.extend([
                DVec3::new(0.0, a, b),
                DVec3::new(a, b, 0.0),
                DVec3::new(b, 0.0, a),
            ]);
        }
    }
    // Faces are the triples at edge length 2.
    let near = |i: usize, j: usize| (vertices[i].distance(vertices[j]) - 2.0).abs() < 1e-9;
    let mut faces = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if near(i, j) && near(j, k) && near(i, k) {
                    let (a, b, c) = (vertices[i], vertices[j], vertices[k]);
                    let outward = (b - a).cross(c - a).dot(a) > 0.0;
                    let (j, k) = if outward { (j, k) } else { (k, j) };
                    faces.push([i as u32, j as u32, k as u32]);
                }
            }
        }
    }
    (vertices.into_iter().map(DVec3::normalize).collect(), faces)
}
