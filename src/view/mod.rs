//! The window: a picture that one can turn, light and measure, and a panel that says what it costs.
//!
//! - [`session`]: what is drawn, and by which renderer
//! - `window`: the system's window, its events and its frames
//! - `events`: its events, as the panel can take them in
//! - `panel`: what stands beside the picture
//! - [`lens`]: what is looked at in its place: the images that it is made of, fetches, errors
//! - [`worker`]: what takes too long for a frame of the window, and [`region`], the error of a rectangle
//! - [`orbit`]: what a drag does to camera and light
//! - `save`: the picture as files that `marmor render` reproduces

mod events;
pub mod lens;
pub mod orbit;
pub mod paint;
mod panel;
pub mod region;
mod save;
pub mod session;
mod style;
mod timing;
mod window;
pub mod worker;

use crate::frame::Options;
use crate::gpu::{self, PresentMode};
use crate::scene::Request;
use session::Draft;
use std::path::PathBuf;

/// How the window is opened.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Its width and height at first, pixels.
    pub size: [u32; 2],
    /// When a frame may be shown.
    pub present: PresentMode,
    /// At which size frames are drawn while something moves.
    pub in_motion: Draft,
    /// The folder of shaders that are watched and reloaded, if any are.
    pub watch: Option<PathBuf>,
    /// The folder that pictures are saved to.
    pub saves: PathBuf,
}

impl Settings {
    /// Width and height of a window where nobody says, pixels.
    pub const WINDOW: [u32; 2] = [1280, 800];

    /// Width and height of the window in which a picture has `size` pixels, on a display with one pixel a point.
    pub fn window_of(size: [u32; 2]) -> [u32; 2] {
        [
            size[0].saturating_add(style::WIDTH as u32),
            size[1].saturating_add(style::STRIP as u32),
        ]
    }
}

/// Why the window closed, or never opened.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// What was asked for cannot be drawn.
    #[error("{0}")]
    Input(String),
    /// There is no display, no window or no device for it.
    #[error("{0}")]
    Start(String),
    /// The device failed.
    #[error("{0}")]
    Device(gpu::Error),
}

/// What a session in the window was like.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Summary {
    /// Frames of the window.
    pub frames: u64,
    /// The longest that one kept the window from answering, ms.
    pub longest: f64,
    /// Messages of the validation layer.
    pub messages: usize,
}

/// Opens the window on `request`, and returns when it is closed.
///
/// # Errors
/// [`Error::Start`] without a display or a device that shows pictures on it, [`Error::Input`] where the first picture cannot
/// be drawn, [`Error::Device`] where the device fails.
pub fn run(options: &Options, request: Request, settings: &Settings) -> Result<Summary, Error> {
    window::run(options, request, settings)
}
