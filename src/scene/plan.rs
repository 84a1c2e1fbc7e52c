//! The plan: how a scene is rendered, validated once, before anything runs.

use super::volume::{BLENDED, Volumes};
use super::{LightFrame, Motion, Scene, View, names};
use crate::optics::Dipole;
use crate::optics::mixture::{Fit, Levels, weights};
use glam::{DVec2, DVec3};
use std::fmt;
use std::ops::{Range, RangeInclusive};
use std::sync::Arc;

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
    /// Which levels read the fourth moment of depth, as a second texture.
    pub fourth: Fourth,
    /// 1 taps every level, 2 every second one.
    pub level_step: u32,
    /// Where the weights of the levels come from.
    pub fit: Fit,
    /// How many levels, the coarsest, read volumes of light. The finest tap never does, nor any whose
    /// volume would have too many cells ([`super::volume::CELLS_MAX`]).
    pub volumes: u32,
}

/// Which levels of the mixture read the fourth moment of depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fourth {
    /// None: three moments.
    Never,
    /// The levels from this one up.
    From(u32),
    /// As many neighbouring taps, those that carry the most light.
    Most(u32),
}

impl Mixture {
    /// Every level with three moments, and the better weights.
    pub const THREE: Mixture = Mixture {
        fourth: Fourth::Never,
        level_step: 1,
        fit: Fit::Best,
        volumes: 0,
    };
    /// Every level with four moments, and the better weights.
    pub const FOUR: Mixture = Mixture {
        fourth: Fourth::From(0),
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
}

/// How light that is scattered once is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Single {
    /// Not at all.
    Off,
    /// By the march along the refracted view ray.
    March(March),
    /// By ray casting on the mesh, on the CPU: the reference.
    Traced,
}

/// The march of single scattering.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct March {
    /// Samples along the refracted view ray, each one fetch.
    pub steps: u32,
    /// How each finds the lit surface.
    pub exits: Exits,
}

/// What tells how far a point inside is from the lit surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exits {
    /// A bilinear tap of the light moments: mean depth and, across an edge, two depths.
    Linear,
    /// The nearest texel of the light moments.
    Nearest,
    /// The nearest texel of the light's depth buffer, which knows nothing of the surface's angle.
    Depth,
}

impl Exits {
    /// The names by which they are asked for.
    pub const NAMES: [&'static str; 3] = ["linear", "nearest", "depth"];

    /// The way called `name`.
    ///
    /// # Errors
    /// A phrase that suggests the nearest name, or lists them all.
    pub fn named(name: &str) -> Result<Exits, String> {
        match name {
            "linear" => Ok(Exits::Linear),
            "nearest" => Ok(Exits::Nearest),
            "depth" => Ok(Exits::Depth),
            _ => Err(format!(
                "unknown exits \"{name}\"; {}",
                names::remedy(name, &Exits::NAMES)
            )),
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Exits::Linear => "linear",
            Exits::Nearest => "nearest",
            Exits::Depth => "depth",
        }
    }
}

/// At which size light inside the medium is shaded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scattering {
    /// In every pixel.
    #[default]
    Full,
    /// Once for four pixels, at half the width and height, and brought back by the four nearest.
    Half,
}

