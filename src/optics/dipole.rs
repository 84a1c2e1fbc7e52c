//! The classical diffusion dipole: how far light spreads below the surface.

use std::f64::consts::PI;

use crate::optics::fresnel;

/// Diffusion dipole of one colour channel of a homogeneous medium.
///
/// A beam that enters the medium is replaced by an isotropic source at depth z_r below the
/// point of entry and a negative image of it at height z_v above, which together make the
/// fluence vanish on an extrapolated boundary.
///
/// Source: Jensen, Marschner, Levoy and Hanrahan 2001, section 2.1, equation 4.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dipole {
    /// Reduced extinction sigma_t' = sigma_s' + sigma_a, mm^-1.
    pub sigma_t: f64,
    /// Reduced albedo alpha' = sigma_s' / sigma_t', in [0, 1].
    pub alpha_prime: f64,
    /// Effective transport coefficient sigma_tr = sqrt(3 sigma_a sigma_t'), mm^-1.
    pub sigma_tr: f64,
    /// Depth of the real source, one transport mean free path 1 / sigma_t', mm.
    pub z_r: f64,
    /// Height of the virtual source, z_r (1 + 4A/3), mm.
    pub z_v: f64,
}

impl Dipole {
    /// Dipole of a medium with reduced scattering `sigma_s` and absorption `sigma_a` (mm^-1,
    /// both >= 0, not both 0) and relative index `eta` >= 1.
    ///
    /// The arguments are not checked here: they are when a material is read.
    pub fn new(sigma_s: f64, sigma_a: f64, eta: f64) -> Self {
        let sigma_t = sigma_s + sigma_a;
        let z_r = 1.0 / sigma_t;
        Dipole {
            sigma_t,
            alpha_prime: sigma_s / sigma_t,
            sigma_tr: (3.0 * sigma_a * sigma_t).sqrt(),
            z_r,
            z_v: z_r * (1.0 + 4.0 / 3.0 * fresnel::boundary(eta)),
        }
    }

    /// The dipole as a sum over texels of side `texel` (mm) can resolve it: its real source lies
    /// a texel deep where it lay higher.
    ///
    /// A sum over a lattice of pitch a aliases what is narrower, by e^(-2 pi z_r / a) for the kernel
    /// z_r / (r^2 + z_r^2)^(3/2) that R_d is near its peak: 0.2 % a neighbour at z_r = a, but visible
    /// dots below. This blurs by less than a texel instead, in dense media only. The virtual source
    /// rises by as much as the real one sinks, which keeps the tail, proportional to z_r + z_v, and
    /// alpha' keeps the energy phi(0). The two meet where z_r + z_v < 2 a; then some dots remain.
    pub fn resolved(self, texel: f64) -> Self {
        // What scatters nothing has no energy to keep.
        if self.z_r >= texel || self.alpha_prime == 0.0 {
            return self;
        }
        let both = self.z_r + self.z_v;
        let z_r = texel.min(0.5 * both);
        let deeper = Dipole {
            z_r,
            z_v: both - z_r,
            ..self
        };
        Dipole {
            alpha_prime: self.alpha_prime * self.phi(0.0) / deeper.phi(0.0),
            ..deeper
        }
    }

    /// Diffuse reflectance R_d (mm^-2) at distance `r` (mm) from the point of entry.
    pub fn r_d(&self, r: f64) -> f64 {
        self.r_d_squared(r * r)
    }

    /// [`r_d`](Self::r_d) of the squared distance `r2` (mm^2): the renderer has no use for r
    /// itself.
    pub fn r_d_squared(&self, r2: f64) -> f64 {
        let source = |z: f64| {
            let d2 = r2 + z * z;
            let d = d2.sqrt();
            let optical = self.sigma_tr * d;
            z * (1.0 + optical) * (-optical).exp() / (d2 * d)
        };
        self.alpha_prime / (4.0 * PI) * (source(self.z_r) + source(self.z_v))
    }

    /// Total diffuse reflectance R_tot: the integral of R_d over the plane, in closed form.
    ///
    /// R_tot = alpha'/2 (1 + e^(-4A/3 sqrt(3(1-alpha')))) e^(-sqrt(3(1-alpha'))).
    ///
    /// Source: Jensen et al. 2001, section 2.4, the BRDF approximation.
    pub fn total(&self) -> f64 {
        self.phi(0.0)
    }

    /// Reflectance Phi(s) that is left outside the circle of squared radius `s` (mm^2).
    ///
    /// Phi(s) = alpha'/2 sum_j z_j e^(-sigma_tr sqrt(s + z_j^2)) / sqrt(s + z_j^2), so that
    /// Phi(0) = R_tot and dPhi/ds = -pi R_d(sqrt(s)).
    pub fn phi(&self, s: f64) -> f64 {
        let source = |z: f64| {
            let d = (s + z * z).sqrt();
            z * (-self.sigma_tr * d).exp() / d
        };
        0.5 * self.alpha_prime * (source(self.z_r) + source(self.z_v))
    }

