//! Fetch budgets: of the plans whose error was measured, the best that a number of fetches a pixel buys.
//!
//! The table is `plans.csv` beside this file, written by `marmor bench --pareto`; docs/budgets.md says how. Its errors
//! are means over scenes and materials, so they tell what to expect of a plan and not what it does to one picture. Its
//! fetches are those of one scene, to look at: what a plan costs *here* is counted anew, since how many levels a mixture
//! has depends on the material, the object and the light map.

use super::{Filter, declared, total};
use crate::optics::mixture::Fit;
use crate::scene::{
    Exits, Fourth, March, Method, Mixture, Multiple, Plan, Single, defaults, limits,
};

/// The table's text.
const PLANS: &str = include_str!("plans.csv");
/// The table's name in messages.
const NAME: &str = "src/ledger/plans.csv";

/// The table's columns, each a field of [`Row`].
pub const COLUMNS: [&str; 5] = ["multiple", "single", "expected_rr", "worst_rr", "fetches"];

/// By how much the error of a noisy plan counts for more than that of a smooth one: between two that are as good, the
/// one without noise is meant.
const NOISE: f64 = 1.05;

/// Why no plan was chosen. Each message is one line with its remedy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// The table is at fault.
    #[error("{NAME}:{line}: {problem}; write it anew with marmor bench --pareto")]
    Table {
        /// Counted from 1.
        line: u64,
        /// What is wrong there.
        problem: String,
    },
    /// Every plan makes more fetches.
    #[error(
        "a fetch budget of {budget} is too small for {scene}: the least that draws it is {least}, with {choice}; \
         give --fetch-budget {least}"
    )]
    TooSmall {
        /// What was given.
        budget: u32,
        /// The scene and its material.
        scene: String,
        /// The smallest budget that a plan fits.
        least: u32,
        /// That plan.
        choice: Choice,
    },
}

/// What a budget chooses: how both kinds of scattering are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    /// Multiple scattering.
    pub multiple: Multiple,
    /// Single scattering.
    pub single: Single,
}

/// A line of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// The plan.
    pub choice: Choice,
    /// Its error rr, as a mean over the scenes and materials that were measured.
    pub expected: f64,
    /// The largest of them.
    pub worst: f64,
    /// Its fetches a pixel on the bundled statue with every default.
    pub fetches: u32,
}

/// Why a plan was chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chosen {
    /// What it may fetch a pixel.
    pub budget: u32,
    /// What it fetches, as declared.
    pub fetches: u32,
    /// Its line of the table.
    pub row: Row,
}

impl Choice {
    /// Whether it shows noise in a single frame.
    pub fn noisy(&self) -> bool {
        matches!(self.multiple, Multiple::Samples(_))
    }

    /// Puts it in the place of `plan`'s methods, those of both halves.
    pub fn apply(&self, plan: &mut Plan) {
        plan.multiple = self.multiple;
        plan.split = None;
        plan.single = self.single;
    }

    /// Multiple scattering as flags after `--multiple`.
    pub fn multiple_flags(&self) -> String {
        match self.multiple {
            Multiple::None => "none".to_owned(),
            Multiple::Brdf => "brdf".to_owned(),
            Multiple::Exact => "exact".to_owned(),
            Multiple::Samples(count) => format!("samples --samples {count}"),
            Multiple::Rings(count) => format!("rings --rings {count}"),
            Multiple::Mixture(mixture) => {
                let mut text = "mixture".to_owned();
                let mut flag = |name: &str, value: &dyn std::fmt::Display| {
                    text.push_str(&format!(" --{name} {value}"));
                };
                match mixture.fourth {
                    Fourth::Never => flag("moments", &3),
                    Fourth::From(0) => flag("moments", &4),
                    Fourth::From(level) => {
                        flag("moments", &4);
                        flag("fourth-from", &level);
                    }
                    Fourth::Most(count) => {
                        flag("moments", &4);
                        flag("fourth-levels", &count);
                    }
                }
                if mixture.level_step != 1 {
                    flag("level-step", &mixture.level_step);
                }
                if mixture.volumes > 0 {
                    flag("volumes", &mixture.volumes);
                }
                if mixture.fit != Fit::Best {
                    flag("weights", &mixture.fit.name());
                }
                text
            }
        }
    }

