//! Sculpts marmor's models as signed-distance fields: the [`statue`] and the
//! fish ([`betta`]). A field is polygonised ([`polygonise`]), thinned out to a
//! few triangle counts ([`decimate`]), checked to be a closed surface
//! ([`mesh`]) and written as OBJ ([`obj`]) or, with its rig, as glTF ([`glb`]).

pub mod betta;
pub mod decimate;
pub mod glb;
pub mod mesh;
pub mod obj;
pub mod polygonise;
pub mod preview;
pub mod sdf;
pub mod statue;

use glam::Vec3;
use mesh::Mesh;
use rayon::prelude::*;

/// Lattice spacing of the polygonisation, mm.
pub const STEP: f32 = 0.25;

/// The statue's file names and triangle counts, finest first.
pub const SIZES: [(&str, usize); 3] = [
    ("statue-20k.obj", 20_000),
    ("statue-5k.obj", 5_000),
    ("statue-1k.obj", 1_000),
];

/// What can be carved.
pub trait Sculpture: Sync {
    /// Names and triangle counts of its meshes, finest first.
    const SIZES: &'static [(&'static str, usize)];

    /// Signed distance, mm, right to first order at the surface.
    fn distance(&self, p: Vec3) -> f32;

    /// A box that holds it.
    fn bounds(&self) -> (Vec3, Vec3);

    /// How dear an error at a point is when triangles are thinned out.
    fn importance(&self, p: Vec3) -> f32;
}

/// One finished mesh.
pub struct Piece {
    /// File name.
    pub name: String,
    /// The surface.
    pub mesh: Mesh,
    /// A shading normal for each vertex.
    pub normals: Vec<Vec3>,
}

/// Moves the vertices of a thinned mesh back on the surface, by 0.1 mm at most
/// and only where no face around turns by more than 45 degrees. (Coarser meshes
/// keep the places that thinning found: they hold the volume.)
fn lay_on_surface(mesh: &mut Mesh, field: &(impl Fn(Vec3) -> f32 + Sync)) {
    let before = mesh.clone();
    mesh.positions.par_iter_mut().for_each(|p| {
        let settled = polygonise::settle(field, *p, 0.1);
        // As written in the file, to 0.0001 mm.
        *p = ((settled.as_dvec3() * 1e4).round() * 1e-4).as_vec3();
    });
    let normal = |m: &Mesh, t| {
        let [a, b, c] = m.corners(t);
        (b - a).cross(c - a).normalize_or_zero()
    };
    loop {
        let turned: Vec<_> = before
            .triangles
            .iter()
            .filter(|&&t| normal(mesh, t).dot(normal(&before, t)) < 0.7)
            .flatten()
            .map(|&i| i as usize)
            .filter(|&i| mesh.positions[i] != before.positions[i])
            .collect();
        if turned.is_empty() {
            break;
        }
        for i in turned {
            mesh.positions[i] = before.positions[i];
        }
    }
}

/// Carves a sculpture from a lattice of spacing `step` mm. The pieces come
/// finest first: the meshes of its `SIZES`, then the undecimated one. Fails if
/// any is not a closed manifold surface.
pub fn carve<S: Sculpture>(sculpture: &S, step: f32) -> Result<Vec<Piece>, String> {
    let field = |p: Vec3| sculpture.distance(p);
    let (lo, hi) = sculpture.bounds();
    let fine = polygonise::polygonise(&field, lo, hi, step);
    fine.check_closed().map_err(|e| format!("fine mesh: {e}"))?;
    let mut decimator = decimate::Decimator::new(&fine, |p| sculpture.importance(p));
    let mut meshes = Vec::new();
    for (name, target) in S::SIZES.iter().copied() {
        decimator.reduce(target);
        let mut mesh = decimator.mesh();
        if target >= 10_000 {
            lay_on_surface(&mut mesh, &field);
        }
        mesh.check().map_err(|e| format!("{name}: {e}"))?;
        let error = mesh.triangles.len().abs_diff(target);
        if error * 20 > target {
            return Err(format!("{name}: {} triangles", mesh.triangles.len()));
        }
        meshes.push((name.to_owned(), mesh));
    }
    meshes.push(("fine".into(), fine));
    Ok(meshes
        .into_par_iter()
        .map(|(name, mesh)| Piece {
            normals: obj::shading_normals(&mesh, &field),
            name,
            mesh,
        })
        .collect())
}
