//! Cameras that orbit a mesh and fit it into the picture.

use super::{Camera, defaults};
use glam::{DQuat, DVec2, DVec3};

/// Where the camera stands, as a scene file or a flag says it.
#[derive(Clone, Debug, PartialEq)]
pub enum Viewpoint {
    /// On a sphere around the target.
    Orbit {
        /// Degrees around +Y, counted from +Z towards +X.
        azimuth: f64,
        /// Degrees above the horizon, in [-90, 90].
        elevation: f64,
        /// From the target, mm; none fits the mesh into the picture.
        distance: Option<f64>,
        /// The point at the middle of the picture, mm; none centres the mesh.
        target: Option<DVec3>,
    },
    /// At a point.
    At {
        /// Position, mm.
        eye: DVec3,
        /// The point at the middle of the picture, mm.
        target: DVec3,
        /// Direction that is up in the picture.
        up: DVec3,
    },
}

impl Default for Viewpoint {
    fn default() -> Self {
        Viewpoint::Orbit {
            azimuth: defaults::CAMERA_AZIMUTH,
            elevation: defaults::CAMERA_ELEVATION,
            distance: None,
            target: None,
        }
    }
}

/// A viewpoint at one instant, and its vertical field of view, degrees.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Turned {
    pub viewpoint: Viewpoint,
    pub fov: f64,
}

impl Viewpoint {
    /// Turned by `degrees` about the vertical through its target.
    #[must_use]
    pub(super) fn turned(&self, degrees: f64) -> Viewpoint {
        match *self {
            Viewpoint::Orbit {
                azimuth,
                elevation,
                distance,
                target,
            } => Viewpoint::Orbit {
                azimuth: azimuth + degrees,
                elevation,
                distance,
                target,
            },
            Viewpoint::At { eye, target, up } => {
                let turn = DQuat::from_rotation_y(degrees.to_radians());
                Viewpoint::At {
                    eye: target + turn * (eye - target),
                    target,
                    up: turn * up,
                }
            }
        }
    }

    /// The same, with `target` at the middle of the picture where it has no target of its own.
    #[must_use]
    pub(super) fn around(&self, target: DVec3) -> Viewpoint {
        let mut viewpoint = self.clone();
        if let Viewpoint::Orbit { target: own, .. } = &mut viewpoint {
            own.get_or_insert(target);
        }
        viewpoint
    }

    /// The camera there, at `distance` (mm) from `target` where it has no distance or target of its own: of a viewpoint
    /// that [`Viewpoint::camera`] has found usable.
    pub(super) fn placed(&self, fov: f64, target: DVec3, distance: f64) -> Camera {
        match *self {
            Viewpoint::At { eye, target, up } => Camera {
                eye,
                target,
                up,
                fov,
            },
            Viewpoint::Orbit {
                azimuth,
                elevation,
                distance: own_distance,
                target: own_target,
            } => {
                let frame = Frame::looking_back(azimuth, elevation);
                let target = own_target.unwrap_or(target);
                Camera {
                    eye: target - frame.forward * own_distance.unwrap_or(distance),
                    target,
                    up: frame.up,
                    fov,
                }
            }
        }
    }

    /// The camera there, with vertical field of view `fov` (degrees), for a picture of
    /// `size` pixels of a mesh whose vertices are `positions` (mm).
    ///
    /// Without a distance the mesh fills [`defaults::CAMERA_FILL`] of the width or the
    /// height, measured where its vertices really project to.
    ///
    /// # Errors
    /// A phrase that names what leaves the camera without a direction.
    pub fn camera(&self, fov: f64, size: [u32; 2], positions: &[DVec3]) -> Result<Camera, String> {
        match *self {
            Viewpoint::At { eye, target, up } => {
                let Some(forward) = (target - eye).try_normalize() else {
                    return Err("eye and target are the same point; move one of them".to_owned());
                };
                let up_is_along = up
                    .try_normalize()
                    .is_none_or(|up| up.cross(forward).length() < 1e-6);
                if up_is_along {
                    return Err(
                        "up is zero or points along the view; choose another direction, \
                         such as [0, 1, 0]"
                            .to_owned(),
                    );
                }
                // It has a target and a distance of its own.
                Ok(self.placed(fov, target, 0.0))
            }
            Viewpoint::Orbit {
                azimuth,
                elevation,
                distance,
                target,
            } => {
                let frame = Frame::looking_back(azimuth, elevation);
                let half = slopes(fov, size);
                let (target, distance) = match (target, distance) {
                    (Some(target), Some(distance)) => (target, distance),
                    (None, Some(distance)) => (middle(positions), distance),
                    (Some(target), None) => (target, frame.fit_around(target, half, positions)),
                    (None, None) => frame.fit(half, positions),
                };
                Ok(self.placed(fov, target, distance))
            }
        }
    }
}

