//! Hair: parted in the middle, combed back in waves over the temples into a
//! knot, with a few locks that escape.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

use super::{Frame, mirrored};
use crate::sdf::{Station, Sweep, curve, ellipsoid, join, join_sweeps, meet, smoothstep};

/// The ellipsoid on which the locks lie.
pub const CAP_AT: Vec3 = Vec3::new(0.0, 3.8, -1.6);
/// Its radii.
pub const CAP: Vec3 = Vec3::new(10.1, 11.9, 12.6);

/// How far the cap fills up between the locks, mm.
const FILL: f32 = 0.35;

/// Locks combed back on each side.
const LOCKS: usize = 6;

/// All the locks.
pub struct Hair {
    combed: Vec<Sweep>,
    curls: Vec<Sweep>,
    knot: Vec<Sweep>,
    tresses: Vec<Sweep>,
}

/// The point of the cap in direction `d`, `lift` mm above it, and the cap's
/// normal there.
pub fn on_cap(d: Vec3, lift: f32) -> (Vec3, Vec3) {
    let d = d.normalize();
    let normal = (d / CAP).normalize();
    (CAP_AT + d * CAP + normal * lift, normal)
}

impl Hair {
    /// Combs the hair of a head placed by `head`.
    pub fn new(head: Frame) -> Self {
        let mut combed = Vec::new();
        for side in [-1.0, 1.0] {
            for i in 0..LOCKS {
                combed.push(combed_lock(side, i as f32, 1.0).grooved(1.0, 0.45));
                // A finer strand strays over each gap.
                if i + 1 < LOCKS {
                    combed.push(combed_lock(side, i as f32 + 0.55, 0.55));
                }
            }
        }
        Self {
            combed,
            curls: [-1.0, 1.0].map(temple_curl).to_vec(),
            knot: knot(),
            tresses: [-1.0, 1.0].map(|side| tress(side, head)).concat(),
        }
    }

    /// Distance to the hair on the head, head frame.
    pub fn distance(&self, p: Vec3) -> f32 {
        // Before the face there are only the two temple curls.
        let curls = join_sweeps(p, &self.curls, 0.3);
        let before = 0.8 * p.z - 0.6 * p.y - 1.3;
        if before > 7.0 {
            return curls.min(before - 3.0);
        }
        join(self.cap(p), join_sweeps(p, &self.combed, 0.15), 0.2)
            .min(curls)
            .min(join(
                join_sweeps(p, &self.knot, 0.3),
                ellipsoid(p, Vec3::new(0.0, -1.0, -15.4), Vec3::new(4.4, 4.2, 3.2)),
                0.3,
            ))
    }

    /// What shows between the locks: a cap that ends at the hairline.
    fn cap(&self, p: Vec3) -> f32 {
        let q = mirrored(p);
        let hairline = -(0.6 * q.y - 0.8 * q.z + 1.3);
        meet(ellipsoid(p, CAP_AT, CAP) - FILL, hairline, 0.8)
    }

    /// Distance to the loose tresses, world frame.
    pub fn tresses(&self, p: Vec3) -> f32 {
        join_sweeps(p, &self.tresses, 0.2)
    }
}

/// Lock `i` on one side: from the parting, down over the temple or
/// the side of the head, back to the knot. The first frames the face.
fn combed_lock(side: f32, i: f32, size: f32) -> Sweep {
    let s = i / (LOCKS - 1) as f32;
    let start = (26.0 + 100.0 * s).to_radians();
    let path = [
        Vec3::new(0.05, start.sin(), start.cos()),
        Vec3::new(0.66, 0.38, 0.65).lerp(Vec3::new(0.28, 0.78, -0.56), s),
        Vec3::new(0.97, 0.10, 0.12).lerp(Vec3::new(0.45, 0.50, -0.74), s),
        Vec3::new(0.80, -0.20, -0.52).lerp(Vec3::new(0.36, 0.12, -0.92), s),
        Vec3::new(0.20, -0.38, -0.90).lerp(Vec3::new(0.12, -0.2, -0.97), s),
    ]
    .map(Vec3::normalize);
    let count = 44;
    let stations = (0..=count)
        .map(|k| {
            let t = k as f32 / count as f32;
            let d = curve(&path, t).normalize();
            let ahead = (curve(&path, (t + 0.02).min(1.0)) - curve(&path, (t - 0.02).max(0.0)))
                .normalize_or(Vec3::Z);
            let across = d.cross(ahead).normalize();
            let wave = 0.1 * (TAU * (2.3 * t + 0.13 * i)).sin() * (PI * t).sin().sqrt();
            let d = d + across * wave;
            let swell = 0.35 * (TAU * (2.3 * t + 0.13 * i + 0.2)).cos();
            let (at, up) = on_cap(
                d * Vec3::new(side, 1.0, 1.0),
                -0.2 + 0.3 * (PI * t).sin() + swell * 0.5 + 2.0 * (1.0 - size),
            );
            let body = 0.55 + 0.45 * (PI * t).sin();
            Station {
                at,
                up,
                wide: 1.5 * body * size,
                thick: 1.9 * body * size,
            }
        })
        .collect();
    Sweep::new(stations)
}

