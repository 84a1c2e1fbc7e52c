//! The fetch ledger as a table and as a document for scripts: `marmor fetches`.

use crate::ledger::{self, Ledger};
use serde::Serialize;

/// The ledger of one plan on one device.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Document {
    /// Version of marmor.
    pub marmor: &'static str,
    /// Name of the device.
    pub device: String,
    /// Driver name and version.
    pub driver: String,
    /// Where the scene came from.
    pub scene: String,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Method for multiple scattering.
    pub multiple: String,
    /// Single scattering.
    pub single: String,
    /// Fetches of a pixel over all passes.
    pub per_pixel: PerPixel,
    /// What each pass reads for each term.
    pub terms: Vec<Term>,
    /// Where the accounts differ; empty when all is well.
    pub disagreements: Vec<String>,
    /// What is declared, but of which no pixel of this picture makes full use.
    pub unread: Vec<String>,
}

/// Fetches of a pixel over all passes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PerPixel {
    /// As the plan declares them.
    pub declared: f64,
    /// As they stand in the SPIR-V.
    pub found: f64,
    /// Of the pixel that made most.
    pub measured: Option<u32>,
}

/// What one shader reads for one term.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Term {
    /// The pass.
    pub pass: String,
    /// The file of its shader.
    pub shader: String,
    /// single, multiple, other: fetches of a pixel; input: reads of input attachments; texel: reads for each texel that
    /// a pass over the light map writes; buffer: the same of buffers.
    pub term: String,
    /// Declared.
    pub declared: f64,
    /// Found in the SPIR-V.
    pub found: Option<f64>,
    /// Measured: the pixel, or texel, that read most.
    pub measured: Option<f64>,
    /// Measured: the mean over the pixels in which the pass ran.
    pub mean: Option<f64>,
    /// The textures.
    pub textures: Vec<Texture>,
}

/// What is read of one texture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Texture {
    /// Its name in the shader.
    pub texture: String,
    /// What it holds and how it is read.
    pub what: String,
    /// Declared.
    pub declared: f64,
    /// Found in the SPIR-V.
    pub found: Option<f64>,
    /// Where.
    pub sites: Vec<Site>,
}

/// One read that stands in a shader.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Site {
    /// The file and line.
    pub place: String,
    /// The function of the source.
    pub function: String,
    /// How the texture is read.
    pub kind: &'static str,
    /// Files and lines of the loops around it, outermost first.
    pub loops: Vec<String>,
    /// How often it runs in one invocation.
    pub trips: u64,
}

impl Document {
    /// The document of `ledger`, for a device, a scene and a plan in words.
    pub fn new(
        ledger: &Ledger,
        [device, driver, scene]: [String; 3],
        size: [u32; 2],
        [multiple, single]: [String; 2],
    ) -> Document {
        let place = |p: &ledger::spirv::Place| format!("{}:{}", p.file, p.line);
        let texture = |row: &ledger::Row| Texture {
            texture: row.texture.clone(),
            what: row.what.clone(),
            declared: row.declared,
            found: row.found,
            sites: row
                .sites
                .iter()
                .map(|site| Site {
                    place: place(&site.place),
                    function: site.function.clone(),
                    kind: site.kind.name(),
                    loops: site.loops.iter().map(place).collect(),
                    trips: site.trips,
                })
                .collect(),
        };
        let terms = ledger.subtotals.iter().map(|sum| Term {
            pass: sum.pass.clone(),
            shader: sum.shader.clone(),
            term: sum.term.clone(),
            declared: sum.declared,
            found: sum.found,
            measured: sum.measured.map(|m| m.most),
            mean: sum.measured.and_then(|m| m.mean),
            textures: ledger
                .rows
                .iter()
                .filter(|row| {
                    row.pass == sum.pass && row.shader == sum.shader && row.term == sum.term
                })
                .map(texture)
                .collect(),
        });
        Document {
            marmor: env!("CARGO_PKG_VERSION"),
            device,
            driver,
            scene,
            size,
            multiple,
            single,
            per_pixel: PerPixel {
                declared: ledger.declared(),
                found: ledger.found(),
                measured: ledger.most(),
            },
            terms: terms.collect(),
            disagreements: ledger.disagreements(),
            unread: ledger.unread(),
        }
    }

