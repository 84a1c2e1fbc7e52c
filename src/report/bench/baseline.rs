//! A run against an earlier one: which times grew by more than noise explains.
//!
//! A shared machine is not as fast today as it was yesterday, so absolute times of two runs
//! do not compare. Each run carries its own yardstick, what a fetch costs (see
//! [`Run::costs`]), measured on the same machine in the same minutes. A time counts as
//! grown where it grew by more than the yardstick did.

use super::table::wrap;
use super::{Case, Cost, FRAME, Header, Run, Spread, digits};
use crate::report::Error;
use serde::Serialize;

/// By what factor the frame's time, over the yardstick, may differ between two runs of the
/// same program on a quiet machine: what the costs of fetches do not see of a machine's
/// mood, such as its caches' and the clock's. A case is measured within a second, and what
/// disturbs that second slows all of it: 1.47 was seen on idle cores.
pub const QUIET_FRAME: f64 = 1.55;

/// The same for a pass that takes less than [`SHORT`]: one preemption is a large share of it.
pub const QUIET_SHORT: f64 = 1.55;

/// Below this time a pass is short, ms.
pub const SHORT: f64 = 2.0;

/// A smaller difference is of no consequence, however surely it was measured, ms.
pub const NOTICEABLE: f64 = 0.5;

/// How many frames in a row one disturbance slows alike: so many count as one measurement.
pub const BURST: f64 = 10.0;

/// How many standard errors are noise. A run has some 500 ratios; at 4 (one-sided, normal)
/// one run in 60 would show one false regression if [`QUIET_FRAME`] were 1.
pub const STANDARD_ERRORS: f64 = 4.0;

/// Instead of a case: all of them, by the geometric mean of their ratios.
pub const ALL: &str = "all cases";

/// The same factor for a pass in the mean over all cases.
pub const QUIET_ALL: f64 = 1.2;

/// The same for a pass that takes less than [`SHORT`].
pub const QUIET_SHORT_ALL: f64 = 1.5;

/// How many standard errors of that mean are noise. Of 6 runs on two cores that other work slowed by up to 2.2, 30 pairs, none
/// exceeded its bound with 5, and one pass in one pair did with 4.
pub const STANDARD_ERRORS_ALL: f64 = 5.0;

/// Fewer cases make no mean.
const LEAST_CASES: usize = 5;

/// Instead of a pass: [`Case::wall`].
pub const WALL: &str = "wall";

/// What became of the times of one run in another.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Which run is old, in words.
    pub old: String,
    /// Which run is new, in words.
    pub new: String,
    /// The new run's yardstick over the old run's: how much slower the machine was.
    pub yardstick: f64,
    /// The kinds of fetches it is the geometric mean of.
    pub kinds: Vec<String>,
    /// Each time that both runs have.
    pub ratios: Vec<Ratio>,
    /// Cases that only the old run has.
    pub only_old: Vec<String>,
    /// Cases that only the new run has.
    pub only_new: Vec<String>,
    /// What the reader should know beside the figures.
    pub notes: Vec<String>,
}

/// A time in both runs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ratio {
    /// Name of the case.
    pub case: String,
    /// Name of the pass, [`FRAME`] or [`WALL`].
    pub pass: String,
    /// Median in the old run, ms.
    pub old: f64,
    /// Median in the new run, ms.
    pub new: f64,
    /// New over old.
    pub raw: f64,
    /// New over old, each over its run's yardstick.
    pub normalised: f64,
    /// What noise makes of `normalised`: up to this, and down to its inverse.
    pub bound: f64,
    /// New, had the machine been as fast as in the old run, less old, ms.
    pub difference: f64,
}

/// What a ratio means.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Noise explains it, or nobody would notice.
    Same,
    /// A regression.
    Slower,
    /// An improvement.
    Faster,
}

