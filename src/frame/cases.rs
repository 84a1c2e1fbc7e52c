//! Whole frames, measured: device time of each pass, wall time, and what their fetches alone take.

use std::sync::Arc;

use super::probe::{FetchCost, Probe};
use super::run::{Error, Options, check_fit, open_device};
use super::{Renderer, SHADE_PASS, Setup, Shaders, filter_of};
use crate::gpu::Device;
use crate::ledger::{self, Declared, Filter, HALF_SHADE, HALF_SHARE, INPUT, TEXEL};
use crate::scene::pyramid::Atlas;
use crate::scene::{Multiple, Plan};

/// Frames that do not count: drivers compile and allocate on first use.
const WARM_UP: u32 = 2;

/// How many frames of the shading are measured for one of its reads alone? That is steady, and only a yardstick.
const FRAMES_A_FLOOR: u32 = 2;

/// Rounds of the probe that are measured before the first case, and after each: the machine's speed drifts, and the
/// yardstick must have seen it all.
const ROUNDS: u32 = 3;

/// A device that is measured.
pub struct Session {
    device: Arc<Device>,
    probe: Probe,
}

/// What was measured of one plan.
#[derive(Clone, Debug)]
pub struct Frames {
    /// Of each frame, from recording it to its fence, ms.
    pub wall: Vec<f64>,
    /// Of each frame, the sum of its passes on the device, ms.
    pub device: Vec<f64>,
    /// Each pass that ran.
    pub passes: Vec<Pass>,
    /// Share of the pixels that the object covers.
    pub covered: f64,
    /// Declared fetches of a pixel.
    pub fetches: u32,
    /// The last frame for display: sRGB, straight alpha, row-major.
    pub display: Vec<[u8; 4]>,
    /// Its linear radiance.
    pub radiance: Vec<[f32; 4]>,
}

/// What was measured of one pass.
#[derive(Clone, Debug)]
pub struct Pass {
    /// Its name.
    pub pass: String,
    /// Of each frame, ms.
    pub milliseconds: Vec<f64>,
    /// Fetches of a frame.
    pub fetches: f64,
    /// What these fetches touch.
    pub bytes: f64,
    /// What they alone take, ms: of the passes that shade measured by a build of it that only reads; of others by the
    /// probe's price of each.
    pub floor: Option<f64>,
    /// Invocations of fragment shaders in a frame, where the device counts them.
    pub invocations: Option<u64>,
}

impl Session {
    /// Opens the device that `options` ask for, and measures its fetches for the first time.
    ///
    /// # Errors
    /// [`Error::NoDevice`] where there is none, or none that has a clock.
    pub fn open(options: &Options) -> Result<Session, Error> {
        let device = open_device(options)?;
        let candidate = device.candidate();
        if candidate.timestamp_bits == 0 {
            return Err(Error::NoDevice(format!(
                "{} has no timestamps to measure by; choose another with --device",
                candidate.name
            )));
        }
        let mut probe = Probe::new(&device, filter_of(candidate))?;
        for round in 0..WARM_UP + ROUNDS {
            probe.round(round >= WARM_UP)?;
        }
        Ok(Session { device, probe })
    }

    /// Name of the device, and its driver's name and version.
    pub fn names(&self) -> [String; 2] {
        let candidate = self.device.candidate();
        [candidate.name.clone(), candidate.driver.clone()]
    }

    /// How the device filters.
    pub fn filter(&self) -> ledger::Filter {
        filter_of(self.device.candidate())
    }

    /// What fetches have cost so far.
    pub fn costs(&self) -> Vec<FetchCost> {
        self.probe.costs()
    }

    /// What the validation layer said.
    pub fn messages(&self) -> Vec<String> {
        self.device.instance().take_messages()
    }

    /// Measures `frames` frames of `plan`, each on its own; with `rests` they share one light map. None where `stop`
    /// came true meanwhile.
    ///
    /// # Errors
    /// [`Error::TooLarge`] where the plan cannot fit the device.
    pub fn measure(
        &mut self,
        options: &Options,
        plan: &Plan,
        frames: u32,
        rests: bool,
        stop: &dyn Fn() -> bool,
    ) -> Result<Option<Frames>, Error> {
        check_fit(options, plan, self.device.candidate(), false)?;
        let setup = |shaders| Setup {
            measure: true,
            shaders,
            ..Setup::default()
        };
        let mut renderer = Renderer::new(&self.device, plan, &setup(Shaders::Plain))?;
        let mut reads = Renderer::new(&self.device, plan, &setup(Shaders::Floor))?;
        renderer.redraw_light = !rests;
        let mut wall = Vec::new();
        let mut device = Vec::new();
        let mut floor = [SHADE_PASS, HALF_SHADE].map(|pass| (pass, Vec::new()));
        let mut passes = Vec::<(String, Vec<f64>)>::new();
        for frame in 0..WARM_UP + frames {
            if stop() {
                return Ok(None);
            }
            let counts = frame >= WARM_UP;
            // In turn, so that what else the machine does meets both alike.
            if !counts || frame % FRAMES_A_FLOOR == 0 {
                reads.render_frames(frame..frame + 1, &mut |_| ())?;
                if counts {
                    let times = reads.pass_times();
                    for (pass, all) in &mut floor {
                        let shade = times.iter().find(|time| time.pass == *pass);
                        all.extend(shade.map(|time| time.milliseconds));
                    }
                }
            }
            let took = renderer.render_frames(frame..frame + 1, &mut |_| ())?;
            if !counts {
                continue;
            }
            wall.push(1e3 * took.as_secs_f64());
            let times = renderer.pass_times();
            device.push(times.iter().map(|time| time.milliseconds).sum());
            for time in times {
                match passes.iter_mut().find(|(pass, _)| *pass == time.pass) {
                    Some((_, all)) => all.push(time.milliseconds),
                    None => passes.push((time.pass, vec![time.milliseconds])),
                }
            }
        }
        for _ in 0..ROUNDS {
            self.probe.round(true)?;
        }
        let radiance = renderer.radiance()?;
        let covered = radiance.iter().filter(|p| p[3] > 0.0).count();
        let declared = ledger::declared(plan, self.filter());
        let floor = floor.map(|(pass, all)| (pass, median(all)));
        let costs = self.probe.costs();
        let fetched = Fetched {
            plan,
            declared: &declared,
            filter: self.filter(),
            covered: covered as f64,
            costs: &costs,
        };
        let passes = passes
            .into_iter()
            .map(|(pass, milliseconds)| {
                let mut of_pass = fetched.reads(&pass);
                if let Some((_, floor)) = floor.iter().find(|(of, _)| *of == pass) {
                    of_pass.floor = *floor;
                }
                Pass {
                    invocations: renderer.invocations(&pass),
                    pass,
                    milliseconds,
                    ..of_pass
                }
            })
            .collect();
        Ok(Some(Frames {
            wall,
            device,
            passes,
            covered: covered as f64 / radiance.len().max(1) as f64,
            fetches: ledger::total(&declared),
            display: renderer.display()?,
            radiance,
        }))
    }
}

