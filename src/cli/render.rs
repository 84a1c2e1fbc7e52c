//! `marmor render`: one picture.

use super::failure::Failure;
use super::picture::PictureArguments;
use super::progress::Bar;
use super::{Global, print};
use crate::cpu::resolve::resolve;
use crate::cpu::traced;
use crate::frame;
use crate::report::{self, Format, Output, Stats, stats};
use crate::scene::{Plan, Single, defaults};
use clap::Args;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

/// Render one picture
///
/// Flags override the scene file. Lengths are in mm, coefficients in mm^-1, angles in
/// degrees.
#[derive(Args, Debug)]
#[command(after_long_help = "\
Examples:
  marmor render -o statue.png
      the bundled statue in marble
  marmor render bunny.obj --unit 1000 --material skin1 -o bunny.png
      a mesh in metres
  marmor render scene.toml --frames-averaged 64 -o smooth.exr
      edges and noise averaged away, linear values kept
  marmor render --fetch-budget 16 --material skin1 -o skin.png
      the best that 16 fetches a pixel buy
  marmor render --multiple samples --split brdf -o both.png
      translucent on the right, opaque on the left
  marmor render --multiple mixture --split exact --split-at 0.2 -o truth.png
      a fifth of it as the reference has it")]
pub(super) struct Arguments {
    #[command(flatten)]
    picture: PictureArguments,

    /// File to write: .png (8-bit sRGB) or .exr (linear)
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    output: PathBuf,

    /// Also write a JSON document of times, fetches and settings
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    stats: Option<PathBuf>,
}

pub(super) fn run(global: &Global, arguments: &Arguments) -> Result<(), Failure> {
    let format = Format::of(&arguments.output)?;
    let output = Output::check(&arguments.output)?;
    let stats_output = arguments.stats.as_deref().map(Output::check).transpose()?;
    if let Some(stats) = stats_output.as_ref().filter(|stats| stats.is(&output)) {
        return Err(Failure::Input(format!(
            "{}: --stats and --output name the same file; give them different names",
            stats.path().display()
        )));
    }
    let (plan, chosen) = arguments.picture.plan(&global.options())?;

    let mut bar = Bar::new(global.quiet);
    let options = frame::Options {
        // Statistics must tell whose time is whose; a picture alone need not.
        measure: arguments.stats.is_some(),
        ..global.options()
    };
    let picture = frame::render(&options, &plan, &mut |progress| {
        bar.report(progress);
    });
    bar.clear();
    let mut picture = picture?;
    if plan.single == Single::Traced {
        add_traced(&plan, &mut picture, &mut bar);
        bar.clear();
    }
    for message in &picture.validation_messages {
        tracing::warn!("validation: {message}");
    }

    match format {
        Format::Png => report::image::write_png(&output, picture.size, &picture.display)?,
        Format::Exr => report::image::write_exr(&output, picture.size, &picture.radiance)?,
    }
    let measured = measured(picture, global.validation);
    let mut stats = Stats::new(&plan, measured);
    stats.method.budget = chosen.map(stats::Budget::from);
    if let Some(stats_output) = stats_output {
        stats.write(&stats_output)?;
    }
    if global.quiet {
        return Ok(());
    }
    print(&summary(&arguments.output, &stats))
}

/// Adds single scattering by ray casting, and encodes the picture anew.
pub(super) fn add_traced(plan: &Plan, picture: &mut frame::Picture, bar: &mut Bar) {
    let of = traced::rows(plan);
    let shared = Mutex::new((bar, 0));
    let term = traced::picture(plan, &|| {
        // A poisoned lock is that of a bar: draw on.
        let mut shared = shared.lock().unwrap_or_else(PoisonError::into_inner);
        shared.1 += 1;
        let done = shared.1;
        shared.0.report_traced(done, of);
    });
    for ((radiance, display), term) in picture
        .radiance
        .iter_mut()
        .zip(&mut picture.display)
        .zip(term)
    {
        // What the device does not cover by rounding alone stays empty.
        if radiance[3] > 0.0 {
            for (value, more) in radiance.iter_mut().zip(term) {
                *value += more;
            }
        }
        *display = resolve(radiance.map(f64::from), plan.exposure, plan.background);
    }
}

fn measured(picture: frame::Picture, validation: bool) -> stats::Measured {
    stats::Measured {
        device: picture.device,
        driver: picture.driver,
        validation,
        validation_messages: picture.validation_messages,
        passes: picture
            .passes
            .into_iter()
            .map(|time| (time.pass, time.milliseconds))
            .collect(),
        wall_milliseconds: picture.wall_milliseconds,
        fetches: picture.fetches,
    }
}

/// What was written, and what it cost.
fn summary(output: &std::path::Path, stats: &Stats) -> String {
    let [width, height] = stats.method.size;
    let split = match (&stats.method.split, stats.method.split_at) {
        (Some(split), None | Some(defaults::SPLIT_AT)) => format!(" (left half {split})"),
        (Some(split), Some(share)) => format!(" (left {:.0} % {split})", 100.0 * share),
        (None, _) => String::new(),
    };
    // Without a budget the methods are what was asked for.
    let budget = match stats.method.budget {
        Some(budget) => format!(
            "budget of {}: {}, single scattering {}; expected error {:.3}\n",
            budget.fetches, stats.method.multiple, stats.method.single, budget.expected_rr
        ),
        None => String::new(),
    };
    format!(
        "{}: {width}x{height}, {} triangles of {}, {}{split}\n{}: {:.2} ms/frame, {} fetches/pixel\n{budget}",
        output.display(),
        stats.scene.triangles,
        stats.scene.material.name,
        stats.method.multiple,
        stats.device.name,
        stats.times.wall,
        stats.fetches.per_pixel,
    )
}
