//! Thin tools over ash: what any Vulkan program needs, ignorant of scattering.
//!
//! Objects own a share of the [`Device`] and destroy themselves, so that teardown
//! follows from ownership. Nothing here records a barrier or waits on its own:
//! synchronisation is the caller's, in plain sight.

pub mod barrier;
#[cfg(test)]
mod canary;
pub mod descriptor;
pub mod device;
pub mod image;
pub mod instance;
mod kept;
pub mod memory;
pub mod pipeline;
pub mod query;
pub mod submit;
pub mod swapchain;

pub use barrier::Use;
pub use descriptor::{Binding, DescriptorSets};
pub use device::{Candidate, Device, Tally};
pub use image::{Image, ImageDesc, Sampler};
pub use instance::Instance;
pub use memory::{Buffer, Location};
pub use pipeline::{
    ComputePipeline, GraphicsDesc, GraphicsPipeline, RenderPass, Shader, ShaderBuild, ShaderSource,
};
pub use query::{Statistics, Timestamps};
pub use submit::Slot;
pub use swapchain::{Handles, PresentMode, Semaphore, Surface, Swapchain, Turn};

use ash::vk;

/// What can go wrong between the program and the driver.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// No Vulkan loader, layer or usable device; the message holds the remedy.
    #[error("{0}")]
    NoDevice(String),
    /// The device has not enough memory for the named object.
    #[error("out of memory for {what}{}", .bytes.map(|b| format!(" ({} MiB)", b.div_ceil(1 << 20))).unwrap_or_default())]
    OutOfMemory {
        /// The object that was being allocated.
        what: String,
        /// Its size in bytes, where it is known.
        bytes: Option<u64>,
    },
    /// What was asked is beyond this device, or beyond the method; the message says which.
    #[error("{0}")]
    Unsupported(String),
    /// Whoever asked for the work wants it no longer.
    #[error("stopped")]
    Stopped,
    /// A shader that is not the program's own is at fault; the message is the compiler's.
    #[error("{0}")]
    Shader(String),
    /// The driver lost the device.
    #[error("the driver lost the device during {0}; run again, or choose another with --device")]
    DeviceLost(&'static str),
    /// Any other error code of a Vulkan call.
    #[error("{call} failed with {result}")]
    Vulkan {
        /// The Vulkan function.
        call: &'static str,
        /// What it returned.
        result: vk::Result,
    },
}

impl Error {
    /// Whether the device, or the driver, can no longer be trusted. Else something did not fit, and what was there before
    /// goes on.
    pub fn is_fatal(&self) -> bool {
        matches!(
            self,
            Error::NoDevice(_) | Error::DeviceLost(_) | Error::Vulkan { .. }
        )
    }
}

/// A result of this layer.
pub type Result<T> = std::result::Result<T, Error>;

/// Locks `mutex`. A thread that panicked with it held leaves what Vulkan handles allow: nothing
/// half-changed, so its poison is of no matter.
pub(crate) fn lock<T>(mutex: &std::sync::Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// Turns the result of the Vulkan function `call` into ours.
pub(crate) fn check<T>(call: &'static str, result: ash::prelude::VkResult<T>) -> Result<T> {
    result.map_err(|result| match result {
        vk::Result::ERROR_DEVICE_LOST => Error::DeviceLost(call),
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
            Error::OutOfMemory {
                what: call.to_owned(),
                bytes: None,
            }
        }
        result => Error::Vulkan { call, result },
    })
}
