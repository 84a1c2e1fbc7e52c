//! The command line: raw arguments become one validated plan, and the plan runs.
//!
//! Results go to stdout. What went wrong goes to stderr as one line that names the file
//! or flag and the remedy.

mod animate;
mod bench;
mod compare;
mod completions;
mod devices;
mod failure;
mod fetches;
mod man;
mod pareto;
mod picture;
mod progress;
mod render;
mod values;
mod view;

use crate::frame;
use crate::report::{Format, Output};
use clap::{ArgAction, Args, CommandFactory, Parser, Subcommand};
use failure::Failure;
use std::ffi::OsString;
use std::io::{IsTerminal, Write};
use std::path::Path;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// How a command ended. The codes are part of the interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// Done.
    Done,
    /// A check did not hold, such as `compare --max-rr`.
    CheckFailed,
    /// Bad usage or input.
    BadInput,
    /// No usable device.
    NoDevice,
}

impl Exit {
    /// The process's exit code.
    pub fn code(self) -> u8 {
        match self {
            Exit::Done => 0,
            Exit::CheckFailed => 1,
            Exit::BadInput => 2,
            Exit::NoDevice => 3,
        }
    }
}

/// Real-time subsurface scattering in raw Vulkan, with every texture fetch accounted for.
///
/// Draws translucent objects (marble, milk, skin) from a single mesh, one directional
/// light and measured scattering coefficients.
#[derive(Parser, Debug)]
#[command(
    name = "marmor",
    version,
    max_term_width = 100,
    subcommand_required = true,
    arg_required_else_help = true,
    after_long_help = "\
Examples:
  marmor render -o statue.png
  marmor render scene.toml --material skin1 --light 150,20 -o skin.png
  marmor view --multiple mixture
  marmor render --multiple exact -o truth.exr
  marmor compare truth.exr fast.exr --max-rr 0.05
  marmor fetches --multiple mixture --budget 20
  marmor bench reduce
  marmor devices

Exit codes:
  0  done
  1  a check did not hold (compare --max-rr, fetches --budget)
  2  bad usage or input
  3  no usable device"
)]
struct Cli {
    #[command(flatten)]
    global: Global,
    #[command(subcommand)]
    command: Command,
}

/// What every command takes.
#[derive(Args, Debug)]
struct Global {
    /// Vulkan device: a part of its name, or its index in 'marmor devices'
    #[arg(
        long,
        global = true,
        env = "MARMOR_DEVICE",
        value_name = "NAME|INDEX",
        help_heading = "Device",
        display_order = 900
    )]
    device: Option<String>,

    /// Have the Vulkan validation layers watch, and report what they say
    #[arg(long, global = true, help_heading = "Device", display_order = 901)]
    validation: bool,

    /// Use no more device memory than this, MiB
    ///
    /// A picture that needs more is refused before it starts.
    #[arg(
        long,
        global = true,
        value_name = "MIB",
        help_heading = "Device",
        display_order = 902,
        value_parser = values::mebibytes,
        allow_hyphen_values = true
    )]
    memory_limit: Option<u64>,

    /// Tell more on stderr: -v what is done, -vv details, -vvv everything
    #[arg(short, long, global = true, action = ArgAction::Count, help_heading = "Messages", display_order = 910)]
    verbose: u8,

    /// Print nothing but errors, and no progress
    #[arg(
        short,
        long,
        global = true,
        conflicts_with = "verbose",
        help_heading = "Messages",
        display_order = 911
    )]
    quiet: bool,
}

#[derive(Subcommand, Debug)]
enum Command {
    Render(Box<render::Arguments>),
    View(Box<view::Arguments>),
    Animate(Box<animate::Arguments>),
    Compare(compare::Arguments),
    Fetches(Box<fetches::Arguments>),
    Bench(bench::Arguments),
    Devices(devices::Arguments),
    Completions(completions::Arguments),
    Man(man::Arguments),
}

impl Global {
    fn options(&self) -> frame::Options {
        frame::Options {
            // An empty variable means that none is set.
            device: self.device.clone().filter(|device| !device.is_empty()),
            validation: self.validation,
            measure: false,
            memory_limit: self.memory_limit,
            redraw_light: false,
        }
    }
}

