//! The fins: thin waving sheets stiffened by rays that fan out and branch.
//!
//! A fin is drawn in a plane of its own by a few guide rays. Places on it are
//! told by `s`, 0 to 1 across the rays, and `t`, 0 at the base to 1 at the
//! tips. Outline, thickness and waves are laid down once in a map of the
//! plane; the field reads the map.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::sdf::{curve, lerp, polygon, smoothstep};

/// Spacing of a fin's map, mm.
const CELL: f32 = 0.085;

/// What the map holds at one place of the plane.
#[derive(Clone, Copy, Debug, Default)]
struct Cell {
    /// Signed distance to the outline.
    rim: f32,
    /// Half the thickness.
    half: f32,
    /// Height of the sheet's middle over the plane.
    lift: f32,
    /// One over the length of the sheet's slope.
    lean: f32,
    s: f32,
    t: f32,
}

impl Cell {
    fn mix(self, o: Self, k: f32) -> Self {
        Self {
            rim: lerp(self.rim, o.rim, k),
            half: lerp(self.half, o.half, k),
            lift: lerp(self.lift, o.lift, k),
            lean: lerp(self.lean, o.lean, k),
            s: lerp(self.s, o.s, k),
            t: lerp(self.t, o.t, k),
        }
    }
}

/// How a fin is drawn.
#[derive(Clone, Debug)]
pub struct Plan {
    /// A name for the joints.
    pub name: &'static str,
    /// The plane: a point of it and two axes; the third is their cross product.
    pub at: Vec3,
    /// The axes.
    pub axes: [Vec3; 2],
    /// Guide rays from the base outwards, each with the same number of points.
    pub guides: Vec<Vec<Vec2>>,
    /// How many rays leave the base.
    pub rays: usize,
    /// Where they branch, as `t`; beyond 1 they do not.
    pub branch: f32,
    /// How far the membrane falls back between the tips, as a part of `t`.
    pub scallop: f32,
    /// How far the rim's corners reach in, as a part of `s`.
    pub corner: f32,
    /// Height of the waves at the rim, mm, how many there are, their phase.
    pub wave: [f32; 3],
    /// Thickness of the membrane and of a ray at its base and at its tip, mm.
    pub thick: [f32; 3],
    /// Whether a twin grows on the other side.
    pub paired: bool,
}

/// A fin of the fish.
pub struct Fin {
    /// How it was drawn.
    pub plan: Plan,
    lo: Vec2,
    size: [usize; 2],
    map: Vec<Cell>,
}

/// A number in 0..1 that looks random but belongs to `i`.
fn chance(i: usize) -> f32 {
    ((i as f32 * 12.9898 + 4.1).sin() * 43_758.547)
        .fract()
        .abs()
}

impl Plan {
    /// The place `(s, t)` in the plane, carried on straight beyond 0..=1.
    pub fn place(&self, s: f32, t: f32) -> Vec2 {
        let inside = |s: f32, t: f32| {
            let across: Vec<Vec3> = self
                .guides
                .iter()
                .map(|g| {
                    let points: Vec<Vec3> = g.iter().map(|p| p.extend(0.0)).collect();
                    curve(&points, t)
                })
                .collect();
            curve(&across, s).truncate()
        };
        const NEAR: f32 = 0.02;
        let (cs, ct) = (s.clamp(0.0, 1.0), t.clamp(0.0, 1.0));
        let p = inside(cs, ct);
        let slope = |over: f32, back: Vec2| (p - back) * (over.abs() / NEAR);
        let mut q = p;
        if s != cs {
            q += slope(s - cs, inside(cs - NEAR * (s - cs).signum(), ct));
        }
        if t != ct {
            q += slope(t - ct, inside(cs, ct - NEAR * (t - ct).signum()));
        }
        q
    }

