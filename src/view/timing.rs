//! How long frames took, for the rolling plot.

use std::collections::VecDeque;

/// Frames that the plot shows.
pub const KEPT: usize = 240;

/// One frame of the window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// From the start of its work on the host to the end of it, waiting included, ms.
    pub milliseconds: f64,
    /// Whether a picture was drawn in it, or the panel alone.
    pub picture: bool,
}

/// The last frames of the window.
#[derive(Clone, Debug, Default)]
pub struct Timing {
    frames: VecDeque<Frame>,
    /// Frames in all.
    pub count: u64,
    /// The longest of all but the first, which also opens the window, ms.
    pub longest: f64,
}

impl Timing {
    /// Adds a frame.
    pub fn push(&mut self, frame: Frame) {
        if self.frames.len() == KEPT {
            self.frames.pop_front();
        }
        if self.count > 0 {
            self.longest = self.longest.max(frame.milliseconds);
        }
        self.frames.push_back(frame);
        self.count += 1;
    }

    /// The last frames, oldest first.
    pub fn frames(&self) -> impl Iterator<Item = &Frame> {
        self.frames.iter()
    }

    /// The middle of the last `count` frames with a picture, ms; none before there is one.
    pub fn median(&self, count: usize) -> Option<f64> {
        let last = self.frames.iter().rev().filter(|frame| frame.picture);
        let mut times: Vec<f64> = last.take(count).map(|frame| frame.milliseconds).collect();
        times.sort_by(f64::total_cmp);
        times.get(times.len() / 2).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_keeps_the_last_frames() {
        let mut timing = Timing::default();
        assert_eq!(timing.median(9), None);
        for k in 0..1000 {
            let picture = k % 2 == 0;
            timing.push(Frame {
                milliseconds: f64::from(k),
                picture,
            });
        }
        assert_eq!(timing.frames().count(), KEPT);
        assert_eq!((timing.count, timing.longest), (1000, 999.0));
        // 998, 996, 994
        assert_eq!(timing.median(3), Some(996.0));
    }

    #[test]
    fn the_frame_that_opens_the_window_is_no_stall() {
        let mut timing = Timing::default();
        for milliseconds in [900.0, 5.0] {
            timing.push(Frame {
                milliseconds,
                picture: true,
            });
        }
        assert_eq!(timing.longest, 5.0);
    }
}
