//! What the picture costs: a bar for each pass, and the last frames of the window.

use super::Facts;
use crate::ledger;
use crate::view::session::Session;
use crate::view::style;
use crate::view::timing::KEPT;
use egui::{Align2, Color32, FontId, Rect, Sense, Ui, pos2, vec2};

/// Height of a bar and its words, points.
const LINE: f32 = 15.5;
/// Columns of words beside the bars, points from their left.
const NAME: f32 = 0.0;
const BAR: f32 = 74.0;
const NUMBERS: f32 = 186.0;

/// Width from which the strip has room for bars and plot, points.
const BOTH: f32 = 640.0;

/// Draws the strip.
pub fn show(ui: &mut Ui, session: &Session, facts: &Facts<'_>) {
    let rect = ui.available_rect_before_wrap();
    ui.allocate_rect(rect, Sense::hover());
    let top = ui.clip_rect().top();
    ui.painter().hline(
        ui.clip_rect().x_range(),
        top,
        egui::Stroke::new(1.0, style::LINE),
    );
    // A narrow window has room for one of the two.
    let both = rect.width() > BOTH;
    let bars = if both { 430.0 } else { rect.width() };
    show_bars(
        ui,
        Rect::from_min_size(rect.min, vec2(bars, rect.height())),
        session,
        facts,
    );
    if both {
        let plot = Rect::from_min_max(pos2(rect.left() + bars + 24.0, rect.top()), rect.max);
        show_plot(ui, plot, facts);
    }
}

fn text(ui: &Ui, at: egui::Pos2, align: Align2, words: &str, font: FontId, color: Color32) {
    ui.painter().text(at, align, words, font, color);
}

/// What a part of the strip is.
fn show_head(ui: &Ui, rect: Rect, words: &str) {
    let at = rect.left_top();
    text(
        ui,
        at,
        Align2::LEFT_TOP,
        words,
        style::heading(),
        style::DIM,
    );
}

/// What it adds up to.
fn show_foot(ui: &Ui, rect: Rect, words: &str) {
    let at = rect.left_bottom();
    text(
        ui,
        at,
        Align2::LEFT_BOTTOM,
        words,
        style::numbers(),
        style::DIM,
    );
}

fn show_bars(ui: &Ui, rect: Rect, session: &Session, facts: &Facts<'_>) {
    let small = style::heading();
    let bar_width = (rect.width() - NUMBERS - BAR).max(20.0);
    let right = rect.left() + BAR + bar_width;
    let heads = [(58.0, "ms"), (104.0, "fetches"), (176.0, "× floor")];
    show_head(ui, rect, "DEVICE TIME");
    for (at, head) in heads {
        text(
            ui,
            pos2(right + at, rect.top()),
            Align2::RIGHT_TOP,
            head,
            small.clone(),
            style::DIM,
        );
    }
    let [picture, _] = ledger::declared_window();
    let compose = facts
        .compose
        .map(|milliseconds| ("compose", milliseconds, picture.per_pixel, None, ""));
    let passes = facts.costs.passes.iter().map(|cost| {
        let about = if cost.roughly { "~" } else { "" };
        (
            cost.pass,
            cost.milliseconds,
            cost.fetches,
            cost.over_floor,
            about,
        )
    });
    let lines: Vec<_> = passes.chain(compose).collect();
    let most = lines.iter().map(|line| line.1).fold(1e-3, f64::max);
    // All passes have their line, be they many.
    let room = (rect.height() - 16.0 - LINE) / lines.len().max(1) as f32;
    let line = room.min(LINE);
    let font = FontId::proportional((0.82 * line).min(12.0));
    let numbers_font = FontId::monospace((0.8 * line).min(11.5));
    for (row, (name, milliseconds, fetches, over_floor, about)) in lines.iter().enumerate() {
        let y = rect.top() + 16.0 + line * row as f32;
        let own = if *name == "compose" {
            style::COOL
        } else {
            style::WARM
        };
        text(
            ui,
            pos2(rect.left() + NAME, y),
            Align2::LEFT_TOP,
            name,
            font.clone(),
            style::TEXT,
        );
        let length = bar_width * (milliseconds / most) as f32;
        let bar = Rect::from_min_size(
            pos2(rect.left() + BAR, y + 0.22 * line),
            vec2(length.max(1.0), 0.5 * line),
        );
        ui.painter().rect_filled(bar, 2.0, own.gamma_multiply(0.85));
        let numbers = [
            (58.0, format!("{milliseconds:.2}")),
            (
                104.0,
                if *fetches > 0 {
                    fetches.to_string()
                } else {
                    "–".to_owned()
                },
            ),
            (
                176.0,
                over_floor.map_or("–".to_owned(), |over| format!("{about}{over:.1}")),
            ),
        ];
        for (at, number) in numbers {
            text(
                ui,
                pos2(right + at, y),
                Align2::RIGHT_TOP,
                &number,
                numbers_font.clone(),
                style::TEXT,
            );
        }
    }
    let sum: f64 = lines.iter().map(|line| line.1).sum();
    let triangles = session.plan().scene.mesh.triangles.len();
    let [width, height] = facts.costs.size;
    let fetches = facts.costs.fetches;
    let words = [
        format!("{sum:.1} ms"),
        format!("{fetches} fetches a pixel"),
        format!("{width} × {height}"),
        format!("{triangles} triangles"),
    ];
    // As many of them as there is room for.
    let fits = |words: &str| {
        let galley = ui
            .painter()
            .layout_no_wrap(words.to_owned(), style::numbers(), style::DIM);
        galley.size().x <= rect.width()
    };
    let words = (1..=words.len())
        .rev()
        .map(|count| words[..count].join("   "));
    let words = words
        .into_iter()
        .find(|words| fits(words))
        .unwrap_or_default();
    show_foot(ui, rect, &words);
}