/// Tangents of half the angles that the mesh may fill, across and up.
fn slopes(fov: f64, [width, height]: [u32; 2]) -> DVec2 {
    let up = (0.5 * fov.to_radians()).tan() * defaults::CAMERA_FILL;
    DVec2::new(up * f64::from(width) / f64::from(height.max(1)), up)
}

fn middle(positions: &[DVec3]) -> DVec3 {
    let mut lo = DVec3::INFINITY;
    let mut hi = DVec3::NEG_INFINITY;
    for &p in positions {
        lo = lo.min(p);
        hi = hi.max(p);
    }
    if lo.x <= hi.x {
        0.5 * (lo + hi)
    } else {
        DVec3::ZERO
    }
}

/// The axes of a camera.
struct Frame {
    right: DVec3,
    up: DVec3,
    forward: DVec3,
}

impl Frame {
    /// The frame of a camera that stands at (azimuth, elevation) and looks at the middle.
    fn looking_back(azimuth: f64, elevation: f64) -> Frame {
        let (sin_a, cos_a) = azimuth.to_radians().sin_cos();
        let (sin_e, cos_e) = elevation.to_radians().sin_cos();
        // Up is the direction in which the camera moves when its elevation grows: upright
        // everywhere, and still defined straight above and below.
        Frame {
            right: DVec3::new(cos_a, 0.0, -sin_a),
            up: DVec3::new(-sin_a * sin_e, cos_e, -cos_a * sin_e),
            forward: -DVec3::new(sin_a * cos_e, sin_e, cos_a * cos_e),
        }
    }

    /// (right, up, forward) coordinates.
    fn resolve(&self, p: DVec3) -> DVec3 {
        DVec3::new(self.right.dot(p), self.up.dot(p), self.forward.dot(p))
    }

    /// Target and distance that make the mesh as large as it may be.
    ///
    /// A point (x, y, z) lies between the left and right planes of an eye at (a, b, c)
    /// when |x - a| <= s (z - c). Over all points that is a >= max(x - s z) + s c and
    /// a <= -max(-x - s z) - s c, so the eye nearest to the mesh has
    /// 2 s c = -max(x - s z) - max(-x - s z), and a is the middle of what is left.
    fn fit(&self, half: DVec2, positions: &[DVec3]) -> (DVec3, f64) {
        let mut above = DVec2::NEG_INFINITY;
        let mut below = DVec2::NEG_INFINITY;
        for &p in positions {
            let q = self.resolve(p);
            let reach = half * q.z;
            above = above.max(q.truncate() - reach);
            below = below.max(-q.truncate() - reach);
        }
        let across = 0.5 * (above - below);
        let back = (-0.5 * (above + below) / half).min_element();
        let depth = self.forward.dot(middle(positions));
        let distance = depth - back;
        if !(distance > 0.0 && across.is_finite()) {
            return (middle(positions), 1.0);
        }
        let target = self.right * across.x + self.up * across.y + self.forward * depth;
        (target, distance)
    }

    /// Distance from a given target at which the mesh just fits.
    fn fit_around(&self, target: DVec3, half: DVec2, positions: &[DVec3]) -> f64 {
        let nearest = positions
            .iter()
            .map(|&p| {
                let q = self.resolve(p - target);
                q.z - (q.truncate().abs() / half).max_element()
            })
            .fold(f64::INFINITY, f64::min);
        // A mesh entirely behind the target would put the eye beyond it.
        if nearest < 0.0 { -nearest } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Projects to the picture: (-1, -1) to (1, 1) are its corners.
    fn project(camera: &Camera, size: [u32; 2], p: DVec3) -> DVec2 {
        let view = camera.view(size[0], size[1], DVec3::ZERO, 100.0, DVec2::ZERO);
        let clip = view.view_proj * p.extend(1.0);
        assert!(clip.w > 0.0, "{p} is behind the camera");
        clip.truncate().truncate() / clip.w
    }

    fn extent(camera: &Camera, size: [u32; 2], positions: &[DVec3]) -> (DVec2, DVec2) {
        positions
            .iter()
            .map(|&p| project(camera, size, p))
            .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(lo, hi), p| {
                (lo.min(p), hi.max(p))
            })
    }