    /// Single scattering as flags after `--single`.
    pub fn single_flags(&self) -> String {
        match self.single {
            Single::Off => "off".to_owned(),
            Single::Traced => "traced".to_owned(),
            Single::March(March { steps, exits }) => match exits {
                Exits::Linear => steps.to_string(),
                exits => format!("{steps} --exits {}", exits.name()),
            },
        }
    }

    /// Reads what [`Choice::multiple_flags`] and [`Choice::single_flags`] write.
    ///
    /// # Errors
    /// A phrase that names the word at fault.
    pub fn parse(multiple: &str, single: &str) -> Result<Choice, String> {
        Ok(Choice {
            multiple: parse_multiple(multiple)?,
            single: parse_single(single)?,
        })
    }
}

impl std::fmt::Display for Choice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "--multiple {}", self.multiple_flags())?;
        // What knows no transport has no single scattering to switch off.
        if self.multiple != Multiple::Brdf {
            write!(f, " --single {}", self.single_flags())?;
        }
        Ok(())
    }
}

impl Row {
    /// What rows are chosen by, the less the better: the expected error, and more where there is noise.
    pub fn rank(&self) -> f64 {
        self.expected * if self.choice.noisy() { NOISE } else { 1.0 }
    }
}

/// A flag without its dashes, and its value.
type Flag<'a> = (&'a str, &'a str);

/// The first word, and the flags after it.
fn words(text: &str) -> Result<(&str, Vec<Flag<'_>>), String> {
    let mut words = text.split_whitespace();
    let first = words.next().ok_or("nothing is named")?;
    let mut flags = Vec::new();
    while let Some(flag) = words.next() {
        let name = flag
            .strip_prefix("--")
            .ok_or_else(|| format!("\"{flag}\" is no flag"))?;
        let value = words.next().ok_or_else(|| format!("{flag} has no value"))?;
        flags.push((name, value));
    }
    Ok((first, flags))
}

fn whole(text: &str, check: fn(i64) -> Result<u32, String>) -> Result<u32, String> {
    let value = text
        .parse()
        .map_err(|_| format!("\"{text}\" is not a whole number"))?;
    check(value)
}

fn parse_multiple(text: &str) -> Result<Multiple, String> {
    let (name, flags) = words(text)?;
    let method = Method::named(name)?;
    let (mut samples, mut rings) = (defaults::SAMPLES, defaults::RINGS);
    let mut mixture = Mixture::THREE;
    for (flag, value) in flags {
        let known = |of| method == of;
        let result = match flag {
            "samples" if known(Method::Samples) => {
                whole(value, limits::samples).map(|n| samples = n)
            }
            "rings" if known(Method::Rings) => whole(value, limits::rings).map(|n| rings = n),
            "moments" if known(Method::Mixture) => whole(value, limits::moments).map(|n| {
                mixture.fourth = match n {
                    4 => Fourth::From(0),
                    _ => Fourth::Never,
                };
            }),
            "fourth-from" if mixture.fourth != Fourth::Never => {
                whole(value, limits::level).map(|n| mixture.fourth = Fourth::From(n))
            }
            "fourth-levels" if mixture.fourth != Fourth::Never => {
                whole(value, limits::fourth_levels).map(|n| mixture.fourth = Fourth::Most(n))
            }
            "level-step" if known(Method::Mixture) => {
                whole(value, limits::level_step).map(|n| mixture.level_step = n)
            }
            "volumes" if known(Method::Mixture) => {
                whole(value, limits::volumes).map(|n| mixture.volumes = n)
            }
            "weights" if known(Method::Mixture) => {
                Mixture::weights(value).map(|fit| mixture.fit = fit)
            }
            _ => Err(format!("no flag of {name}")),
        };
        result.map_err(|phrase| format!("--{flag} {value}: {phrase}"))?;
    }
    Ok(method.with(samples, rings, mixture))
}

