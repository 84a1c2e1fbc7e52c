//! Skull and face, in the head's frame.

use glam::Vec3;

use super::mirrored;
use crate::sdf::{carve, chain, ellipsoid, join, meet, smoothstep, sphere, spline};

/// Half the width of the face against height.
const WIDTH: [(f32, f32); 10] = [
    (-16.0, 2.2),
    (-14.8, 3.5),
    (-13.0, 5.2),
    (-11.0, 6.5),
    (-8.5, 7.45),
    (-5.5, 8.45),
    (-2.0, 9.25),
    (2.0, 9.3),
    (6.0, 9.2),
    (11.0, 7.8),
];

/// The profile, without nose and lips, against height.
const PROFILE: [(f32, f32); 10] = [
    (-16.0, 8.2),
    (-14.8, 10.0),
    (-13.2, 10.5),
    (-11.5, 10.3),
    (-9.0, 11.0),
    (-6.0, 10.9),
    (-2.0, 10.9),
    (2.0, 11.3),
    (6.0, 11.0),
    (11.0, 9.2),
];

/// A run of capsules: centre and radius at each point.
type Line = Vec<(Vec3, f32)>;

/// The face, with the lines of its features laid on the skin.
pub struct Face {
    brow: Line,
    crease: Line,
    upper_lip: Line,
    lower_lip: Line,
    parting: Line,
    corner: Vec3,
}

impl Face {
    /// Draws the features on the bare face.
    pub fn new() -> Self {
        let lips = [
            // x, y, height over the skin, radius
            (0.0, -8.85, 0.05, 0.50),
            (0.75, -8.62, 0.10, 0.50),
            (1.7, -8.95, 0.05, 0.42),
            (2.4, -9.2, -0.05, 0.30),
            (2.95, -9.28, -0.15, 0.18),
        ];
        let lower = [
            (0.0, -10.35, 0.15, 0.72),
            (1.0, -10.3, 0.10, 0.68),
            (1.9, -10.0, 0.0, 0.50),
            (2.75, -9.48, -0.15, 0.22),
        ];
        let parting = [
            (0.0, -9.58, 0.50, 0.26),
            (0.8, -9.42, 0.48, 0.26),
            (1.9, -9.5, 0.30, 0.26),
            (2.6, -9.42, 0.12, 0.22),
            (3.15, -9.22, 0.10, 0.16),
        ];
        let brow = [
            (1.4, 2.6, -0.55, 0.6),
            (2.6, 3.3, -0.4, 0.62),
            (4.3, 3.75, -0.3, 0.65),
            (6.3, 3.2, -0.4, 0.6),
            (7.7, 1.9, -0.5, 0.4),
        ];
        let crease = [
            (2.3, 0.85, 0.05, 0.16),
            (3.2, 1.55, 0.1, 0.22),
            (4.4, 1.85, 0.1, 0.24),
            (5.6, 1.55, 0.1, 0.22),
            (6.4, 0.95, 0.05, 0.12),
        ];
        Self {
            brow: draw(&brow, unbrowed),
            crease: draw(&crease, |q| eye(bare(q), q)),
            upper_lip: draw(&lips, bare),
            lower_lip: draw(&lower, bare),
            parting: draw(&parting, bare),
            corner: draw(&[(3.35, -9.2, 0.35, 0.0)], bare)[0].0,
        }
    }

    /// The skin of the head without ears, down to the jaw.
    pub fn skin(&self, p: Vec3) -> f32 {
        let q = mirrored(p);
        let d = unbrowed(q);
        if d > 5.0 {
            return d - 2.0;
        }
        let d = join(d, chain(q, &self.brow), 1.8);
        let d = with_nose(d, q);
        let d = self.mouth(d, q);
        let d = eye(d, q);
        carve(d, chain(q, &self.crease), 0.5)
    }

    /// Cupid's bow above, a full lower lip, a parting line that dips at the
    /// middle, and the hollow over the chin.
    fn mouth(&self, skin: f32, q: Vec3) -> f32 {
        let hollow = ellipsoid(q, Vec3::new(0.0, -11.85, 11.9), Vec3::new(2.0, 0.5, 0.9));
        let d = carve(skin, hollow, 1.2);
        let d = join(d, chain(q, &self.upper_lip), 0.55);
        let d = join(d, chain(q, &self.lower_lip), 0.6);
        let d = carve(d, sphere(q, self.corner, 0.32), 0.6);
        carve(d, chain(q, &self.parting), 0.4)
    }
}

/// Puts points given as (x, y, height over the skin, radius) on `skin`, seen
/// from the front.
fn draw(points: &[(f32, f32, f32, f32)], skin: impl Fn(Vec3) -> f32) -> Line {
    points
        .iter()
        .map(|&(x, y, lift, radius)| {
            let mut q = Vec3::new(x, y, 18.0);
            for _ in 0..60 {
                q.z -= 0.7 * (skin(q) - lift);
            }
            (q, radius)
        })
        .collect()
}

/// The masses of the head.
fn unbrowed(q: Vec3) -> f32 {
    let d = join(skull(q), mask(q), 1.5);
    let d = join(d, cheek(q), 2.6);
    let d = join(d, chin(q), 3.0);
    let d = join(d, muzzle(q), 2.0);
    carve(d, socket(q), 1.6)
}

/// The face without brow, mouth and eyes.
fn bare(q: Vec3) -> f32 {
    with_nose(unbrowed(q), q)
}

