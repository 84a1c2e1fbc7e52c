//! The promise: scene files, meshes and bundled meshes load as documented.

mod common;

use common::program::{file, folder};
use glam::DVec3;
use marmor::scene::{Bundled, Mesh, Multiple, Request, preset};
use std::path::Path;

#[test]
fn every_bundled_mesh_is_whole() {
    for name in marmor::scene::bundled::NAMES {
        let bundled = Bundled::named(name).expect("a bundled mesh");
        let mesh = bundled.mesh().expect("a good mesh");
        check(&mesh);
        assert!(mesh.triangles.len() >= 500, "{}", bundled.name());
    }
    assert_eq!(Bundled::named("statue"), Some(Bundled::Statue20k));
    assert_eq!(Bundled::named("Statue"), None);
}

/// What every loaded mesh promises.
fn check(mesh: &Mesh) {
    assert_eq!(mesh.positions.len(), mesh.normals.len());
    assert_eq!(mesh.positions.len(), mesh.uvs.len());
    assert!(mesh.positions.iter().all(|p| p.is_finite()));
    assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-9));
    assert_eq!(mesh.corners().count(), mesh.triangles.len());
    let mut used = vec![false; mesh.positions.len()];
    for &index in mesh.triangles.iter().flatten() {
        used[index as usize] = true;
    }
    assert!(used.into_iter().all(|used| used));
}

#[test]
fn a_scene_file_finds_its_mesh_beside_it() {
    let folder = folder();
    std::fs::create_dir(folder.path().join("meshes")).expect("a folder");
    file(
        folder.path(),
        "meshes/a.obj",
        "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n",
    );
    let path = file(
        folder.path(),
        "s.toml",
        "mesh = \"meshes/a.obj\"\nunit = 10\n[method]\nmultiple = \"exact\"\n",
    );
    let plan = Request::open(&path)
        .expect("a scene")
        .plan()
        .expect("a plan");
    check(&plan.scene.mesh);
    assert_eq!(plan.multiple, Multiple::Exact);
    let (lo, hi) = plan.scene.mesh.bounding_box().expect("vertices");
    assert_eq!((lo, hi), (DVec3::ZERO, DVec3::splat(10.0)));
}

#[test]
fn the_unit_scales_mesh_and_camera_alike() {
    let mut request = Request::statue();
    let one = request.plan().expect("a plan").scene;
    request.unit = 7.0;
    let seven = request.plan().expect("a plan").scene;
    let view = |scene: &marmor::scene::Scene| scene.camera.eye - scene.mesh.center();
    let difference = view(&seven) - 7.0 * view(&one);
    assert!(difference.length() < 1e-9 * view(&seven).length());
}

#[test]
fn a_moved_mesh_is_seen_the_same() {
    let folder = folder();
    let tetrahedron = |shift: f64| {
        let mut text = String::new();
        for p in [[0., 0., 0.], [4., 0., 0.], [0., 4., 0.], [0., 0., 4.]] {
            text += &format!(
                "v {} {} {}\n",
                p[0] + shift,
                p[1] - shift,
                p[2] + 2.0 * shift
            );
        }
        text + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    };
    let scene = |name: &str, shift| {
        let path = file(folder.path(), name, tetrahedron(shift));
        Request::open(&path)
            .expect("a scene")
            .plan()
            .expect("a plan")
            .scene
    };
    let (here, there) = (scene("a.obj", 0.0), scene("b.obj", 64.0));
    let shift = DVec3::new(64.0, -64.0, 128.0);
    assert!((there.camera.eye - here.camera.eye - shift).length() < 1e-9);
    assert!((there.camera.target - here.camera.target - shift).length() < 1e-9);
    for (a, b) in here.mesh.normals.iter().zip(&there.mesh.normals) {
        assert!((*a - *b).length() < 1e-12);
    }
}

#[test]
fn the_documented_schema_is_the_schema() {
    let document = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/scene.md"));
    let moving = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/animation.md"));
    // Every example in the documentation is a scene that loads.
    let mut examples = 0;
    let blocks = |document: &'static str| document.split("```toml\n").skip(1);
    for block in blocks(document).chain(blocks(moving)) {
        let text = block.split("```").next().expect("a block");
        marmor::scene::file::parse(text, "docs/scene.md", Path::new(""))
            .unwrap_or_else(|error| panic!("{error} in\n{text}"));
        examples += 1;
    }
    assert!(examples >= 7, "{examples}");
    for name in preset::NAMES {
        assert!(document.contains(name), "{name}");
    }
}

#[test]
fn the_documented_defaults_are_the_defaults() {
    use marmor::scene::defaults as d;
    let document = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/scene.md"));
    let default = |section: &str, key: &str| -> f64 {
        let (_, rest) = document
            .split_once(&format!("## `[{section}]`"))
            .expect("the section");
        let rest = rest.split("\n## ").next().expect("its text");
        let row = rest
            .lines()
            .find(|line| line.starts_with(&format!("| `{key}` |")))
            .unwrap_or_else(|| panic!("[{section}] has no {key}"));
        let cell = row.trim_end_matches([' ', '|']).rsplit('|').next();
        cell.expect("a last cell").trim().parse().expect("a number")
    };
    for (section, key, value) in [
        ("light", "azimuth", d::LIGHT_AZIMUTH),
        ("light", "elevation", d::LIGHT_ELEVATION),
        ("camera", "azimuth", d::CAMERA_AZIMUTH),
        ("camera", "elevation", d::CAMERA_ELEVATION),
        ("camera", "fov", d::CAMERA_FOV),
        ("animation", "fps", d::FPS),
        ("method", "samples", f64::from(d::SAMPLES)),
        ("method", "light_map", f64::from(d::LIGHT_MAP)),
        ("method", "frames_averaged", f64::from(d::FRAMES_AVERAGED)),
    ] {
        assert_eq!(default(section, key), value, "[{section}] {key}");
    }
}
