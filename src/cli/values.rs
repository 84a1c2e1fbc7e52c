//! How flag values are read. Each function returns the value, or a phrase that clap puts
//! after the flag's name.

use crate::scene::{Exits, Jitter, March, Method, Single, color, limits};
use glam::DVec3;
use std::ops::RangeInclusive;

fn number(text: &str) -> Result<f64, String> {
    text.trim()
        .parse()
        .map_err(|_| format!("\"{text}\" is not a number"))
}

fn whole(text: &str) -> Result<i64, String> {
    text.trim()
        .parse()
        .map_err(|_| format!("\"{text}\" is not a whole number"))
}

/// Numbers between commas.
fn list(text: &str) -> Result<Vec<f64>, String> {
    text.split(',').map(number).collect()
}

pub(super) fn size(text: &str) -> Result<[u32; 2], String> {
    let (width, height) = text
        .split_once(['x', 'X'])
        .ok_or("write WIDTHxHEIGHT in pixels, such as 800x600")?;
    limits::size([whole(width)?, whole(height)?])
}

fn triple(text: &str) -> Result<DVec3, String> {
    match list(text)?[..] {
        [r, g, b] => Ok(DVec3::new(r, g, b)),
        _ => Err("write three numbers, such as 2.19,2.62,3.00".to_owned()),
    }
}

pub(super) fn sigma_s(text: &str) -> Result<DVec3, String> {
    limits::sigma_s(triple(text)?)
}

pub(super) fn sigma_a(text: &str) -> Result<DVec3, String> {
    limits::sigma_a(triple(text)?)
}

pub(super) fn eta(text: &str) -> Result<f64, String> {
    limits::eta(number(text)?)
}

pub(super) fn positive(text: &str) -> Result<f64, String> {
    limits::positive(number(text)?)
}

pub(super) fn non_negative(text: &str) -> Result<f64, String> {
    limits::non_negative(number(text)?)
}

pub(super) fn share(text: &str) -> Result<f64, String> {
    limits::share(number(text)?)
}

pub(super) fn finite(text: &str) -> Result<f64, String> {
    limits::finite(number(text)?)
}

pub(super) fn duration(text: &str) -> Result<f64, String> {
    limits::duration(number(text)?)
}

pub(super) fn time(text: &str) -> Result<f64, String> {
    limits::time(number(text)?)
}

pub(super) fn fps(text: &str) -> Result<f64, String> {
    limits::fps(number(text)?)
}

/// Two numbers of frames, both of them meant.
pub(super) fn range(text: &str) -> Result<RangeInclusive<u32>, String> {
    let wrong = || {
        format!(
            "\"{text}\" is no range of frames; write the first and the last, such as 0..47, or one number"
        )
    };
    let parse = |text: &str| text.trim().parse::<u32>().map_err(|_| wrong());
    let (first, last) = match text.split_once("..") {
        Some((first, last)) => (parse(first)?, parse(last)?),
        None => (parse(text)?, parse(text)?),
    };
    if first > last {
        return Err(format!(
            "\"{text}\" ends before it begins; write {last}..{first}"
        ));
    }
    Ok(first..=last)
}

pub(super) fn samples(text: &str) -> Result<u32, String> {
    limits::samples(whole(text)?)
}

pub(super) fn rings(text: &str) -> Result<u32, String> {
    limits::rings(whole(text)?)
}

/// Fetches of a pixel.
pub(super) fn budget(text: &str) -> Result<u32, String> {
    limits::budget(whole(text)?)
}

pub(super) fn moments(text: &str) -> Result<u32, String> {
    limits::moments(whole(text)?)
}

pub(super) fn level(text: &str) -> Result<u32, String> {
    limits::level(whole(text)?)
}

pub(super) fn fourth_levels(text: &str) -> Result<u32, String> {
    limits::fourth_levels(whole(text)?)
}

pub(super) fn volumes(text: &str) -> Result<u32, String> {
    limits::volumes(whole(text)?)
}

pub(super) fn level_step(text: &str) -> Result<u32, String> {
    limits::level_step(whole(text)?)
}

pub(super) fn light_map(text: &str) -> Result<u32, String> {
    limits::light_map(whole(text)?)
}

pub(super) fn frames_averaged(text: &str) -> Result<u32, String> {
    limits::frames_averaged(whole(text)?)
}

pub(super) fn rounds(text: &str) -> Result<u32, String> {
    limits::rounds(whole(text)?)
}

pub(super) fn on_off(text: &str) -> Result<bool, String> {
    match text {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err("write on or off".to_owned()),
    }
}

