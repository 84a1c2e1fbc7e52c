//! What the integration tests share.
#![allow(dead_code, reason = "each test file uses its own part")]

pub mod device;
pub mod media;
pub mod program;
pub mod random;
pub mod shaders;
pub mod shapes;
