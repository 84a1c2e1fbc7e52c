//! The three accounts of the ledger agree: what a plan declares, what stands in the SPIR-V, and what a counting build
//! measures.

mod common;

use common::device::{TestDevice, device};
use marmor::frame::{Renderer, Setup, Shaders, shaders, stages, window_stages};
use marmor::gpu::Shader;
use marmor::ledger::spirv::{Kind, sites};
use marmor::ledger::{self, Counts, Filter, Ledger, budget, declared};
use marmor::scene::{
    Bundled, Exits, March, MeshSource, Method, Mixture, Multiple, Plan, Request, Scattering, Single,
};
use rspirv::dr::{Loader, Operand};
use rspirv::spirv::{Op, StorageClass, Word};
use std::collections::HashMap;

/// Plans of every method, with and without single scattering, as requests on the statue.
fn requests() -> Vec<Request> {
    let march = |steps, exits| Single::March(March { steps, exits });
    let singles = [
        Single::Off,
        march(1, Exits::Linear),
        march(8, Exits::Linear),
        march(5, Exits::Nearest),
        march(64, Exits::Depth),
    ];
    let base = Request::statue;
    let mut methods = Vec::new();
    for multiple in [Method::None, Method::Brdf] {
        methods.push(Request { multiple, ..base() });
    }
    for samples in [1, 7, 30, 256] {
        methods.push(Request {
            multiple: Method::Samples,
            samples,
            ..base()
        });
    }
    for rings in [1, 2, 8, 14] {
        methods.push(Request {
            multiple: Method::Rings,
            rings,
            ..base()
        });
    }
    for (moments, fourth_from, fourth_levels, level_step, volumes) in [
        (3, 0, None, 1, 0),
        (3, 0, None, 2, 0),
        (3, 0, None, 1, 1),
        (3, 0, None, 1, 5),
        (4, 0, None, 1, 0),
        (4, 2, None, 1, 0),
        (4, 0, Some(3), 1, 0),
        (4, 0, Some(9), 2, 0),
        (4, 0, Some(1), 1, 2),
        (4, 0, None, 1, 4),
    ] {
        methods.push(Request {
            multiple: Method::Mixture,
            moments,
            fourth_from,
            fourth_levels,
            level_step,
            volumes,
            ..base()
        });
    }
    for (multiple, moments, volumes) in [
        (Method::None, 3, 0),
        (Method::Samples, 3, 0),
        (Method::Rings, 3, 0),
        (Method::Mixture, 3, 0),
        (Method::Mixture, 4, 3),
    ] {
        methods.push(Request {
            multiple,
            moments,
            volumes,
            scattering: Scattering::Half,
            ..base()
        });
    }
    methods.push(Request {
        multiple: Method::Exact,
        light_map: 300,
        ..base()
    });
    let mut all = Vec::new();
    for (at, method) in methods.into_iter().enumerate() {
        for (k, single) in singles.into_iter().enumerate() {
            // Nothing to shade at half size.
            let shades = single != Single::Off || method.multiple != Method::None;
            if method.scattering == Scattering::Half && !shades {
                continue;
            }
            // What does not change the reads of scattering need not meet every other choice.
            let exits = match single {
                Single::March(march) => march.exits,
                _ => Exits::Linear,
            };
            all.push(Request {
                single,
                exits,
                specular: (at + k) % 2 == 0,
                frames_averaged: Some(1 + (at + k) as u32 % 3 % 2),
                ..method.clone()
            });
        }
    }
    all
}

#[test]
fn what_is_declared_stands_in_the_spirv() {
    let mut totals = Vec::new();
    for request in requests() {
        let plan = request.plan().expect("a plan");
        for filter in [Filter::Linear, Filter::Texels] {
            let stages = stages(&plan, filter, Shaders::Plain);
            let ledger = Ledger::new(&declared(&plan, filter), &stages, &[]).expect("a ledger");
            let name = format!("{}, {}, {filter:?}", plan.method_name(), plan.single);
            assert_eq!(ledger.disagreements(), [""; 0], "{name}");
            // The floor that times are compared with reads exactly that.
            let floor = marmor::frame::stages(&plan, filter, Shaders::Floor);
            let floor = Ledger::new(&declared(&plan, filter), &floor, &[]).expect("a ledger");
            assert_eq!(floor.disagreements(), [""; 0], "{name}, floor");
            assert_eq!(
                ledger.declared(),
                f64::from(ledger::total(&declared(&plan, filter)))
            );
            assert_eq!(ledger.found(), ledger.declared(), "{name}");
            totals.push(ledger.declared());
        }
    }
    totals.sort_by(f64::total_cmp);
    totals.dedup();
    assert!(
        totals.len() > 40,
        "plans must differ in what they read: {totals:?}"
    );
}

