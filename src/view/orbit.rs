//! What a drag of the mouse does to camera and light: pure functions.
//!
//! A viewpoint that was fitted, or stood at a point, becomes an orbit with a distance and a target of its own, lest the
//! picture breathe as it turns.

use crate::scene::{Camera, Light, Viewpoint};
use glam::DVec2;

/// Degrees that a drag over one point of the window turns the camera by: half a turn for the width of a small window.
const TURN: f64 = 0.3;
/// Degrees that it turns the light by.
const TURN_LIGHT: f64 = 0.4;
/// The camera stops short of the poles, where up has no direction.
const HIGHEST: f64 = 89.0;
/// How near and how far may the camera go, in radii of the object? Nearer it would be inside, further a dot.
const DISTANCES: [f64; 2] = [0.05, 50.0];

/// Azimuth and elevation (degrees) of the camera seen from its target, and its distance (mm).
fn angles(camera: &Camera) -> [f64; 3] {
    let from = camera.eye - camera.target;
    let distance = from.length();
    let azimuth = from.x.atan2(from.z).to_degrees();
    let elevation = (from.y / distance.max(1e-300)).clamp(-1.0, 1.0).asin();
    [azimuth, elevation.to_degrees(), distance]
}

/// The same azimuth (degrees) within half a turn.
pub fn around(azimuth: f64) -> f64 {
    (azimuth + 180.0).rem_euclid(360.0) - 180.0
}

fn orbit([azimuth, elevation, distance]: [f64; 3], camera: &Camera) -> Viewpoint {
    Viewpoint::Orbit {
        azimuth,
        elevation: elevation.clamp(-HIGHEST, HIGHEST),
        distance: Some(distance),
        target: Some(camera.target),
    }
}

/// The camera turned around its target by a drag of `by` (points, right and down): what is seen follows the pointer.
pub fn turned(camera: &Camera, by: DVec2) -> Viewpoint {
    let [azimuth, elevation, distance] = angles(camera);
    // A drag across the front wraps around, so that the numbers in the panel stay small.
    let azimuth = around(azimuth - TURN * by.x);
    orbit([azimuth, elevation + TURN * by.y, distance], camera)
}

/// The camera moved in the plane of the picture, so that what lies at its target follows a drag of `by` (points) in a
/// picture `height` points high.
pub fn panned(camera: &Camera, by: DVec2, height: f64) -> Viewpoint {
    let forward = (camera.target - camera.eye).normalize_or(-glam::DVec3::Z);
    let right = forward.cross(camera.up).normalize_or(glam::DVec3::X);
    let down = forward.cross(right);
    let distance = camera.eye.distance(camera.target);
    let point = 2.0 * distance * (0.5 * camera.fov.to_radians()).tan() / height.max(1.0);
    let shift = -point * (by.x * right + by.y * down);
    let moved = Camera {
        eye: camera.eye + shift,
        target: camera.target + shift,
        ..camera.clone()
    };
    orbit(angles(&moved), &moved)
}

/// The camera `factor` times as near, as far as an object of `radius` (mm) allows.
pub fn zoomed(camera: &Camera, factor: f64, radius: f64) -> Viewpoint {
    let [azimuth, elevation, distance] = angles(camera);
    let [nearest, furthest] = DISTANCES.map(|side| side * radius);
    // One that stands further out already is not pulled in.
    let distance = (distance / factor.max(1e-6)).clamp(nearest, furthest.max(distance));
    orbit([azimuth, elevation, distance], camera)
}

/// The light turned by a drag of `by` (points), as if one pushed the lamp.
pub fn turned_light(light: &Light, by: DVec2) -> Light {
    Light {
        azimuth: around(light.azimuth + TURN_LIGHT * by.x),
        elevation: (light.elevation - TURN_LIGHT * by.y).clamp(-90.0, 90.0),
        ..light.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn camera() -> Camera {
        Camera {
            eye: DVec3::new(3.0, 4.0, 12.0),
            target: DVec3::new(1.0, 1.0, 1.0),
            up: DVec3::Y,
            fov: 30.0,
        }
    }

    fn placed(viewpoint: &Viewpoint) -> Camera {
        let any = [DVec3::ZERO, DVec3::ONE];
        viewpoint.camera(30.0, [100, 100], &any).expect("a camera")
    }

    #[test]
    fn a_drag_of_nothing_changes_nothing() {
        for viewpoint in [
            turned(&camera(), DVec2::ZERO),
            panned(&camera(), DVec2::ZERO, 100.0),
            zoomed(&camera(), 1.0, 10.0),
        ] {
            let placed = placed(&viewpoint);
            assert!(placed.eye.distance(camera().eye) < 1e-12, "{placed:?}");
            assert!(placed.target.distance(camera().target) < 1e-12);
        }
    }

    #[test]
    fn what_is_seen_follows_the_pointer() {
        // A point in front of the target, on the viewer's side, seen in pixels of a picture 100 high.
        let seen = |camera: &Camera, p: DVec3| {
            let view = camera.view(100, 100, camera.target, 20.0, DVec2::ZERO);
            let clip = view.view_proj * p.extend(1.0);
            DVec2::new(clip.x, clip.y) / clip.w * 50.0
        };
        let toward = (camera().eye - camera().target).normalize();
        let near = camera().target + 2.0 * toward;
        for by in [
            DVec2::new(8.0, 0.0),
            DVec2::new(0.0, 8.0),
            DVec2::new(-5.0, 3.0),
        ] {
            let moved = seen(&placed(&turned(&camera(), by)), near) - seen(&camera(), near);
            assert!(
                moved.dot(by) > 0.9 * moved.length() * by.length(),
                "turned {by}: {moved}"
            );
            let moved = seen(&placed(&panned(&camera(), by, 100.0)), camera().target);
            assert!((moved - by).length() > 0.0, "the target moves along");
            let of_old = seen(&placed(&panned(&camera(), by, 100.0)), camera().target)
                - seen(&camera(), camera().target);
            assert!((of_old - by).length() < 1e-9, "panned {by}: {of_old}");
        }
    }

    #[test]
    fn the_camera_keeps_its_bounds() {
        let high = placed(&turned(&camera(), DVec2::new(0.0, 1e6)));
        let [_, elevation, _] = angles(&high);
        assert!((elevation - HIGHEST).abs() < 1e-9);
        let distance = |factor| {
            let camera = placed(&zoomed(&camera(), factor, 10.0));
            camera.eye.distance(camera.target)
        };
        assert!((distance(1e9) - 0.5).abs() < 1e-9);
        assert!((distance(1e-9) - 500.0).abs() < 1e-9);
        let own = camera().eye.distance(camera().target);
        assert!((distance(2.0) - 0.5 * own).abs() < 1e-9);
    }

    #[test]
    fn the_light_stays_in_its_range() {
        let light = Light {
            azimuth: 170.0,
            elevation: 80.0,
            irradiance: 1.0,
            color: DVec3::ONE,
        };
        let pushed = turned_light(&light, DVec2::new(100.0, -1000.0));
        assert_eq!(pushed.elevation, 90.0);
        assert!((pushed.azimuth - (170.0 + 40.0 - 360.0)).abs() < 1e-9);
    }
}
