//! The fetch ledger: what the plan declares that each pass reads, per pixel.
//!
//! A fetch is one executed image instruction that reads a texture. Reads of input
//! attachments are listed with term [`INPUT`], and what a reduction reads per texel that it
//! writes with term [`TEXEL`]; neither counts as fetches of a pixel.

use crate::scene::{Exits, Multiple, Plan};

/// The term of attachment reads.
pub const INPUT: &str = "input";
/// The term of reads per texel written, in passes over the light map.
pub const TEXEL: &str = "texel";

/// Reads per texel that halving writes: an invocation makes 2x2 texels of 6x6.
const HALVE_LOADS: u32 = 9;
/// Reads per texel that smoothing writes: an invocation makes 4x4 texels of 12x12.
const SMOOTH_LOADS: u32 = 9;

/// Reads per cell that halving a grid writes: an invocation makes 2x2x2 cells of 6x6x6.
const HALVE_CELL_LOADS: u32 = 27;
/// Cells along its axis that an invocation of a blur makes.
const BLUR_OUTPUTS: u32 = 8;

/// How a device reads between texels of 32-bit floats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// One bilinear tap is one fetch.
    Linear,
    /// The device cannot filter them: a bilinear tap is four fetches, a trilinear one eight.
    Texels,
}

impl Filter {
    /// Fetches of one trilinear tap.
    pub fn volume_fetches(self) -> u32 {
        match self {
            Filter::Linear => 1,
            Filter::Texels => 8,
        }
    }

    /// Fetches of one bilinear tap.
    pub fn fetches(self) -> u32 {
        match self {
            Filter::Linear => 1,
            Filter::Texels => 4,
        }
    }
}

/// One line of the ledger.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Declared {
    /// The pass that reads.
    pub pass: &'static str,
    /// The term it serves: "multiple", "single", "other", [`INPUT`] or [`TEXEL`].
    pub term: &'static str,
    /// What is read, and how.
    pub what: &'static str,
    /// How often per covered pixel, at most; per texel written for [`TEXEL`].
    pub per_pixel: u32,
}

/// What `plan` declares on a device that filters as `filter`. With a split picture, the more
/// expensive half.
pub fn declared(plan: &Plan, filter: Filter) -> Vec<Declared> {
    let own = of_method(plan, plan.multiple, filter);
    match plan.split {
        Some(left) => {
            let other = of_method(plan, left, filter);
            if total(&other) > total(&own) {
                other
            } else {
                own
            }
        }
        None => own,
    }
}

/// Fetches per pixel over all passes, inputs and reductions left out.
pub fn total(lines: &[Declared]) -> u32 {
    lines
        .iter()
        .filter(|l| ![INPUT, TEXEL].contains(&l.term))
        .map(|l| l.per_pixel)
        .sum()
}

fn of_method(plan: &Plan, method: Multiple, filter: Filter) -> Vec<Declared> {
    let line = |pass, term, what, per_pixel| Declared {
        pass,
        term,
        what,
        per_pixel,
    };
    let mut lines = vec![
        line("shade", INPUT, "view depth", 1),
        line("shade", INPUT, "view normal", 1),
    ];
    if plan.specular || method == Multiple::Brdf {
        lines.push(line("shade", "other", "light depth, gather and compare", 1));
    }
    if let Some(march) = plan.march(method) {
        lines.push(line("shade", INPUT, "back faces' depth", 1));
        lines.push(line("shade", INPUT, "back faces' normal", 1));
        let what = match march.exits {
            Exits::Depth => "light depth, nearest",
            Exits::Linear if filter == Filter::Linear => "light moments, bilinear",
            // A device that cannot filter reads the nearest.
            Exits::Linear | Exits::Nearest => "light moments, nearest",
        };
        lines.push(line("shade", "single", what, march.steps));
    }
    match method {
        Multiple::None | Multiple::Brdf => {}
        Multiple::Samples(n) => {
            lines.push(line(
                "shade",
                "multiple",
                "light moments above the receiver, nearest",
                1,
            ));
            lines.push(line("shade", "multiple", "blue noise, texel", 1));
            lines.push(line("shade", "multiple", "light moments, nearest", n));
        }
        Multiple::Rings(rings) => {
            let rings = plan.rings(rings);
            lines.push(line("boxes", TEXEL, "level above, 2x2 texels", 4));
            let taps = [
                ("light moments, bilinear", 1),
                ("boxes, bilinear", rings - 1),
            ];
            for (what, taps) in taps {
                lines.push(line("shade", "multiple", what, taps * filter.fetches()));
            }
        }
        Multiple::Mixture(mixture) => {
            let taps = plan.taps(mixture, &plan.light_frame());
            let [levels, fourth, volumes] = taps.counts();
            for (what, count) in [
                ("level above, 6x6 texels for 2x2", HALVE_LOADS),
                ("a level, 12x12 texels for 4x4", SMOOTH_LOADS),
            ] {
                let textures = 1 + u32::from(fourth > 0);
                lines.push(line("reduce", TEXEL, what, textures * count));
            }
            lines.push(line(
                "shade",
                "multiple",
                "smoothed moments, bilinear",
                levels * filter.fetches(),
            ));
            if fourth > 0 {
                lines.push(line(
                    "shade",
                    "multiple",
                    "smoothed fourth moment, bilinear",
                    fourth * filter.fetches(),
                ));
            }
            if let Some(desc) = &taps.volumes {
                let reach = desc.grids[0].reach();
                let radius = desc.volumes.iter().map(|v| v.weights.len() as u32 - 1);
                let blur = (BLUR_OUTPUTS + 2 * radius.max().unwrap_or(0)).div_ceil(BLUR_OUTPUTS);
                for (what, count) in [
                    ("light moments around a column of cells", reach * reach),
                    (
                        "cells of the grid before, 6x6x6 for 2x2x2",
                        HALVE_CELL_LOADS,
                    ),
                    ("cells along an axis, three times, at most", 3 * blur),
                ] {
                    lines.push(line("volume", TEXEL, what, count));
                }
                lines.push(line(
                    "shade",
                    "multiple",
                    "volumes, trilinear",
                    volumes * filter.volume_fetches(),
                ));
            }
        }
        Multiple::Exact => {
            // Each band of rows reads the pixel's own values again; one band is declared.
            lines.push(line("exact", "multiple", "view depth and normal, texel", 2));
            lines.push(line(
                "exact",
                "multiple",
                "light moments, texel",
                plan.light_map.pow(2),
            ));
            lines.push(line("exact", "multiple", "radiance, storage image", 1));
        }
    }
    let history = u32::from(plan.frames_averaged > 1);
    lines.push(line(
        "resolve",
        "other",
        "radiance and mean, nearest",
        1 + history,
    ));
    lines
}
