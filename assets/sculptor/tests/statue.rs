//! The statue's meshes are closed, and the same at every run.

use sculptor::statue::Statue;
use sculptor::{SIZES, carve, obj};

/// A coarser lattice than the shipped one, to be quick.
const STEP: f32 = 0.4;

#[test]
fn the_meshes_are_closed_and_repeatable() {
    let statue = Statue::new();
    let first = carve(&statue, STEP).expect("carved");
    let second = carve(&statue, STEP).expect("carved again");
    for (piece, (name, count)) in first.iter().zip(SIZES) {
        assert_eq!(piece.name, name);
        piece.mesh.check().expect("closed");
        assert!(piece.mesh.triangles.len().abs_diff(count) * 20 <= count);
        let tall = piece.mesh.positions.iter().fold(0.0f32, |h, p| h.max(p.y));
        assert!((78.0..82.0).contains(&tall), "{tall} mm tall");
    }
    for (a, b) in first.iter().zip(&second) {
        let text = |p: &sculptor::Piece| obj::write(&p.mesh, &p.normals, "");
        assert!(text(a) == text(b), "{} differs between runs", a.name);
    }
}

#[test]
fn the_check_sees_a_hole_and_a_flipped_face() {
    let statue = Statue::new();
    let mut mesh = carve(&statue, 0.6).expect("carved").remove(2).mesh;
    mesh.check().expect("closed");
    let face = mesh.triangles.pop().expect("a face");
    assert!(mesh.check().is_err());
    mesh.triangles.push([face[1], face[0], face[2]]);
    assert!(mesh.check().is_err());
    mesh.triangles.pop();
    mesh.triangles.push(face);
    mesh.check().expect("whole again");
}
