//! Meshes that move: a rest shape, and what poses it.
//!
//! A vertex goes through three steps, in the `deform` pass and in its twin alike ([`crate::cpu::deform`]):
//! morph targets are added, joints blended ([glTF 2.0], "Skins" and "Morph Targets"), and the scene's deformers
//! ([`super::Deformer`]) bend what comes out. Normals follow by the cofactors of each step's Jacobian, so that
//! scaling and shear keep them perpendicular.
//!
//! [glTF 2.0]: https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html

use super::clip::Clip;
use super::deformer::Bend;
use super::{Error, Mesh};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use rayon::prelude::*;

/// A mesh, and what may move it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model {
    /// Its shapes, in the file's own unit: one, or those of a sequence, which may differ in everything.
    pub shapes: Vec<Mesh>,
    /// Joints and morph targets that move its one shape, if any do.
    pub rig: Option<Rig>,
    /// Linear RGB that the file gives as its colour, averaged over its parts by area.
    pub base_color: Option<DVec3>,
}

/// What moves the vertices of one shape.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rig {
    /// Influences a vertex: 4, or 8 where some vertex needs more than 4.
    pub influences: usize,
    /// Joints of each vertex, `influences` of them, as indices into `joints`.
    pub vertex_joints: Vec<u16>,
    /// Their weights, which sum to 1 for each vertex; unused ones are 0.
    pub vertex_weights: Vec<f32>,
    /// Of each vertex, the first of its morphs in `morphs`, the first of their weights in [`Pose::weights`], and how many
    /// there are. Empty where nothing morphs.
    pub vertex_morphs: Vec<[u32; 3]>,
    /// What a morph target adds to a vertex at weight 1: to its position and to its normal.
    pub morphs: Vec<[DVec3; 2]>,
    /// The hierarchy; a parent comes before its children.
    pub nodes: Vec<Node>,
    /// What vertices are bound to.
    pub joints: Vec<Joint>,
    /// Motions that the file holds.
    pub clips: Vec<Clip>,
}

/// A node of the hierarchy, at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// Its name in the file, for messages.
    pub name: String,
    /// The node it hangs on.
    pub parent: Option<usize>,
    /// Where it is, relative to its parent.
    pub local: Local,
    /// The first weight of its mesh's morph targets in [`Pose::weights`].
    pub first_weight: usize,
    /// Their weights at rest; none where its mesh does not morph.
    pub weights: Vec<f64>,
}

/// A node's transformation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Local {
    /// In the parts that animation moves.
    Parts(Parts),
    /// As a matrix, which nothing moves.
    Matrix(DAffine3),
}

/// Translation, rotation and scale, applied from the last to the first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parts {
    /// In the file's unit.
    pub translation: DVec3,
    /// A unit quaternion.
    pub rotation: DQuat,
    /// Along the axes.
    pub scale: DVec3,
}

impl Default for Parts {
    fn default() -> Self {
        Parts {
            translation: DVec3::ZERO,
            rotation: DQuat::IDENTITY,
            scale: DVec3::ONE,
        }
    }
}

/// What vertices are bound to: a joint of a skin, or the node of a mesh that is rigid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// The node that moves it.
    pub node: usize,
    /// From the vertices' space to the node's, at rest: the inverse bind matrix.
    pub inverse_bind: DAffine3,
}

/// A model at one instant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pose {
    /// Which shape.
    pub shape: usize,
    /// Where each joint takes its vertices: the file's unit to mm. At least one: vertices without joints follow the first.
    pub palette: Vec<DAffine3>,
    /// Weight of each morph target.
    pub weights: Vec<f64>,
    /// What bends the result, in turn.
    pub bends: Vec<Bend>,
}

impl Rig {
    /// Palette and weights at `time` (s) of `clip`, or at rest, in the file's unit. `time` is not wrapped; beyond the
    /// ends of a clip its ends hold.
    pub fn pose(&self, clip: Option<&Clip>, time: f64) -> (Vec<DAffine3>, Vec<f64>) {
        let mut locals: Vec<Local> = self.nodes.iter().map(|node| node.local).collect();
        let count = self.nodes.iter().map(|n| n.first_weight + n.weights.len());
        let mut weights = vec![0.0; count.max().unwrap_or(0)];
        for node in &self.nodes {
            weights[node.first_weight..][..node.weights.len()].copy_from_slice(&node.weights);
        }
        if let Some(clip) = clip {
            clip.apply(time, &self.nodes, &mut locals, &mut weights);
        }
        let mut globals: Vec<DAffine3> = Vec::with_capacity(locals.len());
        for (node, local) in self.nodes.iter().zip(&locals) {
            let local = local.affine();
            // A parent comes before its children.
            let parent = node.parent.and_then(|p| globals.get(p));
            globals.push(parent.map_or(local, |parent| *parent * local));
        }
        let palette = self
            .joints
            .iter()
            .map(|joint| globals[joint.node] * joint.inverse_bind)
            .collect();
        (palette, weights)
    }
}

