//! Binary glTF 2.0: one skinned and morphing mesh with its clips.

use glam::{Mat4, Quat, Vec3};
use serde_json::{Value, json};

use crate::betta::rig::{Morph, Rig, Skin};
use crate::mesh::Mesh;

/// How a clip runs between its keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// Straight, or along the great arc.
    Linear,
    /// A cubic Hermite spline: each key has an in-tangent, a value, an out-tangent.
    CubicSpline,
}

/// What a channel moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// A joint's rotation, as x, y, z, w.
    Rotation(usize),
    /// A joint's translation.
    Translation(usize),
    /// The weights of the morph targets.
    Weights,
}

/// The keys of one target.
#[derive(Clone, Debug)]
pub struct Channel {
    /// What it moves.
    pub target: Target,
    /// Values of all keys, with tangents where the clip is a spline.
    pub values: Vec<f32>,
}

/// One animation.
#[derive(Clone, Debug)]
pub struct Clip {
    /// Its name.
    pub name: String,
    /// Times of the keys, s.
    pub times: Vec<f32>,
    /// How it runs between them.
    pub interpolation: Interpolation,
    /// What it moves.
    pub channels: Vec<Channel>,
}

impl Clip {
    /// The numbers of `channel` at key `k`: in-tangent, value, out-tangent.
    fn key<'a>(&self, channel: &'a Channel, k: usize) -> [&'a [f32]; 3] {
        let width = channel.values.len() / self.times.len();
        let key = &channel.values[k * width..][..width];
        match self.interpolation {
            Interpolation::Linear => [key; 3],
            Interpolation::CubicSpline => {
                let n = width / 3;
                [&key[..n], &key[n..2 * n], &key[2 * n..]]
            }
        }
    }

    /// The value of `channel` at the clip's first and last key.
    pub fn ends<'a>(&self, channel: &'a Channel) -> [&'a [f32]; 2] {
        [0, self.times.len() - 1].map(|k| self.key(channel, k)[1])
    }

    /// The value of `channel` at `time`, as the specification of glTF has it.
    pub fn sample(&self, channel: &Channel, time: f32) -> Vec<f32> {
        let last = self.times.len() - 1;
        let k = self.times.partition_point(|&t| t <= time).clamp(1, last) - 1;
        let step = self.times[k + 1] - self.times[k];
        let t = ((time - self.times[k]) / step).clamp(0.0, 1.0);
        let [_, a, out] = self.key(channel, k);
        let [into, b, _] = self.key(channel, k + 1);
        let (t2, t3) = (t * t, t * t * t);
        let turns = matches!(channel.target, Target::Rotation(_));
        let quaternion = |v: &[f32]| Quat::from_xyzw(v[0], v[1], v[2], v[3]);
        match self.interpolation {
            Interpolation::Linear if turns => {
                quaternion(a).slerp(quaternion(b), t).to_array().to_vec()
            }
            Interpolation::Linear => a.iter().zip(b).map(|(a, b)| a + (b - a) * t).collect(),
            Interpolation::CubicSpline => {
                let mixed: Vec<f32> = (0..a.len())
                    .map(|i| {
                        a[i] * (2.0 * t3 - 3.0 * t2 + 1.0)
                            + step * out[i] * (t3 - 2.0 * t2 + t)
                            + b[i] * (3.0 * t2 - 2.0 * t3)
                            + step * into[i] * (t3 - t2)
                    })
                    .collect();
                if turns {
                    quaternion(&mixed).normalize().to_array().to_vec()
                } else {
                    mixed
                }
            }
        }
    }
}

/// Everything that goes into the file.
pub struct Model<'a> {
    /// A name for its nodes.
    pub name: &'a str,
    /// The surface at rest.
    pub mesh: &'a Mesh,
    /// Its shading normals.
    pub normals: &'a [Vec3],
    /// Its skeleton.
    pub rig: &'a Rig,
    /// What its vertices follow.
    pub skin: &'a Skin,
    /// Its morph targets.
    pub morphs: &'a [Morph],
    /// Its clips.
    pub clips: &'a [Clip],
    /// Linear colour of its material.
    pub colour: [f32; 3],
    /// Roughness of its material.
    pub roughness: f32,
}

const FLOAT: u32 = 5126;
const UNSIGNED_BYTE: u32 = 5121;
const UNSIGNED_SHORT: u32 = 5123;
const ARRAY_BUFFER: u32 = 34_962;
const ELEMENT_ARRAY_BUFFER: u32 = 34_963;

