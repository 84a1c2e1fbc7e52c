//! What marmor tells about pictures: files, comparisons, statistics. Sees plain results.

pub mod bench;
pub mod compare;
pub mod fetches;
pub mod glyphs;
pub mod heatmap;
pub mod image;
pub mod output;
pub mod stats;

pub use bench::Bench;
pub use compare::{Comparison, Domain, compare};
pub use image::{Format, Image};
pub use output::Output;
pub use stats::Stats;

/// A file that cannot be read, written or used.
///
/// Displays as one line, `place: problem`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {problem}")]
pub struct Error {
    /// The file.
    pub place: String,
    /// What is wrong with it, and the remedy.
    pub problem: String,
}

impl Error {
    /// A fault of the file `place`.
    pub fn of(place: impl std::fmt::Display, problem: impl Into<String>) -> Self {
        Error {
            place: place.to_string(),
            problem: problem.into(),
        }
    }
}
