//! Times: of whole frames over a matrix of cases ([`Run`], `marmor bench`), and of
//! alternatives side by side ([`reduce`], `marmor bench reduce`).

pub mod baseline;
pub mod csv;
pub mod html;
pub mod plot;
pub mod reduce;
pub mod table;
mod words;

pub use baseline::{Comparison, compare};
pub use reduce::{Bench, Row, rows};

use super::{Error, Output};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::io::Write as _;
use std::path::Path;

/// The form of a [`Run`] as JSON. Counts up whenever an older reader would misread it.
pub const FORMAT: u32 = 1;

/// One run of `marmor bench`. Times in ms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// [`FORMAT`].
    pub format: u32,
    /// What measured, and on what.
    pub header: Header,
    /// Whether all cases were measured; false where the run was interrupted.
    pub complete: bool,
    /// Frames measured of each case.
    pub frames: u32,
    /// What fetches cost on this device.
    pub costs: Vec<Cost>,
    /// The matrix, in the order of measuring.
    pub cases: Vec<Case>,
    /// How times grow.
    pub fits: Vec<Fit>,
    /// Remarks on how the figures came about, and cases left out with their reasons.
    pub notes: Vec<String>,
}

/// What measured, and on what.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// Version of marmor.
    pub marmor: String,
    /// Commit it was built from, where known.
    pub commit: Option<String>,
    /// When the run began: ISO 8601, UTC.
    pub date: String,
    /// The command line.
    pub command: String,
    /// Name of the Vulkan device.
    pub device: String,
    /// Driver name and version.
    pub driver: String,
    /// Name of the processor.
    pub cpu: String,
    /// Its cores that the process may use.
    pub cores: u32,
    /// Whether the validation layers watched; times are then of no use.
    pub validation: bool,
}

/// What one fetch of a kind costs on this device: all its cores together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Kind of access: `bilinear`, `nearest`, `texel`, `gather and compare`, `trilinear`,
    /// `storage image` or `input attachment`.
    pub kind: String,
    /// Format of the image, such as `RGBA32F`.
    pub format: String,
    /// Time of one fetch, ns.
    pub nanoseconds: Spread,
    /// Bytes of one texel.
    pub bytes: u32,
}

/// How measured values lie. The unit is that of the values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Half of the values are less.
    pub median: f64,
    /// 5 % of the values are less.
    pub p5: f64,
    /// 95 % of the values are less.
    pub p95: f64,
    /// How many values there were.
    pub count: u32,
}

/// A cell of the matrix: what was drawn, and how long it took.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Case {
    /// Key of the case in the matrix; no other case of the run has it.
    pub name: String,
    /// The sweep it belongs to, such as `methods` or `triangles`.
    pub group: String,
    /// Name of the scene.
    pub scene: String,
    /// Triangles of its mesh.
    pub triangles: u64,
    /// Width and height of the picture, pixels.
    pub size: [u32; 2],
    /// Texels along a side of the light map.
    pub light_map: u32,
    /// Method for multiple scattering, such as `mixture(3)`.
    pub multiple: String,
    /// Method for single scattering, such as `march(8)`.
    pub single: String,
    /// Whether the light map and its pyramid are those of an earlier frame.
    pub light_rests: bool,
    /// Fetches a pixel that the method was chosen to keep to.
    pub budget: Option<u32>,
    /// Declared fetches a pixel.
    pub fetches: u32,
    /// Share of the pixels that the object covers, in [0, 1].
    pub covered: f64,
    /// Relative RMSE (rr) against the reference, where one was drawn.
    pub error: Option<f64>,
    /// Time from submitting a frame to its fence, ms.
    pub wall: Spread,
    /// Sum of the passes' times on the device, ms.
    pub device: Spread,
    /// Each pass, in the order of the frame.
    pub passes: Vec<Pass>,
    /// What was drawn, as PNG. JSON does not keep it.
    #[serde(skip)]
    pub picture: Option<Vec<u8>>,
}

/// A pass of a case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pass {
    /// Its name.
    pub pass: String,
    /// Time on the device, ms.
    pub time: Spread,
    /// Fetches of a frame: declared times the pixels it covers, or the texels it writes.
    pub fetches: f64,
    /// What these fetches touch: bytes of a texel times texels of a tap, summed.
    pub bytes: f64,
    /// Time that its fetches alone take, ms: of shading measured by a build that only reads, else by the run's [`Cost`]s.
    pub floor: Option<f64>,
    /// Invocations of its shader in a frame, by the device's pipeline statistics.
    pub invocations: Option<u64>,
}