/// The binary chunk and the lists that describe it.
#[derive(Default)]
struct Store {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

fn floats(values: impl IntoIterator<Item = f32>) -> Vec<u8> {
    values.into_iter().flat_map(f32::to_le_bytes).collect()
}

fn shorts(values: impl IntoIterator<Item = u16>) -> Vec<u8> {
    values.into_iter().flat_map(u16::to_le_bytes).collect()
}

/// Least and largest of each coordinate.
fn range(points: &[Vec3]) -> [[f32; 3]; 2] {
    let lo = points.iter().fold(Vec3::INFINITY, |m, &p| m.min(p));
    let hi = points.iter().fold(Vec3::NEG_INFINITY, |m, &p| m.max(p));
    [lo.to_array(), hi.to_array()]
}

impl Store {
    /// Appends `bytes`, starting on a multiple of four.
    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = json!({
            "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len(),
        });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.bytes.extend(bytes);
        self.views.push(view);
        self.views.len() - 1
    }

    fn accessor(
        &mut self,
        bytes: &[u8],
        target: Option<u32>,
        component: u32,
        kind: &str,
        count: usize,
    ) -> usize {
        let view = self.view(bytes, target);
        self.accessors.push(json!({
            "bufferView": view, "componentType": component, "type": kind, "count": count,
        }));
        self.accessors.len() - 1
    }

    fn vectors(&mut self, values: &[Vec3]) -> usize {
        let bytes = floats(values.iter().flat_map(|v| v.to_array()));
        self.accessor(&bytes, Some(ARRAY_BUFFER), FLOAT, "VEC3", values.len())
    }

    fn numbers(&mut self, values: &[f32], kind: &str, width: usize) -> usize {
        self.accessor(
            &floats(values.iter().copied()),
            None,
            FLOAT,
            kind,
            values.len() / width,
        )
    }

    /// Only those of `values` that are not zero.
    fn sparse(&mut self, values: &[Vec3]) -> usize {
        let some: Vec<usize> = (0..values.len())
            .filter(|&i| values[i].length() > 1e-4)
            .collect();
        let mut accessor = json!({
            "componentType": FLOAT, "type": "VEC3", "count": values.len(),
        });
        let mut kept = vec![Vec3::ZERO];
        if !some.is_empty() {
            let indices = self.view(&shorts(some.iter().map(|&i| i as u16)), None);
            let deltas = floats(some.iter().flat_map(|&i| values[i].to_array()));
            let deltas = self.view(&deltas, None);
            accessor["sparse"] = json!({
                "count": some.len(),
                "indices": { "bufferView": indices, "componentType": UNSIGNED_SHORT },
                "values": { "bufferView": deltas },
            });
            kept.extend(some.iter().map(|&i| values[i]));
        }
        let [lo, hi] = range(&kept);
        accessor["min"] = json!(lo);
        accessor["max"] = json!(hi);
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }
}

/// The mesh's node; joints follow it.
const MESH_NODE: usize = 0;

