//! The ledger as a table: declared, found and measured, side by side.

use super::spirv::{self, Kind, Site};
use super::{BUFFER, Declared, HALF_SHADE, HALF_SHARE, INPUT, TEXEL, counts};

/// A shader that a plan runs, as the ledger sees it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stage {
    /// The pass it belongs to.
    pub pass: &'static str,
    /// Its file and variant, as "shade.frag mixture".
    pub shader: &'static str,
    /// Its SPIR-V.
    pub words: Vec<u32>,
    /// Values of its specialisation constants 0, 1, ...
    pub constants: Vec<u32>,
    /// Trips of the loops that only the device knows, outermost first.
    pub given: Vec<u64>,
    /// Texels that an invocation writes, in passes over the light map; none where an invocation is a pixel.
    pub texels: Option<u32>,
}

/// What a counting build has counted of one stage.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Counts {
    /// The stage's shader, as [`Stage::shader`].
    pub shader: &'static str,
    /// Pixels in a row; 1 in passes over the light map.
    pub columns: u32,
    /// Of every pixel, row-major, reads by term: single, multiple, other, input attachments; 0 where nothing ran. Of
    /// passes over the light map one entry, the most that an invocation read.
    pub reads: Vec<[u32; 4]>,
}

/// How often the device read, in fact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// In the pixel that read most; per texel, in passes over the light map.
    pub most: f64,
    /// In the mean over the pixels in which the pass ran; none in passes over the light map.
    pub mean: Option<f64>,
}

/// What is read of one texture for one term by one shader.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The pass.
    pub pass: String,
    /// The file of the shader.
    pub shader: String,
    /// The term: "single", "multiple", "other", "input", "texel" or "buffer".
    pub term: String,
    /// The texture's name in the shader.
    pub texture: String,
    /// What it holds and how it is read, where it was declared.
    pub what: String,
    /// Declared, per pixel or texel.
    pub declared: f64,
    /// Found in the SPIR-V, per pixel or texel; none of buffers, whose reads are no image instructions.
    pub found: Option<f64>,
    /// Where.
    pub sites: Vec<Site>,
}

/// What one shader reads for one term.
#[derive(Clone, Debug, PartialEq)]
pub struct Subtotal {
    /// The pass.
    pub pass: String,
    /// The file of the shader.
    pub shader: String,
    /// The term.
    pub term: String,
    /// Declared, per pixel or texel.
    pub declared: f64,
    /// Found in the SPIR-V.
    pub found: Option<f64>,
    /// Measured, where a counting build ran.
    pub measured: Option<Measured>,
}

/// The three accounts of one plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Ledger {
    /// By texture.
    pub rows: Vec<Row>,
    /// By term.
    pub subtotals: Vec<Subtotal>,
    /// Of every pixel, the fetches that were measured, row-major; empty where none were. Of several frames, those of the
    /// last that drew the pixel. Those of a pixel of half size are shared by all that it lies over, covered or not.
    pub pixels: Vec<u32>,
    /// Whether a counting build ran.
    pub counted: bool,
}

