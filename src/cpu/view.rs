//! The view pass: what the camera sees.

use glam::{DVec3, DVec4};
use rayon::prelude::*;

use crate::cpu::raster::{self, Cull};
use crate::scene::{Mesh, View};

/// The geometry behind each pixel, row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct GBuffer {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Depth-buffer value in [0, 1); 1 where nothing is seen.
    pub depth: Vec<f64>,
    /// Unit normal, turned to the side of the surface that is seen; 0 where nothing is.
    pub normal: Vec<DVec3>,
    /// Depth-buffer value of the nearest back face, where the view ray leaves the object; 1 for
    /// none.
    pub back_depth: Vec<f64>,
    /// Outward unit normal of that face; 0 for none.
    pub back_normal: Vec<DVec3>,
}

/// Draws the geometry buffer of `mesh` as `view` sees it, in `width` x `height` pixels: of a solid
/// ([`Mesh::is_solid_from`]) the front faces, else every face.
///
/// `view` must have been made for that picture size.
pub fn draw(mesh: &Mesh, view: &View, width: usize, height: usize) -> GBuffer {
    let clip: Vec<DVec4> = mesh
        .positions
        .iter()
        .map(|p| view.view_proj * p.extend(1.0))
        .collect();
    // An open sheet is seen from both sides; of a solid back faces are seen by rounding alone.
    let cull = if mesh.is_solid_from(view.eye) {
        Cull::Back
    } else {
        Cull::None
    };
    let nearest = raster::rasterise(&clip, &mesh.triangles, width, height, cull);
    let back = raster::rasterise(&clip, &mesh.triangles, width, height, Cull::Front);
    let normal = nearest
        .par_iter()
        .map(|fragment| {
            fragment.map_or(DVec3::ZERO, |f| {
                let turn = if f.front_facing { 1.0 } else { -1.0 };
                turn * super::light::normal(mesh, &f)
            })
        })
        .collect();
    GBuffer {
        width,
        height,
        depth: nearest.iter().map(|f| f.map_or(1.0, |f| f.depth)).collect(),
        normal,
        back_depth: back.iter().map(|f| f.map_or(1.0, |f| f.depth)).collect(),
        back_normal: back
            .par_iter()
            .map(|f| f.map_or(DVec3::ZERO, |f| super::light::normal(mesh, &f)))
            .collect(),
    }
}
