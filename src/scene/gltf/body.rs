//! All that is drawn, as one mesh.

use super::super::model::{Joint, Rig};
use super::super::{Error, Mesh};
use super::accessor::{FLOAT, Wanted};
use super::container::Source;
use super::hierarchy::{Hierarchy, affine, label};
use super::primitive::{Influences, Part};
use super::{EXPORT_ANEW, called};
use glam::{DAffine3, DMat3, DMat4, DVec3};
use gltf::json::accessor::Type;
use gltf::json::{self, Index};
use std::collections::HashMap;

/// What the meshes of the scene's nodes come to.
#[derive(Default)]
pub(super) struct Body {
    /// Their vertices, each in the space that its joints take it from, and their triangles.
    pub mesh: Mesh,
    /// What moves the vertices, but for the nodes and clips.
    pub rig: Rig,
    /// Per primitive: how many triangles it has, and the linear RGB of its material.
    pub colors: Vec<(usize, DVec3)>,
    /// Whether any primitive has a material.
    pub has_material: bool,
    /// Joints and weights of each vertex.
    influences: Vec<Influences>,
    /// Where the joints of each skin start.
    skins: HashMap<usize, usize>,
    /// How many morph weights there are.
    weights: usize,
}

impl Body {
    /// Adds the mesh of a node of the file, if it has one.
    pub fn add(
        &mut self,
        source: &Source,
        hierarchy: &mut Hierarchy,
        node: usize,
    ) -> Result<(), Error> {
        let root = &source.root;
        let Some((json, place)) = root.nodes.get(node).zip(hierarchy.places[node]) else {
            return Ok(());
        };
        let Some(index) = json.mesh else {
            return Ok(());
        };
        let mesh = root.meshes.get(index.value()).ok_or_else(|| {
            source.fault(&format!(
                "{} has mesh {index}, and there are {}; {EXPORT_ANEW}",
                label(source, node),
                root.meshes.len()
            ))
        })?;
        let called = called("mesh", index.value(), mesh.name.as_ref());
        let (first_joint, joints) = match json.skin {
            Some(skin) => {
                let (first, count) = self.skin(source, hierarchy, skin)?;
                (first, Some(count))
            }
            None => {
                self.rig.joints.push(Joint {
                    node: place,
                    inverse_bind: DAffine3::IDENTITY,
                });
                (self.rig.joints.len() - 1, None)
            }
        };
        if self.rig.joints.len() > usize::from(u16::MAX) + 1 {
            return Err(source.fault(
                "it has more than 65536 joints and nodes with meshes; join meshes and export it anew",
            ));
        }

        let mut parts: Vec<Part> = Vec::new();
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let place = format!("{called}, primitive {number}");
            let Some(part) = Part::read(source, primitive, &place, joints)? else {
                continue;
            };
            if let Some(first) = parts.first()
                && first.targets.len() != part.targets.len()
            {
                return Err(source.fault(&format!(
                    "{place}: it has {} morph targets, and others of its mesh have {}; {EXPORT_ANEW}",
                    part.targets.len(),
                    first.targets.len()
                )));
            }
            let color = material(source, primitive.material, &place)?;
            self.has_material |= primitive.material.is_some();
            self.colors.push((part.triangles.len(), color));
            parts.push(part);
        }
        let targets = parts.first().map_or(0, |part| part.targets.len());
        if targets > 0 {
            let (weights, of) = match (&json.weights, &mesh.weights) {
                (Some(weights), _) => (
                    weights.iter().copied().map(f64::from).collect(),
                    label(source, node),
                ),
                (None, Some(weights)) => (weights.iter().copied().map(f64::from).collect(), called),
                (None, None) => (vec![0.0; targets], called),
            };
            if weights.len() != targets || weights.iter().any(|w: &f64| !w.is_finite()) {
                return Err(source.fault(&format!(
                    "{of}: it needs {targets} finite morph weights and has {}; {EXPORT_ANEW}",
                    weights.len()
                )));
            }
            let node = &mut hierarchy.nodes[place];
            node.first_weight = self.weights;
            node.weights = weights;
            self.weights += targets;
        }
        let first_weight = hierarchy.nodes[place].first_weight;
        self.append(source, &hierarchy.rest, parts, first_joint, first_weight)
    }

    /// Where the joints of a skin start among all, and how many they are.
    fn skin(
        &mut self,
        source: &Source,
        hierarchy: &Hierarchy,
        index: Index<json::Skin>,
    ) -> Result<(usize, usize), Error> {
        let skins = &source.root.skins;
        let skin = skins.get(index.value()).ok_or_else(|| {
            source.fault(&format!(
                "a node has skin {index}, and there are {}; {EXPORT_ANEW}",
                skins.len()
            ))
        })?;
        let count = skin.joints.len();
        if let Some(&first) = self.skins.get(&index.value()) {
            return Ok((first, count));
        }
        let called = called("skin", index.value(), skin.name.as_ref());
        if count == 0 {
            return Err(source.fault(&format!("{called} has no joints; {EXPORT_ANEW}")));
        }
        let matrices = match skin.inverse_bind_matrices {
            Some(accessor) => {
                let wanted = Wanted {
                    shape: Type::Mat4,
                    components: FLOAT,
                    count: None,
                };
                let place = format!("{called}, inverseBindMatrices");
                source.numbers(accessor, &place, &wanted)?
            }
            None => DMat4::IDENTITY.to_cols_array().repeat(count),
        };
        let first = self.rig.joints.len();
        let mut columns = matrices.chunks_exact(16);
        for (number, joint) in skin.joints.iter().enumerate() {
            let fault = |problem: String| {
                source.fault(&format!(
                    "{called}, joint {number}: {problem}; {EXPORT_ANEW}"
                ))
            };
            let node = hierarchy.places.get(joint.value()).copied().flatten();
            let node = node.ok_or_else(|| fault(format!("there is no node {joint}")))?;
            let matrix = columns.next().and_then(|c| c.try_into().ok());
            let matrix = matrix.ok_or_else(|| fault("it has no inverse bind matrix".to_owned()))?;
            let inverse_bind = affine(matrix)
                .map_err(|problem| fault(format!("its inverse bind matrix {problem}")))?;
            self.rig.joints.push(Joint { node, inverse_bind });
        }
        self.skins.insert(index.value(), first);
        Ok((first, count))
    }

    /// Adds the primitives of one mesh, whose joints start at `first_joint`. `rest` places the nodes at rest.
    fn append(
        &mut self,
        source: &Source,
        rest: &[DAffine3],
        parts: Vec<Part>,
        first_joint: usize,
        first_weight: usize,
    ) -> Result<(), Error> {
        let mut mesh = Mesh::default();
        let mut influences: Vec<Influences> = Vec::new();
        // Vertex by vertex, target by target.
        let mut morphs: Vec<[DVec3; 2]> = Vec::new();
        let mut targets = 0;
        for part in parts {
            let base = mesh.positions.len() as u32;
            let count = part.positions.len();
            targets = part.targets.len();
            for vertex in 0..count {
                let deltas = part.targets.iter();
                morphs.extend(deltas.map(|[p, n]| [p[vertex], n[vertex]]));
            }
            mesh.positions.extend(part.positions);
            mesh.normals.extend(part.normals);
            mesh.uvs.extend(part.uvs);
            let triangles = part.triangles.into_iter();
            mesh.triangles
                .extend(triangles.map(|t| t.map(|i| base + i)));
            let mut rigid = Influences::default();
            rigid[0].1 = 1.0;
            influences.extend(part.influences);
            influences.resize(mesh.positions.len(), rigid);
        }
        let vertices = self.mesh.positions.len() + mesh.positions.len();
        let largest = vertices.max(self.rig.morphs.len() + morphs.len());
        if u32::try_from(largest).is_err() {
            return Err(source.fault(
                "it has more than 4294967295 vertices or morphs of vertices; decimate the mesh",
            ));
        }

        // Where what moves a vertex mirrors it, triangles are wound the other way (glTF 2.0, 3.7.4). Normals follow by
        // cofactors, which turn over there as well: they are kept inward, as the faces are in the mesh's own space.
        let palette: Vec<DMat3> = self.rig.joints[first_joint..]
            .iter()
            .map(|joint| (rest[joint.node] * joint.inverse_bind).matrix3)
            .collect();
        let mirrored: Vec<bool> = influences
            .iter()
            .map(|influences| {
                let used = influences.iter().filter(|(_, weight)| *weight > 0.0);
                let matrix = used.fold(DMat3::ZERO, |m, &(joint, w)| m + palette[joint] * w);
                matrix.determinant() < 0.0
            })
            .collect();
        for triangle in &mut mesh.triangles {
            let corners = triangle.iter().filter(|&&i| mirrored[i as usize]);
            if corners.count() >= 2 {
                triangle.swap(1, 2);
            }
        }
        for (vertex, normal) in mesh.normals.iter_mut().enumerate() {
            if mirrored[vertex] {
                *normal = -*normal;
                for [_, delta] in &mut morphs[vertex * targets..][..targets] {
                    *delta = -*delta;
                }
            }
        }
        // By itself: other meshes are in spaces of their own, where theirs may coincide with its vertices. A triangle with
        // two corners in one place spans no angle there, and stays for a clip to unfold.
        let triangles = mesh.triangles.clone();
        let positions = &mesh.positions;
        mesh.triangles.retain(|triangle| {
            let [a, b, c] = triangle.map(|i| positions[i as usize]);
            a != b && b != c && c != a
        });
        mesh.complete_normals();
        mesh.triangles = triangles;

        let base = self.mesh.positions.len() as u32;
        for vertex in 0..mesh.positions.len() {
            let first = self.rig.morphs.len() + vertex * targets;
            let range = [first as u32, first_weight as u32, targets as u32];
            self.rig.vertex_morphs.push(range);
        }
        self.rig.morphs.extend(morphs);
        for mut influences in influences {
            for (joint, _) in influences.iter_mut().filter(|(_, weight)| *weight > 0.0) {
                *joint += first_joint;
            }
            self.influences.push(influences);
        }
        self.mesh.positions.extend(mesh.positions);
        self.mesh.normals.extend(mesh.normals);
        self.mesh.uvs.extend(mesh.uvs);
        let triangles = mesh.triangles.into_iter();
        self.mesh
            .triangles
            .extend(triangles.map(|t| t.map(|i| base + i)));
        Ok(())
    }

    /// The mesh, and its rig but for nodes and clips.
    pub fn finish(mut self) -> (Mesh, Rig) {
        let more = |influences: &Influences| influences[4..].iter().any(|(_, w)| *w > 0.0);
        let used = if self.influences.iter().any(more) {
            8
        } else {
            4
        };
        self.rig.influences = used;
        let all = self.influences.iter().flat_map(|i| &i[..used]);
        // add() holds joints to what u16 can name.
        let (joints, weights) = all.map(|&(joint, w)| (joint as u16, w as f32)).unzip();
        self.rig.vertex_joints = joints;
        self.rig.vertex_weights = weights;
        if self.rig.morphs.is_empty() {
            self.rig.vertex_morphs = Vec::new();
        }
        (self.mesh, self.rig)
    }
}

/// Linear RGB of a material; white, as the format's default, without one.
fn material(
    source: &Source,
    index: Option<Index<json::Material>>,
    place: &str,
) -> Result<DVec3, Error> {
    let Some(index) = index else {
        return Ok(DVec3::ONE);
    };
    let material = source.root.materials.get(index.value()).ok_or_else(|| {
        source.fault(&format!(
            "{place}: there is no material {index}; {EXPORT_ANEW}"
        ))
    })?;
    let base = &material.pbr_metallic_roughness;
    if base.base_color_texture.is_some() {
        tracing::debug!("{}: {place}: textures are ignored", source.name);
    }
    let [r, g, b, _] = base.base_color_factor.0.map(f64::from);
    let color = DVec3::new(r, g, b);
    if !color.is_finite() {
        return Err(source.fault(&format!(
            "{}: its base colour is not finite; give it numbers from 0 to 1",
            called("material", index.value(), material.name.as_ref())
        )));
    }
    Ok(color.clamp(DVec3::ZERO, DVec3::ONE))
}
