//! Why a command did not do what was asked.

use super::Exit;
use crate::ledger::budget;
use crate::{frame, report, scene};

/// A command that failed, and the one line that says why.
#[derive(Debug)]
pub(super) enum Failure {
    /// A check did not hold.
    Check(String),
    /// Bad usage or input.
    Input(String),
    /// No usable device, or the device failed.
    Device(String),
}

impl Failure {
    pub(super) fn message(&self) -> &str {
        match self {
            Failure::Check(message) | Failure::Input(message) | Failure::Device(message) => message,
        }
    }

    pub(super) fn exit(&self) -> Exit {
        match self {
            Failure::Check(_) => Exit::CheckFailed,
            Failure::Input(_) => Exit::BadInput,
            Failure::Device(_) => Exit::NoDevice,
        }
    }
}

impl From<scene::Error> for Failure {
    fn from(error: scene::Error) -> Self {
        Failure::Input(error.to_string())
    }
}

impl From<report::Error> for Failure {
    fn from(error: report::Error) -> Self {
        Failure::Input(error.to_string())
    }
}

impl From<report::compare::Error> for Failure {
    fn from(error: report::compare::Error) -> Self {
        Failure::Input(error.to_string())
    }
}

impl From<budget::Error> for Failure {
    fn from(error: budget::Error) -> Self {
        Failure::Input(error.to_string())
    }
}

impl From<frame::Error> for Failure {
    fn from(error: frame::Error) -> Self {
        match error {
            frame::Error::TooLarge(message) | frame::Error::Shader(message) => {
                Failure::Input(message)
            }
            frame::Error::NoDevice(message) | frame::Error::Device(message) => {
                Failure::Device(message)
            }
        }
    }
}

/// Folds the paragraphs of a clap error into one line: what is wrong, the tips, and
/// which help to read. `command` is the subcommand in question, where there is one;
/// clap names it only in faults that come with a usage line.
pub(super) fn one_line(text: &str, command: Option<&str>) -> String {
    let mut parts: Vec<String> = Vec::new();
    let mut help = match command {
        Some(command) => format!("marmor {command} --help"),
        None => "marmor --help".to_owned(),
    };
    for paragraph in text.split("\n\n") {
        let paragraph = paragraph
            .lines()
            .map(str::trim)
            .filter(|line| !line.is_empty())
            .collect::<Vec<_>>()
            .join(" ");
        if let Some(usage) = paragraph.strip_prefix("Usage: ") {
            let command: Vec<&str> = usage
                .split_whitespace()
                .take_while(|word| word.starts_with(|c: char| c.is_ascii_lowercase()))
                .collect();
            help = format!("{} --help", command.join(" "));
        } else if !paragraph.is_empty() && !paragraph.starts_with("For more information") {
            let paragraph = paragraph.strip_prefix("error: ").unwrap_or(&paragraph);
            parts.push(paragraph.to_owned());
        }
    }
    format!("{} (see '{help}')", parts.join("; "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clap_errors_become_one_line() {
        let text = "error: unexpected argument '--siz' found\n\n  tip: a similar argument exists: \
                    '--size'\n\nUsage: marmor render --output <FILE> [SCENE]\n\nFor more \
                    information, try '--help'.\n";
        assert_eq!(
            one_line(text, None),
            "unexpected argument '--siz' found; tip: a similar argument exists: '--size' \
             (see 'marmor render --help')"
        );
        let text = "error: invalid value 'x'\n\nFor more information, try '--help'.\n";
        assert_eq!(
            one_line(text, Some("compare")),
            "invalid value 'x' (see 'marmor compare --help')"
        );
    }
}