    /// Where the two branches of each ray run at `t`; they are one at first.
    fn rays_at(&self, t: f32) -> impl Iterator<Item = [f32; 2]> {
        let gap = 1.0 / (self.rays - 1) as f32;
        (0..self.rays).map(move |k| {
            let s = 0.012 + 0.976 * k as f32 * gap;
            let from = self.branch * (0.8 + 0.45 * chance(k + self.rays));
            // The outermost rays stay whole: they edge the fin.
            let whole = k == 0 || k == self.rays - 1;
            let open = if whole {
                0.0
            } else {
                smoothstep(from, from + 0.55, t)
            };
            let apart = 0.25 * gap * open * (1.0 - 0.12 * t);
            [s - apart, s + apart]
        })
    }

    /// Where the rim lies at `s`: scalloped between the tips, and never quite even.
    fn rim(&self, s: f32) -> f32 {
        // A deep hollow between rays, a faint one between their branches.
        let gaps = (self.rays - 1) as f32;
        let hollow = 0.4 - 0.4 * (s * gaps * TAU).cos() + 0.1 * (s * 2.0 * gaps * TAU).cos();
        let drift = (s * TAU * 2.3 + self.wave[2]).sin() + 0.6 * (s * TAU * 5.1 + 1.3).sin();
        // The corners are round, and smooth.
        let inward = s.min(1.0 - s).max(0.0) / self.corner;
        let corner = (1.0 - inward).max(0.0);
        let round = 1.0 - (1.0 - corner * corner).sqrt();
        let even = smoothstep(0.2, 1.2, inward);
        1.0 - self.scallop * even * (hollow + 0.5 * (drift + 1.2)) - 0.16 * round
    }

    /// The sheet's height over the plane.
    fn lift(&self, s: f32, t: f32) -> f32 {
        let [height, count, phase] = self.wave;
        let t = t.max(0.0);
        let fold = (TAU * (count * s + 0.22 * t) + phase).sin()
            + 0.35 * (TAU * (1.9 * count * s - 0.35 * t) + 2.0 * phase + 1.0).sin() * t;
        let sway = 0.4 * (TAU * 0.7 * t + phase).sin();
        height * t.powf(1.25) * (fold + sway)
    }

    /// Half the thickness at `(s, t)`, `across` being the mm that one of `s`
    /// spans square to the rays.
    fn half(&self, s: f32, t: f32, across: f32) -> f32 {
        let [sheet, base, tip] = self.thick.map(|v| 0.5 * v);
        let branched = smoothstep(self.branch, self.branch + 0.5, t);
        let gap = across / (self.rays - 1) as f32 * lerp(1.0, 0.5, branched);
        let width = lerp(1.2, 0.9, t.clamp(0.0, 1.0)).min(0.6 * gap + 0.1);
        let bump = |r: f32| {
            let u = ((s - r).abs() * across / width).min(1.0);
            (1.0 - u * u) * (1.0 - u * u)
        };
        // Branches part smoothly: the mean of high powers is nearly the larger.
        let valley = self.rays_at(t.clamp(0.0, 1.2)).fold(1.0, |v, [a, b]| {
            v * (1.0 - (0.5 * (bump(a).powi(6) + bump(b).powi(6))).powf(1.0 / 6.0))
        });
        // Where they crowd, they run together.
        let room = smoothstep(0.3, 0.8, gap);
        let crest = lerp(0.4, 1.0 - valley, room);
        let ray = lerp(base, tip, t.clamp(0.0, 1.0));
        let root = 0.35 * smoothstep(0.18, 0.0, t);
        sheet + root + (ray - sheet) * crest
    }
}

