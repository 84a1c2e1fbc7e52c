//! Multiple scattering as a mixture of Gaussians, one a level of the pyramid.

use glam::DVec3;

use super::{Receiver, Shading};
use crate::cpu::reduce::Level;
use crate::cpu::volume::Light;

/// Least and largest tan^2 of the receiver's slope that the depth spread below a kernel is held to.
const SLOPE: [f64; 2] = [0.03, 6.0];

/// Half of minus the excess kurtosis of a level's kernel: nine binomial weights have fourth cumulant
/// -1 and variance 2, what halves before and the tap after them -0.04 and 0.42, so 1.04 / 2.42^2.
///
/// It is not the surface's: a slope shows it in its depths, and would be taken for two surfaces (a plane
/// at 60 degrees comes out 1.7 % too dark). All of it serves the plane best, none the sphere.
const KERNEL: f64 = 0.089;

/// The variance of depth, over s^2, from which on a blended level believes its volume, and from which on it
/// believes nothing else.
const BLEND: [f64; 2] = [0.5, 2.0];

/// One level that the mixture taps.
#[derive(Clone, Debug)]
pub struct Tap {
    /// Number of the level: its texels are 2^level of the map's.
    pub level: u32,
    /// Standard deviation of its kernel, mm.
    pub s: f64,
    /// Its share W of R_tot, per channel.
    pub weight: DVec3,
    /// Whether it reads the fourth moment.
    pub fourth: bool,
    /// Smoothed moments (w, w z, w z^2, w z^3, w z^4), z normalised.
    pub smoothed: Level<5>,
}

/// One level whose volume the mixture taps.
#[derive(Clone, Debug)]
pub struct VolumeTap {
    /// Its share W of R_tot, per channel.
    pub weight: DVec3,
    /// The volume.
    pub light: Light,
}

/// Mean, variance and third central moment of depth under a kernel, normalised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Mean.
    pub m1: f64,
    /// Variance, floored where float32 would lose it.
    pub v: f64,
    /// Third central moment.
    pub c3: f64,
}

impl Spread {
    /// Of the moments (w, w z, w z^2, w z^3), as a level holds them.
    pub fn new(m: [f64; 5]) -> Self {
        let w = m[0].max(1e-6);
        let (m1, m2, m3) = (m[1] / w, m[2] / w, m[3] / w);
        let v = (m2 - m1 * m1).max(1.2e-7 * (m1 * m1 + 1e-3));
        let c3 = m3 - m1 * (m2 + 2.0 * v);
        Spread { m1, v, c3 }
    }

    /// The expectation of exp(-(z - z_p)^2 / (2 s^2)) over two Gaussians of common variance
    /// `var` <= v, which have the mean, the variance and the third moment of this.
    ///
    /// Two points of variance y = v - var and third moment c3 about their mean lie at x =
    /// (q +- sqrt(q^2 + 4 y)) / 2, q = c3 / y, and each weighs the other's distance to the mean.
    pub fn expectation(&self, z_p: f64, var: f64, s: f64) -> f64 {
        let s2 = s * s;
        let gaussian = |mu: f64| (s2 / (s2 + var)).sqrt() * (-mu * mu / (2.0 * (s2 + var))).exp();
        let (mu, y) = (self.m1 - z_p, self.v - var);
        if y <= 0.0 {
            return gaussian(mu);
        }
        // The same guard as on the GPU: far below a kernel's width two points are one.
        let q = self.c3 * y / (y * y + 1e-12 * s2 * s2);
        let root = (q * q + 4.0 * y).sqrt();
        let (far, near) = (0.5 * (q + root), 0.5 * (q - root));
        (far * gaussian(mu + near) - near * gaussian(mu + far)) / root
    }