impl Local {
    /// As a matrix.
    pub fn affine(&self) -> DAffine3 {
        match *self {
            Local::Parts(p) => {
                DAffine3::from_scale_rotation_translation(p.scale, p.rotation, p.translation)
            }
            Local::Matrix(matrix) => matrix,
        }
    }
}

/// The cofactors of `m`: what takes normals where `m` takes points, but for their length. It has no inverse to miss.
pub fn cofactors(m: &DMat3) -> DMat3 {
    DMat3::from_cols(
        m.y_axis.cross(m.z_axis),
        m.z_axis.cross(m.x_axis),
        m.x_axis.cross(m.y_axis),
    )
}

impl Model {
    /// A model of one shape that nothing moves.
    pub fn of(mesh: Mesh) -> Model {
        Model {
            shapes: vec![mesh],
            ..Model::default()
        }
    }

    /// The pose of a model whose one mesh unit is `unit` mm, without deformers: of shape `shape`, at `time` (s) of clip
    /// `clip`.
    pub fn pose(&self, unit: f64, shape: usize, clip: Option<&Clip>, time: f64) -> Pose {
        let scale = DAffine3::from_scale(DVec3::splat(unit));
        let (mut palette, weights) = match &self.rig {
            Some(rig) => rig.pose(clip, time),
            None => (vec![DAffine3::IDENTITY], Vec::new()),
        };
        for matrix in &mut palette {
            *matrix = scale * *matrix;
        }
        Pose {
            shape,
            palette,
            weights,
            bends: Vec::new(),
        }
    }

    /// Vertex `index` in `pose`: its position, mm, and its unit normal. Zero where there is no such vertex.
    fn vertex(&self, pose: &Pose, index: usize) -> [DVec3; 2] {
        let Some(shape) = self.shapes.get(pose.shape) else {
            return [DVec3::ZERO; 2];
        };
        let (mut position, mut normal) = (shape.positions[index], shape.normals[index]);
        let mut matrix = pose.palette.first().copied().unwrap_or_default();
        if let Some(rig) = &self.rig {
            if let Some(&[first, weight, count]) = rig.vertex_morphs.get(index) {
                for i in 0..count {
                    let [p, n] = rig.morphs[(first + i) as usize];
                    let w = pose.weights[(weight + i) as usize];
                    position += w * p;
                    normal += w * n;
                }
            }
            if rig.influences > 0 {
                matrix = DAffine3::ZERO;
                let own = rig.influences * index..rig.influences * (index + 1);
                let sum: f64 = rig.vertex_weights[own.clone()]
                    .iter()
                    .copied()
                    .map(f64::from)
                    .sum();
                for i in own {
                    let joint = pose.palette[usize::from(rig.vertex_joints[i])];
                    // In f32 they miss 1 by a digit, which far from the origin is a distance.
                    let w = f64::from(rig.vertex_weights[i]) / sum;
                    matrix.matrix3 += joint.matrix3 * w;
                    matrix.translation += joint.translation * w;
                }
            }
        }
        position = matrix.transform_point3(position);
        normal = cofactors(&matrix.matrix3) * normal;
        for bend in &pose.bends {
            let (p, jacobian) = bend.apply(position);
            position = p;
            normal = cofactors(&jacobian) * normal;
        }
        [position, normal.normalize_or(DVec3::Y)]
    }

    /// Where the vertices are in `pose`, mm: what bounds and framing need of [`Model::posed`].
    pub fn positions(&self, pose: &Pose) -> Vec<DVec3> {
        let count = self.shapes.get(pose.shape).map_or(0, |s| s.positions.len());
        let vertices = (0..count).into_par_iter();
        vertices.map(|index| self.vertex(pose, index)[0]).collect()
    }

    /// The mesh in `pose`, mm.
    pub fn posed(&self, pose: &Pose) -> Mesh {
        let Some(shape) = self.shapes.get(pose.shape) else {
            return Mesh::default();
        };
        let (positions, normals) = (0..shape.positions.len())
            .into_par_iter()
            .map(|index| {
                let [p, n] = self.vertex(pose, index);
                (p, n)
            })
            .unzip();
        Mesh {
            positions,
            normals,
            uvs: shape.uvs.clone(),
            triangles: shape.triangles.clone(),
        }
    }

    /// The clip called `name`, or without one the first, if the model has any.
    ///
    /// # Errors
    /// No clip is called so; the message lists those there are. `place` names the file.
    pub fn clip(&self, name: Option<&str>, place: &str) -> Result<Option<&Clip>, Error> {
        let clips = self.rig.as_ref().map_or(&[][..], |rig| &rig.clips);
        let Some(name) = name else {
            return Ok(clips.first());
        };
        let found = clips.iter().find(|clip| clip.name == name);
        found.map(Some).ok_or_else(|| {
            let names: Vec<&str> = clips.iter().map(|clip| clip.name.as_str()).collect();
            let problem = match names[..] {
                [] => "it has no clips; drop it, or name a file that is animated".to_owned(),
                _ => super::names::remedy(name, &names),
            };
            Error::of(place, format!("no clip is called \"{name}\"; {problem}"))
        })
    }
}
