//! Built-in deformers: motion for any mesh, without a rig.
//!
//! Each is a map of space in closed form, with its Jacobian, which normals follow. They act along an axis through the
//! mesh, from its *base*, the lowest point along the axis, to its *tip*, and move with time as
//! sin(2 pi (t / period + phase)).

use super::{limits, names};
use glam::{DMat3, DVec3};
use std::f64::consts::{PI, TAU};

/// How many a scene may have: what the uniforms of the deform pass hold.
pub const DEFORMERS_MAX: usize = 4;

/// Below this product of curvature and length, the arc of a bend is its series: there 1 - cos loses half its digits.
const STRAIGHT: f64 = 1e-4;

/// A deformer as a scene asks for it.
#[derive(Clone, Debug, PartialEq)]
pub struct Deformer {
    /// What it does.
    pub kind: Kind,
    /// Along which direction; any length but 0.
    pub axis: DVec3,
    /// The direction it moves towards, for [`Kind::Bend`] and [`Kind::Wave`]; what lies along `axis` in it does not count.
    /// None chooses one.
    pub towards: Option<DVec3>,
    /// How far it goes: degrees from base to tip for a twist and a bend, a fraction for breathing, mm for a wave.
    pub amplitude: f64,
    /// Seconds from one beat to the next, above 0.
    pub period: f64,
    /// Where in the beat it starts, in beats.
    pub phase: f64,
    /// Length of a wave along the axis, mm; none for that of the mesh. For [`Kind::Wave`] alone.
    pub wavelength: Option<f64>,
}

/// What a deformer does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Turns about the axis, more and more from the base to the tip.
    Twist,
    /// Bends the axis into an arc; the base stays.
    Bend,
    /// Widens across the axis, most in the middle; both ends stay.
    Breathe,
    /// Shifts across the axis by a wave that runs along it.
    Wave,
}

impl Kind {
    /// The names by which they are asked for.
    pub const NAMES: [&'static str; 4] = ["twist", "bend", "breathe", "wave"];

    /// An amplitude: any finite number, of a twist and a bend at most ten turns.
    ///
    /// # Errors
    /// The phrase that names the range.
    pub fn amplitude(self, value: f64) -> Result<f64, String> {
        limits::finite(value)?;
        match self {
            Kind::Twist | Kind::Bend if value.abs() > DEGREES_MAX => Err(format!(
                "must be from -{DEGREES_MAX} to {DEGREES_MAX} degrees, not {value:e}"
            )),
            _ => Ok(value),
        }
    }

    /// The kind called `name`.
    ///
    /// # Errors
    /// A phrase that suggests the nearest name, or lists them all.
    pub fn named(name: &str) -> Result<Kind, String> {
        match name {
            "twist" => Ok(Kind::Twist),
            "bend" => Ok(Kind::Bend),
            "breathe" => Ok(Kind::Breathe),
            "wave" => Ok(Kind::Wave),
            _ => Err(format!(
                "unknown deformer \"{name}\"; {}",
                names::remedy(name, &Kind::NAMES)
            )),
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Twist => "twist",
            Kind::Bend => "bend",
            Kind::Breathe => "breathe",
            Kind::Wave => "wave",
        }
    }

    /// Whether it moves towards a direction of its own.
    pub(super) fn has_direction(self) -> bool {
        matches!(self, Kind::Bend | Kind::Wave)
    }

    /// Whether it has a wavelength.
    pub(super) fn has_length(self) -> bool {
        self == Kind::Wave
    }
}

/// A deformer at one instant, on one mesh: a map of space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bend {
    /// What it does.
    pub kind: Kind,
    /// A point on the axis, level with the base, mm.
    pub base: DVec3,
    /// Unit vector along the axis.
    pub axis: DVec3,
    /// Unit vector across it, for a bend and a wave.
    pub towards: DVec3,
    /// 1 / distance from base to tip, mm^-1; for a wave 1 / wavelength.
    pub per_length: f64,
    /// Radians from base to tip, a fraction, or mm.
    pub amount: f64,
    /// Of a wave: its phase at the base, radians.
    pub phase: f64,
}

/// Largest amplitude of a twist or a bend, degrees: ten turns, of which float32 still has five digits.
const DEGREES_MAX: f64 = 3600.0;

