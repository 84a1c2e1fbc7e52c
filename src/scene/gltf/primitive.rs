//! One primitive: its triangles, what binds its vertices to joints, and its morph targets.

use super::super::Error;
use super::EXPORT_ANEW;
use super::accessor::{ATTRIBUTE, INDEX, JOINT, WEIGHT, Wanted};
use super::container::Source;
use glam::DVec3;
use gltf::json::Index;
use gltf::json::accessor::{Accessor, Type};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;

/// Sets of four influences that are read.
const SETS: usize = 2;

/// Influences of one vertex: joints of its skin and weights that sum to 1, the unused ones zero.
pub(super) type Influences = [(usize, f64); 4 * SETS];

/// A primitive's vertices and triangles, in its mesh's own space.
#[derive(Default)]
pub(super) struct Part {
    pub positions: Vec<DVec3>,
    /// As many; zero where the file has none.
    pub normals: Vec<DVec3>,
    /// As many.
    pub uvs: Vec<[f32; 2]>,
    pub triangles: Vec<[u32; 3]>,
    /// As many; none without a skin.
    pub influences: Vec<Influences>,
    /// Of each morph target, what it adds to each position and normal.
    pub targets: Vec<[Vec<DVec3>; 2]>,
}

impl Part {
    /// Reads a primitive; none where it has no triangles by its nature. `place` names it; `joints` is how many its skin has.
    pub fn read(
        source: &Source,
        primitive: &Primitive,
        place: &str,
        joints: Option<usize>,
    ) -> Result<Option<Part>, Error> {
        let mode = match primitive.mode {
            Checked::Valid(mode) => mode,
            Checked::Invalid => {
                let problem = format!("{place}: its mode is none of glTF 2.0; {EXPORT_ANEW}");
                return Err(source.fault(&problem));
            }
        };
        let attribute = |semantic| {
            let index = primitive.attributes.get(&Checked::Valid(semantic));
            index.copied()
        };
        let Some(positions) = attribute(Semantic::Positions) else {
            tracing::debug!("{}: {place}: no positions; skipped", source.name);
            return Ok(None);
        };
        if !matches!(
            mode,
            Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan
        ) {
            tracing::debug!("{}: {place}: points or lines; skipped", source.name);
            return Ok(None);
        }

        let at = |what: &str| format!("{place}, {what}");
        let positions = source.vectors(positions, &at("POSITION"), ATTRIBUTE, None)?;
        let count = positions.len();
        let normals = match attribute(Semantic::Normals) {
            Some(index) => normals(source, index, &at("NORMAL"), count)?,
            None => vec![DVec3::ZERO; count],
        };
        let uvs = match attribute(Semantic::TexCoords(0)) {
            Some(index) => uvs(source, index, &at("TEXCOORD_0"), count)?,
            None => vec![[0.0; 2]; count],
        };
        let corners = match primitive.indices {
            Some(index) => indices(source, index, &at("indices"), count)?,
            None => (0..count as u32).collect(),
        };
        let influences = match joints {
            Some(joints) => influences(source, attribute, place, count, joints)?,
            None => Vec::new(),
        };
        let mut targets = Vec::new();
        for (number, target) in primitive.targets.iter().flatten().enumerate() {
            let delta = |index: Option<Index<Accessor>>, what: &str| match index {
                Some(index) => {
                    let place = format!("{place}, morph target {number}, {what}");
                    source.vectors(index, &place, ATTRIBUTE, Some(count))
                }
                None => Ok(vec![DVec3::ZERO; count]),
            };
            targets.push([
                delta(target.positions, "POSITION")?,
                delta(target.normals, "NORMAL")?,
            ]);
        }
        Ok(Some(Part {
            positions,
            normals,
            uvs,
            triangles: triangles(mode, &corners),
            influences,
            targets,
        }))
    }
}

