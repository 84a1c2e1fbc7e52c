//! What one render did, as a document for scripts: `render --stats`.

use super::{Error, Output};
use crate::ledger::{self, HALF_SHADE, HALF_SHARE, budget::Chosen};
use crate::scene::Plan;
use serde::Serialize;
use std::io::Write as _;

/// What a renderer measured, as plain data.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measured {
    /// The device's name.
    pub device: String,
    /// Its driver.
    pub driver: String,
    /// Whether the validation layers watched.
    pub validation: bool,
    /// What they said.
    pub validation_messages: Vec<String>,
    /// Passes with their device times, mean over the frames in which each ran, ms.
    pub passes: Vec<(String, f64)>,
    /// Wall time of a frame, ms.
    pub wall_milliseconds: f64,
    /// Declared fetches: pass, term, what is read, reads per pixel.
    pub fetches: Vec<(String, String, String, u32)>,
}

/// The document. Lengths in mm, coefficients in mm^-1, angles in degrees, times in ms.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stats {
    /// Version of marmor.
    pub marmor: &'static str,
    /// What drew the picture.
    pub device: Device,
    /// What was drawn.
    pub scene: Scene,
    /// How it was drawn.
    pub method: Method,
    /// How long it took.
    pub times: Times,
    /// What it read.
    pub fetches: Fetches,
}

/// What drew the picture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Device {
    /// Its name.
    pub name: String,
    /// Its driver.
    pub driver: String,
    /// Whether the validation layers watched.
    pub validation: bool,
    /// What they said.
    pub validation_messages: Vec<String>,
}

/// What was drawn.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Scene {
    /// Where it came from.
    pub name: String,
    /// Vertices of the mesh.
    pub vertices: usize,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// The medium.
    pub material: Material,
    /// The light.
    pub light: Light,
    /// The camera.
    pub camera: Camera,
}

/// The medium.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Material {
    /// Preset, or "custom".
    pub name: String,
    /// Reduced scattering, mm^-1.
    pub sigma_s: [f64; 3],
    /// Absorption, mm^-1.
    pub sigma_a: [f64; 3],
    /// Relative index.
    pub eta: f64,
    /// Mean cosine of the phase function of light scattered once.
    pub g: f64,
    /// GGX alpha.
    pub roughness: f64,
}

/// The light.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Light {
    /// Degrees.
    pub azimuth: f64,
    /// Degrees.
    pub elevation: f64,
    /// On a surface that faces the light.
    pub irradiance: f64,
    /// Linear RGB.
    pub color: [f64; 3],
}

/// The camera.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Camera {
    /// mm.
    pub eye: [f64; 3],
    /// mm.
    pub target: [f64; 3],
    /// Direction.
    pub up: [f64; 3],
    /// Vertical, degrees.
    pub fov: f64,
}

/// How the picture was drawn.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Method {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// The fetch budget that chose the methods, if one did.
    pub budget: Option<Budget>,
    /// Method for multiple scattering, such as `samples(30)`.
    pub multiple: String,
    /// Method of the left part, if it differs.
    pub split: Option<String>,
    /// The share of the picture's width that it draws, in [0, 1], if there is one.
    pub split_at: Option<f64>,
    /// Single scattering, such as `march(8)`.
    pub single: String,
    /// Whether the specular reflection was added.
    pub specular: bool,
    /// Texels along a side of the light map.
    pub light_map: u32,
    /// Frames averaged.
    pub frames_averaged: u32,
    /// What moved between frames.
    pub jitter: &'static str,
    /// Factor on radiance before display encoding.
    pub exposure: f64,
    /// Linear RGB behind the picture.
    pub background: Option<[f64; 3]>,
}

/// A fetch budget, and what is known of the plan that it chose.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Budget {
    /// Fetches a pixel that were allowed; `fetches.per_pixel` are made.
    pub fetches: u32,
    /// The plan's error rr, as a mean over the scenes and materials that were measured.
    pub expected_rr: f64,
    /// The largest of them.
    pub worst_rr: f64,
}

impl From<Chosen> for Budget {
    fn from(chosen: Chosen) -> Budget {
        Budget {
            fetches: chosen.budget,
            expected_rr: chosen.row.expected,
            worst_rr: chosen.row.worst,
        }
    }
}

/// How long the picture took, ms per frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Times {
    /// Wall time.
    pub wall: f64,
    /// Sum of the passes' device times: of a frame that runs them all.
    pub device: f64,
    /// Each pass.
    pub passes: Vec<Pass>,
}

/// The time of one pass.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pass {
    /// Its name.
    pub pass: String,
    /// Mean over the frames in which it ran, ms: light and what is made of it rest while the light map does.
    pub milliseconds: f64,
}

/// Declared texture fetches.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fetches {
    /// Of a pixel of the picture, over all passes; of [`HALF_SHADE`] its share, rounded up, as [`ledger::total`] has it.
    pub per_pixel: u64,
    /// Each pass.
    pub passes: Vec<PassFetches>,
}

/// The declared fetches of one pass.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PassFetches {
    /// Its name.
    pub pass: String,
    /// Of one of the pass's own pixels, over all terms.
    pub per_pixel: u64,
    /// Each term.
    pub terms: Vec<Term>,
}

/// The declared fetches of one term.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Term {
    /// Its name.
    pub term: String,
    /// What is read.
    pub what: String,
    /// Reads per pixel.
    pub per_pixel: u32,
}