impl Deformer {
    /// Checks every value.
    ///
    /// # Errors
    /// A phrase that names the value at fault.
    pub fn check(&self) -> Result<(), String> {
        let named = |name: &str, result: Result<(), String>| {
            result.map_err(|phrase| format!("{name} {phrase}"))
        };
        named("axis", limits::direction(self.axis).map(drop))?;
        if let Some(towards) = self.towards {
            named("towards", limits::direction(towards).map(drop))?;
        }
        named("amplitude", self.kind.amplitude(self.amplitude).map(drop))?;
        named("period", limits::positive(self.period).map(drop))?;
        named("phase", limits::finite(self.phase).map(drop))?;
        match self.wavelength {
            Some(length) => named("wavelength", limits::positive(length).map(drop)),
            None => Ok(()),
        }
    }

    /// What it does at `time` (s) to a mesh between the corners `lo` and `hi` of its box at rest, mm.
    pub fn at(&self, time: f64, [lo, hi]: [DVec3; 2]) -> Bend {
        let axis = self.axis.normalize_or(DVec3::Y);
        let towards = self.towards.unwrap_or(DVec3::Z);
        let across = (towards - axis * towards.dot(axis))
            .try_normalize()
            .unwrap_or_else(|| axis.any_orthonormal_vector());
        let (middle, half) = (0.5 * (lo + hi), 0.5 * (hi - lo));
        // Of a box, the extent along a direction.
        let reach = half.dot(axis.abs()).max(f64::MIN_POSITIVE);
        // Of many beats only the last counts, and float32 has its digits for that.
        let beat = TAU * (time / self.period + self.phase).rem_euclid(1.0);
        let (amount, phase) = match self.kind {
            Kind::Twist | Kind::Bend => (self.amplitude.to_radians() * beat.sin(), 0.0),
            Kind::Breathe => (self.amplitude * beat.sin(), 0.0),
            // A crest moves from the base to the tip.
            Kind::Wave => (self.amplitude, -beat),
        };
        Bend {
            kind: self.kind,
            base: middle - axis * reach,
            axis,
            towards: across,
            per_length: match (self.kind, self.wavelength) {
                (Kind::Wave, Some(length)) => 1.0 / length,
                _ => 0.5 / reach,
            },
            amount,
            phase,
        }
    }
}

impl Bend {
    /// Where it takes the point `p` (mm), and the Jacobian there.
    pub fn apply(&self, p: DVec3) -> (DVec3, DMat3) {
        let (a, k) = (self.axis, self.per_length);
        let q = p - self.base;
        let h = q.dot(a);
        match self.kind {
            Kind::Twist => {
                let turn = DMat3::from_axis_angle(a, self.amount * k * h);
                let r = turn * q;
                // d(R(theta(h)) q) = R dq + (a x R q) theta' (a . dq).
                let jacobian = turn + outer(a.cross(r) * (self.amount * k), a);
                (self.base + r, jacobian)
            }
            Kind::Bend => {
                // The axis becomes an arc of curvature c in the plane of a and b, and cross sections stay
                // perpendicular to it: (h, x) -> (s - x sin, x cos + v) with the arc's end (s, v) at h.
                let (b, c) = (self.towards, self.amount * k);
                let x = q.dot(b);
                let (sin, cos) = (c * h).sin_cos();
                let (s, v) = if (c * h).abs() < STRAIGHT {
                    (h, 0.5 * c * h * h)
                } else {
                    (sin / c, (1.0 - cos) / c)
                };
                let rest = q - a * h - b * x;
                let point = rest + a * (s - x * sin) + b * (v + x * cos);
                // Along the arc lengths change by 1 - c x; the frame turns by c h.
                let (along, across) = (a * cos + b * sin, b * cos - a * sin);
                let third = a.cross(b);
                let jacobian =
                    outer(along * (1.0 - c * x), a) + outer(across, b) + outer(third, third);
                (self.base + point, jacobian)
            }
            Kind::Breathe => {
                let u = (h * k).clamp(0.0, 1.0);
                let (sin, cos) = (PI * u).sin_cos();
                let factor = 1.0 + self.amount * sin * sin;
                let slope = self.amount * 2.0 * sin * cos * PI * k;
                let across = q - a * h;
                let wide =
                    DMat3::from_diagonal(DVec3::splat(factor)) + outer(a * (1.0 - factor), a);
                (
                    self.base + a * h + across * factor,
                    wide + outer(across * slope, a),
                )
            }
            Kind::Wave => {
                let (sin, cos) = (TAU * k * h + self.phase).sin_cos();
                let jacobian =
                    DMat3::IDENTITY + outer(self.towards * (self.amount * TAU * k * cos), a);
                (p + self.towards * (self.amount * sin), jacobian)
            }
        }
    }
}

