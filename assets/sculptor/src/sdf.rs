//! The sculptor's tools: signed-distance primitives and ways to join them.
//!
//! Distances are in millimetres, negative inside. The primitives and the
//! polynomial smooth minimum follow Inigo Quilez's articles "distance
//! functions" and "smooth minimum"; where a formula is only a bound or only
//! right to first order near the surface, its comment says so.

use glam::{Vec2, Vec3};

/// Distance to a sphere.
pub fn sphere(p: Vec3, centre: Vec3, radius: f32) -> f32 {
    p.distance(centre) - radius
}

/// Distance to an axis-aligned ellipsoid, right to first order at the surface
/// (Quilez's `k0 (k0 - 1) / k1` estimate).
pub fn ellipsoid(p: Vec3, centre: Vec3, radii: Vec3) -> f32 {
    let q = p - centre;
    let k0 = (q / radii).length();
    let k1 = (q / (radii * radii)).length();
    if k1 < 1e-6 {
        -radii.min_element()
    } else {
        k0 * (k0 - 1.0) / k1
    }
}

/// Distance to a capsule whose radius runs linearly from `ra` to `rb`.
pub fn capsule(p: Vec3, a: Vec3, b: Vec3, ra: f32, rb: f32) -> f32 {
    let ab = b - a;
    let t = ((p - a).dot(ab) / ab.length_squared()).clamp(0.0, 1.0);
    p.distance(a + ab * t) - lerp(ra, rb, t)
}

/// Distance to a polyline of capsules with a radius at each point.
pub fn chain(p: Vec3, points: &[(Vec3, f32)]) -> f32 {
    points.windows(2).fold(f32::MAX, |d, s| {
        d.min(capsule(p, s[0].0, s[1].0, s[0].1, s[1].1))
    })
}

/// Distance, in the plane, to a closed polygon (Quilez's exact formula).
pub fn polygon(p: Vec2, points: &[Vec2]) -> f32 {
    let mut squared = f32::MAX;
    let mut sign = 1.0;
    let mut b = points[points.len() - 1];
    for &a in points {
        let e = b - a;
        let w = p - a;
        let t = (w.dot(e) / e.length_squared()).clamp(0.0, 1.0);
        squared = squared.min((w - e * t).length_squared());
        let above = p.y >= a.y;
        let below = p.y < b.y;
        let left = e.x * w.y > e.y * w.x;
        if (above && below && left) || (!above && !below && !left) {
            sign = -sign;
        }
        b = a;
    }
    sign * squared.sqrt()
}

/// Union with a fillet: the quadratic polynomial smooth minimum. The fillet
/// reaches where the two distances differ by less than `k` mm.
pub fn join(a: f32, b: f32, k: f32) -> f32 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - h * h * k * 0.25
}

/// Intersection with a rounded edge, `join` turned inside out.
pub fn meet(a: f32, b: f32, k: f32) -> f32 {
    -join(-a, -b, k)
}

/// Cuts `tool` out of `a`, rounding the rim.
pub fn carve(a: f32, tool: f32, k: f32) -> f32 {
    meet(a, -tool, k)
}