impl Stats {
    /// The document of one render.
    pub fn new(plan: &Plan, measured: Measured) -> Stats {
        let scene = &plan.scene;
        let (material, light, camera) = (&scene.material, &scene.light, &scene.camera);
        Stats {
            marmor: env!("CARGO_PKG_VERSION"),
            device: Device {
                name: measured.device,
                driver: measured.driver,
                validation: measured.validation,
                validation_messages: measured.validation_messages,
            },
            scene: Scene {
                name: scene.name.clone(),
                vertices: scene.mesh.positions.len(),
                triangles: scene.mesh.triangles.len(),
                material: Material {
                    name: material.name.clone(),
                    sigma_s: material.sigma_s.to_array(),
                    sigma_a: material.sigma_a.to_array(),
                    eta: material.eta,
                    g: material.g,
                    roughness: material.roughness,
                },
                light: Light {
                    azimuth: light.azimuth,
                    elevation: light.elevation,
                    irradiance: light.irradiance,
                    color: light.color.to_array(),
                },
                camera: Camera {
                    eye: camera.eye.to_array(),
                    target: camera.target.to_array(),
                    up: camera.up.to_array(),
                    fov: camera.fov,
                },
            },
            method: Method {
                size: plan.size,
                budget: None,
                multiple: plan.method_name(),
                split: plan.split.map(|method| method.to_string()),
                split_at: plan.split.map(|_| plan.split_at),
                single: plan.single.to_string(),
                specular: plan.specular,
                light_map: plan.light_map,
                frames_averaged: plan.frames_averaged,
                jitter: plan.jitter.name(),
                exposure: plan.exposure,
                background: plan.background,
            },
            times: Times {
                wall: measured.wall_milliseconds,
                device: measured.passes.iter().map(|(_, time)| time).sum(),
                passes: measured
                    .passes
                    .into_iter()
                    .map(|(pass, milliseconds)| Pass { pass, milliseconds })
                    .collect(),
            },
            fetches: Fetches::new(measured.fetches),
        }
    }

    /// Writes the document as JSON, indented.
    ///
    /// # Errors
    /// The disk does not take the file.
    pub fn write(&self, output: &Output) -> Result<(), Error> {
        output.write(|writer| {
            serde_json::to_writer_pretty(&mut *writer, self)?;
            writer.write_all(b"\n")
        })
    }
}

impl Fetches {
    /// Groups declared fetches (pass, term, what, reads per pixel) by pass, in the order
    /// of first appearance.
    pub fn new(declared: Vec<(String, String, String, u32)>) -> Fetches {
        let mut passes: Vec<PassFetches> = Vec::new();
        for (pass, term, what, per_pixel) in declared {
            // Attachment reads are no fetches, and those per texel or cell are not per pixel.
            let counted = if ledger::counts(&term) {
                u64::from(per_pixel)
            } else {
                0
            };
            let term = Term {
                term,
                what,
                per_pixel,
            };
            match passes.iter_mut().find(|known| known.pass == pass) {
                Some(known) => {
                    known.per_pixel += counted;
                    known.terms.push(term);
                }
                None => passes.push(PassFetches {
                    pass,
                    per_pixel: counted,
                    terms: vec![term],
                }),
            }
        }
        let of_picture = |pass: &PassFetches| match pass.pass.as_str() {
            HALF_SHADE => pass.per_pixel.div_ceil(u64::from(HALF_SHARE)),
            _ => pass.per_pixel,
        };
        Fetches {
            per_pixel: passes.iter().map(of_picture).sum(),
            passes,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Request, Scattering};

    #[test]
    fn the_sum_is_that_of_the_ledger() {
        for scattering in [Scattering::Full, Scattering::Half] {
            let mut request = Request::statue();
            request.scattering = scattering;
            let plan = request.plan().expect("a plan");
            let declared = ledger::declared(&plan, ledger::Filter::Linear);
            let rows = declared.iter().map(|line| {
                let [pass, term, what] = [line.pass, line.term, line.what].map(str::to_owned);
                (pass, term, what, line.per_pixel)
            });
            let sum = Fetches::new(rows.collect()).per_pixel;
            assert_eq!(sum, u64::from(ledger::total(&declared)), "{scattering:?}");
        }
    }

    #[test]
    fn fetches_add_up_by_pass() {
        let row = |pass: &str, term: &str, count| {
            (pass.to_owned(), term.to_owned(), "map".to_owned(), count)
        };
        let fetches = Fetches::new(vec![
            row("shade", "multiple", 30),
            row("resolve", "history", 1),
            row("shade", "shadow", 1),
            row("shade", "input", 2),
            row("reduce", "texel", 9),
            row("reduce", "buffer", 27),
            row("volume", "buffer", 27),
            row("half shade", "multiple", 9),
        ]);
        // Four pixels share what is shaded for them.
        assert_eq!(fetches.per_pixel, 32 + 3);
        let passes: Vec<_> = fetches
            .passes
            .iter()
            .map(|p| (p.pass.as_str(), p.per_pixel, p.terms.len()))
            .collect();
        assert_eq!(
            passes,
            [
                ("shade", 31, 3),
                ("resolve", 1, 1),
                ("reduce", 0, 2),
                ("volume", 0, 1),
                ("half shade", 9, 1)
            ]
        );
    }
}
