//! `marmor fetches`: what a plan reads, declared, found and measured.

use super::failure::Failure;
use super::picture::PictureArguments;
use super::progress::Bar;
use super::{Global, print, values};
use crate::frame;
use crate::report::{fetches::Document, heatmap, image};
use clap::Args;
use std::path::PathBuf;

/// Account for every texture fetch of a picture
///
/// Three accounts, pass by pass and term by term: what the plan declares, what stands in the SPIR-V (every read, times
/// the trips of the loops around it), and what a counting build of the same shaders measures in every pixel. Exits with
/// 1 where they differ.
///
/// A fetch is one executed instruction that reads a texture. Reads of input attachments, and what the passes over the
/// light map read for each texel that they write, have lines of their own and are no fetches of a pixel.
#[derive(Args, Debug)]
#[command(after_long_help = "\
Examples:
  marmor fetches
  marmor fetches --multiple mixture --moments 4 --sites
  marmor fetches --multiple samples --samples 16 --budget 24
  marmor fetches --fetch-budget 16
  marmor fetches scene.toml --heatmap fetches.png --json")]
pub(super) struct Arguments {
    #[command(flatten)]
    picture: PictureArguments,

    /// Write the fetches of every pixel as a picture with its scale (.png)
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    heatmap: Option<PathBuf>,

    /// Exit with 1 where a pixel makes more fetches than this
    #[arg(long, value_name = "N", value_parser = values::budget, allow_hyphen_values = true, help_heading = "Output")]
    budget: Option<u32>,

    /// List every read: file, line, function, loops and trips
    #[arg(long, conflicts_with = "json", help_heading = "Output")]
    sites: bool,

    /// Print JSON
    #[arg(long, help_heading = "Output")]
    json: bool,
}

pub(super) fn run(global: &Global, arguments: &Arguments) -> Result<(), Failure> {
    let map = super::map_output(arguments.heatmap.as_deref())?;
    let (plan, _) = arguments.picture.plan(&global.options())?;
    if plan.split.is_some() {
        return Err(Failure::Input(
            "--split: the ledger is of one method; leave it out, or account for each part on its own"
                .to_owned(),
        ));
    }
    let mut bar = Bar::new(global.quiet);
    let counted = frame::count(&global.options(), &plan, &mut |progress| {
        bar.report(progress)
    });
    bar.clear();
    let counted = counted?;
    for message in &counted.validation_messages {
        tracing::error!("validation: {message}");
    }
    let ledger = &counted.ledger;
    let document = Document::new(
        ledger,
        [counted.device, counted.driver, plan.scene.name.clone()],
        plan.size,
        [plan.method_name(), plan.single.to_string()],
    );
    if let Some(output) = map {
        let map = heatmap::fetches(plan.size, &ledger.pixels, ledger.declared() as u32);
        image::write_png(&output, map.size, &map.pixels)?;
    }
    if arguments.json {
        let json = serde_json::to_string_pretty(&document)
            .map_err(|error| Failure::Input(format!("cannot be written as JSON ({error})")))?;
        print(&(json + "\n"))?;
    } else {
        print(&document.table(arguments.sites))?;
    }
    if let [first, rest @ ..] = document.disagreements.as_slice() {
        let more = match rest.len() {
            0 => String::new(),
            n => format!(" (and {n} more)"),
        };
        return Err(Failure::Check(format!(
            "the accounts differ: {first}{more}"
        )));
    }
    if let Some(budget) = arguments.budget
        && let Some((term, sum)) = ledger.breaks(budget)
    {
        return Err(Failure::Check(format!(
            "the budget of {budget} fetches a pixel breaks in pass {}, term {}: {sum} with it, {} in all",
            term.pass,
            term.term,
            ledger.most().map_or(ledger.declared(), f64::from),
        )));
    }
    Ok(())
}