/// How a time grows: intercept + slope x by least squares over cases of a group, or, with
/// an exponent, slope x^exponent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// The group whose cases were used.
    pub group: String,
    /// The method, as [`Case::label`], [`Case::multiple`] or [`Case::family`] says it.
    pub method: String,
    /// What was varied; see [`Case::x`].
    pub x: String,
    /// A pass, or [`FRAME`].
    pub pass: String,
    /// Time at x = 0, ms; 0 with an exponent.
    pub intercept: f64,
    /// ms per unit of x; with an exponent, the time at x = 1, ms.
    pub slope: f64,
    /// Share of the variance that the fit explains, of logarithms with an exponent.
    pub r2: f64,
    /// The exponent of a power law.
    pub exponent: Option<f64>,
}

/// Instead of a pass, all of them: [`Case::device`].
pub const FRAME: &str = "frame";

/// Abscissas: the number of pixels that the object covers.
pub const COVERED_PIXELS: &str = "covered pixels";
/// Abscissas: declared fetches a pixel.
pub const FETCHES: &str = "fetches";
/// Abscissas: triangles of the mesh.
pub const TRIANGLES: &str = "triangles";
/// Abscissas: texels of the light map.
pub const LIGHT_MAP_TEXELS: &str = "light map texels";

impl Run {
    /// Reads a run that [`Run::write`] wrote. Pictures are not in it.
    ///
    /// # Errors
    /// The file is missing, is no such document, is of another [`FORMAT`], or names two
    /// cases alike.
    pub fn read(path: &Path) -> Result<Run, Error> {
        let fault = |problem: String| Error::of(path.display(), problem);
        let text = std::fs::read_to_string(path).map_err(|error| {
            fault(match error.kind() {
                std::io::ErrorKind::NotFound => "no such file; check the path".to_owned(),
                std::io::ErrorKind::InvalidData => {
                    "not text; name a JSON file that 'marmor bench' wrote".to_owned()
                }
                _ => format!("cannot be read ({error}); check the path and its permissions"),
            })
        })?;
        let run = Run::parse(&text).map_err(fault)?;
        let mut names = BTreeSet::new();
        match run.cases.iter().find(|case| !names.insert(&case.name)) {
            Some(case) => Err(fault(format!(
                "two cases are called \"{}\"; measure anew",
                case.name
            ))),
            None => Ok(run),
        }
    }

    fn parse(text: &str) -> Result<Run, String> {
        // A document of another format would fail at some key, which says less.
        #[derive(Deserialize)]
        struct Any {
            format: Option<u64>,
        }
        let any: Any = serde_json::from_str(text).map_err(|error| {
            format!("not usable JSON ({error}); name a file that 'marmor bench' wrote")
        })?;
        match any.format {
            Some(format) if format == u64::from(FORMAT) => {}
            Some(format) => {
                return Err(format!(
                    "has format {format}, but this marmor reads {FORMAT}; measure anew with this \
                     marmor, or read it with the one that wrote it"
                ));
            }
            None => {
                return Err(
                    "not a run of 'marmor bench' (it has no format); name another \
                            file or measure anew"
                        .to_owned(),
                );
            }
        }
        serde_json::from_str(text)
            .map_err(|error| format!("not a usable run ({error}); measure anew"))
    }

    /// Writes the run as JSON, indented, without pictures.
    ///
    /// # Errors
    /// The disk does not take the file.
    pub fn write(&self, output: &Output) -> Result<(), Error> {
        output.write(|writer| {
            serde_json::to_writer_pretty(&mut *writer, self)?;
            writer.write_all(b"\n")
        })
    }

    /// The groups in the order of their first case, with their cases.
    pub fn groups(&self) -> Vec<(&str, Vec<&Case>)> {
        let mut groups: Vec<(&str, Vec<&Case>)> = Vec::new();
        for case in &self.cases {
            match groups.iter_mut().find(|(name, _)| *name == case.group) {
                Some((_, cases)) => cases.push(case),
                None => groups.push((&case.group, vec![case])),
            }
        }
        groups
    }

