//! Plots of a run as SVG, for the page that [`html`](super::html) writes.
//!
//! Legends and captions are not in the drawing: text that flows cannot overlap it. Colours
//! of ink and lines are marked so that the page can turn them over for a dark scheme.

use super::{
    COVERED_PIXELS, Case, FETCHES, FRAME, Fit, LIGHT_MAP_TEXELS, Run, Spread, TRIANGLES, digits,
    distinct, fits_in_words,
};
use plotters::coord::Shift;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Okabe and Ito 2008, told apart by any eye; blue first, black (here the ink) last.
pub const PALETTE: [RGBColor; 8] = [
    RGBColor(0x00, 0x72, 0xb2),
    RGBColor(0xd5, 0x5e, 0x00),
    RGBColor(0x00, 0x9e, 0x73),
    RGBColor(0xcc, 0x79, 0xa7),
    RGBColor(0x56, 0xb4, 0xe9),
    RGBColor(0xe6, 0x9f, 0x00),
    RGBColor(0xf0, 0xe4, 0x42),
    INK,
];

/// Text and marks without a meaning of their own.
pub const INK: RGBColor = RGBColor(0x1b, 0x1f, 0x24);
/// Text that steps back.
pub const MUTED: RGBColor = RGBColor(0x5b, 0x64, 0x70);
/// Lines behind the data.
pub const GRID: RGBColor = RGBColor(0xe1, 0xe4, 0xe8);

/// The backend's pixels are whole; so many make one of the page.
const SCALE: i32 = 4;

/// Width of a plot that fills the page, pixels.
const WIDE: i32 = 1040;
/// Width of a plot with another beside it, pixels.
const HALF: i32 = 510;

/// A drawing, and what belongs beside it.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// The drawing.
    pub svg: String,
    /// What its marks mean.
    pub keys: Vec<Key>,
    /// What it shows, one sentence each.
    pub captions: Vec<String>,
}

/// A colour as HTML writes it.
pub fn hex(RGBColor(red, green, blue): RGBColor) -> String {
    format!("#{red:02X}{green:02X}{blue:02X}")
}

/// An entry of a legend.
#[derive(Clone, Debug, PartialEq)]
pub struct Key {
    /// Its colour.
    pub color: RGBColor,
    /// Its mark: corners around 0, at most 1 away.
    pub outline: Vec<(f64, f64)>,
    /// What it means.
    pub text: String,
}

type Surface<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Chart<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<Axis, Axis>>;
type Fault = DrawingAreaErrorKind<std::io::Error>;
type Drawn = Result<(), Fault>;

/// Error against fetches of those `cases` that have both; none without two of them.
pub fn errors(cases: &[&Case]) -> Option<Plot> {
    let cases: Vec<&Case> = cases
        .iter()
        .copied()
        .filter(|case| case.fetches > 0 && case.error.is_some_and(|e| e > 0.0 && e.is_finite()))
        .collect();
    let points: Vec<(f64, f64)> = cases
        .iter()
        .map(|case| (f64::from(case.fetches), case.error.unwrap_or_default()))
        .collect();
    if distinct(points.iter().map(|(x, _)| *x)).len() < 2 {
        return None;
    }
    let families = distinct(cases.iter().map(|case| case.family()));
    let scenes = distinct(cases.iter().map(|case| case.scene.as_str()));
    let place = |names: &[&str], name: &str| names.iter().position(|n| *n == name).unwrap_or(0);
    let marks: Vec<Mark> = cases
        .iter()
        .zip(&points)
        .map(|(case, &(x, y))| {
            let family = place(&families, case.family());
            let scene = place(&scenes, &case.scene);
            Mark {
                x,
                y,
                color: color(family),
                // With one scene the shape repeats the colour, for those who see none.
                shape: if scenes.len() > 1 { scene } else { family },
                text: case.label(),
            }
        })
        .collect();
    let x = Axis::log("fetches a pixel, declared", points.iter().map(|p| p.0));
    let y = Axis::log("error rr", points.iter().map(|p| p.1));
    let mut keys = Vec::new();
    for (index, family) in families.iter().enumerate() {
        let shape = if scenes.len() > 1 { SQUARE } else { index };
        keys.push(Key::new(color(index), shape, family));
    }
    if scenes.len() > 1 {
        for (index, scene) in scenes.iter().enumerate() {
            keys.push(Key::new(MUTED, index, scene));
        }
    }
    let svg = draw(WIDE, 420, |root| {
        let mut chart = axes(root, &x, &y)?;
        let mut places = Vec::new();
        for scene in &scenes {
            for family in &families {
                let line =
                    |case: &Case| case.family() == *family && case.scene == *scene && counted(case);
                let path = cases.iter().zip(&points).filter(|(case, _)| line(case));
                join(
                    &mut chart,
                    path.map(|(_, p)| *p),
                    color(place(&families, family)),
                )?;
            }
        }
        for mark in &marks {
            places.push(marker(root, &chart, mark)?);
        }
        label(root, &marks, &places)
    })?;
    Some(Plot {
        svg,
        keys,
        captions: vec![
            "Both axes are logarithmic; lower and further left is better. Points that would \
             overlap another's name have none; the tables name all."
                .to_owned(),
        ],
    })
}

