//! Reflection at the rough boundary.

use std::f64::consts::PI;

use glam::DVec3;

use crate::optics::fresnel;

/// Value (sr^-1, without the cosine) of the microfacet BRDF of a rough dielectric boundary.
///
/// `n`, `wo` and `wi` are unit vectors away from the surface, `alpha` in (0, 1] is the GGX
/// width (the roughness itself, not its square), `eta` the relative index. 0 unless both
/// directions lie above the surface.
///
/// Source: Walter, Marschner, Li and Torrance 2007, equations 20 (reflection) and 33 (GGX),
/// with the height-correlated masking and shadowing of Heitz 2014, section 5.3, and exact
/// Fresnel reflectance at the half vector.
pub fn ggx(n: DVec3, wo: DVec3, wi: DVec3, alpha: f64, eta: f64) -> f64 {
    let (cos_o, cos_i) = (n.dot(wo), n.dot(wi));
    if cos_o <= 0.0 || cos_i <= 0.0 {
        return 0.0;
    }
    let h = (wo + wi).normalize();
    let a2 = alpha * alpha;
    // D's denominator cos^2 (a^2 - 1) + 1, written with the sine: near the peak of a narrow
    // lobe the other form cancels.
    let sine2 = n.cross(h).length_squared();
    let base = a2 * (1.0 - sine2) + sine2;
    let distribution = a2 / (PI * base * base);
    // The visibility G / (4 cos_o cos_i), in which the foreshortening has cancelled.
    let masked = cos_i * (a2 + cos_o * cos_o * (1.0 - a2)).sqrt();
    let shadowed = cos_o * (a2 + cos_i * cos_i * (1.0 - a2)).sqrt();
    let visibility = 0.5 / (masked + shadowed);
    distribution * visibility * fresnel::reflectance(wi.dot(h), eta)
}
