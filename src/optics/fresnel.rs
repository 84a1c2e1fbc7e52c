//! Fresnel's equations at a smooth dielectric boundary, and their diffuse average.
//!
//! `eta` is always the relative index of refraction: inside over outside.

/// Reflectance of unpolarised light that meets the boundary from outside.
///
/// `cos_i` is the cosine of incidence, clamped to [0, 1]; `eta` > 0. Returns the exact mean of
/// both polarisations, in [0, 1]; 1 where an `eta` below 1 reflects totally.
///
/// Source: Fresnel's equations, as in Born and Wolf, Principles of Optics, section 1.5.2.
pub fn reflectance(cos_i: f64, eta: f64) -> f64 {
    if eta == 1.0 {
        // There is no boundary, and at grazing incidence the ratios below would be 0/0.
        return 0.0;
    }
    let cos_i = cos_i.clamp(0.0, 1.0);
    let sin2_t = (1.0 - cos_i * cos_i) / (eta * eta);
    if sin2_t >= 1.0 {
        return 1.0;
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    let perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    0.5 * (perpendicular * perpendicular + parallel * parallel)
}

/// Transmittance Ft of the boundary: 1 - [`reflectance`], since a dielectric absorbs nothing.
pub fn transmittance(cos_i: f64, eta: f64) -> f64 {
    1.0 - reflectance(cos_i, eta)
}

/// Diffuse Fresnel reflectance Fdr seen from inside, for `eta` >= 1.
///
/// Source: the rational fit of Jensen, Marschner, Levoy and Hanrahan 2001, section 2.1.
pub fn diffuse_reflectance(eta: f64) -> f64 {
    -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta
}

/// The boundary term A = (1 + Fdr) / (1 - Fdr), for `eta` >= 1.
///
/// It moves the plane on which the fluence vanishes away from an index-mismatched boundary.
///
/// Source: Jensen et al. 2001, section 2.1.
pub fn boundary(eta: f64) -> f64 {
    let fdr = diffuse_reflectance(eta);
    (1.0 + fdr) / (1.0 - fdr)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_incidence_is_the_textbook_ratio() {
        for eta in [1.1, 1.3, 1.5, 2.4] {
            let expected = ((eta - 1.0_f64) / (eta + 1.0)).powi(2);
            assert!((reflectance(1.0, eta) - expected).abs() < 1e-15);
        }
    }

    #[test]
    fn grazing_light_is_reflected_whole() {
        assert!((reflectance(0.0, 1.3) - 1.0).abs() < 1e-15);
        assert_eq!(reflectance(-0.3, 1.3), reflectance(0.0, 1.3));
        assert_eq!(reflectance(1.7, 1.3), reflectance(1.0, 1.3));
    }

    #[test]
    fn parallel_light_passes_at_brewsters_angle() {
        // At Brewster's angle only the perpendicular half is left, and it is known in closed
        // form.
        let eta: f64 = 1.5;
        let cos_b = 1.0 / (1.0 + eta * eta).sqrt();
        let perpendicular = ((eta * eta - 1.0) / (eta * eta + 1.0)).powi(2);
        assert!((reflectance(cos_b, eta) - 0.5 * perpendicular).abs() < 1e-15);
    }

    #[test]
    fn a_thinner_medium_reflects_totally_beyond_the_critical_angle() {
        let eta: f64 = 1.0 / 1.5;
        let critical = (1.0 - eta * eta).sqrt();
        assert_eq!(reflectance(critical - 1e-6, eta), 1.0);
        assert!(reflectance(critical + 1e-3, eta) < 1.0);
    }

    #[test]
    fn no_boundary_reflects_nothing() {
        for i in 0..=10 {
            assert_eq!(reflectance(f64::from(i) / 10.0, 1.0), 0.0);
        }
    }

    #[test]
    fn light_path_is_reversible() {
        // What enters at cos_i leaves along cos_t with the same reflectance and inverse eta.
        let eta = 1.4;
        for i in 1..=20 {
            let cos_i = f64::from(i) / 20.0;
            let cos_t = (1.0 - (1.0 - cos_i * cos_i) / (eta * eta)).sqrt();
            let back = reflectance(cos_t, 1.0 / eta);
            assert!((reflectance(cos_i, eta) - back).abs() < 1e-12);
        }
    }

    #[test]
    fn diffuse_fit_follows_the_average_of_the_exact_reflectance() {
        // Fdr is the cosine-weighted mean of the reflectance from inside: 2 int F mu dmu.
        for eta in [1.1, 1.3, 1.5] {
            let n = 20_000;
            let mean: f64 = (0..n)
                .map(|i| {
                    let mu = (f64::from(i) + 0.5) / f64::from(n);
                    2.0 * mu * reflectance(mu, 1.0 / eta) / f64::from(n)
                })
                .sum();
            assert!(
                (diffuse_reflectance(eta) - mean).abs() < 0.02,
                "{eta}: {mean}"
            );
        }
    }
}
