//! A progress bar on stderr, where someone watches.

use crate::frame::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A bar that stays hidden when stderr is no terminal, and for a single frame.
pub(super) struct Bar {
    bar: ProgressBar,
    shown: bool,
    /// Rows of the exact method say more than frames, so frames stop counting once rows come.
    rows: bool,
}

impl Bar {
    pub(super) fn new(quiet: bool) -> Bar {
        let bar = ProgressBar::hidden();
        // The template is constant and a test parses it; a plain bar is the fallback.
        if let Ok(style) = ProgressStyle::with_template(TEMPLATE) {
            bar.set_style(style);
        }
        Bar {
            bar,
            shown: quiet,
            rows: false,
        }
    }

    pub(super) fn report(&mut self, progress: Progress) {
        let (what, done, of) = match progress {
            Progress::Frame { .. } if self.rows => return,
            Progress::Frame { done, of } => ("frames", u64::from(done), u64::from(of)),
            Progress::Exact { done, of } => {
                self.rows = true;
                ("light-map rows", done, of)
            }
        };
        self.show(what, done, of);
    }

    fn show(&mut self, what: &'static str, done: u64, of: u64) {
        if of <= 1 {
            return;
        }
        self.bar.set_message(what);
        self.bar.set_length(of);
        self.bar.set_position(done);
        // Last, since it draws: an empty bar says nothing.
        if !self.shown {
            // Draws nothing where stderr is no terminal.
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
            self.shown = true;
        }
    }

    /// Rows of the picture that rays have been cast for.
    pub(super) fn report_traced(&mut self, done: u64, of: u64) {
        self.show("rows of single scattering", done, of);
    }

    /// Frames of an animation drawn.
    pub(super) fn report_frames(&mut self, done: u64, of: u64) {
        self.show("frames", done, of);
    }

    /// Pictures drawn, those that take longer counted more than once.
    pub(super) fn report_pictures(&mut self, done: u64, of: u64) {
        self.show("pictures", done, of);
    }

    pub(super) fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

const TEMPLATE: &str = "{bar:30} {pos}/{len} {msg}, {eta} left";

#[cfg(test)]
mod tests {
    #[test]
    fn the_template_parses() {
        assert!(indicatif::ProgressStyle::with_template(super::TEMPLATE).is_ok());
    }
}