/// Whether the method has but a number as its parameter. A line through others would tell
/// of an order that there is not.
fn counted(case: &Case) -> bool {
    let rest = case.label();
    let rest = rest.strip_prefix(case.family()).unwrap_or_default();
    let number = rest
        .strip_prefix('(')
        .and_then(|rest| rest.strip_suffix(')'));
    number.is_some_and(|number| number.chars().all(|digit| digit.is_ascii_digit()))
}

/// The passes' median times of each case as stacked bars; none without cases that have
/// passes. `passes` are those of the whole run, so that colours mean the same everywhere.
pub fn stacks(cases: &[&Case], passes: &[&str]) -> Option<Plot> {
    let sum = |case: &Case| case.passes.iter().map(|pass| pass.time.median).sum::<f64>();
    let high = cases.iter().map(|case| sum(case)).fold(0.0, f64::max);
    if high <= 0.0 || !high.is_finite() {
        return None;
    }
    let names = short_names(cases);
    let longest = names.iter().map(|name| name.chars().count()).max()?;
    let left = (longest as f64 * LETTER) as i32 + 14;
    let x = Axis::linear("device time of a frame, ms", high * 1.09);
    let rows = cases.len() as i32;
    let y = Axis::rows(rows);
    const ROW: i32 = 22;
    let svg = draw(WIDE, rows * ROW + 58, |root| {
        let mut chart = ChartBuilder::on(root)
            .margin_top(8 * SCALE)
            .margin_right(16 * SCALE)
            .x_label_area_size(46 * SCALE)
            .y_label_area_size(left * SCALE)
            .build_cartesian_2d(x.clone(), y)?;
        mesh(&mut chart, &x, None)?;
        for (index, case) in cases.iter().enumerate() {
            let top = f64::from(rows) - index as f64;
            let corner = |at: f64, y: f64| chart.backend_coord(&(at, y));
            let mut at = 0.0;
            for pass in &case.passes {
                let place = passes.iter().position(|p| *p == pass.pass).unwrap_or(0);
                let end = at + pass.time.median;
                let (from, to) = (corner(at, top - 0.14), corner(end, top - 0.86));
                // A hair of paper between passes, where there is room for it.
                let gap = i32::from(to.0 - from.0 > 3 * SCALE) * SCALE / 2;
                let bar = [from, (to.0 - gap, to.1)];
                root.draw(&Rectangle::new(bar, color(place).filled()))?;
                at = end;
            }
            let (x, y) = corner(0.0, top - 0.5);
            let name = names.get(index).cloned().unwrap_or_default();
            write(root, &name, (x - 8 * SCALE, y), INK, HPos::Right)?;
            let (x, _) = corner(at, top - 0.5);
            write(
                root,
                &digits(case.device.median),
                (x + 6 * SCALE, y),
                MUTED,
                HPos::Left,
            )?;
        }
        Ok(())
    })?;
    let shown = |pass: &&str| cases.iter().any(|case| case.time(pass).is_some());
    Some(Plot {
        svg,
        keys: passes
            .iter()
            .enumerate()
            .filter(|(_, pass)| shown(pass))
            .map(|(index, pass)| Key::new(color(index), SQUARE, pass))
            .collect(),
        captions: vec![
            "Medians of the passes, stacked in the order of the frame; the figure is the median \
             of the frame, ms."
                .to_owned(),
        ],
    })
}

