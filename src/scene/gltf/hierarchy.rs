//! The nodes that move and place what is drawn.

use super::super::Error;
use super::super::model::{Local, Node, Parts};
use super::container::Source;
use super::{EXPORT_ANEW, called};
use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf::json;

/// Nodes of the file in an order that puts parents before their children.
pub(super) struct Hierarchy {
    /// The nodes of the scene, those its skins need, and what they hang on.
    pub nodes: Vec<Node>,
    /// Where each node of the file is among `nodes`, if it is.
    pub places: Vec<Option<usize>>,
    /// The file's indices of the nodes in the scene, ascending.
    pub drawn: Vec<usize>,
    /// Where each of `nodes` is at rest, in the scene.
    pub rest: Vec<DAffine3>,
}

impl Hierarchy {
    /// Reads it off the default scene, else the first, else all nodes.
    pub fn of(source: &Source) -> Result<Hierarchy, Error> {
        let all = &source.root.nodes;
        let parents = parents(source)?;
        let order = order(source, &parents)?;
        let drawn = drawn(source, &parents, &order)?;
        let mut needed = drawn.clone();
        for (index, node) in all.iter().enumerate() {
            let Some(skin) = node.skin.filter(|_| drawn[index]) else {
                continue;
            };
            // What is wrong with a skin is said where it is read.
            let joints = source.root.skins.get(skin.value()).map(|skin| &skin.joints);
            for joint in joints.into_iter().flatten() {
                if let Some(needed) = needed.get_mut(joint.value()) {
                    *needed = true;
                }
            }
        }
        for &index in order.iter().rev() {
            if let Some(parent) = parents[index]
                && needed[index]
            {
                needed[parent] = true;
            }
        }

        let mut hierarchy = Hierarchy {
            nodes: Vec::new(),
            places: vec![None; all.len()],
            drawn: (0..all.len()).filter(|&index| drawn[index]).collect(),
            rest: Vec::new(),
        };
        for index in order.into_iter().filter(|&index| needed[index]) {
            let local = local(&all[index])
                .map_err(|problem| source.fault(&format!("{}: {problem}", label(source, index))))?;
            let parent = parents[index].and_then(|parent| hierarchy.places[parent]);
            let above = parent.map_or(DAffine3::IDENTITY, |parent| hierarchy.rest[parent]);
            hierarchy.places[index] = Some(hierarchy.nodes.len());
            hierarchy.rest.push(above * local.affine());
            hierarchy.nodes.push(Node {
                name: all[index].name.clone().unwrap_or_default(),
                parent,
                local,
                first_weight: 0,
                weights: Vec::new(),
            });
        }
        Ok(hierarchy)
    }
}

/// A node of the file, for messages.
pub(super) fn label(source: &Source, index: usize) -> String {
    let node = source.root.nodes.get(index);
    called("node", index, node.and_then(|node| node.name.as_ref()))
}

/// The parent of each node of the file.
fn parents(source: &Source) -> Result<Vec<Option<usize>>, Error> {
    let all = &source.root.nodes;
    let mut parents = vec![None; all.len()];
    for (index, node) in all.iter().enumerate() {
        for child in node.children.iter().flatten() {
            let Some(parent) = parents.get_mut(child.value()) else {
                return Err(source.fault(&format!(
                    "{} has node {child} as a child, and there are {} nodes; {EXPORT_ANEW}",
                    label(source, index),
                    all.len()
                )));
            };
            if let Some(other) = parent.replace(index) {
                return Err(source.fault(&format!(
                    "{} is a child of node {other} and of node {index}: a node has one parent; {EXPORT_ANEW}",
                    label(source, child.value()),
                )));
            }
        }
    }
    Ok(parents)
}