/// The model as the bytes of a `.glb` file. Fails if it has more vertices than
/// 16-bit indices can tell apart.
pub fn write(model: &Model) -> Result<Vec<u8>, String> {
    let count = model.mesh.positions.len();
    // The largest index would mean a restart.
    if count >= usize::from(u16::MAX) {
        return Err(format!("{count} vertices are too many for 16-bit indices"));
    }
    let mut store = Store::default();
    let indices = shorts(model.mesh.triangles.iter().flatten().map(|&i| i as u16));
    let indices = store.accessor(
        &indices,
        Some(ELEMENT_ARRAY_BUFFER),
        UNSIGNED_SHORT,
        "SCALAR",
        model.mesh.triangles.len() * 3,
    );
    let positions = store.vectors(&model.mesh.positions);
    let [lo, hi] = range(&model.mesh.positions);
    store.accessors[positions]["min"] = json!(lo);
    store.accessors[positions]["max"] = json!(hi);
    let normals = store.vectors(model.normals);
    let joints: Vec<u8> = model.skin.joints.iter().flatten().copied().collect();
    let joints = store.accessor(&joints, Some(ARRAY_BUFFER), UNSIGNED_BYTE, "VEC4", count);
    let weights = shorts(model.skin.weights.iter().flatten().copied());
    let weights = store.accessor(&weights, Some(ARRAY_BUFFER), UNSIGNED_SHORT, "VEC4", count);
    store.accessors[weights]["normalized"] = json!(true);
    let targets: Vec<Value> = model
        .morphs
        .iter()
        .map(|m| {
            json!({
                "POSITION": store.sparse(&m.positions),
                "NORMAL": store.sparse(&m.normals),
            })
        })
        .collect();
    let inverse: Vec<f32> = model
        .rig
        .joints
        .iter()
        .flat_map(|j| Mat4::from_translation(-j.at).to_cols_array())
        .collect();
    let inverse = store.numbers(&inverse, "MAT4", 16);
    let animations: Vec<Value> = model
        .clips
        .iter()
        .map(|clip| animation(&mut store, clip))
        .collect();
    let node_of = |joint: usize| MESH_NODE + 1 + joint;
    let mut nodes = vec![json!({ "name": model.name, "mesh": 0, "skin": 0 })];
    for (i, joint) in model.rig.joints.iter().enumerate() {
        let from = joint.parent.map_or(Vec3::ZERO, |p| model.rig.joints[p].at);
        let mut node = json!({
            "name": joint.name, "translation": (joint.at - from).to_array(),
        });
        let children: Vec<usize> = (0..model.rig.joints.len())
            .filter(|&c| model.rig.joints[c].parent == Some(i))
            .map(node_of)
            .collect();
        if !children.is_empty() {
            node["children"] = json!(children);
        }
        nodes.push(node);
    }
    let [r, g, b] = model.colour;
    let names: Vec<&str> = model.morphs.iter().map(|m| m.name).collect();
    let document = json!({
        "asset": {
            "version": "2.0",
            "generator": "marmor sculptor",
            "copyright": "MIT OR Apache-2.0",
        },
        "scene": 0,
        "scenes": [{ "nodes": [MESH_NODE, node_of(0)] }],
        "nodes": nodes,
        "meshes": [{
            "name": model.name,
            "primitives": [{
                "attributes": {
                    "POSITION": positions,
                    "NORMAL": normals,
                    "JOINTS_0": joints,
                    "WEIGHTS_0": weights,
                },
                "indices": indices,
                "material": 0,
                "targets": targets,
            }],
            "weights": vec![0.0; names.len()],
            "extras": { "targetNames": names },
        }],
        "skins": [{
            "inverseBindMatrices": inverse,
            "skeleton": node_of(0),
            "joints": (0..model.rig.joints.len()).map(node_of).collect::<Vec<_>>(),
        }],
        "materials": [{
            "name": model.name,
            "pbrMetallicRoughness": {
                "baseColorFactor": [r, g, b, 1.0],
                "metallicFactor": 0.0,
                "roughnessFactor": model.roughness,
            },
            "doubleSided": false,
        }],
        "animations": animations,
        "accessors": store.accessors,
        "bufferViews": store.views,
        "buffers": [{ "byteLength": store.bytes.len() }],
    });
    Ok(container(document.to_string().into_bytes(), store.bytes))
}

fn animation(store: &mut Store, clip: &Clip) -> Value {
    let times = store.numbers(&clip.times, "SCALAR", 1);
    let last = clip.times[clip.times.len() - 1];
    store.accessors[times]["min"] = json!([clip.times[0]]);
    store.accessors[times]["max"] = json!([last]);
    let interpolation = match clip.interpolation {
        Interpolation::Linear => "LINEAR",
        Interpolation::CubicSpline => "CUBICSPLINE",
    };
    let mut samplers = Vec::new();
    let mut channels = Vec::new();
    for channel in &clip.channels {
        let (node, path, kind, width) = match channel.target {
            Target::Rotation(joint) => (joint + 1, "rotation", "VEC4", 4),
            Target::Translation(joint) => (joint + 1, "translation", "VEC3", 3),
            Target::Weights => (MESH_NODE, "weights", "SCALAR", 1),
        };
        let output = store.numbers(&channel.values, kind, width);
        channels.push(json!({
            "sampler": samplers.len(), "target": { "node": node, "path": path },
        }));
        samplers.push(json!({
            "input": times, "output": output, "interpolation": interpolation,
        }));
    }
    json!({ "name": clip.name, "samplers": samplers, "channels": channels })
}

/// The two chunks of a binary glTF, each padded to four bytes.
fn container(mut text: Vec<u8>, mut binary: Vec<u8>) -> Vec<u8> {
    text.resize(text.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let size = 12 + 8 + text.len() + 8 + binary.len();
    let mut file = Vec::with_capacity(size);
    file.extend(b"glTF");
    for word in [2, size as u32] {
        file.extend(word.to_le_bytes());
    }
    for (kind, chunk) in [(b"JSON", text), (b"BIN\0", binary)] {
        file.extend((chunk.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(chunk);
    }
    file
}