/// How time grows: the plots that the run's groups and fits call for.
pub fn growth(run: &Run) -> Vec<(String, Plot)> {
    let mut wanted: Vec<(&str, &str)> = [
        ("triangles", TRIANGLES),
        ("pixels", COVERED_PIXELS),
        ("fetches", FETCHES),
        ("light map", LIGHT_MAP_TEXELS),
    ]
    .to_vec();
    wanted.extend(run.fits.iter().map(|fit| (&*fit.group, &*fit.x)));
    distinct(wanted)
        .into_iter()
        .filter_map(|(group, x)| Some((format!("Time against {x}"), grown(run, group, x)?)))
        .collect()
}

/// The times of one method and pass.
struct Series<'a> {
    name: String,
    pass: &'a str,
    points: Vec<(f64, Spread)>,
    fit: Option<&'a Fit>,
}

fn grown(run: &Run, group: &str, x: &str) -> Option<Plot> {
    let cases: Vec<&Case> = run
        .cases
        .iter()
        .filter(|case| case.group == group)
        .collect();
    let series = series(run, &cases, group, x);
    let values = || series.iter().flat_map(|series| &series.points);
    if distinct(values().map(|(x, _)| *x)).len() < 2 {
        return None;
    }
    let (name, log) = match x {
        TRIANGLES | LIGHT_MAP_TEXELS => (x, true),
        FETCHES => ("fetches a pixel, declared", false),
        other => (other, false),
    };
    let across = if log {
        Axis::log(name, values().map(|(x, _)| *x))
    } else {
        Axis::linear(name, values().map(|(x, _)| *x).fold(0.0, f64::max) * 1.04)
    };
    let high = values().map(|(_, time)| time.p95).fold(0.0, f64::max);
    let up = Axis::linear("time, ms", high * 1.05);
    let svg = draw(HALF, 330, |root| {
        let mut chart = axes(root, &across, &up)?;
        for (index, series) in series.iter().enumerate() {
            let points = || series.points.iter().map(|(x, time)| (*x, time.median));
            match series.fit {
                Some(fit) => {
                    let path = across.steps().map(|x| (x, fit.at(x)));
                    let inside = path.filter(|(_, y)| (0.0..=up.high).contains(y));
                    join(&mut chart, inside, color(index))?;
                }
                None => join(&mut chart, points(), color(index))?,
            }
        }
        for (index, series) in series.iter().enumerate() {
            for (x, time) in &series.points {
                let ends = [time.p5, time.p95].map(|y| chart.backend_coord(&(*x, y)));
                let line = color(index).stroke_width(SCALE as u32);
                root.draw(&PathElement::new(ends.to_vec(), line))?;
                let mark = Mark {
                    x: *x,
                    y: time.median,
                    color: color(index),
                    shape: index,
                    text: String::new(),
                };
                marker(root, &chart, &mark)?;
            }
        }
        Ok(())
    })?;
    Some(Plot {
        svg,
        keys: series
            .iter()
            .enumerate()
            .map(|(index, series)| Key::new(color(index), index, &series.name))
            .collect(),
        captions: captions(run, group, x),
    })
}

fn captions(run: &Run, group: &str, x: &str) -> Vec<String> {
    let fits = run.fits.iter();
    let mut captions = fits_in_words(fits.filter(|fit| fit.group == group && fit.x == x));
    captions.push(if captions.is_empty() {
        "Medians, joined; bars from 5 % to 95 % of the frames.".to_owned()
    } else {
        "Medians, with bars from 5 % to 95 % of the frames; lines are fits where there is one."
            .to_owned()
    });
    captions
}

