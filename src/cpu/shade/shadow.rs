//! The shadow test of what is not spread by scattering.

use glam::{DVec2, DVec3};

use crate::cpu::LightMap;
use crate::cpu::light::{depth_of, normalised_depth};

/// Share of the light, in [0, 1], that reaches the point `p` (mm) with unit normal `n`.
///
/// Four texels are compared and blended bilinearly. 0 where `n` faces away from the light.
/// Against self-shadowing `p` is moved along `n` by texel (0.5 + 1.5 sin(theta)): the steeper
/// the light, the further a texel reaches along the surface.
pub fn visibility(map: &LightMap, p: DVec3, n: DVec3) -> f64 {
    let frame = &map.frame;
    let cos = n.dot(frame.to_light);
    if cos <= 0.0 {
        return 0.0;
    }
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let q = frame.to_light_space(p + n * (frame.texel * (0.5 + 1.5 * sin)));
    let reference = depth_of(normalised_depth(frame, q.z));
    let t = frame.to_texel(q.truncate()) - 0.5;
    let (corner, f) = (t.floor(), t - t.floor());
    let lit = |dx: f64, dy: f64| {
        let DVec2 { x, y } = corner + DVec2::new(dx, dy);
        if reference <= map.depth_at(x, y) {
            1.0
        } else {
            0.0
        }
    };
    let top = (1.0 - f.x) * lit(0.0, 0.0) + f.x * lit(1.0, 0.0);
    let bottom = (1.0 - f.x) * lit(0.0, 1.0) + f.x * lit(1.0, 1.0);
    (1.0 - f.y) * top + f.y * bottom
}
