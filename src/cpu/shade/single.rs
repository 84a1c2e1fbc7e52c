//! Single scattering: the march along the refracted view ray.

use glam::DVec3;

use super::{MIN_COS_OUT, Receiver, Shading};
use crate::cpu::light::normalised_depth;
use crate::cpu::reduce::texels_tap;
use crate::optics::fresnel;
use crate::optics::single::{self, PathFit, Steps};
use crate::scene::{Exits, March};

/// What the march needs of a medium and its boundary, besides the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// Scattering coefficient sigma_s per channel, mm^-1: sigma_s' / (1 - g).
    pub sigma_s: DVec3,
    /// Extinction sigma_t = sigma_s + sigma_a per channel, mm^-1.
    pub sigma_t: DVec3,
    /// Mean cosine of the phase function.
    pub g: f64,
    /// What the stored weight says of the angle of the light.
    pub path: PathFit,
}

/// The lit surface over a point of the march, and what arrives from it.
#[derive(Clone, Copy, Debug)]
struct Above {
    /// Coverage times transmittance.
    w: f64,
    /// Length of the refracted path from the mean depth, mm, at least 0.
    l: f64,
    /// How far below the nearest of the surfaces under the tap the point lies, mm; below 0 above it.
    below: f64,
    /// Mean of e^(-sigma_t l) over the surfaces under the tap, per channel.
    arrives: DVec3,
    /// Whether these are two.
    edge: bool,
}

/// Where the light meets nothing.
const NOTHING: Above = Above {
    w: 0.0,
    l: 0.0,
    below: 0.0,
    arrives: DVec3::ONE,
    edge: false,
};

/// How far the refracted ray runs from the receiver until it leaves the object, mm, from the one back
/// face that its own pixel sees; infinite where there is none.
///
/// The face is taken for a plane, which the refracted ray meets elsewhere than the view ray, or never. So it is
/// held to twice the larger of two spheres: one through the chord's ends with the normals there, one through them with
/// the receiver's. And the least is a face parallel to the front, as that of a slab: a plane that the view ray grazes falls
/// far short, and an exit too near is black.
pub fn exit_length(receiver: &Receiver, inward: DVec3) -> f64 {
    let Some((q, n)) = receiver.back else {
        return f64::INFINITY;
    };
    let across = q - receiver.p;
    let toward = inward.dot(n);
    let plane = if toward > 1e-3 {
        across.dot(n) / toward
    } else {
        f64::INFINITY
    };
    // The way through a sphere of radius R is 2 R times the cosine below the surface.
    let cos_t = -inward.dot(receiver.n);
    let turn = n - receiver.n;
    let radius = (across.dot(turn) / turn.length_squared().max(1e-6)).max(0.0);
    let of_both = 2.0 * radius * cos_t;
    let cos_o = receiver.n.dot(receiver.wo).clamp(0.05, 1.0);
    let chord = across.length();
    let of_one = chord * cos_t / cos_o;
    let parallel = chord * cos_o / cos_t;
    plane.min(2.0 * of_both.max(of_one)).max(parallel)
}

/// Radiance that is scattered once towards the viewer of `receiver`, per channel: the two boundaries'
/// transmittances, sigma_s, the phase function and the integral of e^(-sigma_t (x + l(x))) over the
/// refracted ray (DESIGN, single scattering).
pub fn single(shading: &Shading, receiver: &Receiver, march: March) -> DVec3 {
    let medium = &shading.medium;
    let (frame, sigma_t) = (&shading.map.frame, medium.sigma_t);
    let inward = single::refract(receiver.wo, receiver.n, shading.eta);
    let first = single::FIRST_STEP / sigma_t.max_element();
    // Rounding must not make the steps vanish.
    let mut exit = exit_length(receiver, inward).max(1e-3 * first);
    let far = exit.min(single::LAST_STEP / sigma_t.min_element());
    let steps = Steps::new(first, far, march.steps);
    let clear = single::CLEAR * frame.texel;

    let mut sum = DVec3::ZERO;
    let (mut from, mut x) = (NOTHING, 0.0);
    let mut slope = DVec3::ZERO;
    for i in 1..=march.steps {
        let mut to = above(
            shading,
            receiver,
            march.exits,
            receiver.p + inward * steps.depth(i),
        );
        let mut dx = steps.depth(i) - x;
        // Where no column of the map holds anything, or the point lies before the lit surface by
        // more than half a texel, the ray is outside: it left on the way.
        let share = if to.w <= 0.0 && from.w > 0.0 {
            to = from;
            0.5
        } else if i > 1 && to.below < -clear && to.below < from.below {
            let share = (from.below + clear) / (from.below - to.below);
            // Through the lit surface itself.
            to.l = 0.0;
            to.arrives = DVec3::ONE;
            to.edge = false;
            share.clamp(1e-3, 1.0)
        } else {
            1.0
        };
        if share < 1.0 {
            dx *= share;
            exit = x + dx;
        }
        // Nothing is read at the surface itself: the first segment begins where the second points to;
        // a lone one at the surface itself, if that may be lit.
        if i == 1 {
            from = to;
            if march.steps == 1 && to.l <= single::JUMP * dx {
                from.l = 0.0;
                from.arrives = DVec3::ONE;
            }
        } else if i == 2 {
            let start = backwards(sigma_t, x, dx, &from, &to);
            sum += segment(sigma_t, 0.0, x, &start, &from);
        }
        if i > 1 || march.steps == 1 {
            sum += segment(sigma_t, x, dx, &from, &to);
        }
        slope = sigma_t * (1.0 + (to.l - from.l) / dx);
        (from, x) = (to, x + dx);
        if share < 1.0 {
            break;
        }
    }
    if exit > x {
        sum += tail(sigma_t, x, exit, &from, slope);
    }
    let leaving = fresnel::transmittance(receiver.n.dot(receiver.wo).max(MIN_COS_OUT), shading.eta);
    let phase = single::henyey_greenstein(frame.to_light.dot(inward), medium.g);
    shading.irradiance * medium.sigma_s * sum * (leaving * phase)
}

