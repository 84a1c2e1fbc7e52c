//! Runs the binary as a user does.

// Each test crate uses its own part of this module.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The binary, with the tester's own settings kept out.
pub fn marmor() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_marmor"));
    command.env_remove("MARMOR_DEVICE").env_remove("NO_COLOR");
    command
}

/// What a run left behind.
pub struct Ran {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

/// Runs the binary in `folder`.
pub fn run(folder: &Path, arguments: &[&str]) -> Ran {
    let Output {
        status,
        stdout,
        stderr,
    } = marmor()
        .current_dir(folder)
        .args(arguments)
        .output()
        .expect("the binary runs");
    Ran {
        code: status.code().expect("no signal"),
        stdout: String::from_utf8(stdout).expect("UTF-8"),
        stderr: String::from_utf8(stderr).expect("UTF-8"),
    }
}

/// An empty folder that goes with the test.
pub fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a folder")
}

/// Writes a file into a folder.
pub fn file(folder: &Path, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, content).expect("written");
    path
}

/// The names in a folder, sorted.
pub fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .expect("readable")
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .to_string_lossy()
                .into()
        })
        .collect();
    names.sort();
    names
}

/// Writes an EXR of linear RGBA.
pub fn exr(folder: &Path, name: &str, size: [u32; 2], pixel: impl Fn(u32, u32) -> [f32; 4]) {
    image::Rgba32FImage::from_fn(size[0], size[1], |x, y| image::Rgba(pixel(x, y)))
        .save(folder.join(name))
        .expect("written");
}

/// Writes a PNG of 8-bit sRGB.
pub fn png(folder: &Path, name: &str, size: [u32; 2], pixel: impl Fn(u32, u32) -> [u8; 4]) {
    image::RgbaImage::from_fn(size[0], size[1], |x, y| image::Rgba(pixel(x, y)))
        .save(folder.join(name))
        .expect("written");
}