impl Fin {
    /// Lays down the map of `plan`.
    pub fn new(plan: Plan) -> Self {
        let side = |s: f32, end: f32| -> Vec<Vec2> {
            (0..24)
                .map(|i| plan.place(s, end * i as f32 / 24.0))
                .collect()
        };
        let mut outline = side(0.0, plan.rim(0.0));
        let count = plan.rays * 30;
        for i in 0..count {
            let s = i as f32 / count as f32;
            outline.push(plan.place(s, plan.rim(s)));
        }
        let mut back = side(1.0, plan.rim(1.0));
        back.push(plan.place(1.0, plan.rim(1.0)));
        outline.extend(back.into_iter().rev());
        for i in 1..16 {
            outline.push(plan.place(1.0 - i as f32 / 16.0, 0.0));
        }
        let lo = outline.iter().fold(Vec2::INFINITY, |m, &p| m.min(p)) - 2.0;
        let hi = outline.iter().fold(Vec2::NEG_INFINITY, |m, &p| m.max(p)) + 2.0;
        let size = ((hi - lo) / CELL).ceil().as_uvec2() + 2;
        let size = [size.x as usize, size.y as usize];
        let mut this = Self {
            plan,
            lo,
            size,
            map: Vec::new(),
        };
        this.fill(&outline);
        this
    }

    /// Fills the map: first `s` and `t`, then all that follows from them.
    fn fill(&mut self, outline: &[Vec2]) {
        const ACROSS: usize = 160;
        const ALONG: usize = 110;
        let [w, h] = self.size;
        let plan = &self.plan;
        // A net over the plane, a little larger than the fin.
        let net = |i: usize, j: usize| {
            (
                lerp(-0.08, 1.08, i as f32 / ACROSS as f32),
                lerp(-0.1, 1.12, j as f32 / ALONG as f32),
            )
        };
        let knots: Vec<(Vec2, Vec3)> = (0..(ACROSS + 1) * (ALONG + 1))
            .into_par_iter()
            .map(|k| {
                let (s, t) = net(k % (ACROSS + 1), k / (ACROSS + 1));
                let slope = |ds: f32, dt: f32| {
                    (plan.place(s + ds, t + dt) - plan.place(s - ds, t - dt)) * 50.0
                };
                // Across the rays, not along the rim.
                let along = slope(0.0, 0.01).normalize_or_zero();
                let span = slope(0.01, 0.0).perp_dot(along).abs();
                (plan.place(s, t), Vec3::new(s, t, span))
            })
            .collect();
        let mut places = vec![None; w * h];
        for within in [true, false] {
            for j in 0..ALONG {
                for i in 0..ACROSS {
                    let at = |a: usize, b: usize| knots[(j + b) * (ACROSS + 1) + i + a];
                    let (s, t) = net(i, j);
                    let inner = (-0.01..1.0).contains(&s) && (-0.01..1.0).contains(&t);
                    if inner != within {
                        continue;
                    }
                    for triangle in [
                        [at(0, 0), at(1, 0), at(1, 1)],
                        [at(0, 0), at(1, 1), at(0, 1)],
                    ] {
                        self.lay(&triangle, &mut places);
                    }
                }
            }
        }
        spread(&mut places, w, h);
        let lifts: Vec<f32> = places
            .iter()
            .map(|p| p.map_or(0.0, |p: Vec3| plan.lift(p.x, p.y)))
            .collect();
        let lo = self.lo;
        self.map = (0..w * h)
            .into_par_iter()
            .map(|k| {
                let (x, y) = (k % w, k / w);
                let p = places[k].unwrap_or_default();
                let lift = |x: usize, y: usize| lifts[y.min(h - 1) * w + x.min(w - 1)];
                let slope = Vec2::new(
                    lift(x + 1, y) - lift(x.saturating_sub(1), y),
                    lift(x, y + 1) - lift(x, y.saturating_sub(1)),
                ) / (2.0 * CELL);
                Cell {
                    rim: polygon(lo + Vec2::new(x as f32, y as f32) * CELL, outline),
                    half: plan.half(p.x, p.y, p.z),
                    lift: lifts[k],
                    lean: 1.0 / (1.0 + slope.length_squared()).sqrt(),
                    s: p.x,
                    t: p.y,
                }
            })
            .collect();
    }

