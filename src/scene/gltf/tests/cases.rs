//! A good file, and what no file may do.

use super::*;

/// A change to a good file, and what its one line must say: the place and the remedy.
pub(super) type Case = (&'static str, fn(&mut Builder), &'static [&'static str]);

/// A morphing mesh of two triangles bound to two joints, with a clip for each property.
pub(super) fn good() -> Builder {
    let mut file = Builder::one(json!({"skin": 0}));
    let joints = file.accessor("VEC4", UNSIGNED_BYTE, 4, &[0, 1, 0, 0].repeat(4));
    let weights = file.floats("VEC4", &[0.5, 0.5, 0., 0.].repeat(4));
    let delta = file.floats("VEC3", &[0.5; 12]);
    let at = file.view(&[1, 0, 3, 0]);
    let sparse = file.push(
        "accessors",
        json!({"componentType": FLOAT, "count": 4, "type": "VEC3", "sparse": {
            "count": 2, "values": {"bufferView": 0},
            "indices": {"bufferView": at, "componentType": UNSIGNED_SHORT},
        }}),
    );
    let primitive = &mut file.json["meshes"][0]["primitives"][0];
    merge(
        &mut primitive["attributes"],
        json!({"JOINTS_0": joints, "WEIGHTS_0": weights}),
    );
    primitive["targets"] = json!([{"POSITION": delta}, {"NORMAL": sparse}]);
    file.push("nodes", json!({"name": "hip", "children": [2]}));
    file.push("nodes", json!({"rotation": [0, 0, 0, 1]}));
    let identity = glam::Mat4::IDENTITY.to_cols_array().repeat(2);
    let inverse = file.floats("MAT4", &identity);
    let skin = json!({"name": "Rig", "joints": [1, 2], "inverseBindMatrices": inverse});
    file.push("skins", skin);
    file.drift(1);
    file.clip(
        2,
        "rotation",
        "CUBICSPLINE",
        &[0., 1.],
        &[0., 0., 0., 1.].repeat(6),
    );
    file.clip(0, "weights", "STEP", &[0., 1.], &[0., 0., 1., 1.]);
    file.json["animations"][0]["name"] = "walk".into();
    file
}

/// An element of the JSON.
fn at<'a>(file: &'a mut Builder, pointer: &str) -> &'a mut Value {
    file.json.pointer_mut(pointer).expect("an element")
}

pub(super) fn set(file: &mut Builder, pointer: &str, value: Value) {
    *at(file, pointer) = value;
}

/// Adds a key to an object of the JSON.
fn add(file: &mut Builder, pointer: &str, key: &str, value: Value) {
    at(file, pointer)[key] = value;
}

/// Overwrites the float `index` of an accessor.
fn poke(file: &mut Builder, pointer: &str, index: usize, value: f32) {
    let start = start(file, pointer) + 4 * index;
    file.bytes[start..start + 4].copy_from_slice(&value.to_le_bytes());
}

/// Where the data of the accessor begins that an element of the JSON refers to.
fn start(file: &mut Builder, pointer: &str) -> usize {
    let number = |value: &Value| value.as_u64().expect("a number") as usize;
    let accessor = number(at(file, pointer));
    let view = number(&file.json["accessors"][accessor]["bufferView"]);
    number(&file.json["bufferViews"][view]["byteOffset"])
}

const POSITION: &str = "/meshes/0/primitives/0/attributes/POSITION";
const JOINTS: &str = "/meshes/0/primitives/0/attributes/JOINTS_0";
const WEIGHTS: &str = "/meshes/0/primitives/0/attributes/WEIGHTS_0";
const ATTRIBUTES: &str = "/meshes/0/primitives/0/attributes";
const PRIMITIVE: &str = "/meshes/0/primitives/0";
const TIMES: &str = "/animations/0/samplers/0/input";
const VALUES: &str = "/animations/0/samplers/0/output";

