//! Skins, morph targets and clips.

use super::*;
use crate::scene::clip::{Interpolation, Values};
use glam::{DMat4, DQuat, Quat};

/// A clip over a tetrahedron bound to `joints` joints in a chain, with weights that vary. Returns the file, and per vertex
/// its joints and weights.
fn chain(joints: usize, component: u32) -> (Builder, Vec<Vec<(usize, f64)>>) {
    // The transform of a skinned mesh's own node does not count.
    let mut file = Builder::one(json!({"skin": 0, "translation": [9, 9, 9], "scale": [3, 1, 1]}));
    let sets = joints.div_ceil(4);
    let mut bindings = vec![Vec::new(); 4];
    for set in 0..sets {
        let (mut indices, mut weights) = (Vec::new(), Vec::new());
        for (vertex, binding) in bindings.iter_mut().enumerate() {
            for slot in 0..4 {
                let joint = (4 * set + slot + vertex) % joints;
                // Not normalised: 1 to 8 parts.
                let parts = 1 + (joint * 5 + vertex * 3) % 8;
                indices.push(joint as u16);
                weights.push(parts as f32);
                binding.push((joint, parts as f64));
            }
        }
        let bytes: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        let indices = file.accessor("VEC4", UNSIGNED_SHORT, 4, &bytes);
        let bytes: Vec<u8> = match component {
            UNSIGNED_BYTE => weights.iter().map(|&w| w as u8 * 25).collect(),
            UNSIGNED_SHORT => weights
                .iter()
                .flat_map(|&w| (w as u16 * 8000).to_le_bytes())
                .collect(),
            _ => floats(&weights),
        };
        let weights = file.accessor("VEC4", component, 4, &bytes);
        file.json["accessors"][weights]["normalized"] = (component != FLOAT).into();
        let attributes = &mut file.json["meshes"][0]["primitives"][0]["attributes"];
        attributes[format!("JOINTS_{set}")] = indices.into();
        attributes[format!("WEIGHTS_{set}")] = weights.into();
    }
    for binding in &mut bindings {
        let sum: f64 = binding.iter().map(|(_, w)| w).sum();
        binding.iter_mut().for_each(|(_, w)| *w /= sum);
    }
    let inverse: Vec<f32> = (0..joints)
        .flat_map(|j| inverse_bind(j).as_mat4().to_cols_array())
        .collect();
    let inverse = file.floats("MAT4", &inverse);
    for joint in 0..joints {
        let [x, y, z, w] = rotation(joint).as_quat().to_array();
        let mut node = json!({"translation": [0.5, joint, 0], "rotation": [x, y, z, w]});
        if joint + 1 < joints {
            node["children"] = json!([joint + 2]);
        }
        file.push("nodes", node);
    }
    let nodes: Vec<usize> = (1..=joints).collect();
    file.push(
        "skins",
        json!({"joints": nodes, "inverseBindMatrices": inverse}),
    );
    (file, bindings)
}

fn rotation(joint: usize) -> DQuat {
    DQuat::from_rotation_x(0.2 + 0.1 * joint as f64)
}

fn inverse_bind(joint: usize) -> DMat4 {
    DMat4::from_rotation_translation(DQuat::from_rotation_y(0.3 * joint as f64), DVec3::X * 0.25)
}

#[test]
fn skins_of_four_and_eight_influences_by_hand() {
    for (joints, component) in [
        (4, FLOAT),
        (4, UNSIGNED_BYTE),
        (4, UNSIGNED_SHORT),
        (8, FLOAT),
        (8, UNSIGNED_BYTE),
        (8, UNSIGNED_SHORT),
    ] {
        let (mut file, bindings) = chain(joints, component);
        // Bakes what nothing moves; moves the root by (t, 0, 0) otherwise.
        let still = file.model();
        file.drift(1);
        let moving = file.model();
        let rig = moving.rig.as_ref().expect("a rig");
        assert_eq!(rig.influences, if joints > 4 { 8 } else { 4 });
        for weights in rig.vertex_weights.chunks(rig.influences) {
            assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        }
        for (mesh, shift) in [
            (posed(&moving, Some(1.5)), 1.5),
            (still.shapes[0].clone(), 0.5),
        ] {
            for (vertex, p) in TETRAHEDRON.chunks(3).enumerate() {
                let p = DVec3::new(p[0].into(), p[1].into(), p[2].into()).extend(1.0);
                let mut sum = DVec3::ZERO;
                for &(joint, weight) in &bindings[vertex] {
                    let mut global = DMat4::IDENTITY;
                    for above in 0..=joint {
                        let x = if above == 0 { shift } else { 0.5 };
                        let local = DMat4::from_rotation_translation(
                            rotation(above),
                            DVec3::new(x, above as f64, 0.0),
                        );
                        global *= local;
                    }
                    sum += weight * (global * inverse_bind(joint) * p).truncate();
                }
                // A clip replaces the root's translation, y and z and all.
                close(mesh.positions[vertex], sum);
            }
        }
    }
}

