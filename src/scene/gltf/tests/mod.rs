//! Files built in memory.

mod bad;
mod cases;
mod motion;
mod shapes;

use crate::scene::{Mesh, Model};
use base64::Engine as _;
use glam::DVec3;
use serde_json::{Value, json};

const BYTE: u32 = 5120;
const UNSIGNED_BYTE: u32 = 5121;
const SHORT: u32 = 5122;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

/// Corners of a tetrahedron with its right angle at the origin.
const TETRAHEDRON: [f32; 12] = [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.];
/// Its faces, outward.
const FACES: [u8; 12] = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];
/// The only node of a file.
const ONE_NODE: &str = "a node that holds mesh 0";

/// A file in the making: JSON and the bytes of buffer 0.
struct Builder {
    json: Value,
    bytes: Vec<u8>,
}

impl Builder {
    /// A file whose scene holds node 0.
    fn new() -> Builder {
        let json = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
            "buffers": [{"byteLength": 0}],
        });
        Builder {
            json,
            bytes: Vec::new(),
        }
    }

    /// Appends to a list of the JSON; returns the index there.
    fn push(&mut self, list: &str, value: Value) -> usize {
        if self.json[list].is_null() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().expect("a list");
        list.push(value);
        list.len() - 1
    }

    /// A view of new bytes.
    fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        self.json["buffers"][0]["byteLength"] = self.bytes.len().into();
        self.push(
            "bufferViews",
            json!({"buffer": 0, "byteOffset": start, "byteLength": bytes.len()}),
        )
    }

    /// An accessor of new bytes.
    fn accessor(&mut self, shape: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": component, "count": count, "type": shape}),
        )
    }

    fn floats(&mut self, shape: &str, values: &[f32]) -> usize {
        let count = values.len() / width(shape);
        self.accessor(shape, FLOAT, count, &floats(values))
    }

    /// A mesh of one primitive of the tetrahedron; returns its index.
    fn tetrahedron(&mut self) -> usize {
        let positions = self.floats("VEC3", &TETRAHEDRON);
        let indices = self.accessor("SCALAR", UNSIGNED_BYTE, 12, &FACES);
        let primitive = json!({"attributes": {"POSITION": positions}, "indices": indices});
        self.push("meshes", json!({"name": "Tet", "primitives": [primitive]}))
    }

    /// A tetrahedron on node 0, with `more` in the node.
    fn one(more: Value) -> Builder {
        let mut file = Builder::new();
        file.tetrahedron();
        let mut node = json!({"name": ONE_NODE, "mesh": 0});
        merge(&mut node, more);
        file.push("nodes", node);
        file
    }

    /// A clip with one channel.
    fn clip(&mut self, node: usize, path: &str, how: &str, times: &[f32], values: &[f32]) -> usize {
        let input = self.floats("SCALAR", times);
        let shape = match path {
            "rotation" => "VEC4",
            "weights" => "SCALAR",
            _ => "VEC3",
        };
        let output = self.floats(shape, values);
        self.push(
            "animations",
            json!({
                "channels": [{"sampler": 0, "target": {"node": node, "path": path}}],
                "samplers": [{"input": input, "output": output, "interpolation": how}],
            }),
        )
    }

    /// A clip that moves `node` from the origin along x by one unit a second.
    fn drift(&mut self, node: usize) -> usize {
        let values = [0., 0., 0., 2., 0., 0.];
        self.clip(node, "translation", "LINEAR", &[0., 2.], &values)
    }

    fn glb(&self) -> Vec<u8> {
        let mut json = self.json.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut binary = self.bytes.clone();
        binary.resize(binary.len().next_multiple_of(4), 0);
        let length = 28 + json.len() + binary.len();
        let mut file = b"glTF".to_vec();
        for number in [2, length, json.len()] {
            file.extend((number as u32).to_le_bytes());
        }
        file.extend(b"JSON");
        file.extend(json);
        file.extend((binary.len() as u32).to_le_bytes());
        file.extend(b"BIN\0");
        file.extend(binary);
        file
    }

    /// As a .gltf whose buffer lies at `uri`.
    fn gltf(&self, uri: &str) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"][0]["uri"] = uri.into();
        json.to_string().into_bytes()
    }

    fn data_uri(&self) -> String {
        let data = base64::engine::general_purpose::STANDARD.encode(&self.bytes);
        format!("data:application/octet-stream;base64,{data}")
    }

    fn model(&self) -> Model {
        super::parse(&self.glb(), "good.glb", None).expect("a good file")
    }

    fn fault(&self) -> String {
        fault(&self.glb())
    }
}

fn fault(bytes: &[u8]) -> String {
    let fault = super::parse(bytes, "bad.glb", None).expect_err("a bad file");
    fault.to_string()
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn width(shape: &str) -> usize {
    match shape {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "MAT4" => 16,
        _ => 4,
    }
}

fn merge(value: &mut Value, more: Value) {
    for (key, more) in more.as_object().expect("an object") {
        value[key] = more.clone();
    }
}

/// At rest, or at `time` (s) of the first clip.
fn posed(model: &Model, time: Option<f64>) -> Mesh {
    let clip = model.rig.as_ref().and_then(|rig| rig.clips.first());
    let clip = time.map(|_| clip.expect("a clip"));
    model.posed(&model.pose(1.0, 0, clip, time.unwrap_or(0.0)))
}

/// The volume that its faces enclose.
fn volume(mesh: &Mesh) -> f64 {
    mesh.corners()
        .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
        .sum()
}

#[track_caller]
fn close(a: DVec3, b: DVec3) {
    // What f32 leaves of numbers of order 10.
    assert!(a.distance(b) < 1e-5, "{a} is not {b}");
}