/// The surface over the entry of the ray, from the samples `from` at depth `x` and `to`, `dx` further: on
/// the line through the two, or, where the surface jumps between them, that of the first.
fn backwards(sigma_t: DVec3, x: f64, dx: f64, from: &Above, to: &Above) -> Above {
    let rise = to.l - from.l;
    if from.edge || to.edge || rise.abs() > single::JUMP * dx {
        return *from;
    }
    let l = (from.l - rise * x / dx).max(0.0);
    Above {
        l,
        arrives: (sigma_t * -l).exp(),
        ..*from
    }
}

/// The integral over a segment of length `dx` that begins at depth `x` along the ray.
fn segment(sigma_t: DVec3, x: f64, dx: f64, from: &Above, to: &Above) -> DVec3 {
    // The surface is straight between the two, unless it jumps.
    let open = from.edge || to.edge || (to.l - from.l).abs() > single::JUMP * dx;
    let channel = |c: usize| {
        let s = sigma_t[c];
        let lost = (-s * x).exp();
        if open {
            let [near, far] = single::open_segment(s * dx);
            dx * lost * (from.w * from.arrives[c] * near + to.w * to.arrives[c] * far)
        } else {
            let b = s * (dx + to.l - from.l);
            let mean = if b >= 0.0 {
                from.arrives[c] * single::segment(b)
            } else {
                to.arrives[c] * (-s * dx).exp() * single::segment(-b)
            };
            0.5 * (from.w + to.w) * dx * lost * mean
        }
    };
    DVec3::from_array([0, 1, 2].map(channel))
}

/// The integral from the last sample at depth `x` along the ray to the exit.
///
/// The exponent goes on as it did over the last segment. It rises at least by half of sigma_t, as it does
/// in a half-space lit from any side, or, where the exit is near, by so much that no more arrives there
/// than light without any path: a thin sheet lit from behind loses nothing along the view ray.
fn tail(sigma_t: DVec3, x: f64, exit: f64, last: &Above, slope: DVec3) -> DVec3 {
    let channel = |c: usize| {
        let s = sigma_t[c];
        let rest = exit - x;
        let least = if rest.is_finite() {
            (0.5 * s).min(s + last.arrives[c].max(1e-37).ln() / rest)
        } else {
            0.5 * s
        };
        let m = slope[c].max(least);
        last.w * (-s * x).exp() * last.arrives[c] * single::tail(m, rest)
    };
    DVec3::from_array([0, 1, 2].map(channel))
}

/// The lit surface over `p`; of weight 0 where there is none.
fn above(shading: &Shading, receiver: &Receiver, exits: Exits, p: DVec3) -> Above {
    let (frame, medium) = (&shading.map.frame, &shading.medium);
    let q = frame.to_light_space(p);
    let z = normalised_depth(frame, q.z);
    let size = [frame.size; 2];
    let st = frame.to_texel(q.truncate());
    let nearest = |texels: &[[f64; 4]]| texels_tap(size, texels, st.floor() + 0.5);
    let (w, factor, m1, v, c3) = match exits {
        Exits::Depth => {
            let depth = shading.map.depth_at(st.x.floor(), st.y.floor());
            let cos = receiver.n.dot(frame.to_light).abs();
            let lit = if depth < 1.0 {
                fresnel::transmittance(cos, shading.eta)
            } else {
                0.0
            };
            let z = (depth - 0.5) * 2.0 * crate::cpu::light::DEPTH_MARGIN;
            (lit, single::path_factor(cos, shading.eta), z, 0.0, 0.0)
        }
        Exits::Linear | Exits::Nearest => {
            let m = if exits == Exits::Linear {
                texels_tap(size, &shading.map.moments, st)
            } else {
                nearest(&shading.map.moments)
            };
            let w = m[0].max(1e-6);
            let (m1, m2, m3) = (m[1] / w, m[2] / w, m[3] / w);
            let v = (m2 - m1 * m1).max(0.0);
            let w = if m[0] > 1e-6 { m[0] } else { 0.0 };
            (w, medium.path.factor(w), m1, v, m3 - m1 * (m2 + 2.0 * v))
        }
    };
    if w == 0.0 {
        return NOTHING;
    }
    let s = (z - m1) * frame.z_half;
    let path = |s: f64| s.max(0.0) * factor;
    let lost = |s: f64| DVec3::from_array([0, 1, 2].map(|c| (-medium.sigma_t[c] * path(s)).exp()));
    let edge = v > single::edge_variance(frame.texel / frame.z_half);
    // Two surfaces: the points of variance v and third moment c3 about their mean, as in the mixture.
    let skew = if edge { c3 / v } else { 0.0 };
    let apart = if edge {
        (skew * skew + 4.0 * v).sqrt()
    } else {
        0.0
    };
    let [near, deep] = [0.5 * (skew - apart), 0.5 * (skew + apart)].map(|x| x * frame.z_half);
    let share = if edge {
        0.5 * (1.0 + skew / apart)
    } else {
        1.0
    };
    Above {
        w,
        l: path(s),
        below: s - near,
        arrives: lost(s - near) * share + lost(s - deep) * (1.0 - share),
        edge,
    }
}
