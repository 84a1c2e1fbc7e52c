//! The skeleton, what each vertex follows, and the two morph targets.
//!
//! Every joint stands unturned at rest, so that its axes are the world's. A
//! joint bends what lies behind it: from its own place to that of the next.

use glam::{Mat4, Quat, Vec2, Vec3};

use super::Betta;
use super::body;
use super::fins::{ANAL, DORSAL, Fin, PECTORAL, TAIL, VENTRAL};
use crate::mesh::Mesh;
use crate::sdf::smoothstep;

/// The spine's joints lie on the midline at these places, from the head on.
pub const SPINE: [f32; 7] = [22.0, 18.0, 14.2, 10.4, 6.6, 2.8, -1.0];

/// Chains of each fin: their places across it, and those of their joints along it.
const CHAINS: [(usize, &[f32], &[f32]); 5] = [
    (TAIL, &[0.13, 0.5, 0.87], &[0.17, 0.38, 0.6, 0.81]),
    (DORSAL, &[0.15, 0.5, 0.85], &[0.2, 0.58]),
    (ANAL, &[0.12, 0.5, 0.88], &[0.19, 0.46, 0.73]),
    (PECTORAL, &[0.5], &[0.2, 0.55]),
    (VENTRAL, &[0.5], &[0.18, 0.44, 0.7]),
];

/// Below this `t` a fin follows the body alone.
const ROOTED: f32 = 0.08;

/// One joint.
#[derive(Clone, Debug)]
pub struct Joint {
    /// Its name.
    pub name: String,
    /// The joint that carries it.
    pub parent: Option<usize>,
    /// Its place at rest, mm.
    pub at: Vec3,
    /// The direction of what it bends.
    pub along: Vec3,
    /// Positive angles round this axis move what it bends to the fish's left,
    /// or, for the paired fins, away from the body.
    pub axis: Vec3,
    /// Where in the fish it is.
    pub role: Role,
}

/// What a joint is for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Role {
    /// Carries everything.
    Root,
    /// The n-th of the spine.
    Spine(usize),
    /// Of a fin: which, on which side (1 left or median, -1 right), the number
    /// of the chain, and the number of the joint within it.
    Fin(usize, f32, usize, usize),
}

/// The skeleton.
#[derive(Default)]
pub struct Rig {
    /// Its joints, parents first; the first is the root.
    pub joints: Vec<Joint>,
}

/// What the vertices follow.
pub struct Skin {
    /// Four joints of each vertex.
    pub joints: Vec<[u8; 4]>,
    /// Their weights, which sum to 65 535.
    pub weights: Vec<[u16; 4]>,
}

/// The joint of the spine that bends what lies at `x`.
fn vertebra(x: f32) -> usize {
    SPINE.iter().rposition(|&s| x <= s).unwrap_or(0)
}

impl Rig {
    /// The skeleton of `fish`.
    pub fn new(fish: &Betta) -> Self {
        let mut rig = Self::default();
        rig.add("root", None, Vec3::new(14.0, 0.0, 0.0), Vec3::Z, Role::Root);
        for (i, &x) in SPINE.iter().enumerate() {
            let name = format!("spine.{i}");
            rig.add(
                &name,
                Some(i),
                Vec3::new(x, 0.0, 0.0),
                Vec3::Z,
                Role::Spine(i),
            );
        }
        for (fin, across, places) in CHAINS {
            let it = &fish.fins[fin];
            let sides: &[f32] = if it.plan.paired { &[1.0, -1.0] } else { &[1.0] };
            for &side in sides {
                for (c, &s) in across.iter().enumerate() {
                    let mut parent = 1 + vertebra(it.point(s, 0.0).x);
                    for (j, &t) in places.iter().enumerate() {
                        let mirror = Vec3::new(1.0, 1.0, side);
                        let mut name = it.plan.name.to_owned();
                        if it.plan.paired {
                            name += if side > 0.0 { ".left" } else { ".right" };
                        }
                        if across.len() > 1 {
                            name += &format!(".{c}");
                        }
                        let end = places.get(j + 1).copied().unwrap_or(1.0);
                        let along = (it.point(s, end) - it.point(s, t)) * mirror;
                        let at = it.point(s, t) * mirror;
                        let normal = it.normal() * mirror;
                        let role = Role::Fin(fin, side, c, j);
                        parent = rig.add(&format!("{name}.{j}"), Some(parent), at, normal, role);
                        let joint = &mut rig.joints[parent];
                        joint.along = along.normalize();
                        joint.axis = joint.along.cross(normal).normalize();
                    }
                }
            }
        }
        rig
    }

