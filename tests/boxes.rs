//! The promise: every way to build the box pyramid gives the pyramid of the CPU twin.

mod common;

use common::device::{self, TestDevice};
use common::random::Random;
use marmor::cpu;
use marmor::frame::{SHARED_SIDE, Way, boxes_alone};
use marmor::gpu;

/// Sides that are even, odd, thin, one texel, and beyond one tile of the shared way.
const SIZES: [[u32; 2]; 11] = [
    [512, 512],
    [128, 32],
    [37, 53],
    [1, 64],
    [300, 300],
    [1, 1],
    [2, 1],
    [65, 3],
    [129, 127],
    [3, 1000],
    [16, 16],
];

/// Allowed error, as a share of the largest value of the base.
///
/// A mean of four is rounded at most three times, by half a unit in the last place (6e-8), at each
/// of the nine levels of 512; errors of random sign add up to less than 3e-7.
const ROUNDING: f64 = 4e-7;

/// Allowed error of the blit chain where sides are no powers of two, for each texel of the longer
/// side: its taps fall between texels only as exactly as the driver interpolates coordinates. On
/// llvmpipe these are floats: this is four units in their last place, and two were measured.
const BLIT_FLOAT: f64 = 5e-7;

/// The same on devices whose taps have eight bits, half of the last one, whatever the side.
const BLIT_FIXED: f64 = 4e-3;

fn random(size: [u32; 2], seed: u64) -> Vec<[f32; 4]> {
    let mut random = Random(seed);
    (0..size[0] * size[1])
        .map(|_| [(); 4].map(|()| 2.0 * random.uniform() as f32 - 1.0))
        .collect()
}

type Levels = Vec<([u32; 2], Vec<[f32; 4]>)>;

fn built(device: &TestDevice, way: Way, size: [u32; 2], base: &[[f32; 4]]) -> Levels {
    boxes_alone(&device.device, way, size, base).expect("a pyramid")
}

fn tolerance(device: &TestDevice, way: Way, size: [u32; 2]) -> f64 {
    let exact = size.iter().all(|side| side.is_power_of_two());
    let on_cpu = format!("{:?}", device.device.candidate().kind) == "CPU";
    match (way, exact, on_cpu) {
        (Way::Levels | Way::Shared, _, _) | (Way::Blit, true, _) => ROUNDING,
        (Way::Blit, false, true) => BLIT_FLOAT * f64::from(size[0].max(size[1])),
        (Way::Blit, false, false) => BLIT_FIXED,
    }
}

/// Compares every texel of every level with the twin's.
fn check(device: &TestDevice, way: Way, size: [u32; 2], base: &[[f32; 4]]) {
    let twin = cpu::boxes::boxes(size, &device::wide(base));
    let levels = built(device, way, size, base);
    let largest = base
        .iter()
        .flatten()
        .fold(0.0_f64, |m, &x| m.max(f64::from(x).abs()));
    assert_eq!(levels.len(), twin.len() - 1, "{way:?} {size:?}");
    for (k, ((gpu_size, gpu), twin)) in levels.iter().zip(&twin[1..]).enumerate() {
        assert_eq!(*gpu_size, twin.size, "{way:?} {size:?} level {}", k + 1);
        let mut worst = (0.0, 0);
        for (at, (g, t)) in gpu.iter().zip(&twin.texels).enumerate() {
            for c in 0..4 {
                let error = (f64::from(g[c]) - t[c]).abs();
                if error.is_nan() || error > worst.0 {
                    worst = (error, at);
                }
            }
        }
        assert!(
            worst.0 <= tolerance(device, way, size) * largest,
            "{way:?} {size:?} level {}: texel {} off by {}",
            k + 1,
            worst.1,
            worst.0
        );
    }
}

#[test]
fn every_level_of_each_way_is_the_twins() {
    let Some(device) = device::device() else {
        return;
    };
    for (seed, size) in (1..).zip(SIZES) {
        let base = random(size, seed);
        for way in Way::ALL {
            check(&device, way, size, &base);
        }
    }
}

#[test]
fn two_tiles_of_the_shared_way_reach_its_largest_side() {
    let Some(device) = device::device() else {
        return;
    };
    for size in [[SHARED_SIDE, 5], [2, SHARED_SIDE], [1100, 1090]] {
        let base = random(size, 99);
        for way in [Way::Levels, Way::Shared] {
            check(&device, way, size, &base);
        }
    }
}