/// Compares the times of `new` to those of `old`.
///
/// # Errors
/// The runs are of different devices, only one was validated, or they have no case or no
/// cost of a fetch in common.
pub fn compare(old: &Run, new: &Run) -> Result<Comparison, Error> {
    check(&old.header, &new.header)?;
    let yardstick = Yardstick::new(old, new)?;
    let mut comparison = Comparison {
        old: name(old),
        new: name(new),
        yardstick: yardstick.ratio,
        kinds: yardstick.kinds.clone(),
        ratios: Vec::new(),
        only_old: missing(old, new),
        only_new: missing(new, old),
        notes: notes(old, new),
    };
    let mut common = 0;
    for case in &new.cases {
        let Some(before) = find(old, &case.name) else {
            continue;
        };
        if let Some(change) = change(before, case) {
            comparison.notes.push(format!(
                "{}: not compared, {change} between the runs",
                case.name
            ));
            continue;
        }
        common += 1;
        comparison.add(before, case, &yardstick);
    }
    comparison.add_all(&yardstick);
    if common == 0 {
        return Err(fault(
            "has no case in common with this run; measure both with the same selection of cases"
                .to_owned(),
        ));
    }
    Ok(comparison)
}

fn fault(problem: String) -> Error {
    Error::of("the baseline", problem)
}

/// Whether runs with these headers can be compared.
///
/// # Errors
/// They measured different devices, or only one was validated.
pub fn check(before: &Header, after: &Header) -> Result<(), Error> {
    if before.device != after.device {
        return Err(fault(format!(
            "was measured on \"{}\", this run on \"{}\"; times of different devices do not \
             compare, so measure a baseline on this one",
            before.device, after.device
        )));
    }
    if before.validation != after.validation {
        let state = |on| if on { "with" } else { "without" };
        return Err(fault(format!(
            "was measured {} validation layers, this run {} them; measure both without",
            state(before.validation),
            state(after.validation)
        )));
    }
    Ok(())
}

/// What distinguishes a run from others, in words.
fn name(run: &Run) -> String {
    let header = &run.header;
    let commit = header.commit.as_ref();
    let commit = commit.map_or(String::new(), |commit| format!(" ({commit})"));
    format!("marmor {}{commit}, {}", header.marmor, header.date)
}

fn find<'a>(run: &'a Run, name: &str) -> Option<&'a Case> {
    run.cases.iter().find(|case| case.name == name)
}

/// The cases of `run` that `other` has not.
fn missing(run: &Run, other: &Run) -> Vec<String> {
    run.cases
        .iter()
        .filter(|case| find(other, &case.name).is_none())
        .map(|case| case.name.clone())
        .collect()
}

/// Why two cases of one name are not the same work, if so.
fn change(old: &Case, new: &Case) -> Option<String> {
    let told = |what: &str, old: String, new: String| {
        (old != new).then(|| format!("{what} changed from {old} to {new}"))
    };
    let size = |case: &Case| format!("{}x{}", case.size[0], case.size[1]);
    told("the scene", old.scene.clone(), new.scene.clone())
        .or_else(|| {
            told(
                "the mesh",
                old.triangles.to_string(),
                new.triangles.to_string(),
            )
        })
        .or_else(|| told("the size", size(old), size(new)))
        .or_else(|| {
            told(
                "the light map",
                old.light_map.to_string(),
                new.light_map.to_string(),
            )
        })
        .or_else(|| told("the method", old.label(), new.label()))
        .or_else(|| {
            told(
                "the number of fetches",
                old.fetches.to_string(),
                new.fetches.to_string(),
            )
        })
        .or_else(|| {
            let share = |case: &Case| format!("{:.1} %", 100.0 * case.covered);
            let moved = (old.covered - new.covered).abs() > 0.002;
            moved.then(|| told("the share that is covered", share(old), share(new)))?
        })
}