    /// Integral of R_d over a half-plane whose edge passes at distance `h` >= 0 (mm).
    ///
    /// This is what a point in shadow receives at distance h from a straight shadow edge.
    /// Integration by parts turns int_h^inf R_d(r) 2 acos(h/r) r dr into 1/pi int_0^inf Phi(h^2
    /// cosh^2 t) / cosh t dt. That integrand is even and analytic in the strip |Im t| < pi/2,
    /// where the trapezoidal rule converges exponentially, to about 1e-15 of R_tot with the
    /// step of 1/4 used here.
    pub fn beyond(&self, h: f64) -> f64 {
        const STEP: f64 = 0.25;
        // 1/cosh t has fallen below 1e-17 at the last node.
        const NODES: u32 = 160;
        let node = |k: u32| {
            let cosh = (STEP * f64::from(k)).cosh();
            self.phi(h * h * cosh * cosh) / cosh
        };
        STEP / PI * (0.5 * node(0) + (1..=NODES).map(node).sum::<f64>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Marble's red channel.
    fn marble() -> Dipole {
        Dipole::new(2.19, 0.0021, 1.5)
    }

    #[test]
    fn total_matches_the_form_in_alpha_prime() {
        // R_tot = alpha'/2 (1 + e^(-4A sqrt(3(1-alpha'))/3)) e^(-sqrt(3(1-alpha'))).
        for (sigma_s, sigma_a) in [(2.19, 0.0021), (0.18, 0.061), (0.03, 1.45), (11.6, 0.0)] {
            let dipole = Dipole::new(sigma_s, sigma_a, 1.3);
            let root = (3.0 * (1.0 - dipole.alpha_prime)).sqrt();
            let edge = (-4.0 / 3.0 * fresnel::boundary(1.3) * root).exp();
            let expected = 0.5 * dipole.alpha_prime * (1.0 + edge) * (-root).exp();
            assert!((dipole.total() - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn phi_falls_at_the_rate_of_r_d() {
        let dipole = marble();
        for s in [0.01, 0.3, 4.0, 90.0] {
            let step = 1e-4 * s;
            let slope = (dipole.phi(s + step) - dipole.phi(s - step)) / (2.0 * step);
            let expected = -PI * dipole.r_d_squared(s);
            assert!(
                (slope / expected - 1.0).abs() < 1e-6,
                "{s}: {slope} {expected}"
            );
        }
    }

    #[test]
    fn half_of_the_light_lies_beyond_a_line_through_the_entry() {
        let dipole = marble();
        assert!((dipole.beyond(0.0) - 0.5 * dipole.total()).abs() < 1e-14);
    }

    #[test]
    fn a_medium_that_does_not_scatter_is_black() {
        let dipole = Dipole::new(0.0, 1.0, 1.3);
        assert_eq!((dipole.total(), dipole.r_d(0.5)), (0.0, 0.0));
        assert_eq!(dipole.resolved(5.0), dipole);
    }

    #[test]
    fn a_coarse_map_blurs_but_loses_nothing() {
        let spectralon = Dipole::new(20.4, 0.0, 1.3);
        let cream = Dipole::new(7.38, 0.0002, 1.3);
        for (dipole, texel) in [(spectralon, 0.17), (cream, 0.5)] {
            let blurred = dipole.resolved(texel);
            assert!(blurred.z_r > dipole.z_r && blurred.z_r <= texel);
            assert!((blurred.phi(0.0) / dipole.phi(0.0) - 1.0).abs() < 1e-12);
            // Beyond some texels it is the same profile.
            let far = 10.0 * texel;
            assert!((blurred.phi(far * far) / dipole.phi(far * far) - 1.0).abs() < 0.02);
            // And a lattice sums it to its energy, wherever the receiver stands: the sum over
            // 401^2 texels around it, plus what lies beyond.
            for shift in [0.0, 0.25, 0.5] {
                let sum = |d: &Dipole| -> f64 {
                    let at = |i: i32, j: i32| {
                        let (x, y) = (f64::from(i) + shift, f64::from(j) + shift);
                        d.r_d_squared((x * x + y * y) * texel * texel)
                    };
                    (-200..=200)
                        .flat_map(|i| (-200..=200).map(move |j| (i, j)))
                        .map(|(i, j)| at(i, j))
                        .sum::<f64>()
                        * texel
                        * texel
                };
                let inside = 200.5 * texel;
                let beyond = blurred.phi(inside * inside);
                let error = (sum(&blurred) + beyond) / blurred.phi(0.0) - 1.0;
                // Poisson summation: the four nearest and four diagonal frequencies of the lattice.
                let alias = |k: f64| 4.0 * (-std::f64::consts::TAU * k * blurred.z_r / texel).exp();
                let bound = alias(1.0) + alias(2_f64.sqrt()) + 2e-3;
                assert!(error.abs() < bound, "shift {shift}: {error}");
            }
        }
        assert_eq!(cream.resolved(0.1), cream);
    }
}