impl Ledger {
    /// Joins what was `declared` with what stands in `stages` and, unless it is empty, with what was `counted`.
    ///
    /// # Errors
    /// As [`spirv::sites`], with the shader's name.
    pub fn new(
        declared: &[Declared],
        stages: &[Stage],
        counted: &[Counts],
    ) -> Result<Ledger, String> {
        let mut rows = Vec::<Row>::new();
        for line in declared {
            rows.push(Row {
                pass: line.pass.to_owned(),
                shader: line.shader.to_owned(),
                term: line.term.to_owned(),
                texture: line.texture.to_owned(),
                what: line.what.to_owned(),
                declared: f64::from(line.per_pixel),
                found: (line.term != BUFFER).then_some(0.0),
                sites: Vec::new(),
            });
        }
        for stage in stages {
            let sites = spirv::sites(&stage.words, &stage.constants, &stage.given)
                .map_err(|phrase| format!("{}: {phrase}", stage.shader))?;
            for site in sites.into_iter().filter(|site| site.trips > 0) {
                let term = term_of(stage, &site);
                let each = site.trips as f64 / f64::from(stage.texels.unwrap_or(1));
                let known = rows.iter().position(|row| {
                    row.pass == stage.pass
                        && row.shader == file(stage.shader)
                        && row.term == term
                        && row.texture == site.texture
                });
                let at = known.unwrap_or_else(|| {
                    rows.push(Row {
                        pass: stage.pass.to_owned(),
                        shader: file(stage.shader).to_owned(),
                        term: term.to_owned(),
                        texture: site.texture.clone(),
                        what: "declared nowhere".to_owned(),
                        declared: 0.0,
                        found: Some(0.0),
                        sites: Vec::new(),
                    });
                    rows.len() - 1
                });
                *rows[at].found.get_or_insert(0.0) += each;
                rows[at].sites.push(site);
            }
        }
        let mut subtotals = Vec::<Subtotal>::new();
        for row in &rows {
            let same = |s: &&mut Subtotal| {
                s.pass == row.pass && s.shader == row.shader && s.term == row.term
            };
            match subtotals.iter_mut().find(same) {
                Some(sum) => {
                    sum.declared += row.declared;
                    sum.found = sum.found.zip(row.found).map(|(a, b)| a + b);
                }
                None => subtotals.push(Subtotal {
                    pass: row.pass.clone(),
                    shader: row.shader.clone(),
                    term: row.term.clone(),
                    declared: row.declared,
                    found: row.found,
                    measured: None,
                }),
            }
        }
        for sum in &mut subtotals {
            sum.measured = measured(sum, stages, counted);
        }
        // What was read where nothing was declared or found must show, too.
        for counts in counted {
            let Some(stage) = stages.iter().find(|s| s.shader == counts.shader) else {
                continue;
            };
            for (slot, term) in [(0, "single"), (1, "multiple"), (2, "other"), (3, INPUT)] {
                let term = if stage.texels.is_some() { TEXEL } else { term };
                let of = |s: &Subtotal| {
                    s.pass == stage.pass && s.shader == file(stage.shader) && s.term == term
                };
                if counts.reads.iter().any(|r| r[slot] > 0) && !subtotals.iter().any(of) {
                    let mut sum = Subtotal {
                        pass: stage.pass.to_owned(),
                        shader: file(stage.shader).to_owned(),
                        term: term.to_owned(),
                        declared: 0.0,
                        found: Some(0.0),
                        measured: None,
                    };
                    sum.measured = measured(&sum, stages, counted);
                    subtotals.push(sum);
                }
            }
        }
        Ok(Ledger {
            rows,
            subtotals,
            pixels: pixels(stages, counted),
            counted: !counted.is_empty(),
        })
    }

    /// Declared fetches per pixel over all passes.
    pub fn declared(&self) -> f64 {
        self.sum(|s| Some(s.declared))
    }

    /// Found fetches per pixel over all passes.
    pub fn found(&self) -> f64 {
        self.sum(|s| s.found)
    }

    /// Over all passes, that of half size at its share, as [`super::total`].
    fn sum(&self, reads: impl Fn(&Subtotal) -> Option<f64>) -> f64 {
        let of_pixels = self.subtotals.iter().filter(|s| counts(&s.term));
        let (half, full): (Vec<_>, Vec<_>) = of_pixels.partition(|s| s.pass == HALF_SHADE);
        let half: f64 = half.into_iter().filter_map(&reads).sum();
        full.into_iter().filter_map(&reads).sum::<f64>() + (half / f64::from(HALF_SHARE)).ceil()
    }

    /// The most fetches that any pixel made, where they were measured.
    pub fn most(&self) -> Option<u32> {
        self.pixels.iter().copied().max()
    }

    /// Where the accounts differ, one line each: what is found is not what is declared, or some pixel reads more than
    /// that, or what was to be measured was not.
    ///
    /// That no pixel reads as much is no fault of the ledger, but of the picture, in which nothing may face the light
    /// or nothing be covered: see [`Ledger::unread`].
    pub fn disagreements(&self) -> Vec<String> {
        let mut lines = Vec::new();
        for row in &self.rows {
            if let Some(found) = row.found.filter(|&found| found != row.declared) {
                let at = row
                    .sites
                    .iter()
                    .map(|s| format!("{}:{}", s.place.file, s.place.line));
                let at: Vec<_> = at.collect();
                lines.push(format!(
                    "{}{}, {}: {} reads of {} declared, {found} found in the SPIR-V{}{}",
                    of_half(&row.pass),
                    row.shader,
                    row.term,
                    row.declared,
                    row.texture,
                    if at.is_empty() { "" } else { " at " },
                    at.join(", ")
                ));
            }
        }
        for sum in &self.subtotals {
            match sum.measured {
                Some(measured) if measured.most > sum.declared => lines.push(format!(
                    "{}{}, {}: {} declared, {} measured",
                    of_half(&sum.pass),
                    sum.shader,
                    sum.term,
                    sum.declared,
                    measured.most
                )),
                None if self.counted && sum.term != BUFFER => lines.push(format!(
                    "{}{}, {}: {} declared, none measured",
                    of_half(&sum.pass),
                    sum.shader,
                    sum.term,
                    sum.declared
                )),
                _ => {}
            }
        }
        lines
    }

