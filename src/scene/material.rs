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

/// Reflectances that a medium can have and still be told from black or from one that absorbs nothing.
const REFLECTANCE: std::ops::RangeInclusive<f64> = 0.01..=0.97;

impl Material {
    /// The medium whose total diffuse reflectance is `color` (linear RGB), with a transport mean free path of 1 mm in
    /// every channel: what a colour says of a medium, and what it leaves open. Its boundary and phase function are those
    /// of `like`.
    ///
    /// Inverts R_tot of alpha' ([`Dipole::total`]).
    pub fn colored(color: DVec3, like: &Material) -> Material {
        let alpha = color.to_array().map(|channel| {
            let wanted = channel.clamp(*REFLECTANCE.start(), *REFLECTANCE.end());
            let total = |alpha: f64| Dipole::new(alpha, 1.0 - alpha, like.eta).total();
            // R_tot grows with alpha'; 52 halvings are all that f64 has.
            let (mut lo, mut hi) = (1e-6, 1.0);
            for _ in 0..52 {
                let middle = 0.5 * (lo + hi);
                *(if total(middle) < wanted {
                    &mut lo
                } else {
                    &mut hi
                }) = middle;
            }
            0.5 * (lo + hi)
        });
        let alpha = DVec3::from_array(alpha);
        Material {
            name: "colour of the mesh".to_owned(),
            sigma_s: alpha,
            sigma_a: 1.0 - alpha,
            eta: like.eta,
            g: like.g,
            roughness: like.roughness,
        }
    }

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_colour_is_the_total_reflectance_of_its_medium() {
        let color = DVec3::new(0.85, 0.45, 0.05);
        let like = Material::preset("skin1").expect("a preset");
        let medium = Material::colored(color, &like);
        medium.check().expect("within the limits");
        for (channel, dipole) in medium.dipoles().iter().enumerate() {
            assert!((dipole.total() - color[channel]).abs() < 1e-9);
            assert!((dipole.sigma_t - 1.0).abs() < 1e-12);
        }
        let clamped = Material::colored(DVec3::new(0.0, 1.0, 7.0), &like);
        clamped.check().expect("within the limits");
    }
}