fn parse_single(text: &str) -> Result<Single, String> {
    let (name, flags) = words(text)?;
    let mut single = match name {
        "off" => Single::Off,
        "traced" => Single::Traced,
        _ => Single::March(March {
            steps: whole(name, limits::steps)?,
            exits: Exits::Linear,
        }),
    };
    for (flag, value) in flags {
        match (&mut single, flag) {
            (Single::March(march), "exits") => march.exits = Exits::named(value)?,
            _ => return Err(format!("--{flag} {value}: no flag of --single {name}")),
        }
    }
    Ok(single)
}

/// The table, best plan first.
///
/// # Errors
/// [`Error::Table`], though not in a binary that passed its tests: they read it.
pub fn table() -> Result<Vec<Row>, Error> {
    parse(PLANS)
}

/// The table in `text`, best plan first.
///
/// # Errors
/// [`Error::Table`] with the line at fault.
pub fn parse(text: &str) -> Result<Vec<Row>, Error> {
    let fault = |line: u64, problem: String| Error::Table { line, problem };
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    // A position stands before the comments that the reader skips.
    let line_at = |position: Option<&csv::Position>| {
        let (line, byte) = position.map_or((1, 0), |p| (p.line(), p.byte() as usize));
        let skipped = text.get(byte..).unwrap_or_default().lines();
        line + skipped.take_while(|l| l.starts_with('#')).count() as u64
    };
    let line_of = |error: &csv::Error| line_at(error.position());
    let header = reader
        .headers()
        .map_err(|error| fault(line_of(&error), error.to_string()))?;
    if header != COLUMNS.as_slice() {
        let line = line_at(header.position());
        return Err(fault(
            line,
            format!("the columns must be {}", COLUMNS.join(",")),
        ));
    }
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| fault(line_of(&error), error.to_string()))?;
        let line = line_at(record.position());
        rows.push(row(&record).map_err(|problem| fault(line, problem))?);
    }
    if rows.is_empty() {
        return Err(fault(1, "there is no plan".to_owned()));
    }
    // Stable: of equals the first in the file stays first.
    rows.sort_by(|a, b| a.rank().total_cmp(&b.rank()));
    Ok(rows)
}

fn row(record: &csv::StringRecord) -> Result<Row, String> {
    let cell = |at: usize| record.get(at).unwrap_or_default();
    let error = |at: usize| {
        let value: f64 = cell(at).parse().unwrap_or(f64::NAN);
        if value.is_finite() && value >= 0.0 {
            Ok(value)
        } else {
            Err(format!(
                "{} must be 0 or greater, not \"{}\"",
                COLUMNS[at],
                cell(at)
            ))
        }
    };
    Ok(Row {
        choice: Choice::parse(cell(0), cell(1))?,
        expected: error(2)?,
        worst: error(3)?,
        fetches: whole(cell(4), limits::budget).map_err(|phrase| format!("fetches {phrase}"))?,
    })
}

/// Fetches a pixel of `plan`, drawn by other methods; counts each method for multiple scattering once.
pub struct Counter {
    plan: Plan,
    filter: Filter,
    known: Vec<(Multiple, u32)>,
}

impl Counter {
    /// Counts for `plan`'s scene, size, light map, reflection and frames, on a device that filters as `filter`.
    pub fn new(plan: &Plan, filter: Filter) -> Counter {
        Counter {
            plan: plan.clone(),
            filter,
            known: Vec::new(),
        }
    }