    /// The common variance of the two Gaussians that have all four moments, `m4` being the
    /// fourth about 0; `fallback`, the variance that the receiver's slope alone would have, where
    /// float32 cannot carry it.
    pub fn common_variance(&self, m4: f64, fallback: f64) -> f64 {
        let Spread { m1, v, c3 } = *self;
        let c4 = m4 - m1 * (4.0 * c3 + m1 * (6.0 * v + m1 * m1));
        let kappa = c4 / (v * v) - 3.0 + KERNEL * (fallback / v).powi(2);
        let y = two_gaussians(c3 * c3 / v.powi(3), kappa);
        // The rounding of the moments, about 6e-8 of each term, against v^2.
        let rho = v * v / (8.0 * 6e-8 * (m1.powi(4) + 6.0 * m1 * m1 * v + 3.0 * v * v));
        let trust = (0.25 * (rho - 1.0)).clamp(0.0, 1.0);
        fallback + (v * (1.0 - y) - fallback) * trust
    }
}

/// The share Y, in [0, 1], of the variance that lies between two Gaussians of common variance with
/// the squared skewness `gamma2` and the excess kurtosis `kappa`: the positive root of
/// 2 Y^3 + kappa Y - gamma2 = 0, by two steps of Halley's from a guess in closed form.
pub fn two_gaussians(gamma2: f64, kappa: f64) -> f64 {
    let halley = |y: f64| {
        let f = y * (2.0 * y * y + kappa) - gamma2;
        let df = 6.0 * y * y + kappa;
        (y - f * df / (df * df - 6.0 * y * f + 1e-20)).clamp(0.0, 1.0)
    };
    let guess = (0.5 * ((-kappa).max(0.0) + 0.8 * gamma2.sqrt())).sqrt();
    halley(halley(guess.min(1.0)))
}

/// How much of a blended level's light is the volume's, by the depth's variance over s^2: nothing where it is
/// that of one surface, which moments describe without ripple; all where it is that of several.
fn trust(ratio: f64) -> f64 {
    let t = ((ratio - BLEND[0]) / (BLEND[1] - BLEND[0])).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// M as the sum over levels k: E0 sum_k W_k m0_k E_k, m0 the mean weight below the level's kernel
/// and E_k the expectation over its depths (DESIGN, multiple scattering). A volume holds their product.
///
/// With three moments the common variance of the two Gaussians is what the receiver's own slope
/// makes of the kernel's width; with four it follows from the moments.
pub fn mixture(shading: &Shading, receiver: &Receiver) -> DVec3 {
    let frame = &shading.map.frame;
    let q = frame.to_light_space(receiver.p);
    let st = frame.to_texel(q.truncate());
    let z_p = (q.z - frame.z_center) / frame.z_half;
    let cos2 = receiver.n.dot(frame.to_light).powi(2).max(1e-6);
    let slope = ((1.0 - cos2) / cos2).clamp(SLOPE[0], SLOPE[1]);
    let in_volume = st.extend(z_p * frame.z_half / frame.texel);
    let volume = |tap: &VolumeTap| tap.light.tap(tap.light.grid.place(in_volume));
    let blended = shading.taps.len() - shading.blended;
    // Mean weight and expectation of the finer level.
    let mut finer = [0.0, 0.0];
    let sum: DVec3 = shading
        .taps
        .iter()
        .enumerate()
        .map(|(i, tap)| {
            let m = tap.smoothed.tap(st / f64::from(1 << tap.level));
            let spread = Spread::new(m);
            let s = tap.s / frame.z_half;
            let mut var = spread.v.min(slope * s * s);
            if tap.fourth {
                var = spread.common_variance(m[4] / m[0].max(1e-6), var);
            }
            let least = shading.kept * finer[1] * m[0].min(finer[0]) / m[0].max(1e-6);
            finer = [m[0], spread.expectation(z_p, var, s).max(least)];
            if let Some(blended) = i.checked_sub(blended) {
                let light = volume(&shading.volumes[blended]);
                let trust = trust(spread.v / (s * s));
                finer[1] += trust * (light / m[0].max(1e-6) - finer[1]);
            }
            tap.weight * (finer[0] * finer[1])
        })
        .sum();
    let coarse = shading.volumes[shading.blended..].iter();
    let coarse: DVec3 = coarse.map(|tap| tap.weight * volume(tap)).sum();
    shading.irradiance * (sum + coarse)
}