    /// Interpolates what the corners of a triangle hold over the cells within it.
    fn lay(&self, corners: &[(Vec2, Vec3); 3], places: &mut [Option<Vec3>]) {
        let [a, b, c] = corners.map(|k| (k.0 - self.lo) / CELL);
        let area = (b - a).perp_dot(c - a);
        if area.abs() < 1e-9 {
            return;
        }
        let [w, h] = self.size;
        let lo = a.min(b).min(c).ceil().max(Vec2::ZERO);
        let hi = a.max(b).max(c).floor();
        for y in lo.y as usize..=(hi.y.max(-1.0) + 0.5) as usize {
            for x in lo.x as usize..=(hi.x.max(-1.0) + 0.5) as usize {
                if x >= w || y >= h || places[y * w + x].is_some() {
                    continue;
                }
                let p = Vec2::new(x as f32, y as f32);
                let u = (c - b).perp_dot(p - b) / area;
                let v = (a - c).perp_dot(p - c) / area;
                let k = 1.0 - u - v;
                if u.min(v).min(k) >= -1e-4 {
                    places[y * w + x] =
                        Some(corners[0].1 * u + corners[1].1 * v + corners[2].1 * k);
                }
            }
        }
    }

    /// `p` in the fin's own frame: two coordinates in the plane, one across.
    pub fn local(&self, p: Vec3) -> Vec3 {
        let p = if self.plan.paired {
            p.with_z(p.z.abs())
        } else {
            p
        };
        let q = p - self.plan.at;
        let [u, v] = self.plan.axes;
        Vec3::new(q.dot(u), q.dot(v), q.dot(u.cross(v)))
    }

    /// The direction across the sheet, on the left side of the fish.
    pub fn normal(&self) -> Vec3 {
        let [u, v] = self.plan.axes;
        u.cross(v)
    }

    /// The point of the sheet at `(s, t)`, on the left side of the fish.
    pub fn point(&self, s: f32, t: f32) -> Vec3 {
        let p = self.plan.place(s, t);
        let [u, v] = self.plan.axes;
        self.plan.at + u * p.x + v * p.y + self.normal() * self.plan.lift(s, t)
    }

    /// The map at a place of the plane, and how far outside the map that is.
    fn read(&self, q: Vec2) -> (Cell, f32) {
        let [w, h] = self.size;
        let at = (q - self.lo) / CELL;
        let top = Vec2::new(w as f32 - 1.001, h as f32 - 1.001);
        let held = at.clamp(Vec2::ZERO, top);
        let (x, y) = (held.x as usize, held.y as usize);
        let f = held - held.floor();
        let cell = |i: usize, j: usize| self.map[(y + j) * w + x + i];
        let low = cell(0, 0).mix(cell(1, 0), f.x);
        let high = cell(0, 1).mix(cell(1, 1), f.x);
        (low.mix(high, f.y), held.distance(at) * CELL)
    }

    /// `(s, t)` of the place nearest to `p`.
    pub fn parameters(&self, p: Vec3) -> Vec2 {
        let (cell, _) = self.read(self.local(p).truncate());
        Vec2::new(cell.s, cell.t)
    }

    /// Signed distance to the fin, mm. Where that is large, a rough one.
    pub fn distance(&self, p: Vec3) -> f32 {
        let q = self.local(p);
        let (cell, beyond) = self.read(q.truncate());
        let rim = cell.rim + beyond;
        let rise = (q.z - cell.lift).abs() * cell.lean - cell.half;
        // A rim as round as the sheet is thick.
        let r = cell.half * 0.95;
        let (a, b) = (rim + r, rise + r);
        a.max(b).min(0.0) + a.max(0.0).hypot(b.max(0.0)) - r
    }