    /// Declared fetches of `choice`.
    pub fn fetches(&mut self, choice: Choice) -> u32 {
        let march = match choice.single {
            Single::March(march) if choice.multiple != Multiple::Brdf => march.steps,
            _ => 0,
        };
        if let Some((_, count)) = self.known.iter().find(|known| known.0 == choice.multiple) {
            return count + march;
        }
        let alone = Choice {
            single: Single::Off,
            ..choice
        };
        alone.apply(&mut self.plan);
        let count = total(&declared(&self.plan, self.filter));
        self.known.push((choice.multiple, count));
        count + march
    }
}

/// `plan` with the methods of the best of `rows`, best first as [`table`] has them, that makes at most `budget` fetches a
/// pixel, as declared for its scene on a device that filters as `filter`. A split goes.
///
/// # Errors
/// [`Error::TooSmall`] with the smallest budget that would do.
pub fn choose(
    rows: &[Row],
    plan: &Plan,
    budget: u32,
    filter: Filter,
) -> Result<(Plan, Chosen), Error> {
    let mut counter = Counter::new(plan, filter);
    let mut least: Option<(u32, Choice)> = None;
    for row in rows {
        let fetches = counter.fetches(row.choice);
        if fetches <= budget {
            let mut plan = plan.clone();
            row.choice.apply(&mut plan);
            trim(&mut plan);
            let chosen = Chosen {
                budget,
                fetches,
                row: *row,
            };
            return Ok((plan, chosen));
        }
        if least.is_none_or(|(known, _)| fetches < known) {
            least = Some((fetches, row.choice));
        }
    }
    match least {
        Some((least, choice)) => Err(Error::TooSmall {
            budget,
            scene: format!("{} in {}", plan.scene.name, plan.scene.material.name),
            least,
            choice,
        }),
        None => Err(Error::Table {
            line: 1,
            problem: "there is no plan".to_owned(),
        }),
    }
}

