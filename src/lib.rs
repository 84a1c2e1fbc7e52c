//! Real-time subsurface scattering in raw Vulkan, after *Real-time subsurface scattering on
//! the GPU* (Bouthors, Bruneton, Neyret, Max 2007), with every texture fetch accounted for.
//!
//! Lengths are in mm and coefficients in mm^-1 throughout.
//!
//! - [`scene`]: what is rendered, and the plan to render it by
//! - [`optics`]: the physics, pure f64
//! - [`cpu`]: the f64 twin of each GPU stage, of the same name
//! - [`gpu`]: thin tools over ash, ignorant of scattering
//! - [`frame`]: the renderer; its front page is the frame
//! - [`ledger`]: what each pass fetches
//! - [`report`]: images, comparisons, statistics
//! - [`view`]: the window
//! - [`cli`]: the command line

#![warn(missing_docs)]

pub mod cli;
pub mod cpu;
pub mod frame;
pub mod gpu;
pub mod ledger;
pub mod optics;
pub mod report;
pub mod scene;
pub mod view;
