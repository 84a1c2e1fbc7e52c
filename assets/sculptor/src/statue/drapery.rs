//! The cloth: pinned on her left shoulder, it fans out in pleats over chest
//! and back and leaves the right shoulder bare.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::torso::Torso;
use crate::sdf::{FAR, Station, Sweep, capsule, carve, gradient, join, meet, smoothstep, sphere};

/// Where the cloth is pinned.
const PIN: Vec3 = Vec3::new(12.6, 31.2, -1.2);

/// The middle of the brooch that holds it.
pub const BROOCH: Vec3 = Vec3::new(12.8, 31.7, 1.2);

/// Pleats in the whole round about the pin.
const PLEATS: f32 = 17.0;

/// The cloth.
pub struct Drapery {
    hem: Sweep,
}

/// Lays a point on the body, `lift` mm above its skin.
fn lay(torso: &Torso, p: Vec3, lift: f32) -> (Vec3, Vec3) {
    let field = |p| torso.distance(p);
    let mut q = p;
    for _ in 0..12 {
        let g = gradient(field, q, 0.1);
        q -= g * ((field(q) - lift) / g.length_squared().max(0.3)) * 0.8;
    }
    (q, gradient(field, q, 0.3).normalize_or(Vec3::Z))
}

impl Drapery {
    /// Drapes `torso`.
    pub fn new(torso: &Torso) -> Self {
        Self { hem: hem(torso) }
    }

    /// Distance to the clad body, given the distances `body` to the nude and
    /// `sleeve` to what fills the sleeve.
    pub fn distance(&self, p: Vec3, body: f32, sleeve: f32) -> f32 {
        let form = join(body, sleeve, 2.5);
        if form > 8.0 {
            return form - 4.0;
        }
        let cloth = (form - 0.8 - pleats(p)) * 0.7;
        let right_arm = capsule(
            p,
            Vec3::new(-17.0, 25.0, -4.6),
            Vec3::new(-19.4, 9.0, -4.2),
            8.4,
            8.4,
        );
        let cloth = meet(cloth, (p.y - neckline(p)) * 0.8, 0.4);
        let cloth = carve(cloth, right_arm, 0.6);
        let base = 10.6 + 0.011 * p.x * p.x;
        let cloth = meet(cloth, base - p.y, 0.5);
        let brooch = brooch(p);
        join(body.min(cloth), self.hem.distance(p, FAR), 0.3).min(brooch)
    }
}

/// A round brooch: a ring about a boss.
fn brooch(p: Vec3) -> f32 {
    let face = Vec3::new(0.25, 0.45, 0.86).normalize();
    let q = p - BROOCH;
    let high = q.dot(face);
    let ring = Vec2::new((q - face * high).length() - 1.9, high).length() - 0.55;
    join(ring, sphere(p, BROOCH, 1.35), 0.3)
}

/// Upper edge of the cloth against the lateral coordinate.
fn neckline(p: Vec3) -> f32 {
    let t = ((p.x + 14.0) / 27.0).clamp(-0.2, 1.0);
    22.5 + 9.0 * t * t + 1.3 * (p.x - 10.0).max(0.0)
}

/// Height of the pleats: meridians about an axis through the pin, sharp on the
/// crest and broad in the valley as Hellenistic carvers drew thin wool, deeper
/// the further they fall, some forking on the way.
fn pleats(p: Vec3) -> f32 {
    let axis = Vec3::new(0.36, 0.92, 0.12).normalize();
    let v = p - PIN;
    let east = Vec3::X.reject_from_normalized(axis).normalize();
    let south = axis.cross(east);
    let angle = v.dot(south).atan2(v.dot(east)) / TAU;
    let fall = v.length();
    let turn = angle + 0.0011 * fall + 0.006 * (angle * 31.0 + fall * 0.12).sin();
    let ridge = |s: f32| {
        let x = (s - s.floor()) * 2.0 - 1.0;
        let tent = 1.0 - (x * x + 0.09).sqrt();
        (tent.max(0.0) / 0.70).powf(1.5)
    };
    let unequal = 0.75 + 0.25 * (angle * 47.0).sin();
    let main = ridge(turn * PLEATS) * unequal;
    let fork = ridge(turn * PLEATS + 0.5) * smoothstep(12.0, 22.0, fall) * 0.45;
    let deep = 0.15 + 1.95 * smoothstep(3.0, 20.0, fall);
    deep * meet(main, fork, 0.25)
}

/// The free upper hem: a thin band, 1.7 mm thick, that stands off the breast.
fn hem(torso: &Torso) -> Sweep {
    let count = 30;
    let stations = (0..=count)
        .map(|k| {
            let t = k as f32 / count as f32;
            let x = 12.6 - 26.4 * t;
            let guess = Vec3::new(
                x,
                neckline(Vec3::new(x.min(10.0), 0.0, 0.0)) + 0.3,
                7.0 - 0.03 * x * x,
            );
            let taper = smoothstep(0.0, 0.2, t) * smoothstep(1.0, 0.85, t);
            let (at, up) = lay(torso, guess, -0.7 + (2.4 + 0.4 * (t * 15.0).sin()) * taper);
            Station {
                at,
                up: (up - Vec3::Y * 0.5).normalize(),
                wide: 0.4 + 1.7 * taper,
                thick: 0.35 + 0.5 * taper,
            }
        })
        .collect();
    Sweep::new(stations)
}
