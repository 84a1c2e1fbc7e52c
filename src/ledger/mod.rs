//! The fetch ledger: what each pass reads of textures, per pixel, three times over.
//!
//! A fetch is one executed image instruction that reads a texture. It is *declared* by the plan ([`declared`]),
//! *found* in the SPIR-V ([`spirv`]) and *measured* by a counting build of the same shaders; [`Ledger`] holds the three
//! together. Reads of input attachments are listed with term [`INPUT`], and what a reduction reads per texel that it
//! writes with term [`TEXEL`], or [`BUFFER`] where it reads no texture; none of these counts as a fetch of a pixel.
//!
//! Where scattering is shaded at half size, the lines of pass [`HALF_SHADE`] are of one of *its* pixels, and hold as the
//! others do: declared, found and measured are equal there. It is shaded for [`HALF_SHARE`] pixels of the picture, so each
//! of them bears that share of the pass's fetches, rounded up, in [`total`], in the sums of [`Ledger`] and in its map.

mod access;
pub mod budget;
pub mod spirv;
mod table;

pub use access::Access;
pub use table::{Counts, Ledger, Measured, Row, Stage, Subtotal};

use crate::scene::{Exits, Multiple, Plan, Scattering};

/// The term of attachment reads.
pub const INPUT: &str = "input";
/// The term of reads per texel written, in passes over the light map.
pub const TEXEL: &str = "texel";
/// The term of what a pass over volumes reads of buffers, per cell written.
pub const BUFFER: &str = "buffer";

/// The pass that shades scattering at half the width and height.
pub const HALF_SHADE: &str = "half shade";
/// Pixels of the picture that one of its pixels is shaded for.
pub const HALF_SHARE: u32 = 4;

/// Bilinear taps of history that live display takes.
const HISTORY_TAPS: u32 = 5;

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
    /// The shader that reads.
    pub shader: &'static str,
    /// The term it serves: "multiple", "single", "other", [`INPUT`], [`TEXEL`] or [`BUFFER`].
    pub term: &'static str,
    /// What is read, by its name in the shader.
    pub texture: &'static str,
    /// What is read, and how.
    pub what: &'static str,
    /// How often per covered pixel of the pass, at most; per texel or cell written for [`TEXEL`] and [`BUFFER`].
    pub per_pixel: u32,
}

/// Whether `term` counts as fetches of a pixel.
pub fn counts(term: &str) -> bool {
    ![INPUT, TEXEL, BUFFER].contains(&term)
}

/// What `plan` declares on a device that filters as `filter`. With a split picture, the more
/// expensive part.
pub fn declared(plan: &Plan, filter: Filter) -> Vec<Declared> {
    let parts = plan.methods().map(|method| of_method(plan, method, filter));
    // Of two that cost the same, the right one, which comes last.
    parts.max_by_key(|lines| total(lines)).unwrap_or_default()
}

/// What a frame of `plan` for live display declares: the same, but for how it resolves.
pub fn declared_live(plan: &Plan, filter: Filter) -> Vec<Declared> {
    let mut lines = declared(plan, filter);
    lines.retain(|line| line.pass != "resolve");
    for (texture, what, per_pixel) in [
        ("radiance", "radiance of 3x3 pixels, nearest", 9),
        (
            "view_depth",
            "its own depth, and beside a silhouette its neighbours'",
            9,
        ),
        ("motion", "motion, nearest", 1),
        (
            "mean",
            "history, five bilinear taps",
            HISTORY_TAPS * filter.fetches(),
        ),
    ] {
        lines.push(Declared {
            pass: "resolve",
            shader: "resolve.frag",
            term: "other",
            texture,
            what,
            per_pixel,
        });
    }
    lines
}

/// What a frame of a window declares besides: of the picture for each pixel of its place, and of the panel for each pixel of
/// each triangle.
pub fn declared_window() -> [Declared; 2] {
    [
        ("compose.frag", "picture", "the display image, bilinear"),
        (
            "panel.frag",
            "image",
            "letters and other images of the panel, bilinear",
        ),
    ]
    .map(|(shader, texture, what)| Declared {
        pass: "compose",
        shader,
        term: "other",
        texture,
        what,
        per_pixel: 1,
    })
}

/// Fetches per pixel of the picture over all passes, inputs and reductions left out.
pub fn total(lines: &[Declared]) -> u32 {
    let sum = |half| -> u32 {
        let counted = lines.iter().filter(|l| counts(l.term));
        counted
            .filter(|l| (l.pass == HALF_SHADE) == half)
            .map(|l| l.per_pixel)
            .sum()
    };
    sum(false) + sum(true).div_ceil(HALF_SHARE)
}

