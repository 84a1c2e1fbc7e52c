//! What stands still, and what stays in place: transforms, topology, components, containers, colours.

use super::super::{load, parse};
use super::*;
use std::f64::consts::FRAC_1_SQRT_2;

/// A quarter turn about z.
const QUARTER: [f64; 4] = [0.0, 0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2];

#[test]
fn a_child_follows_its_parent() {
    // The child comes first in the file.
    let mut file = Builder::one(json!({"translation": [1, 0, 0], "scale": [1, 3, 1]}));
    let parent = json!({
        "children": [0], "translation": [1, 2, 3], "rotation": QUARTER, "scale": [2, 1, 1],
    });
    file.push("nodes", parent);
    file.json["scenes"][0]["nodes"] = json!([1]);
    // (x, y, z) -> (x + 1, 3 y, z) -> (2 x + 2, 3 y, z) -> (-3 y, 2 x + 2, z) -> + (1, 2, 3).
    let by_hand = |x: f64, y: f64, z: f64| DVec3::new(1.0 - 3.0 * y, 2.0 * x + 4.0, z + 3.0);
    let check = |mesh: &Mesh| {
        close(mesh.positions[0], by_hand(0., 0., 0.));
        close(mesh.positions[1], by_hand(1., 0., 0.));
        close(mesh.positions[2], by_hand(0., 1., 0.));
        close(mesh.positions[3], by_hand(0., 0., 1.));
        assert!((volume(mesh) - 1.0).abs() < 1e-5);
    };
    let still = file.model();
    assert!(still.rig.is_none());
    check(&still.shapes[0]);
    // With a clip its nodes come along, the parent first; it holds what is at rest.
    file.clip(1, "scale", "STEP", &[0., 1.], &[2., 1., 1., 2., 1., 1.]);
    let moving = file.model();
    let rig = moving.rig.as_ref().expect("a rig");
    assert_eq!(rig.nodes[0].parent, None);
    assert_eq!(rig.nodes[1].parent, Some(0));
    assert_eq!(rig.nodes[1].name, ONE_NODE);
    assert_eq!(rig.clips[0].channels[0].node, 0);
    check(&posed(&moving, None));
    check(&posed(&moving, Some(0.5)));
    // A matrix says the same.
    file.json["animations"] = json!([]);
    file.json["nodes"][0] =
        json!({"mesh": 0, "matrix": [1, 0, 0, 0, 0, 3, 0, 0, 0, 0, 1, 0, 1, 0, 0, 1]});
    check(&file.model().shapes[0]);
}

#[test]
fn normals_stay_perpendicular_under_scale() {
    let mut file = Builder::new();
    let positions = file.floats("VEC3", &[0., 0., 0., 1., 0., -1., 0., 1., 0.]);
    let normals = file.floats("VEC3", &[3., 0., 3., 3., 0., 3., 3., 0., 3.]);
    let primitive = json!({"attributes": {"POSITION": positions, "NORMAL": normals}});
    file.push("meshes", json!({"primitives": [primitive]}));
    file.push(
        "nodes",
        json!({"mesh": 0, "scale": [1, 1, 5], "rotation": QUARTER}),
    );
    let mesh = &file.model().shapes[0];
    let [a, b, c] = mesh.corners().next().expect("a triangle");
    let face = (b - a).cross(c - a).normalize();
    for normal in &mesh.normals {
        close(*normal, face);
    }
}

#[test]
fn a_mesh_may_be_in_several_places() {
    let mut file = Builder::one(json!({}));
    file.push("nodes", json!({"mesh": 0, "translation": [5, 0, 0]}));
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    let mesh = &file.model().shapes[0];
    assert_eq!(mesh.positions.len(), 8);
    close(mesh.positions[5] - mesh.positions[1], DVec3::X * 5.0);
    assert!((volume(mesh) - 1.0 / 3.0).abs() < 1e-6);
    // Only what is in the scene is drawn; without scenes, everything.
    file.json["scenes"] = json!([{"nodes": []}, {"nodes": [1]}]);
    file.json["scene"] = json!(1);
    assert_eq!(file.model().shapes[0].positions.len(), 4);
    let json = file.json.as_object_mut().expect("an object");
    json.remove("scenes");
    json.remove("scene");
    assert_eq!(file.model().shapes[0].positions.len(), 8);
}

