//! Her left hand, which comes out of a wide sleeve and rests on the breast.

use glam::Vec3;

use crate::sdf::{capsule, carve, chain, curve, ellipsoid, join, lerp, meet, smoothstep};

/// A joint: where it is and the finger's radius there.
type Joint = (Vec3, f32);

/// The elbow, hidden in the cloth.
const ELBOW: Vec3 = Vec3::new(17.5, 16.0, -1.5);
/// The middle of the cuff.
const CUFF: Vec3 = Vec3::new(10.3, 16.9, 7.6);
/// The wrist, from which the drawing of the hand below is enlarged.
const WRIST: Vec3 = Vec3::new(8.0, 17.3, 9.9);
/// Scale of that drawing.
const SIZE: f32 = 1.28;
/// Scale of its fingers' radii.
const SLENDER: f32 = 0.88;

/// The end of the forearm.
const ARM: [Joint; 2] = [
    (Vec3::new(8.6, 14.8, 8.2), 1.9),
    (Vec3::new(5.2, 15.4, 11.0), 1.75),
];

/// Four fingers, index first: knuckle, two joints, tip. Each comes out 1.5 to
/// 2.3 mm thick and lies a little apart from the next.
const FINGERS: [[Joint; 4]; 4] = [
    [
        (Vec3::new(1.6, 18.9, 12.1), 1.0),
        (Vec3::new(-1.4, 21.2, 12.7), 0.95),
        (Vec3::new(-3.4, 21.2, 11.6), 0.85),
        (Vec3::new(-4.5, 20.3, 10.2), 0.7),
    ],
    [
        (Vec3::new(0.9, 17.4, 12.5), 1.0),
        (Vec3::new(-2.5, 19.0, 13.0), 0.95),
        (Vec3::new(-4.7, 18.7, 11.7), 0.85),
        (Vec3::new(-5.7, 17.8, 10.3), 0.7),
    ],
    [
        (Vec3::new(0.7, 15.9, 12.4), 0.95),
        (Vec3::new(-2.6, 16.7, 12.8), 0.9),
        (Vec3::new(-4.7, 16.2, 11.6), 0.8),
        (Vec3::new(-5.6, 15.3, 10.2), 0.66),
    ],
    [
        (Vec3::new(1.0, 14.5, 11.9), 0.85),
        (Vec3::new(-1.6, 14.6, 12.3), 0.8),
        (Vec3::new(-3.4, 14.0, 11.2), 0.72),
        (Vec3::new(-4.2, 13.2, 9.9), 0.6),
    ],
];

/// The thumb, pointing up.
const THUMB: [Joint; 4] = [
    (Vec3::new(4.9, 16.6, 11.2), 1.3),
    (Vec3::new(4.2, 19.4, 11.9), 1.15),
    (Vec3::new(2.6, 21.7, 12.0), 0.95),
    (Vec3::new(0.9, 23.0, 11.4), 0.7),
];

/// Distance to what fills the sleeve, world frame: a cone from the elbow, cut
/// off and hollowed at the cuff so that the cloth over it ends in a lip.
pub fn sleeve(p: Vec3) -> f32 {
    let along = (CUFF - ELBOW).normalize();
    let cone = capsule(p, ELBOW, CUFF + along * 3.0, 4.4, 2.2);
    meet(cone, (p - CUFF).dot(along), 0.6)
}

/// Cuts the inside of the cuff out of the cloth.
pub fn open_cuff(cloth: f32, p: Vec3) -> f32 {
    let along = (CUFF - ELBOW).normalize();
    let inside = capsule(p, CUFF - along * 0.6, CUFF + along * 4.0, 2.1, 2.6);
    carve(cloth, inside, 0.4)
}

/// The hand, its fingers bent along smooth curves.
pub struct Hand {
    fingers: Vec<Vec<Joint>>,
    thumb: Vec<Joint>,
}

/// Rounds the bends of a finger.
fn bend(finger: &[Joint]) -> Vec<Joint> {
    let points: Vec<Vec3> = finger.iter().map(|j| j.0).collect();
    let last = finger.len() - 1;
    (0..=4 * last)
        .map(|k| {
            let t = k as f32 / 4.0;
            let i = (t as usize).min(last - 1);
            let radius = lerp(finger[i].1, finger[i + 1].1, t - i as f32);
            (curve(&points, t / last as f32), radius * SLENDER)
        })
        .collect()
}

impl Hand {
    /// Poses the hand.
    pub fn new() -> Self {
        Self {
            fingers: FINGERS.iter().map(|f| bend(f)).collect(),
            thumb: bend(&THUMB),
        }
    }

    /// Distance to the hand, world frame.
    pub fn distance(&self, p: Vec3) -> f32 {
        let far = p.distance(Vec3::new(2.5, 20.0, 10.0)) - 14.0;
        if far > 4.0 {
            return far;
        }
        self.drawn((p - WRIST) / SIZE + ARM[1].0) * SIZE
    }

    fn drawn(&self, p: Vec3) -> f32 {
        // The palm is a fan of rays from the wrist to the knuckles.
        let palm = self.fingers.iter().fold(chain(p, &ARM), |d, finger| {
            join(d, chain(p, &[(ARM[1].0, 1.5), finger[0]]), 1.3)
        });
        let heel = ellipsoid(p, Vec3::new(3.6, 16.2, 11.0), Vec3::new(2.4, 2.0, 1.3));
        let palm = join(palm, heel, 1.0);
        let d = join(palm, chain(p, &self.thumb), 0.9);
        self.fingers.iter().fold(d, |d, finger| {
            // Fingers melt into the palm but stay apart from each other.
            let past = (p - finger[0].0).dot((finger[1].0 - finger[0].0).normalize());
            join(d, chain(p, finger), 0.25 + 0.6 * smoothstep(1.5, 0.0, past))
        })
    }
}
