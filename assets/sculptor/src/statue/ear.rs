//! A faun's ear, thin so that light shines through it.

use glam::{Mat3, Vec2, Vec3};

use super::mirrored;
use crate::sdf::{chain, ellipsoid, join, meet, polygon, smoothstep, sphere};

/// The root of the ear on the side of the head.
const AT: Vec3 = Vec3::new(8.9, -0.6, -1.2);
/// Half the thickness of the shell, mm: 1.5 mm in the hollow, 2 mm at the rim.
const HALF: f32 = 0.7;

/// Scale of the drawing below.
const SIZE: f32 = 0.94;

/// Outline in the plane of the ear: x away from the head, y up.
const OUTLINE: [(f32, f32); 15] = [
    (-1.0, -3.0),
    (0.0, -4.2),
    (1.2, -4.5),
    (2.1, -3.6),
    (2.8, -2.2),
    (3.9, -0.2),
    (4.8, 2.2),
    (5.4, 4.8),
    (5.9, 7.6),
    (5.6, 7.6),
    (3.9, 5.8),
    (2.0, 4.6),
    (0.4, 3.6),
    (-1.0, 2.0),
    (-1.4, -0.6),
];

/// A pair of ears.
pub struct Ear {
    outline: Vec<Vec2>,
    turn: Mat3,
}

impl Ear {
    /// Stands the ears out from the head at 50 degrees, leaning back.
    pub fn new() -> Self {
        let out = Vec3::new(0.74, 0.06, -0.67).normalize();
        let up = Vec3::new(0.14, 0.97, -0.16)
            .reject_from_normalized(out)
            .normalize();
        let points: Vec<Vec2> = OUTLINE
            .iter()
            .map(|&(x, y)| Vec2::new(x * 1.3, y))
            .collect();
        Self {
            outline: smooth_outline(&points),
            turn: Mat3::from_cols(out, up, out.cross(up)).transpose(),
        }
    }

    /// Distance to both ears, head frame.
    pub fn distance(&self, p: Vec3) -> f32 {
        let e = self.turn * (mirrored(p) - AT) / SIZE;
        let far = e.distance(Vec3::new(3.0, 1.6, 0.0)) - 8.2;
        if far > 3.0 {
            return far * SIZE;
        }
        let edge = polygon(e.truncate(), &self.outline);
        let inside = -edge;
        // A cupped shell: set back in the middle, its rim rolled forward.
        let cup = -smoothstep(0.3, 2.4, inside) + 0.05 * e.x;
        let helix = 0.5 * smoothstep(1.25, 0.75, inside) * smoothstep(-0.2, 0.4, inside);
        let front = e.z - cup - HALF - helix;
        let back = cup - HALF - e.z;
        let shell = meet(edge, front.max(back) * 0.8, 0.7);
        // The fold inside the helix, forking towards the tip.
        let antihelix = chain(
            e,
            &[
                (Vec3::new(0.7, -2.9, 0.0), 0.5),
                (Vec3::new(2.0, -1.6, -0.1), 0.5),
                (Vec3::new(2.6, 0.6, -0.2), 0.5),
                (Vec3::new(3.2, 3.0, -0.3), 0.35),
            ],
        );
        let shell = join(shell, antihelix, 0.5);
        let hollow = ellipsoid(e, Vec3::new(0.9, -0.7, 0.6), Vec3::new(1.1, 1.7, 1.1));
        let shell = meet(shell, -hollow, 0.5);
        let tragus = ellipsoid(e, Vec3::new(-0.5, -1.1, 0.6), Vec3::new(0.6, 0.9, 0.8));
        let lobe = sphere(e, Vec3::new(0.9, -3.5, 0.1), 0.85);
        join(join(shell, tragus, 0.5), lobe, 0.8) * SIZE
    }
}

/// Rounds a closed outline with a Catmull-Rom curve.
fn smooth_outline(points: &[Vec2]) -> Vec<Vec2> {
    let n = points.len();
    let at = |i: usize| points[i % n];
    (0..n)
        .flat_map(|i| {
            let (a, b, c, d) = (at(i + n - 1), at(i), at(i + 1), at(i + 2));
            (0..3).map(move |k| {
                let t = k as f32 / 3.0;
                0.5 * (b * 2.0
                    + (c - a) * t
                    + (a * 2.0 - b * 5.0 + c * 4.0 - d) * (t * t)
                    + (b * 3.0 - a - c * 3.0 + d) * (t * t * t))
            })
        })
        .collect()
}
