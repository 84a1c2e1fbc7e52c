//! The plan: how a scene is rendered, validated once, before anything runs.

use super::{LightFrame, Scene, names};
use crate::optics::Dipole;
use crate::optics::mixture::{Fit, Levels};
use glam::DVec2;
use std::fmt;

/// Levels of the pyramid that the mixture taps at most. Nine octaves reach from 0.4 mean free
/// paths to where the profiles of all presets have ended, at 512^2 texels on a hand-sized object.
pub const LEVELS_MAX: u32 = 9;

/// How multiple scattering is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Multiple {
    /// No multiple scattering.
    None,
    /// No transport: R_tot / pi as a Lambertian reflector, with a shadow test.
    Brdf,
    /// Importance-sampled Monte Carlo with this many samples a pixel.
    Samples(u32),
    /// Square rings between levels of a MIP pyramid, at most this many: the paper's own method.
    Rings(u32),
    /// A mixture of Gaussians, one from each level of a pyramid of depth moments.
    Mixture(Mixture),
    /// The sum over every texel of the light map: the reference.
    Exact,
}

/// Which moments of which levels the mixture reads, and how its levels are weighted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mixture {
    /// The first level that reads the fourth moment of depth, as a second texture; none reads three.
    pub fourth_from: Option<u32>,
    /// 1 taps every level, 2 every second one.
    pub level_step: u32,
    /// Where the weights of the levels come from.
    pub fit: Fit,
}

impl Mixture {
    /// Every level with three moments, and the better weights.
    pub const THREE: Mixture = Mixture {
        fourth_from: None,
        level_step: 1,
        fit: Fit::Best,
    };
    /// Every level with four moments, and the better weights.
    pub const FOUR: Mixture = Mixture {
        fourth_from: Some(0),
        ..Mixture::THREE
    };

    /// The weights called `name`.
    ///
    /// # Errors
    /// A phrase that suggests the nearest name, or lists them all.
    pub fn weights(name: &str) -> Result<Fit, String> {
        let named = Fit::ALL.into_iter().find(|fit| fit.name() == name);
        named.ok_or_else(|| {
            let all = Fit::ALL.map(Fit::name);
            format!("unknown weights \"{name}\"; {}", names::remedy(name, &all))
        })
    }

    /// The fetches of each of `levels`: 1, or 2 where it reads the fourth moment.
    pub fn fetches(&self, levels: Levels) -> u32 {
        let fourth = |k: &u32| self.fourth_from.is_some_and(|from| *k >= from);
        levels.count + levels.iter().filter(fourth).count() as u32
    }
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

impl Plan {
    /// The methods of the picture: one, or those of its two halves.
    pub fn methods(&self) -> impl Iterator<Item = Multiple> {
        self.split
            .filter(|left| *left != self.multiple)
            .into_iter()
            .chain([self.multiple])
    }

    /// The frame of the light map, relative to the mesh's centre ([`super::Mesh::center`]).
    pub fn light_frame(&self) -> LightFrame {
        let mesh = &self.scene.mesh;
        let center = mesh.center();
        LightFrame::fit(
            mesh.positions.iter().map(|&p| p - center),
            self.scene.light.to_light(),
            self.light_map,
            DVec2::ZERO,
        )
    }

    /// The profiles of the three channels as texels of side `texel` (mm) resolve them.
    pub fn dipoles(&self, texel: f64) -> [Dipole; 3] {
        self.scene.material.dipoles().map(|d| d.resolved(texel))
    }

    /// The levels that `mixture` taps in a map of texels of side `texel` (mm).
    pub fn levels(&self, mixture: Mixture, texel: f64) -> Levels {
        Levels::choose(&self.dipoles(texel), texel, mixture.level_step, LEVELS_MAX)
    }

    /// How many of `rings` the map has levels for: the last level is one texel.
    pub fn rings(&self, rings: u32) -> u32 {
        rings.min(self.light_map.ilog2() + 1)
    }
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
    /// [`Multiple::Rings`]
    Rings,
    /// [`Multiple::Mixture`]
    Mixture,
    /// [`Multiple::Exact`]
    Exact,
}

impl Method {
    /// The names by which methods are asked for.
    pub const NAMES: [&'static str; 6] = ["none", "brdf", "samples", "rings", "mixture", "exact"];

    /// The method called `name`.
    ///
    /// # Errors
    /// A phrase that suggests the nearest method, or lists them all.
    pub fn named(name: &str) -> Result<Method, String> {
        match name {
            "none" => Ok(Method::None),
            "brdf" => Ok(Method::Brdf),
            "samples" => Ok(Method::Samples),
            "rings" => Ok(Method::Rings),
            "mixture" => Ok(Method::Mixture),
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
            Method::Rings => "rings",
            Method::Mixture => "mixture",
            Method::Exact => "exact",
        }
    }

    /// The method with its parameters.
    pub fn with(self, samples: u32, rings: u32, mixture: Mixture) -> Multiple {
        match self {
            Method::None => Multiple::None,
            Method::Brdf => Multiple::Brdf,
            Method::Samples => Multiple::Samples(samples),
            Method::Rings => Multiple::Rings(rings),
            Method::Mixture => Multiple::Mixture(mixture),
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
            Multiple::Rings(count) => write!(f, "rings({count})"),
            Multiple::Mixture(mixture) => mixture.fmt(f),
            Multiple::Exact => f.write_str("exact"),
        }
    }
}

impl fmt::Display for Mixture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.fourth_from {
            None => f.write_str("mixture(3")?,
            Some(0) => f.write_str("mixture(4")?,
            Some(from) => write!(f, "mixture(4 from level {from}")?,
        }
        if self.level_step == 2 {
            f.write_str(", every second level")?;
        }
        if self.fit != Fit::Best {
            write!(f, ", {} weights", self.fit.name())?;
        }
        f.write_str(")")
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
