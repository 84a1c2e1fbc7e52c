//! Which values a scene may hold. One place, so that scene files, flags and
//! library callers meet the same limits in the same words.
//!
//! Every function returns the value, or a phrase such as
//! `must be from 1 to 256, not 0` that reads on from the name of what was given.

use glam::DVec3;

/// Pixels along a side of the picture.
pub const SIDE: std::ops::RangeInclusive<u32> = 1..=16384;
/// Samples a pixel.
pub const SAMPLES: std::ops::RangeInclusive<u32> = 1..=256;
/// Fetches of a pixel.
pub const BUDGET: std::ops::RangeInclusive<u32> = 1..=1_000_000;
/// Rings of the method `rings`.
pub const RINGS: std::ops::RangeInclusive<u32> = 1..=14;
/// Samples of the march of single scattering.
pub const STEPS: std::ops::RangeInclusive<u32> = 1..=64;
/// Moments of depth that the mixture reads.
pub const MOMENTS: std::ops::RangeInclusive<u32> = 3..=4;
/// Levels of a pyramid, by number.
pub const LEVEL: std::ops::RangeInclusive<u32> = 0..=13;
/// Levels of the mixture that read the fourth moment.
pub const FOURTH_LEVELS: std::ops::RangeInclusive<u32> = 1..=9;
/// Levels from one tap of the mixture to the next.
pub const LEVEL_STEP: std::ops::RangeInclusive<u32> = 1..=2;
/// Levels of the mixture that read volumes.
pub const VOLUMES: std::ops::RangeInclusive<u32> = 0..=8;
/// Texels along a side of the light map.
pub const LIGHT_MAP: std::ops::RangeInclusive<u32> = 16..=8192;
/// Rounds of a benchmark.
pub const ROUNDS: std::ops::RangeInclusive<u32> = 1..=10_000;
/// Frames averaged into a picture.
pub const FRAMES_AVERAGED: std::ops::RangeInclusive<u32> = 1..=1_000_000;
/// Largest coefficient, mm^-1: what the device computes in float32 stays finite.
const SIGMA_MAX: f64 = 1e6;
/// Largest irradiance, for the same reason.
const BRIGHT_MAX: f64 = 1e30;

fn whole(value: i64, range: &std::ops::RangeInclusive<u32>) -> Result<u32, String> {
    u32::try_from(value)
        .ok()
        .filter(|value| range.contains(value))
        .ok_or_else(|| {
            format!(
                "must be from {} to {}, not {value}",
                range.start(),
                range.end()
            )
        })
}

fn number(value: f64, holds: bool, rule: &str) -> Result<f64, String> {
    if value.is_finite() && holds {
        Ok(value)
    } else {
        Err(format!("must be {rule}, not {value}"))
    }
}

/// Width and height, each in [`SIDE`], pixels.
///
/// # Errors
/// The phrase that names the side at fault.
pub fn size(size: [i64; 2]) -> Result<[u32; 2], String> {
    let side = |name: &str, value: i64| {
        u32::try_from(value)
            .ok()
            .filter(|value| SIDE.contains(value))
            .ok_or_else(|| {
                format!(
                    "must have sides from {} to {} pixels, not a {name} of {value}",
                    SIDE.start(),
                    SIDE.end()
                )
            })
    };
    Ok([side("width", size[0])?, side("height", size[1])?])
}

/// Samples a pixel, in [`SAMPLES`].
///
/// # Errors
/// The phrase that names the range.
pub fn samples(value: i64) -> Result<u32, String> {
    whole(value, &SAMPLES)
}

/// Rings, in [`RINGS`].
///
/// # Errors
/// The phrase that names the range.
pub fn rings(value: i64) -> Result<u32, String> {
    whole(value, &RINGS)
}

/// Fetches of a pixel, in [`BUDGET`].
///
/// # Errors
/// The phrase that names the range.
pub fn budget(value: i64) -> Result<u32, String> {
    whole(value, &BUDGET)
}

/// Samples of the march, in [`STEPS`].
///
/// # Errors
/// The phrase that names the range.
pub fn steps(value: i64) -> Result<u32, String> {
    whole(value, &STEPS)
}

