//! A laurel wreath whose leaves stand clear of the head.

use glam::{Mat3, Vec2, Vec3};

use super::hair::on_cap;
use crate::sdf::{FAR, Station, Sweep, meet};

/// One leaf: a frame (along, across, out of its face) and its size.
struct Leaf {
    at: Vec3,
    turn: Mat3,
    length: f32,
    width: f32,
    bend: f32,
}

/// Both branches.
pub struct Wreath {
    leaves: Vec<Leaf>,
    stem: Sweep,
}

/// Leaves per side and row.
const NODES: usize = 7;

/// The wreath's path over the hair at `angle` from the front: high over the
/// forehead, lower at the back.
fn path(angle: f32) -> Vec3 {
    let rise = (53.0 - 24.0 * (0.5 - 0.5 * angle.cos())).to_radians();
    Vec3::new(
        angle.sin() * rise.cos(),
        rise.sin(),
        angle.cos() * rise.cos(),
    )
}

impl Wreath {
    /// Binds two branches that meet over the forehead.
    pub fn new() -> Self {
        let mut leaves = Vec::new();
        for side in [-1.0, 1.0] {
            for node in 0..NODES {
                for upper in [true, false] {
                    leaves.push(Leaf::grow(side, node, upper));
                }
            }
        }
        let count = 40;
        let stations = (0..=count)
            .map(|k| {
                let angle = (k as f32 / count as f32 - 0.5) * 330f32.to_radians();
                let (at, up) = on_cap(path(angle), 1.9);
                Station {
                    at,
                    up,
                    wide: 0.95,
                    thick: 0.95,
                }
            })
            .collect();
        Self {
            leaves,
            stem: Sweep::new(stations),
        }
    }

    /// Distance to the wreath, head frame.
    pub fn distance(&self, p: Vec3) -> f32 {
        self.leaves
            .iter()
            .fold(self.stem.distance(p, FAR), |d, leaf| {
                d.min(leaf.distance(p))
            })
    }
}

impl Leaf {
    fn grow(side: f32, node: usize, upper: bool) -> Self {
        let shift = if upper { 0.0 } else { 14.0 };
        let angle = side * (20.0 + 22.0 * node as f32 + shift).to_radians();
        let (at, normal) = on_cap(path(angle), 1.6);
        let ahead = (path(angle - side * 0.05) - path(angle + side * 0.05)).normalize();
        // Blades face outward rather than along the skull's normal, so that
        // they show their breadth from the front.
        let out = (normal * Vec3::new(1.0, 0.25, 1.0)).normalize();
        let ahead = ahead.reject_from_normalized(out).normalize();
        let above = out.cross(ahead);
        let above = above * above.y.signum();
        let vary = (node as f32 * 2.4 + f32::from(u8::from(upper))).sin();
        // The upper leaves stand clear; at the sides they flare outward instead
        // of forward and turn their faces to the front. The lower ones follow
        // the branch, close to the hair.
        let flank = angle.sin().abs();
        let (forward, lean, lift, turn) = if upper {
            let lift = 0.42 + 0.1 * vary + 0.4 * flank;
            (0.85 - 0.4 * flank, 0.62 + 0.14 * vary, lift, flank)
        } else {
            (0.9, -0.34 + 0.1 * vary, 0.16 + 0.15 * flank, 0.3 * flank)
        };
        let along = (ahead * forward + above * lean + out * lift).normalize();
        let face = (out * (1.0 - 0.5 * turn) + Vec3::Z * (0.8 * turn) + above * 0.2 * vary)
            .reject_from_normalized(along)
            .normalize();
        let across = face.cross(along);
        let size = if upper { 1.0 } else { 0.86 } * (1.0 - 0.015 * node as f32);
        Self {
            at,
            turn: Mat3::from_cols(along, across, face).transpose(),
            length: 10.4 * size,
            width: 4.6 * size,
            bend: 0.13 + 0.05 * vary,
        }
    }

    /// A pointed blade 1.4 mm thick, 1 mm at the edge, cupped, curling outward
    /// at the tip, with a midrib line.
    fn distance(&self, p: Vec3) -> f32 {
        let far = p.distance(self.at + self.turn.row(0) * self.length * 0.5) - self.length * 0.62;
        if far > 2.0 {
            return far;
        }
        let q = self.turn * (p - self.at);
        let t = q.x / self.length;
        let curl = self.length * self.bend * (t * t - 0.3 * t) + 0.07 * q.y * q.y;
        let z = q.z - curl;
        let blade = vesica(
            Vec2::new(q.x - self.length * 0.5, q.y),
            self.length * 0.5,
            self.width * 0.5,
        );
        let rib = 0.3 * (1.0 - (q.y / 0.55).abs()).max(0.0);
        let half = 0.68 - 0.2 * (2.0 * q.y / self.width).powi(2).min(1.0);
        let face = (z - half + rib).max(-z - half);
        meet(blade, face * 0.85, 0.35)
    }
}

/// Distance to the lens of half length `a` and half width `b` along x
/// (Quilez's vesica).
fn vesica(p: Vec2, a: f32, b: f32) -> f32 {
    let p = p.abs();
    let d = (a * a - b * b) / (2.0 * b);
    if d * (p.x - a) > p.y * a {
        p.distance(Vec2::new(a, 0.0))
    } else {
        p.distance(Vec2::new(0.0, -d)) - (d + b)
    }
}