#[test]
fn a_window_reads_what_it_declares() {
    let (declared, stages) = (ledger::declared_window(), window_stages());
    let found = Ledger::new(&declared, &stages, &[]).expect("sites");
    assert_eq!(found.disagreements(), Vec::<String>::new());
    assert_eq!(found.subtotals.len(), 2);
}

#[test]
fn a_site_says_where_it_stands() {
    let plan = Request {
        multiple: Method::Mixture,
        ..Request::statue()
    };
    let plan = plan.plan().expect("a plan");
    let stages = stages(&plan, Filter::Linear, Shaders::Plain);
    let shade = stages.iter().find(|s| s.pass == "shade").expect("shading");
    let sites = sites(&shade.words, &shade.constants, &shade.given).expect("sites");
    let tap = sites
        .iter()
        .find(|s| s.texture == "smoothed")
        .expect("a tap");
    assert_eq!(tap.kind, Kind::Sample);
    assert_eq!(
        (tap.place.file.as_str(), tap.function.as_str()),
        ("mixture.glsl", "tap_three")
    );
    let source = include_str!("../shaders/mixture.glsl");
    let line = |of: u32| source.lines().nth(of as usize - 1).expect("a line");
    assert!(line(tap.place.line).contains("FETCH_LINEAR(smoothed"));
    let [around] = tap.loops.as_slice() else {
        panic!("one loop, not {:?}", tap.loops);
    };
    assert!(line(around.line).contains("for (int i = 0; i < FINE; ++i)"));
    assert_eq!(tap.trips, u64::from(shade.constants[1]));
    let march = sites
        .iter()
        .find(|s| s.texture == "exits")
        .expect("the march");
    assert_eq!((march.trips, march.function.as_str()), (8, "above"));
}

/// A loop whose trips only the device knows must not be guessed.
#[test]
fn trips_that_nobody_tells_are_an_error() {
    let words = shaders::EXACT_COMP.words();
    let error = sites(&words, &[], &[]).expect_err("exact takes its rows from the host");
    let (file, rest) = error.split_once(':').expect("a place");
    let line: usize = rest
        .split(':')
        .next()
        .expect("a line")
        .parse()
        .expect("a number");
    assert_eq!(file, "exact.comp");
    let source = include_str!("../shaders/exact.comp");
    let text = source.lines().nth(line - 1).expect("a line");
    assert!(text.contains("for (int j"), "{text}");
    let found = sites(&words, &[], &[7, 11]).expect("sites");
    let texels = found
        .iter()
        .find(|s| s.texture == "moments")
        .expect("texels");
    assert_eq!(texels.trips, 77);
}

#[test]
fn geometry_reads_no_texture() {
    for shader in [
        shaders::LIGHT_VERT,
        shaders::LIGHT_FRAG,
        shaders::LIGHT_FRAG_FOURTH,
        shaders::VIEW_VERT,
        shaders::VIEW_FRAG,
        shaders::SHADE_VERT,
        shaders::VOLUME_HALVE_COMP,
        shaders::VOLUME_BLUR_COMP,
    ] {
        assert_eq!(
            sites(&shader.words(), &[], &[]),
            Ok(Vec::new()),
            "{}",
            shader.name
        );
    }
}

/// Some of these plans, every method among them, small enough to be counted pixel by pixel; with MARMOR_LEDGER_ALL set,
/// as scripts/soak.sh does, all of them.
fn small_plans() -> Vec<Plan> {
    let small = |request: Request| {
        let request = Request {
            mesh: MeshSource::Bundled(Bundled::Statue1k),
            size: [64, 48],
            // `exact` in more than one band.
            light_map: if request.multiple == Method::Exact {
                250
            } else {
                64
            },
            ..request
        };
        request.plan().expect("a plan")
    };
    let all = std::env::var_os("MARMOR_LEDGER_ALL").is_some();
    let requests = requests();
    let exact = requests.iter().rev().cloned();
    let half = requests.iter().rev().cloned();
    let half = half.filter(|request| request.scattering == Scattering::Half);
    let others = requests.iter().step_by(if all { 1 } else { 7 }).cloned();
    others
        .chain(exact.take(if all { 0 } else { 1 }))
        .chain(half.take(if all { 0 } else { 9 }).step_by(4))
        .map(small)
        .collect()
}

