//! Animation clips: keyframes of nodes and morph weights, sampled in time.
//!
//! Interpolations are those of glTF 2.0, appendix C.

use super::model::{Local, Node};
use glam::{DQuat, DVec3};
use std::ops::{Add, Mul};

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

/// Where a time lies among keyframes.
enum Span {
    /// On one, or held by the first or last.
    At(usize),
    /// Between one and the next.
    Between {
        first: usize,
        /// How far on the way to the next, 0 to 1.
        fraction: f64,
        /// Seconds from one to the next.
        interval: f64,
    },
}

impl Clip {
    /// Moves `locals` and `weights`, which hold the rest pose of `nodes`, to where they are at `time` (s).
    ///
    /// The ends hold before the first keyframe of a channel and after its last. A node placed by a matrix stays.
    pub fn apply(&self, time: f64, nodes: &[Node], locals: &mut [Local], weights: &mut [f64]) {
        for channel in &self.channels {
            let (Some(node), Some(local)) = (nodes.get(channel.node), locals.get_mut(channel.node))
            else {
                continue;
            };
            match (&channel.values, local) {
                (Values::Translation(values), Local::Parts(parts)) => {
                    parts.translation = channel.sample(time, |i| values[i], DVec3::lerp);
                }
                (Values::Rotation(values), Local::Parts(parts)) => {
                    // On the shorter arc; a spline leaves the unit sphere between its keyframes.
                    let rotation = channel.sample(time, |i| values[i], DQuat::slerp);
                    let length = rotation.length();
                    // Opposite tangents may lead a spline through zero, where any rotation is as good.
                    if length > 0.0 && length.is_finite() {
                        parts.rotation = rotation * length.recip();
                    }
                }
                (Values::Scale(values), Local::Parts(parts)) => {
                    parts.scale = channel.sample(time, |i| values[i], DVec3::lerp);
                }
                (Values::Weights(values), _) => {
                    let count = node.weights.len();
                    let own = weights.iter_mut().skip(node.first_weight).take(count);
                    for (target, weight) in own.enumerate() {
                        let at = |i: usize| values[i * count + target];
                        *weight = channel.sample(time, at, |a, b, t| a + (b - a) * t);
                    }
                }
                (_, Local::Matrix(_)) => {}
            }
        }
    }
}

impl Channel {
    /// Its value at `time` (s), by glTF 2.0, appendix C. `at` gives its values and tangents in their order; `linear`
    /// goes from one to another.
    fn sample<T>(&self, time: f64, at: impl Fn(usize) -> T, linear: impl Fn(T, T, f64) -> T) -> T
    where
        T: Add<Output = T> + Mul<f64, Output = T>,
    {
        let cubic = self.interpolation == Interpolation::CubicSpline;
        let value = |key: usize| at(if cubic { 3 * key + 1 } else { key });
        match (self.span(time), self.interpolation) {
            (Span::At(key), _) => value(key),
            (Span::Between { first, .. }, Interpolation::Step) => value(first),
            (
                Span::Between {
                    first, fraction, ..
                },
                Interpolation::Linear,
            ) => linear(value(first), value(first + 1), fraction),
            (
                Span::Between {
                    first,
                    fraction: t,
                    interval,
                },
                Interpolation::CubicSpline,
            ) => {
                // Appendix C.5. Tangents are a second's worth, hence the interval.
                let (t2, t3) = (t * t, t * t * t);
                let out_tangent = at(3 * first + 2);
                let in_tangent = at(3 * (first + 1));
                value(first) * (2.0 * t3 - 3.0 * t2 + 1.0)
                    + out_tangent * (interval * (t3 - 2.0 * t2 + t))
                    + value(first + 1) * (3.0 * t2 - 2.0 * t3)
                    + in_tangent * (interval * (t3 - t2))
            }
        }
    }