#[test]
fn a_vertex_without_weights_follows_the_first_joint() {
    let (mut file, _) = chain(4, FLOAT);
    let weights = &file.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"];
    let view = file.json["accessors"][weights.as_u64().expect("an index") as usize]["bufferView"]
        .as_u64()
        .expect("an index") as usize;
    let start = file.json["bufferViews"][view]["byteOffset"]
        .as_u64()
        .expect("an offset");
    file.bytes[start as usize..][..16].fill(0);
    file.drift(1);
    let rig = file.model().rig.expect("a rig");
    assert_eq!(rig.vertex_joints[..4], [0; 4]);
    assert_eq!(rig.vertex_weights[..4], [1., 0., 0., 0.]);
}

#[test]
fn two_nodes_may_share_a_skin() {
    let (mut file, _) = chain(4, FLOAT);
    file.drift(1);
    let one = file.model();
    let node = file.push("nodes", json!({"mesh": 0, "skin": 0}));
    file.json["scenes"][0]["nodes"] = json!([0, node]);
    let two = file.model();
    let joints = |model: &Model| model.rig.as_ref().expect("a rig").joints.len();
    assert_eq!(joints(&one), joints(&two));
    let mesh = posed(&two, Some(1.0));
    assert_eq!(mesh.positions[..4], mesh.positions[4..]);
    assert_eq!(mesh.positions[..4], posed(&one, Some(1.0)).positions);
}

/// Two targets: one moves vertex 3 up by 1 and turns its normal, sparse or dense; one moves all along x, positions alone.
fn morphing(sparse: bool, scale: [i32; 3]) -> Builder {
    let mut file = Builder::one(json!({"weights": [0.5, 0], "scale": scale}));
    let normals = file.floats("VEC3", &[0., 0., 1.].repeat(4));
    let mut one = |value: [f32; 3]| {
        if !sparse {
            let mut values = vec![0.0; 9];
            values.extend(value);
            return file.floats("VEC3", &values);
        }
        let index = file.view(&3u16.to_le_bytes());
        let value = file.view(&floats(&value));
        file.push(
            "accessors",
            json!({"componentType": FLOAT, "count": 4, "type": "VEC3", "sparse": {
                "count": 1, "values": {"bufferView": value},
                "indices": {"bufferView": index, "componentType": UNSIGNED_SHORT},
            }}),
        )
    };
    let up = one([0., 0., 1.]);
    let turn = one([1., 0., -1.]);
    let along = file.floats("VEC3", &[1., 0., 0.].repeat(4));
    let mesh = &mut file.json["meshes"][0];
    // The node's weights come before these.
    mesh["weights"] = json!([1, 1]);
    mesh["primitives"][0]["attributes"]["NORMAL"] = normals.into();
    mesh["primitives"][0]["targets"] =
        json!([{"POSITION": up, "NORMAL": turn}, {"POSITION": along}]);
    file
}

#[test]
fn morph_targets_move_positions_and_normals() {
    for sparse in [false, true] {
        let mut file = morphing(sparse, [1, 1, 1]);
        let still = &file.model().shapes[0];
        close(still.positions[3], DVec3::Z * 1.5);
        close(still.normals[3], DVec3::new(0.5, 0.0, 0.5).normalize());
        close(still.normals[1], DVec3::Z);
        // At 1 s half of the first target, a quarter of the second.
        file.clip(0, "weights", "LINEAR", &[0., 2.], &[1., 0., 0., 0.5]);
        let moving = file.model();
        let mesh = posed(&moving, Some(1.0));
        close(mesh.positions[3], DVec3::new(0.25, 0.0, 1.5));
        close(mesh.positions[1], DVec3::X * 1.25);
        close(mesh.normals[3], DVec3::new(0.5, 0.0, 0.5).normalize());
        close(posed(&moving, Some(0.0)).normals[3], DVec3::X);
        assert_eq!(posed(&moving, None).positions, still.positions);
        // Without the node's weights those of the mesh hold, without these zeros.
        file.json["nodes"][0] = json!({"mesh": 0});
        close(
            posed(&file.model(), None).positions[3],
            DVec3::new(1., 0., 2.),
        );
        let mesh = file.json["meshes"][0].as_object_mut().expect("a mesh");
        mesh.remove("weights");
        close(posed(&file.model(), None).positions[3], DVec3::Z);
        // A sparse accessor may leave all of its elements zero.
        let empty = json!({"componentType": FLOAT, "count": 4, "type": "VEC3"});
        let empty = file.push("accessors", empty);
        file.json["meshes"][0]["primitives"][0]["targets"][1]["POSITION"] = empty.into();
        close(posed(&file.model(), Some(1.0)).positions[1], DVec3::X);
    }
}

#[test]
fn morph_targets_of_mirrored_nodes_turn_normals_alike() {
    for moving in [false, true] {
        let mut file = morphing(true, [-1, 1, 1]);
        if moving {
            file.clip(0, "weights", "STEP", &[0., 1.], &[0.5, 0., 0.5, 0.]);
        }
        let mesh = posed(&file.model(), None);
        close(mesh.normals[3], DVec3::new(-0.5, 0.0, 0.5).normalize());
        close(mesh.normals[1], DVec3::Z);
    }
}

