//! `marmor completions`: what the shell offers on Tab.

use super::failure::Failure;
use super::print;
use clap::Args;
use clap_complete::Shell;

/// Print a completion script for a shell
#[derive(Args, Debug)]
#[command(after_long_help = "\
Examples:
  marmor completions bash > ~/.local/share/bash-completion/completions/marmor
  marmor completions zsh > ~/.zfunc/_marmor
  marmor completions fish > ~/.config/fish/completions/marmor.fish")]
pub(super) struct Arguments {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

pub(super) fn run(arguments: &Arguments, command: &mut clap::Command) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, command, "marmor", &mut script);
    print(&String::from_utf8_lossy(&script))
}
