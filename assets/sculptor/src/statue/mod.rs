//! The statue: a young dryad with a faun's ears and a laurel wreath, a bust on
//! a turned socle. Y is up, she faces +Z, a millimetre is a millimetre.
//!
//! The head is carved in its own frame: the origin lies between the eyes, Z
//! leaves through the nose, and 30 mm from chin to crown is the canon all
//! proportions follow (eyes at half height, hairline, brow, nose base and chin
//! a third of the face apart, an eye's width between the eyes).

mod drapery;
mod ear;
mod face;
mod hair;
mod hand;
mod socle;
mod torso;
mod wreath;

use glam::{Mat3, Vec3};

use crate::sdf::{join, smoothstep, sphere};

/// Where the head's frame sits in the world.
const HEAD_AT: Vec3 = Vec3::new(-0.6, 54.4, 1.6);
/// Turned towards her right shoulder, degrees.
const HEAD_TURN: f32 = -24.0;
/// Bowed, degrees.
const HEAD_BOW: f32 = 5.0;
/// Inclined towards her left shoulder, degrees.
const HEAD_TILT: f32 = 7.0;

/// The lengths in these files are of the model; the statue is this much larger
/// so that it stands 80 mm tall.
const ENLARGED: f32 = 1.05;

/// The head's place in the world.
#[derive(Clone, Copy, Debug)]
struct Frame {
    at: Vec3,
    turn: Mat3,
}

impl Frame {
    fn head() -> Self {
        Self {
            at: HEAD_AT,
            turn: Mat3::from_rotation_y(HEAD_TURN.to_radians())
                * Mat3::from_rotation_x(HEAD_BOW.to_radians())
                * Mat3::from_rotation_z(-HEAD_TILT.to_radians()),
        }
    }

    fn to_world(self, p: Vec3) -> Vec3 {
        self.at + self.turn * p
    }

    fn to_local(self, p: Vec3) -> Vec3 {
        self.turn.transpose() * (p - self.at)
    }
}

/// The finished field.
pub struct Statue {
    head: Frame,
    face: face::Face,
    ear: ear::Ear,
    hair: hair::Hair,
    hand: hand::Hand,
    wreath: wreath::Wreath,
    torso: torso::Torso,
    drapery: drapery::Drapery,
}

impl Default for Statue {
    fn default() -> Self {
        Self::new()
    }
}

impl Statue {
    /// Lays out every lock, leaf and fold.
    pub fn new() -> Self {
        let head = Frame::head();
        let torso = torso::Torso::new(head);
        Self {
            head,
            face: face::Face::new(),
            ear: ear::Ear::new(),
            hair: hair::Hair::new(head),
            hand: hand::Hand::new(),
            wreath: wreath::Wreath::new(),
            drapery: drapery::Drapery::new(&torso),
            torso,
        }
    }

    /// Signed distance to the marble, mm. Right to first order at the surface.
    pub fn distance(&self, p: Vec3) -> f32 {
        self.model(p / ENLARGED) * ENLARGED
    }

    fn model(&self, p: Vec3) -> f32 {
        let bust = self.bust(p);
        let head = self.head_and_neck(p);
        join(bust, head, 3.0).min(self.hair.tresses(p))
    }

    fn bust(&self, p: Vec3) -> f32 {
        if p.y > 46.0 {
            return p.y - 42.0;
        }
        let body = self.torso.distance(p);
        let clad = self.drapery.distance(p, body, hand::sleeve(p));
        let clad = hand::open_cuff(clad, p);
        let held = join(clad, self.hand.distance(p), 0.35);
        join(held, socle::socle(p), 0.6)
    }

    fn head_and_neck(&self, p: Vec3) -> f32 {
        let q = self.head.to_local(p);
        let far = q.distance(Vec3::new(0.0, 2.0, 0.0)) - 24.0;
        let neck = self.torso.neck(p);
        if far > 6.0 {
            return neck.min(far);
        }
        // The jaw stays crisp over the neck; the nape flows into it.
        let skin = join(self.face.skin(q), neck, 1.2);
        let skin = join(skin, self.ear.distance(q), 0.8);
        let hair = join(skin, self.hair.distance(q), 0.25);
        hair.min(self.wreath.distance(q))
    }

    /// A box that holds the statue.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        (Vec3::new(-30.0, -1.5, -22.0), Vec3::new(30.0, 84.0, 22.0))
    }

    /// How dear an error at `p` is when triangles are thinned out: the eye
    /// goes to the face first, then to the ears; hair forgives much. (Edge
    /// length goes with about the sixth root of this.)
    pub fn importance(&self, p: Vec3) -> f32 {
        let q = mirrored(self.head.to_local(p / ENLARGED));
        let near = |x, y, z, radius| smoothstep(1.5, -0.5, sphere(q, Vec3::new(x, y, z), radius));
        let eye = near(4.2, 0.2, 10.0, 3.2);
        let mouth = near(0.0, -9.5, 11.5, 3.6);
        let nose = near(0.0, -5.5, 12.8, 2.8);
        let face = near(0.0, -4.0, 6.0, 10.0) * smoothstep(4.0, 7.0, q.z);
        let ear = near(11.5, 1.0, -3.5, 5.5);
        let hand = smoothstep(
            1.5,
            -0.5,
            sphere(p / ENLARGED, Vec3::new(1.5, 20.0, 11.0), 9.0),
        );
        let hair = smoothstep(1.0, -2.0, 0.8 * q.z - 0.6 * q.y - 1.3) * smoothstep(-3.0, 0.0, q.y);
        let plain = 1.0 - 0.65 * hair * (1.0 - ear);
        let socle = smoothstep(13.0, 12.0, p.y);
        plain
            + 6.0 * socle
            + 90.0 * eye
            + 50.0 * mouth
            + 30.0 * nose
            + 14.0 * face
            + 5.0 * ear
            + 4.0 * hand
    }

    /// The middle of the face, for a close view.
    pub fn face_centre(&self) -> Vec3 {
        self.head.to_world(Vec3::new(0.0, -1.0, 2.0)) * ENLARGED
    }

    /// Where the face looks, degrees from +Z towards +X.
    pub fn face_azimuth(&self) -> f32 {
        HEAD_TURN
    }
}

/// `p` with the left half folded over the right: most of a face is symmetric.
fn mirrored(p: Vec3) -> Vec3 {
    Vec3::new(p.x.abs(), p.y, p.z)
}

impl crate::Sculpture for Statue {
    const SIZES: &'static [(&'static str, usize)] = &crate::SIZES;

    fn distance(&self, p: Vec3) -> f32 {
        self.distance(p)
    }

    fn bounds(&self) -> (Vec3, Vec3) {
        self.bounds()
    }

    fn importance(&self, p: Vec3) -> f32 {
        self.importance(p)
    }
}