    /// The names of all passes in the order of their first appearance.
    pub fn passes(&self) -> Vec<&str> {
        distinct(
            self.cases
                .iter()
                .flat_map(|case| case.passes.iter().map(|pass| pass.pass.as_str())),
        )
    }
}

impl Spread {
    /// How `values` lie: quantiles between neighbours in proportion. All 0 where there are
    /// none.
    pub fn of(mut values: Vec<f64>) -> Spread {
        values.sort_by(f64::total_cmp);
        Spread {
            median: reduce::quantile(&values, 0.5),
            p5: reduce::quantile(&values, 0.05),
            p95: reduce::quantile(&values, 0.95),
            count: u32::try_from(values.len()).unwrap_or(u32::MAX),
        }
    }
}

impl Case {
    /// The methods in words: multiple scattering, single scattering unless `off`, and
    /// whether the light rests.
    pub fn label(&self) -> String {
        let mut label = self.multiple.clone();
        if !["", "off"].contains(&self.single.as_str()) {
            label = format!("{label} + {}", self.single);
        }
        if self.light_rests {
            label.push_str(", light at rest");
        }
        label
    }

    /// The method for multiple scattering without its parameters: `mixture`.
    pub fn family(&self) -> &str {
        self.multiple.split('(').next().unwrap_or_default().trim()
    }

    /// What a fit or plot has along its horizontal axis: [`COVERED_PIXELS`], [`FETCHES`],
    /// [`TRIANGLES`] or [`LIGHT_MAP_TEXELS`]. None for another name.
    pub fn x(&self, name: &str) -> Option<f64> {
        let [width, height] = self.size.map(f64::from);
        match name {
            COVERED_PIXELS => Some(self.covered * width * height),
            FETCHES => Some(f64::from(self.fetches)),
            TRIANGLES => Some(self.triangles as f64),
            LIGHT_MAP_TEXELS => Some(f64::from(self.light_map).powi(2)),
            _ => None,
        }
    }

    /// The time of a pass or of the [`FRAME`], ms. None where the case has no such pass.
    pub fn time(&self, pass: &str) -> Option<Spread> {
        match pass {
            FRAME => Some(self.device),
            _ => {
                let found = self.passes.iter().find(|known| known.pass == pass)?;
                Some(found.time)
            }
        }
    }

    /// Frames a second by the wall clock. None where no time passed.
    pub fn rate(&self) -> Option<f64> {
        (self.wall.median > 0.0).then(|| 1000.0 / self.wall.median)
    }
}

impl Pass {
    /// The time as a multiple of what its fetches alone take. None where that is unknown
    /// or nothing.
    pub fn over_floor(&self) -> Option<f64> {
        let floor = self.floor.filter(|floor| *floor > 0.0)?;
        Some(self.time.median / floor)
    }
}

impl Fit {
    /// The line through (x, ms) by least squares. None without two different x.
    ///
    /// `r2` is 1 where all times are equal: the line then explains them.
    pub fn linear(
        group: &str,
        method: &str,
        x: &str,
        pass: &str,
        points: &[(f64, f64)],
    ) -> Option<Fit> {
        let line = Line::through(points)?;
        Some(Fit {
            group: group.to_owned(),
            method: method.to_owned(),
            x: x.to_owned(),
            pass: pass.to_owned(),
            intercept: line.intercept,
            slope: line.slope,
            r2: line.r2,
            exponent: None,
        })
    }

    /// The power law through (x, ms) by least squares of logarithms. Points that have none
    /// are left out. None without two different x.
    pub fn power(
        group: &str,
        method: &str,
        x: &str,
        pass: &str,
        points: &[(f64, f64)],
    ) -> Option<Fit> {
        let logs: Vec<_> = points
            .iter()
            .filter(|(x, y)| *x > 0.0 && *y > 0.0)
            .map(|(x, y)| (x.ln(), y.ln()))
            .collect();
        let line = Line::through(&logs)?;
        Some(Fit {
            group: group.to_owned(),
            method: method.to_owned(),
            x: x.to_owned(),
            pass: pass.to_owned(),
            intercept: 0.0,
            slope: line.intercept.exp(),
            r2: line.r2,
            exponent: Some(line.slope),
        })
    }