/// Renders `plan` and returns radiance and counts.
fn counted(device: &TestDevice, plan: &Plan, setup: &Setup) -> (Vec<[f32; 4]>, Vec<Counts>) {
    let mut renderer = Renderer::new(&device.device, plan, setup).expect("a renderer");
    renderer.render(&mut |_| ()).expect("a picture");
    let radiance = renderer.radiance().expect("its radiance");
    (radiance, renderer.counts().expect("its counts"))
}

#[test]
fn what_is_declared_is_measured() {
    let Some(device) = device() else {
        return;
    };
    let mut last = None;
    for plan in small_plans() {
        for filter in [Filter::Linear, Filter::Texels] {
            // One way of filtering is enough for what does not filter.
            let filters = matches!(plan.multiple, Multiple::Mixture(_) | Multiple::Rings(_));
            if filter == Filter::Texels && !filters {
                continue;
            }
            let name = format!("{}, {}, {filter:?}", plan.method_name(), plan.single);
            let setup = |shaders| Setup {
                filter: Some(filter),
                shaders,
                ..Setup::default()
            };
            let (plain, none) = counted(&device, &plan, &setup(Shaders::Plain));
            let (radiance, counts) = counted(&device, &plan, &setup(Shaders::Counting));
            assert!(none.is_empty());
            // Same bits: what counts must not change what it counts.
            let bits = |picture: &[[f32; 4]]| -> Vec<[u32; 4]> {
                picture.iter().map(|p| p.map(f32::to_bits)).collect()
            };
            assert!(
                bits(&plain) == bits(&radiance),
                "{name}: the counting build draws another picture"
            );
            let stages = stages(&plan, filter, Shaders::Counting);
            let ledger = Ledger::new(&declared(&plan, filter), &stages, &counts).expect("a ledger");
            assert_eq!(ledger.disagreements(), [""; 0], "{name}");
            assert!(
                ledger
                    .subtotals
                    .iter()
                    .all(|s| s.measured.is_some() || s.term == ledger::BUFFER),
                "{name}"
            );
            assert_eq!(
                ledger.most().map(f64::from),
                Some(ledger.declared()),
                "{name}"
            );
            // Where nothing is covered only resolve reads, and `exact`, once in each band, to find that out.
            let covered = radiance.iter().filter(|p| p[3] > 0.0).count();
            assert!(
                covered > 100 && covered < radiance.len() / 2,
                "{name}: {covered}"
            );
            let resolve = plan.frames_averaged.min(2);
            let bands = match plan.multiple {
                Multiple::Exact => ledger::exact_bands(plan.light_map),
                _ => 0,
            };
            let half = plan.scattering == Scattering::Half;
            for (n, pixel) in ledger.pixels.iter().zip(&radiance) {
                // A pixel of half size that is covered may lie over one that is not.
                let alone = pixel[3] == 0.0 && !half;
                assert!(!alone || *n == resolve + bands, "{name}: {n}");
            }
            last = Some(ledger);
        }
    }
    assert!(last.is_some());
}

/// What a budget has chosen is measured to keep it.
#[test]
fn a_budget_is_measured() {
    let Some(device) = device() else {
        return;
    };
    let rows = budget::table().expect("the table");
    for (wanted, filter) in [
        (6, Filter::Linear),
        (17, Filter::Linear),
        (30, Filter::Texels),
    ] {
        let request = Request {
            mesh: MeshSource::Bundled(Bundled::Statue1k),
            size: [64, 48],
            light_map: 128,
            ..Request::statue()
        };
        let plan = request.plan().expect("a plan");
        let (plan, chosen) = budget::choose(&rows, &plan, wanted, filter).expect("a choice");
        let setup = Setup {
            filter: Some(filter),
            shaders: Shaders::Counting,
            ..Setup::default()
        };
        let (_, counts) = counted(&device, &plan, &setup);
        let stages = stages(&plan, filter, Shaders::Counting);
        let ledger = Ledger::new(&declared(&plan, filter), &stages, &counts).expect("a ledger");
        assert_eq!(ledger.disagreements(), [""; 0], "{wanted}");
        assert_eq!(ledger.most(), Some(chosen.fetches), "{wanted}");
        assert!(ledger.breaks(wanted).is_none(), "{wanted}");
    }
}

