//! Single scattering: light that is scattered once on its way from the surface back to it.
//!
//! Source: Bouthors, Bruneton, Neyret and Max 2007, section 2; Jensen, Marschner, Levoy and
//! Hanrahan 2001, section 2.3 (the refraction of the light's path).

use std::f64::consts::PI;

use glam::DVec3;

/// Thickness of the first step in mean free paths of the densest channel: how thin a layer below
/// the surface must be resolved?
pub const FIRST_STEP: f64 = 0.1;

/// Depth of the last step in mean free paths of the thinnest channel: what lies deeper is left to
/// the closed form of the tail.
pub const LAST_STEP: f64 = 4.0;

/// Where the lit surface moves by more than this many steps, it is not one surface: the
/// segment then interpolates what arrives instead of how far away the surface is.
pub const JUMP: f64 = 3.0;

/// By how many texels a point of the march must lie before the lit surface to be outside the object: less
/// may be a matter of where the texel's centre falls.
pub const CLEAR: f64 = 0.5;

/// Depths under one bilinear tap that vary by more than this many texels squared are those of two
/// surfaces: one that is inclined by less than 75 degrees varies less.
const EDGE: f64 = 4.0;

/// What float32 leaves of the variance of depths, in units of the half depth range squared.
const ROUNDING: f64 = 1e-6;

/// The variance from which depths under a bilinear tap are those of two surfaces, for texels of side
/// `texel`; both in units of the half depth range.
pub fn edge_variance(texel: f64) -> f64 {
    (EDGE * texel * texel).max(ROUNDING)
}

/// Phase function of Henyey and Greenstein, sr^-1, of mean cosine `g` in (-1, 1).
///
/// `cos` is that of the angle between the directions of travel before and after: 1 goes straight on.
///
/// Source: Henyey and Greenstein 1941. Over the sphere it integrates to 1.
pub fn henyey_greenstein(cos: f64, g: f64) -> f64 {
    let d = 1.0 + g * g - 2.0 * g * cos;
    (1.0 - g * g) / (4.0 * PI * d * d.sqrt())
}

/// The unit direction in which a ray that comes from the unit direction `wo` goes on below a surface
/// of unit normal `n` and relative index `eta` >= 1, by Snell's law.
///
/// A `wo` on the far side of `n`, as interpolated normals make it, is bent as if on this side.
pub fn refract(wo: DVec3, n: DVec3, eta: f64) -> DVec3 {
    let across = (wo - n * n.dot(wo)) / eta;
    -across - n * (1.0 - across.length_squared()).max(0.0).sqrt()
}

/// Length of the refracted path from the surface over that of the straight one towards the light,
/// for light that arrives at cosine `cos_i` in [0, 1].
///
/// Below a plane the refracted ray enters nearer to the point that it reaches, and the straight one
/// is longer: s' = s |cos_i| / sqrt(1 - (1 - cos_i^2) / eta^2).
///
/// Source: Jensen et al. 2001, section 2.3.
pub fn path_factor(cos_i: f64, eta: f64) -> f64 {
    if eta == 1.0 {
        return 1.0;
    }
    let cos_i = cos_i.clamp(0.0, 1.0);
    cos_i / (1.0 - (1.0 - cos_i * cos_i) / (eta * eta)).sqrt()
}

/// [`path_factor`] as a function of the transmittance Ft that the light map stores: the weight tells
/// the angle, so that no further texture need hold it.
///
/// Ft falls steadily from its value at normal incidence to 0 at grazing, where the factor is 1 and 0.
/// It starts with a vanishing slope: with x = sqrt(1 - Ft / Ft(1)) the factor is smooth, and
/// (1 - x) (1 + c_0 x + c_1 x^2 + c_2 x^3 + c_3 x^4) is fitted by least squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathFit {
    /// Ft at normal incidence.
    pub normal: f64,
    /// The coefficients c.
    pub c: [f64; 4],
}

impl PathFit {
    /// Fits the factor of a boundary of relative index `eta` >= 1.
    pub fn new(eta: f64) -> Self {
        let normal = super::fresnel::transmittance(1.0, eta);
        // Without a boundary every weight is 1, and the factor with it: 1 - x^5.
        let mut c = [1.0; 4];
        if eta > 1.0 {
            const POINTS: usize = 512;
            // Normal equations of the four coefficients; the unknown part is what the factor has
            // beyond 1 - x.
            let mut m = [[0.0; 5]; 4];
            for i in 0..POINTS {
                // Even in angle, so that the steep end near grazing has its share.
                let cos = (0.5 * PI * (i as f64 + 0.5) / POINTS as f64).cos();
                let x = (1.0 - super::fresnel::transmittance(cos, eta) / normal)
                    .max(0.0)
                    .sqrt();
                let basis: [f64; 4] = std::array::from_fn(|k| (1.0 - x) * x.powi(k as i32 + 1));
                let rest = path_factor(cos, eta) - (1.0 - x);
                for (row, b) in m.iter_mut().zip(basis) {
                    for (entry, other) in row.iter_mut().zip(basis) {
                        *entry += b * other;
                    }
                    row[4] += b * rest;
                }
            }
            c = solve(m);
        }
        PathFit { normal, c }
    }

