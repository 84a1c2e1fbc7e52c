//! Multiple scattering by square rings, as published.

use glam::DVec3;

use super::{Receiver, Shading, multiple};

/// Mean distance of the points of a square from its middle, in half sides: (sqrt 2 + asinh 1) / 3.
const SQUARE_RADIUS: f64 = 0.765_195_716;
/// The same for the ring between squares of half sides 1/2 and 1.
const RING_RADIUS: f64 = 0.892_728_336;
/// Least variance of depth, in squared texels: bilinear taps of a slope of 45 degrees have as much.
const VARIANCE_MIN: f64 = 0.25;

/// M by `rings` square rings: E0 sum R_d(r_i) I_i, the light I_i on ring i being the difference of
/// two levels of the box pyramid (Bouthors et al. 2007, section 3).
///
/// What is lit at the depth of the receiver is Chebyshev's bound on the share of a square that
/// lies at least as deep (Donnelly and Lauritzen 2006, equation 5).
pub fn rings(shading: &Shading, receiver: &Receiver, rings: u32) -> DVec3 {
    let frame = &shading.map.frame;
    let q = frame.to_light_space(receiver.p);
    let st = frame.to_texel(q.truncate());
    let z_p = (q.z - frame.z_center) / frame.z_half;
    let least = VARIANCE_MIN * (frame.texel / frame.z_half).powi(2);
    let (mut sum, mut inner) = (DVec3::ZERO, 0.0);
    for (k, level) in (0..rings).zip(&shading.boxes) {
        let side = f64::from(1 << k);
        let [w, wz, wz2, _] = level.tap(st / side);
        let mean = wz / w.max(1e-6);
        let variance = (wz2 / w.max(1e-6) - mean * mean).max(least);
        let behind = (z_p - mean).max(0.0);
        let outer = side * side * w * variance / (variance + behind * behind);
        let radius = if k == 0 { SQUARE_RADIUS } else { RING_RADIUS } * 0.5 * side * frame.texel;
        sum += (outer - inner).max(0.0) * multiple::r_d(shading, radius * radius);
        inner = outer;
    }
    shading.irradiance * frame.texel_area() * sum
}
