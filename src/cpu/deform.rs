//! The deform pass: the mesh of a model at one instant, morphed, skinned and bent.
//!
//! Twin of `deform.comp` and [`crate::frame`]'s pass of the same name. The steps themselves are
//! [`Model::posed`]: where a mesh lies is also what framing and light map are fitted to.

use crate::scene::{Mesh, Model, Pose};
use glam::DVec3;

/// The mesh of `model` in `pose`, mm, relative to `center`, as the pass leaves it for the light and the camera.
pub fn deform(model: &Model, pose: &Pose, center: DVec3) -> Mesh {
    let mut mesh = model.posed(pose);
    for position in &mut mesh.positions {
        *position -= center;
    }
    mesh
}