    fn points() -> Vec<DVec3> {
        // A lopsided cloud, away from the origin.
        (0..200)
            .map(|i| {
                let t = f64::from(i);
                DVec3::new(
                    5.0 + 4.0 * (t * 0.7).sin(),
                    -3.0 + 0.09 * t,
                    2.0 * (t * 1.3).cos(),
                )
            })
            .collect()
    }

    #[test]
    fn the_mesh_fills_nine_tenths_of_one_side_and_no_more_of_the_other() {
        let positions = points();
        for size in [[800, 600], [600, 800], [64, 64], [1000, 100]] {
            for (azimuth, elevation) in [(30.0, 10.0), (0.0, 90.0), (-120.0, -90.0), (200.0, -45.0)]
            {
                for fov in [5.0, 30.0, 90.0] {
                    let viewpoint = Viewpoint::Orbit {
                        azimuth,
                        elevation,
                        distance: None,
                        target: None,
                    };
                    let camera = viewpoint.camera(fov, size, &positions).expect("a camera");
                    let (lo, hi) = extent(&camera, size, &positions);
                    let furthest = lo.abs().max(hi.abs());
                    assert!(furthest.max_element() < 0.9 + 1e-9, "{lo} {hi}");
                    // The tight side touches both of its margins.
                    let touches =
                        |lo: f64, hi: f64| (lo + 0.9).abs() < 1e-9 && (hi - 0.9).abs() < 1e-9;
                    assert!(touches(lo.x, hi.x) || touches(lo.y, hi.y), "{lo} {hi}");
                }
            }
        }
    }

    #[test]
    fn a_given_target_stays_in_the_middle() {
        let positions = points();
        let target = DVec3::new(4.0, 0.0, 0.0);
        let viewpoint = Viewpoint::Orbit {
            azimuth: 30.0,
            elevation: 10.0,
            distance: None,
            target: Some(target),
        };
        let camera = viewpoint
            .camera(30.0, [800, 600], &positions)
            .expect("a camera");
        let (lo, hi) = extent(&camera, [800, 600], &positions);
        assert!((lo.abs().max(hi.abs()).max_element() - 0.9).abs() < 1e-9);
        assert!(project(&camera, [800, 600], target).length() < 1e-9);
    }

    #[test]
    fn the_camera_stands_where_light_of_the_same_angles_comes_from() {
        let viewpoint = Viewpoint::Orbit {
            azimuth: 40.0,
            elevation: 20.0,
            distance: Some(7.0),
            target: Some(DVec3::ZERO),
        };
        let camera = viewpoint.camera(30.0, [8, 6], &points()).expect("a camera");
        let light = super::super::Light {
            azimuth: 40.0,
            elevation: 20.0,
            irradiance: 1.0,
            color: DVec3::ONE,
        };
        assert!((camera.eye - 7.0 * light.to_light()).length() < 1e-12);
    }

    #[test]
    fn cameras_without_a_direction_are_refused() {
        let at = |eye, up| Viewpoint::At {
            eye,
            target: DVec3::ZERO,
            up,
        };
        let camera = |viewpoint: Viewpoint| viewpoint.camera(30.0, [8, 6], &[]);
        assert!(camera(at(DVec3::ZERO, DVec3::Y)).is_err_and(|e| e.contains("same point")));
        assert!(camera(at(DVec3::Y, DVec3::Y)).is_err_and(|e| e.contains("along the view")));
        assert!(camera(at(DVec3::Z, DVec3::ZERO)).is_err_and(|e| e.contains("up is zero")));
        assert!(camera(at(DVec3::Z, DVec3::Y)).is_ok());
    }
}
