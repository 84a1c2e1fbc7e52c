//! The `marmor` binary: arguments in, exit code out.
#![warn(missing_docs)]

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(marmor::cli::run(std::env::args_os()).code())
}
