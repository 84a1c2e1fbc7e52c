//! glTF 2.0, as .gltf and .glb: meshes, skins, morph targets and animations.
//!
//! Everything drawn in the default scene becomes one mesh. Where a clip moves any of it, its rig comes along: each vertex
//! stays in the space of what it is bound to, the joints of a skin or its own node. Where none does, it is posed once
//! and for all. Of materials the base colour is read; textures, cameras and lights are not.
//!
//! The [specification] is cited as glTF 2.0. A file is untrusted: indices and extents are checked where they are used.
//!
//! [specification]: https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html

mod accessor;
mod animation;
mod body;
mod container;
mod hierarchy;
mod primitive;
#[cfg(test)]
mod tests;

use super::model::{Model, Rig};
use super::{Error, Mesh};
use body::Body;
use container::Source;
use glam::DVec3;
use hierarchy::Hierarchy;
use std::path::Path;

/// The remedy for what only the exporter can have got wrong.
const EXPORT_ANEW: &str = "export it anew";

/// Loads a model, in the file's own unit (metres, by the specification).
///
/// Normals that the file lacks are computed. A model that no clip moves comes without a rig and without triangles that
/// have no area; of one that moves, only triangles that repeat a vertex are dropped.
///
/// # Errors
/// The file or one of its buffers cannot be read, is no glTF 2.0, requires an extension that is not supported, has no
/// triangles in its scene, or contradicts itself. The message names the place in it.
pub fn load(path: &Path) -> Result<Model, Error> {
    let bytes = super::bytes::read(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    parse(&bytes, &path.display().to_string(), Some(folder))
}

/// Parses the bytes of a .gltf or a .glb; `name` stands for the file in messages. Buffers in files of their own are
/// looked for in `folder`, and refused without one.
///
/// # Errors
/// As [`load`].
pub fn parse(bytes: &[u8], name: &str, folder: Option<&Path>) -> Result<Model, Error> {
    if bytes.is_empty() {
        return Err(Error::of(name, "the file is empty; export it anew"));
    }
    let source = Source::open(bytes, name, folder)?;
    let mut hierarchy = Hierarchy::of(&source)?;
    let mut body = Body::default();
    for node in hierarchy.drawn.clone() {
        body.add(&source, &mut hierarchy, node)?;
    }
    let colors = body.has_material.then(|| std::mem::take(&mut body.colors));
    let (mesh, rig) = body.finish();
    if mesh.triangles.is_empty() {
        let in_scene = |&node: &usize| source.root.nodes[node].mesh.is_some();
        let problem = if hierarchy.drawn.iter().any(in_scene) {
            "its meshes have no triangles; export them with their faces"
        } else {
            "its scene has no meshes; put a mesh into the default scene and export it anew"
        };
        return Err(source.fault(problem));
    }
    let mut clips = animation::clips(&source, &hierarchy)?;
    if !clips
        .iter()
        .any(|clip| animation::moves(clip, &hierarchy, &rig.joints))
    {
        clips.clear();
    }

    let mut model = Model {
        shapes: vec![mesh],
        rig: Some(Rig {
            nodes: hierarchy.nodes,
            clips,
            ..rig
        }),
        base_color: None,
    };
    let mut rest = model.posed(&model.pose(1.0, 0, None, 0.0));
    if let Some(vertex) = rest.positions.iter().position(|p| !p.is_finite()) {
        return Err(source.fault(&format!(
            "vertex {vertex} of its {} lies at infinity, once its nodes have placed it; \
             check their scales and export it anew",
            rest.positions.len()
        )));
    }
    model.base_color = colors.and_then(|colors| average(&rest, &colors));
    if model.rig.as_ref().is_some_and(|rig| rig.clips.is_empty()) {
        let dropped = rest.drop_degenerate();
        if dropped > 0 {
            tracing::debug!("{name}: {dropped} triangles without area dropped");
        }
        if rest.triangles.is_empty() {
            return Err(source.fault(
                "no triangle has any area (all vertices lie on a point or a line); \
                 check the scale of the export",
            ));
        }
        rest.complete_normals();
        model.shapes = vec![rest];
        model.rig = None;
    }
    tracing::info!(
        "{name}: {} vertices, {} triangles, {} joints, {} clips",
        model
            .shapes
            .iter()
            .map(|s| s.positions.len())
            .sum::<usize>(),
        model
            .shapes
            .iter()
            .map(|s| s.triangles.len())
            .sum::<usize>(),
        model.rig.as_ref().map_or(0, |rig| rig.joints.len()),
        model.rig.as_ref().map_or(0, |rig| rig.clips.len())
    );
    Ok(model)
}

/// The mean of the primitives' colours by area, where each has a number of the triangles in turn.
fn average(mesh: &Mesh, colors: &[(usize, DVec3)]) -> Option<DVec3> {
    let mut corners = mesh.corners();
    let (mut sum, mut total) = (DVec3::ZERO, 0.0);
    for &(count, color) in colors {
        let triangles = corners.by_ref().take(count);
        let area: f64 = triangles
            .map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length())
            .sum();
        sum += area * color;
        total += area;
    }
    if total > 0.0 && total.is_finite() {
        Some(sum / total)
    } else {
        // What is folded up at rest has some colour all the same.
        colors.first().map(|&(_, color)| color)
    }
}

/// An element of the file for messages: its kind, its index in the JSON, and its name if it has one.
fn called(kind: &str, index: usize, name: Option<&String>) -> String {
    match name {
        Some(name) if !name.is_empty() => format!("{kind} {index} {name:?}"),
        _ => format!("{kind} {index}"),
    }
}