/// One at a time.
pub(super) const CASES: &[Case] = &[
    // The file.
    (
        "version",
        |f| set(f, "/asset/version", json!("1.0")),
        &["\"1.0\"", "as glTF 2.0"],
    ),
    (
        "no asset",
        |f| set(f, "/asset", json!({})),
        &["JSON", "version", "line 1", "anew"],
    ),
    (
        "draco",
        |f| f.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]),
        &[
            "\"KHR_draco_mesh_compression\"",
            "switch off Draco compression",
        ],
    ),
    (
        "meshopt",
        |f| f.json["extensionsRequired"] = json!(["EXT_meshopt_compression"]),
        &[
            "\"EXT_meshopt_compression\"",
            "switch off meshopt compression",
        ],
    ),
    (
        "another extension",
        |f| f.json["extensionsRequired"] = json!(["KHR_mesh_quantization", "X_\n"]),
        &["\"X_\\n\"", "export it without"],
    ),
    (
        "a wrong type",
        |f| set(f, "/nodes/0/mesh", json!("Tet")),
        &["string \"Tet\"", "line 1"],
    ),
    // Buffers.
    (
        "a short buffer",
        |f| set(f, "/buffers/0/byteLength", json!(1_000_000)),
        &["buffer 0", "1000000 bytes", "cut short", "anew"],
    ),
    (
        "no such file",
        |f| add(f, "/buffers/0", "uri", json!("a.bin")),
        &["buffer 0", "\"a.bin\"", "export it as .glb"],
    ),
    (
        "no base64",
        |f| add(f, "/buffers/0", "uri", json!("data:;base64,a?b")),
        &["buffer 0", "not base64", "anew"],
    ),
    (
        "percent-encoded data",
        |f| add(f, "/buffers/0", "uri", json!("data:text/plain,abc")),
        &["buffer 0", "not in base64", "as .glb"],
    ),
    (
        "a second buffer without data",
        |f| {
            f.push("buffers", json!({"byteLength": 4}));
        },
        &["buffer 1", "neither", "anew"],
    ),
    // Accessors.
    (
        "a view beyond its buffer",
        |f| set(f, "/bufferViews/0/byteLength", json!(100_000)),
        &[
            "mesh 0 \"Tet\", primitive 0, POSITION (accessor 0)",
            "buffer view 0",
            "anew",
        ],
    ),
    (
        "a view that wraps around",
        |f| set(f, "/bufferViews/0/byteOffset", json!(u64::MAX - 3)),
        &["POSITION (accessor 0)", "buffer view 0", "anew"],
    ),
    (
        "an accessor beyond its view",
        |f| set(f, "/accessors/0/count", json!(5)),
        &[
            "POSITION (accessor 0)",
            "5 elements",
            "48 bytes of buffer view 0",
        ],
    ),
    (
        "a count that wraps around",
        |f| set(f, "/accessors/0/count", json!(u64::MAX)),
        &["POSITION (accessor 0)", "buffer view 0"],
    ),
    (
        "a stride too small",
        |f| add(f, "/bufferViews/0", "byteStride", json!(4)),
        &["POSITION (accessor 0)", "stride is 4"],
    ),
    (
        "no view",
        |f| {
            let accessor = at(f, "/accessors/0").as_object_mut();
            accessor.expect("an object").remove("bufferView");
        },
        &["POSITION (accessor 0)", "no buffer view"],
    ),
    (
        "zeros without end",
        |f| {
            let sparse = at(f, "/accessors/5/sparse").clone();
            let accessor = json!({"componentType": FLOAT, "type": "VEC3", "count": 1u64 << 60});
            set(f, "/accessors/0", accessor);
            add(f, "/accessors/0", "sparse", sparse);
        },
        &["POSITION (accessor 0)", "1152921504606846976 elements"],
    ),
    (
        "no such view",
        |f| set(f, "/accessors/0/bufferView", json!(99)),
        &["buffer view 99"],
    ),
    (
        "no such buffer",
        |f| set(f, "/bufferViews/0/buffer", json!(9)),
        &["no buffer 9"],
    ),
    (
        "no such accessor",
        |f| set(f, POSITION, json!(99)),
        &["POSITION (accessor 99)"],
    ),
    (
        "a wrong shape",
        |f| set(f, "/accessors/0/type", json!("VEC2")),
        &["POSITION (accessor 0)", "Vec2", "Vec3"],
    ),
    (
        "an unknown type",
        |f| set(f, "/accessors/0/componentType", json!(5124)),
        &["POSITION (accessor 0)", "none of glTF 2.0"],
    ),
    (
        "a sparse index beyond",
        |f| set(f, "/accessors/5/count", json!(3)),
        &["morph target 1, NORMAL (accessor 5)", "3 elements, where 4"],
    ),
    (
        "sparse values beyond",
        |f| set(f, "/accessors/5/sparse/count", json!(3)),
        &["morph target 1, NORMAL (accessor 5)", "3 elements"],
    ),
    (
        "sparse indices beyond",
        |f| {
            let view = at(f, "/accessors/5/sparse/indices/bufferView").as_u64();
            let view = view.expect("an index") as usize;
            let start = f.json["bufferViews"][view]["byteOffset"].as_u64();
            f.bytes[start.expect("an offset") as usize] = 9;
        },
        &["(accessor 5)", "sparse index 9", "4 elements"],
    ),
    // Meshes.
    (
        "no nodes",
        |f| set(f, "/scenes/0/nodes", json!([])),
        &["no meshes", "default scene"],
    ),
    (
        "points",
        |f| add(f, PRIMITIVE, "mode", json!(0)),
        &["no triangles", "faces"],
    ),
    (
        "an unknown mode",
        |f| add(f, PRIMITIVE, "mode", json!(9)),
        &["primitive 0", "mode"],
    ),
    (
        "a vertex at infinity",
        |f| poke(f, POSITION, 7, f32::INFINITY),
        &[
            "POSITION (accessor 0)",
            "element 2 is not finite (inf)",
            "anew",
        ],
    ),
    (
        "an index beyond",
        |f| {
            let start = start(f, "/meshes/0/primitives/0/indices");
            f.bytes[start + 4] = 4;
        },
        &[
            "mesh 0 \"Tet\", primitive 0, indices (accessor 1)",
            "element 4 is vertex 4",
        ],
    ),
    (
        "normals of another count",
        |f| add(f, ATTRIBUTES, "NORMAL", json!(6)),
        &["NORMAL (accessor 6)"],
    ),
    (
        "targets of another count",
        |f| {
            let mut primitive = at(f, PRIMITIVE).clone();
            primitive["targets"] = json!([]);
            let list = at(f, "/meshes/0/primitives").as_array_mut();
            list.expect("a list").push(primitive);
        },
        &["primitive 1", "0 morph targets", "2"],
    ),
    (
        "morph weights of another count",
        |f| add(f, "/nodes/0", "weights", json!([1])),
        &["node 0", "needs 2 finite morph weights and has 1"],
    ),
    (
        "no such mesh",
        |f| set(f, "/nodes/0/mesh", json!(7)),
        &["node 0", "mesh 7"],
    ),
    (
        "no such material",
        |f| add(f, PRIMITIVE, "material", json!(7)),
        &["material 7"],
    ),
    (
        "a flat mesh",
        |f| {
            f.json["animations"] = json!([]);
            add(f, "/nodes/1", "scale", json!([1, 0, 0]));
        },
        &["no triangle has any area", "scale"],
    ),
    // Nodes.
    (
        "two parents",
        |f| add(f, "/nodes/0", "children", json!([2])),
        &["node 2", "node 0 and of node 1"],
    ),
    (
        "a ring",
        |f| add(f, "/nodes/2", "children", json!([1])),
        &["node 1 \"hip\"", "ring"],
    ),
    (
        "its own child",
        |f| set(f, "/nodes/1/children", json!([1, 2])),
        &["node 1", "ring"],
    ),
    (
        "no such child",
        |f| set(f, "/nodes/1/children", json!([8])),
        &["node 1", "node 8"],
    ),
    (
        "no such scene",
        |f| set(f, "/scene", json!(3)),
        &["default scene is 3"],
    ),
    (
        "no such root",
        |f| set(f, "/scenes/0/nodes", json!([4])),
        &["node 4"],
    ),
    (
        "a translation at infinity",
        |f| add(f, "/nodes/1", "translation", json!([0, 1e39, 0])),
        &["number out of range at line 1", "anew"],
    ),
    (
        "a rotation of zero",
        |f| set(f, "/nodes/2/rotation", json!([0, 0, 0, 0])),
        &["node 2", "rotation", "unit quaternion"],
    ),
    (
        "a matrix at infinity",
        |f| {
            add(
                f,
                "/nodes/0",
                "matrix",
                json!([1e39, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]),
            )
        },
        &["number out of range at line 1", "anew"],
    ),
    (
        "a projection",
        |f| {
            add(
                f,
                "/nodes/0",
                "matrix",
                json!([1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]),
            )
        },
        &["node 0", "last row"],
    ),
    // Skins.
    (
        "a joint beyond",
        |f| {
            let start = start(f, JOINTS);
            f.bytes[start + 9] = 2;
        },
        &[
            "primitive 0, JOINTS_0",
            "vertex 2 follows joint 2",
            "skin has 2",
            "anew",
        ],
    ),
    (
        "a negative weight",
        |f| poke(f, WEIGHTS, 5, -0.5),
        &["WEIGHTS_0", "vertex 1", "-0.5", "normalise"],
    ),
    (
        "a weight that is no number",
        |f| poke(f, WEIGHTS, 5, f32::NAN),
        &["WEIGHTS_0", "element 1 is not finite (NaN)"],
    ),
    (
        "weights alone",
        |f| {
            let attributes = at(f, ATTRIBUTES).as_object_mut();
            attributes.expect("an object").remove("JOINTS_0");
        },
        &["primitive 0", "WEIGHTS_0 comes alone"],
    ),
    (
        "no weights",
        |f| {
            let attributes = at(f, ATTRIBUTES).as_object_mut().expect("an object");
            attributes.remove("JOINTS_0");
            attributes.remove("WEIGHTS_0");
        },
        &["primitive 0", "no JOINTS_0 and WEIGHTS_0", "bind it"],
    ),
    (
        "twelve influences",
        |f| {
            for set in 1..3 {
                for what in ["JOINTS", "WEIGHTS"] {
                    let same = at(f, ATTRIBUTES)[format!("{what}_0")].clone();
                    add(f, ATTRIBUTES, &format!("{what}_{set}"), same);
                }
            }
        },
        &["primitive 0", "more than 8", "limit them"],
    ),
    (
        "no such skin",
        |f| set(f, "/nodes/0/skin", json!(5)),
        &["skin 5"],
    ),
    (
        "a skin of nothing",
        |f| set(f, "/skins/0/joints", json!([])),
        &["skin 0 \"Rig\"", "no joints"],
    ),
    (
        "no such joint",
        |f| set(f, "/skins/0/joints", json!([1, 77])),
        &["skin 0 \"Rig\", joint 1", "no node 77"],
    ),
    (
        "too few matrices",
        |f| set(f, "/skins/0/joints", json!([1, 2, 2])),
        &["skin 0 \"Rig\", joint 2", "no inverse bind matrix"],
    ),
    (
        "a matrix that is no number",
        |f| poke(f, "/skins/0/inverseBindMatrices", 17, f32::NAN),
        &["skin 0 \"Rig\", joint 1", "matrix is not finite"],
    ),
    // Clips.
    (
        "a clip of nothing",
        |f| set(f, "/animations/0/channels", json!([])),
        &[
            "animation 0 \"walk\"",
            "no channels",
            "length is zero",
            "remove it",
        ],
    ),
    (
        "a clip of no length",
        |f| {
            set(f, "/accessors/7/count", json!(1));
            set(f, "/accessors/8/count", json!(1));
        },
        &["animation 0 \"walk\"", "length is zero", "keyframe"],
    ),
    (
        "no keyframes",
        |f| set(f, "/accessors/7/count", json!(0)),
        &[
            "animation 0 \"walk\", channel 0, times (accessor 7)",
            "no keyframes",
        ],
    ),
    (
        "times that stand still",
        |f| poke(f, TIMES, 1, 0.0),
        &[
            "channel 0, times (accessor 7)",
            "keyframe 1 is at 0 s, not after keyframe 0",
        ],
    ),
    (
        "a time that is no number",
        |f| poke(f, TIMES, 1, f32::NAN),
        &["times (accessor 7)", "element 1 is not finite (NaN)"],
    ),
    (
        "a time before",
        |f| poke(f, TIMES, 0, -1.0),
        &["times (accessor 7)", "before 0"],
    ),
    (
        "a value that is no number",
        |f| poke(f, VALUES, 3, f32::NAN),
        &[
            "channel 0, values (accessor 8)",
            "element 1 is not finite (NaN)",
        ],
    ),
    (
        "values of another count",
        |f| set(f, "/accessors/8/count", json!(1)),
        &["channel 0, values (accessor 8)", "1 elements, where 2"],
    ),
    (
        "tangents that are not there",
        |f| {
            add(
                f,
                "/animations/0/samplers/0",
                "interpolation",
                json!("CUBICSPLINE"),
            )
        },
        &["channel 0, values (accessor 8)", "2 elements, where 6"],
    ),
    (
        "an unknown interpolation",
        |f| {
            add(
                f,
                "/animations/0/samplers/0",
                "interpolation",
                json!("CATMULLROM"),
            )
        },
        &["animation 0 \"walk\", channel 0", "interpolation"],
    ),
    (
        "a keyframe of zero",
        |f| poke(f, "/animations/1/samplers/0/output", 7, 0.0),
        &["animation 1, channel 0", "rotation at keyframe 0 is zero"],
    ),
    (
        "no such node",
        |f| set(f, "/animations/0/channels/0/target/node", json!(42)),
        &["animation 0 \"walk\", channel 0", "node 42"],
    ),
    (
        "no such sampler",
        |f| set(f, "/animations/0/channels/0/sampler", json!(6)),
        &["animation 0 \"walk\", channel 0", "sampler 6"],
    ),
    (
        "a matrix that should move",
        |f| {
            let matrix = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
            add(f, "/nodes/1", "matrix", matrix);
        },
        &[
            "animation 0 \"walk\", channel 0",
            "node 1 \"hip\"",
            "translation, rotation and scale",
        ],
    ),
];
