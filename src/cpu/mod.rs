//! The CPU twin of every GPU stage, in `f64`: what the shaders are checked against.
//!
//! Each module bears the name of the pass and of the shader that it repeats.

pub mod boxes;
pub mod compose;
pub mod deform;
pub mod light;
pub mod raster;
pub mod reduce;
pub mod resolve;
pub mod shade;
pub mod traced;
pub mod view;
pub mod volume;

pub use light::LightMap;
pub use view::GBuffer;