fn of_method(plan: &Plan, method: Multiple, filter: Filter) -> Vec<Declared> {
    let line = |(pass, shader), term, texture, what, per_pixel| Declared {
        pass,
        shader,
        term,
        texture,
        what,
        per_pixel,
    };
    const SHADE: (&str, &str) = ("shade", "shade.frag");
    let half = plan.scattering == Scattering::Half;
    // Where both terms of scattering are shaded.
    let inside = match half {
        true => (HALF_SHADE, SHADE.1),
        false => SHADE,
    };
    let surface = |pass| {
        [
            line(pass, INPUT, "view_depth", "its own depth", 1),
            line(pass, INPUT, "view_normal", "its own normal", 1),
        ]
    };
    let mut lines = Vec::from(surface(inside));
    let lit = || {
        line(
            SHADE,
            "other",
            "light_depth",
            "light depth, gather and compare",
            1,
        )
    };
    let needs_lit = plan.specular || method == Multiple::Brdf;
    if needs_lit && !half {
        lines.push(lit());
    }
    if let Some(march) = plan.march(method) {
        let what = ["back face's depth", "back face's normal"];
        lines.push(line(inside, INPUT, "back_depth", what[0], 1));
        lines.push(line(inside, INPUT, "back_normal", what[1], 1));
        let what = match march.exits {
            Exits::Depth => "light depth, nearest",
            Exits::Linear if filter == Filter::Linear => "light moments, bilinear",
            // A device that cannot filter reads the nearest.
            Exits::Linear | Exits::Nearest => "light moments, nearest",
        };
        lines.push(line(inside, "single", "exits", what, march.steps));
    }
    let mut multiple =
        |texture, what, count| lines.push(line(inside, "multiple", texture, what, count));
    match method {
        Multiple::None | Multiple::Brdf => {}
        Multiple::Samples(n) => {
            multiple("blue_noise", "blue noise, texel", 1);
            // One more above the receiver, whose depth tells the gap to the light.
            multiple("moments", "light moments, nearest", 1 + n);
        }
        Multiple::Rings(rings) => {
            let rings = plan.rings(rings);
            multiple("moments", "light moments, bilinear", filter.fetches());
            let taps = (rings - 1) * filter.fetches();
            if taps > 0 {
                multiple("boxes", "boxes, bilinear", taps);
            }
            let pass = ("boxes", "boxes.comp");
            lines.push(line(pass, TEXEL, "source", "level above, 2x2 texels", 4));
        }
        Multiple::Mixture(mixture) => {
            let taps = plan.taps(mixture, &plan.light_frame());
            let [levels, fourth, volumes] = taps.counts();
            let what = "smoothed moments, bilinear";
            multiple("smoothed", what, levels * filter.fetches());
            if fourth > 0 {
                let what = "smoothed fourth moment, bilinear";
                multiple("smoothed_fourth", what, fourth * filter.fetches());
            }
            if volumes > 0 {
                let what = "volumes, trilinear";
                multiple("volumes", what, volumes * filter.volume_fetches());
            }
            let (halving, smoothing) = (("reduce", "decimate.comp"), ("reduce", "smooth.comp"));
            let what = "level above, 6x6 texels for 2x2";
            // Of level 0 alone nothing is halved.
            let halves = taps.level(taps.moments() - 1) > 0;
            if halves {
                lines.push(line(halving, TEXEL, "moments", what, HALVE_LOADS));
            }
            if halves && fourth > 0 {
                lines.push(line(halving, TEXEL, "fourth", what, HALVE_LOADS));
            }
            let what = "a level, 12x12 texels for 4x4";
            lines.push(line(smoothing, TEXEL, "source", what, SMOOTH_LOADS));
            if fourth > 0 {
                lines.push(line(smoothing, TEXEL, "source_fourth", what, SMOOTH_LOADS));
            }
            if let Some(desc) = &taps.volumes {
                let reach = desc.grids[0].reach();
                let radius = desc.volumes.iter().map(|v| v.weights.len() as u32 - 1);
                let blur = (BLUR_OUTPUTS + 2 * radius.max().unwrap_or(0)).div_ceil(BLUR_OUTPUTS);
                let what = "light moments around a column of cells";
                let pass = ("volume", "volume.comp");
                lines.push(line(pass, TEXEL, "moments", what, reach * reach));
                let what = "cells of the grid before, 6x6x6 for 2x2x2";
                let pass = ("volume", "volume_halve.comp");
                lines.push(line(pass, BUFFER, "light", what, HALVE_CELL_LOADS));
                let what = "cells along an axis, three times, at most";
                let pass = ("volume", "volume_blur.comp");
                lines.push(line(pass, BUFFER, "source", what, 3 * blur));
            }
        }
        Multiple::Exact => {
            let pass = ("exact", "exact.comp");
            // Each band of rows reads the pixel's own values again.
            let bands = exact_bands(plan.light_map);
            for (texture, what, count) in [
                ("view_depth", "its own depth, texel", bands),
                ("view_normal", "its own normal, texel", bands),
                ("moments", "light moments, texel", plan.light_map.pow(2)),
                ("radiance", "sum so far, storage image", bands),
            ] {
                lines.push(line(pass, "multiple", texture, what, count));
            }
        }
    }
    if half {
        lines.extend(surface(SHADE));
        let what = "scattering at half size, nearest";
        lines.push(line(SHADE, "multiple", "half_radiance", what, 4));
        lines.extend(needs_lit.then(lit));
    }
    let resolve = ("resolve", "resolve.frag");
    let what = "radiance, nearest";
    lines.push(line(resolve, "other", "radiance", what, 1));
    if plan.frames_averaged > 1 {
        let what = "mean so far, nearest";
        lines.push(line(resolve, "other", "mean", what, 1));
    }
    lines
}

/// Texels of the light map that one dispatch of `exact` sums at most, for each pixel: llvmpipe ends every loop of a
/// shader after 65535 iterations in all, without a word.
pub const EXACT_TEXELS: u32 = 60_000;

/// In how many bands of its rows `exact` sums a light map of `side` texels a side, at least. The renderer cuts more
/// where the device is slow, and each reads three values of the pixel again.
pub fn exact_bands(side: u32) -> u32 {
    side.div_ceil((EXACT_TEXELS / side).max(1))
}