/// Names no more volumes than there are: nobody asked for those that are too large here.
fn trim(plan: &mut Plan) {
    if let Multiple::Mixture(mixture) = plan.multiple {
        let [_, _, volumes] = plan.taps(mixture, &plan.light_frame()).counts();
        plan.multiple = Multiple::Mixture(Mixture { volumes, ..mixture });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Request;

    #[test]
    fn the_table_is_whole() {
        let rows = table().expect("a table");
        assert!(rows.is_sorted_by(|a, b| a.rank() <= b.rank()));
        let statue = Request::statue().plan().expect("a plan");
        let mut counter = Counter::new(&statue, Filter::Linear);
        for row in &rows {
            let Row { choice, .. } = row;
            assert!(row.expected <= row.worst, "{choice}");
            assert_eq!(counter.fetches(*choice), row.fetches, "{choice}");
            assert!(choice.multiple != Multiple::Exact && choice.single != Single::Traced);
            let again = Choice::parse(&choice.multiple_flags(), &choice.single_flags());
            assert_eq!(again, Ok(*choice));
            let twice = rows.iter().filter(|other| other.choice == *choice);
            assert_eq!(twice.count(), 1, "{choice}");
        }
        // The file is by fetches; of plans that make as many the best comes first, so the front can be read off.
        let lines = PLANS.lines().filter(|line| !line.starts_with('#')).skip(1);
        let order: Vec<Row> = lines
            .map(|line| {
                let one = format!("{}\n{line}\n", COLUMNS.join(","));
                parse(&one).expect("a row")[0]
            })
            .collect();
        let key = |row: &Row| (row.fetches, (row.rank() * 1e6) as u64);
        assert!(order.is_sorted_by_key(key));
        assert_eq!(order.len(), rows.len());
        let mut front: Vec<Row> = Vec::new();
        for row in order {
            if front.last().is_none_or(|best| row.rank() < best.rank()) {
                front.push(row);
            }
        }
        assert!(front.is_sorted_by(|a, b| a.fetches < b.fetches && a.rank() > b.rank()));
        assert!(front.len() > 8 && front[0].fetches <= 4);
    }

    #[test]
    fn flags_are_read_as_they_are_written() {
        let march = |steps, exits| Single::March(March { steps, exits });
        let mixture = |fourth, level_step, volumes, fit| {
            Multiple::Mixture(Mixture {
                fourth,
                level_step,
                volumes,
                fit,
            })
        };
        for multiple in [
            Multiple::None,
            Multiple::Brdf,
            Multiple::Exact,
            Multiple::Samples(7),
            Multiple::Rings(3),
            mixture(Fourth::Never, 1, 0, Fit::Best),
            mixture(Fourth::Never, 2, 3, Fit::LeastSquares),
            mixture(Fourth::From(0), 1, 5, Fit::Best),
            mixture(Fourth::From(2), 1, 0, Fit::ClosedForm),
            mixture(Fourth::Most(3), 2, 1, Fit::Best),
        ] {
            for single in [
                Single::Off,
                Single::Traced,
                march(8, Exits::Linear),
                march(1, Exits::Nearest),
                march(64, Exits::Depth),
            ] {
                let choice = Choice { multiple, single };
                let read = Choice::parse(&choice.multiple_flags(), &choice.single_flags());
                assert_eq!(read, Ok(choice), "{choice}");
            }
        }
    }

    #[test]
    fn faults_name_their_line() {
        for (body, line, holds) in [
            ("# nothing\nmultiple,single\n", 2, "columns"),
            ("H\n", 1, "no plan"),
            ("H\nmixtur,off,0.1,0.2,3\n", 2, "mixture"),
            (
                "# a\nH\nbrdf,off,0.1,0.2,3\nsamples --rings 3,off,0.1,0.2,3\n",
                4,
                "--rings 3",
            ),
            (
                "H\nsamples --samples,off,0.1,0.2,3\n",
                2,
                "--samples has no value",
            ),
            ("H\nsamples 3,off,0.1,0.2,3\n", 2, "\"3\" is no flag"),
            ("H\nrings --rings 99,off,0.1,0.2,3\n", 2, "from 1 to 14"),
            (
                "H\nmixture --moments 3 --fourth-levels 2,off,0.1,0.2,3\n",
                2,
                "--fourth-levels 2",
            ),
            ("H\nnone,8 --exits near,0.1,0.2,3\n", 2, "nearest"),
            ("H\nnone,0,0.1,0.2,3\n", 2, "from 1 to 64"),
            ("H\nnone,off --exits depth,0.1,0.2,3\n", 2, "--exits depth"),
            ("H\nbrdf,off,nan,0.2,3\n", 2, "expected_rr"),
            ("H\nbrdf,off,0.1,-1,3\n", 2, "worst_rr"),
            ("H\nbrdf,off,0.1,0.2,\n", 2, "not a whole number"),
            ("H\nbrdf,off,0.1,0.2\n", 2, "4"),
        ] {
            let text = body.replace('H', &COLUMNS.join(","));
            let error = parse(&text).expect_err(body);
            assert!(
                matches!(error, Error::Table { line: at, .. } if at == line),
                "{error}"
            );
            let message = error.to_string();
            assert!(
                message.contains(holds) && message.contains("plans.csv"),
                "{message}"
            );
            assert!(!message.contains('\n'));
        }
    }

    /// Of two plans that are as good the one without noise is meant, though it be a little worse.
    #[test]
    fn noise_loses_near_ties() {
        let rows = |noisy: f64| {
            let lines = format!(
                "{}\nsamples --samples 4,off,{noisy},1,6\nmixture --moments 3,off,0.1,1,6\n",
                COLUMNS.join(",")
            );
            parse(&lines).expect("a table")
        };
        assert!(!rows(0.096)[0].choice.noisy());
        assert!(rows(0.094)[0].choice.noisy());
    }
}