/// Moments, in [`MOMENTS`].
///
/// # Errors
/// The phrase that names the range.
pub fn moments(value: i64) -> Result<u32, String> {
    whole(value, &MOMENTS)
}

/// A level's number, in [`LEVEL`].
///
/// # Errors
/// The phrase that names the range.
pub fn level(value: i64) -> Result<u32, String> {
    whole(value, &LEVEL)
}

/// Levels with the fourth moment, in [`FOURTH_LEVELS`].
///
/// # Errors
/// The phrase that names the range.
pub fn fourth_levels(value: i64) -> Result<u32, String> {
    whole(value, &FOURTH_LEVELS)
}

/// Levels from tap to tap, in [`LEVEL_STEP`].
///
/// # Errors
/// The phrase that names the range.
pub fn level_step(value: i64) -> Result<u32, String> {
    whole(value, &LEVEL_STEP)
}

/// Levels that read volumes, in [`VOLUMES`].
///
/// # Errors
/// The phrase that names the range.
pub fn volumes(value: i64) -> Result<u32, String> {
    whole(value, &VOLUMES)
}

/// Texels along a side of the light map, in [`LIGHT_MAP`].
///
/// # Errors
/// The phrase that names the range.
pub fn light_map(value: i64) -> Result<u32, String> {
    whole(value, &LIGHT_MAP)
}

/// Rounds of a benchmark, in [`ROUNDS`].
///
/// # Errors
/// The phrase that names the range.
pub fn rounds(value: i64) -> Result<u32, String> {
    whole(value, &ROUNDS)
}

/// Frames averaged, in [`FRAMES_AVERAGED`].
///
/// # Errors
/// The phrase that names the range.
pub fn frames_averaged(value: i64) -> Result<u32, String> {
    whole(value, &FRAMES_AVERAGED)
}

/// A finite number above 0: units, distances, exposures.
///
/// # Errors
/// The phrase that names the range.
pub fn positive(value: f64) -> Result<f64, String> {
    number(value, value > 0.0, "greater than 0")
}

/// A number in [0, 1e30]: irradiance. The device computes in float32.
///
/// # Errors
/// The phrase that names the range.
pub fn non_negative(value: f64) -> Result<f64, String> {
    number(
        value,
        (0.0..=BRIGHT_MAX).contains(&value),
        "0 or greater, and at most 1e30",
    )
}

/// Any finite number: azimuths, degrees.
///
/// # Errors
/// The phrase that says so.
pub fn finite(value: f64) -> Result<f64, String> {
    number(value, true, "a finite number")
}

/// Length of an animation in [1e-3, 1e6], s.
///
/// # Errors
/// The phrase that names the range.
pub fn duration(value: f64) -> Result<f64, String> {
    number(
        value,
        (1e-3..=1e6).contains(&value),
        "from 0.001 to 1000000 seconds",
    )
}

/// An instant in [0, 1e6], s.
///
/// # Errors
/// The phrase that names the range.
pub fn time(value: f64) -> Result<f64, String> {
    number(
        value,
        (0.0..=1e6).contains(&value),
        "from 0 to 1000000 seconds",
    )
}

/// Frames a second, in [0.01, 1000].
///
/// # Errors
/// The phrase that names the range.
pub fn fps(value: f64) -> Result<f64, String> {
    number(
        value,
        (0.01..=1000.0).contains(&value),
        "from 0.01 to 1000 frames a second",
    )
}

/// A direction: finite, and longer than 0.
///
/// # Errors
/// The phrase that says so.
pub fn direction(value: DVec3) -> Result<DVec3, String> {
    match value.try_normalize() {
        Some(_) if value.is_finite() => Ok(value),
        _ => Err(format!("must be a direction, not {value}")),
    }
}

/// A share of a whole, in [0, 1].
///
/// # Errors
/// The phrase that names the range.
pub fn share(value: f64) -> Result<f64, String> {
    number(value, (0.0..=1.0).contains(&value), "from 0 to 1")
}

