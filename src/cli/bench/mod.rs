//! `marmor bench`: how long a frame takes, pass by pass, over a matrix of cases.

mod matrix;
mod reduce;

use super::failure::Failure;
use super::{Global, pareto, print, values};
use crate::cpu::traced;
use crate::frame;
use crate::frame::cases::{Frames, Session};
use crate::ledger::{Filter, budget};
use crate::report::bench::{
    self, COVERED_PIXELS, Case, Cost, FETCHES, FORMAT, FRAME, Fit, Header, LIGHT_MAP_TEXELS, Run,
    Spread, TRIANGLES, baseline,
};
use crate::report::{Image, Output, compare, image};
use crate::scene::{Jitter, Method, Plan, Request, Scattering, Single};
use clap::{Args, Subcommand};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use matrix::Desc;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::SystemTime;

/// Measure frames pass by pass, over methods, sizes and meshes
///
/// Device times by timestamps, the device drained around each, and wall times by fence. A time alone means little on a
/// shared machine: what one fetch of each kind costs is measured in the same run, and of every pass its multiple of what
/// its fetches alone take. --baseline compares with an earlier run on that footing.
///
/// Ctrl-C ends the run early; what was measured is written, marked incomplete.
#[derive(Args, Debug)]
#[command(
    args_conflicts_with_subcommands = true,
    after_long_help = "\
Examples:
  marmor bench --quick
  marmor bench --html bench.html --json bench.json
  marmor bench --quick --json new.json --baseline old.json
  marmor bench reduce"
)]
pub(super) struct Arguments {
    #[command(subcommand)]
    what: Option<What>,

    /// Scene files, meshes or bundled meshes, as of 'marmor render' [default: statue]
    #[arg(value_name = "SCENE")]
    scenes: Vec<PathBuf>,

    /// Measure the error of every plan that --fetch-budget may choose, and write the table to this file
    ///
    /// The one that ships is src/ledger/plans.csv. Takes some 10 minutes on two cores.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["scenes", "quick", "frames", "only", "list", "json", "csv", "html", "baseline"])]
    pareto: Option<PathBuf>,

    /// A small matrix, small pictures and few frames: under a minute on two cores
    #[arg(long)]
    quick: bool,

    /// Frames measured of each case, from 1 to 10000 [default: 24, with --quick 8]
    #[arg(long, value_name = "N", value_parser = values::rounds, allow_hyphen_values = true)]
    frames: Option<u32>,

    /// Only cases whose name contains this; --list names them
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,

    /// List the cases, and measure nothing
    #[arg(long)]
    list: bool,

    /// Write the run as JSON
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    json: Option<PathBuf>,

    /// Write a row for each pass of each case
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    csv: Option<PathBuf>,

    /// Write a report with plots and pictures, in one file
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    html: Option<PathBuf>,

    /// An earlier run (JSON) to compare with; exit with 1 where a pass has become slower than noise explains
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    baseline: Option<PathBuf>,
}

#[derive(Subcommand, Debug)]
enum What {
    Reduce(reduce::Arguments),
}

pub(super) fn run(global: &Global, arguments: &Arguments) -> Result<(), Failure> {
    if let Some(What::Reduce(arguments)) = &arguments.what {
        return reduce::run(global, arguments);
    }
    if let Some(out) = &arguments.pareto {
        return pareto::run(global, out);
    }
    let outputs = [&arguments.json, &arguments.csv, &arguments.html]
        .map(|path| path.as_deref().map(Output::check).transpose());
    let [json, csv, html] = outputs;
    let (json, csv, html) = (json?, csv?, html?);
    let named: Vec<_> = [&json, &csv, &html].into_iter().flatten().collect();
    for (at, output) in named.iter().enumerate() {
        if named[..at].iter().any(|other| other.is(output)) {
            return Err(Failure::Input(format!(
                "{}: two outputs name the same file; give them different names",
                output.path().display()
            )));
        }
    }
    let baseline = arguments.baseline.as_deref().map(Run::read).transpose()?;
    let cases = cases(arguments)?;
    if arguments.list {
        let lines: Vec<_> = cases
            .iter()
            .map(|case| format!("{}\n", case.name))
            .collect();
        return print(&lines.concat());
    }
    let stop = stop_on_interrupt()?;
    let stopped = || stop.load(Ordering::Relaxed);

    let planned = cases.len();
    let measured = measure(global, arguments, baseline.as_ref(), cases, &stopped)?;
    if let Some(output) = &json {
        measured.write(output)?;
    }
    if let Some(output) = &csv {
        measured.write_csv(output)?;
    }
    if let Some(output) = &html {
        measured.write_html(output)?;
    }
    print(&measured.table())?;
    if !measured.complete {
        return Err(Failure::Check(format!(
            "interrupted after {} of {planned} cases; what was measured is marked incomplete",
            measured.cases.len()
        )));
    }
    let Some(old) = baseline else {
        return Ok(());
    };
    let comparison = bench::compare(&old, &measured)?;
    print(&format!("\n{}", comparison.table()))?;
    match comparison.regressions().as_slice() {
        [] => Ok(()),
        found => Err(Failure::Check(format!(
            "slower than the baseline beyond noise: {}",
            found
                .iter()
                .map(|ratio| format!("{}, {} ({:.2})", ratio.case, ratio.pass, ratio.normalised))
                .collect::<Vec<_>>()
                .join("; ")
        ))),
    }
}

