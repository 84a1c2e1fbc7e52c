//! The reduce pass: the twin's filters are what they say, and the device's are the twin's.

mod common;

use std::ops::RangeInclusive;

use common::device::{self, TestDevice};
use common::media::medium;
use common::random::Random;
use common::shapes;
use glam::DVec2;
use marmor::cpu::reduce::{self, Level};
use marmor::frame::{Renderer, Setup, Target, reduce_alone};
use marmor::scene::pyramid::Atlas;
use marmor::scene::{Fourth, Jitter, Mixture, Multiple, Plan};

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

/// Compares a whole image of the device with the levels that the twin has in it, and 0 everywhere
/// else; `tolerance` relative to the largest value of the twin's.
fn compare(
    what: &str,
    atlas: &Atlas,
    image: &[[f32; 5]],
    levels: &[(u32, Level<5>)],
    tolerance: f64,
) {
    let width = atlas.size[0] as usize;
    let mut expected = vec![([0.0; 5], 0.0); image.len()];
    for (level, twin) in levels {
        let content = atlas.content(*level);
        let interior = atlas.places[*level as usize];
        let values = twin.texels.iter().flatten();
        let largest = values.fold(0.0, |a: f64, &b| a.max(b.abs()));
        for y in content.origin[1]..content.origin[1] + content.size[1] {
            for x in content.origin[0]..content.origin[0] + content.size[0] {
                let i = i64::from(x) - i64::from(interior.origin[0]);
                let j = i64::from(y) - i64::from(interior.origin[1]);
                let at = y as usize * width + x as usize;
                expected[at] = (twin.at(i, j), tolerance * largest);
            }
        }
    }
    let (mut worst, mut place) = (0.0_f64, 0);
    for (at, (gpu, (twin, allowed))) in image.iter().zip(&expected).enumerate() {
        for (gpu, twin) in gpu.iter().zip(twin) {
            let off = (f64::from(*gpu) - twin).abs();
            // What must be 0 is 0, and no number passes for one that is none.
            let relative = if off == 0.0 { 0.0 } else { off / allowed };
            if relative.is_nan() || relative > worst {
                (worst, place) = (relative, at);
            }
        }
    }
    assert!(
        worst <= 1.0,
        "{what}: texel ({}, {}) of {:?} is off by {worst} times what is allowed",
        place % width,
        place / width,
        atlas.size
    );
}

/// Runs the pass on the device and compares pyramid and smoothed levels with the twin.
fn check(device: &TestDevice, size: [u32; 2], levels: RangeInclusive<u32>, fourth: bool) {
    let what = format!("{size:?}, levels {levels:?}, fourth {fourth}");
    let mut texels = moments(size, 11);
    if !fourth {
        texels.iter_mut().for_each(|m| m[4] = 0.0);
    }
    let four: Vec<[f32; 4]> = texels
        .iter()
        .map(|m| [0, 1, 2, 3].map(|k| m[k] as f32))
        .collect();
    let fifth: Vec<f32> = texels.iter().map(|m| m[4] as f32).collect();
    let fifth = fourth.then_some(&fifth[..]);
    // Twice in one submit: the layer sees what may race between frames, and the second run
    // finds what the first has left.
    let made =
        reduce_alone(&device.device, size, &four, fifth, levels.clone(), 2).expect("a reduction");
    let twin = reduce::pyramid(Level::base(size, &texels), levels.end() + 1);
    let all: Vec<_> = (0..).zip(twin).collect();
    compare(
        &format!("pyramid of {what}"),
        &made.atlas,
        &made.moments,
        &all,
        ROUNDING,
    );
    let smoothed: Vec<_> = all
        .iter()
        .filter(|(k, _)| levels.contains(k))
        .map(|(k, level)| (*k, reduce::smooth(level)))
        .collect();
    compare(
        &format!("smoothed {what}"),
        &made.atlas,
        &made.smoothed,
        &smoothed,
        ROUNDING,
    );
}

/// Each level rounds sums of 16 terms once more: half an ulp (6e-8) a level and a few within one,
/// of errors that mostly cancel, over ten levels and the smoothing.
const ROUNDING: f64 = 1e-6;