fn notes(old: &Run, new: &Run) -> Vec<String> {
    let mut notes = Vec::new();
    for (run, which) in [(old, "old"), (new, "new")] {
        if !run.complete {
            notes.push(format!(
                "the {which} run is INCOMPLETE: it has {} cases",
                run.cases.len()
            ));
        }
    }
    if new.header.validation {
        notes.push("both runs were validated, which slows every frame".to_owned());
    }
    let (before, after) = (&old.header, &new.header);
    let cores = |run: &Run| format!("{} cores", run.header.cores);
    for (what, old, new) in [
        ("driver", before.driver.clone(), after.driver.clone()),
        ("processor", before.cpu.clone(), after.cpu.clone()),
        ("number of cores", cores(old), cores(new)),
    ] {
        if old != new {
            notes.push(format!("another {what}: {old}, now {new}"));
        }
    }
    for case in &new.cases {
        let before = find(old, &case.name).map(|before| before.fetches);
        if let Some(before) = before.filter(|before| *before != case.fetches) {
            notes.push(format!(
                "{}: {before} fetches a pixel, now {}",
                case.name, case.fetches
            ));
        }
    }
    notes
}

/// How much slower the machine was in the new run than in the old one.
struct Yardstick {
    ratio: f64,
    /// Relative standard error of the ratio.
    uncertainty: f64,
    kinds: Vec<String>,
}

impl Yardstick {
    fn new(old: &Run, new: &Run) -> Result<Yardstick, Error> {
        let alike = |a: &Cost, b: &Cost| a.kind == b.kind && a.format == b.format;
        let mut kinds = Vec::new();
        let (mut logs, mut squares) = (0.0, 0.0);
        for after in &new.costs {
            let before = old.costs.iter().find(|before| alike(before, after));
            let Some(before) = before else { continue };
            let (before, spread) = (before.nanoseconds, after.nanoseconds);
            let Some(ratio) = quotient(spread.median, before.median) else {
                continue;
            };
            logs += ratio.ln();
            squares += uncertainty(before).powi(2) + uncertainty(spread).powi(2);
            kinds.push(format!("{} {}", after.kind, after.format));
        }
        if kinds.is_empty() {
            return Err(fault(
                "has no cost of a fetch in common with this run, so nothing tells how fast the \
                 machine was; measure it anew"
                    .to_owned(),
            ));
        }
        let count = kinds.len() as f64;
        Ok(Yardstick {
            ratio: (logs / count).exp(),
            uncertainty: squares.sqrt() / count,
            kinds,
        })
    }
}

/// Relative standard error of a median.
fn uncertainty(spread: Spread) -> f64 {
    if spread.median <= 0.0 {
        return 0.0;
    }
    // Of a normal distribution: 5 % and 95 % are 1.645 standard deviations from the middle,
    // and a median is 1.2533 times less sure than a mean.
    let deviation = (spread.p95 - spread.p5).max(0.0) / (2.0 * 1.645 * spread.median);
    let independent = (f64::from(spread.count) / BURST).max(1.0);
    1.2533 * deviation / independent.sqrt()
}

/// a / b where both are positive and finite.
fn quotient(a: f64, b: f64) -> Option<f64> {
    let usable = |value: f64| value.is_finite() && value > 0.0;
    (usable(a) && usable(b)).then(|| a / b)
}

impl Comparison {
    fn add(&mut self, old: &Case, new: &Case, yardstick: &Yardstick) {
        let mut push = |pass: &str, before: Spread, after: Spread| {
            let ratio = Ratio::new([&new.name, pass], before, after, yardstick);
            self.ratios.extend(ratio);
        };
        push(FRAME, old.device, new.device);
        push(WALL, old.wall, new.wall);
        for pass in &new.passes {
            if let Some(before) = old.time(&pass.pass) {
                push(&pass.pass, before, pass.time);
            }
        }
        for (case, other, which) in [(old, new, "old"), (new, old, "new")] {
            for pass in &case.passes {
                if other.time(&pass.pass).is_none() {
                    self.notes.push(format!(
                        "{}: only the {which} run has the pass {}",
                        new.name, pass.pass
                    ));
                }
            }
        }
    }

