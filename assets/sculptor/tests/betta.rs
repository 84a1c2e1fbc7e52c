//! The fish is closed, moves without tearing, and is the same at every run.

use std::sync::OnceLock;

use glam::Vec3;
use sculptor::betta::rig::Role;
use sculptor::betta::{Animal, Betta};

/// A coarser lattice than the shipped one, to be quick.
const STEP: f32 = 0.3;

fn animal() -> &'static Animal {
    static ANIMAL: OnceLock<Animal> = OnceLock::new();
    ANIMAL.get_or_init(|| Animal::new(&Betta::new(), STEP).expect("carved"))
}

/// Eight times of each clip.
fn poses() -> impl Iterator<Item = (String, sculptor::mesh::Mesh, Vec<Vec3>)> {
    let animal = animal();
    animal.clips.iter().flat_map(move |clip| {
        let length = clip.times[clip.times.len() - 1];
        (0..8).map(move |k| {
            // Off the keys as well as on them.
            let time = length * (k as f32 + 0.37) / 8.0;
            let (mesh, normals) = animal.posed(clip, time);
            (format!("{} at {time:.2} s", clip.name), mesh, normals)
        })
    })
}

#[test]
fn the_mesh_is_closed_and_of_its_size() {
    let mesh = &animal().piece.mesh;
    mesh.check().expect("closed");
    assert!((10_000..=16_000).contains(&mesh.triangles.len()));
    let (lo, hi) = mesh
        .positions
        .iter()
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), &p| {
            (lo.min(p), hi.max(p))
        });
    assert!((66.0..74.0).contains(&(hi.x - lo.x)), "{} mm", hi.x - lo.x);
}

#[test]
fn every_vertex_follows_joints_that_are_there() {
    let animal = animal();
    assert!(animal.rig.joints.len() <= 64);
    for (i, joint) in animal.rig.joints.iter().enumerate() {
        assert!(joint.parent.is_none_or(|p| p < i), "{}", joint.name);
    }
    for (joints, weights) in animal.skin.joints.iter().zip(&animal.skin.weights) {
        assert_eq!(weights.iter().map(|&w| u32::from(w)).sum::<u32>(), 65_535);
        for (&j, &w) in joints.iter().zip(weights) {
            assert!(usize::from(j) < animal.rig.joints.len());
            assert!(w > 0 || j == 0);
        }
    }
}

#[test]
fn no_fin_follows_a_joint_of_another() {
    let animal = animal();
    for (joints, weights) in animal.skin.joints.iter().zip(&animal.skin.weights) {
        let mut fin = None;
        for (&j, &w) in joints.iter().zip(weights) {
            let Role::Fin(which, side, ..) = animal.rig.joints[usize::from(j)].role else {
                continue;
            };
            // Neighbours along the body share a little at their roots.
            if w > 3_000 {
                assert!(fin.is_none_or(|f| f == (which, side)));
                fin = Some((which, side));
            }
        }
    }
}

#[test]
fn clips_loop() {
    for clip in &animal().clips {
        for channel in &clip.channels {
            let [first, last] = clip.ends(channel);
            assert_eq!(first, last, "{} {:?}", clip.name, channel.target);
        }
    }
}

#[test]
fn no_pose_tears_or_swells() {
    let rest = &animal().piece.mesh;
    let area = |m: &sculptor::mesh::Mesh, t| {
        let [a, b, c] = m.corners(t);
        (b - a).cross(c - a).length()
    };
    for (name, mesh, normals) in poses() {
        assert!(mesh.positions.iter().all(|p| p.is_finite()), "{name}");
        assert!(normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-3));
        let shrunk = (rest.triangles.iter())
            .filter(|&&t| area(&mesh, t) < 0.1 * area(rest, t))
            .count();
        assert!(
            shrunk * 200 < rest.triangles.len(),
            "{name}: {shrunk} faces"
        );
        let change = mesh.volume() / rest.volume() - 1.0;
        assert!(change.abs() < 0.08, "{name}: volume changes by {change}");
    }
}

#[test]
fn the_tail_sweeps_moderately() {
    let animal = animal();
    let rest = &animal.piece.mesh.positions;
    let tip = (0..rest.len())
        .min_by(|&a, &b| rest[a].x.total_cmp(&rest[b].x))
        .expect("a vertex");
    let clip = &animal.clips[0];
    let across: Vec<f32> = (0..48)
        .map(|k| animal.posed(clip, 0.05 * k as f32).0.positions[tip].z)
        .collect();
    let lo = across.iter().fold(f32::MAX, |m, &z| m.min(z));
    let hi = across.iter().fold(f32::MIN, |m, &z| m.max(z));
    println!("the tip goes from {lo} to {hi} mm");
    assert!((14.0..30.0).contains(&(hi - lo)), "{} mm", hi - lo);
}

#[test]
fn the_file_is_repeatable_and_reads_back() {
    let bytes = animal().glb().expect("written");
    let again = Animal::new(&Betta::new(), STEP).expect("carved again");
    assert!(bytes == again.glb().expect("written again"));
    assert!(bytes.len() < 900_000, "{} bytes", bytes.len());

    let file = gltf::Gltf::from_slice(&bytes).expect("valid");
    let blob = file.blob.as_deref().expect("a binary chunk");
    let mesh = file.meshes().next().expect("a mesh");
    let primitive = mesh.primitives().next().expect("a primitive");
    let reader = primitive.reader(|_| Some(blob));
    let rest = &animal().piece.mesh;
    let positions: Vec<Vec3> = reader
        .read_positions()
        .expect("positions")
        .map(Vec3::from)
        .collect();
    assert_eq!(positions, rest.positions);
    let indices = reader.read_indices().expect("indices").into_u32();
    assert!(indices.eq(rest.triangles.iter().flatten().copied()));
    for ((positions, normals, _), ours) in reader.read_morph_targets().zip(&animal().morphs) {
        let deltas: Vec<Vec3> = positions.expect("deltas").map(Vec3::from).collect();
        assert_eq!(deltas.len(), ours.positions.len());
        assert_eq!(normals.expect("deltas").count(), ours.normals.len());
        for (a, b) in deltas.iter().zip(&ours.positions) {
            assert!(a.distance(*b) < 2e-4);
        }
    }
    let skin = file.skins().next().expect("a skin");
    assert_eq!(skin.joints().count(), animal().rig.joints.len());
    let names: Vec<_> = file
        .animations()
        .map(|a| a.name().map(String::from))
        .collect();
    assert_eq!(names, [Some("swim".into()), Some("hover".into())]);
}