    /// The document as a table; with `sites` a line for each read that stands in a shader.
    pub fn table(&self, sites: bool) -> String {
        let [width, height] = self.size;
        let mut table = format!(
            "{}, {width}x{height}, {}, single {}\n{}, {}\n\n",
            self.scene, self.multiple, self.single, self.device, self.driver
        );
        let lines = self.terms.iter().flat_map(|t| &t.textures);
        let wide = lines.map(|t| t.texture.len() + t.what.len() + 4).max();
        let wide = wide.unwrap_or(0).max(36);
        let measured = |n: Option<f64>| n.map_or("-".to_owned(), number);
        let heading = |unit: &str| {
            format!(
                "{:<wide$} {:>8} {:>8} {:>8} {:>8}\n",
                unit, "declared", "SPIR-V", "measured", "mean"
            )
        };
        let units = [
            "fetches of a pixel",
            "reads of input attachments",
            "reads for each texel or cell written",
        ];
        for (at, unit) in units.into_iter().enumerate() {
            let belongs = |term: &&Term| match at {
                0 => ledger::counts(&term.term),
                1 => term.term == ledger::INPUT,
                _ => term.term == ledger::TEXEL || term.term == ledger::BUFFER,
            };
            let terms: Vec<_> = self.terms.iter().filter(belongs).collect();
            if terms.is_empty() {
                continue;
            }
            if at > 0 {
                table.push('\n');
            }
            table.push_str(&heading(unit));
            for term in terms {
                let name = if at == 0 {
                    format!("{} {}", term.pass, term.term)
                } else {
                    format!("{}, {}", term.pass, term.shader)
                };
                table.push_str(&format!(
                    "{name:<wide$} {:>8} {:>8} {:>8} {:>8}\n",
                    number(term.declared),
                    measured(term.found),
                    measured(term.measured),
                    term.mean.map_or("-".to_owned(), |m| format!("{m:.2}")),
                ));
                for texture in &term.textures {
                    let name = format!("  {}: {}", texture.texture, texture.what);
                    table.push_str(&format!(
                        "{name:<wide$} {:>8} {:>8}\n",
                        number(texture.declared),
                        measured(texture.found),
                    ));
                    if sites {
                        table.push_str(&texture.sites());
                    }
                }
            }
            if at == 0 {
                table.push_str(&format!(
                    "{:<wide$} {:>8} {:>8} {:>8}\n",
                    "in all",
                    number(self.per_pixel.declared),
                    number(self.per_pixel.found),
                    measured(self.per_pixel.measured.map(f64::from)),
                ));
            }
        }
        for line in &self.unread {
            table.push_str(&format!("note     {line}\n"));
        }
        for line in &self.disagreements {
            table.push_str(&format!("DIFFERS  {line}\n"));
        }
        table
    }
}

impl Texture {
    /// A line for each place that reads it, those of unrolled loops together.
    fn sites(&self) -> String {
        let mut lines: Vec<(String, u32)> = Vec::new();
        for site in &self.sites {
            let loops: Vec<_> = site.loops.iter().map(|l| format!(", loop {l}")).collect();
            let Site {
                place,
                function,
                kind,
                trips,
                ..
            } = site;
            let line = format!("    {place} {function}: {kind} x {trips}{}", loops.concat());
            match lines.last_mut().filter(|(last, _)| *last == line) {
                Some((_, times)) => *times += 1,
                None => lines.push((line, 1)),
            }
        }
        let lines = lines.into_iter().map(|(line, times)| match times {
            1 => format!("{line}\n"),
            _ => format!("{line}, unrolled {times} times\n"),
        });
        lines.collect()
    }
}

/// A whole number as such, others with two digits.
fn number(n: f64) -> String {
    if n.fract() == 0.0 {
        format!("{n:.0}")
    } else {
        format!("{n:.2}")
    }
}