impl Scattering {
    /// The names by which the sizes are asked for.
    pub const NAMES: [&'static str; 2] = ["full", "half"];

    /// The size called `name`.
    ///
    /// # Errors
    /// A phrase that suggests the nearest name, or lists them all.
    pub fn named(name: &str) -> Result<Scattering, String> {
        match name {
            "full" => Ok(Scattering::Full),
            "half" => Ok(Scattering::Half),
            _ => Err(format!(
                "unknown scattering \"{name}\"; {}",
                names::remedy(name, &Scattering::NAMES)
            )),
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Scattering::Full => "full",
            Scattering::Half => "half",
        }
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

/// A picture that is part of a larger one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Width and height of the whole, pixels.
    pub whole: [u32; 2],
    /// The column and row of the whole at its upper left corner.
    pub corner: [u32; 2],
}

/// A validated request for one picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// What is rendered, at one instant.
    pub scene: Scene,
    /// What moves, if anything does: what the scene is at every other instant.
    pub motion: Option<Arc<Motion>>,
    /// The instant that `scene` is, s; 0 where nothing moves.
    pub time: f64,
    /// Width and height in pixels, each in [1, 16384].
    pub size: [u32; 2],
    /// Of which picture this one is a part, if it is of one; never where there is a `split`.
    pub part: Option<Part>,
    /// The method of the picture, or of its right part when `split` is given.
    pub multiple: Multiple,
    /// The method of the left part.
    pub split: Option<Multiple>,
    /// The share of the picture's width that is left of the divider, in [0, 1]; heeded where `split` is given.
    pub split_at: f64,
    /// Light scattered once. Where the method is [`Multiple::Brdf`], which knows no transport, there is
    /// none.
    pub single: Single,
    /// At which size both are shaded; at half only where there is no `split`, no [`Multiple::Brdf`] or
    /// [`Multiple::Exact`], and no [`Single::Traced`].
    pub scattering: Scattering,
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

/// What a mixture taps: its levels, their widths and weights, and which of them read the fourth moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Taps {
    /// The levels.
    pub levels: Levels,
    /// The standard deviation of each level's kernel, mm.
    pub widths: Vec<f64>,
    /// The reflectance that each level carries, per channel.
    pub weights: Vec<DVec3>,
    /// The taps that read the fourth moment, counted from 0.
    pub fourth: Range<u32>,
    /// The first tap that reads a volume; all after it do.
    pub first_volume: u32,
    /// The volumes, if there are any.
    pub volumes: Option<Volumes>,
}

impl Taps {
    /// The taps of `mixture` for profiles as the texels of a map in `frame` resolve them.
    pub fn new(dipoles: &[Dipole; 3], mixture: Mixture, frame: &LightFrame) -> Taps {
        let levels = Levels::choose(dipoles, frame.texel, mixture.level_step, LEVELS_MAX);
        let widths = levels.widths(frame.texel);
        let volumes = (1..levels.count)
            .skip_while(|&tap| levels.count - tap > mixture.volumes)
            .find_map(|tap| {
                let finest = levels.first + tap * levels.step;
                let volumes = Volumes::new(frame, &widths[tap as usize..], finest)?;
                Some((tap, volumes))
            });
        let (first_volume, volumes) = match volumes {
            Some((tap, volumes)) => (tap, Some(volumes)),
            None => (levels.count, None),
        };
        let channels = dipoles.map(|d| weights(&d, &widths, mixture.fit).values);
        let weights: Vec<_> = (0..widths.len())
            .map(|k| DVec3::from_array([0, 1, 2].map(|c| channels[c][k])))
            .collect();
        let fourth = match mixture.fourth {
            Fourth::Never => first_volume..first_volume,
            Fourth::From(level) => {
                let before = level.saturating_sub(levels.first).div_ceil(levels.step);
                before.min(first_volume)..first_volume
            }
            Fourth::Most(count) => {
                let count = count.min(first_volume);
                let light = |first: &u32| -> f64 {
                    let taps = &weights[*first as usize..(first + count) as usize];
                    taps.iter().map(|w| w.element_sum()).sum()
                };
                let first = (0..=first_volume - count)
                    .max_by(|a, b| light(a).total_cmp(&light(b)))
                    .unwrap_or(0);
                first..first + count
            }
        };
        Taps {
            levels,
            widths,
            weights,
            fourth,
            first_volume,
            volumes,
        }
    }

    /// What of the light within a level's reach is there at the next, at least.
    ///
    /// Moments of a kernel that holds the receiver's own surface, and others nearer and deeper,
    /// show one broad hump and lose the first; the finer level still saw it. Over an octave the true
    /// light falls below 0.8 of that in one of ten taps on the statue. Where less lies below the wider
    /// kernel, since it reaches beyond the object, the light falls by as much more.
    pub fn kept(&self) -> f64 {
        0.8_f64.powi(self.levels.step as i32)
    }