/// The cases that are asked for.
fn cases(arguments: &Arguments) -> Result<Vec<Desc>, Failure> {
    let scenes = match arguments.scenes.as_slice() {
        [] => &[PathBuf::from("statue")][..],
        scenes => scenes,
    };
    let mut cases = Vec::new();
    for (at, scene) in scenes.iter().enumerate() {
        if scenes[..at].contains(scene) {
            return Err(Failure::Input(format!(
                "{}: named twice; name each scene once",
                scene.display()
            )));
        }
        let request = Request::open(scene)?;
        // A scene that cannot be drawn is refused before the others are measured.
        request.plan()?;
        cases.extend(matrix::cases(&request, arguments.quick, scenes.len() > 1));
    }
    if let Some(only) = &arguments.only {
        cases.retain(|case| case.name.contains(only.as_str()));
        if cases.is_empty() {
            return Err(Failure::Input(format!(
                "--only {only}: no case has that in its name; see 'marmor bench --list'"
            )));
        }
    }
    Ok(cases)
}

/// A flag that Ctrl-C sets; a second one ends the process.
fn stop_on_interrupt() -> Result<Arc<AtomicBool>, Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    })
    .map_err(|error| Failure::Input(format!("Ctrl-C cannot be caught ({error})")))?;
    Ok(stop)
}

fn measure(
    global: &Global,
    arguments: &Arguments,
    baseline: Option<&Run>,
    cases: Vec<Desc>,
    stop: &dyn Fn() -> bool,
) -> Result<Run, Failure> {
    let options = global.options();
    let date = humantime::format_rfc3339_seconds(SystemTime::now()).to_string();
    let frames = arguments
        .frames
        .unwrap_or(if arguments.quick { 8 } else { 24 });
    let bar = bar(global.quiet, cases.len());
    let mut session = Session::open(&options)?;
    let header = header(global, &session, date);
    if let Some(old) = baseline {
        // Before anything is measured for nothing.
        baseline::check(&old.header, &header)?;
    }
    let mut references = HashMap::new();
    let mut run = Run {
        format: FORMAT,
        header,
        complete: true,
        frames,
        costs: Vec::new(),
        cases: Vec::new(),
        fits: Vec::new(),
        notes: Vec::new(),
    };
    for desc in cases {
        bar.set_message(desc.name.clone());
        let plan = plan(&desc.request, session.filter())?;
        let measured = match session.measure(&options, &plan, frames, desc.rests, stop) {
            Ok(Some(measured)) => measured,
            Ok(None) => {
                run.complete = false;
                break;
            }
            // A device too small for one case may do for the others.
            Err(frame::Error::TooLarge(phrase)) => {
                run.notes.push(format!("{}: left out: {phrase}", desc.name));
                bar.inc(1);
                continue;
            }
            Err(error) => return Err(error.into()),
        };
        let error = match desc.error {
            Some(size) => {
                let filter = session.filter();
                Some(error(global, &desc.request, filter, size, &mut references)?)
            }
            None => None,
        };
        run.cases.push(case(&desc, &plan, measured, error)?);
        bar.inc(1);
        if stop() {
            run.complete = false;
            break;
        }
    }
    bar.finish_and_clear();
    run.costs = session
        .costs()
        .into_iter()
        .map(|cost| Cost {
            kind: cost.access.kind().to_owned(),
            format: cost.access.format().to_owned(),
            nanoseconds: Spread::of(cost.nanoseconds),
            bytes: cost.access.bytes(),
        })
        .collect();
    // Of several scenes a line through all would say nothing of any.
    if arguments.scenes.len() < 2 {
        run.fits = fits(&run.cases);
    }
    run.notes.push(
        "the floor of shade is measured: a build of it that reads the same textures as often, and does no more; other \
         floors are fetches times their price"
            .to_owned(),
    );
    for message in session.messages() {
        tracing::error!("validation: {message}");
        run.notes.push(format!("validation: {message}"));
    }
    Ok(run)
}

fn bar(quiet: bool, cases: usize) -> ProgressBar {
    let bar = ProgressBar::hidden();
    // The template is constant and a test parses it; a plain bar is the fallback.
    if let Ok(style) = ProgressStyle::with_template(TEMPLATE) {
        bar.set_style(style);
    }
    bar.set_length(cases as u64);
    if !quiet {
        // Draws nothing where stderr is no terminal.
        bar.set_draw_target(ProgressDrawTarget::stderr());
    }
    bar
}

const TEMPLATE: &str = "{bar:30} {pos}/{len} cases, {eta} left  {msg}";