/// What a plot of growth shows: each method's frame, the passes that were fitted, and, where
/// there is but one method, the passes that matter.
fn series<'a>(run: &'a Run, cases: &[&'a Case], group: &str, x: &str) -> Vec<Series<'a>> {
    let fits: Vec<&Fit> = run
        .fits
        .iter()
        .filter(|fit| fit.group == group && fit.x == x && fit.exponent.is_none())
        .collect();
    let method = |case: &Case| {
        // Parameters are what varies along fetches; elsewhere they tell methods apart.
        if x == FETCHES {
            case.family().to_owned()
        } else {
            case.label()
        }
    };
    let methods = distinct(cases.iter().map(|case| method(case)));
    let mut passes = vec![FRAME];
    if methods.len() == 1 {
        passes.extend(distinct(cases.iter().flat_map(|case| {
            let least = 0.05 * case.device.median;
            let large = case
                .passes
                .iter()
                .filter(move |pass| pass.time.median >= least);
            large.map(|pass| pass.pass.as_str())
        })));
    }
    passes.extend(fits.iter().map(|fit| fit.pass.as_str()));
    let mut found = Vec::new();
    for name in &methods {
        for pass in distinct(passes.iter().copied()) {
            let own: Vec<_> = cases.iter().filter(|case| method(case) == *name).collect();
            let mut points: Vec<_> = own
                .iter()
                .filter_map(|case| Some((case.x(x)?, case.time(pass)?)))
                .filter(|(x, _)| *x > 0.0)
                .collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            if !points.is_empty() {
                found.push(Series {
                    name: format!("{name}, {pass}"),
                    pass,
                    points,
                    fit: None,
                });
                let last = found.last_mut();
                let fit = fits
                    .iter()
                    .find(|fit| fit.pass == pass && own.iter().all(|case| fit.is_of(case)));
                if let Some(series) = last {
                    series.fit = fit.copied();
                }
            }
        }
    }
    // With one method its name says nothing.
    if methods.len() == 1 {
        for series in &mut found {
            series.name = series.pass.to_owned();
        }
    }
    found
}

/// A scale with its ticks.
#[derive(Clone, Debug, PartialEq)]
struct Axis {
    name: String,
    log: bool,
    low: f64,
    high: f64,
    ticks: Vec<f64>,
}

impl Axis {
    /// From 0 to `high`.
    fn linear(name: &str, high: f64) -> Axis {
        let high = if high > 0.0 && high.is_finite() {
            high
        } else {
            1.0
        };
        let power = 10f64.powf((high / 5.0).log10().floor());
        let steps = [1.0, 2.0, 5.0, 10.0].map(|step| step * power);
        let step = steps
            .into_iter()
            .find(|step| high / step <= 8.0)
            .unwrap_or(high);
        Axis {
            name: name.to_owned(),
            log: false,
            low: 0.0,
            high,
            ticks: (0..=8)
                .map(|k| f64::from(k) * step)
                .filter(|tick| *tick <= high)
                .collect(),
        }
    }

    /// `count` rows of height 1, without ticks.
    fn rows(count: i32) -> Axis {
        Axis {
            name: String::new(),
            log: false,
            low: 0.0,
            high: f64::from(count),
            ticks: Vec::new(),
        }
    }

    /// Around positive `values`.
    fn log(name: &str, values: impl Iterator<Item = f64>) -> Axis {
        let (low, high) = values.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), value| {
            (low.min(value), high.max(value))
        });
        let pad = (high / low).powf(0.06).max(1.15);
        let (low, high) = (low / pad, high * pad);
        let decades = low.log10().floor() as i32..=high.log10().floor() as i32;
        let ticks = |digits: &[f64]| -> Vec<f64> {
            let all = decades
                .clone()
                .flat_map(|decade| digits.iter().map(move |digit| digit * 10f64.powi(decade)));
            all.filter(|tick| (low..=high).contains(tick)).collect()
        };
        let ways = [
            ticks(&[1.0]),
            ticks(&[1.0, 2.0, 5.0]),
            ticks(&[1., 2., 3., 4., 5., 7.]),
        ];
        let [_, _, most] = ways.clone();
        Axis {
            name: name.to_owned(),
            log: true,
            low,
            high,
            ticks: ways
                .into_iter()
                .find(|ticks| ticks.len() >= 4)
                .unwrap_or(most),
        }
    }

    /// The values that a curve is drawn through.
    fn steps(&self) -> impl Iterator<Item = f64> {
        let (low, high) = (self.scaled(self.low), self.scaled(self.high));
        (0..=120).map(move |k| {
            let at = low + (high - low) * f64::from(k) / 120.0;
            if self.log { 10f64.powf(at) } else { at }
        })
    }

    fn scaled(&self, value: f64) -> f64 {
        if self.log { value.log10() } else { value }
    }
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (from, to): (i32, i32)) -> i32 {
        let (low, high) = (self.scaled(self.low), self.scaled(self.high));
        let share = (self.scaled(*value) - low) / (high - low);
        from + (f64::from(to - from) * share).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.low..self.high
    }
}

impl ValueFormatter<f64> for Axis {
    fn format(value: &f64) -> String {
        short(*value)
    }
}