#[test]
fn the_ways_agree_with_each_other() {
    let Some(device) = device::device() else {
        return;
    };
    for (seed, size) in (50..).zip(SIZES) {
        let base = random(size, seed);
        let reference = built(&device, Way::Levels, size, &base);
        for way in [Way::Shared, Way::Blit] {
            let other = built(&device, way, size, &base);
            for ((_, a), (_, b)) in reference.iter().zip(&other) {
                assert_eq!(a.len(), b.len());
                for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
                    let error = f64::from((a - b).abs());
                    assert!(
                        error <= tolerance(&device, way, size),
                        "{way:?} {size:?}: {error}"
                    );
                }
            }
        }
    }
}

#[test]
fn runs_give_the_same_bits() {
    let Some(device) = device::device() else {
        return;
    };
    let size = [300, 260];
    let base = random(size, 7);
    for way in Way::ALL {
        let first = built(&device, way, size, &base);
        for _ in 0..3 {
            assert!(first == built(&device, way, size, &base), "{way:?}");
        }
    }
}

#[test]
fn a_constant_stays_constant() {
    let Some(device) = device::device() else {
        return;
    };
    let value = [0.7, -1.3, 3.0e-3, 250.0];
    for size in SIZES {
        let base = vec![value; (size[0] * size[1]) as usize];
        for way in Way::ALL {
            for (_, texels) in built(&device, way, size, &base) {
                for texel in texels {
                    for c in 0..4 {
                        let error = ((texel[c] - value[c]) / value[c]).abs();
                        assert!(error <= 1e-6, "{way:?} {size:?}: {texel:?}");
                    }
                }
            }
        }
    }
}

/// Moments are premultiplied by their weight: what is empty adds nothing, and the mean depth of a
/// texel, wz / w, is that of its covered part.
#[test]
fn an_empty_background_adds_nothing() {
    let Some(device) = device::device() else {
        return;
    };
    let size = [128, 128];
    let z = 0.37_f32;
    let texel = |k: u32| {
        let (x, y) = (k % size[0], k / size[0]);
        let inside = (30..75).contains(&x) && (41..100).contains(&y);
        let w = if inside { 0.9 } else { 0.0 };
        [w, w * z, w * z * z, w * z * z * z]
    };
    let base: Vec<_> = (0..size[0] * size[1]).map(texel).collect();
    let total = 45.0 * 59.0 * 0.9_f64;
    for way in Way::ALL {
        check(&device, way, size, &base);
        for (level_size, texels) in built(&device, way, size, &base) {
            let area = f64::from(size[0] * size[1]) / f64::from(level_size[0] * level_size[1]);
            let sum: f64 = texels.iter().map(|t| f64::from(t[0])).sum();
            assert!((sum * area / total - 1.0).abs() < 1e-6, "{way:?}");
            for t in texels.iter().filter(|t| t[0] > 0.0) {
                for c in 1..4 {
                    assert!((t[c] / t[c - 1] - z).abs() < 1e-6, "{way:?}: {t:?}");
                }
            }
        }
    }
}

/// One texel shows where each level takes it, and what it weighs.
#[test]
fn one_texel_goes_where_it_belongs() {
    let Some(device) = device::device() else {
        return;
    };
    for (size, at) in [
        ([512, 512], [341, 170]),
        ([128, 32], [127, 31]),
        ([37, 53], [20, 31]),
        ([1, 64], [0, 63]),
        ([2, 1], [1, 0]),
        // Dropped with the odd last column.
        ([37, 53], [36, 0]),
    ] {
        let mut base = vec![[0.0; 4]; (size[0] * size[1]) as usize];
        base[(at[1] * size[0] + at[0]) as usize] = [1.0; 4];
        for way in Way::ALL {
            check(&device, way, size, &base);
        }
    }
}

#[test]
fn what_a_way_cannot_do_is_refused() {
    let Some(device) = device::device() else {
        return;
    };
    let size = [SHARED_SIDE + 1, 1];
    let base = vec![[0.0; 4]; size[0] as usize];
    let error = boxes_alone(&device.device, Way::Shared, size, &base).expect_err("too large");
    assert!(matches!(error, gpu::Error::Unsupported(_)));
    assert!(error.to_string().contains("4096"), "{error}");
    assert!(boxes_alone(&device.device, Way::Levels, size, &base).is_ok());
    for way in Way::ALL {
        for (size, texels) in [([0, 4], 0), ([4, 4], 15)] {
            let base = vec![[0.0; 4]; texels];
            let error = boxes_alone(&device.device, way, size, &base).expect_err("no such base");
            assert!(matches!(error, gpu::Error::Unsupported(_)), "{error}");
        }
    }
}
