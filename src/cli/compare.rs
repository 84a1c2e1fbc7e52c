//! `marmor compare`: how far one picture is from another.

use super::failure::Failure;
use super::{print, values};
use crate::report::{Comparison, Domain, Image, compare, heatmap, image};
use clap::Args;
use std::path::PathBuf;

/// Compare a picture to a reference: rr, RMSE, PSNR, SSIM, FLIP
///
/// Only pixels that the reference covers count (alpha above 0.999; all, without alpha);
/// SSIM and FLIP see the whole picture as a display shows it, on black.
///
/// rr, the relative RMSE, is measured on linear values: the root of the mean, over covered
/// pixels and channels, of (difference / mean of the reference's channel)^2. RMSE, PSNR and
/// the mean difference are measured on display-encoded values (peak 1) between two PNGs,
/// else on linear values (peak: the largest of the reference).
#[derive(Args, Debug)]
#[command(after_long_help = "\
Examples:
  marmor compare truth.exr fast.exr
  marmor compare truth.exr fast.exr --max-rr 0.05 --map errors.png
  marmor compare truth.png fast.png --json")]
pub(super) struct Arguments {
    /// The picture that counts as true: .png or .exr
    reference: PathBuf,

    /// The picture in question: .png or .exr, of the same size
    image: PathBuf,

    /// Write the relative error of every pixel as a picture with its scale (.png)
    #[arg(long, value_name = "FILE")]
    map: Option<PathBuf>,

    /// Exit with 1 where rr is above this
    #[arg(long, value_name = "X", value_parser = values::non_negative, allow_hyphen_values = true)]
    max_rr: Option<f64>,

    /// Print JSON; what is infinite is null
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let map = super::map_output(arguments.map.as_deref())?;
    let reference = Image::read(&arguments.reference)?;
    let image = Image::read(&arguments.image)?;
    let comparison = compare(&reference, &image)?;
    if let Some(output) = map {
        let map = heatmap::draw(&reference, &image)?;
        image::write_png(&output, map.size, &map.pixels)?;
    }
    if arguments.json {
        let json = serde_json::to_string_pretty(&comparison)
            .map_err(|error| Failure::Input(format!("cannot be written as JSON ({error})")))?;
        print(&(json + "\n"))?;
    } else {
        print(&table(&comparison))?;
    }
    match arguments.max_rr {
        None => Ok(()),
        // Asked this way round, NaN does not pass.
        Some(allowed) if comparison.rr <= allowed => Ok(()),
        Some(allowed) => Err(Failure::Check(format!(
            "{}: rr {:.6} is above the {allowed} that --max-rr allows",
            image.name, comparison.rr
        ))),
    }
}

fn table(comparison: &Comparison) -> String {
    let [width, height] = comparison.size;
    let [r, g, b] = comparison.mean_difference;
    let pixels = u64::from(width) * u64::from(height);
    let share = 100.0 * comparison.covered as f64 / pixels.max(1) as f64;
    let domain = match comparison.domain {
        Domain::Display => "display-encoded",
        Domain::Linear => "linear",
    };
    let mut table = format!(
        "rr     {:.6}\n\
         RMSE   {:.6}  ({domain})\n\
         PSNR   {:.2} dB  (peak {:.6})\n\
         SSIM   {:.6}\n\
         FLIP   {:.6}\n\
         mean   {r:+.6} {g:+.6} {b:+.6}  (picture - reference, {domain})\n\
         over   {} of {pixels} pixels ({share:.1} %)\n",
        comparison.rr,
        comparison.rmse,
        comparison.psnr,
        comparison.peak,
        comparison.ssim,
        comparison.flip,
        comparison.covered,
    );
    for note in &comparison.notes {
        table.push_str(&format!("note   {note}\n"));
    }
    table
}