/// A round number: `0.02`, `20`, `20 k`.
fn short(value: f64) -> String {
    for (unit, prefix) in [(1e9, " G"), (1e6, " M"), (1e3, " k")] {
        if value.abs() >= 0.9995 * unit {
            return format!("{}{prefix}", short(value / unit));
        }
    }
    // Rounding hides what powers and sums leave of a round number.
    let places = if value == 0.0 {
        0
    } else {
        (2 - value.abs().log10().floor() as i32).max(0)
    };
    let text = format!("{value:.*}", places as usize);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// A point with its looks.
struct Mark {
    x: f64,
    y: f64,
    color: RGBColor,
    shape: usize,
    text: String,
}

impl Key {
    fn new(color: RGBColor, shape: usize, text: &str) -> Key {
        Key {
            color,
            outline: outline(shape),
            text: text.to_owned(),
        }
    }
}

fn color(index: usize) -> RGBColor {
    PALETTE.get(index % PALETTE.len()).copied().unwrap_or(INK)
}

/// The index of a square among the shapes.
const SQUARE: usize = 1;

/// The corners of a shape around 0; five shapes, then again.
fn outline(shape: usize) -> Vec<(f64, f64)> {
    let polygon = |corners: u32, turn: f64, radius: f64| {
        (0..corners)
            .map(|k| {
                let angle = (f64::from(k) / f64::from(corners) + turn) * std::f64::consts::TAU;
                (radius * angle.sin(), -radius * angle.cos())
            })
            .collect()
    };
    match shape % 5 {
        0 => polygon(24, 0.0, 0.85),
        SQUARE => polygon(4, 0.125, 1.0),
        2 => polygon(3, 0.0, 1.0),
        3 => polygon(4, 0.0, 1.0),
        _ => polygon(3, 0.5, 1.0),
    }
}

/// Draws into an SVG of so many pixels of the page.
fn draw(width: i32, height: i32, paint: impl FnOnce(&Surface<'_>) -> Drawn) -> Option<String> {
    let mut svg = String::new();
    let size = [width, height].map(|side| (side * SCALE).unsigned_abs());
    let root = SVGBackend::with_string(&mut svg, (size[0], size[1])).into_drawing_area();
    paint(&root).ok()?;
    root.present().ok()?;
    drop(root);
    Some(svg)
}

/// A font size in pixels of the page. The backend divides by 1.24.
fn font(pixels: f64) -> (&'static str, f64) {
    ("sans-serif", pixels * 1.24 * f64::from(SCALE))
}

fn text(size: f64, color: &RGBColor) -> TextStyle<'_> {
    TextStyle::from(font(size)).color(color)
}

fn axes<'a>(root: &Surface<'a>, x: &Axis, y: &Axis) -> Result<Chart<'a>, Fault> {
    let widest = y
        .ticks
        .iter()
        .map(|tick| short(*tick).chars().count())
        .max();
    let left = 34 + (widest.unwrap_or(0) as f64 * LETTER) as i32;
    let mut chart = ChartBuilder::on(root)
        .margin_top(10 * SCALE)
        .margin_right(16 * SCALE)
        .x_label_area_size(46 * SCALE)
        .y_label_area_size(left * SCALE)
        .build_cartesian_2d(x.clone(), y.clone())?;
    mesh(&mut chart, x, Some(y))?;
    Ok(chart)
}

fn mesh(chart: &mut Chart<'_>, x: &Axis, y: Option<&Axis>) -> Drawn {
    let mut mesh = chart.configure_mesh();
    mesh.bold_line_style(GRID.stroke_width(SCALE as u32))
        .max_light_lines(0)
        .axis_style(GRID.stroke_width(SCALE as u32))
        .set_all_tick_mark_size(4 * SCALE)
        .label_style(text(11.5, &MUTED))
        .axis_desc_style(text(12.0, &INK))
        .x_desc(x.name.as_str());
    match y {
        Some(y) => mesh.y_desc(y.name.as_str()),
        None => mesh.disable_y_axis(),
    };
    mesh.draw()
}

/// A line through points.
fn join(chart: &mut Chart<'_>, points: impl Iterator<Item = (f64, f64)>, color: RGBColor) -> Drawn {
    let style = color.mix(0.55).stroke_width(SCALE as u32 * 3 / 2);
    chart.draw_series(LineSeries::new(points, style))?;
    Ok(())
}

