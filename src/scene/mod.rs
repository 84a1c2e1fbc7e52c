//! What is rendered: mesh, material, light, camera, and the plan to render them by.
//!
//! Knows nothing of Vulkan. Lengths are in mm, coefficients in mm^-1, angles in degrees.

pub mod bundled;
mod bytes;
pub mod camera;
pub mod clip;
pub mod color;
pub mod defaults;
pub mod deformer;
pub mod error;
pub mod file;
pub mod framing;
pub mod gltf;
pub mod keys;
pub mod light;
pub mod limits;
pub mod material;
pub mod mesh;
pub mod model;
pub mod motion;
pub mod names;
pub mod obj;
pub mod plan;
pub mod preset;
pub mod pyramid;
pub mod request;
pub mod sequence;
pub mod volume;
mod written;

pub use bundled::Bundled;
pub use camera::{Camera, View};
pub use clip::Clip;
pub use deformer::Deformer;
pub use error::Error;
pub use framing::Viewpoint;
pub use light::{Light, LightFrame};
pub use material::Material;
pub use mesh::Mesh;
pub use model::{Model, Pose};
pub use motion::{Animation, Moment, Motion};
pub use plan::{
    Exits, Fourth, Jitter, March, Method, Mixture, Multiple, Part, Plan, Scattering, Single, Taps,
};
pub use request::{MeshSource, Request};

/// One mesh of one material under one light, seen by one camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Where the scene came from, for messages.
    pub name: String,
    /// The geometry, mm.
    pub mesh: Mesh,
    /// The medium inside it.
    pub material: Material,
    /// The light.
    pub light: Light,
    /// The camera.
    pub camera: Camera,
}
