//! The shade pass: the radiance that leaves each visible point.

mod half;
mod mixture;
mod multiple;
mod rings;
mod shadow;
mod single;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

pub use half::{halved, upsampled};
pub use mixture::{Spread, Tap, VolumeTap, mixture, two_gaussians};
pub use multiple::{TECHNIQUES, brdf, exact, samples, samples_shifted};
pub use rings::rings;
pub use shadow::visibility;
pub use single::{Medium, exit_length, single};

use crate::cpu::boxes::boxes;
use crate::cpu::reduce::{self, pyramid};
use crate::cpu::{GBuffer, LightMap, volume};
use crate::optics::sampling::r2;
pub use crate::optics::sampling::{NOISE_SIZE, noise};
use crate::optics::single::PathFit;
use crate::optics::{Dipole, fresnel, specular as microfacet};
use crate::scene::{Light, March, Material, Mixture, Multiple, Taps, View};

/// Interpolated normals may turn away from the viewer where the triangle does not. How grazing
/// may light leave? The clamp touches the outer 2 % of a sphere's radius, and spares it the
/// black rim that Ft(0) = 0 would draw.
pub const MIN_COS_OUT: f64 = 0.2;

/// A visible point of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// Position, mm.
    pub p: DVec3,
    /// Unit normal.
    pub n: DVec3,
    /// Unit direction to the viewer.
    pub wo: DVec3,
    /// Column and row of the pixel that sees it.
    pub pixel: [u32; 2],
    /// Position (mm) and outward unit normal of the nearest back face that the pixel sees behind it.
    pub back: Option<(DVec3, DVec3)>,
}

/// What every pixel is shaded with.
#[derive(Clone, Debug)]
pub struct Shading<'a> {
    /// Profiles of the three colour channels, as the map resolves them.
    pub dipoles: [Dipole; 3],
    /// Total diffuse reflectance R_tot per channel, of the medium itself.
    pub totals: DVec3,
    /// Relative index of refraction.
    pub eta: f64,
    /// GGX roughness of the boundary, in (0, 1].
    pub roughness: f64,
    /// Irradiance E0 on a surface perpendicular to the light, per channel.
    pub irradiance: DVec3,
    /// What the light sees.
    pub map: &'a LightMap,
    /// Two channels of blue noise in [0, 1), [`NOISE_SIZE`] x [`NOISE_SIZE`], row-major.
    pub noise: &'a [[f32; 2]],
    /// Index of the frame: moves the sample sequence.
    pub frame: u32,
    /// Levels whose moments the method `mixture` taps, from fine to coarse.
    pub taps: Vec<Tap>,
    /// The coarser levels, whose volumes it taps; the finest of them are among `taps`, too.
    pub volumes: Vec<VolumeTap>,
    /// How many levels, the last of `taps` and the first of `volumes`, are blended from both.
    pub blended: usize,
    /// [`Taps::kept`] of them.
    pub kept: f64,
    /// The medium as single scattering has it.
    pub medium: Medium,
    /// Levels that the method `rings` reads, from level 0: means of (w, w z, w z^2, w z^3).
    pub boxes: Vec<reduce::Level<4>>,
}

impl<'a> Shading<'a> {
    /// Gathers what `material` under `light`, seen through `map`, is shaded with in frame
    /// `frame`.
    ///
    /// `noise` is that of [`noise`]; it must have [`NOISE_SIZE`]^2 entries.
    pub fn new(
        material: &Material,
        light: &Light,
        map: &'a LightMap,
        noise: &'a [[f32; 2]],
        frame: u32,
    ) -> Self {
        let dipoles = material.dipoles();
        Shading {
            dipoles: dipoles.map(|d| d.resolved(map.frame.texel)),
            totals: DVec3::from_array(dipoles.map(|d| d.total())),
            eta: material.eta,
            roughness: material.roughness,
            irradiance: light.perpendicular_irradiance(),
            map,
            noise,
            frame,
            taps: Vec::new(),
            volumes: Vec::new(),
            blended: 0,
            kept: 0.0,
            medium: Medium {
                sigma_s: material.unreduced_sigma_s(),
                sigma_t: material.unreduced_sigma_s() + material.sigma_a,
                g: material.g,
                path: PathFit::new(material.eta),
            },
            boxes: Vec::new(),
        }
    }

    /// Reduces the map to what `multiple` reads.
    pub fn reduce(&mut self, multiple: Multiple) {
        match multiple {
            Multiple::Rings(_) => {
                self.boxes = boxes([self.map.frame.size; 2], &self.map.moments);
            }
            Multiple::Mixture(mixture) => {
                let taps = self.taps_of(mixture);
                let base: Vec<[f64; 5]> = self
                    .map
                    .moments
                    .iter()
                    .zip(&self.map.fourth)
                    .map(|(&[a, b, c, d], &e)| [a, b, c, d, e])
                    .collect();
                let base = reduce::Level::base([self.map.frame.size; 2], &base);
                let pyramid = pyramid(base, taps.level(taps.moments() - 1) + 1);
                self.kept = taps.kept();
                self.volumes = self.volumes_of(&taps);
                self.blended = (taps.moments() - taps.first_volume) as usize;
                self.taps = (0..taps.moments())
                    .zip(taps.levels.iter())
                    .map(|(i, level)| Tap {
                        level,
                        s: taps.widths[i as usize],
                        weight: taps.weights[i as usize],
                        fourth: taps.fourth.contains(&i),
                        smoothed: reduce::smooth(&pyramid[level as usize]),
                    })
                    .collect();
            }
            _ => {}
        }
    }