    /// How near `p` is to the rim, 0..=1.
    pub fn rim(&self, p: Vec3) -> f32 {
        let (cell, _) = self.read(self.local(p).truncate());
        smoothstep(0.9, 0.3, -cell.rim) * smoothstep(0.25, 0.4, cell.t)
    }
}

/// Lets every empty cell take the mean of its filled neighbours, until none is left.
fn spread(places: &mut [Option<Vec3>], w: usize, h: usize) {
    while places.iter().any(Option::is_none) && places.iter().any(Option::is_some) {
        let before = places.to_vec();
        for k in (0..w * h).filter(|&k| before[k].is_none()) {
            let (x, y) = (k % w, k / w);
            let mut sum = (Vec3::ZERO, 0.0);
            for j in y.saturating_sub(1)..=(y + 1).min(h - 1) {
                for i in x.saturating_sub(1)..=(x + 1).min(w - 1) {
                    if let Some(p) = before[j * w + i] {
                        sum = (sum.0 + p, sum.1 + 1.0);
                    }
                }
            }
            if sum.1 > 0.0 {
                places[k] = Some(sum.0 / sum.1);
            }
        }
    }
}

fn plane(points: &[(f32, f32)]) -> Vec<Vec2> {
    points.iter().map(|&p| p.into()).collect()
}

/// A median fin's plan lies in the plane of symmetry.
fn median(
    name: &'static str,
    guides: &[&[(f32, f32)]],
    rays: usize,
    [scallop, corner]: [f32; 2],
    wave: [f32; 3],
) -> Plan {
    Plan {
        name,
        at: Vec3::ZERO,
        axes: [Vec3::X, Vec3::Y],
        guides: guides.iter().map(|g| plane(g)).collect(),
        rays,
        branch: 0.3,
        scallop,
        corner,
        wave,
        thick: [0.72, 1.5, 1.2],
        paired: false,
    }
}

/// Which fin of [`all`] is which.
pub const TAIL: usize = 0;
/// The fin on the back.
pub const DORSAL: usize = 1;
/// The long fin under the belly.
pub const ANAL: usize = 2;
/// The pair behind the gills.
pub const PECTORAL: usize = 3;
/// The pair of long feelers under the breast.
pub const VENTRAL: usize = 4;

