//! `marmor man`: the manual, from the same description as the help.

use super::failure::Failure;
use super::print;
use crate::report::{self, Output};
use clap::Args;
use clap_mangen::Man;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// Print the manual page, or write the pages of all commands to a folder
#[derive(Args, Debug)]
#[command(after_long_help = "\
Examples:
  marmor man | man -l -
  marmor man --out ~/.local/share/man/man1")]
pub(super) struct Arguments {
    /// An existing folder to write marmor.1, marmor-render.1, ... to
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments, command: clap::Command) -> Result<(), Failure> {
    let mut command = command.disable_help_subcommand(true);
    // Fills in the full names of subcommands, such as marmor-render.
    command.build();
    let Some(folder) = &arguments.out else {
        let page = page(&command, "stdout")?;
        return print(&String::from_utf8_lossy(&page));
    };
    if !folder.is_dir() {
        return Err(Failure::Input(format!(
            "{}: there is no such folder; create it first",
            folder.display()
        )));
    }
    write_all(&command, folder)
}

fn write_all(command: &clap::Command, folder: &Path) -> Result<(), Failure> {
    write(command, folder)?;
    command
        .get_subcommands()
        .filter(|command| !command.is_hide_set())
        .try_for_each(|command| write_all(command, folder))
}

fn write(command: &clap::Command, folder: &Path) -> Result<(), Failure> {
    let path = folder.join(Man::new(command.clone()).get_filename());
    let page = page(command, &path.display().to_string())?;
    let output = Output::check(&path)?;
    output.write(|writer| writer.write_all(&page))?;
    Ok(())
}

fn page(command: &clap::Command, place: &str) -> Result<Vec<u8>, Failure> {
    let mut page = Vec::new();
    Man::new(command.clone())
        .render(&mut page)
        .map_err(|error| report::Error::of(place, format!("no manual page ({error})")))?;
    Ok(page)
}