    fn add(
        &mut self,
        name: &str,
        parent: Option<usize>,
        at: Vec3,
        normal: Vec3,
        role: Role,
    ) -> usize {
        self.joints.push(Joint {
            name: name.to_owned(),
            parent,
            at,
            along: Vec3::NEG_X,
            axis: Vec3::NEG_X.cross(normal),
            role,
        });
        self.joints.len() - 1
    }

    fn find(&self, role: Role) -> usize {
        self.joints.iter().position(|j| j.role == role).unwrap_or(0)
    }

    /// Adds what the spine does at `x`, `share` of it all, to `weights`.
    fn follow_spine(&self, x: f32, share: f32, weights: &mut [f32]) {
        let mut rest = 1.0;
        for i in (0..SPINE.len()).rev() {
            let half = 1.9;
            let w = if i == 0 {
                1.0
            } else {
                smoothstep(SPINE[i] + half, SPINE[i] - half, x)
            };
            weights[1 + i] += share * rest * w;
            rest *= 1.0 - w;
        }
    }

    /// What a vertex of a fin follows.
    fn follow_fin(&self, fin: usize, side: f32, place: Vec2, x: f32, weights: &mut [f32]) {
        let (_, across, along) = CHAINS[fin];
        let c = across.partition_point(|&s| s <= place.x);
        let (a, b) = (c.saturating_sub(1), c.min(across.len() - 1));
        let mix = if a == b {
            0.0
        } else {
            smoothstep(across[a], across[b], place.x)
        };
        let mut rest = 1.0;
        for (j, &t) in along.iter().enumerate().rev() {
            let ahead = along.get(j + 1).map_or(1.0, |&n| n);
            let behind = if j == 0 { ROOTED } else { along[j - 1] };
            let half = 0.5 * (ahead - t).min(t - behind);
            let (lo, hi) = if j == 0 {
                (ROOTED, t + half)
            } else {
                (t - half, t + half)
            };
            let w = rest * smoothstep(lo, hi, place.y);
            rest -= w;
            weights[self.find(Role::Fin(fin, side, a, j))] += w * (1.0 - mix);
            weights[self.find(Role::Fin(fin, side, b, j))] += w * mix;
        }
        self.follow_spine(x, rest, weights);
    }

    /// What each vertex of `mesh` follows.
    pub fn bind(&self, fish: &Betta, mesh: &Mesh) -> Skin {
        let count = self.joints.len();
        let mut all: Vec<Vec<f32>> = mesh
            .positions
            .iter()
            .map(|&p| {
                let mut weights = vec![0.0; count];
                match fish.part(p) {
                    None => self.follow_spine(p.x, 1.0, &mut weights),
                    Some(fin) => {
                        let it = &fish.fins[fin];
                        let side = if it.plan.paired && p.z < 0.0 {
                            -1.0
                        } else {
                            1.0
                        };
                        self.follow_fin(fin, side, it.parameters(p), p.x, &mut weights);
                    }
                }
                weights
            })
            .collect();
        // Evened out along the surface, which never crosses a gap.
        let rings = mesh.rings();
        for _ in 0..4 {
            all = (0..all.len())
                .map(|i| {
                    let mut sum = all[i].clone();
                    for &n in &rings[i] {
                        for (s, w) in sum.iter_mut().zip(&all[n as usize]) {
                            *s += w;
                        }
                    }
                    let scale = 1.0 / (1 + rings[i].len()) as f32;
                    sum.iter().map(|s| s * scale).collect()
                })
                .collect();
        }
        let mut skin = Skin {
            joints: Vec::new(),
            weights: Vec::new(),
        };
        for weights in &all {
            let (joints, weights) = strongest(weights);
            skin.joints.push(joints);
            skin.weights.push(weights);
        }
        skin
    }

    /// Where each joint takes its vertices, given its turn and the root's shift.
    pub fn palette(&self, turns: &[Quat], shift: Vec3) -> Vec<Mat4> {
        let mut globals: Vec<Mat4> = Vec::with_capacity(self.joints.len());
        for (i, joint) in self.joints.iter().enumerate() {
            let global = match joint.parent {
                None => Mat4::from_rotation_translation(turns[i], joint.at + shift),
                Some(p) => {
                    let offset = joint.at - self.joints[p].at;
                    globals[p] * Mat4::from_rotation_translation(turns[i], offset)
                }
            };
            globals.push(global);
        }
        globals
            .iter()
            .zip(&self.joints)
            .map(|(g, j)| *g * Mat4::from_translation(-j.at))
            .collect()
    }
}