/// The plans of all fins.
pub fn plans() -> Vec<Plan> {
    let tail = median(
        "tail",
        &[
            &[
                (-2.5, 2.5),
                (-8.0, 6.6),
                (-14.0, 10.6),
                (-20.5, 13.0),
                (-27.0, 12.6),
            ],
            &[
                (-3.2, 1.7),
                (-10.0, 5.0),
                (-18.0, 7.9),
                (-26.0, 8.4),
                (-33.2, 5.8),
            ],
            &[
                (-3.6, 0.7),
                (-11.0, 1.9),
                (-19.5, 2.5),
                (-28.0, 0.8),
                (-35.8, -3.6),
            ],
            &[
                (-3.6, -0.4),
                (-10.5, -1.4),
                (-18.5, -3.4),
                (-26.5, -7.4),
                (-33.8, -13.4),
            ],
            &[
                (-3.2, -1.3),
                (-9.0, -4.0),
                (-15.5, -8.0),
                (-22.0, -13.6),
                (-28.0, -20.6),
            ],
            &[
                (-2.5, -2.1),
                (-7.0, -6.0),
                (-11.5, -11.0),
                (-15.5, -16.6),
                (-19.0, -23.0),
            ],
        ],
        9,
        [0.036, 0.12],
        [1.6, 2.6, 0.4],
    );
    let dorsal = median(
        "dorsal",
        &[
            &[
                (10.0, 3.4),
                (9.9, 6.5),
                (9.5, 9.4),
                (8.8, 12.0),
                (7.8, 14.2),
            ],
            &[
                (7.0, 3.4),
                (5.7, 8.8),
                (3.3, 13.6),
                (0.6, 17.9),
                (-3.0, 21.2),
            ],
            &[
                (3.6, 3.0),
                (1.0, 8.8),
                (-3.0, 13.8),
                (-8.0, 18.4),
                (-13.8, 22.0),
            ],
            &[
                (0.8, 2.4),
                (-2.5, 7.6),
                (-7.2, 12.2),
                (-12.8, 16.2),
                (-19.4, 19.4),
            ],
        ],
        6,
        [0.028, 0.3],
        [1.1, 1.6, 2.1],
    );
    let anal = median(
        "anal",
        &[
            &[
                (15.5, -3.6),
                (15.5, -6.2),
                (15.3, -8.8),
                (14.8, -11.3),
                (14.1, -13.6),
            ],
            &[
                (11.5, -3.6),
                (10.4, -8.6),
                (8.4, -13.4),
                (6.4, -18.0),
                (3.4, -22.0),
            ],
            &[
                (7.0, -3.2),
                (4.9, -9.4),
                (1.8, -15.2),
                (-2.2, -20.6),
                (-6.6, -25.4),
            ],
            &[
                (2.8, -2.5),
                (0.4, -8.6),
                (-3.0, -14.4),
                (-7.4, -20.2),
                (-12.0, -25.8),
            ],
            &[
                (-0.4, -1.9),
                (-3.0, -6.8),
                (-6.4, -12.2),
                (-10.4, -18.2),
                (-14.6, -24.2),
            ],
        ],
        8,
        [0.028, 0.26],
        [1.2, 2.4, 1.2],
    );
    let pectoral = Plan {
        name: "pectoral",
        at: Vec3::new(17.3, -1.5, 2.8),
        axes: [Vec3::new(-0.78, -0.12, 0.61).normalize(), Vec3::Y],
        guides: [
            &[(0.0, 0.95), (2.4, 2.2), (5.0, 3.7), (7.6, 4.9), (9.8, 5.4)],
            &[(0.0, 0.4), (2.8, 0.9), (5.8, 1.5), (8.8, 1.9), (11.4, 1.7)],
            &[
                (0.0, -0.3),
                (2.7, -0.5),
                (5.6, -1.0),
                (8.5, -1.8),
                (10.9, -2.9),
            ],
            &[
                (0.0, -0.9),
                (2.1, -1.8),
                (4.3, -3.1),
                (6.4, -4.7),
                (8.0, -6.4),
            ],
        ]
        .map(|g| plane(g))
        .to_vec(),
        rays: 6,
        branch: 0.45,
        scallop: 0.04,
        corner: 0.2,
        wave: [0.35, 1.2, 0.3],
        thick: [0.72, 1.25, 1.1],
        paired: true,
    };
    let down = Vec3::new(0.0, -0.93, 0.36).normalize();
    let ventral = Plan {
        name: "ventral",
        at: Vec3::new(20.6, -3.4, 1.25),
        axes: [Vec3::NEG_X, down],
        guides: [
            &[
                (-1.1, 0.0),
                (-1.0, 4.8),
                (0.2, 9.8),
                (3.2, 14.6),
                (8.2, 18.8),
            ],
            &[(0.0, 0.0), (0.6, 4.7), (1.8, 9.5), (4.4, 14.2), (8.7, 18.5)],
            &[(1.1, 0.0), (2.1, 4.5), (3.4, 9.1), (5.5, 13.6), (9.1, 18.1)],
        ]
        .map(|g| plane(g))
        .to_vec(),
        rays: 3,
        branch: 2.0,
        scallop: 0.0,
        corner: 0.5,
        wave: [0.6, 0.4, 0.0],
        thick: [0.75, 1.5, 0.95],
        paired: true,
    };
    vec![tail, dorsal, anal, pectoral, ventral]
}

/// All fins, in the order of the constants above.
pub fn all() -> Vec<Fin> {
    plans().into_iter().map(Fin::new).collect()
}