fn header(global: &Global, session: &Session, date: String) -> Header {
    let [device, driver] = session.names();
    let words: Vec<_> = std::env::args_os()
        .skip(1)
        .map(|word| word.to_string_lossy().into_owned())
        .collect();
    let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpu
        .lines()
        .find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    Header {
        marmor: env!("CARGO_PKG_VERSION").to_owned(),
        commit: option_env!("MARMOR_COMMIT").map(str::to_owned),
        date,
        command: format!("marmor {}", words.join(" ")),
        device,
        driver,
        cpu: model
            .map_or(std::env::consts::ARCH, |(_, name)| name.trim())
            .to_owned(),
        cores: std::thread::available_parallelism().map_or(1, |n| n.get() as u32),
        validation: global.validation,
    }
}

fn case(desc: &Desc, plan: &Plan, measured: Frames, error: Option<f64>) -> Result<Case, Failure> {
    let picture = ["methods", "budgets"]
        .contains(&desc.group)
        .then(|| image::encode_png(plan.size, &measured.display))
        .transpose()?;
    Ok(Case {
        name: desc.name.clone(),
        group: desc.group.to_owned(),
        scene: plan.scene.name.clone(),
        triangles: plan.scene.mesh.triangles.len() as u64,
        size: plan.size,
        light_map: plan.light_map,
        multiple: plan.method_name(),
        single: plan.single.to_string(),
        light_rests: desc.rests,
        budget: desc.request.fetch_budget,
        fetches: measured.fetches,
        covered: measured.covered,
        error,
        wall: Spread::of(measured.wall),
        device: Spread::of(measured.device),
        passes: measured
            .passes
            .into_iter()
            .map(|pass| bench::Pass {
                pass: pass.pass,
                time: Spread::of(pass.milliseconds),
                fetches: pass.fetches,
                bytes: pass.bytes,
                floor: pass.floor,
                invocations: pass.invocations,
            })
            .collect(),
        picture,
    })
}

/// The plan of a request; where it has a budget, the best that keeps to it.
fn plan(request: &Request, filter: Filter) -> Result<Plan, Failure> {
    let plan = request.plan()?;
    match request.fetch_budget {
        None => Ok(plan),
        Some(fetches) => Ok(budget::choose(&budget::table()?, &plan, fetches, filter)?.0),
    }
}

/// rr of scattering alone, one frame, in a picture of `size`, against the sum over the light map and cast rays.
fn error(
    global: &Global,
    request: &Request,
    filter: Filter,
    size: [u32; 2],
    references: &mut HashMap<String, Image>,
) -> Result<f64, Failure> {
    let small = Request {
        size,
        specular: false,
        jitter: Jitter::Off,
        frames_averaged: Some(1),
        ..request.clone()
    };
    let draw = |plan: &Plan| -> Result<Image, Failure> {
        let mut picture = frame::render(&global.options(), plan, &mut |_| ())?;
        if plan.single == Single::Traced {
            let term = traced::picture(plan, &|| ());
            for (pixel, term) in picture.radiance.iter_mut().zip(term) {
                if pixel[3] > 0.0 {
                    (0..3).for_each(|c| pixel[c] += term[c]);
                }
            }
        }
        Ok(Image {
            name: plan.scene.name.clone(),
            size,
            pixels: picture.radiance,
            has_alpha: true,
            encoded: false,
        })
    };
    let reference = match references.entry(request.name.clone()) {
        Entry::Occupied(known) => known.into_mut(),
        Entry::Vacant(place) => {
            let truth = Request {
                multiple: Method::Exact,
                scattering: Scattering::Full,
                single: Single::Traced,
                split: None,
                fetch_budget: None,
                ..small.clone()
            };
            place.insert(draw(&truth.plan()?)?)
        }
    };
    let image = draw(&plan(&small, filter)?)?;
    Ok(compare(reference, &image)?.rr)
}

/// How times grow over the sweeps.
fn fits(cases: &[Case]) -> Vec<Fit> {
    let mut fits = Vec::new();
    for (group, x) in [
        ("pixels", COVERED_PIXELS),
        ("fetches", FETCHES),
        ("light map", LIGHT_MAP_TEXELS),
        ("triangles", TRIANGLES),
    ] {
        let of_group: Vec<_> = cases.iter().filter(|case| case.group == group).collect();
        let by = |case: &Case| match group {
            "fetches" => case.family().to_owned(),
            _ => case.label(),
        };
        let mut methods: Vec<String> = of_group.iter().map(|case| by(case)).collect();
        methods.dedup();
        for method in methods {
            let own = || of_group.iter().filter(|case| by(case) == method).copied();
            for pass in ["shade", FRAME] {
                let points = Fit::points(own(), x, pass);
                fits.extend(match group {
                    "triangles" => Fit::power(group, &method, x, pass, &points),
                    _ => Fit::linear(group, &method, x, pass, &points),
                });
            }
        }
    }
    fits
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_template_parses() {
        assert!(indicatif::ProgressStyle::with_template(super::TEMPLATE).is_ok());
    }
}