    /// What is declared and was measured, but of which no pixel made full use, one line each.
    pub fn unread(&self) -> Vec<String> {
        let short = |s: &&Subtotal| s.measured.is_some_and(|m| m.most < s.declared);
        let lines = self.subtotals.iter().filter(short).map(|sum| {
            let most = sum.measured.map_or(0.0, |m| m.most);
            format!(
                "{}, {}: no pixel of this picture reads more than {most} of the {} declared",
                sum.shader, sum.term, sum.declared
            )
        });
        lines.collect()
    }

    /// The pass and term by which the fetches of a pixel, added up in the order of the frame, first exceed `budget`:
    /// the subtotal, and the sum up to and with it. Measured where they were, else declared.
    pub fn breaks(&self, budget: u32) -> Option<(&Subtotal, f64)> {
        let mut sum = 0.0;
        let reads = |s: &Subtotal| {
            let reads = s.measured.map_or(s.declared, |m| m.most.max(s.declared));
            match s.pass.as_str() {
                // Whole numbers but for this share: it exceeds a budget when it does so rounded up.
                HALF_SHADE => reads / f64::from(HALF_SHARE),
                _ => reads,
            }
        };
        self.subtotals
            .iter()
            .filter(|s| counts(&s.term))
            .find_map(|s| {
                sum += reads(s);
                (sum > f64::from(budget)).then_some((s, sum))
            })
    }
}

/// What tells the shader of the pass of half size from the same file in the picture's own.
fn of_half(pass: &str) -> &'static str {
    match pass {
        HALF_SHADE => "half, ",
        _ => "",
    }
}

/// "shade.frag" of "shade.frag mixture single".
fn file(shader: &str) -> &str {
    shader.split(' ').next().unwrap_or(shader)
}

/// The term that a read serves: by the texture in the shade pass, where each serves one.
fn term_of(stage: &Stage, site: &Site) -> &'static str {
    match (stage.texels, site.kind, stage.pass, site.texture.as_str()) {
        (Some(_), ..) => TEXEL,
        (None, Kind::Input, ..) => INPUT,
        (None, _, "shade" | HALF_SHADE, "exits") => "single",
        (None, _, "shade", "light_depth") => "other",
        (None, _, "shade" | HALF_SHADE | "exact", _) => "multiple",
        _ => "other",
    }
}

fn measured(sum: &Subtotal, stages: &[Stage], counted: &[Counts]) -> Option<Measured> {
    let slot = match sum.term.as_str() {
        "single" => Some(0),
        "multiple" => Some(1),
        "other" => Some(2),
        INPUT => Some(3),
        _ => None,
    };
    let mut found = None;
    for counts in counted {
        let Some(stage) = stages.iter().find(|s| s.shader == counts.shader) else {
            continue;
        };
        if stage.pass != sum.pass || file(stage.shader) != sum.shader {
            continue;
        }
        match (stage.texels, slot) {
            (Some(texels), None) if sum.term == TEXEL => {
                // Two images smoothed by two stages are one line.
                let most: u32 = counts.reads.iter().flatten().sum();
                let known = found.map_or(0.0, |m: Measured| m.most);
                found = Some(Measured {
                    most: known + f64::from(most) / f64::from(texels),
                    mean: None,
                });
            }
            (None, Some(slot)) => {
                let ran = counts.reads.iter().filter(|r| r.iter().any(|&n| n > 0));
                let (mut most, mut total, mut pixels) = (0, 0.0, 0.0);
                for reads in ran {
                    most = most.max(reads[slot]);
                    total += f64::from(reads[slot]);
                    pixels += 1.0;
                }
                found = Some(Measured {
                    most: f64::from(most),
                    mean: (pixels > 0.0).then(|| total / pixels),
                });
            }
            _ => {}
        }
    }
    found
}

fn pixels(stages: &[Stage], counted: &[Counts]) -> Vec<u32> {
    let mut sums = Vec::new();
    let mut columns = 0;
    let mut half = None;
    for counts in counted {
        let Some(stage) = stages.iter().find(|s| s.shader == counts.shader) else {
            continue;
        };
        if stage.texels.is_some() {
            continue;
        }
        if stage.pass == HALF_SHADE {
            half = Some(counts);
            continue;
        }
        columns = counts.columns as usize;
        sums.resize(counts.reads.len(), 0);
        for (sum, reads) in sums.iter_mut().zip(&counts.reads) {
            *sum += fetches(reads);
        }
    }
    if let Some(half) = half {
        for (at, sum) in sums.iter_mut().enumerate() {
            let [x, y] = [at % columns / 2, at / columns / 2];
            let reads = half.reads.get(y * half.columns as usize + x);
            *sum += reads.map_or(0, fetches).div_ceil(HALF_SHARE);
        }
    }
    sums
}

/// Of a pixel's reads, those that count.
fn fetches(reads: &[u32; 4]) -> u32 {
    reads[..3].iter().sum()
}
