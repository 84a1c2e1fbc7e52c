//! The physics of translucent materials, in `f64` and free of any renderer.
//!
//! Lengths are in mm, coefficients in mm^-1, one colour channel at a time.

pub mod dipole;
pub mod fresnel;
pub mod mixture;
pub mod sampling;
pub mod single;
pub mod specular;

pub use dipole::Dipole;