#[test]
fn levels_are_the_twins() {
    let Some(device) = device::device() else {
        return;
    };
    for (size, levels, fourth) in [
        ([512, 512], 0..=9, false),
        ([512, 512], 1..=9, true),
        ([128, 32], 1..=7, true),
        ([37, 53], 0..=5, true),
        ([37, 53], 1..=3, false),
        ([1, 64], 0..=6, false),
        ([64, 1], 0..=13, true),
        ([300, 300], 1..=8, false),
        ([16, 16], 0..=0, true),
        ([1, 1], 0..=1, false),
    ] {
        check(&device, size, levels, fourth);
    }
}

/// A frame whose left half is the mixture: the levels are the twin's of what the light pass drew,
/// the right half is that of a frame without a pyramid, and two frames in one submit do not race.
#[test]
fn a_frame_reduces_what_its_light_pass_drew() {
    let Some(device) = device::device() else {
        return;
    };
    for (multiple, mixture) in [
        (Multiple::Samples(12), Mixture::THREE),
        (Multiple::Exact, Mixture::THREE),
        (Multiple::Rings(7), Mixture::FOUR),
    ] {
        let mut plan = device::plan(
            shapes::bumpy(20.0, 5),
            medium("marble").material(),
            [140.0, 25.0],
            [20.0, 10.0],
            [96, 72],
            multiple,
        );
        plan.jitter = Jitter::All;
        plan.frames_averaged = 2;
        let new =
            |plan: &Plan| Renderer::new(&device.device, plan, &Setup::default()).expect("one");
        let mut flat = new(&plan);
        flat.render(&mut |_| ()).expect("a picture");
        plan.split = Some(Multiple::Mixture(mixture));
        let mut renderer = new(&plan);
        renderer.render(&mut |_| ()).expect("a picture");
        let whole = flat.radiance().expect("radiance");
        let picture = renderer.radiance().expect("radiance");
        let right = |image: &[[f32; 4]]| -> Vec<[f32; 4]> {
            image
                .chunks(96)
                .flat_map(|row| row[48..].to_vec())
                .collect()
        };
        assert!(
            right(&whole) == right(&picture),
            "{multiple:?}: another picture"
        );

        let side = plan.light_map;
        let levels = plan.taps(mixture, &renderer.light_frame(0)).levels;
        let mut read = |target| renderer.read(target).expect("an image");
        let fourth = mixture.fourth != Fourth::Never;
        let joined = |[main, fourth]: [Vec<[f32; 4]>; 2]| -> Vec<[f32; 5]> {
            let pairs = main.iter().zip(&fourth);
            pairs.map(|(m, f)| [m[0], m[1], m[2], m[3], f[0]]).collect()
        };
        let with = |read: &mut dyn FnMut(Target) -> Vec<[f32; 4]>, targets: [Target; 2]| {
            let main = read(targets[0]);
            let none = vec![[0.0; 4]; main.len()];
            joined([main, if fourth { read(targets[1]) } else { none }])
        };
        let pyramid = with(&mut read, [Target::LightPyramid, Target::FourthPyramid]);
        let image = with(&mut read, [Target::LightSmoothed, Target::FourthSmoothed]);
        let atlas = Atlas::new([side, side], levels.last() + 1);
        let width = atlas.size[0] as usize;
        let drawn: Vec<[f64; 5]> = pyramid
            .chunks(width)
            .take(side as usize)
            .flat_map(|row| row[..side as usize].iter().map(|m| m.map(f64::from)))
            .collect();
        assert!(drawn.iter().any(|m| m[0] > 0.5), "nothing is lit");
        for m in &drawn {
            let z = m[1] / m[0].max(1e-6);
            let expected = if fourth { m[3] * z } else { 0.0 };
            assert!((m[4] - expected).abs() < 1e-5, "{m:?}");
        }
        let twin = reduce::pyramid(Level::base([side, side], &drawn), levels.last() + 1);
        let all: Vec<_> = (0..).zip(twin).collect();
        compare("pyramid", &atlas, &pyramid, &all, ROUNDING);
        let smoothed: Vec<_> = all[levels.first as usize..]
            .iter()
            .map(|(k, level)| (*k, reduce::smooth(level)))
            .collect();
        compare("smoothed", &atlas, &image, &smoothed, ROUNDING);

        if multiple != Multiple::Exact {
            renderer.render_pair().expect("two frames");
            assert!(picture == renderer.radiance().expect("radiance"));
        }
    }
}
