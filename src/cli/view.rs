//! `marmor view`: the window.

use super::Global;
use super::failure::Failure;
use super::picture::PictureArguments;
use super::values;
use crate::frame;
use crate::gpu::PresentMode;
use crate::scene::{defaults, names};
use crate::view::session::Draft;
use crate::view::{self, Settings};
use clap::Args;
use std::path::PathBuf;

/// Open a window: turn the object and the light, and see what it costs
///
/// Drag to turn, right-drag to turn the light, wheel to zoom; F1 lists the keys. P saves the picture with a scene file that
/// `marmor render` draws the same picture from.
#[derive(Args, Debug)]
#[command(after_long_help = "\
Examples:
  marmor view
      the bundled statue in marble
  marmor view betta --multiple mixture
      a fish that swims
  marmor view scene.toml --split brdf
      translucent against opaque, with a line to drag
  marmor view --watch
      with shaders that reload as they are saved")]
pub(super) struct Arguments {
    #[command(flatten)]
    picture: PictureArguments,

    /// Width and height of the window at first, pixels [default: 1280x800, or what holds a picture of the --size asked for]
    #[arg(long, value_name = "WxH", value_parser = values::size, allow_hyphen_values = true, help_heading = "Window")]
    window: Option<[u32; 2]>,

    /// When a frame may be shown: with the display's refresh in turn, with it the newest first, or at once
    #[arg(long, value_name = "fifo|mailbox|immediate", default_value = "fifo", value_parser = present, help_heading = "Window")]
    present: PresentMode,

    /// Size of the picture while something moves; auto takes the largest that is drawn in 40 ms
    #[arg(long, value_name = "auto|full|half|third|quarter", default_value = "auto", value_parser = in_motion, help_heading = "Window")]
    in_motion: Draft,

    /// Reload the shaders of this folder when they change
    #[arg(long, value_name = "FOLDER", num_args = 0..=1, default_missing_value = "shaders", help_heading = "Window")]
    watch: Option<PathBuf>,

    /// The folder that P saves to
    #[arg(
        long,
        value_name = "FOLDER",
        default_value = ".",
        help_heading = "Window"
    )]
    saves: PathBuf,
}

fn present(name: &str) -> Result<PresentMode, String> {
    let all = [
        PresentMode::Fifo,
        PresentMode::Mailbox,
        PresentMode::Immediate,
    ];
    named(name, all, PresentMode::NAMES, "way to present")
}

fn in_motion(name: &str) -> Result<Draft, String> {
    named(name, Draft::ALL, Draft::NAMES, "size in motion")
}

/// That of `all` which has `name` among those they are `known` by; `what` they are, for who misspells it.
fn named<T, const N: usize>(
    name: &str,
    all: [T; N],
    known: [&str; N],
    what: &str,
) -> Result<T, String> {
    let mut pairs = all.into_iter().zip(known);
    let found = pairs.find_map(|(value, own)| (own == name).then_some(value));
    found.ok_or_else(|| {
        let remedy = names::remedy(name, &known);
        format!("unknown {what} \"{name}\"; {remedy}")
    })
}

pub(super) fn run(global: &Global, arguments: &Arguments) -> Result<(), Failure> {
    let request = arguments.picture.request()?;
    let settings = Settings {
        size: arguments.window.unwrap_or(match request.size {
            defaults::SIZE => Settings::WINDOW,
            size => Settings::window_of(size),
        }),
        present: arguments.present,
        in_motion: arguments.in_motion,
        watch: arguments.watch.clone(),
        saves: arguments.saves.clone(),
    };
    view::run(&global.options(), request, &settings)?;
    Ok(())
}

impl From<view::Error> for Failure {
    fn from(error: view::Error) -> Self {
        match error {
            view::Error::Input(message) => Failure::Input(message),
            view::Error::Start(message) => Failure::Device(message),
            view::Error::Device(error) => frame::Error::from(error).into(),
        }
    }
}