/// The last frames of the window, each a line as long as it took.
fn show_plot(ui: &Ui, rect: Rect, facts: &Facts<'_>) {
    let small = style::heading();
    let mode = facts.mode.map_or("", |mode| mode.name());
    let head = format!("FRAMES OF THE WINDOW   {mode}");
    show_head(ui, rect, &head);
    let plot = Rect::from_min_max(
        pos2(rect.left(), rect.top() + 18.0),
        pos2(rect.right() - 30.0, rect.bottom() - 16.0),
    );
    if plot.width() < 40.0 || plot.height() < 20.0 {
        return;
    }
    let frames: Vec<_> = facts.timing.frames().collect();
    let longest = frames
        .iter()
        .map(|frame| frame.milliseconds)
        .fold(0.0, f64::max);
    // The scale is a round number, lest it breathe with every frame.
    let scale = [20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0, 5000.0];
    let scale = scale
        .into_iter()
        .find(|top| longest <= *top)
        .unwrap_or(longest.max(1.0));
    for share in [0.5, 1.0] {
        let y = plot.bottom() - plot.height() * share as f32;
        ui.painter()
            .hline(plot.x_range(), y, egui::Stroke::new(1.0, style::LINE));
        let words = format!("{:.0}", scale * share);
        text(
            ui,
            pos2(rect.right(), y),
            Align2::RIGHT_CENTER,
            &words,
            small.clone(),
            style::DIM,
        );
    }
    ui.painter().hline(
        plot.x_range(),
        plot.bottom(),
        egui::Stroke::new(1.0, style::LINE),
    );
    let step = plot.width() / KEPT as f32;
    for (place, frame) in frames.iter().rev().enumerate() {
        let x = plot.right() - step * (place as f32 + 1.0);
        let height = plot.height() * (frame.milliseconds / scale).min(1.0) as f32;
        let color = if frame.picture {
            style::WARM
        } else {
            style::COOL
        };
        let bar = Rect::from_min_max(
            pos2(x, plot.bottom() - height.max(1.0)),
            pos2(x + (step - 0.4).max(0.6), plot.bottom()),
        );
        ui.painter()
            .rect_filled(bar, 0.0, color.gamma_multiply(0.8));
    }
    let median = facts
        .timing
        .median(30)
        .map_or(String::new(), |ms| format!("median {ms:.1} ms   "));
    let words = format!("{median}longest {:.0} ms", facts.timing.longest);
    show_foot(ui, rect, &words);
}
