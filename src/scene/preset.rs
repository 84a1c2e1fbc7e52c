//! The measured materials of Jensen, Marschner, Levoy and Hanrahan, "A practical model
//! for subsurface light transport", SIGGRAPH 2001, figure 5.
//!
//! The paper measured reduced scattering and absorption coefficients in mm^-1 and
//! assumed eta = 1.3 for all but marble, for which it used 1.5. Roughness is ours.

use super::{Material, defaults, names};
use glam::DVec3;

struct Row {
    name: &'static str,
    sigma_s: [f64; 3],
    sigma_a: [f64; 3],
    eta: f64,
}

const fn row(name: &'static str, sigma_s: [f64; 3], sigma_a: [f64; 3]) -> Row {
    Row {
        name,
        sigma_s,
        sigma_a,
        eta: 1.3,
    }
}

const TABLE: [Row; 12] = [
    row("apple", [2.29, 2.39, 1.97], [0.0030, 0.0034, 0.046]),
    row("chicken1", [0.15, 0.21, 0.38], [0.015, 0.077, 0.19]),
    row("chicken2", [0.19, 0.25, 0.32], [0.018, 0.088, 0.20]),
    row("cream", [7.38, 5.47, 3.15], [0.0002, 0.0028, 0.0163]),
    row("ketchup", [0.18, 0.07, 0.03], [0.061, 0.97, 1.45]),
    Row {
        eta: 1.5,
        ..row("marble", [2.19, 2.62, 3.00], [0.0021, 0.0041, 0.0071])
    },
    row("potato", [0.68, 0.70, 0.55], [0.0024, 0.0090, 0.12]),
    row("skimmilk", [0.70, 1.22, 1.90], [0.0014, 0.0025, 0.0142]),
    row("skin1", [0.74, 0.88, 1.01], [0.032, 0.17, 0.48]),
    row("skin2", [1.09, 1.59, 1.79], [0.013, 0.070, 0.145]),
    row("spectralon", [11.6, 20.4, 14.9], [0.0, 0.0, 0.0]),
    row("wholemilk", [2.55, 3.21, 3.77], [0.0011, 0.0024, 0.014]),
];

/// The names of the presets, in alphabetical order.
pub const NAMES: [&str; TABLE.len()] = {
    let mut names = [""; TABLE.len()];
    let mut i = 0;
    while i < TABLE.len() {
        names[i] = TABLE[i].name;
        i += 1;
    }
    names
};

impl Material {
    /// The preset called `name`.
    ///
    /// # Errors
    /// A phrase that suggests the nearest preset, or lists them all.
    pub fn preset(name: &str) -> Result<Material, String> {
        TABLE
            .iter()
            .find(|row| row.name == name)
            .map(Row::material)
            .ok_or_else(|| {
                format!(
                    "unknown material \"{name}\"; {}",
                    names::remedy(name, &NAMES)
                )
            })
    }
}

impl Row {
    fn material(&self) -> Material {
        Material {
            name: self.name.to_owned(),
            sigma_s: DVec3::from_array(self.sigma_s),
            sigma_a: DVec3::from_array(self.sigma_a),
            eta: self.eta,
            g: defaults::G,
            roughness: defaults::ROUGHNESS,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_is_found_and_valid() {
        for name in NAMES {
            let material = Material::preset(name).expect(name);
            assert_eq!(material.name, name);
            material.check().expect(name);
        }
        assert!(NAMES.is_sorted());
        assert_eq!(Material::preset("marble").map(|m| m.eta), Ok(1.5));
        assert_eq!(Material::preset("skin1").map(|m| m.eta), Ok(1.3));
    }

    #[test]
    fn a_near_miss_is_suggested() {
        let message = Material::preset("marbel").expect_err("no such preset");
        assert!(message.contains("did you mean \"marble\"?"), "{message}");
    }
}