    /// (x, ms) of those `cases` that have both: what to fit a line through.
    pub fn points<'a>(
        cases: impl IntoIterator<Item = &'a Case>,
        x: &str,
        pass: &str,
    ) -> Vec<(f64, f64)> {
        cases
            .into_iter()
            .filter_map(|case| Some((case.x(x)?, case.time(pass)?.median)))
            .collect()
    }

    /// The fitted time at `x`, ms.
    pub fn at(&self, x: f64) -> f64 {
        match self.exponent {
            Some(exponent) => self.slope * x.powf(exponent),
            None => self.intercept + self.slope * x,
        }
    }

    /// Whether the method of `case` is the fit's.
    pub fn is_of(&self, case: &Case) -> bool {
        self.group == case.group
            && [&*case.label(), &case.multiple, case.family()].contains(&self.method.as_str())
    }

    /// The fit in words, without its method: `shade: 0.42 ms + 12.3 ns per covered pixel`.
    pub fn words(&self) -> String {
        let r2 = format!("R² {:.4}", self.r2);
        let pass = &self.pass;
        match self.exponent {
            Some(exponent) => format!("{pass}: grows as {}^{exponent:.2} ({r2})", self.x),
            None => {
                let slope = per_unit(self.slope);
                let unit = match self.x.as_str() {
                    FETCHES => "fetch a pixel",
                    COVERED_PIXELS => "covered pixel",
                    TRIANGLES => "triangle",
                    LIGHT_MAP_TEXELS => "texel of the light map",
                    other => other,
                };
                let intercept = digits(self.intercept);
                format!("{pass}: {intercept} ms + {slope} per {unit} ({r2})")
            }
        }
    }
}

/// The fits in sentences: lines, each with the exponent of the power law beside it, where
/// both were fitted to the same times.
fn fits_in_words<'a>(fits: impl IntoIterator<Item = &'a Fit>) -> Vec<String> {
    let fits: Vec<&Fit> = fits.into_iter().collect();
    let same = |a: &Fit, b: &Fit| {
        [&a.group, &a.method, &a.x, &a.pass] == [&b.group, &b.method, &b.x, &b.pass]
    };
    let line = |fit: &&&Fit| fit.exponent.is_none();
    let law = |fit: &Fit| {
        fits.iter()
            .find(|law| same(fit, law) && law.exponent.is_some())
    };
    let lines = fits.iter().filter(line).map(|fit| {
        let words = format!("{}, {}", fit.method, fit.words());
        match law(fit).and_then(|law| law.exponent) {
            Some(exponent) => format!("{words}; grows as {}^{exponent:.2}.", fit.x),
            None => format!("{words}."),
        }
    });
    let alone = |fit: &&&Fit| {
        !line(fit)
            && !fits
                .iter()
                .any(|line| line.exponent.is_none() && same(fit, line))
    };
    let laws = fits.iter().filter(alone);
    lines
        .chain(laws.map(|fit| format!("{}, {}.", fit.method, fit.words())))
        .collect()
}

/// A line by least squares.
struct Line {
    intercept: f64,
    slope: f64,
    r2: f64,
}

impl Line {
    fn through(points: &[(f64, f64)]) -> Option<Line> {
        let count = points.len() as f64;
        let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
        let (x, y) = (mean(|p| p.0), mean(|p| p.1));
        // Centred, so that large x do not cancel.
        let [mut xx, mut xy, mut yy] = [0.0; 3];
        for (px, py) in points {
            let (dx, dy) = (px - x, py - y);
            xx += dx * dx;
            xy += dx * dy;
            yy += dy * dy;
        }
        if xx <= 0.0 || !(xx + yy).is_finite() {
            return None;
        }
        let slope = xy / xx;
        let r2 = if yy > 0.0 { xy * xy / (xx * yy) } else { 1.0 };
        Some(Line {
            intercept: y - slope * x,
            slope,
            r2,
        })
    }
}

/// Those of `values` that did not come before.
fn distinct<T: PartialEq>(values: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for value in values {
        if !found.contains(&value) {
            found.push(value);
        }
    }
    found
}

/// A time per unit, in the unit that suits it.
fn per_unit(milliseconds: f64) -> String {
    let size = milliseconds.abs();
    if size >= 0.1 || size == 0.0 {
        format!("{} ms", digits(milliseconds))
    } else if size >= 0.9995e-3 {
        format!("{} µs", digits(milliseconds * 1e3))
    } else {
        format!("{} ns", digits(milliseconds * 1e6))
    }
}