/// What a frame reads, and what that costs.
pub struct Fetched<'a> {
    /// The plan that it draws.
    pub plan: &'a Plan,
    /// What the plan declares on a device that filters as `filter`.
    pub declared: &'a [Declared],
    /// How the device filters.
    pub filter: Filter,
    /// Pixels that it covers.
    pub covered: f64,
    /// The prices that a probe has found.
    pub costs: &'a [FetchCost],
}

impl Fetched<'_> {
    /// What the fetches of `pass` alone take, ms; none of a pass that reads nothing that has a price.
    pub fn floor(&self, pass: &str) -> Option<f64> {
        self.reads(pass).floor
    }

    /// What `pass` reads, and what that takes.
    fn reads(&self, pass: &str) -> Pass {
        let &Fetched {
            plan,
            declared,
            filter,
            covered,
            costs,
        } = self;
        let [width, height] = plan.size.map(f64::from);
        let mut sum = Pass {
            pass: String::new(),
            milliseconds: Vec::new(),
            fetches: 0.0,
            bytes: 0.0,
            floor: None,
            invocations: None,
        };
        for line in declared {
            if line.pass != pass || line.term == INPUT {
                continue;
            }
            let Some(access) = line.access(filter) else {
                continue;
            };
            let times = match (line.term, pass) {
                (TEXEL, _) => texels(plan, line),
                (_, "resolve") => width * height,
                // As many as its pixels lie over, but for edges.
                (_, HALF_SHADE) => covered / f64::from(HALF_SHARE),
                _ => covered,
            };
            let fetches = f64::from(line.per_pixel) * times;
            sum.fetches += fetches;
            sum.bytes += fetches * f64::from(access.bytes() * access.texels());
            let cost = costs.iter().find(|cost| cost.access == access);
            // The rounds before this case and after it: the machine as it was meanwhile.
            let cost = cost.and_then(|cost| {
                let last = cost.nanoseconds.iter().rev().take(2 * ROUNDS as usize);
                median(last.copied().collect())
            });
            if let Some(cost) = cost {
                *sum.floor.get_or_insert(0.0) += 1e-6 * fetches * cost;
            }
        }
        sum
    }
}

/// The middle of `values`, or the mean of the two in the middle; none of none.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let upper = values.get(values.len() / 2)?;
    let lower = values.get((values.len() - 1) / 2)?;
    Some(0.5 * (lower + upper))
}

/// Texels for which a frame of `plan` reads what `line` declares.
fn texels(plan: &Plan, line: &Declared) -> f64 {
    let shader = line.shader;
    let area = |size: [u32; 2]| f64::from(size[0]) * f64::from(size[1]);
    let frame = plan.light_frame();
    let mut sum = 0.0;
    for method in plan.methods() {
        match method {
            Multiple::Rings(_) if shader == "boxes.comp" => {
                let levels = plan.light_map.ilog2();
                sum += (1..=levels)
                    .map(|l| area([plan.light_map >> l; 2]))
                    .sum::<f64>();
            }
            Multiple::Mixture(mixture) => {
                let taps = plan.taps(mixture, &frame);
                let last = taps.level(taps.moments() - 1);
                let atlas = Atlas::new([plan.light_map; 2], last + 1);
                let levels = |range: std::ops::RangeInclusive<u32>| -> f64 {
                    range.map(|level| area(atlas.content(level).size)).sum()
                };
                sum += match shader {
                    "decimate.comp" => levels(1..=last),
                    "smooth.comp" if line.texture == "source_fourth" => {
                        levels(taps.span(taps.fourth.clone()))
                    }
                    "smooth.comp" => levels(taps.span(0..taps.moments())),
                    "volume.comp" => taps.volumes.map_or(0.0, |volumes| {
                        let [x, y, _] = volumes.grids[0].size;
                        area([x, y])
                    }),
                    _ => 0.0,
                };
            }
            _ => {}
        }
    }
    sum
}