fn with_nose(skin: f32, q: Vec3) -> f32 {
    let d = join(skin, nose(q), 1.1);
    let d = carve(d, nostril(q), 0.35);
    carve(d, philtrum(q), 0.5)
}

/// The brain case.
fn skull(q: Vec3) -> f32 {
    ellipsoid(q, Vec3::new(0.0, 3.8, -1.6), Vec3::new(9.6, 11.4, 12.1))
}

/// The block of the face: level sections are superellipses whose half width
/// and depth follow [`WIDTH`] and [`PROFILE`], cut below from chin to jaw
/// angle.
fn mask(q: Vec3) -> f32 {
    const POWER: f32 = 2.35;
    let (w, dw) = spline(&WIDTH, q.y);
    let (f, df) = spline(&PROFILE, q.y);
    let (a, b) = (q.x / w, q.z.max(0.0) / f);
    let s = (a.powf(POWER) + b.powf(POWER)).max(1e-6);
    let radius = s.powf(1.0 / POWER);
    let scale = radius / s;
    let (ga, gb) = (scale * a.powf(POWER - 1.0), scale * b.powf(POWER - 1.0));
    let slope = Vec3::new(ga / w, -ga * a / w * dw - gb * b / f * df, gb / f);
    let side = (radius - 1.0) / slope.length().max(0.02);
    let under = -(q.y + 15.3 + 0.62 * (q.z - 9.0)) / 1.18;
    let behind = -q.z - 4.0;
    let above = q.y - 11.0;
    meet(meet(meet(side, under, 2.4), behind, 3.0), above, 2.0)
}

/// Cheekbone, the widest point of the face, and the full cheek of youth.
fn cheek(q: Vec3) -> f32 {
    let bone = ellipsoid(q, Vec3::new(5.6, -3.4, 6.9), Vec3::new(2.6, 2.2, 2.6));
    let flesh = ellipsoid(q, Vec3::new(4.4, -7.0, 6.9), Vec3::new(3.2, 3.8, 2.4));
    join(bone, flesh, 2.5)
}

fn chin(q: Vec3) -> f32 {
    ellipsoid(q, Vec3::new(0.0, -13.2, 8.6), Vec3::new(2.6, 1.9, 2.2))
}

/// The teeth push the lips forward.
fn muzzle(q: Vec3) -> f32 {
    ellipsoid(q, Vec3::new(0.0, -9.0, 8.6), Vec3::new(3.9, 3.0, 3.0))
}

fn socket(q: Vec3) -> f32 {
    ellipsoid(q, Vec3::new(4.35, 0.45, 12.5), Vec3::new(2.9, 1.95, 3.35))
}

/// A straight Greek nose: the ridge runs on from the forehead.
fn nose(q: Vec3) -> f32 {
    let ridge = chain(
        q,
        &[
            (Vec3::new(0.0, 3.2, 10.1), 1.0),
            (Vec3::new(0.0, 0.6, 11.35), 0.85),
            (Vec3::new(0.0, -2.6, 12.6), 0.92),
            (Vec3::new(0.0, -5.2, 13.65), 1.0),
        ],
    );
    let flank = chain(
        q,
        &[
            (Vec3::new(0.3, 0.0, 10.4), 0.9),
            (Vec3::new(0.65, -3.0, 11.1), 0.85),
            (Vec3::new(0.8, -5.3, 11.7), 0.95),
        ],
    );
    let tip = ellipsoid(q, Vec3::new(0.0, -5.45, 13.7), Vec3::new(1.08, 0.95, 1.12));
    let septum = chain(
        q,
        &[
            (Vec3::new(0.0, -6.1, 13.9), 0.55),
            (Vec3::new(0.0, -6.7, 11.8), 0.6),
        ],
    );
    let wing = ellipsoid(q, Vec3::new(1.4, -5.85, 12.0), Vec3::new(0.72, 0.85, 1.2));
    let bridge = join(join(ridge, flank, 1.4), tip, 0.8);
    join(join(bridge, wing, 0.5), septum, 0.5)
}

fn nostril(q: Vec3) -> f32 {
    ellipsoid(q, Vec3::new(0.82, -6.65, 12.5), Vec3::new(0.4, 0.7, 0.8))
}

fn philtrum(q: Vec3) -> f32 {
    chain(
        q,
        &[
            (Vec3::new(0.0, -7.2, 12.0), 0.3),
            (Vec3::new(0.0, -8.1, 12.3), 0.38),
        ],
    )
}

/// A blank classical eyeball under two lids half a millimetre thick whose
/// opening is an almond 4.5 mm long, its outer corner a little higher.
fn eye(skin: f32, q: Vec3) -> f32 {
    const AT: Vec3 = Vec3::new(4.15, 0.0, 7.35);
    const BALL: f32 = 2.95;
    let ball = sphere(q, AT, BALL);
    if ball > 2.5 {
        return skin;
    }
    let u = q.x - AT.x;
    let v = q.y - AT.y - 0.06 * u;
    let across = 1.0 - (u / 2.3) * (u / 2.3);
    let gap = (v - 1.02 * across).max(-0.75 * across - v) * 0.8;
    let upper = smoothstep(-0.4, 0.4, v);
    let lid = sphere(q, AT, BALL + 0.36 + 0.26 * upper);
    let front = 0.25 * (q.z - AT.z) - 0.3;
    let d = join(skin, lid, 0.95);
    let d = carve(d, gap.max(-front), 0.4);
    d.min(ball)
}