    /// Bilinear taps of the moments, and of the fourth moment, and trilinear ones of the volumes.
    pub fn counts(&self) -> [u32; 3] {
        let fourth = self.fourth.end - self.fourth.start;
        let volumes = self.levels.count - self.first_volume;
        [self.moments(), fourth, volumes]
    }

    /// How many taps read moments: all before the volumes, and of those the finest, which are blended
    /// with them.
    pub fn moments(&self) -> u32 {
        (self.first_volume + BLENDED).min(self.levels.count)
    }

    /// The level of tap `tap`.
    pub fn level(&self, tap: u32) -> u32 {
        self.levels.first + tap * self.levels.step
    }

    /// The levels of the pyramid that the taps of `taps` lie in, all between them included.
    pub fn span(&self, taps: Range<u32>) -> RangeInclusive<u32> {
        self.level(taps.start)..=self.level(taps.end.max(1) - 1)
    }
}

impl Plan {
    /// The column at which the right part of a split picture begins: that nearest to its share of the width, and of two
    /// as near the left one. 0 where all is right of it, the width where all is left.
    pub fn divider(&self) -> u32 {
        let width = self.size[0];
        let column = (self.split_at * f64::from(width) - 0.5).ceil();
        (column as u32).min(width)
    }

    /// The parts of the picture, from left to right: the first column of each, one past its last, and its method. No part
    /// is empty, and neighbours differ.
    pub fn parts(&self) -> impl Iterator<Item = ([u32; 2], Multiple)> {
        let (width, divider) = (self.size[0], self.divider());
        let left = self.split.filter(|left| *left != self.multiple);
        let first = left.map_or(0, |_| divider);
        let right = ([first, width], self.multiple);
        let left = left.map(|method| ([0, divider], method));
        let parts = left.into_iter().chain([right]);
        parts.filter(|([first, end], _)| first < end)
    }

    /// The methods of the picture: one, or those of its two parts.
    pub fn methods(&self) -> impl Iterator<Item = Multiple> {
        self.parts().map(|(_, method)| method)
    }

    /// The point that positions on the device are relative to, mm: the middle of the mesh, of one that moves over all its
    /// frames.
    pub fn center(&self) -> DVec3 {
        match &self.motion {
            Some(motion) => motion.center,
            None => self.scene.mesh.center(),
        }
    }

    /// Radius around [`Plan::center`] that holds the mesh, in all its frames, mm.
    pub fn radius(&self) -> f64 {
        match &self.motion {
            Some(motion) => motion.radius,
            None => self.scene.mesh.bounding_radius(),
        }
    }

    /// The frame of the light map, relative to [`Plan::center`].
    pub fn light_frame(&self) -> LightFrame {
        if let Some(motion) = &self.motion {
            return motion.light_frame(self.time, self.light_map);
        }
        let mesh = &self.scene.mesh;
        let center = mesh.center();
        LightFrame::fit(
            mesh.positions.iter().map(|&p| p - center),
            self.scene.light.to_light(),
            self.light_map,
            DVec2::ZERO,
        )
    }

    /// The same picture at another instant, `time` (s), if anything moves.
    #[must_use]
    pub fn at(&self, time: f64) -> Plan {
        let mut plan = self.clone();
        if let Some(motion) = &self.motion {
            let time = motion.within(time);
            plan.time = time;
            plan.scene.mesh = motion.mesh(time);
            plan.scene.light = motion.light(time);
            plan.scene.camera = motion.camera(time);
        }
        plan
    }

    /// [`Plan::light_frame`], given as `frame`, as averaged frame `index` shifts it.
    pub fn light_frame_at(&self, frame: &LightFrame, index: u32) -> LightFrame {
        let mut frame = frame.clone();
        frame.origin += self.offsets(index)[1] * frame.texel;
        frame
    }

