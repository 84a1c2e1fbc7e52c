//! `marmor bench reduce`: ways to reduce the light map, side by side.

use super::super::failure::Failure;
use super::super::{Global, print, values};
use crate::frame::measure;
use crate::report::{Bench, Output, bench};
use clap::Args;
use std::path::PathBuf;

/// Ways to reduce the light map to its MIP pyramid
///
/// levels: one compute dispatch a level, as the frame does it. shared: one dispatch in all, with
/// tiles in shared memory. blit: one vkCmdBlitImage with a linear filter a level, to which the
/// others are compared.
#[derive(Args, Debug)]
#[command(after_long_help = "\
Examples:
  marmor bench reduce
  marmor bench reduce --light-map 1024 --rounds 100 --json reduce.json")]
pub(super) struct Arguments {
    /// Texels along a side of the light map, 16 to 8192
    #[arg(long, value_name = "TEXELS", default_value = "512", value_parser = values::light_map, allow_hyphen_values = true)]
    light_map: u32,

    /// How often each is measured, 1 to 10000
    #[arg(long, value_name = "COUNT", default_value = "30", value_parser = values::rounds, allow_hyphen_values = true)]
    rounds: u32,

    /// Write the times as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

pub(super) fn run(global: &Global, arguments: &Arguments) -> Result<(), Failure> {
    let json = arguments.json.as_deref().map(Output::check).transpose()?;
    let options = global.options();
    let measured = measure::reduce(&options, arguments.light_map, arguments.rounds)?;
    for message in &measured.validation_messages {
        tracing::error!("validation: {message}");
    }
    let times = measured
        .times
        .into_iter()
        .map(|times| (times.name.to_owned(), times.milliseconds))
        .collect();
    let bench = Bench {
        marmor: env!("CARGO_PKG_VERSION"),
        bench: "reduce",
        device: measured.device,
        driver: measured.driver,
        validation: options.validation,
        light_map: arguments.light_map,
        rounds: arguments.rounds,
        reference: measure::BLIT,
        ways: bench::rows(times, measure::BLIT),
        notes: measured.notes,
        validation_messages: measured.validation_messages,
    };
    if let Some(output) = &json {
        bench.write(output)?;
    }
    print(&bench.table())
}
