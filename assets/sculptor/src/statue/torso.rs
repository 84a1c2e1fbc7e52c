//! Neck, shoulders and chest, in the world frame.

use glam::Vec3;

use super::{Frame, mirrored};
use crate::sdf::{capsule, carve, chain, ellipsoid, join, meet, sphere};

/// The nude under the cloth.
pub struct Torso {
    column: [(Vec3, f32); 4],
    throat: [(Vec3, f32); 2],
    cords: [[(Vec3, f32); 3]; 2],
}

impl Torso {
    /// A torso that carries the head at `head`.
    pub fn new(head: Frame) -> Self {
        let at = |x: f32, y: f32, z: f32| head.to_world(Vec3::new(x, y, z));
        let cord = |side: f32| {
            let ear = at(6.2 * side, -5.0, -4.6);
            let pit = Vec3::new(1.5 * side, 30.0, 2.2);
            let belly = ear.lerp(pit, 0.5) + Vec3::new(0.5 * side, 0.0, 0.5);
            [(ear, 1.2), (belly, 1.05), (pit, 0.7)]
        };
        Self {
            column: [
                (Vec3::new(0.0, 26.0, -5.0), 6.4),
                (Vec3::new(0.0, 34.0, -3.6), 5.2),
                (Vec3::new(-0.3, 40.0, -2.4), 4.9),
                (at(0.0, -4.5, -3.5), 5.4),
            ],
            throat: [
                (Vec3::new(-0.3, 30.0, -0.8), 2.4),
                (at(0.0, -11.5, 2.0), 2.8),
            ],
            cords: [cord(-1.0), cord(1.0)],
        }
    }

    /// The neck with its two sternomastoids, from behind each ear to the pit
    /// of the neck: the V that makes a neck a neck when the head is turned.
    pub fn neck(&self, p: Vec3) -> f32 {
        let far = p.distance(Vec3::new(0.0, 39.0, -2.0)) - 19.0;
        if far > 4.0 {
            return far;
        }
        let d = join(chain(p, &self.column), chain(p, &self.throat), 3.0);
        let d = join(d, chain(p, &self.cords[0]), 2.2);
        join(d, chain(p, &self.cords[1]), 2.2)
    }

    /// Distance to shoulders and chest, cut below like a portrait bust.
    pub fn distance(&self, p: Vec3) -> f32 {
        let q = mirrored(p);
        let chest = ellipsoid(q, Vec3::new(0.0, 19.0, -3.0), Vec3::new(15.5, 13.0, 9.2));
        let shoulder = chain(
            q,
            &[
                (Vec3::new(4.0, 26.5, -4.0), 4.6),
                (Vec3::new(12.0, 26.3, -4.6), 4.6),
                (Vec3::new(17.0, 24.3, -4.6), 5.4),
                (Vec3::new(19.0, 15.0, -4.2), 4.9),
            ],
        );
        let trapezius = capsule(
            q,
            Vec3::new(2.4, 39.0, -5.6),
            Vec3::new(14.5, 28.6, -5.4),
            2.2,
            2.2,
        );
        let breast = ellipsoid(q, Vec3::new(6.6, 18.6, 2.2), Vec3::new(5.2, 5.4, 5.0));
        let collarbone = chain(
            q,
            &[
                (Vec3::new(1.5, 29.4, 3.0), 0.9),
                (Vec3::new(5.5, 29.9, 2.6), 0.75),
                (Vec3::new(10.0, 30.4, 0.2), 0.75),
                (Vec3::new(14.5, 30.4, -3.2), 0.8),
            ],
        );
        let d = join(chest, shoulder, 4.0);
        let d = join(d, trapezius, 4.5);
        let d = join(d, breast, 3.0);
        let d = join(d, collarbone, 1.8);
        let pit = sphere(q, Vec3::new(0.0, 29.8, 5.0), 1.5);
        let d = carve(d, pit, 1.8);
        let base = 11.2 + 0.011 * p.x * p.x;
        meet(d, (base - p.y) * 0.9, 1.2)
    }
}