/// A small curl before the ear.
fn temple_curl(side: f32) -> Sweep {
    let path = [
        Vec3::new(8.6, 4.2, 4.2),
        Vec3::new(9.3, 1.6, 4.6),
        Vec3::new(9.3, -0.6, 3.4),
        Vec3::new(8.9, -2.6, 3.8),
        Vec3::new(8.6, -3.6, 5.0),
        Vec3::new(8.5, -2.8, 5.9),
    ];
    let count = 24;
    let stations = (0..=count)
        .map(|k| {
            let t = k as f32 / count as f32;
            Station {
                at: curve(&path, t) * Vec3::new(side, 1.0, 1.0),
                up: Vec3::new(side, 0.0, 0.2),
                wide: 1.25 * (1.0 - 0.75 * t),
                thick: 0.95 * (1.0 - 0.7 * t),
            }
        })
        .collect();
    Sweep::new(stations)
}

/// The knot at the back: five locks wound about its axis.
fn knot() -> Vec<Sweep> {
    (0..5)
        .map(|i| {
            let count = 36;
            let stations = (0..=count)
                .map(|k| {
                    let t = k as f32 / count as f32;
                    let angle = TAU * (i as f32 / 5.0 + 0.62 * t);
                    let r = 4.4 * (1.0 - t).powf(0.6) + 0.5;
                    let z = -14.2 - 4.2 * t.powf(0.7);
                    let out = Vec3::new(angle.cos(), angle.sin(), 0.0);
                    Station {
                        at: Vec3::new(0.0, -1.0, z) + out * r * Vec3::new(1.0, 0.92, 1.0),
                        up: (out * (1.0 - t) - Vec3::Z * (0.3 + t)).normalize(),
                        wide: 1.9 - 0.9 * t,
                        thick: 1.5 - 0.6 * t,
                    }
                })
                .collect();
            Sweep::new(stations).grooved(1.5, 0.35)
        })
        .collect()
}

/// A loose tress that falls from behind the ear to the collarbone: two strands
/// wound about each other, each 2 to 2.5 mm thick, free of the neck for most of
/// their length.
fn tress(side: f32, head: Frame) -> [Sweep; 2] {
    let at = |x: f32, y: f32, z: f32| head.to_world(Vec3::new(x * side, y, z));
    let mut path = vec![at(7.0, 0.5, -7.4), at(8.8, -5.0, -6.0)];
    if side < 0.0 {
        path.extend([
            Vec3::new(-9.6, 41.0, -2.4),
            Vec3::new(-7.8, 36.5, -0.4),
            Vec3::new(-9.2, 32.5, 1.6),
            Vec3::new(-7.6, 28.5, 5.0),
            Vec3::new(-9.4, 24.5, 6.8),
            Vec3::new(-8.2, 22.0, 7.6),
        ]);
    } else {
        path.extend([
            Vec3::new(9.2, 41.0, -4.5),
            Vec3::new(8.6, 37.0, -6.5),
            Vec3::new(9.6, 33.0, -8.5),
            Vec3::new(8.0, 29.0, -11.4),
            Vec3::new(9.0, 25.0, -13.0),
        ]);
    }
    [0.0, 0.5].map(|phase| {
        let count = 64;
        let stations = (0..=count)
            .map(|k| {
                let t = k as f32 / count as f32;
                let coil = TAU * (2.6 * t * side + phase);
                let out = Vec3::new(coil.sin(), 0.0, coil.cos());
                let body = (0.5 + 0.5 * (PI * (0.15 + 0.7 * t)).sin())
                    * (1.0 - 0.6 * smoothstep(0.8, 1.0, t));
                Station {
                    at: curve(&path, t) + out * 0.85 * body,
                    up: out,
                    wide: 1.3 * body,
                    thick: 1.15 * body,
                }
            })
            .collect();
        Sweep::new(stations)
    })
}
