//! The reduce pass: the twin's filters are what they say.

mod common;

use common::random::Random;
use glam::DVec2;
use marmor::cpu::reduce::{self, Level};

/// Texels of premultiplied depth moments up to the fourth; a third of them are empty.
fn moments(size: [u32; 2], seed: u64) -> Vec<[f64; 5]> {
    let mut random = Random(seed);
    (0..size[0] * size[1])
        .map(|_| {
            let (w, z) = (random.uniform(), 2.0 * random.uniform() - 1.0);
            // Rounded to float32, so that the device starts from the same.
            let w = if random.uniform() < 1.0 / 3.0 { 0.0 } else { w };
            [0, 1, 2, 3, 4].map(|k| f64::from((w * z.powi(k)) as f32))
        })
        .collect()
}

/// A level of 0 but for 1 in texel (i, j).
fn impulse(size: [u32; 2], i: u32, j: u32) -> Level<1> {
    let mut texels = vec![[0.0]; (size[0] * size[1]) as usize];
    texels[(j * size[0] + i) as usize] = [1.0];
    Level::base(size, &texels)
}

/// Mean and variance of a level's columns.
fn spread(level: &Level<1>) -> (f64, f64) {
    let width = i64::from(level.size[0]) + 8;
    let height = i64::from(level.size[1]) + 8;
    let sum = |power: i32, about: f64| -> f64 {
        let texels = (-8..width).flat_map(|i| (-8..height).map(move |j| (i, j)));
        texels
            .map(|(i, j)| (i as f64 + 0.5 - about).powi(power) * level.at(i, j)[0])
            .sum()
    };
    let total = sum(0, 0.0);
    let mean = sum(1, 0.0) / total;
    (mean, sum(2, mean) / total)
}

#[test]
fn smoothing_has_variance_two() {
    let level = reduce::smooth(&impulse([32, 32], 15, 16));
    let (mean, variance) = spread(&level);
    // Sums of a few dyadic fractions: exact but for the last bits.
    assert!((mean - 15.5).abs() < 1e-14, "{mean}");
    assert!((variance - 2.0).abs() < 1e-13, "{variance}");
    assert_eq!(level.total(), [1.0]);
}

/// v' = (v + 3/4) / 4 and m' = m / 2, wherever the impulse lies and at its rim.
#[test]
fn decimation_follows_its_variance() {
    for (i, j) in [(40, 21), (41, 20), (0, 0), (63, 63), (62, 1)] {
        let mut variance = 0.0;
        let mut mean = f64::from(i) + 0.5;
        for level in &reduce::pyramid(impulse([64, 64], i, j), 9)[1..] {
            variance = (variance + 0.75) / 4.0;
            mean /= 2.0;
            let (m, v) = spread(level);
            assert!((m - mean).abs() < 1e-13, "mean {m}, not {mean}");
            assert!((v - variance).abs() < 1e-13, "variance {v}, not {variance}");
        }
    }
}

/// Decimation loses nothing, whatever the size: the sum of a level times its texels' area is
/// that of level 0.
#[test]
fn decimation_conserves_every_moment() {
    for size in [
        [64, 64],
        [128, 32],
        [37, 53],
        [1, 64],
        [63, 1],
        [1, 1],
        [7, 5],
    ] {
        let base = Level::base(size, &moments(size, 7));
        let expected = base.total();
        let largest = expected[0].abs().max(1.0);
        for (k, level) in reduce::pyramid(base, 12).iter().enumerate() {
            let area = 4.0_f64.powi(k as i32);
            for (total, expected) in level.total().iter().zip(expected) {
                let off = (total * area - expected).abs();
                // Float64 rounding of at most 4096 terms.
                assert!(off < 1e-12 * largest, "{size:?}, level {k}: off by {off}");
            }
        }
    }
}

#[test]
fn a_constant_stays_constant_far_from_the_rim() {
    let base = Level::base([256, 256], &vec![[0.75, -0.375]; 256 * 256]);
    for level in &reduce::pyramid(base, 4) {
        let middle = i64::from(level.size[0]) / 2;
        assert_eq!(level.at(middle, middle), [0.75, -0.375]);
        let smoothed = reduce::smooth(level);
        assert_eq!(smoothed.at(middle, middle), [0.75, -0.375]);
        let st = DVec2::splat(middle as f64) + DVec2::new(0.3, 0.71);
        let tap = smoothed.tap(st);
        assert!((tap[0] - 0.75).abs() < 1e-15 && (tap[1] + 0.375).abs() < 1e-15);
    }
}

/// A tap at a texel's centre is the texel, between two their mean, and 0 far outside.
#[test]
fn taps_interpolate() {
    let level = &reduce::pyramid(Level::base([20, 14], &moments([20, 14], 3)), 2)[1];
    let center = |i: i64, j: i64| DVec2::new(i as f64 + 0.5, j as f64 + 0.5);
    for (i, j) in [(-2, -1), (-1, 3), (0, 0), (4, 2), (10, 7), (11, 8)] {
        assert_eq!(level.tap(center(i, j)), level.at(i, j));
        let (a, b) = (level.at(i, j), level.at(i + 1, j));
        let between = level.tap(center(i, j) + DVec2::new(0.5, 0.0));
        for c in 0..5 {
            assert!((between[c] - 0.5 * (a[c] + b[c])).abs() < 1e-15);
        }
    }
    assert_eq!(level.tap(center(-9, 0)), [0.0; 5]);
    assert_eq!(level.tap(center(3, 900)), [0.0; 5]);
}
