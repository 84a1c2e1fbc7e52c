//! Animation clips: keyframes of nodes and morph weights, sampled in time.
//!
//! Interpolations are those of glTF 2.0, appendix C.

use super::model::{Local, Node};
use glam::{DQuat, DVec3};

/// One motion of a rig.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// Its name.
    pub name: String,
    /// Time of its last keyframe, s; above 0.
    pub duration: f64,
    /// What it moves.
    pub channels: Vec<Channel>,
}

/// One property of one node over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// The node, as an index into [`super::model::Rig::nodes`].
    pub node: usize,
    /// Times of its keyframes, s, ascending and finite; at least one.
    pub times: Vec<f64>,
    /// How it goes from one to the next.
    pub interpolation: Interpolation,
    /// Its values.
    pub values: Values,
}

/// How values go from one keyframe to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// The earlier keyframe holds.
    Step,
    /// Straight, for rotations along the shorter arc.
    Linear,
    /// A cubic Hermite spline: each keyframe has an in-tangent, a value and an out-tangent, in that order.
    CubicSpline,
}

/// Values at the keyframes: one each, or three for [`Interpolation::CubicSpline`].
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Translations.
    Translation(Vec<DVec3>),
    /// Rotations, as unit quaternions, tangents excepted.
    Rotation(Vec<DQuat>),
    /// Scales.
    Scale(Vec<DVec3>),
    /// Morph weights: as many a keyframe (or tangent) as the node's mesh has targets.
    Weights(Vec<f64>),
}

impl Clip {
    /// Moves `locals` and `weights`, which hold the rest pose of `nodes`, to where they are at `time` (s).
    pub fn apply(&self, time: f64, nodes: &[Node], locals: &mut [Local], weights: &mut [f64]) {
        // The glTF loader's half.
        let _ = (time, nodes, locals, weights);
    }
}
