//! The clips: sums of sines, keyed at even spacing.

use std::f32::consts::{PI, TAU};

use glam::{Quat, Vec3};

use super::fins::{ANAL, DORSAL, PECTORAL, TAIL};
use super::rig::{Rig, Role};
use crate::glb::{Channel, Clip, Interpolation, Target};

/// One sine: its height, how often it repeats in a clip, and its lag in radians.
#[derive(Clone, Copy, Debug)]
struct Wave(f32, f32, f32);

/// A quantity that swings round a mean.
#[derive(Clone, Debug)]
struct Swing {
    mean: f32,
    waves: Vec<Wave>,
}

impl Swing {
    fn new(mean: f32, waves: &[Wave]) -> Self {
        Self {
            mean,
            waves: waves.to_vec(),
        }
    }

    /// The value and its slope at `phase` of a clip, 0..1.
    fn at(&self, phase: f32) -> (f32, f32) {
        self.waves
            .iter()
            .fold((self.mean, 0.0), |(value, slope), &Wave(a, n, lag)| {
                let x = TAU * n * phase - lag;
                (value + a * x.sin(), slope + a * TAU * n * x.cos())
            })
    }
}

/// How one joint turns: degrees round each of some axes, the first outermost.
type Turn = Vec<(Vec3, Swing)>;

/// What a clip does.
struct Score {
    name: &'static str,
    seconds: f32,
    keys: usize,
    interpolation: Interpolation,
    turns: Vec<Turn>,
    shift: [Swing; 3],
    morphs: Vec<Swing>,
}

/// A rotation and its rate of change at `phase`.
fn rotation(turn: &Turn, phase: f32) -> (Quat, Quat) {
    let none = Quat::from_xyzw(0.0, 0.0, 0.0, 0.0);
    turn.iter()
        .fold((Quat::IDENTITY, none), |(q, dq), (axis, swing)| {
            let (angle, rate) = swing.at(phase);
            let (half, rate) = (angle.to_radians() * 0.5, rate.to_radians() * 0.5);
            let of = |v: f32, w: f32| Quat::from_xyzw(axis.x * v, axis.y * v, axis.z * v, w);
            let r = of(half.sin(), half.cos());
            let dr = of(half.cos() * rate, -half.sin() * rate);
            (q * r, dq * r + q * dr)
        })
}

impl Score {
    /// Keys of values that come with their rates of change.
    fn key(&self, values: impl Fn(f32) -> (Vec<f32>, Vec<f32>)) -> Vec<f32> {
        let mut keys = Vec::new();
        for k in 0..=self.keys {
            // The last key is the first again, to the bit.
            let (value, rate) = values((k % self.keys) as f32 / self.keys as f32);
            let rate: Vec<f32> = rate.iter().map(|r| r / self.seconds).collect();
            if self.interpolation == Interpolation::CubicSpline {
                keys.extend(&rate);
                keys.extend(&value);
                keys.extend(&rate);
            } else {
                keys.extend(&value);
            }
        }
        keys
    }

    fn clip(&self, rig: &Rig) -> Clip {
        let mut channels = Vec::new();
        for (i, turn) in self.turns.iter().enumerate() {
            if turn.is_empty() {
                continue;
            }
            channels.push(Channel {
                target: Target::Rotation(i),
                values: self.key(|phase| {
                    let (q, dq) = rotation(turn, phase);
                    (q.to_array().to_vec(), dq.to_array().to_vec())
                }),
            });
        }
        channels.push(Channel {
            target: Target::Translation(0),
            values: self.key(|phase| {
                let at = [0, 1, 2].map(|k| self.shift[k].at(phase));
                let rest = rig.joints[0].at.to_array();
                let value = (0..3).map(|k| rest[k] + at[k].0).collect();
                (value, at.iter().map(|v| v.1).collect())
            }),
        });
        channels.push(Channel {
            target: Target::Weights,
            values: self.key(|phase| self.morphs.iter().map(|m| m.at(phase)).unzip()),
        });
        Clip {
            name: self.name.to_owned(),
            times: (0..=self.keys)
                .map(|k| self.seconds * k as f32 / self.keys as f32)
                .collect(),
            interpolation: self.interpolation,
            channels,
        }
    }
}

/// Lag of the body's wave at `x`, radians: it runs from head to tail.
fn lag(x: f32) -> f32 {
    (22.0 - x) * 0.105
}