/// A number with three digits that count, never more than three behind the point.
fn digits(value: f64) -> String {
    let size = value.abs();
    let places = match size {
        _ if size >= 99.95 => 0,
        _ if size >= 9.995 => 1,
        _ if size >= 0.9995 => 2,
        _ => 3,
    };
    format!("{value:.places$}")
}

/// An error rr with three digits that count.
fn error(value: f64) -> String {
    let places = match value.abs() {
        size if size >= 0.9995 => 2,
        size if size >= 0.09995 => 3,
        size if size >= 0.009995 => 4,
        _ => 5,
    };
    format!("{value:.places$}")
}

/// A count with a unit prefix: `1.23 M`.
fn count(value: f64) -> String {
    for (unit, prefix) in [(1e12, "T"), (1e9, "G"), (1e6, "M"), (1e3, "k")] {
        if value.abs() >= 0.9995 * unit {
            return format!("{} {prefix}", digits(value / unit));
        }
    }
    if value.fract() == 0.0 {
        format!("{value:.0}")
    } else {
        digits(value)
    }
}

/// A whole number in groups of three digits.
fn grouped(value: u64) -> String {
    let plain = value.to_string();
    let mut text = String::new();
    for (index, digit) in plain.chars().enumerate() {
        if index > 0 && (plain.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
pub(crate) mod example;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_has_the_quantiles_of_its_values() {
        let spread = Spread::of((0..=200).rev().map(f64::from).collect());
        let expected = Spread {
            median: 100.0,
            p5: 10.0,
            p95: 190.0,
            count: 201,
        };
        assert_eq!(spread, expected);
        let one = Spread::of(vec![7.0]);
        assert_eq!((one.median, one.p5, one.p95, one.count), (7.0, 7.0, 7.0, 1));
        assert_eq!(Spread::of(Vec::new()), Spread::default());
    }

    /// Anscombe 1973, the first of four: slope 0.500, intercept 3.00, R² 0.667.
    #[test]
    fn a_line_through_anscombes_points_is_the_published_one() {
        let x = [10., 8., 13., 9., 11., 14., 6., 4., 12., 7., 5.];
        let y = [
            8.04, 6.95, 7.58, 8.81, 8.33, 9.96, 7.24, 4.26, 10.84, 4.82, 5.68,
        ];
        let points: Vec<_> = x.into_iter().zip(y).collect();
        let fit = Fit::linear("g", "m", FETCHES, "shade", &points).expect("a line");
        assert!((fit.slope - 0.500_090_9).abs() < 1e-6, "{fit:?}");
        assert!((fit.intercept - 3.000_090_9).abs() < 1e-6, "{fit:?}");
        assert!((fit.r2 - 0.666_542).abs() < 1e-5, "{fit:?}");
        assert!((fit.at(10.0) - 8.001).abs() < 1e-6);
    }

    #[test]
    fn a_power_law_is_found_again_and_zeros_do_not_spoil_it() {
        let mut points: Vec<_> = (1..20)
            .map(|i| (f64::from(i * i), 0.3 * f64::from(i * i).powf(1.5)))
            .collect();
        points.push((0.0, 0.0));
        let fit = Fit::power("g", "m", TRIANGLES, FRAME, &points).expect("a law");
        assert!((fit.exponent.expect("one") - 1.5).abs() < 1e-12);
        assert!((fit.slope - 0.3).abs() < 1e-12 && (fit.r2 - 1.0).abs() < 1e-12);
        assert!((fit.at(4.0) - 2.4).abs() < 1e-12);
    }

    #[test]
    fn no_line_goes_through_a_single_place() {
        let linear = |points: &[(f64, f64)]| Fit::linear("g", "m", "x", "shade", points);
        assert_eq!(linear(&[]), None);
        assert_eq!(linear(&[(1.0, 2.0)]), None);
        assert_eq!(linear(&[(1.0, 2.0), (1.0, 3.0)]), None);
        assert_eq!(linear(&[(1.0, 2.0), (2.0, f64::NAN)]), None);
        let flat = linear(&[(1.0, 2.0), (2.0, 2.0)]).expect("a line");
        assert_eq!((flat.slope, flat.r2), (0.0, 1.0));
    }

    #[test]
    fn a_fit_in_words_has_units_that_suit() {
        let mut fit = Fit::linear(
            "g",
            "m",
            COVERED_PIXELS,
            "shade",
            &[(0.0, 0.5), (1e6, 12.5)],
        )
        .expect("a line");
        assert_eq!(
            fit.words(),
            "shade: 0.500 ms + 12.0 ns per covered pixel (R² 1.0000)"
        );
        fit.exponent = Some(0.97);
        assert_eq!(
            fit.words(),
            "shade: grows as covered pixels^0.97 (R² 1.0000)"
        );
    }

    #[test]
    fn a_line_and_a_law_of_the_same_times_are_one_sentence() {
        let points = [(1.0, 1.0), (2.0, 2.0), (4.0, 4.0)];
        let line = Fit::linear("g", "m", TRIANGLES, FRAME, &points).expect("a line");
        let law = Fit::power("g", "m", TRIANGLES, FRAME, &points).expect("a law");
        let other = Fit {
            method: "n".to_owned(),
            ..law.clone()
        };
        assert_eq!(
            fits_in_words([&law, &line, &other]),
            [
                "m, frame: 0.000 ms + 1.00 ms per triangle (R² 1.0000); grows as triangles^1.00.",
                "n, frame: grows as triangles^1.00 (R² 1.0000).",
            ]
        );
    }

    #[test]
    fn a_run_survives_json_but_for_its_pictures() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run.json");
        let mut run = example::run();
        assert!(run.cases.iter().any(|case| case.picture.is_some()));
        run.write(&Output::check(&path).expect("writable"))
            .expect("written");
        for case in &mut run.cases {
            case.picture = None;
        }
        // A whole run is too long to be printed.
        assert!(Run::read(&path).expect("a run") == run);
    }

    #[test]
    fn what_cannot_be_read_is_named_with_its_remedy_in_one_line() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run.json");
        let of = |text: &[u8]| {
            std::fs::write(&path, text).expect("written");
            let message = Run::read(&path).expect_err("no run").to_string();
            assert!(message.contains("run.json: "), "{message}");
            assert!(!message.contains('\n'), "{message}");
            message
        };
        let json = |run: &Run| serde_json::to_vec(run).expect("JSON");
        let mut run = example::run();
        run.format = 2;
        assert!(of(&json(&run)).contains("has format 2, but this marmor reads 1; measure anew"));
        run.format = FORMAT;
        run.cases[1].name = run.cases[0].name.clone();
        assert!(of(&json(&run)).contains("two cases are called"));
        assert!(of(b"{\"marmor\": \"0.1.0\"}").contains("it has no format"));
        assert!(of(b"{\"format\": 1}").contains("missing field `header`"));
        assert!(of(b"{\"format\": 1").contains("not usable JSON"));
        assert!(of(b"").contains("not usable JSON"));
        assert!(of(&[0xff, 0xfe, 0]).contains("not text"));
        let missing = Run::read(&folder.path().join("none.json")).expect_err("missing");
        assert!(missing.problem.starts_with("no such file"));
    }

    #[test]
    fn numbers_are_short_and_keep_what_counts() {
        let of = |value| digits(value);
        assert_eq!(
            [of(0.01234), of(1.2345), of(12.345)],
            ["0.012", "1.23", "12.3"]
        );
        assert_eq!([of(9.999), of(123.45), of(99.96)], ["10.0", "123", "100"]);
        assert_eq!(
            [error(0.0123), error(0.00987), error(1.2)],
            ["0.0123", "0.00987", "1.20"]
        );
        assert_eq!(
            [count(0.0), count(999.0), count(1234.0)],
            ["0", "999", "1.23 k"]
        );
        assert_eq!([count(2.0e6), count(999_999.0)], ["2.00 M", "1.00 M"]);
        assert_eq!([grouped(0), grouped(1_234_567)], ["0", "1,234,567"]);
        assert_eq!(
            [per_unit(0.25), per_unit(0.025), per_unit(2.5e-4)],
            ["0.250 ms", "25.0 µs", "250 ns"]
        );
    }

    #[test]
    fn a_label_names_what_differs_from_the_usual() {
        let mut case = example::run().cases[0].clone();
        case.multiple = "mixture(4 from level 2)".to_owned();
        case.single = "off".to_owned();
        case.light_rests = false;
        assert_eq!(case.label(), "mixture(4 from level 2)");
        assert_eq!(case.family(), "mixture");
        case.single = "march(8)".to_owned();
        case.light_rests = true;
        assert_eq!(
            case.label(),
            "mixture(4 from level 2) + march(8), light at rest"
        );
    }
}