    /// The factor at the stored weight `w` = coverage * Ft, in [0, 1].
    pub fn factor(&self, w: f64) -> f64 {
        let x = (1.0 - w / self.normal).clamp(0.0, 1.0).sqrt();
        let [c0, c1, c2, c3] = self.c;
        (1.0 - x) * (1.0 + x * (c0 + x * (c1 + x * (c2 + x * c3))))
    }
}

/// Solves four linear equations, their right-hand sides in the last column, by elimination; the
/// matrix is symmetric and positive definite, so no pivot is sought.
fn solve(mut m: [[f64; 5]; 4]) -> [f64; 4] {
    for i in 0..4 {
        let pivot = m[i];
        for row in &mut m[i + 1..] {
            let f = row[i] / pivot[i];
            for (entry, p) in row.iter_mut().zip(pivot) {
                *entry -= f * p;
            }
        }
    }
    let mut x = [0.0; 4];
    for i in (0..4).rev() {
        let known: f64 = (i + 1..4).map(|k| m[i][k] * x[k]).sum();
        x[i] = (m[i][4] - known) / m[i][i];
    }
    x
}

/// Exponentially spaced steps below the surface: x_i = first (growth^i - 1) / (growth - 1), mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steps {
    /// Length of the first step, mm.
    pub first: f64,
    /// ln of what each step is longer than the one before; 0 where all are equal.
    pub log_growth: f64,
}

impl Steps {
    /// The `count` steps that reach `far` mm, the first `first` mm long, or `far / count` where that
    /// is shorter.
    ///
    /// growth is the root of first (growth^count - 1) / (growth - 1) = far (DESIGN, single
    /// scattering). With u = ln growth the logarithm of the mean of growth^i is (n - 1)/2 u + (n^2 - 1)/24 u^2 near 0,
    /// n being the count, and (n - 1) u - ln n far out; the lesser root of the two is where Newton's method starts.
    pub fn new(first: f64, far: f64, count: u32) -> Self {
        let n = f64::from(count);
        let ratio = far / (n * first);
        if count < 2 || ratio <= 1.0 {
            return Steps {
                first: far / n,
                log_growth: 0.0,
            };
        }
        let target = ratio.ln();
        let (a, b) = ((n * n - 1.0) / 12.0, (n - 1.0) / 2.0);
        let near = ((b * b + 2.0 * a * target).sqrt() - b) / a;
        let mut u = near.min((target + n.ln()) / (n - 1.0));
        for _ in 0..NEWTON_STEPS {
            // ln of the mean of growth^i over i < count, and its derivative.
            let (up, one) = ((n * u).exp_m1(), u.exp_m1());
            let value = (up / (n * one)).ln() - target;
            let slope = n * (1.0 + 1.0 / up) - (1.0 + 1.0 / one);
            u = (u - value / slope).max(1e-4);
        }
        Steps {
            first,
            log_growth: u,
        }
    }

    /// x_i, mm; x_0 = 0.
    pub fn depth(&self, i: u32) -> f64 {
        if self.log_growth == 0.0 {
            self.first * f64::from(i)
        } else {
            self.first * (self.log_growth * f64::from(i)).exp_m1() / self.log_growth.exp_m1()
        }
    }
}

/// Newton's steps for the growth: after the second the depth is within 6e-6 for all counts and ratios that the limits of
/// materials allow, which is all that the shader's float32 carries; the third is for f64.
const NEWTON_STEPS: u32 = 3;

/// Mean of e^-A over a segment along which A goes linearly from `a0` to `a0 + b`, relative to e^-a0:
/// f(b) = (1 - e^-b) / b, by its series near 0.
///
/// Where A falls far, take it from the other end, e^-a0 f(b) = e^-(a0 + b) f(-b), or it overflows.
pub fn segment(b: f64) -> f64 {
    if b.abs() < 0.02 {
        1.0 - b / 2.0 + b * b / 6.0 - b * b * b / 24.0
    } else {
        -(-b).exp_m1() / b
    }
}

