//! The body: a tapered spindle with a head, eyes, an upturned mouth and gill
//! covers. The fish lies along X with its nose at +X; both sides are alike.

use glam::{Vec2, Vec3};

use crate::sdf::{self, carve, join, lerp, meet, smoothstep, spline};

/// Where the profiles begin, inside the snout.
const NOSE: f32 = 31.2;

/// Where the peduncle ends, inside the tail fin.
const END: f32 = -9.2;

/// The middle of the left eye.
pub const EYE: Vec3 = Vec3::new(26.7, 1.75, 2.1);

/// The gill cover's edge is an arc round this point of the side view.
pub const GILL: Vec2 = Vec2::new(24.6, -0.5);

/// Radius of that arc, mm.
pub const GILL_REACH: f32 = 5.9;

/// The corner of the mouth and its tip, in the side view: it points upwards.
const MOUTH: [Vec2; 2] = [Vec2::new(30.5, 1.05), Vec2::new(32.6, 2.75)];

/// Profiles over the root of the distance from the nose, which makes a round
/// snout of a straight line: height of the middle, half height, half width.
const MIDDLE: [(f32, f32); 9] = [
    (0.0, 1.7),
    (1.0, 0.95),
    (1.84, 0.45),
    (2.53, 0.15),
    (3.22, 0.0),
    (3.92, -0.05),
    (5.04, 0.1),
    (5.86, 0.25),
    (6.4, 0.1),
];
const HALF_HEIGHT: [(f32, f32); 13] = [
    (0.0, 0.0),
    (0.5, 1.1),
    (1.0, 2.05),
    (1.84, 3.3),
    (2.53, 4.2),
    (3.22, 4.9),
    (3.92, 5.3),
    (4.52, 5.2),
    (5.04, 4.7),
    (5.51, 3.95),
    (5.86, 3.35),
    (6.1, 2.95),
    (6.4, 2.4),
];
const HALF_WIDTH: [(f32, f32); 13] = [
    (0.0, 0.0),
    (0.5, 1.05),
    (1.0, 1.8),
    (1.84, 2.65),
    (2.53, 3.2),
    (3.22, 3.6),
    (3.92, 3.7),
    (4.52, 3.4),
    (5.04, 2.85),
    (5.51, 2.15),
    (5.86, 1.5),
    (6.1, 0.9),
    (6.4, 0.3),
];

/// The bare trunk, without features.
fn trunk(p: Vec3) -> f32 {
    // Cut off before the profiles close, where they are too steep to tell distance.
    const CUT: f32 = 0.4;
    let beyond = p.x - (NOSE - CUT);
    let u = (NOSE - p.x).max(CUT).sqrt();
    let du = if beyond > 0.0 { 0.0 } else { -0.5 / u };
    let (middle, dm) = spline(&MIDDLE, u);
    let (high, dh) = spline(&HALF_HEIGHT, u);
    let (wide, dw) = spline(&HALF_WIDTH, u);
    let y = p.y - middle;
    let (a, b) = (y / high, p.z / wide);
    let k = a.hypot(b).max(0.05);
    // The gradient of k, to turn the ratio into a distance.
    let ky = a / (k * high);
    let kz = b / (k * wide);
    let kx = -(ky * (dm + a / k * dh) + kz * b / k * dw) * du;
    let section = (k - 1.0) / Vec3::new(kx, ky, kz).length().max(1e-3);
    // Beside the snout the ratio says too little; a hull says more.
    let hull = sdf::capsule(p, Vec3::new(26.9, 0.3, 0.0), Vec3::NEG_X * 6.0, 5.5, 5.5);
    let section = section.max(hull);
    let trunk = if beyond > 0.0 {
        section.max(0.0).hypot(beyond)
    } else {
        meet(section, END - p.x, 1.0)
    };
    let snout = sdf::ellipsoid(p, Vec3::new(29.6, 1.05, 0.0), Vec3::new(2.9, 2.1, 1.8));
    join(trunk, snout, 1.2)
}

/// Where `p` lies in the gill cover's side view: distance from the arc's
/// middle, and how far it faces backwards (0 towards the eye, 1 behind).
fn gill(p: Vec3) -> (f32, f32) {
    let q = p.truncate() - GILL;
    let r = Vec2::new(q.x, q.y * 0.95).length();
    let back = smoothstep(0.35, -0.35, q.x / r.max(0.1));
    (r, back)
}

/// Relief of the cheek and the gill cover: a plate that rises towards its
/// rear edge, a crease behind it, a fainter one before it.
fn relief(p: Vec3) -> f32 {
    let (r, back) = gill(p);
    if r > GILL_REACH + 3.0 {
        return 0.0;
    }
    let ridge = |centre: f32, width: f32| {
        let t = (r - centre) / width;
        (-t * t).exp()
    };
    // The crease fades where the covers meet at the nape.
    let low = smoothstep(4.6, 3.0, p.y - GILL.y);
    let plate = smoothstep(2.2, GILL_REACH - 0.2, r) * smoothstep(0.35, -0.05, r - GILL_REACH);
    let cover = 0.5 * plate - 0.42 * ridge(GILL_REACH + 0.5, 0.4);
    let cheek = -0.16 * ridge(3.7, 0.35) * smoothstep(0.5, -1.0, p.y - 0.8);
    back * (low * cover + cheek)
}

