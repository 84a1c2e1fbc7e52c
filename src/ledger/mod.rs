//! The fetch ledger: what the plan declares that each pass reads, per pixel.
//!
//! A fetch is one executed image instruction that reads a texture. Reads of input
//! attachments are listed with term "input" and do not count as fetches.

use crate::scene::{Multiple, Plan};

/// One line of the ledger.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Declared {
    /// The pass that reads.
    pub pass: &'static str,
    /// The term it serves: "multiple", "other", or "input" for attachment reads.
    pub term: &'static str,
    /// What is read, and how.
    pub what: &'static str,
    /// How often per covered pixel, at most.
    pub per_pixel: u32,
}

/// What `plan` declares. With a split picture, the more expensive half.
pub fn declared(plan: &Plan) -> Vec<Declared> {
    let own = of_method(plan, plan.multiple);
    match plan.split {
        Some(left) => {
            let other = of_method(plan, left);
            if total(&other) > total(&own) {
                other
            } else {
                own
            }
        }
        None => own,
    }
}

/// Fetches per pixel over all passes, inputs left out.
pub fn total(lines: &[Declared]) -> u32 {
    lines
        .iter()
        .filter(|l| l.term != "input")
        .map(|l| l.per_pixel)
        .sum()
}

fn of_method(plan: &Plan, method: Multiple) -> Vec<Declared> {
    let line = |pass, term, what, per_pixel| Declared {
        pass,
        term,
        what,
        per_pixel,
    };
    let mut lines = vec![
        line("shade", "input", "view depth", 1),
        line("shade", "input", "view normal", 1),
    ];
    if plan.specular || method == Multiple::Brdf {
        lines.push(line("shade", "other", "light depth, gather and compare", 1));
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
        "radiance and mean, storage image",
        1 + history,
    ));
    lines
}