    /// What `mixture` taps.
    pub fn taps_of(&self, mixture: Mixture) -> Taps {
        Taps::new(&self.dipoles, mixture, &self.map.frame)
    }

    fn volumes_of(&self, taps: &Taps) -> Vec<VolumeTap> {
        let Some(volumes) = &taps.volumes else {
            return Vec::new();
        };
        (0..)
            .zip(volume::volumes(self.map, volumes))
            .map(|(i, light)| VolumeTap {
                weight: taps.weights[(taps.first_volume + i) as usize],
                light,
            })
            .collect()
    }

    /// Random shift of the sample sequence at a pixel, in [0, 1)^2: blue noise over the
    /// picture, the R2 sequence over frames.
    pub fn shift(&self, pixel: [u32; 2]) -> [f64; 2] {
        let [x, y] = pixel.map(|k| k as usize % NOISE_SIZE);
        r2(self.noise[y * NOISE_SIZE + x].map(f64::from), self.frame)
    }
}

/// Radiance of the specular reflection at `receiver`: E0 f cos(theta) times visibility.
pub fn specular(shading: &Shading, receiver: &Receiver) -> DVec3 {
    let to_light = shading.map.frame.to_light;
    let value = microfacet::ggx(
        receiver.n,
        receiver.wo,
        to_light,
        shading.roughness,
        shading.eta,
    );
    let cos = receiver.n.dot(to_light).max(0.0);
    shading.irradiance * (value * cos * visibility(shading.map, receiver.p, receiver.n))
}

/// Radiant exitance M of multiple scattering at `receiver`, by one of the methods;
/// [`Shading::reduce`] must have made what it reads.
pub fn exitance(shading: &Shading, receiver: &Receiver, multiple: Multiple) -> DVec3 {
    match multiple {
        Multiple::None => DVec3::ZERO,
        Multiple::Brdf => brdf(shading, receiver),
        Multiple::Samples(n) => samples(shading, receiver, n),
        Multiple::Rings(n) => rings(shading, receiver, n),
        Multiple::Mixture(_) => mixture(shading, receiver),
        Multiple::Exact => exact(shading, receiver),
    }
}

/// Radiance towards the viewer: the specular reflection if asked for, single scattering by `march` if
/// there is one, and Ft(n . wo) / pi times [`exitance`].
pub fn radiance(
    shading: &Shading,
    receiver: &Receiver,
    multiple: Multiple,
    march: Option<March>,
    with_specular: bool,
) -> DVec3 {
    let cos_out = receiver.n.dot(receiver.wo).max(MIN_COS_OUT);
    let leaving = fresnel::transmittance(cos_out, shading.eta);
    let mut sum = exitance(shading, receiver, multiple) * (leaving * std::f64::consts::FRAC_1_PI);
    if let Some(march) = march {
        sum += single(shading, receiver, march);
    }
    if with_specular {
        sum += specular(shading, receiver);
    }
    sum
}

/// The point that pixel `index` (row-major) of `gbuffer` sees through `view`, or none.
pub fn receiver(gbuffer: &GBuffer, view: &View, index: usize) -> Option<Receiver> {
    let depth = gbuffer.depth[index];
    if depth >= 1.0 {
        return None;
    }
    let (x, y) = (index % gbuffer.width, index / gbuffer.width);
    let at = |depth| view.position(DVec2::new(x as f64 + 0.5, y as f64 + 0.5), depth);
    let p = at(depth);
    // An open sheet seen from behind is its own back face, and no way out.
    let back = gbuffer.back_depth[index];
    let back = (back > depth && back < 1.0).then(|| (at(back), gbuffer.back_normal[index]));
    Some(Receiver {
        p,
        n: gbuffer.normal[index],
        wo: (view.eye - p).normalize(),
        pixel: [x as u32, y as u32],
        back,
    })
}

/// Shades a picture: (radiance, 1) in every covered pixel, 0 elsewhere, row-major.
pub fn shade(
    gbuffer: &GBuffer,
    view: &View,
    shading: &Shading,
    multiple: Multiple,
    march: Option<March>,
    with_specular: bool,
) -> Vec<[f64; 4]> {
    (0..gbuffer.depth.len())
        .into_par_iter()
        .map(|index| {
            receiver(gbuffer, view, index).map_or([0.0; 4], |receiver| {
                radiance(shading, &receiver, multiple, march, with_specular)
                    .extend(1.0)
                    .to_array()
            })
        })
        .collect()
}