/// The matrix x y^T.
fn outer(x: DVec3, y: DVec3) -> DMat3 {
    DMat3::from_cols(x * y.x, x * y.y, x * y.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: [DVec3; 2] = [DVec3::new(-1.0, 0.0, -2.0), DVec3::new(3.0, 5.0, 2.0)];

    fn deformer(kind: Kind) -> Deformer {
        Deformer {
            kind,
            axis: DVec3::new(0.2, 1.0, -0.3),
            towards: Some(DVec3::new(1.0, 0.4, 0.0)),
            amplitude: match kind {
                Kind::Twist | Kind::Bend => 70.0,
                Kind::Breathe => 0.4,
                Kind::Wave => 0.8,
            },
            period: 2.0,
            phase: 0.1,
            wavelength: None,
        }
    }

    #[test]
    fn jacobians_are_derivatives() {
        for name in Kind::NAMES {
            let kind = Kind::named(name).expect("a kind");
            for time in [0.0, 0.3, 1.7] {
                let bend = deformer(kind).at(time, BOX);
                for p in [
                    DVec3::new(0.1, 0.5, 0.2),
                    DVec3::new(2.0, 4.0, -1.0),
                    DVec3::new(-1.0, 2.5, 1.9),
                ] {
                    let (_, jacobian) = bend.apply(p);
                    for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                        let step = 1e-6 * axis;
                        let slope = (bend.apply(p + step).0 - bend.apply(p - step).0) / 2e-6;
                        let error = (slope - jacobian * axis).length();
                        assert!(error < 1e-8, "{name} at {time}: {error}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_base_stays_and_the_tip_moves() {
        for name in ["twist", "bend", "breathe"] {
            let kind = Kind::named(name).expect("a kind");
            let mut deformer = deformer(kind);
            deformer.phase = 0.0;
            let bend = deformer.at(0.5, BOX);
            assert!(
                (bend.apply(bend.base).0 - bend.base).length() < 1e-12,
                "{name}"
            );
            let tip = bend.base + bend.axis / bend.per_length;
            let (moved, _) = bend.apply(tip);
            match kind {
                // An arc over 70 degrees keeps its length, and its chord is shorter.
                Kind::Bend => {
                    let angle = 70_f64.to_radians();
                    let chord = (moved - bend.base).length() * bend.per_length;
                    assert!((chord - (angle / 2.0).sin() / (angle / 2.0)).abs() < 1e-12);
                }
                _ => assert!((moved - tip).length() < 1e-12, "{name}"),
            }
            // A beat has both sides, and its middle is at rest.
            let rest = deformer.at(1.0, BOX);
            let p = DVec3::new(1.0, 3.0, 1.0);
            assert!((rest.apply(p).0 - p).length() < 1e-9, "{name}");
        }
    }

    #[test]
    fn a_wave_runs_from_the_base_to_the_tip() {
        let mut wave = deformer(Kind::Wave);
        wave.phase = 0.0;
        let bend = |time| wave.at(time, BOX);
        // After a quarter of the period it is where it was a quarter of a wave further down.
        let p = DVec3::new(0.3, 1.0, 0.2);
        let quarter = 0.25 / bend(0.0).per_length * bend(0.0).axis;
        let shift = |time, p: DVec3| bend(time).apply(p).0 - p;
        assert!((shift(0.0, p) - shift(0.5, p + quarter)).length() < 1e-12);
        assert!((shift(0.0, p) - shift(2.0, p)).length() < 1e-12);
    }

    /// Where an arc is nearly straight, its series meets the closed form.
    #[test]
    fn a_slight_bend_is_continuous() {
        let mut bend = deformer(Kind::Bend).at(0.3, BOX);
        let p = DVec3::new(1.0, 3.0, 1.0);
        let h = (p - bend.base).dot(bend.axis);
        let mut at = |product: f64| {
            bend.amount = product / (h * bend.per_length);
            bend.apply(p).0
        };
        let (below, above) = (at(0.999_999 * STRAIGHT), at(1.000_001 * STRAIGHT));
        assert!(
            (below - above).length() < 1e-8 * h,
            "{}",
            (below - above).length()
        );
    }
}