/// A read that nobody declared is caught twice.
#[test]
fn a_stray_read_is_caught() {
    let Some(device) = device() else {
        return;
    };
    let plans = small_plans().into_iter();
    let mut plain = plans.filter(|p| p.multiple == Multiple::Exact);
    let plan = Plan {
        multiple: Multiple::Mixture(Mixture::THREE),
        single: Single::Off,
        frames_averaged: 1,
        light_map: 64,
        ..plain.next().expect("a plan")
    };
    let declared = declared(&plan, Filter::Linear);
    let setup = Setup {
        shaders: Shaders::Stray,
        filter: Some(Filter::Linear),
        ..Setup::default()
    };
    let (_, counts) = counted(&device, &plan, &setup);
    let stray = stages(&plan, Filter::Linear, Shaders::Stray);
    let ledger = Ledger::new(&declared, &stray, &counts).expect("a ledger");
    let lines = ledger.disagreements();
    let found = lines.iter().any(|l| {
        l.starts_with("shade.frag, multiple: 0 reads of moments declared, 1 found in the SPIR-V at shade.frag:")
    });
    assert!(found, "{lines:?}");
    // It stands after the terms of scattering.
    let measured = lines.iter().any(|l| l.contains("measured"));
    assert!(measured, "{lines:?}");
    assert_eq!(ledger.found(), ledger.declared() + 1.0);
    assert_eq!(ledger.most().map(f64::from), Some(ledger.declared() + 1.0));
    // Without it all is well.
    let clean = stages(&plan, Filter::Linear, Shaders::Counting);
    let ledger = Ledger::new(&declared, &clean, &[]).expect("a ledger");
    assert_eq!(ledger.disagreements(), [""; 0]);
}

/// Loads of floats from storage buffers that stand in a shader, all loops unrolled.
fn loads(shader: &Shader) -> u32 {
    let mut loader = Loader::new();
    rspirv::binary::parse_words(shader.words(), &mut loader).expect("SPIR-V");
    let module = loader.module();
    let of_buffers: HashMap<Word, ()> = module
        .types_global_values
        .iter()
        .filter(|i| i.class.opcode == Op::TypePointer)
        .filter(|i| {
            i.operands
                .contains(&Operand::StorageClass(StorageClass::StorageBuffer))
        })
        .filter_map(|i| Some((i.result_id?, ())))
        .collect();
    let mut pointers = HashMap::new();
    let mut found = 0;
    for i in module.all_inst_iter() {
        match (i.class.opcode, i.result_id, i.result_type) {
            (Op::AccessChain, Some(id), Some(kind)) if of_buffers.contains_key(&kind) => {
                pointers.insert(id, ());
            }
            (Op::Load, ..) => {
                let from = i.operands.first();
                let counts = matches!(from, Some(Operand::IdRef(id)) if pointers.contains_key(id));
                found += u32::from(counts);
            }
            _ => {}
        }
    }
    found
}

/// What the volumes read of buffers is declared, though it is no fetch.
#[test]
fn volumes_declare_what_they_read_of_buffers() {
    let request = Request {
        multiple: Method::Mixture,
        volumes: 5,
        ..Request::statue()
    };
    let plan = request.plan().expect("a plan");
    let Multiple::Mixture(mixture) = plan.multiple else {
        panic!("another method");
    };
    let lines = declared(&plan, Filter::Linear);
    let lines = lines.iter().filter(|l| l.term == ledger::BUFFER);
    let declared: Vec<u32> = lines.map(|l| l.per_pixel).collect();
    // Of eight cells 6x6x6 halved ones, and 8 + 2 radius along an axis.
    assert_eq!(loads(&shaders::VOLUME_HALVE_COMP), 216);
    let taps = plan.taps(mixture, &plan.light_frame());
    let volumes = taps.volumes.expect("volumes");
    let radius = volumes.volumes.iter().map(|v| v.weights.len() as u32 - 1);
    let blur = (8 + 2 * radius.max().unwrap_or(0)).div_ceil(8);
    assert_eq!(declared, [216 / 8, 3 * blur]);
    // Every texel that may lie within a cell of a column is read.
    let reach = volumes.grids[0].reach();
    assert!((2.0 / volumes.grids[0].scale) < f64::from(reach));
}