/// Draws a mark and tells where.
fn marker(root: &Surface<'_>, chart: &Chart<'_>, mark: &Mark) -> Result<(i32, i32), Fault> {
    let at = chart.backend_coord(&(mark.x, mark.y));
    let radius = f64::from(5 * SCALE);
    let corner = |(dx, dy): (f64, f64)| {
        let [dx, dy] = [dx, dy].map(|d| (radius * d).round() as i32);
        (at.0 + dx, at.1 + dy)
    };
    let corners: Vec<_> = outline(mark.shape).into_iter().map(corner).collect();
    root.draw(&Polygon::new(corners, mark.color.filled()))?;
    Ok(at)
}

/// A text beside a point, halfway up.
fn write(root: &Surface<'_>, text: &str, at: (i32, i32), color: RGBColor, side: HPos) -> Drawn {
    let style = self::text(11.5, &color).pos(Pos::new(side, VPos::Center));
    // XML has no control characters.
    let text = text.replace(char::is_control, " ");
    root.draw(&Text::new(text, at, style))
}

/// Width of a letter of [`write`]'s font, pixels: a wide one's average, for the reader's may
/// be any.
const LETTER: f64 = 7.0;

/// A part of the drawing: left, top, right, bottom.
type Box4 = [i32; 4];

fn overlap(a: &Box4, b: &Box4) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

/// Writes the names of the marks where they cover no mark and no other name.
fn label(root: &Surface<'_>, marks: &[Mark], places: &[(i32, i32)]) -> Drawn {
    let (width, height) = root.dim_in_pixel();
    let page = [width, height].map(|side| side as i32);
    let mut taken: Vec<Box4> = places
        .iter()
        .map(|(x, y)| [x - 5 * SCALE, y - 5 * SCALE, x + 5 * SCALE, y + 5 * SCALE])
        .collect();
    for (mark, &(x, y)) in marks.iter().zip(places) {
        let length = (mark.text.chars().count() as f64 * LETTER * f64::from(SCALE)) as i32;
        let half = 7 * SCALE;
        let [right, left] = [x + 9 * SCALE, x - 9 * SCALE - length];
        let [above, below] = [y - 12 * SCALE, y + 12 * SCALE];
        let middle = x - length / 2;
        let free = [
            (right, y),
            (left, y),
            (middle, above),
            (middle, below),
            (right, above),
            (right, below),
            (left, above),
            (left, below),
        ]
        .into_iter()
        .find(|&(start, row)| {
            let place = [start, row - half, start + length, row + half];
            let inside = start > 60 * SCALE && place[2] < page[0] && place[1] > 0;
            let inside = inside && place[3] < page[1] - 46 * SCALE;
            inside && !taken.iter().any(|other| overlap(other, &place))
        });
        if let Some((start, row)) = free {
            taken.push([start, row - half, start + length, row + half]);
            write(root, &mark.text, (start, row), INK, HPos::Left)?;
        }
    }
    Ok(())
}