    /// Adds for each pass, and for the frame, the geometric mean of its ratios over all cases: what slows a pass
    /// slows it everywhere, and what disturbed one case did not disturb all.
    fn add_all(&mut self, yardstick: &Yardstick) {
        let mut passes: Vec<&str> = Vec::new();
        for ratio in &self.ratios {
            if !passes.contains(&ratio.pass.as_str()) {
                passes.push(&ratio.pass);
            }
        }
        let mut all = Vec::new();
        for pass in passes {
            let own: Vec<_> = self.ratios.iter().filter(|r| r.pass == pass).collect();
            let count = own.len() as f64;
            if own.len() < LEAST_CASES {
                continue;
            }
            let mean = |of: &dyn Fn(&Ratio) -> f64| own.iter().map(|r| of(r)).sum::<f64>() / count;
            let (old, new) = (mean(&|r| r.old), mean(&|r| r.new));
            let middle = mean(&|r| r.normalised.ln());
            // How far the cases lie apart tells how far their mean may lie from the truth.
            let squares = mean(&|r| (r.normalised.ln() - middle).powi(2));
            let error = (squares / (count - 1.0)).sqrt();
            let quiet = if old < SHORT {
                QUIET_SHORT_ALL
            } else {
                QUIET_ALL
            };
            all.push(Ratio {
                case: ALL.to_owned(),
                pass: pass.to_owned(),
                old,
                new,
                raw: mean(&|r| r.raw.ln()).exp(),
                normalised: middle.exp(),
                bound: f64::hypot(quiet.ln(), STANDARD_ERRORS_ALL * error).exp(),
                difference: new / yardstick.ratio - old,
            });
        }
        self.ratios.splice(0..0, all);
    }

    /// What became slower by more than noise explains.
    pub fn regressions(&self) -> Vec<&Ratio> {
        self.of(Verdict::Slower)
    }

    /// What became faster by more than noise explains.
    pub fn improvements(&self) -> Vec<&Ratio> {
        self.of(Verdict::Faster)
    }

    fn of(&self, verdict: Verdict) -> Vec<&Ratio> {
        self.ratios
            .iter()
            .filter(|ratio| ratio.verdict() == verdict)
            .collect()
    }

    /// The comparison as text, at most [`WIDTH`](super::table::WIDTH) columns wide: every
    /// frame, and what else is beyond its bound.
    pub fn table(&self) -> String {
        let mut lines = wrap("old        ", &self.old);
        lines.extend(wrap("new        ", &self.new));
        let yardstick = format!(
            "{:.2} (new / old: what a fetch costs; geometric mean of {})",
            self.yardstick,
            self.kinds.join(", ")
        );
        lines.extend(wrap("yardstick  ", &yardstick));
        lines.push(String::new());
        lines.push(row(
            "case",
            ["pass", "old ms", "new ms", "raw", "normalised", "bound", ""].map(str::to_owned),
        ));
        for ratio in &self.ratios {
            if ratio.pass == FRAME || ratio.case == ALL || ratio.verdict() != Verdict::Same {
                lines.extend(ratio.lines());
            }
        }
        lines.extend(wrap("", LEGEND));
        lines.push(String::new());
        for (cases, which) in [(&self.only_old, "old"), (&self.only_new, "new")] {
            if !cases.is_empty() {
                let head = format!("only in the {which} run: ");
                lines.extend(wrap(&head, &cases.join(", ")));
            }
        }
        for note in &self.notes {
            lines.extend(wrap("note: ", note));
        }
        lines.extend(wrap("", &self.summary()));
        lines.push(String::new());
        lines.join("\n")
    }

    /// The outcome in one line.
    pub fn summary(&self) -> String {
        let some = |count: usize, what: &str| match count {
            0 => format!("no {what}"),
            1 => format!("1 {what}"),
            _ => format!("{count} {what}s"),
        };
        let frame = self
            .ratios
            .iter()
            .find(|r| r.case == ALL && r.pass == FRAME);
        let sees = frame.map_or(String::new(), |frame| {
            format!(
                "; a frame slower by less than x{:.2} would not be seen",
                frame.bound
            )
        });
        format!(
            "{}, {} among {} compared{sees}",
            some(self.regressions().len(), "regression"),
            some(self.improvements().len(), "improvement"),
            some(self.ratios.len(), "time")
        )
    }
}