pub(super) fn single(text: &str) -> Result<Single, String> {
    match text {
        "off" => Ok(Single::Off),
        "traced" => Ok(Single::Traced),
        _ => {
            let steps =
                whole(text).map_err(|_| "write off, traced or a whole number".to_owned())?;
            Ok(Single::March(March {
                steps: limits::steps(steps)?,
                exits: Exits::Linear,
            }))
        }
    }
}

pub(super) fn exits(text: &str) -> Result<Exits, String> {
    Exits::named(text)
}

pub(super) fn g(text: &str) -> Result<f64, String> {
    limits::g(number(text)?)
}

pub(super) fn method(text: &str) -> Result<Method, String> {
    Method::named(text)
}

pub(super) fn jitter(text: &str) -> Result<Jitter, String> {
    Jitter::named(text)
}

/// Azimuth and elevation, degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Direction {
    pub(super) azimuth: f64,
    pub(super) elevation: f64,
}

fn direction(azimuth: f64, elevation: f64) -> Result<Direction, String> {
    Ok(Direction {
        azimuth: limits::finite(azimuth).map_err(|phrase| format!("azimuth {phrase}"))?,
        elevation: limits::elevation(elevation).map_err(|phrase| format!("elevation {phrase}"))?,
    })
}

pub(super) fn light(text: &str) -> Result<Direction, String> {
    match list(text)?[..] {
        [azimuth, elevation] => direction(azimuth, elevation),
        _ => Err("write AZIMUTH,ELEVATION in degrees, such as 140,25".to_owned()),
    }
}

/// A direction, and a distance in mm unless the mesh is to be fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Orbit {
    pub(super) direction: Direction,
    pub(super) distance: Option<f64>,
}

pub(super) fn camera(text: &str) -> Result<Orbit, String> {
    match list(text)?[..] {
        [azimuth, elevation] => Ok(Orbit {
            direction: direction(azimuth, elevation)?,
            distance: None,
        }),
        [azimuth, elevation, distance] => Ok(Orbit {
            direction: direction(azimuth, elevation)?,
            distance: Some(
                limits::positive(distance).map_err(|phrase| format!("distance {phrase}"))?,
            ),
        }),
        _ => Err(
            "write AZIMUTH,ELEVATION in degrees and perhaps ,DISTANCE in mm, such as 30,10"
                .to_owned(),
        ),
    }
}

/// A colour behind the picture, linear RGB, or none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Background(pub(super) Option<[f64; 3]>);

pub(super) fn background(text: &str) -> Result<Background, String> {
    if text == "none" {
        return Ok(Background(None));
    }
    color::parse_hex(text)
        .map(|color| Background(Some(color)))
        .map_err(|_| "write none or #rrggbb, such as #203040".to_owned())
}

/// MiB to bytes.
pub(super) fn mebibytes(text: &str) -> Result<u64, String> {
    text.parse::<u64>()
        .ok()
        .filter(|&mebibytes| mebibytes > 0)
        .and_then(|mebibytes| mebibytes.checked_mul(1 << 20))
        .ok_or_else(|| "write a whole number of MiB, at least 1".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn good_values_are_read() {
        assert_eq!(size("800x600"), Ok([800, 600]));
        assert_eq!(
            light("-30, 45.5"),
            Ok(Direction {
                azimuth: -30.0,
                elevation: 45.5
            })
        );
        assert_eq!(camera("0,0").map(|orbit| orbit.distance), Ok(None));
        assert_eq!(camera("0,0,90").map(|orbit| orbit.distance), Ok(Some(90.0)));
        assert_eq!(background("none"), Ok(Background(None)));
        assert_eq!(background("#ffffff"), Ok(Background(Some([1.0; 3]))));
        assert_eq!(mebibytes("2"), Ok(2 << 20));
        assert_eq!(single("off"), Ok(Single::Off));
        assert!(single("64").is_ok() && single("traced").is_ok());
    }

    #[test]
    fn bad_values_are_refused() {
        for bad in [
            "",
            "800",
            "x",
            "800x",
            "800x600x2",
            "8e2x600",
            "0x5",
            "5x-1",
        ] {
            assert!(size(bad).is_err(), "{bad}");
        }
        for bad in ["", "1", "1,2,3", "a,b", "0,91", "nan,0", "inf,0"] {
            assert!(light(bad).is_err(), "{bad}");
        }
        for bad in ["0,0,0", "0,0,-1", "0,0,1,1"] {
            assert!(camera(bad).is_err(), "{bad}");
        }
        for bad in ["0", "-1", "1.5", "99999999999999999"] {
            assert!(mebibytes(bad).is_err(), "{bad}");
        }
        for bad in ["0", "65", "on", "-1", "8.5", ""] {
            assert!(single(bad).is_err(), "{bad}");
        }
    }
}