/// The names of cases without what all of them begin with by their group, no longer than
/// a plot has room for.
fn short_names(cases: &[&Case]) -> Vec<String> {
    const MOST: usize = 46;
    let bare = |case: &Case| -> Option<String> {
        let rest = case.name.strip_prefix(&case.group)?;
        let rest = rest.strip_prefix(['/', ' ', ':', ','])?.trim_start();
        (!rest.is_empty()).then(|| rest.to_owned())
    };
    let names: Option<Vec<String>> = cases.iter().map(|case| bare(case)).collect();
    let names = names.unwrap_or_else(|| cases.iter().map(|case| case.name.clone()).collect());
    names
        .into_iter()
        .map(|name| match name.chars().count() {
            length if length > MOST => name.chars().take(MOST - 1).chain(['…']).collect(),
            _ => name,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::example;
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let axis = Axis::linear("ms", 27.3);
        let texts: Vec<_> = axis.ticks.iter().map(|t| short(*t)).collect();
        assert_eq!(texts, ["0", "5", "10", "15", "20", "25"]);
        let axis = Axis::log("rr", [0.021, 0.83].into_iter());
        let texts: Vec<_> = axis.ticks.iter().map(|t| short(*t)).collect();
        assert_eq!(texts, ["0.02", "0.05", "0.1", "0.2", "0.5", "1"]);
        let axis = Axis::log("triangles", [1280.0, 1.3e6].into_iter());
        assert!(axis.ticks.len() >= 4);
        assert!(
            axis.ticks
                .iter()
                .all(|t| (axis.low..=axis.high).contains(t))
        );
        assert_eq!(
            [short(0.3 * 3.0), short(2.5e4), short(1e6)],
            ["0.9", "25 k", "1 M"]
        );
        // Nothing to show is no reason to fail.
        assert_eq!(Axis::linear("ms", f64::NAN).high, 1.0);
    }

    #[test]
    fn names_do_not_overlap() {
        let run = example::run();
        let cases: Vec<&Case> = run.cases.iter().filter(|c| c.group == "methods").collect();
        let plot = errors(&cases).expect("a plot");
        let attribute = |tag: &str, name: &str| -> String {
            let from = tag.split_once(&format!(" {name}=\"")).expect("it").1;
            from.split_once('"').expect("its end").0.to_owned()
        };
        // Names begin at their place; what belongs to axes does not.
        let places: Vec<Box4> = plot
            .svg
            .split("<text ")
            .skip(1)
            .filter(|tag| attribute(tag, "fill").as_str() == "#1B1F24" && tag.contains("\"start\""))
            .map(|tag| {
                let tag = format!(" {tag}");
                let number = |name| attribute(&tag, name).parse::<i32>().expect("a number");
                let text = tag.split_once('>').expect("a text").1;
                let text = text.split_once('<').expect("its end").0.trim().to_owned();
                let length = text.chars().count() as i32 * 6 * SCALE;
                let (x, y) = (number("x"), number("y"));
                [x, y - 6 * SCALE, x + length, y + 6 * SCALE]
            })
            .collect();
        assert!(places.len() > cases.len() / 2, "{} names", places.len());
        for (index, a) in places.iter().enumerate() {
            assert!(places.iter().skip(index + 1).all(|b| !overlap(a, b)));
        }
    }

    #[test]
    fn stacks_are_as_long_as_the_times_and_coloured_by_pass() {
        let run = example::run();
        let cases: Vec<&Case> = run.cases.iter().take(1).collect();
        let plot = stacks(&cases, &run.passes()).expect("a plot");
        let keys: Vec<_> = plot.keys.iter().map(|key| key.text.as_str()).collect();
        assert_eq!(keys, run.passes());
        let width = |index: usize| -> f64 {
            let fill = format!("fill=\"{}\"", hex(color(index)));
            let rects = plot.svg.split("<rect ").filter(|tag| tag.contains(&fill));
            rects
                .map(|tag| {
                    let from = tag.split_once("width=\"").expect("a width").1;
                    let text = from.split_once('"').expect("its end").0;
                    text.parse::<f64>().expect("a number")
                })
                .sum()
        };
        let time = |index: usize| cases[0].passes[index].time.median;
        let (drawn, expected) = (width(3) / width(2), time(3) / time(2));
        assert!((drawn / expected - 1.0).abs() < 0.02, "{drawn} {expected}");
        // A case's own passes do not decide on colours.
        let reversed: Vec<_> = run.passes().into_iter().rev().collect();
        let other = stacks(&cases, &reversed).expect("a plot");
        assert_ne!(plot.svg, other.svg);
    }

    #[test]
    fn growth_is_plotted_for_each_sweep_with_its_fits() {
        let run = example::run();
        let plots = growth(&run);
        let titles: Vec<_> = plots.iter().map(|(title, _)| title.as_str()).collect();
        let expected = ["triangles", "covered pixels", "fetches", "light map texels"]
            .map(|x| format!("Time against {x}"));
        assert_eq!(titles, expected);
        let told: Vec<&String> = plots.iter().flat_map(|(_, plot)| &plot.captions).collect();
        for words in fits_in_words(&run.fits) {
            assert!(told.contains(&&words), "{words}");
        }
    }

    #[test]
    fn what_is_missing_is_not_plotted() {
        let mut run = example::run();
        for case in &mut run.cases {
            case.error = None;
            case.passes.clear();
        }
        let cases: Vec<&Case> = run.cases.iter().collect();
        assert_eq!(errors(&cases), None);
        assert_eq!(stacks(&cases, &[]), None);
        assert_eq!(stacks(&[], &[]), None);
        run.cases.truncate(1);
        assert!(growth(&run).is_empty());
    }
}