const LEGEND: &str = "normalised: the ratio over the yardstick, by which the machine itself was \
    slower. bound: what noise alone makes of it. Passes within their bounds are not listed.";

impl Ratio {
    fn new(
        [case, pass]: [&str; 2],
        old: Spread,
        new: Spread,
        yardstick: &Yardstick,
    ) -> Option<Ratio> {
        let raw = quotient(new.median, old.median)?;
        let restored = new.median / yardstick.ratio;
        let short = ![FRAME, WALL].contains(&pass) && old.median.min(restored) < SHORT;
        let quiet = if short { QUIET_SHORT } else { QUIET_FRAME };
        let squares =
            uncertainty(old).powi(2) + uncertainty(new).powi(2) + yardstick.uncertainty.powi(2);
        let noise = STANDARD_ERRORS * squares.sqrt();
        Some(Ratio {
            case: case.to_owned(),
            pass: pass.to_owned(),
            old: old.median,
            new: new.median,
            raw,
            normalised: raw / yardstick.ratio,
            bound: f64::hypot(quiet.ln(), noise).exp(),
            difference: restored - old.median,
        })
    }

    /// Whether the time changed: beyond the bound, and by a noticeable time.
    pub fn verdict(&self) -> Verdict {
        if self.normalised > self.bound && self.difference >= NOTICEABLE {
            Verdict::Slower
        } else if self.normalised < 1.0 / self.bound && self.difference <= -NOTICEABLE {
            Verdict::Faster
        } else {
            Verdict::Same
        }
    }

    fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        let mut name = self.case.as_str();
        if name.chars().count() > NAME {
            lines.extend(wrap("  ", name));
            name = "";
        }
        let verdict = match self.verdict() {
            Verdict::Same => "",
            Verdict::Slower => "SLOWER",
            Verdict::Faster => "faster",
        };
        lines.push(row(
            name,
            [
                self.pass.clone(),
                digits(self.old),
                digits(self.new),
                format!("{:.2}", self.raw),
                format!("{:.2}", self.normalised),
                format!("{:.2}", self.bound),
                verdict.to_owned(),
            ],
        ));
        lines
    }
}

/// Columns of a case's name. A longer one stands in a line of its own.
const NAME: usize = 36;