/// Elevation in [-90, 90], degrees.
///
/// # Errors
/// The phrase that names the range.
pub fn elevation(value: f64) -> Result<f64, String> {
    number(value, value.abs() <= 90.0, "from -90 to 90 degrees")
}

/// Vertical field of view in [0.1, 170], degrees. Outside it the projection degenerates.
///
/// # Errors
/// The phrase that names the range.
pub fn fov(value: f64) -> Result<f64, String> {
    number(
        value,
        (0.1..=170.0).contains(&value),
        "from 0.1 to 170 degrees",
    )
}

/// Relative index of refraction in [1, 3].
///
/// # Errors
/// The phrase that names the range.
pub fn eta(value: f64) -> Result<f64, String> {
    number(value, (1.0..=3.0).contains(&value), "from 1 to 3")
}

/// Mean cosine of the phase function in [-0.95, 0.95]: beyond, the march's steps miss the peak.
///
/// # Errors
/// The phrase that names the range.
pub fn g(value: f64) -> Result<f64, String> {
    number(value, (-0.95..=0.95).contains(&value), "from -0.95 to 0.95")
}

/// GGX roughness alpha in (0.01, 1].
///
/// # Errors
/// The phrase that names the range.
pub fn roughness(value: f64) -> Result<f64, String> {
    number(
        value,
        value > 0.01 && value <= 1.0,
        "greater than 0.01 and at most 1",
    )
}

/// Reduced scattering coefficients, each in [1e-6, 1e6] mm^-1.
///
/// # Errors
/// The phrase that names the coefficient at fault.
pub fn sigma_s(value: DVec3) -> Result<DVec3, String> {
    each(value, |v| {
        number(
            v,
            v > 0.0 && (1e-6..=SIGMA_MAX).contains(&v),
            "greater than 0 mm^-1 (from 1e-6 to 1e6) in every channel",
        )
    })
}

/// Absorption coefficients, each in [0, 1e6] mm^-1.
///
/// # Errors
/// The phrase that names the coefficient at fault.
pub fn sigma_a(value: DVec3) -> Result<DVec3, String> {
    each(value, |v| {
        number(
            v,
            (0.0..=SIGMA_MAX).contains(&v),
            "0 mm^-1 or greater (and at most 1e6) in every channel",
        )
    })
}

/// Linear RGB, each channel in [0, 1e6].
///
/// # Errors
/// The phrase that names the channel at fault.
pub fn color(value: DVec3) -> Result<DVec3, String> {
    each(value, |v| {
        number(
            v,
            (0.0..=1e6).contains(&v),
            "0 or greater, and at most 1e6, in every channel",
        )
    })
}

/// A point in the scene, finite in every coordinate.
///
/// # Errors
/// The phrase that names the coordinate at fault.
pub fn point(value: DVec3) -> Result<DVec3, String> {
    each(value, |v| number(v, true, "finite in every coordinate"))
}

fn each(value: DVec3, check: impl Fn(f64) -> Result<f64, String>) -> Result<DVec3, String> {
    value
        .to_array()
        .into_iter()
        .try_for_each(|v| check(v).map(drop))?;
    Ok(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_closed_where_they_say_so() {
        assert_eq!(size([1, 16384]), Ok([1, 16384]));
        assert!(size([0, 600]).is_err_and(|e| e.contains("width") && e.contains("1 to 16384")));
        assert!(size([800, 40000]).is_err_and(|e| e.contains("height") && e.contains("40000")));
        assert!(samples(256).is_ok() && samples(257).is_err() && samples(-1).is_err());
        assert!(light_map(16).is_ok() && light_map(15).is_err());
        assert!(roughness(0.01).is_err() && roughness(1.0).is_ok());
        assert!(eta(0.99).is_err() && eta(3.0).is_ok());
    }

    #[test]
    fn nothing_infinite_passes() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for check in [
                positive,
                non_negative,
                finite,
                elevation,
                fov,
                eta,
                roughness,
            ] {
                assert!(check(bad).is_err());
            }
            let vector = DVec3::new(1.0, bad, 1.0);
            for check in [sigma_s, sigma_a, color, point] {
                assert!(check(vector).is_err());
            }
        }
    }
}