/// Runs one command line, program name first. Prints its result or its fault.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> Exit {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let cli = match Cli::try_parse_from(&arguments) {
        Ok(cli) => cli,
        Err(error) => return refused(&error, &arguments),
    };
    log(&cli.global);
    let result = match &cli.command {
        Command::Render(arguments) => render::run(&cli.global, arguments),
        Command::View(arguments) => view::run(&cli.global, arguments),
        Command::Animate(arguments) => animate::run(&cli.global, arguments),
        Command::Fetches(arguments) => fetches::run(&cli.global, arguments),
        Command::Compare(arguments) => compare::run(arguments),
        Command::Bench(arguments) => bench::run(&cli.global, arguments),
        Command::Devices(arguments) => devices::run(&cli.global, arguments),
        Command::Completions(arguments) => completions::run(arguments, &mut command()),
        Command::Man(arguments) => man::run(arguments, command()),
    };
    match result {
        Ok(()) => Exit::Done,
        Err(failure) => {
            complain(failure.message());
            failure.exit()
        }
    }
}

/// The whole command line as data, for completions and manual pages.
fn command() -> clap::Command {
    Cli::command()
}

/// Prints help and version as they are, and faults as one line.
fn refused(error: &clap::Error, arguments: &[OsString]) -> Exit {
    use clap::error::ErrorKind;
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            // A closed pipe is no fault of ours.
            let _ = error.print();
            Exit::Done
        }
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            let _ = error.print();
            Exit::BadInput
        }
        _ => {
            let command = command();
            // `bench reduce` is one below another.
            let (mut found, mut path) = (&command, Vec::new());
            for argument in arguments.iter().skip(1) {
                if let Some(subcommand) = found.find_subcommand(argument) {
                    found = subcommand;
                    path.push(subcommand.get_name());
                }
            }
            let path = Some(path.join(" ")).filter(|path| !path.is_empty());
            complain(&failure::one_line(
                &error.render().to_string(),
                path.as_deref(),
            ));
            Exit::BadInput
        }
    }
}

/// Writes one line to stderr, whatever the message holds.
fn complain(message: &str) {
    let line: String = message
        .chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect();
    // If stderr is gone, the exit code still tells.
    let _ = writeln!(std::io::stderr(), "marmor: {line}");
}

/// Where a map for display goes, which is a PNG.
fn map_output(path: Option<&Path>) -> Result<Option<Output>, Failure> {
    match path {
        Some(path) if Format::of(path)? != Format::Png => Err(Failure::Input(format!(
            "{}: the map is for display; name a .png file",
            path.display()
        ))),
        Some(path) => Ok(Some(Output::check(path)?)),
        None => Ok(None),
    }
}

/// Writes to stdout; a reader that has seen enough is no fault.
fn print(text: &str) -> Result<(), Failure> {
    let mut stdout = std::io::stdout().lock();
    match stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
    {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(Failure::Input(
            format!("stdout: cannot be written ({error}); redirect it elsewhere"),
        )),
        _ => Ok(()),
    }
}

fn log(global: &Global) {
    let level = match (global.quiet, global.verbose) {
        (true, _) => tracing::Level::ERROR,
        (false, 0) => tracing::Level::WARN,
        (false, 1) => tracing::Level::INFO,
        (false, 2) => tracing::Level::DEBUG,
        (false, _) => tracing::Level::TRACE,
    };
    // It warns of servers that say nothing of their screen's size in millimetres, which is of no use to who opens a window.
    let windows = level.min(match global.verbose {
        0 => tracing::Level::ERROR,
        _ => tracing::Level::TRACE,
    });
    let shown = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .with_target(false)
        .without_time();
    let levels = Targets::new()
        .with_default(level)
        .with_target("winit", windows);
    // Fails only where a subscriber exists already, as when a test runs several commands.
    let _ = tracing_subscriber::registry()
        .with(shown)
        .with(levels)
        .try_init();
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_command_line_is_consistent() {
        super::command().debug_assert();
    }
}