fn row(name: &str, [pass, old, new, raw, normalised, bound, verdict]: [String; 7]) -> String {
    let line = format!(
        "  {name:NAME$} {pass:9} {old:>8} {new:>8} {raw:>6} {normalised:>10} {bound:>6} {verdict}"
    );
    line.trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use super::super::example::{self, Numbers};
    use super::super::table::WIDTH;
    use super::*;

    /// A run on a machine `slower` times slower than the example's, whose pass `shade`
    /// takes `shade` times as long.
    fn changed(slower: f64, shade: f64) -> Run {
        let mut run = example::run();
        let scale = |spread: &mut Spread, factor: f64| {
            spread.median *= factor;
            spread.p5 *= factor;
            spread.p95 *= factor;
        };
        for cost in &mut run.costs {
            scale(&mut cost.nanoseconds, slower);
        }
        for case in &mut run.cases {
            let whole = case.device.median;
            let share = case.time("shade").expect("a pass").median / whole;
            for pass in &mut case.passes {
                let factor = if pass.pass == "shade" { shade } else { 1.0 };
                scale(&mut pass.time, slower * factor);
            }
            scale(&mut case.device, slower * (1.0 + share * (shade - 1.0)));
            scale(&mut case.wall, slower * (1.0 + share * (shade - 1.0)));
        }
        run
    }

    fn compared(old: &Run, new: &Run) -> Comparison {
        compare(old, new).expect("comparable")
    }

    #[test]
    fn a_run_equals_itself() {
        let run = example::run();
        let comparison = compared(&run, &run);
        let times: usize = run.cases.iter().map(|case| 2 + case.passes.len()).sum();
        // And of each pass, of the frame and of the wall that over all cases.
        let all = comparison.ratios.iter().filter(|r| r.case == ALL).count();
        assert_eq!(comparison.ratios.len(), times + all);
        assert!(all > 3, "{all}");
        assert_eq!(comparison.yardstick, 1.0);
        assert!(comparison.regressions().is_empty() && comparison.improvements().is_empty());
        assert!(
            comparison
                .ratios
                .iter()
                .all(|ratio| ratio.normalised == 1.0)
        );
        assert!(
            comparison
                .table()
                .contains("no regression, no improvement among")
        );
    }

    #[test]
    fn a_pass_twice_as_slow_is_named_with_its_case() {
        let (old, mut new) = (example::run(), example::run());
        new.cases[2] = changed(1.0, 2.0).cases[2].clone();
        let comparison = compared(&old, &new);
        let found: Vec<_> = comparison
            .regressions()
            .iter()
            .map(|ratio| (ratio.case.as_str(), ratio.pass.as_str()))
            .collect();
        let name = old.cases[2].name.as_str();
        assert_eq!(found, [(name, FRAME), (name, WALL), (name, "shade")]);
        let table = comparison.table();
        let line = table.lines().find(|line| line.ends_with("SLOWER"));
        assert!(line.expect("a line").contains(name), "{table}");
        assert!(
            table.contains("3 regressions, no improvement among"),
            "{table}"
        );
        assert!(table.lines().all(|line| line.chars().count() <= WIDTH));
        let back = compared(&new, &old);
        assert_eq!(
            (back.regressions().len(), back.improvements().len()),
            (0, 3)
        );
    }

    #[test]
    fn a_machine_slower_as_a_whole_is_no_regression() {
        let comparison = compared(&example::run(), &changed(1.6, 1.0));
        assert!((comparison.yardstick - 1.6).abs() < 1e-9);
        assert!(comparison.regressions().is_empty());
        assert!(
            comparison
                .ratios
                .iter()
                .all(|ratio| (ratio.raw - 1.6).abs() < 1e-9)
        );
        // The same times without slower fetches are one, and so is slower code on a machine
        // that got faster.
        let mut worse = changed(1.6, 1.0);
        worse.costs = example::run().costs;
        assert!(!compared(&example::run(), &worse).regressions().is_empty());
        let hidden = compared(&example::run(), &changed(0.5, 2.0));
        assert!(
            hidden
                .regressions()
                .iter()
                .any(|ratio| ratio.pass == "shade")
        );
    }

    #[test]
    fn a_difference_nobody_notices_is_none() {
        let (old, mut new) = (example::run(), example::run());
        let time = |run: &mut Run, median: f64| {
            let pass = &mut run.cases[0].passes[0];
            pass.time = Spread {
                median,
                p5: median,
                p95: median,
                count: 60,
            };
        };
        let mut old = old;
        for (before, after, found) in [
            (0.2, 0.6, 0),
            (0.2, 0.8, 1),
            // A case alone needs half as much again, be the pass short or long.
            (1.4, 2.0, 0),
            (1.4, 2.2, 1),
            (4.0, 5.9, 0),
            (4.0, 6.5, 1),
        ] {
            time(&mut old, before);
            time(&mut new, after);
            let regressions = compared(&old, &new).regressions().len();
            assert_eq!(regressions, found, "{before} to {after}");
        }
    }

    /// A run whose frames are drawn: a machine slower by `machine`, each case's level a bit
    /// off, disturbances that last ten frames, and noise of each frame.
    fn drawn(numbers: &mut Numbers, example: &Run, machine: f64, shade: f64) -> Run {
        let mut run = example.clone();
        let mut spread = |time: f64, count: u32| {
            let level = machine * (0.04 * numbers.normal()).exp();
            let mut burst = 0.0;
            let values = (0..count).map(|frame| {
                if frame % 10 == 0 {
                    burst = 0.1 * numbers.normal();
                }
                level * time * (burst + 0.1 * numbers.normal()).exp()
            });
            Spread::of(values.collect())
        };
        for cost in &mut run.costs {
            cost.nanoseconds = spread(cost.nanoseconds.median, 40);
        }
        for case in &mut run.cases {
            case.device = spread(case.device.median, 60);
            case.wall = spread(case.wall.median, 60);
            for pass in &mut case.passes {
                let factor = if pass.pass == "shade" { shade } else { 1.0 };
                pass.time = spread(pass.time.median * factor, 60);
            }
        }
        run
    }

    #[test]
    fn noise_is_no_regression_and_does_not_hide_one() {
        let mut example = example::run();
        example.cases.truncate(2);
        let mut numbers = Numbers(1);
        for draw in 0..1000 {
            let old = drawn(&mut numbers, &example, 1.0, 1.0);
            let machine = 0.7 + numbers.uniform();
            let new = drawn(&mut numbers, &example, machine, 1.0);
            let comparison = compared(&old, &new);
            let found = comparison.regressions();
            assert!(found.is_empty(), "draw {draw}: {found:?}");
        }
        // The bound is some 1.6 with such noise, and a ratio of 2.2 is off by 10 % at most.
        let mut seen = 0;
        for _ in 0..200 {
            let old = drawn(&mut numbers, &example, 1.0, 1.0);
            let new = drawn(&mut numbers, &example, 1.3, 2.2);
            let comparison = compared(&old, &new);
            let found = comparison.regressions();
            seen += found.iter().filter(|ratio| ratio.pass == "shade").count();
        }
        assert!(seen >= 380, "{seen} of 400");
    }

    #[test]
    fn runs_that_do_not_compare_say_why() {
        let run = example::run();
        let refused = |change: &dyn Fn(&mut Run)| {
            let mut other = run.clone();
            change(&mut other);
            let message = compare(&run, &other).expect_err("refused").to_string();
            assert!(!message.contains('\n') && message.starts_with("the baseline: "));
            message
        };
        let device = refused(&|run| run.header.device = "a GPU".to_owned());
        assert!(device.contains("this run on \"a GPU\""), "{device}");
        let validation = refused(&|run| run.header.validation = true);
        assert!(validation.contains("without validation layers, this run with"));
        assert!(refused(&|run| run.cases.clear()).contains("no case in common"));
        let resized = refused(&|run| run.cases.iter_mut().for_each(|case| case.size = [8, 8]));
        assert!(resized.contains("no case in common"));
        assert!(refused(&|run| run.costs.clear()).contains("no cost of a fetch in common"));
    }

    #[test]
    fn what_only_one_run_has_is_told() {
        let old = example::run();
        let mut new = old.clone();
        new.complete = false;
        new.cases.truncate(5);
        new.cases[0].name = "a new case".to_owned();
        new.cases[1].passes.remove(0);
        new.cases[2].fetches += 1;
        new.cases[3].size = [8, 8];
        new.costs.remove(0);
        let comparison = compared(&old, &new);
        assert_eq!(comparison.only_new, ["a new case"]);
        assert_eq!(comparison.only_old.len(), old.cases.len() - 4);
        assert_eq!(comparison.kinds.len(), old.costs.len() - 1);
        let table = comparison.table();
        for said in [
            "the new run is INCOMPLETE: it has 5 cases",
            "only the old run has the pass light",
            "32 fetches a pixel, now 33",
            "the size changed from 960x540 to 8x8",
            "only in the new run: a new case",
        ] {
            assert!(table.contains(said), "{said}\n{table}");
        }
        assert!(table.lines().all(|line| line.chars().count() <= WIDTH));
    }

    #[test]
    fn times_that_are_nothing_have_no_ratio() {
        let (old, mut new) = (example::run(), example::run());
        new.cases[0].passes[0].time = Spread::default();
        let comparison = compared(&old, &new);
        assert!(comparison.ratios.iter().all(|ratio| ratio.raw.is_finite()));
        assert_eq!(
            comparison.ratios.len() + 1,
            compared(&old, &old).ratios.len()
        );
    }
}
