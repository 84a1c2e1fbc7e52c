//! Keyframes of light and camera.

use super::names;

/// N numbers over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Track<const N: usize> {
    /// When each keyframe is reached, s; ascending, at least one.
    pub times: Vec<f64>,
    /// What it holds; as many as times.
    pub values: Vec<[f64; N]>,
    /// How one leads to the next.
    pub ease: Ease,
}

/// How one keyframe leads to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Ease {
    /// The earlier one holds.
    Step,
    /// At one speed.
    #[default]
    Linear,
    /// Speeding up from one and slowing down to the next: 3 x^2 - 2 x^3. Rests at every keyframe.
    Smooth,
    /// Through all of them at a speed that does not jump: cubic Hermite, whose slope at a keyframe is that of the
    /// parabola through it and its neighbours.
    Spline,
}

impl Ease {
    /// The names by which they are asked for.
    pub const NAMES: [&'static str; 4] = ["step", "linear", "smooth", "spline"];

    /// The one called `name`.
    ///
    /// # Errors
    /// A phrase that suggests the nearest name, or lists them all.
    pub fn named(name: &str) -> Result<Ease, String> {
        match name {
            "step" => Ok(Ease::Step),
            "linear" => Ok(Ease::Linear),
            "smooth" => Ok(Ease::Smooth),
            "spline" => Ok(Ease::Spline),
            _ => Err(format!(
                "unknown interpolation \"{name}\"; {}",
                names::remedy(name, &Ease::NAMES)
            )),
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Ease::Step => "step",
            Ease::Linear => "linear",
            Ease::Smooth => "smooth",
            Ease::Spline => "spline",
        }
    }
}

impl<const N: usize> Track<N> {
    /// The numbers at `time` (s). Before the first keyframe and after the last these hold.
    pub fn at(&self, time: f64) -> [f64; N] {
        let after = self.times.partition_point(|&t| t <= time);
        if after == 0 {
            return self.values[0];
        }
        let (i, last) = (after - 1, self.times.len() - 1);
        if i >= last {
            return self.values[last];
        }
        let span = self.times[i + 1] - self.times[i];
        let x = (time - self.times[i]) / span;
        let (a, b) = (self.values[i], self.values[i + 1]);
        std::array::from_fn(|n| match self.ease {
            Ease::Step => a[n],
            Ease::Linear => a[n] + x * (b[n] - a[n]),
            Ease::Smooth => a[n] + x * x * (3.0 - 2.0 * x) * (b[n] - a[n]),
            Ease::Spline => {
                let (m0, m1) = (self.slope(i, n) * span, self.slope(i + 1, n) * span);
                let (x2, x3) = (x * x, x * x * x);
                a[n] * (2.0 * x3 - 3.0 * x2 + 1.0)
                    + m0 * (x3 - 2.0 * x2 + x)
                    + b[n] * (3.0 * x2 - 2.0 * x3)
                    + m1 * (x3 - x2)
            }
        })
    }

    /// The slope of number `n` at keyframe `i`: of the parabola through its neighbours, at the ends of the line to the one
    /// there is.
    fn slope(&self, i: usize, n: usize) -> f64 {
        let chord = |j: usize| {
            (self.values[j + 1][n] - self.values[j][n]) / (self.times[j + 1] - self.times[j])
        };
        match (i.checked_sub(1), i + 1 < self.times.len()) {
            (Some(before), true) => {
                let (h0, h1) = (
                    self.times[i] - self.times[before],
                    self.times[i + 1] - self.times[i],
                );
                (chord(before) * h1 + chord(i) * h0) / (h0 + h1)
            }
            (Some(before), false) => chord(before),
            (None, true) => chord(i),
            (None, false) => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(ease: Ease) -> Track<1> {
        Track {
            times: vec![1.0, 2.0, 4.0],
            values: vec![[0.0], [10.0], [-10.0]],
            ease,
        }
    }

    #[test]
    fn every_interpolation_meets_its_keyframes() {
        for name in Ease::NAMES {
            let track = track(Ease::named(name).expect("a name"));
            for (time, value) in [
                (0.0, 0.0),
                (1.0, 0.0),
                (2.0, 10.0),
                (4.0, -10.0),
                (9.0, -10.0),
            ] {
                assert_eq!(track.at(time), [value], "{name} at {time}");
            }
        }
    }

    #[test]
    fn between_keyframes() {
        let at = |ease, time| track(ease).at(time)[0];
        assert_eq!(at(Ease::Step, 1.999), 0.0);
        assert_eq!(at(Ease::Linear, 1.25), 2.5);
        assert_eq!(at(Ease::Smooth, 1.5), 5.0);
        // 3/16 - 2/64 of the way.
        assert_eq!(at(Ease::Smooth, 1.25), 10.0 * (3.0 / 16.0 - 2.0 / 64.0));
        // A spline goes through a keyframe at one speed, a straight line does not.
        let slopes = |ease| {
            let h = 1e-6;
            let before = (at(ease, 2.0) - at(ease, 2.0 - h)) / h;
            let after = (at(ease, 2.0 + h) - at(ease, 2.0)) / h;
            (before, after)
        };
        let (before, after) = slopes(Ease::Spline);
        assert!((before - after).abs() < 1e-3, "{before} {after}");
        let (before, after) = slopes(Ease::Linear);
        assert!((before - after).abs() > 15.0);
        // A parabola comes out as one between inner keyframes.
        let parabola = Track {
            times: vec![0.0, 1.0, 3.0, 4.0],
            values: [0.0_f64, 1.0, 3.0, 4.0].iter().map(|t| [t * t]).collect(),
            ease: Ease::Spline,
        };
        assert!((parabola.at(2.3)[0] - 2.3 * 2.3).abs() < 1e-12);
    }
}