/// All nodes, parents before their children.
fn order(source: &Source, parents: &[Option<usize>]) -> Result<Vec<usize>, Error> {
    let mut order: Vec<usize> = (0..parents.len())
        .filter(|&i| parents[i].is_none())
        .collect();
    let mut next = 0;
    while let Some(&index) = order.get(next) {
        let children = source.root.nodes[index].children.iter().flatten();
        order.extend(children.map(|child| child.value()));
        next += 1;
    }
    if order.len() == parents.len() {
        return Ok(order);
    }
    // One parent each, so that what no root leads to hangs on a ring.
    let mut reached = vec![false; parents.len()];
    for &index in &order {
        reached[index] = true;
    }
    let ring = reached.iter().position(|&reached| !reached).unwrap_or(0);
    Err(source.fault(&format!(
        "{} hangs on a ring of nodes, each the child of another; {EXPORT_ANEW}",
        label(source, ring)
    )))
}

/// Whether each node is in the scene.
fn drawn(source: &Source, parents: &[Option<usize>], order: &[usize]) -> Result<Vec<bool>, Error> {
    let root = &source.root;
    let scene = match root.scene {
        Some(index) => Some(root.scenes.get(index.value()).ok_or_else(|| {
            source.fault(&format!(
                "its default scene is {index}, and there are {}; {EXPORT_ANEW}",
                root.scenes.len()
            ))
        })?),
        None => root.scenes.first(),
    };
    let Some(scene) = scene else {
        return Ok(vec![true; root.nodes.len()]);
    };
    let mut drawn = vec![false; root.nodes.len()];
    for node in &scene.nodes {
        let count = drawn.len();
        let Some(drawn) = drawn.get_mut(node.value()) else {
            return Err(source.fault(&format!(
                "its scene has node {node}, and there are {count} nodes; {EXPORT_ANEW}"
            )));
        };
        *drawn = true;
    }
    for &index in order {
        drawn[index] |= parents[index].is_some_and(|parent| drawn[parent]);
    }
    Ok(drawn)
}

fn local(node: &json::Node) -> Result<Local, String> {
    if let Some(matrix) = node.matrix {
        let affine = affine(&matrix.map(f64::from))
            .map_err(|problem| format!("its matrix {problem}; {EXPORT_ANEW}"))?;
        return Ok(Local::Matrix(affine));
    }
    let vector = |values: Option<[f32; 3]>, otherwise, what| {
        let vector = values.map_or(otherwise, |v| DVec3::from_array(v.map(f64::from)));
        if vector.is_finite() {
            Ok(vector)
        } else {
            Err(format!("its {what} is not finite; {EXPORT_ANEW}"))
        }
    };
    let rotation = match node.rotation {
        Some(rotation) => unit(rotation.0.map(f64::from))
            .ok_or_else(|| format!("its rotation is no unit quaternion; {EXPORT_ANEW}"))?,
        None => DQuat::IDENTITY,
    };
    Ok(Local::Parts(Parts {
        translation: vector(node.translation, DVec3::ZERO, "translation")?,
        rotation,
        scale: vector(node.scale, DVec3::ONE, "scale")?,
    }))
}

/// The rotation by a quaternion that is a unit but for rounding; none for zero and what is not finite.
pub(super) fn unit(quaternion: [f64; 4]) -> Option<DQuat> {
    let quaternion = DQuat::from_array(quaternion);
    let length = quaternion.length();
    (length > 0.0 && length.is_finite()).then(|| quaternion * length.recip())
}

/// A matrix given column by column. A problem reads on from what it is the matrix of.
pub(super) fn affine(columns: &[f64; 16]) -> Result<DAffine3, &'static str> {
    let matrix = DMat4::from_cols_array(columns);
    if !matrix.is_finite() {
        return Err("is not finite");
    }
    // Exporters round.
    let last = matrix.row(3) - glam::DVec4::W;
    if last.abs().max_element() > 1e-3 {
        return Err("is a projection, with a last row other than 0 0 0 1");
    }
    Ok(DAffine3::from_mat4(matrix))
}
