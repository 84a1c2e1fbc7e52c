//! How long frames took, for the rolling plot.

use std::collections::VecDeque;
use std::fmt;
use std::time::{Duration, Instant};

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

/// Where the time of one frame goes.
#[derive(Clone, Debug)]
pub struct Clock {
    start: Instant,
    // Parts of the frame, and when each was done.
    laps: Vec<(&'static str, Duration)>,
}

impl Clock {
    /// A frame begins.
    pub fn start() -> Clock {
        Clock {
            start: Instant::now(),
            laps: Vec::new(),
        }
    }

    /// What was done since the last such call, or the start, is `part`.
    pub fn lap(&mut self, part: &'static str) {
        self.laps.push((part, self.start.elapsed()));
    }

    /// From the start to the end of the last part, ms.
    pub fn milliseconds(&self) -> f64 {
        let (_, done) = self.laps.last().copied().unwrap_or_default();
        1e3 * done.as_secs_f64()
    }
}

impl fmt::Display for Clock {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(to, "{:.0} ms", self.milliseconds())?;
        let mut before = Duration::ZERO;
        for (k, &(part, done)) in self.laps.iter().enumerate() {
            let separator = if k == 0 { ": " } else { ", " };
            let took = 1e3 * (done - before).as_secs_f64();
            write!(to, "{separator}{part} {took:.0}")?;
            before = done;
        }
        Ok(())
    }
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
    /// Adds a frame. The first is counted, and no more: what opens the window would dwarf all others in the plot.
    pub fn push(&mut self, frame: Frame) {
        self.count += 1;
        if self.count == 1 {
            return;
        }
        if self.frames.len() == KEPT {
            self.frames.pop_front();
        }
        self.longest = self.longest.max(frame.milliseconds);
        self.frames.push_back(frame);
    }

    /// The last frames, oldest first, without the one that opened the window.
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
    fn the_parts_of_a_frame_are_its_time() {
        let mut clock = Clock::start();
        assert_eq!(clock.to_string(), "0 ms");
        clock.laps = vec![
            ("panel", Duration::from_millis(3)),
            ("picture", Duration::from_millis(45)),
        ];
        assert_eq!(clock.milliseconds(), 45.0);
        assert_eq!(clock.to_string(), "45 ms: panel 3, picture 42");
        clock.lap("window");
        assert_eq!(clock.laps.len(), 3);
    }

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
        assert_eq!((timing.count, timing.longest), (2, 5.0));
        assert_eq!(timing.frames().count(), 1);
    }
}
