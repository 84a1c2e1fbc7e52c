//! Device times of alternatives that do the same, measured in one run.

use std::sync::Arc;

use ash::vk;

use super::boxes_ways::{Chain, Way};
use super::fetches::Build;
use super::reduce::ReducePass;
use super::run::{Error, Options, open_device};
use super::targets::{LightMap, PyramidDesc};
use super::{record_halving, record_reduce};
use crate::gpu::{self, Device, Slot, Timestamps, Use, barrier};
use crate::scene::plan::LEVELS_MAX;

/// Rounds that do not count: drivers compile and allocate on first use.
const WARM_UP: u32 = 3;

/// Something to be timed: a name, and what records its work.
///
/// Its first and last barrier may be part of it; what it needs of others must be done before.
struct Timed<'a> {
    name: &'static str,
    record: Box<dyn Fn(vk::CommandBuffer) + 'a>,
}

/// The device times of one alternative.
#[derive(Clone, Debug, PartialEq)]
pub struct Times {
    /// Which alternative.
    pub name: &'static str,
    /// One for each round, ms.
    pub milliseconds: Vec<f64>,
}

/// What [`reduce`] has measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Reduce {
    /// Name of the device.
    pub device: String,
    /// Driver name and version.
    pub driver: String,
    /// Each alternative.
    pub times: Vec<Times>,
    /// Which alternatives are missing, and why.
    pub notes: Vec<String>,
    /// What the validation layer said.
    pub validation_messages: Vec<String>,
}

/// Name of the alternative that the others are compared with.
pub const BLIT: &str = "blit";

/// Measures the ways to reduce a light map of `side` texels a side, RGBA32F.
///
/// # Errors
/// [`Error::TooLarge`] before anything is allocated where the map cannot fit the device.
pub fn reduce(options: &Options, side: u32, rounds: u32) -> Result<Reduce, Error> {
    let device = open_device(options)?;
    let candidate = device.candidate();
    check_fit(options, &device, side)?;
    let base = base(side);
    let mut notes = Vec::new();
    let mut chains = Vec::new();
    for way in Way::ALL {
        let name = match way {
            Way::Levels => "levels",
            Way::Shared => "shared",
            Way::Blit => BLIT,
        };
        match Chain::new(&device, way, [side, side], &base) {
            Ok(chain) => chains.push((name, chain)),
            Err(gpu::Error::Unsupported(why)) => notes.push(format!("{name}: {why}")),
            Err(error) => return Err(error.into()),
        }
    }
    // What the mixture reads: down to one texel, but no further than it ever taps.
    let last = side.ilog2().min(LEVELS_MAX - 1);
    let pyramid = |first| {
        let desc = PyramidDesc {
            levels: first..=last,
            fourth: None,
        };
        let (moments, pyramid) = LightMap::with_levels(&device, [side, side], &desc)?;
        let pass = ReducePass::new(&device, &moments, &pyramid, Build::Plain)?;
        Ok::<_, gpu::Error>((moments, pyramid, pass))
    };
    let [from_0, from_1] = [pyramid(0)?, pyramid(1.min(last))?];
    let mut ways: Vec<_> = chains
        .iter()
        .map(|(name, chain)| Timed {
            name,
            record: Box::new(|commands| chain.record(commands)),
        })
        .collect();
    ways.push(Timed {
        name: "decimate",
        record: Box::new(|commands| {
            let (moments, pyramid, pass) = &from_0;
            let levels = pyramid.atlas.levels();
            record_halving(
                &device,
                commands,
                &[moments],
                levels,
                pass,
                None,
                Use::FRAGMENT_SAMPLE,
            );
            barrier::image(
                &device,
                commands,
                c"layout: the next round finds it as it was",
                moments,
                Use::COMPUTE_STORAGE,
                Use::FRAGMENT_SAMPLE,
            );
        }),
    });
    for (name, (moments, pyramid, pass)) in [
        ("decimate, smooth from 0", &from_0),
        ("decimate, smooth from 1", &from_1),
    ] {
        let device = &device;
        ways.push(Timed {
            name,
            record: Box::new(move |commands| {
                let state = [Use::FRAGMENT_SAMPLE; 2];
                record_reduce(device, commands, moments, pyramid, pass, None, state);
            }),
        });
    }
    let times = interleaved(&device, &ways, rounds)?;
    Ok(Reduce {
        device: candidate.name.clone(),
        driver: candidate.driver.clone(),
        times,
        notes,
        validation_messages: device.instance().take_messages(),
    })
}

/// Times each of `ways` in every round, in turn, so that what else the machine does meets all of
/// them alike. Each round starts with another one. The device is drained before every stamp.
fn interleaved(device: &Arc<Device>, ways: &[Timed<'_>], rounds: u32) -> Result<Vec<Times>, Error> {
    if device.candidate().timestamp_bits == 0 {
        return Err(Error::NoDevice(format!(
            "{} has no timestamps to measure by; choose another with --device",
            device.candidate().name
        )));
    }
    let stamps = Timestamps::new(device, "ways", ways.len() as u32)?;
    let mut slot = Slot::new(device, "ways")?;
    let mut times: Vec<_> = ways
        .iter()
        .map(|way| Times {
            name: way.name,
            milliseconds: Vec::with_capacity(rounds as usize),
        })
        .collect();
    for round in 0..WARM_UP + rounds {
        let commands = slot.begin()?;
        stamps.reset(commands);
        for k in 0..ways.len() {
            let at = (k + round as usize) % ways.len();
            barrier::drain_compute(device, commands);
            stamps.start(commands, at as u32);
            (ways[at].record)(commands);
            barrier::drain_compute(device, commands);
            stamps.end(commands, at as u32);
        }
        slot.submit()?;
        slot.wait()?;
        if round >= WARM_UP {
            for (at, times) in (0..).zip(&mut times) {
                times.milliseconds.extend(stamps.milliseconds(at));
            }
        }
    }
    Ok(times)
}

/// Texels such as a light map has: a disc of weights with their moments, and nothing around it.
fn base(side: u32) -> Vec<[f32; 4]> {
    let middle = 0.5 * side as f32;
    let texel = |k: u32| {
        let (x, y) = ((k % side) as f32 - middle, (k / side) as f32 - middle);
        let z = 1.0 - (x * x + y * y) / (middle * middle);
        if z > 0.0 {
            [0.9, 0.9 * z, 0.9 * z * z, 0.9 * z * z * z]
        } else {
            [0.0; 4]
        }
    };
    (0..side * side).map(texel).collect()
}

/// Refuses, before anything is allocated, what cannot fit.
fn check_fit(options: &Options, device: &Device, side: u32) -> Result<(), Error> {
    let candidate = device.candidate();
    let limit = candidate.limits.max_image_dimension2_d;
    if side > limit {
        return Err(Error::TooLarge(format!(
            "--light-map {side}: {} has images of at most {limit} texels a side; lower --light-map",
            candidate.name
        )));
    }
    // Each way has its base and a pyramid of a third of it, and the mixture twice three images of
    // at most twice the base; one staging copy at a time.
    let level_0 = 16 * u64::from(side).pow(2);
    let needed = Way::ALL.len() as u64 * level_0 * 4 / 3 + 13 * level_0;
    let memory = options
        .memory_limit
        .unwrap_or(u64::MAX)
        .min(candidate.memory);
    if needed > memory {
        return Err(Error::TooLarge(format!(
            "light map {side}: needs {} MiB, {} offers {} MiB; lower --light-map, or choose another \
             --device",
            needed.div_ceil(1 << 20),
            candidate.name,
            memory >> 20
        )));
    }
    Ok(())
}
