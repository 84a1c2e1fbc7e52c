//! What can be wrong with a scene.

use std::fmt::Display;

/// A scene that cannot be used: where the fault lies, and what to do about it.
///
/// Displays as one line, `place: problem`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {problem}")]
pub struct Error {
    /// The file, and the line where it is known: `scene.toml:7`.
    pub place: String,
    /// What is wrong there, and the remedy.
    pub problem: String,
}

impl Error {
    /// A fault of a whole file, or of a request that came from no file.
    pub fn of(place: impl Display, problem: impl Into<String>) -> Self {
        Error {
            place: place.to_string(),
            problem: problem.into(),
        }
    }

    /// A fault in `line` (counted from 1) of a file.
    pub fn at(file: impl Display, line: usize, problem: impl Into<String>) -> Self {
        Error {
            place: format!("{file}:{line}"),
            problem: problem.into(),
        }
    }
}