/// The eye: a ball in a socket, its pupil a shallow dish.
fn eye(p: Vec3, skin: f32) -> f32 {
    let q = Vec3::new(p.x, p.y, p.z.abs());
    let far = q.distance(EYE);
    if far > 5.0 {
        return skin;
    }
    let brow = sdf::sphere(q, EYE - Vec3::Z * 0.9, 2.35);
    let skin = join(skin, brow, 1.4);
    let axis = Vec3::new(0.2, 0.1, 1.0).normalize();
    let along = (q - EYE).dot(axis);
    let round = (q - EYE - axis * along).length();
    let socket = (round - 1.55).hypot(along - 1.05) - 0.4;
    let skin = carve(skin, socket, 0.4);
    let ball = sdf::sphere(q, EYE, 1.75);
    let pupil = 0.15 * smoothstep(1.0, 0.72, round) * smoothstep(0.0, 0.5, along);
    join(skin, ball + pupil, 0.1)
}

/// Lips round the slit of the mouth. They follow the snout; the lower one juts
/// out, for a fish that feeds from above.
fn mouth(p: Vec3, skin: f32) -> f32 {
    let d = p.truncate() - MOUTH[0];
    let along = (MOUTH[1] - MOUTH[0]).normalize();
    let (l, h) = (d.dot(along), d.dot(along.perp()));
    let front = smoothstep(-0.2, 1.1, l) * smoothstep(1.6, 0.6, skin);
    if front == 0.0 {
        return skin;
    }
    let bump = |centre: f32, width: f32| {
        let t = (h - centre) / width;
        (-t * t).exp()
    };
    let jut = smoothstep(0.8, 2.6, l);
    let skin = skin - front * (0.22 * bump(0.52, 0.36) + (0.3 + 0.1 * jut) * bump(-0.56, 0.44));
    let slit = meet(h.abs() - 0.2, 0.3 - l, 0.2);
    carve(skin, meet(slit, -skin - 0.9, 0.3), 0.45)
}

/// Signed distance to the body, mm.
pub fn distance(p: Vec3) -> f32 {
    let bare = trunk(p);
    if bare > 5.0 {
        return bare - 2.5;
    }
    let mut skin = bare - relief(p) * smoothstep(2.0, 0.5, bare.abs());
    // A shallow line runs along the side.
    let line = (p.y - lerp(0.9, 0.3, smoothstep(18.0, -4.0, p.x))) / 0.45;
    let flank = smoothstep(17.5, 15.0, p.x) * smoothstep(-5.0, -2.0, p.x);
    skin += 0.13 * flank * (-line * line).exp();
    let skin = mouth(p, skin);
    eye(p, skin)
}

/// How much the gill cover at `p` swings out, 0..=1, most at its rear edge.
pub fn gill_cover(p: Vec3) -> f32 {
    let (r, back) = gill(p);
    let inner = smoothstep(1.0, GILL_REACH, r);
    let edge = smoothstep(GILL_REACH + 1.3, GILL_REACH + 0.15, r);
    let side = smoothstep(0.8, 2.4, p.z.abs());
    inner * edge * back * side * smoothstep(4.6, 2.6, p.y - GILL.y)
}

/// How much `p` belongs to the lower jaw, 0..=1.
pub fn jaw(p: Vec3) -> f32 {
    let along = (MOUTH[1] - MOUTH[0]).normalize();
    let d = p.truncate() - MOUTH[0];
    let below = -d.dot(Vec2::new(-along.y, along.x));
    smoothstep(-0.12, 0.22, below)
        * smoothstep(-2.6, 1.2, d.dot(along))
        * smoothstep(4.5, 1.8, below)
}

/// The jaw's hinge.
pub const HINGE: Vec3 = Vec3::new(28.6, -0.6, 0.0);

/// Where detail is dear: eyes, mouth, the gill cover's edge.
pub fn importance(p: Vec3) -> f32 {
    let q = Vec3::new(p.x, p.y, p.z.abs());
    let eye = smoothstep(2.6, 2.0, q.distance(EYE));
    let mouth = smoothstep(29.0, 30.2, p.x);
    let (r, back) = gill(p);
    let edge =
        back * smoothstep(1.6, 0.8, (r - GILL_REACH - 0.2).abs()) * smoothstep(1.0, 2.0, q.z);
    1.0 + (60.0 * eye).max(30.0 * mouth) + 8.0 * edge
}
