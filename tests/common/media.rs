//! The media of Jensen et al. 2001, figure 5, with the diffuse reflectance measured for each.

use glam::DVec3;
use marmor::optics::Dipole;
use marmor::scene::Material;

/// One row of the table.
pub struct Medium {
    pub name: &'static str,
    /// sigma_s' per channel, mm^-1.
    pub sigma_s: [f64; 3],
    /// sigma_a per channel, mm^-1.
    pub sigma_a: [f64; 3],
    /// The table's diffuse reflectance per channel.
    pub reflectance: [f64; 3],
    pub eta: f64,
}

impl Medium {
    pub fn dipole(&self, channel: usize) -> Dipole {
        Dipole::new(self.sigma_s[channel], self.sigma_a[channel], self.eta)
    }

    pub fn material(&self) -> Material {
        Material {
            name: self.name.into(),
            sigma_s: DVec3::from_array(self.sigma_s),
            sigma_a: DVec3::from_array(self.sigma_a),
            eta: self.eta,
            g: 0.0,
            roughness: 0.3,
        }
    }
}

/// The row called `name`.
pub fn medium(name: &str) -> &'static Medium {
    TABLE
        .iter()
        .find(|m| m.name == name)
        .expect("a name from the table")
}

const fn row(
    name: &'static str,
    sigma_s: [f64; 3],
    sigma_a: [f64; 3],
    reflectance: [f64; 3],
    eta: f64,
) -> Medium {
    Medium {
        name,
        sigma_s,
        sigma_a,
        reflectance,
        eta,
    }
}

pub static TABLE: [Medium; 12] = [
    row(
        "apple",
        [2.29, 2.39, 1.97],
        [0.0030, 0.0034, 0.046],
        [0.85, 0.84, 0.53],
        1.3,
    ),
    row(
        "chicken1",
        [0.15, 0.21, 0.38],
        [0.015, 0.077, 0.19],
        [0.31, 0.15, 0.10],
        1.3,
    ),
    row(
        "chicken2",
        [0.19, 0.25, 0.32],
        [0.018, 0.088, 0.20],
        [0.32, 0.16, 0.10],
        1.3,
    ),
    row(
        "cream",
        [7.38, 5.47, 3.15],
        [0.0002, 0.0028, 0.0163],
        [0.98, 0.90, 0.73],
        1.3,
    ),
    row(
        "ketchup",
        [0.18, 0.07, 0.03],
        [0.061, 0.97, 1.45],
        [0.16, 0.01, 0.00],
        1.3,
    ),
    row(
        "marble",
        [2.19, 2.62, 3.00],
        [0.0021, 0.0041, 0.0071],
        [0.83, 0.79, 0.75],
        1.5,
    ),
    row(
        "potato",
        [0.68, 0.70, 0.55],
        [0.0024, 0.0090, 0.12],
        [0.77, 0.62, 0.21],
        1.3,
    ),
    row(
        "skimmilk",
        [0.70, 1.22, 1.90],
        [0.0014, 0.0025, 0.0142],
        [0.81, 0.81, 0.69],
        1.3,
    ),
    row(
        "skin1",
        [0.74, 0.88, 1.01],
        [0.032, 0.17, 0.48],
        [0.44, 0.22, 0.13],
        1.3,
    ),
    row(
        "skin2",
        [1.09, 1.59, 1.79],
        [0.013, 0.070, 0.145],
        [0.63, 0.44, 0.34],
        1.3,
    ),
    row(
        "spectralon",
        [11.6, 20.4, 14.9],
        [0.0, 0.0, 0.0],
        [1.0, 1.0, 1.0],
        1.3,
    ),
    row(
        "wholemilk",
        [2.55, 3.21, 3.77],
        [0.0011, 0.0024, 0.014],
        [0.91, 0.88, 0.76],
        1.3,
    ),
];