/// Every normal of each tetrahedron points away from its middle, and its volume is positive.
#[track_caller]
fn outward(mesh: &Mesh) {
    for (at, four) in mesh.positions.chunks(4).enumerate() {
        let own = |t: &&[u32; 3]| t[0] as usize / 4 == at;
        let one = Mesh {
            triangles: mesh.triangles.iter().filter(own).copied().collect(),
            ..mesh.clone()
        };
        assert_eq!(one.triangles.len(), 4);
        assert!(volume(&one) > 0.01, "{}", volume(&one));
        let middle = four.iter().sum::<DVec3>() / 4.0;
        for (p, n) in four.iter().zip(&mesh.normals[4 * at..]) {
            assert!(n.dot((p - middle).normalize()) > 0.3, "{n} at {p}");
        }
    }
}

#[test]
fn mirrored_meshes_face_outward() {
    for given in [false, true] {
        for (scale, count) in [([-1, 1, 1], 2), ([-1, -1, -1], 1), ([-1, -1, 1], 1)] {
            for moving in [false, true] {
                // A mirrored and a plain instance, whose vertices coincide in the mesh's space.
                let mut file = Builder::one(json!({"scale": scale}));
                if given {
                    let n = [-1., -1., -1., 3., -1., -1., -1., 3., -1., -1., -1., 3.];
                    let normals = file.floats("VEC3", &n);
                    file.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] =
                        normals.into();
                }
                file.push("nodes", json!({"children": [0], "scale": [1, count, 1]}));
                file.push("nodes", json!({"mesh": 0}));
                file.json["scenes"][0]["nodes"] = json!([1, 2]);
                if moving {
                    file.drift(1);
                }
                let model = file.model();
                assert_eq!(model.rig.is_some(), moving);
                outward(&posed(&model, moving.then_some(1.0)));
            }
        }
    }
}

#[test]
fn a_mirrored_skin_faces_outward() {
    for moving in [false, true] {
        let mut file = Builder::one(json!({"skin": 0}));
        let joints = file.accessor("VEC4", UNSIGNED_BYTE, 4, &[0; 16]);
        let weights = file.floats("VEC4", &[1., 0., 0., 0.].repeat(4));
        let attributes = &mut file.json["meshes"][0]["primitives"][0]["attributes"];
        merge(
            attributes,
            json!({"JOINTS_0": joints, "WEIGHTS_0": weights}),
        );
        file.push("nodes", json!({"scale": [1, 1, -2]}));
        file.push("skins", json!({"joints": [1]}));
        if moving {
            file.drift(1);
        }
        outward(&posed(&file.model(), moving.then_some(1.0)));
    }
}

#[test]
fn lists_strips_and_fans_with_all_kinds_of_indices() {
    let square = [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.];
    for (mode, corners) in [
        (4, vec![0u32, 1, 2, 0, 2, 3]),
        // The repeated vertices of a strip draw nothing, but count for its winding.
        (5, vec![0, 0, 0, 1, 3, 2]),
        (6, vec![0, 1, 2, 3]),
    ] {
        for component in [0, UNSIGNED_BYTE, UNSIGNED_SHORT, UNSIGNED_INT] {
            let mut file = Builder::new();
            let mut primitive = json!({"mode": mode, "attributes": {}});
            let positions = if component == 0 {
                // Not indexed: the corners in their order.
                let at = |&i: &u32| &square[3 * i as usize..][..3];
                corners.iter().flat_map(at).copied().collect()
            } else {
                let bytes = |&i: &u32| i.to_le_bytes()[..size(component)].to_vec();
                let bytes: Vec<u8> = corners.iter().flat_map(bytes).collect();
                let indices = file.accessor("SCALAR", component, corners.len(), &bytes);
                primitive["indices"] = indices.into();
                square.to_vec()
            };
            primitive["attributes"]["POSITION"] = file.floats("VEC3", &positions).into();
            // Points and lines are left out.
            let lines = json!({"mode": 1, "attributes": primitive["attributes"]});
            file.push("meshes", json!({"primitives": [lines, primitive]}));
            file.push("nodes", json!({"mesh": 0}));
            let mesh = &file.model().shapes[0];
            assert_eq!(mesh.triangles.len(), 2);
            let faces = mesh.corners().map(|[a, b, c]| (b - a).cross(c - a));
            assert_eq!(faces.sum::<DVec3>(), DVec3::Z * 2.0, "{mode} {component}");
            mesh.normals.iter().for_each(|n| close(*n, DVec3::Z));
        }
    }
}

fn size(component: u32) -> usize {
    match component {
        BYTE | UNSIGNED_BYTE => 1,
        SHORT | UNSIGNED_SHORT => 2,
        _ => 4,
    }
}

