//! A Siamese fighting fish, betta splendens, of the veil-tailed kind. Y is up,
//! the nose points at +X, a millimetre is a millimetre.

pub mod body;
pub mod fins;
pub mod motion;
pub mod rig;

use glam::{Quat, Vec3};

use crate::glb::{self, Clip, Target};
use crate::mesh::Mesh;
use crate::sdf::join;
use crate::{Piece, Sculpture, carve};
use fins::Fin;
use rig::{Morph, Rig, Skin};

/// Where the tail fin takes over from the body, mm.
const PEDUNCLE: f32 = -4.0;

/// The finished field.
pub struct Betta {
    /// The fins, in the order of the constants in [`fins`].
    pub fins: Vec<Fin>,
}

impl Default for Betta {
    fn default() -> Self {
        Self::new()
    }
}

impl Betta {
    /// Lays out every fin.
    pub fn new() -> Self {
        Self { fins: fins::all() }
    }

    /// The fin that is nearest to `p`, or none where the body is nearer. The
    /// body's end, sunk into the tail fin, counts as fin.
    pub fn part(&self, p: Vec3) -> Option<usize> {
        let body = if p.x < PEDUNCLE {
            f32::MAX
        } else {
            body::distance(p)
        };
        (0..self.fins.len())
            .map(|i| (Some(i), self.fins[i].distance(p)))
            .fold((None, body), |m, c| if c.1 < m.1 { c } else { m })
            .0
    }
}

impl Sculpture for Betta {
    const SIZES: &'static [(&'static str, usize)] = &[("betta", 15_600)];

    fn distance(&self, p: Vec3) -> f32 {
        let body = body::distance(p);
        let fins = self.fins.iter().fold(f32::MAX, |d, f| d.min(f.distance(p)));
        join(body, fins, 1.0)
    }

    fn bounds(&self) -> (Vec3, Vec3) {
        (Vec3::new(-39.0, -29.5, -13.0), Vec3::new(36.0, 25.5, 13.0))
    }

    fn importance(&self, p: Vec3) -> f32 {
        let rim = self.fins.iter().fold(0.0f32, |m, f| {
            if f.distance(p).abs() < 0.3 {
                m.max(f.rim(p))
            } else {
                m
            }
        });
        body::importance(p) + 1.5 * rim
    }
}

/// The carved fish with all that moves it.
pub struct Animal {
    /// The surface at rest.
    pub piece: Piece,
    /// Its skeleton.
    pub rig: Rig,
    /// What its vertices follow.
    pub skin: Skin,
    /// Its morph targets.
    pub morphs: Vec<Morph>,
    /// Its clips.
    pub clips: Vec<Clip>,
}

impl Animal {
    /// Carves `fish` from a lattice of spacing `step` mm and rigs it.
    pub fn new(fish: &Betta, step: f32) -> Result<Self, String> {
        let piece = carve(fish, step)?.swap_remove(0);
        let rig = Rig::new(fish);
        Ok(Self {
            skin: rig.bind(fish, &piece.mesh),
            morphs: rig::morphs(fish, &piece.mesh, &piece.normals),
            clips: motion::clips(&rig),
            rig,
            piece,
        })
    }

    /// The bytes of the glTF file.
    pub fn glb(&self) -> Result<Vec<u8>, String> {
        glb::write(&glb::Model {
            name: "betta",
            mesh: &self.piece.mesh,
            normals: &self.piece.normals,
            rig: &self.rig,
            skin: &self.skin,
            morphs: &self.morphs,
            clips: &self.clips,
            colour: [0.85, 0.45, 0.35],
            roughness: 0.35,
        })
    }

    /// The surface and its normals at `time` s of `clip`.
    pub fn posed(&self, clip: &Clip, time: f32) -> (Mesh, Vec<Vec3>) {
        let mut turns = vec![Quat::IDENTITY; self.rig.joints.len()];
        let mut shift = Vec3::ZERO;
        let mut weights = vec![0.0; self.morphs.len()];
        for channel in &clip.channels {
            let v = clip.sample(channel, time);
            match channel.target {
                Target::Rotation(i) => turns[i] = Quat::from_xyzw(v[0], v[1], v[2], v[3]),
                Target::Translation(i) => shift = Vec3::from_slice(&v) - self.rig.joints[i].at,
                Target::Weights => weights = v,
            }
        }
        self.deformed(&self.rig.palette(&turns, shift), &weights)
    }

    /// The surface and its normals, morphed by `weights`, then skinned by `palette`.
    pub fn deformed(&self, palette: &[glam::Mat4], weights: &[f32]) -> (Mesh, Vec<Vec3>) {
        let mut mesh = self.piece.mesh.clone();
        let mut normals = self.piece.normals.clone();
        let vertices = mesh.positions.iter_mut().zip(&mut normals).enumerate();
        for (i, (place, normal)) in vertices {
            let (mut p, mut n) = (*place, *normal);
            for (morph, w) in self.morphs.iter().zip(weights) {
                p += morph.positions[i] * *w;
                n += morph.normals[i] * *w;
            }
            let (mut at, mut along) = (Vec3::ZERO, Vec3::ZERO);
            for (&j, &w) in self.skin.joints[i].iter().zip(&self.skin.weights[i]) {
                let w = f32::from(w) / f32::from(u16::MAX);
                at += palette[usize::from(j)].transform_point3(p) * w;
                along += palette[usize::from(j)].transform_vector3(n) * w;
            }
            *place = at;
            *normal = along.normalize_or(Vec3::Y);
        }
        (mesh, normals)
    }
}
