//! The turned foot: plinth, torus, scotia, astragal.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use crate::sdf::polygon;

/// Height of the socle, mm.
pub const TOP: f32 = 11.5;

/// Distance to the socle: its moulding's profile turned about the Y axis.
pub fn socle(p: Vec3) -> f32 {
    let far = Vec2::new(p.x, p.z).length().max(p.y) - 15.0;
    if far > 4.0 {
        return far;
    }
    const ROUND: f32 = 0.35;
    let mut profile = vec![Vec2::new(-1.0, ROUND)];
    let mut at = |r: f32, y: f32| profile.push(Vec2::new(r - ROUND, y));
    at(13.0, ROUND);
    at(13.0, 2.0);
    at(12.2, 2.25);
    // Torus: a half round 2.4 mm high.
    for k in 0..=8 {
        let a = -1.0 + (0.5 * PI + 1.0) * k as f32 / 8.0;
        at(11.2 + 1.2 * a.cos(), 3.7 + 1.2 * a.sin());
    }
    at(10.3, 5.3);
    // Scotia: a hollow that leads the eye inward.
    for k in 1..=8 {
        let a = 0.5 * PI * k as f32 / 8.0;
        at(10.3 - 3.9 * a.sin(), 9.2 - 3.9 * a.cos());
    }
    // Astragal.
    for k in 0..=6 {
        let a = PI * (k as f32 / 6.0 - 0.5);
        at(6.9 + 0.9 * a.cos(), 10.1 + 0.9 * a.sin());
    }
    at(6.4, 11.2);
    at(6.4, TOP + 2.5);
    profile.push(Vec2::new(-1.0, TOP + 2.5));
    polygon(Vec2::new(Vec2::new(p.x, p.z).length(), p.y), &profile) - ROUND
}
