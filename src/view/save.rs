//! The picture as files: what is shown, what is measured, and the scene that `marmor render` draws it from.

use super::Error;
use super::session::Read;
use crate::report::{self, Output};
use crate::scene::Request;
use std::path::{Path, PathBuf};

/// Saves `read` as PNG and EXR beside a scene file of `request`, under the first number that is free in `folder`. Returns
/// the path of the PNG.
///
/// # Errors
/// [`Error::Input`] naming what cannot be written.
pub fn save(folder: &Path, request: &Request, read: &Read) -> Result<PathBuf, Error> {
    let fault = |path: &Path, error: &dyn std::fmt::Display| {
        Error::Input(format!("{}: cannot be written ({error})", path.display()))
    };
    std::fs::create_dir_all(folder).map_err(|error| fault(folder, &error))?;
    let stem = |number: u32| folder.join(format!("marmor-{number:03}"));
    let free = (1..=9999).map(stem).find(|stem| {
        ["png", "exr", "toml"]
            .iter()
            .all(|end| !stem.with_extension(end).exists())
    });
    let stem = free.ok_or_else(|| {
        Error::Input(format!(
            "{}: holds 9999 pictures; choose another folder with --saves",
            folder.display()
        ))
    })?;
    let refused = |error: report::Error| Error::Input(error.to_string());
    let [png, exr, toml] = ["png", "exr", "toml"].map(|end| stem.with_extension(end));
    let scene = request.to_toml().map_err(|error| fault(&toml, &error))?;
    report::image::write_exr(
        &Output::check(&exr).map_err(refused)?,
        read.size,
        &read.radiance,
    )
    .map_err(refused)?;
    Output::check(&toml)
        .map_err(refused)?
        .write(|file| std::io::Write::write_all(file, scene.as_bytes()))
        .map_err(refused)?;
    // Last: who waits for it finds all three.
    report::image::write_png(
        &Output::check(&png).map_err(refused)?,
        read.size,
        &read.display,
    )
    .map_err(refused)?;
    tracing::info!("saved {}", png.display());
    Ok(png)
}