/// Weights of the two ends of a segment along which what arrives from the light, e^(-sigma_t l), and
/// not l itself goes linearly from end to end, while the view ray loses b = sigma_t dx: the means of
/// (1 - t) e^(-b t) and of t e^(-b t) over t in [0, 1].
///
/// Where the lit surface jumps, as at the edge of a shadow, l in between is none of any surface, and
/// this nearly halves the error (DESIGN, single scattering).
pub fn open_segment(b: f64) -> [f64; 2] {
    let g0 = segment(b);
    let g1 = if b < 0.1 {
        0.5 - b / 3.0 + b * b / 8.0 - b * b * b / 30.0 + b.powi(4) / 144.0
    } else {
        (1.0 - (-b).exp() * (1.0 + b)) / (b * b)
    };
    [g0 - g1, g1]
}

/// The integral of e^-A from the last sample to the exit, `rest` mm further (infinite for none), over
/// e^-A there, with A rising by `slope` mm^-1: (1 - e^(-slope rest)) / slope.
pub fn tail(slope: f64, rest: f64) -> f64 {
    if rest.is_finite() {
        rest * segment(slope * rest)
    } else {
        1.0 / slope
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::fresnel;
    use gauss_quad::GaussLegendre;

    /// The integral of `f` over [a, b], halved until Gauss and Legendre's rule agrees with itself.
    fn quadrature(f: &dyn Fn(f64) -> f64, a: f64, b: f64) -> f64 {
        let rule = GaussLegendre::new(12.try_into().expect("a degree"));
        fn halve(rule: &GaussLegendre, f: &dyn Fn(f64) -> f64, a: f64, b: f64, left: u32) -> f64 {
            let middle = 0.5 * (a + b);
            let (whole, low, high) = (
                rule.integrate(a, b, f),
                rule.integrate(a, middle, f),
                rule.integrate(middle, b, f),
            );
            if left == 0 || (whole - low - high).abs() <= 1e-13 * (low + high).abs() {
                return low + high;
            }
            halve(rule, f, a, middle, left - 1) + halve(rule, f, middle, b, left - 1)
        }
        halve(&rule, f, a, b, 40)
    }

    /// Random numbers in [0, 1): the same at every run.
    fn random() -> impl FnMut() -> f64 {
        let mut state = 0x2545_f491_4f6c_dd1d_u64;
        move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64
        }
    }

    #[test]
    fn segments_are_what_quadrature_says() {
        let mut next = random();
        for i in 0..2000 {
            let a0 = 10_f64.powf(-6.0 + 9.0 * next());
            let a1 = match i % 4 {
                // Anything, nearly equal, on either side of the series' end, and huge.
                0 => 10_f64.powf(-6.0 + 9.0 * next()),
                1 => a0 + 1e-6 * (next() - 0.5),
                2 => a0 + 0.04 * (next() - 0.5),
                _ => 1e4 * next(),
            };
            // Relative to the greater end, and from it, so that nothing overflows.
            let low = a0.min(a1);
            let expected = quadrature(&|t| (low - (a0 + (a1 - a0) * t)).exp(), 0.0, 1.0);
            let value = segment((a1 - a0).abs());
            assert!(
                (value - expected).abs() < 1e-8 * expected,
                "{a0} to {a1}: {value}, quadrature {expected}"
            );
            // From the other end it is the same.
            let b = (a1 - a0).abs();
            if b < 500.0 {
                assert!(((-b).exp() * segment(-b) - expected).abs() < 1e-8 * expected);
            }
        }
    }

    #[test]
    fn open_segments_are_what_quadrature_says() {
        for i in 0..400 {
            let b = 10_f64.powf(-5.0 + 9.0 * f64::from(i) / 399.0);
            let [near, far] = open_segment(b);
            let expected = [
                quadrature(&|t| (1.0 - t) * (-b * t).exp(), 0.0, 1.0),
                quadrature(&|t| t * (-b * t).exp(), 0.0, 1.0),
            ];
            assert!(
                (near - expected[0]).abs() < 2e-7 * expected[0],
                "{b}: {near}"
            );
            assert!((far - expected[1]).abs() < 2e-6 * expected[1], "{b}: {far}");
        }
    }

    #[test]
    fn tails_are_what_quadrature_says() {
        for slope in [-0.3, 0.0, 1e-9, 0.7, 30.0] {
            let expected = quadrature(&|x| (-slope * x).exp(), 0.0, 2.5);
            assert!(
                (tail(slope, 2.5) - expected).abs() < 1e-9 * expected,
                "{slope}"
            );
        }
        assert_eq!(tail(0.5, f64::INFINITY), 2.0);
    }

    /// A shadow begins somewhere within a segment: on average over where, interpolating what arrives is
    /// not much more than half as wrong as interpolating the distance to the surface.
    #[test]
    fn the_jump_rule_nearly_halves_the_error_at_a_shadow_edge() {
        let (b, lit, hidden) = (0.6_f64, 0.3_f64, 9.0_f64);
        let (mut open, mut closed) = (0.0_f64, 0.0_f64);
        for i in 0..100 {
            let edge = (f64::from(i) + 0.5) / 100.0;
            // What arrives is e^-lit up to the edge, and e^-hidden beyond.
            let lost = |t: f64| (1.0 - (-b * t).exp()) / b;
            let truth = (-lit).exp() * lost(edge) + (-hidden).exp() * (lost(1.0) - lost(edge));
            let [near, far] = open_segment(b);
            open += ((-lit).exp() * near + (-hidden).exp() * far - truth).powi(2);
            closed += ((-lit).exp() * segment(b + hidden - lit) - truth).powi(2);
        }
        assert!(open.sqrt() < 0.6 * closed.sqrt(), "{open} {closed}");
    }

    #[test]
    fn steps_grow_from_the_first_to_the_last() {
        for count in [1, 2, 3, 8, 17, 64] {
            for (first, far) in [
                (0.1, 30.0),
                (0.1, 0.3),
                (0.02, 4.0),
                (1e-3, 1e3),
                (1e-6, 1e6),
            ] {
                let steps = Steps::new(first, far, count);
                assert_eq!(steps.depth(0), 0.0);
                let end = steps.depth(count);
                assert!(
                    (end - far).abs() < 1e-6 * far,
                    "{count}, {first} to {far}: {end}"
                );
                let lengths: Vec<f64> = (0..count)
                    .map(|i| steps.depth(i + 1) - steps.depth(i))
                    .collect();
                assert!(lengths[0] > 0.0);
                assert!(
                    lengths.windows(2).all(|w| w[1] >= w[0] * (1.0 - 1e-9)),
                    "{lengths:?}"
                );
                let wanted = first.min(far / f64::from(count));
                if count > 1 {
                    assert!((lengths[0] - wanted).abs() < 1e-9 * wanted, "{lengths:?}");
                }
                // DESIGN's formula: x_i = x_1 (r^i - 1) / (r - 1).
                let r = steps.log_growth.exp();
                if r > 1.0 + 1e-3 {
                    let formula = steps.first * (r.powi(count as i32) - 1.0) / (r - 1.0);
                    assert!((formula - end).abs() < 1e-9 * end);
                }
            }
        }
    }

    #[test]
    fn the_phase_function_is_normalised_and_has_its_mean_cosine() {
        for g in [-0.9, -0.3, 0.0, 0.5, 0.95] {
            let p = |cos: f64| 2.0 * PI * henyey_greenstein(cos, g);
            let (total, mean) = (
                quadrature(&|c| p(c), -1.0, 1.0),
                quadrature(&|c| 1.0 + c * p(c), -1.0, 1.0) - 2.0,
            );
            assert!((total - 1.0).abs() < 1e-9, "{g}: {total}");
            assert!((mean - g).abs() < 1e-9, "{g}: {mean}");
        }
    }

    #[test]
    fn refraction_obeys_snell() {
        let n = DVec3::new(0.2, 0.9, -0.4).normalize();
        for degrees in [0.0_f64, 20.0, 60.0, 89.0] {
            for eta in [1.0, 1.3, 2.0] {
                let side = n.any_orthonormal_vector();
                let (sin, cos) = degrees.to_radians().sin_cos();
                let inward = refract(n * cos + side * sin, n, eta);
                assert!((inward.length() - 1.0).abs() < 1e-12);
                // On the other side of the normal, and with the sine reduced by eta.
                assert!((inward.dot(side) + sin / eta).abs() < 1e-12);
                assert!(inward.dot(n) < 0.0);
            }
        }
    }

    /// Below a plane the corrected path is that of the refracted ray to the same depth.
    #[test]
    fn corrected_paths_are_refracted_paths_below_a_plane() {
        for degrees in [0.0_f64, 30.0, 75.0] {
            let (depth, eta) = (2.0, 1.4);
            let cos_i = degrees.to_radians().cos();
            let straight = depth / cos_i;
            let cos_t = (1.0 - (1.0 - cos_i * cos_i) / (eta * eta)).sqrt();
            let refracted = depth / cos_t;
            assert!((straight * path_factor(cos_i, eta) - refracted).abs() < 1e-12);
        }
    }

    #[test]
    fn the_weight_tells_the_angle() {
        for eta in [1.0, 1.01, 1.1, 1.3, 1.5, 2.0, 3.0] {
            let fit = PathFit::new(eta);
            let worst = (0..1000)
                .map(|i| {
                    let cos = (f64::from(i) + 0.5) / 1000.0;
                    let w = fresnel::transmittance(cos, eta);
                    (fit.factor(w) - path_factor(cos, eta)).abs()
                })
                .fold(0.0, f64::max);
            assert!(
                worst < if eta > 2.0 { 2.5e-3 } else { 5e-4 },
                "{eta}: {worst}"
            );
            assert!(fit.factor(0.0) == 0.0 || eta == 1.0);
        }
    }
}
