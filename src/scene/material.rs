//! Scattering media: the presets of Jensen et al. 2001, and custom coefficients.

use super::limits;
use crate::optics::Dipole;
use glam::DVec3;

/// A homogeneous scattering medium with a smooth or rough dielectric boundary.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name of the preset, or "custom".
    pub name: String,
    /// Reduced scattering coefficient sigma_s' per RGB channel, mm^-1.
    pub sigma_s: DVec3,
    /// Absorption coefficient sigma_a per RGB channel, mm^-1.
    pub sigma_a: DVec3,
    /// Relative index of refraction eta of the medium.
    pub eta: f64,
    /// Mean cosine g of the phase function that light scattered once follows, in (-1, 1).
    ///
    /// The coefficients above are reduced by it: sigma_s' = (1 - g) sigma_s. What is scattered many
    /// times knows sigma_s' alone.
    pub g: f64,
    /// GGX roughness alpha of the boundary's specular lobe, in (0, 1].
    pub roughness: f64,
}

impl Material {
    /// The diffusion profile of each channel.
    pub fn dipoles(&self) -> [Dipole; 3] {
        [0, 1, 2].map(|c| Dipole::new(self.sigma_s[c], self.sigma_a[c], self.eta))
    }

    /// Scattering coefficient sigma_s = sigma_s' / (1 - g) per channel, mm^-1: what light meets before it
    /// is scattered for the first time.
    pub fn unreduced_sigma_s(&self) -> DVec3 {
        self.sigma_s / (1.0 - self.g)
    }

    /// Checks every coefficient against [`limits`].
    ///
    /// # Errors
    /// A phrase that names the coefficient, its limits and the value found.
    pub fn check(&self) -> Result<(), String> {
        let named = |name: &str, result: Result<(), String>| {
            result.map_err(|phrase| format!("{name} {phrase}"))
        };
        named("sigma_s", limits::sigma_s(self.sigma_s).map(drop))?;
        named("sigma_a", limits::sigma_a(self.sigma_a).map(drop))?;
        named("eta", limits::eta(self.eta).map(drop))?;
        named("g", limits::g(self.g).map(drop))?;
        named("roughness", limits::roughness(self.roughness).map(drop))
    }
}