/// Triangles of a list, strip or fan (glTF 2.0, 3.7.2.1), without those that repeat a vertex.
fn triangles(mode: Mode, corners: &[u32]) -> Vec<[u32; 3]> {
    let triples: Vec<[u32; 3]> = match mode {
        Mode::TriangleStrip => corners
            .windows(3)
            .enumerate()
            .map(|(i, c)| match i % 2 {
                0 => [c[0], c[1], c[2]],
                _ => [c[0], c[2], c[1]],
            })
            .collect(),
        Mode::TriangleFan => corners
            .windows(2)
            .skip(1)
            .map(|c| [c[0], c[1], corners[0]])
            .collect(),
        _ => corners
            .chunks_exact(3)
            .map(|c| [c[0], c[1], c[2]])
            .collect(),
    };
    let distinct = |&[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
    triples.into_iter().filter(distinct).collect()
}

fn normals(
    source: &Source,
    index: Index<Accessor>,
    place: &str,
    count: usize,
) -> Result<Vec<DVec3>, Error> {
    let wanted = Wanted {
        shape: Type::Vec3,
        components: ATTRIBUTE,
        count: Some(count),
    };
    let numbers = source.numbers(index, place, &wanted)?;
    let normals = numbers.chunks_exact(3).map(DVec3::from_slice);
    // What is no direction is computed from the faces later.
    Ok(normals
        .map(|n| if n.is_finite() { n } else { DVec3::ZERO })
        .collect())
}

fn uvs(
    source: &Source,
    index: Index<Accessor>,
    place: &str,
    count: usize,
) -> Result<Vec<[f32; 2]>, Error> {
    let wanted = Wanted {
        shape: Type::Vec2,
        components: ATTRIBUTE,
        count: Some(count),
    };
    let numbers = source.numbers(index, place, &wanted)?;
    let usable = |v: f64| if v.is_finite() { v as f32 } else { 0.0 };
    let pairs = numbers.chunks_exact(2);
    Ok(pairs.map(|c| [usable(c[0]), usable(c[1])]).collect())
}

fn indices(
    source: &Source,
    index: Index<Accessor>,
    place: &str,
    count: usize,
) -> Result<Vec<u32>, Error> {
    let wanted = Wanted {
        shape: Type::Scalar,
        components: INDEX,
        count: None,
    };
    let numbers = source.numbers(index, place, &wanted)?;
    match numbers.iter().position(|&v| v >= count as f64) {
        None => Ok(numbers.into_iter().map(|v| v as u32).collect()),
        Some(at) => Err(source.fault(&format!(
            "{place} (accessor {index}): element {at} is vertex {}, and there are {count}; {EXPORT_ANEW}",
            numbers[at]
        ))),
    }
}

/// What binds each of `count` vertices to a skin of `joints` joints.
fn influences(
    source: &Source,
    attribute: impl Fn(Semantic) -> Option<Index<Accessor>>,
    place: &str,
    count: usize,
    joints: usize,
) -> Result<Vec<Influences>, Error> {
    let mut influences = vec![[(0, 0.0); 4 * SETS]; count];
    for set in 0..=SETS {
        let number = set as u32;
        let pair = (
            attribute(Semantic::Joints(number)),
            attribute(Semantic::Weights(number)),
        );
        let (indices, weights) = match pair {
            (Some(_), Some(_)) if set == SETS => {
                return Err(source.fault(&format!(
                    "{place}: vertices have more than 8 joints, which is not supported; \
                     limit them to 8, or 4, in the export"
                )));
            }
            (Some(indices), Some(weights)) => (indices, weights),
            (None, None) if set > 0 => break,
            (None, None) => {
                return Err(source.fault(&format!(
                    "{place}: it has a skin, but no JOINTS_0 and WEIGHTS_0; \
                     bind it to the armature, or remove the skin, and export it anew"
                )));
            }
            (indices, _) => {
                let has = if indices.is_some() {
                    "JOINTS"
                } else {
                    "WEIGHTS"
                };
                return Err(source.fault(&format!(
                    "{place}: {has}_{set} comes alone: JOINTS and WEIGHTS go together; {EXPORT_ANEW}"
                )));
            }
        };
        let wanted = |components| Wanted {
            shape: Type::Vec4,
            components,
            count: Some(count),
        };
        let joints_place = format!("{place}, JOINTS_{set}");
        let weights_place = format!("{place}, WEIGHTS_{set}");
        let indices_read = source.numbers(indices, &joints_place, &wanted(JOINT))?;
        let weights_read = source.finite(weights, &weights_place, &wanted(WEIGHT))?;
        let pairs = indices_read.iter().zip(&weights_read).enumerate();
        for (at, (&joint, &weight)) in pairs {
            let vertex = at / 4;
            if weight < 0.0 {
                return Err(source.fault(&format!(
                    "{weights_place} (accessor {weights}): vertex {vertex} has the weight {weight}, below 0; \
                     normalise the weights and export it anew"
                )));
            }
            // What weighs nothing may point anywhere.
            if weight > 0.0 {
                if joint >= joints as f64 {
                    return Err(source.fault(&format!(
                        "{joints_place} (accessor {indices}): vertex {vertex} follows joint {joint}, \
                         and its skin has {joints}; {EXPORT_ANEW}"
                    )));
                }
                influences[vertex][4 * set + at % 4] = (joint as usize, weight);
            }
        }
    }
    for influences in &mut influences {
        let sum: f64 = influences.iter().map(|(_, weight)| weight).sum();
        if sum > 0.0 {
            for (_, weight) in influences.iter_mut() {
                *weight /= sum;
            }
        } else {
            // One stray vertex should not cost the whole mesh; the first joint is most often the root.
            influences[0] = (0, 1.0);
        }
    }
    Ok(influences)
}