#[test]
fn each_node_has_morph_weights_of_its_own() {
    let mut file = morphing(false, [1, 1, 1]);
    let node = file.push("nodes", json!({"mesh": 0, "weights": [0, 0]}));
    file.json["scenes"][0]["nodes"] = json!([0, node]);
    file.clip(node, "weights", "STEP", &[0., 1.], &[0., 7., 0., 7.]);
    let mesh = posed(&file.model(), Some(1.0));
    close(mesh.positions[3], DVec3::Z * 1.5);
    close(mesh.positions[7], DVec3::new(7.0, 0.0, 1.0));
}

#[test]
fn clips_have_names_lengths_and_interpolations() {
    let mut file = morphing(false, [1, 1, 1]);
    file.json["animations"] = json!([]);
    let quarter = Quat::from_rotation_z(1.5).to_array();
    let mut turn = vec![0.0; 24];
    turn[4..8].copy_from_slice(&[0., 0., 0., 2.]);
    turn[16..20].copy_from_slice(&quarter);
    file.clip(0, "rotation", "CUBICSPLINE", &[0., 1.5], &turn);
    file.clip(0, "weights", "CUBICSPLINE", &[1., 3.], &[0.0; 12]);
    file.clip(0, "scale", "STEP", &[0.5], &[1., 1., 2.]);
    file.drift(0);
    for (index, name) in [(0, "walk"), (1, "walk"), (2, "")] {
        file.json["animations"][index]["name"] = name.into();
    }
    let model = file.model();
    let clips = &model.rig.as_ref().expect("a rig").clips;
    let names: Vec<&str> = clips.iter().map(|clip| clip.name.as_str()).collect();
    assert_eq!(names, ["walk", "walk 2", "clip 2", "clip 3"]);
    assert_eq!(
        clips.iter().map(|c| c.duration).collect::<Vec<_>>(),
        [1.5, 3.0, 0.5, 2.0]
    );
    let kinds: Vec<_> = clips.iter().map(|c| c.channels[0].interpolation).collect();
    use Interpolation::{CubicSpline, Linear, Step};
    assert_eq!(kinds, [CubicSpline, CubicSpline, Step, Linear]);
    // Keyframes are units, tangents as they are.
    let Values::Rotation(rotations) = &clips[0].channels[0].values else {
        panic!("rotations");
    };
    assert_eq!(rotations[1], DQuat::IDENTITY);
    assert_eq!(rotations[0].length(), 0.0);
    assert!(model.clip(Some("walk 2"), "good.glb").is_ok());
}

#[test]
fn quantised_rotations() {
    let mut file = Builder::one(json!({}));
    file.clip(0, "rotation", "STEP", &[0., 1.], &[0.0; 8]);
    let keys: Vec<u8> = [0i16, 0, 0, 32767, 32767, 0, 0, 0]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let output = file.accessor("VEC4", SHORT, 2, &keys);
    file.json["accessors"][output]["normalized"] = true.into();
    file.json["animations"][0]["samplers"][0]["output"] = output.into();
    let mesh = posed(&file.model(), Some(1.0));
    close(mesh.positions[2], DVec3::NEG_Y);
}

#[test]
fn what_moves_nothing_is_no_motion() {
    let mut file = Builder::one(json!({}));
    let other = file.push("nodes", json!({"name": "camera"}));
    file.drift(other);
    // Not in the scene: the clip is left out.
    assert!(file.model().rig.is_none());
    // In the scene, but nothing hangs on it.
    file.json["scenes"][0]["nodes"] = json!([0, other]);
    assert!(file.model().rig.is_none());
    // Once another moves the mesh, both are kept.
    file.drift(0);
    assert_eq!(file.model().rig.expect("a rig").clips.len(), 2);
}

#[test]
fn only_triangles_that_repeat_a_vertex_leave_what_moves() {
    let mut file = Builder::new();
    // A vertex on the first edge and one on the first vertex; the triangles there have no area at rest.
    let mut corners = TETRAHEDRON.to_vec();
    corners.extend([0.5, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let positions = file.floats("VEC3", &corners);
    let mut faces = FACES.to_vec();
    faces.extend([0, 1, 4, 0, 5, 1, 2, 2, 3]);
    let indices = file.accessor("SCALAR", UNSIGNED_BYTE, faces.len(), &faces);
    let primitive = json!({"attributes": {"POSITION": positions}, "indices": indices});
    file.push("meshes", json!({"primitives": [primitive]}));
    file.push("nodes", json!({"mesh": 0}));
    let still = &file.model().shapes[0];
    assert_eq!((still.positions.len(), still.triangles.len()), (4, 4));
    file.drift(0);
    let moving = &file.model().shapes[0];
    assert_eq!((moving.positions.len(), moving.triangles.len()), (6, 6));
    for (a, b) in moving.normals.iter().zip(&still.normals) {
        close(*a, *b);
    }
    close(moving.normals[5], moving.normals[0]);
}