/// The four largest of `weights`, in parts of 65 535.
fn strongest(weights: &[f32]) -> ([u8; 4], [u16; 4]) {
    let mut order: Vec<usize> = (0..weights.len()).collect();
    order.sort_by(|&a, &b| weights[b].total_cmp(&weights[a]).then(a.cmp(&b)));
    let sum: f32 = order[..4].iter().map(|&i| weights[i]).sum();
    let mut joints = [0; 4];
    let mut parts = [0u16; 4];
    let mut left = u16::MAX;
    for k in (0..4).rev() {
        let part = if k == 0 {
            left
        } else {
            (weights[order[k]] / sum * f32::from(u16::MAX)) as u16
        };
        left -= part;
        parts[k] = part;
        // An unused slot names the root.
        joints[k] = if part == 0 { 0 } else { order[k] as u8 };
    }
    (joints, parts)
}

/// What a morph target adds to each vertex at weight 1.
pub struct Morph {
    /// Its name.
    pub name: &'static str,
    /// Added to positions, mm.
    pub positions: Vec<Vec3>,
    /// Added to normals.
    pub normals: Vec<Vec3>,
}

/// How far a fin opens when it is spread, radians at `s` across it. The fins
/// above and below open away from the tail.
fn opening(fin: usize, s: f32) -> f32 {
    let degrees = match fin {
        TAIL => 10.0 * s - 7.0,
        DORSAL => -4.0 - 9.0 * (1.0 - s),
        ANAL => -3.0 - 9.0 * (1.0 - s),
        PECTORAL => 9.0 * (2.0 * s - 1.0),
        _ => -7.0,
    };
    degrees.to_radians()
}

/// Turns `p` of a fin within its plane.
fn opened(it: &Fin, fin: usize, p: Vec3) -> Vec3 {
    let place = it.parameters(p);
    let plan = &it.plan;
    let hub = plan.place(0.5, 0.0);
    // Opening turns the last ray away from the first.
    let (first, last) = (plan.place(0.0, 1.0) - hub, plan.place(1.0, 1.0) - hub);
    let angle = opening(fin, place.x.clamp(0.0, 1.0))
        * first.perp_dot(last).signum()
        * smoothstep(ROOTED, 0.55, place.y);
    let q = it.local(p).truncate() - hub;
    let moved = Vec2::from_angle(angle).rotate(q) - q;
    let side = if plan.paired && p.z < 0.0 { -1.0 } else { 1.0 };
    let [u, v] = plan.axes;
    p + (u * moved.x + v * moved.y) * Vec3::new(1.0, 1.0, side)
}

/// The mouth drops open and the gill covers swing out.
fn breathing(p: Vec3) -> Vec3 {
    let turn = Quat::from_rotation_z(-10f32.to_radians() * body::jaw(p));
    let p = body::HINGE + turn * (p - body::HINGE);
    p + Vec3::new(0.15, 0.0, 0.85 * p.z.signum()) * body::gill_cover(p)
}

/// The two morph targets of `mesh`: `breathe` and `flare`.
pub fn morphs(fish: &Betta, mesh: &Mesh, normals: &[Vec3]) -> Vec<Morph> {
    let breathe = |p: Vec3| match fish.part(p) {
        None => breathing(p),
        Some(_) => p,
    };
    let flare = |p: Vec3| match fish.part(p) {
        None => p,
        Some(fin) => opened(&fish.fins[fin], fin, p),
    };
    let rest = mesh.normals();
    let target = |name, moved: &dyn Fn(Vec3) -> Vec3| {
        let after = Mesh {
            positions: mesh.positions.iter().map(|&p| moved(p)).collect(),
            triangles: mesh.triangles.clone(),
        };
        // The shading normal turns as the mesh's own does.
        let turned = after.normals();
        Morph {
            name,
            positions: (0..normals.len())
                .map(|i| after.positions[i] - mesh.positions[i])
                .collect(),
            normals: (0..normals.len())
                .map(|i| (Quat::from_rotation_arc(rest[i], turned[i]) * normals[i]) - normals[i])
                .collect(),
        }
    };
    vec![target("breathe", &breathe), target("flare", &flare)]
}