    /// What the camera sees in averaged frame `index`, relative to the mesh's `center`; `radius` is that of
    /// the mesh around it.
    pub fn view_at(&self, center: DVec3, radius: f64, index: u32) -> View {
        let mut camera = self.scene.camera.clone();
        camera.eye -= center;
        camera.target -= center;
        let [width, height] = self.part.map_or(self.size, |part| part.whole);
        let view = camera.view(width, height, DVec3::ZERO, radius, self.offsets(index)[0]);
        match self.part {
            Some(Part { whole, corner }) => {
                let ([x, y], [width, height]) = (corner, self.size);
                view.cropped(whole, [x, y, width, height])
            }
            None => view,
        }
    }

    /// Columns and rows `place` (x, y, width, height), which lie within this picture, as a picture of their own, of one
    /// method: where this one is split, that of the side on which their middle lies.
    #[must_use]
    pub fn part_of(&self, place: [u32; 4]) -> Plan {
        let [x, y, width, height] = place;
        let Part { whole, corner } = self.part.unwrap_or(Part {
            whole: self.size,
            corner: [0; 2],
        });
        let middle = x + width / 2;
        let mut methods = self.parts();
        let method = methods.find(|([first, end], _)| (*first..*end).contains(&middle));
        Plan {
            size: [width, height],
            part: Some(Part {
                whole,
                corner: [corner[0] + x, corner[1] + y],
            }),
            multiple: method.map_or(self.multiple, |(_, method)| method),
            split: None,
            ..self.clone()
        }
    }

    /// Sub-pixel offset of the camera and sub-texel offset of the light map in frame `index`,
    /// each in [-1/2, 1/2)^2 and 0 in frame 0: Roberts's sequence in four dimensions, so that
    /// the two are not in step.
    fn offsets(&self, index: u32) -> [DVec2; 2] {
        // The positive root of x^5 = x + 1.
        const PHI_4: f64 = 1.167_303_978_261_418_7;
        if self.jitter != Jitter::All {
            return [DVec2::ZERO; 2];
        }
        let at = |k: i32| (0.5 + f64::from(index) * PHI_4.powi(-k)).fract() - 0.5;
        [DVec2::new(at(1), at(2)), DVec2::new(at(3), at(4))]
    }

    /// The method of the picture, or of its right part, in words: with the size it is shaded at, where that is not
    /// the picture's.
    pub fn method_name(&self) -> String {
        match self.scattering {
            Scattering::Full => self.multiple.to_string(),
            Scattering::Half => format!("{} at half", self.multiple),
        }
    }

    /// The march that light scattered once takes where the method is `multiple`, if it does.
    pub fn march(&self, multiple: Multiple) -> Option<March> {
        match self.single {
            Single::March(march) if multiple != Multiple::Brdf => Some(march),
            _ => None,
        }
    }

    /// The profiles of the three channels as texels of side `texel` (mm) resolve them.
    pub fn dipoles(&self, texel: f64) -> [Dipole; 3] {
        self.scene.material.dipoles().map(|d| d.resolved(texel))
    }

    /// What `mixture` taps in a map in `frame`.
    pub fn taps(&self, mixture: Mixture, frame: &LightFrame) -> Taps {
        Taps::new(&self.dipoles(frame.texel), mixture, frame)
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

impl fmt::Display for Single {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Single::Off => f.write_str("off"),
            Single::March(March { steps, exits }) => match exits {
                Exits::Linear => write!(f, "march({steps})"),
                exits => write!(f, "march({steps}, {})", exits.name()),
            },
            Single::Traced => f.write_str("traced"),
        }
    }
}

impl fmt::Display for Mixture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.fourth {
            Fourth::Never => f.write_str("mixture(3")?,
            Fourth::From(0) => f.write_str("mixture(4")?,
            Fourth::From(level) => write!(f, "mixture(4 from level {level}")?,
            Fourth::Most(count) => write!(f, "mixture(4 at {count} levels")?,
        }
        if self.level_step == 2 {
            f.write_str(", every second level")?;
        }
        if self.volumes > 0 {
            write!(f, ", {} volumes", self.volumes)?;
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