/// A swim: `beats` strokes of the tail in one loop.
fn swim(rig: &Rig) -> Score {
    const BEATS: f32 = 2.0;
    let beat = |a: f32, lag: f32| Wave(a, BEATS, lag);
    let turns = rig
        .joints
        .iter()
        .map(|joint| -> Turn {
            let here = lag(joint.at.x);
            match joint.role {
                Role::Root => vec![
                    (Vec3::Z, Swing::new(0.0, &[Wave(1.3, 1.0, 0.6)])),
                    (Vec3::X, Swing::new(0.0, &[Wave(1.6, BEATS, 2.2)])),
                ],
                Role::Spine(i) => {
                    let degrees = [2.4, 2.0, 2.6, 3.4, 4.4, 5.4, 6.2][i];
                    vec![(Vec3::Y, Swing::new(0.0, &[beat(degrees, here)]))]
                }
                Role::Fin(TAIL, _, chain, j) => {
                    // The outer rays trail the middle ones.
                    let late = lag(-1.0) + 0.45 + 0.55 * j as f32 + [0.5, 0.0, 0.75][chain];
                    let degrees = [7.5, 9.0, 10.5, 12.0][j];
                    let slow = Wave(1.6, 1.0, 0.8 * j as f32 + chain as f32);
                    vec![(joint.axis, Swing::new(0.0, &[beat(degrees, late), slow]))]
                }
                Role::Fin(DORSAL, _, chain, j) => {
                    let late = here + 0.9 + 0.8 * j as f32 + 0.45 * chain as f32;
                    let degrees = [4.5, 7.5][j];
                    vec![(joint.axis, Swing::new(0.0, &[beat(degrees, late)]))]
                }
                Role::Fin(ANAL, _, chain, j) => {
                    let late = here + 0.8 + 0.7 * j as f32 + 0.4 * chain as f32;
                    let degrees = [3.5, 6.0, 8.0][j];
                    vec![(joint.axis, Swing::new(0.0, &[beat(degrees, late)]))]
                }
                Role::Fin(PECTORAL, side, _, j) => {
                    scull(joint.axis, joint.along, side, j, 3.0, 1.0)
                }
                Role::Fin(_, side, _, j) => {
                    let late = 1.0 + 0.7 * j as f32;
                    let out = Swing::new(1.5, &[Wave(side * [3.0, 4.5, 6.0][j], BEATS, late)]);
                    let back = Swing::new(0.0, &[Wave([2.0, 3.0, 4.0][j], 1.0, 0.6 * j as f32)]);
                    vec![(joint.axis, out), (Vec3::Z, back)]
                }
            }
        })
        .collect();
    Score {
        name: "swim",
        seconds: 2.4,
        keys: 24,
        interpolation: Interpolation::CubicSpline,
        turns,
        // The head recoils from the tail's stroke.
        shift: [
            Swing::new(0.0, &[Wave(0.5, 2.0 * BEATS, 0.4)]),
            Swing::new(0.0, &[Wave(0.7, 1.0, 0.0)]),
            Swing::new(0.0, &[Wave(0.9, BEATS, 0.9)]),
        ],
        morphs: vec![
            Swing::new(0.4, &[Wave(0.4, 2.0, 1.0)]),
            Swing::new(0.12, &[Wave(0.12, 1.0, 0.5)]),
        ],
    }
}

/// A pectoral fin's stroke: out and back, feathered a quarter later. The two
/// sides take turns.
fn scull(axis: Vec3, along: Vec3, side: f32, j: usize, beats: f32, strength: f32) -> Turn {
    let turn = if side > 0.0 { 0.0 } else { PI };
    let late = turn + 0.8 * j as f32;
    let stroke = Wave([13.0, 9.0][j] * strength, beats, late);
    let feather = Wave([9.0, 4.0][j] * strength * side, beats, late + 0.5 * PI);
    vec![
        (axis, Swing::new([4.0, 0.0][j], &[stroke])),
        (along, Swing::new(0.0, &[feather])),
    ]
}

/// At rest in the water: the fins ripple, the body hangs still.
fn hover(rig: &Rig) -> Score {
    let turns = rig
        .joints
        .iter()
        .map(|joint| -> Turn {
            let here = lag(joint.at.x);
            match joint.role {
                Role::Root => vec![(Vec3::Z, Swing::new(1.5, &[Wave(1.0, 1.0, 0.4)]))],
                Role::Spine(i) => {
                    let degrees = [0.5, 0.5, 0.7, 0.9, 1.1, 1.4, 1.7][i];
                    vec![(Vec3::Y, Swing::new(0.0, &[Wave(degrees, 1.0, here)]))]
                }
                Role::Fin(fin, _, chain, j) if [TAIL, DORSAL, ANAL].contains(&fin) => {
                    let late = here + 0.7 + 0.6 * j as f32 + 0.8 * chain as f32;
                    let slow = Wave([2.6, 3.8, 5.0, 6.0][j], 1.0, late);
                    let ripple = Wave([0.8, 1.6, 2.2, 2.6][j], 2.0, 1.6 * late);
                    vec![(joint.axis, Swing::new(0.0, &[slow, ripple]))]
                }
                Role::Fin(PECTORAL, side, _, j) => {
                    scull(joint.axis, joint.along, side, j, 3.0, 0.85)
                }
                Role::Fin(_, side, _, j) => {
                    let late = 0.8 * j as f32 + if side > 0.0 { 0.0 } else { 1.2 };
                    let out = Swing::new(1.0, &[Wave([2.0, 3.0, 4.0][j], 1.0, late)]);
                    let back = Swing::new(0.0, &[Wave([1.5, 2.5, 3.5][j], 1.0, late + 1.3)]);
                    vec![(joint.axis, out), (Vec3::Z, back)]
                }
            }
        })
        .collect();
    Score {
        name: "hover",
        seconds: 3.2,
        keys: 24,
        interpolation: Interpolation::Linear,
        turns,
        shift: [
            Swing::new(0.0, &[Wave(0.25, 1.0, 1.0)]),
            Swing::new(0.0, &[Wave(0.8, 1.0, 0.0)]),
            Swing::new(0.0, &[Wave(0.3, 1.0, 2.0)]),
        ],
        morphs: vec![
            Swing::new(0.5, &[Wave(0.5, 2.0, 0.5 * PI)]),
            Swing::new(0.35, &[Wave(0.35, 1.0, 0.5 * PI)]),
        ],
    }
}

/// The clips of the fish.
pub fn clips(rig: &Rig) -> Vec<Clip> {
    vec![swim(rig).clip(rig), hover(rig).clip(rig)]
}