    /// Where `time` (s) lies among its keyframes.
    fn span(&self, time: f64) -> Span {
        let passed = self.times.partition_point(|&key| key <= time);
        let before = passed.checked_sub(1);
        let keys =
            before.and_then(|first| Some((first, self.times[first], *self.times.get(passed)?)));
        match keys {
            Some((first, start, end)) => Span::Between {
                first,
                fraction: (time - start) / (end - start),
                interval: end - start,
            },
            None => Span::At(before.unwrap_or(0)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::model::Parts;
    use super::*;
    use std::f64::consts::PI;

    /// The parts and weights of a node with two morph targets, where `channel` has moved them.
    fn moved(channel: Channel, time: f64) -> (Parts, Vec<f64>) {
        let rest = Local::Parts(Parts::default());
        let node = Node {
            name: String::new(),
            parent: None,
            local: rest,
            first_weight: 1,
            weights: vec![0.0; 2],
        };
        let clip = Clip {
            name: String::new(),
            duration: 1.0,
            channels: vec![channel],
        };
        let (mut locals, mut weights) = (vec![rest], vec![0.5, 0.0, 0.0, 0.5]);
        clip.apply(time, &[node], &mut locals, &mut weights);
        match locals[0] {
            Local::Parts(parts) => (parts, weights),
            Local::Matrix(_) => panic!("a matrix"),
        }
    }

    fn channel(times: &[f64], interpolation: Interpolation, values: Values) -> Channel {
        Channel {
            node: 0,
            times: times.to_vec(),
            interpolation,
            values,
        }
    }

    #[test]
    fn steps_hold_and_lines_join() {
        let values = [1.0, 3.0, -1.0].map(DVec3::splat).to_vec();
        for (time, step, linear) in [
            (-7.0, 1.0, 1.0),
            (0.5, 1.0, 1.0),
            (1.0, 1.0, 1.5),
            (2.49, 1.0, 2.99),
            (2.5, 3.0, 3.0),
            (2.75, 3.0, 1.0),
            (3.0, -1.0, -1.0),
            (99.0, -1.0, -1.0),
        ] {
            let times = [0.5, 2.5, 3.0];
            for (interpolation, expected) in
                [(Interpolation::Step, step), (Interpolation::Linear, linear)]
            {
                let values = Values::Translation(values.clone());
                let (parts, _) = moved(channel(&times, interpolation, values), time);
                let error = parts.translation - DVec3::splat(expected);
                assert!(error.length() < 1e-12, "{interpolation:?} {time}");
            }
            let scale = Values::Scale(values.clone());
            let (parts, _) = moved(channel(&times, Interpolation::Linear, scale), time);
            assert!((parts.scale.y - linear).abs() < 1e-12, "{time}");
            assert_eq!(parts.translation, DVec3::ZERO);
        }
    }

    #[test]
    fn rotations_take_the_shorter_arc() {
        let (start, end) = (DQuat::IDENTITY, DQuat::from_rotation_y(2.0 * PI / 3.0));
        // The same rotation by either sign.
        for end in [end, -end] {
            for (time, angle) in [
                (0.0, 0.0),
                (1.0, PI / 6.0),
                (3.0, PI / 2.0),
                (5.0, 2.0 * PI / 3.0),
            ] {
                let values = Values::Rotation(vec![start, end]);
                let (parts, _) = moved(channel(&[0.0, 4.0], Interpolation::Linear, values), time);
                let expected = DQuat::from_rotation_y(angle);
                assert!(parts.rotation.dot(expected).abs() > 1.0 - 1e-12, "{time}");
            }
        }
        let values = Values::Rotation(vec![start, end]);
        let (parts, _) = moved(channel(&[0.0, 4.0], Interpolation::Step, values), 3.9);
        assert_eq!(parts.rotation, start);
    }

    #[test]
    fn splines_are_hermite() {
        // A cubic is its own spline: p(t) = t^3 - 2 t^2 + 3 over [1, 3] and [3, 3.5], with its slopes as tangents. What
        // nothing uses, the first in-tangent and the last out-tangent, is far off.
        let p = |t: f64| t.powi(3) - 2.0 * t.powi(2) + 3.0;
        let slope = |t: f64| 3.0 * t.powi(2) - 4.0 * t;
        let times = [1.0, 3.0, 3.5];
        let mut values: Vec<DVec3> = times
            .iter()
            .flat_map(|&t| [slope(t), p(t), slope(t)])
            .map(|v| DVec3::new(v, 2.0 * v, -v))
            .collect();
        values[0] = DVec3::splat(1e6);
        values[8] = DVec3::splat(1e6);
        for (time, at) in [
            (0.0, 1.0),
            (1.0, 1.0),
            (1.3, 1.3),
            (2.0, 2.0),
            (3.0, 3.0),
            (3.2, 3.2),
            (3.5, 3.5),
            (4.0, 3.5),
        ] {
            let values = Values::Translation(values.clone());
            let (parts, _) = moved(channel(&times, Interpolation::CubicSpline, values), time);
            let expected = DVec3::new(p(at), 2.0 * p(at), -p(at));
            assert!(parts.translation.distance(expected) < 1e-12, "{time}");
        }
        // In- and out-tangents of one keyframe may differ: half way they count an eighth of the interval each.
        let values = [9.0, 0.0, 4.0, 2.0, 0.0, 9.0].map(DVec3::splat).to_vec();
        let values = Values::Scale(values);
        let (parts, _) = moved(
            channel(&[0.0, 2.0], Interpolation::CubicSpline, values),
            1.0,
        );
        assert!((parts.scale.x - 2.0 / 8.0 * (4.0 - 2.0)).abs() < 1e-12);
    }

    #[test]
    fn splined_rotations_are_units() {
        let zero = DQuat::from_array([0.0; 4]);
        let (a, b) = (DQuat::IDENTITY, DQuat::from_rotation_x(1.0));
        let values = vec![zero, a, zero, zero, b, zero];
        let at = |time| {
            let values = Values::Rotation(values.clone());
            moved(
                channel(&[0.0, 1.0], Interpolation::CubicSpline, values),
                time,
            )
            .0
            .rotation
        };
        // Without tangents, half way lies the mean, which is normalised.
        assert!(at(0.5).dot(DQuat::from_rotation_x(0.5)) > 1.0 - 1e-12);
        assert!((at(0.25).length() - 1.0).abs() < 1e-12);
        assert!(at(0.25).dot(DQuat::from_rotation_x(0.25)) > 0.99);
        // No rotation at all leaves the node as it was.
        let values = Values::Rotation(vec![zero, a, zero, zero, -a, zero]);
        let (parts, _) = moved(
            channel(&[0.0, 1.0], Interpolation::CubicSpline, values),
            0.5,
        );
        assert_eq!(parts.rotation, DQuat::IDENTITY);
    }

    #[test]
    fn weights_go_to_their_node_target_by_target() {
        let values = Values::Weights(vec![0.0, 1.0, 2.0, 5.0]);
        let (_, weights) = moved(channel(&[0.0, 2.0], Interpolation::Linear, values), 0.5);
        assert_eq!(weights, [0.5, 0.5, 2.0, 0.5]);
        // Tangents of all targets, values of all, tangents of all.
        let mut values = vec![0.0; 12];
        values[2..4].copy_from_slice(&[1.0, 2.0]);
        values[4..6].copy_from_slice(&[8.0, 16.0]);
        let values = Values::Weights(values);
        let (_, weights) = moved(
            channel(&[0.0, 1.0], Interpolation::CubicSpline, values),
            0.5,
        );
        assert_eq!(weights, [0.5, 1.5, 3.0, 0.5]);
    }
}
