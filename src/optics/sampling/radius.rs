//! Radii drawn in proportion to the dipole's profile, by inversion and without a table.
//!
//! The profile is a sum over the real and the virtual source. One of them is chosen by its
//! share, and its term is inverted with Lambert's W function. Seen across a depth gap T, the
//! distance to a point of the lit surface is sqrt(rho^2 + T^2), and rho is drawn from what Phi
//! leaves outside T.

use std::f64::consts::PI;

use crate::optics::Dipole;

/// Least sigma_tr (mm^-1) that radii are drawn and weighed with.
///
/// Without absorption the distribution has no mean. This floor cuts its tail off at 100 m,
/// where R_d no longer matters, and leaves the estimate unbiased, for the estimate divides by
/// the same pdf.
pub const MIN_SIGMA_TR: f64 = 1e-5;

/// Least probability that is left beyond a drawn radius: half a step of a 24-bit random number.
const MIN_TAIL: f64 = 5.960_464_477_539_063e-8;

/// Solves y + ln y = `b` for y > 0, that is y = W(e^b) with Lambert's W function.
///
/// The start value is, with x = e^b, x (1 + 0.28 x) / (1 + 1.28 x) for b <= 1/2 and b - ln(1 +
/// b) + 0.7 / (1 + 0.04 b) above; it is within 2.8 %. One iteration of fourth order brings the
/// relative error below 3e-9 for b in [-25, 60].
///
/// Source: Fritsch, Shafer and Crowley 1973, "Algorithm 443: Solution of the transcendental
/// equation w e^w = x", in the logarithmic form of Iacono and Boyd 2017.
pub fn solve(b: f64) -> f64 {
    let y = if b <= 0.5 {
        let x = b.exp();
        x * (1.0 + 0.28 * x) / (1.0 + 1.28 * x)
    } else {
        b - (1.0 + b).ln() + 0.7 / (1.0 + 0.04 * b)
    };
    let z = b - y.ln() - y;
    let q = 2.0 * (1.0 + y) * (1.0 + y + z * (2.0 / 3.0));
    y + y * z * (q - z) / ((1.0 + y) * (q - 2.0 * z))
}

/// Sampler of radii in the light plane for one dipole and one depth gap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadiusSampler {
    /// sigma_tr, at least [`MIN_SIGMA_TR`], mm^-1.
    sigma: f64,
    /// z_r and z_v, mm.
    z: [f64; 2],
    /// Squared depth gap T^2, mm^2.
    gap2: f64,
    /// Distances sqrt(T^2 + z_j^2) of the sources across the gap, mm.
    d_gap: [f64; 2],
    /// Share of the real source in Phi(T^2).
    share_r: f64,
    /// Factor that makes the density integrate to 1, mm.
    normalisation: f64,
}

impl RadiusSampler {
    /// Prepares the sampler for `dipole` and the depth gap `gap` (mm, >= 0).
    pub fn new(dipole: &Dipole, gap: f64) -> Self {
        let sigma = dipole.sigma_tr.max(MIN_SIGMA_TR);
        let z = [dipole.z_r, dipole.z_v];
        let gap2 = gap * gap;
        let d_gap = z.map(|z| (gap2 + z * z).sqrt());
        // Everything is relative to e^(-sigma d_gap[0]), since the exponentials themselves
        // underflow across a wide gap. alpha' cancels altogether.
        let phi_r = z[0] / d_gap[0];
        let phi_v = z[1] / d_gap[1] * (sigma * (d_gap[0] - d_gap[1])).exp();
        RadiusSampler {
            sigma,
            z,
            gap2,
            d_gap,
            share_r: phi_r / (phi_r + phi_v),
            normalisation: 1.0 / (2.0 * PI * (phi_r + phi_v)),
        }
    }

    /// The radius rho (mm) for the uniform random number `u` in [0, 1).
    pub fn sample(&self, u: f64) -> f64 {
        let (j, v) = if u < self.share_r {
            (0, u / self.share_r)
        } else {
            (1, (u - self.share_r) / (1.0 - self.share_r))
        };
        // d solves e^(-sigma d) / d = (1 - v) e^(-sigma d_gap) / d_gap; take logarithms, y =
        // sigma d.
        let y_gap = self.sigma * self.d_gap[j];
        let y = solve(y_gap + y_gap.ln() - (1.0 - v).max(MIN_TAIL).ln());
        ((y - y_gap) * (y + y_gap)).max(0.0).sqrt() / self.sigma
    }

    /// Density (mm^-2) with which [`sample`](Self::sample) and a uniform angle reach radius
    /// `rho` (mm): R_d(sqrt(rho^2 + T^2)) / Phi(T^2).
    pub fn pdf(&self, rho: f64) -> f64 {
        let source = |z: f64| {
            let d2 = rho * rho + self.gap2 + z * z;
            let d = d2.sqrt();
            z * (1.0 + self.sigma * d) * (self.sigma * (self.d_gap[0] - d)).exp() / (d2 * d)
        };
        self.normalisation * (source(self.z[0]) + source(self.z[1]))
    }
}

/// One radius (mm) for `u` in [0, 1) across the depth gap `gap` (mm): see
/// [`RadiusSampler::sample`].
pub fn sample_radius(dipole: &Dipole, u: f64, gap: f64) -> f64 {
    RadiusSampler::new(dipole, gap).sample(u)
}

/// The density (mm^-2) that goes with [`sample_radius`]: see [`RadiusSampler::pdf`].
pub fn pdf_area(dipole: &Dipole, rho: f64, gap: f64) -> f64 {
    RadiusSampler::new(dipole, gap).pdf(rho)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solve_inverts_y_plus_ln_y() {
        for i in 0..=8500 {
            let b = -25.0 + f64::from(i) / 100.0;
            // The residual in b is the relative error in y times (1 + y).
            let y = solve(b);
            let error = (y + y.ln() - b) / (1.0 + y);
            assert!(
                error.abs() < 3e-9,
                "b = {b}: y = {y}, relative error {error}"
            );
        }
    }

    #[test]
    fn pdf_is_the_profile_over_phi() {
        let dipole = Dipole::new(0.74, 0.032, 1.3);
        for gap in [0.0, 0.7, 6.0] {
            for rho in [0.0, 0.5, 3.0, 12.0] {
                let expected = dipole.r_d_squared(rho * rho + gap * gap) / dipole.phi(gap * gap);
                assert!((pdf_area(&dipole, rho, gap) / expected - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn wide_gaps_and_extreme_media_stay_finite() {
        for (sigma_s, sigma_a) in [(0.03, 1.45), (20.4, 0.0), (2.19, 0.0021)] {
            let dipole = Dipole::new(sigma_s, sigma_a, 1.3);
            for gap in [0.0, 1e-9, 1.0, 1e3, 1e6] {
                let sampler = RadiusSampler::new(&dipole, gap);
                for u in [0.0, 0.3, 0.999, 1.0 - f64::EPSILON, 1.0] {
                    let rho = sampler.sample(u);
                    let pdf = sampler.pdf(rho);
                    assert!(rho.is_finite() && rho >= 0.0, "{sigma_a} {gap} {u}: {rho}");
                    assert!(pdf.is_finite() && pdf > 0.0, "{sigma_a} {gap} {u}: {pdf}");
                }
            }
        }
    }
}
