//! The plan: how a scene is rendered, validated once, before anything runs.

use super::names;
use crate::scene::Scene;
use std::fmt;

/// How multiple scattering is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Multiple {
    /// No multiple scattering.
    None,
    /// No transport: R_tot / pi as a Lambertian reflector, with a shadow test.
    Brdf,
    /// Importance-sampled Monte Carlo with this many samples a pixel.
    Samples(u32),
    /// The sum over every texel of the light map: the reference.
    Exact,
}

/// What moves from one averaged frame to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Jitter {
    /// Nothing.
    Off,
    /// The sample sequence only, so that pictures can be compared pixel by pixel.
    Samples,
    /// Camera (sub-pixel), light map (sub-texel) and sample sequence.
    All,
}

/// A validated request for one picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// What is rendered.
    pub scene: Scene,
    /// Width and height in pixels, each in [1, 16384].
    pub size: [u32; 2],
    /// The method of the picture, or of its right half when `split` is given.
    pub multiple: Multiple,
    /// The method of the left half.
    pub split: Option<Multiple>,
    /// Whether the specular reflection at the boundary is added.
    pub specular: bool,
    /// Texels along a side of the light map, in [16, 8192].
    pub light_map: u32,
    /// Frames averaged into the picture, at least 1.
    pub frames_averaged: u32,
    /// What moves between averaged frames.
    pub jitter: Jitter,
    /// Factor on radiance before it is encoded for display.
    pub exposure: f64,
    /// Linear RGB put behind the picture when it is encoded for display; none keeps it transparent.
    pub background: Option<[f64; 3]>,
}

/// The name of a method for multiple scattering, without its parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// [`Multiple::None`]
    None,
    /// [`Multiple::Brdf`]
    Brdf,
    /// [`Multiple::Samples`]
    Samples,
    /// [`Multiple::Exact`]
    Exact,
}

impl Method {
    /// The names by which methods are asked for.
    pub const NAMES: [&'static str; 4] = ["none", "brdf", "samples", "exact"];

    /// The method called `name`.
    ///
    /// # Errors
    /// A phrase that suggests the nearest method, or lists them all.
    pub fn named(name: &str) -> Result<Method, String> {
        match name {
            "none" => Ok(Method::None),
            "brdf" => Ok(Method::Brdf),
            "samples" => Ok(Method::Samples),
            "exact" => Ok(Method::Exact),
            _ => Err(format!(
                "unknown method \"{name}\"; {}",
                names::remedy(name, &Method::NAMES)
            )),
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Method::None => "none",
            Method::Brdf => "brdf",
            Method::Samples => "samples",
            Method::Exact => "exact",
        }
    }

    /// The method with its parameters.
    pub fn with_samples(self, samples: u32) -> Multiple {
        match self {
            Method::None => Multiple::None,
            Method::Brdf => Multiple::Brdf,
            Method::Samples => Multiple::Samples(samples),
            Method::Exact => Multiple::Exact,
        }
    }
}

impl fmt::Display for Multiple {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Multiple::None => f.write_str("none"),
            Multiple::Brdf => f.write_str("brdf"),
            Multiple::Samples(count) => write!(f, "samples({count})"),
            Multiple::Exact => f.write_str("exact"),
        }
    }
}

impl Jitter {
    /// The names by which jitters are asked for.
    pub const NAMES: [&'static str; 3] = ["all", "samples", "off"];

    /// The jitter called `name`.
    ///
    /// # Errors
    /// A phrase that suggests the nearest name, or lists them all.
    pub fn named(name: &str) -> Result<Jitter, String> {
        match name {
            "all" => Ok(Jitter::All),
            "samples" => Ok(Jitter::Samples),
            "off" => Ok(Jitter::Off),
            _ => Err(format!(
                "unknown jitter \"{name}\"; {}",
                names::remedy(name, &Jitter::NAMES)
            )),
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Jitter::All => "all",
            Jitter::Samples => "samples",
            Jitter::Off => "off",
        }
    }
}