#[test]
fn quantised_positions_normals_and_coordinates() {
    for (component, normalised, one) in [
        (BYTE, true, 127),
        (BYTE, false, 1),
        (UNSIGNED_BYTE, true, 255),
        (UNSIGNED_BYTE, false, 1),
        (SHORT, true, 32767),
        (SHORT, false, 1),
        (UNSIGNED_SHORT, true, 65535),
        (UNSIGNED_SHORT, false, 1u32),
    ] {
        let mut file = Builder::one(json!({}));
        file.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        // Elements lie 8 bytes apart, and begin 2 bytes in.
        let mut bytes = vec![0u8; 2];
        for p in TETRAHEDRON.chunks(3) {
            let mut element: Vec<u8> = p
                .iter()
                .flat_map(|&v| (v as u32 * one).to_le_bytes()[..size(component)].to_vec())
                .collect();
            element.resize(8, 0xee);
            bytes.extend(element);
        }
        let view = file.view(&bytes);
        file.json["bufferViews"][view]["byteStride"] = 8.into();
        file.json["accessors"][0] = json!({
            "bufferView": view, "byteOffset": 2, "componentType": component, "count": 4,
            "type": "VEC3", "normalized": normalised,
        });
        let n = [129u8, 0, 0, 127, 0, 0, 0, 127, 0, 0, 0, 127];
        let normals = file.accessor("VEC3", BYTE, 4, &n);
        file.json["accessors"][normals]["normalized"] = true.into();
        let uv = [0u8, 0, 255, 0, 0, 51, 0, 0];
        let uvs = file.accessor("VEC2", UNSIGNED_BYTE, 4, &uv);
        file.json["accessors"][uvs]["normalized"] = true.into();
        let attributes = &mut file.json["meshes"][0]["primitives"][0]["attributes"];
        merge(attributes, json!({"NORMAL": normals, "TEXCOORD_0": uvs}));
        let mesh = &file.model().shapes[0];
        assert!((volume(mesh) - 1.0 / 6.0).abs() < 1e-12, "{component}");
        let axes = [DVec3::NEG_X, DVec3::X, DVec3::Y, DVec3::Z];
        assert_eq!(mesh.normals, axes);
        assert_eq!(mesh.uvs, [[0., 0.], [1., 0.], [0., 0.2], [0., 0.]]);
    }
}

#[test]
fn buffers_lie_inside_or_beside() {
    let file = Builder::one(json!({}));
    let inside = file.model();
    let uri = file.gltf(&file.data_uri());
    let parsed = parse(&uri, "a.gltf", None).expect("a data URI");
    assert_eq!(parsed, inside);
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        path
    };
    write("the mesh.bin", &file.bytes);
    let path = write("a.gltf", &file.gltf("the%20mesh.bin"));
    assert_eq!(load(&path).expect("an external buffer"), inside);
    // What a file is shows by what is in it, not by its name.
    assert_eq!(load(&write("b.gltf", &file.glb())).expect("a .glb"), inside);
    let path = write("c.gltf", &file.gltf("other.bin"));
    let fault = load(&path).expect_err("no buffer").to_string();
    for fragment in [
        "c.gltf: ",
        "buffer 0",
        "\"other.bin\"",
        "no such file",
        "as .glb",
    ] {
        assert!(fault.contains(fragment), "{fault}");
    }
}

#[test]
fn the_base_colour_is_a_mean_by_area() {
    let mut file = Builder::one(json!({}));
    assert_eq!(file.model().base_color, None);
    let red = json!({"pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0, 1]}});
    file.push("materials", red);
    file.json["meshes"][0]["primitives"][0]["material"] = 0.into();
    let color = file.model().base_color.expect("a colour");
    close(color, DVec3::new(1.0, 0.5, 0.0));
    // A second mesh without a material, which is white, of four times the area once it is placed.
    let primitive = json!({
        "attributes": file.json["meshes"][0]["primitives"][0]["attributes"],
        "indices": file.json["meshes"][0]["primitives"][0]["indices"],
    });
    file.push("meshes", json!({"primitives": [primitive]}));
    file.push("nodes", json!({"mesh": 1, "scale": [2, 2, 2]}));
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    for _ in 0..2 {
        let color = file.model().base_color.expect("a colour");
        close(color, DVec3::new(1.0, 0.9, 0.8));
        file.drift(0);
    }
}

#[test]
fn what_is_not_read_may_be_anything() {
    let mut file = Builder::one(json!({"extras": "text", "camera": 0}));
    file.push(
        "textures",
        json!({"extensions": {"EXT_texture_webp": {"source": 0}}}),
    );
    let perspective = json!({"yfov": 1.0, "znear": 0.1});
    file.push(
        "cameras",
        json!({"type": "perspective", "perspective": perspective}),
    );
    file.json["extensionsUsed"] = json!(["KHR_materials_unlit", "KHR_draco_mesh_compression"]);
    file.json["meshes"][0]["primitives"][0]["attributes"]["_OWN"] = 0.into();
    assert_eq!(file.model().shapes[0].triangles.len(), 4);
}