/// Linear interpolation.
pub fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// Hermite step from 0 at `lo` to 1 at `hi`.
pub fn smoothstep(lo: f32, hi: f32, x: f32) -> f32 {
    let t = ((x - lo) / (hi - lo)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Value and slope at `x` of a Catmull-Rom curve through `(x, value)` knots
/// sorted by rising `x`, held constant beyond the ends.
pub fn spline(knots: &[(f32, f32)], x: f32) -> (f32, f32) {
    let last = knots.len() - 1;
    if x <= knots[0].0 {
        return (knots[0].1, 0.0);
    }
    if x >= knots[last].0 {
        return (knots[last].1, 0.0);
    }
    let i = knots.partition_point(|k| k.0 <= x) - 1;
    let slope = |j: usize| {
        let (lo, hi) = (j.saturating_sub(1), (j + 1).min(last));
        (knots[hi].1 - knots[lo].1) / (knots[hi].0 - knots[lo].0)
    };
    let (x0, y0) = knots[i];
    let (x1, y1) = knots[i + 1];
    let h = x1 - x0;
    let t = (x - x0) / h;
    let (m0, m1) = (slope(i) * h, slope(i + 1) * h);
    let (t2, t3) = (t * t, t * t * t);
    let value = y0 * (2.0 * t3 - 3.0 * t2 + 1.0)
        + m0 * (t3 - 2.0 * t2 + t)
        + y1 * (3.0 * t2 - 2.0 * t3)
        + m1 * (t3 - t2);
    let rise = y0 * (6.0 * t2 - 6.0 * t)
        + m0 * (3.0 * t2 - 4.0 * t + 1.0)
        + y1 * (6.0 * t - 6.0 * t2)
        + m1 * (3.0 * t2 - 2.0 * t);
    (value, rise / h)
}

/// A uniform Catmull-Rom curve in space through `points`, `t` in 0..=1.
pub fn curve(points: &[Vec3], t: f32) -> Vec3 {
    let last = points.len() - 1;
    let s = t.clamp(0.0, 1.0) * last as f32;
    let i = (s as usize).min(last - 1);
    let u = s - i as f32;
    let at = |j: isize| -> Vec3 {
        if j < 0 {
            points[0] * 2.0 - points[1]
        } else if j as usize > last {
            points[last] * 2.0 - points[last - 1]
        } else {
            points[j as usize]
        }
    };
    let i = i as isize;
    let (a, b, c, d) = (at(i - 1), at(i), at(i + 1), at(i + 2));
    0.5 * (b * 2.0
        + (c - a) * u
        + (a * 2.0 - b * 5.0 + c * 4.0 - d) * (u * u)
        + (b * 3.0 - a - c * 3.0 + d) * (u * u * u))
}

/// The gradient of a distance field, from the four corners of a tetrahedron
/// of half side `step` (Quilez, "normals for an SDF").
pub fn gradient(field: impl Fn(Vec3) -> f32, p: Vec3, step: f32) -> Vec3 {
    [
        Vec3::new(1.0, -1.0, -1.0),
        Vec3::new(-1.0, -1.0, 1.0),
        Vec3::new(-1.0, 1.0, -1.0),
        Vec3::new(1.0, 1.0, 1.0),
    ]
    .into_iter()
    .map(|corner| corner * field(p + corner * step))
    .sum::<Vec3>()
        / (4.0 * step)
}

/// Beyond this many mm a sweep's distance need not be exact.
pub const FAR: f32 = 4.0;

/// Segments of a sweep that share one bounding sphere.
const RUN: usize = 4;

/// One station of a [`Sweep`].
#[derive(Clone, Copy, Debug)]
pub struct Station {
    /// Centre of the section.
    pub at: Vec3,
    /// Direction across the thickness: the outside of a lock, a fold's crest.
    pub up: Vec3,
    /// Half the width of the section, mm.
    pub wide: f32,
    /// Half the thickness of the section, mm.
    pub thick: f32,
}

/// An elliptical section carried along a curve: a lock of hair, a fold of
/// cloth, a finger.
#[derive(Clone, Debug)]
pub struct Sweep {
    stations: Vec<Station>,
    centre: Vec3,
    reach: f32,
    girth: f32,
    runs: Vec<(Vec3, f32)>,
    grooves: f32,
    depth: f32,
}

impl Sweep {
    /// A sweep through `stations`, at least two of them.
    pub fn new(stations: Vec<Station>) -> Self {
        let ball = |run: &[Station], size: &dyn Fn(&Station) -> f32| {
            let lo = run.iter().fold(Vec3::INFINITY, |m, s| m.min(s.at));
            let hi = run.iter().fold(Vec3::NEG_INFINITY, |m, s| m.max(s.at));
            let centre = (lo + hi) * 0.5;
            let reach = run
                .iter()
                .fold(0.0f32, |r, s| r.max(s.at.distance(centre) + size(s)));
            (centre, reach)
        };
        let (centre, reach) = ball(&stations, &|s| s.wide.max(s.thick));
        let girth = stations
            .iter()
            .fold(0.0f32, |r, s| r.max(s.wide).max(s.thick));
        let runs = (0..stations.len() - 1)
            .step_by(RUN)
            .map(|i| ball(&stations[i..(i + RUN + 1).min(stations.len())], &|_| 0.0))
            .collect();
        Self {
            stations,
            centre,
            reach,
            girth,
            runs,
            grooves: 0.0,
            depth: 0.0,
        }
    }

    /// The same sweep with chiselled grooves `depth` mm deep running along it:
    /// one on the crest, the next a `count`-th of the half width further.
    pub fn grooved(mut self, count: f32, depth: f32) -> Self {
        self.grooves = count;
        self.depth = depth;
        self
    }

    /// Distance to the sweep; where that is more than `limit`, a lower bound
    /// of it that is more than `limit` too.
    pub fn distance(&self, p: Vec3, limit: f32) -> f32 {
        let far = p.distance(self.centre) - self.reach;
        if far > limit {
            return far;
        }
        let clear = |k: usize| p.distance(self.runs[k].0) - self.runs[k].1;
        let (nearest, bound) = (0..self.runs.len())
            .map(|k| (k, clear(k)))
            .fold((0, f32::MAX), |m, c| if c.1 < m.1 { c } else { m });
        if bound - self.girth > limit {
            return bound - self.girth;
        }
        let mut best = (1e8f32, 0, 0.0);
        self.search(p, nearest, &mut best);
        for (k, &(centre, reach)) in self.runs.iter().enumerate() {
            let bound = reach + best.0.sqrt();
            if k != nearest && p.distance_squared(centre) < bound * bound {
                self.search(p, k, &mut best);
            }
        }
        let (_, i, t) = best;
        let (a, b) = (self.stations[i], self.stations[i + 1]);
        let along = (b.at - a.at).normalize();
        let up = a.up.lerp(b.up, t).reject_from_normalized(along).normalize();
        let side = along.cross(up);
        let q = p - a.at.lerp(b.at, t);
        let (wide, thick) = (lerp(a.wide, b.wide, t), lerp(a.thick, b.thick, t));
        let local = Vec3::new(q.dot(side), q.dot(up), q.dot(along));
        let d = ellipsoid(local, Vec3::ZERO, Vec3::new(wide, thick, thick.min(wide)));
        if self.grooves > 0.0 && local.y > -0.2 * thick {
            let u = local.x / wide;
            let fade = smoothstep(1.0, 0.6, u.abs()) * smoothstep(-0.2, 0.4, local.y / thick);
            let cut = 0.5 + 0.5 * (u * self.grooves * std::f32::consts::TAU).cos();
            d + self.depth * fade * cut * cut
        } else {
            d
        }
    }

    /// Looks in run `k` for a spine point nearer to `p` than `best`: squared
    /// distance, segment, place along it.
    fn search(&self, p: Vec3, k: usize, best: &mut (f32, usize, f32)) {
        let first = k * RUN;
        let last = (first + RUN).min(self.stations.len() - 1);
        for i in first..last {
            let (a, b) = (self.stations[i].at, self.stations[i + 1].at);
            let e = b - a;
            let t = ((p - a).dot(e) / e.length_squared()).clamp(0.0, 1.0);
            let d = (p - a - e * t).length_squared();
            if d < best.0 {
                *best = (d, i, t);
            }
        }
    }
}

/// The least distance to any of `sweeps`, each joined to the rest with fillet
/// `k`.
pub fn join_sweeps(p: Vec3, sweeps: &[Sweep], k: f32) -> f32 {
    sweeps
        .iter()
        .fold(FAR, |d, s| join(d, s.distance(p, d + k), k))
}
