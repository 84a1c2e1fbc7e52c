//! The radii that the Monte Carlo method draws follow the density it divides by.

mod common;

use std::f64::consts::TAU;
use std::num::NonZeroUsize;

use common::media::medium;
use common::random::Random;
use gauss_quad::GaussLegendre;
use marmor::optics::Dipole;
use marmor::optics::sampling::{MIN_SIGMA_TR, RadiusSampler, pdf_area, sample_radius};
use statrs::distribution::{ChiSquared, ContinuousCDF};

const BINS: usize = 40;
const DRAWS: usize = 400_000;

/// p-value of the hypothesis that radii drawn across `gap` have the density `pdf` across
/// `claimed`.
fn p_value(dipole: &Dipole, gap: f64, claimed: f64, seed: u64) -> f64 {
    let (edges, expected) = bins(dipole, claimed);
    let mut random = Random(seed);
    let mut observed = [0.0; BINS];
    for _ in 0..DRAWS {
        let rho = sample_radius(dipole, random.uniform(), gap);
        observed[edges.partition_point(|&e| e <= rho)] += 1.0;
    }
    let chi2: f64 = observed
        .iter()
        .zip(&expected)
        .map(|(o, p)| {
            let e = p * DRAWS as f64;
            (o - e) * (o - e) / e
        })
        .sum();
    ChiSquared::new((BINS - 1) as f64)
        .expect("positive degrees of freedom")
        .sf(chi2)
}

/// Inner edges of bins of equal probability, and the integral of the pdf over each.
fn bins(dipole: &Dipole, gap: f64) -> (Vec<f64>, Vec<f64>) {
    // The sampler has its own floor on absorption, and Phi must share it.
    let dipole = &Dipole {
        sigma_tr: dipole.sigma_tr.max(MIN_SIGMA_TR),
        ..*dipole
    };
    let whole = dipole.phi(gap * gap);
    let beyond = |rho: f64| dipole.phi(rho * rho + gap * gap) / whole;
    let edges: Vec<f64> = (1..BINS)
        .map(|k| {
            // Bisection on the logarithm, from far below to far above any radius.
            let target = 1.0 - k as f64 / BINS as f64;
            let (mut lo, mut hi) = (1e-6_f64, 1e6_f64);
            for _ in 0..200 {
                let middle = (lo * hi).sqrt();
                if beyond(middle) > target {
                    lo = middle
                } else {
                    hi = middle
                }
            }
            lo
        })
        .collect();
    let rule = GaussLegendre::new(NonZeroUsize::new(64).expect("not 0"));
    let mut expected = Vec::new();
    let mut inner = 0.0;
    for &outer in &edges {
        expected.push(rule.integrate(inner, outer, |r| pdf_area(dipole, r, gap) * TAU * r));
        inner = outer;
    }
    expected.push(1.0 - expected.iter().sum::<f64>());
    // The quadrature checks the pdf by itself: every bin must hold its share.
    for (k, p) in expected.iter().enumerate() {
        assert!((p * BINS as f64 - 1.0).abs() < 1e-6, "bin {k} holds {p}");
    }
    (edges, expected)
}

#[test]
fn radii_follow_the_pdf() {
    // 36 hypotheses, any of which may fail by chance: divided among them, 1 % is the chance
    // that a correct sampler fails at all (Bonferroni).
    const LEVEL: f64 = 0.01 / 36.0;
    let mut seed = 1;
    let mut values = Vec::new();
    for name in ["marble", "skin1", "ketchup", "spectralon"] {
        for c in 0..3 {
            let dipole = medium(name).dipole(c);
            for gap in [0.0, 0.5, 4.0].map(|k| k * dipole.z_r) {
                let p = p_value(&dipole, gap, gap, seed);
                assert!(p > LEVEL, "{name}, channel {c}, gap {gap} mm: p = {p}");
                values.push(p);
                seed += 1;
            }
        }
    }
    // Together, p-values of a correct sampler are uniform: by Fisher's method, -2 sum ln p is
    // chi-squared.
    let fisher: f64 = values.iter().map(|p| -2.0 * p.ln()).sum();
    let together = ChiSquared::new(2.0 * values.len() as f64)
        .expect("positive")
        .sf(fisher);
    println!("together p = {together}");
    assert!(together > 0.01, "together p = {together}");
}

#[test]
fn the_test_notices_a_wrong_pdf() {
    let dipole = medium("skin1").dipole(0);
    let p = p_value(&dipole, 0.5 * dipole.z_r, 0.6 * dipole.z_r, 1);
    assert!(p < 1e-6, "p = {p}");
}

#[test]
fn strata_reach_every_radius_in_order_of_each_source() {
    // Within one source larger numbers mean larger radii; the real source comes first.
    let sampler = RadiusSampler::new(&medium("marble").dipole(1), 0.8);
    let radii: Vec<f64> = (0..10_000)
        .map(|i| sampler.sample(f64::from(i) / 10_000.0))
        .collect();
    let falls = radii.windows(2).filter(|w| w[1] < w[0]).count();
    assert_eq!(falls, 1);
    // 0 but for the error of `solve`, 4e-9 of the distance, which the square root turns into
    // 1e-4 of it.
    assert!(radii[0] < 1e-3);
}
