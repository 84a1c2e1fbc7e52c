//! Live display: a history that follows what moves, against the truth of each instant.

mod common;

use std::sync::Arc;

use common::device::{TestDevice, device, wide};
use glam::{DVec2, DVec3};
use marmor::cpu::resolve::{Live, resolve};
use marmor::frame::{Renderer, Setup, Shaders, Target, live_stages};
use marmor::ledger::{self, Filter, Ledger};
use marmor::scene::deformer::{Deformer, Kind};
use marmor::scene::{
    Bundled, Exits, Jitter, March, MeshSource, Method, Moment, Motion, Plan, Request, Scattering,
    Single,
};

const LIVE: Setup = Setup {
    keep_gbuffer: false,
    measure: false,
    filter: None,
    shaders: Shaders::Plain,
    live: true,
    reproject: true,
};
/// Light scattered once, by a march.
const STEPS: Single = Single::March(March {
    steps: 4,
    exits: Exits::Linear,
});
/// Frames after which a history is as good as it gets: a tenth of it is older than the last 22.
const WARM: u32 = 24;
/// Frames of the average that is taken for the truth.
const TRUTH: u32 = 64;

/// The statue, which the camera turns around `turns` times in 96 frames, and which bends if it `waves`.
fn moving(turns: f64, waves: bool, size: [u32; 2]) -> (Plan, Arc<Motion>) {
    let mut request = Request::of_mesh("test".to_owned(), MeshSource::Bundled(Bundled::Statue5k));
    request.size = size;
    request.light_map = 256;
    request.multiple = Method::Mixture;
    request.animation.fps = 24.0;
    request.animation.duration = Some(4.0);
    request.animation.camera_turns = turns;
    if waves {
        request.animation.deformers = vec![Deformer {
            kind: Kind::Bend,
            axis: DVec3::Y,
            towards: Some(DVec3::X),
            amplitude: 25.0,
            period: 2.0,
            phase: 0.0,
            wavelength: None,
        }];
    }
    let plan = request.plan().expect("a plan");
    let motion = plan.motion.clone().expect("a motion");
    (plan, motion)
}

fn moment(plan: &Plan, motion: &Arc<Motion>, number: u32) -> Moment {
    motion.moment(motion.time(number), plan.light_map)
}

fn renderer(device: &TestDevice, plan: &Plan, setup: &Setup) -> Renderer {
    Renderer::new(&device.device, plan, setup).expect("a renderer")
}

/// The average of `frames` jittered frames of one instant.
fn truth(device: &TestDevice, plan: &Plan, moment: Option<&Moment>, frames: u32) -> Vec<[f64; 4]> {
    let plan = Plan {
        frames_averaged: frames,
        jitter: Jitter::All,
        ..plan.clone()
    };
    let mut renderer = renderer(device, &plan, &Setup::default());
    moment.into_iter().for_each(|moment| renderer.show(moment));
    renderer.render(&mut |_| ()).expect("a picture");
    wide(&renderer.radiance().expect("radiance"))
}

/// Draws frames `numbers` live; returns the last.
fn drawn(
    renderer: &mut Renderer,
    plan: &Plan,
    motion: &Arc<Motion>,
    numbers: std::ops::RangeInclusive<u32>,
) -> Vec<[f64; 4]> {
    let last = *numbers.end();
    for number in numbers {
        renderer.show(&moment(plan, motion, number));
        renderer.draw_live(number, number == last).expect("a frame");
    }
    wide(&renderer.radiance().expect("radiance"))
}

/// Root of the mean squared difference over pixels that either covers, all four channels.
fn error(a: &[[f64; 4]], b: &[[f64; 4]]) -> f64 {
    error_where(a, b, |a, b| a[3] > 0.0 || b[3] > 0.0)
}

fn error_where(
    a: &[[f64; 4]],
    b: &[[f64; 4]],
    counts: impl Fn(&[f64; 4], &[f64; 4]) -> bool,
) -> f64 {
    let pairs: Vec<_> = a.iter().zip(b).filter(|(a, b)| counts(a, b)).collect();
    assert!(pairs.len() > 100, "{} pixels", pairs.len());
    let squares = pairs
        .iter()
        .map(|(a, b)| (0..4).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>());
    (squares.sum::<f64>() / (4.0 * pairs.len() as f64)).sqrt()
}

/// The motion of a pixel that sees a surface which rests, from its depth and both cameras, in f64.
fn motion_by_depth(
    of: &Renderer,
    index: u32,
    was: &Renderer,
    x: usize,
    y: usize,
    depth: f64,
) -> DVec2 {
    let xy = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
    let point = of.view(index).position(xy, depth);
    let pixel = |r: &Renderer| {
        let clip = r.view(0).view_proj * point.extend(1.0);
        let ndc = clip.truncate().truncate() / clip.w;
        ndc * 0.5
    };
    pixel(was) - pixel(of)
}

#[test]
fn motion_is_that_of_the_surface() {
    let Some(device) = device() else { return };
    let size = [160, 120];
    let (plan, motion) = moving(1.0, false, size);
    let mut live = renderer(&device, &plan, &LIVE);
    let mut was = renderer(&device, &plan, &Setup::default());
    drawn(&mut live, &plan, &motion, 20..=21);
    was.show(&moment(&plan, &motion, 20));
    let depth = live.read(Target::ViewDepth).expect("depth");
    let found = live.read(Target::Motion).expect("motion");
    let (mut worst, mut longest, mut seen) = (0.0_f64, 0.0_f64, 0);
    for (i, (depth, found)) in depth.iter().zip(&found).enumerate() {
        let found = DVec2::new(found[0].into(), found[1].into());
        if depth[0] == 1.0 {
            assert_eq!(found, DVec2::ZERO, "no surface moves");
            continue;
        }
        let [w, h] = size.map(|side| side as usize);
        let own = motion_by_depth(&live, 21, &was, i % w, i / w, depth[0].into());
        let own = own * DVec2::new(w as f64, h as f64);
        worst = worst.max(own.distance(found));
        longest = longest.max(own.length());
        seen += 1;
    }
    println!("motion: up to {longest:.2} px, {worst:.1e} off, {seen} pixels");
    assert!(seen > 1000 && longest > 1.0);
    assert!(worst < 1e-2, "{worst}");
}

/// The device joins frames as the twin does, each on the device's own inputs.
#[test]
fn history_is_that_of_the_twin() {
    let Some(device) = device() else { return };
    let size = [120, 96];
    let (plan, motion) = moving(1.0, true, size);
    let mut live = renderer(&device, &plan, &LIVE);
    let history = drawn(&mut live, &plan, &motion, 0..=9);
    for number in 10..13 {
        let history = if number == 10 {
            history.clone()
        } else {
            wide(&live.radiance().expect("radiance"))
        };
        let joined = drawn(&mut live, &plan, &motion, number..=number);
        let display = live.display().expect("display");
        let read = |live: &mut Renderer, target| wide(&live.read(target).expect("an image"));
        let radiance = read(&mut live, Target::Radiance);
        let depth: Vec<f64> = read(&mut live, Target::ViewDepth)
            .iter()
            .map(|d| d[0])
            .collect();
        let motions: Vec<[f64; 2]> = read(&mut live, Target::Motion)
            .iter()
            .map(|m| [m[0], m[1]])
            .collect();
        let twin = Live {
            size: size.map(|side| side as usize),
            radiance: &radiance,
            depth: &depth,
            motion: &motions,
            history: &history,
            done: number,
            exposure: plan.exposure,
        };
        let (mut worst, mut moved) = (0.0_f64, 0);
        for (i, found) in joined.iter().enumerate() {
            let own = twin.joined(i % size[0] as usize, i / size[0] as usize);
            worst = (0..4).fold(worst, |worst, c| worst.max((own[c] - found[c]).abs()));
            moved += usize::from((0..4).any(|c| (own[c] - radiance[i][c]).abs() > 1e-2));
            let shown = resolve(*found, plan.exposure, None);
            for c in 0..4 {
                assert!(
                    shown[c].abs_diff(display[i][c]) <= 1,
                    "{shown:?} {:?}",
                    display[i]
                );
            }
        }
        println!("twin: {worst:.1e} off, history changes {moved} pixels");
        assert!(moved > 200, "history must matter");
        // A bilinear tap has 8 bits of weight on many devices.
        assert!(worst < 2e-3, "{worst}");
    }
}

#[test]
fn a_still_scene_converges_and_does_not_drift() {
    let Some(device) = device() else { return };
    for (method, name) in [(Method::Mixture, "mixture"), (Method::Samples, "samples")] {
        let (mut plan, motion) = moving(1.0, false, [96, 72]);
        if method == Method::Samples {
            plan.multiple = marmor::scene::Multiple::Samples(16);
        }
        let at = moment(&plan, &motion, 40);
        let truth = truth(&device, &plan, Some(&at), 256);
        let mut live = renderer(&device, &plan, &LIVE);
        live.show(&at);
        // In the mean over single frames, after 64 and after 256.
        let mut single = 0.0;
        for index in 0..8 {
            live.forget_history();
            live.draw_live(index, true).expect("a frame");
            single += error(&wide(&live.radiance().expect("radiance")), &truth) / 8.0;
        }
        live.forget_history();
        let mut errors = Vec::new();
        for index in 0..256 {
            live.draw_live(index, index % 64 == 63).expect("a frame");
            if index % 64 == 63 {
                errors.push(error(&wide(&live.radiance().expect("radiance")), &truth));
            }
        }
        println!("{name}: single {single:.4}, after 64, 128, 192, 256 frames {errors:.4?}");
        // Frames without a pattern would gain sqrt(19) = 4.4 of a share of a tenth; the bound leaves what the clamp costs.
        for error in &errors {
            assert!(*error < single / 3.0, "{name}: {error} of {single}");
        }
        assert!(errors[3] < 1.3 * errors[0], "{name}: it drifts: {errors:?}");
    }
}

/// A camera that moves sideways by whole pixels of a surface far off: what is seen is the same picture, shifted.
#[test]
fn history_follows_what_moves() {
    let Some(device) = device() else { return };
    let size = [96, 72];
    let (mut panned, motion) = moving(1.0, false, size);
    panned.scene.camera = moment(&panned, &motion, 0).camera;
    for (name, turns, waves, gain) in [
        ("pan", 0.0, false, 2.0),
        ("turn", 0.2, false, 1.2),
        ("mesh", 0.0, true, 1.2),
    ] {
        let (plan, motion) = match name {
            "pan" => (panned.clone(), motion.clone()),
            _ => moving(turns, waves, size),
        };
        let number = 30;
        let shown = |at: u32| {
            let mut moment = moment(&plan, &motion, if name == "pan" { 0 } else { at });
            if name == "pan" {
                // Turned about its own place, so that there is no parallax: two pixels a frame at the middle.
                let camera = &mut moment.camera;
                let pixel = 2.0 * (0.5 * camera.fov.to_radians()).tan() / f64::from(size[1]);
                let forward = camera.target - camera.eye;
                let right = forward.normalize().cross(camera.up).normalize();
                let away = forward.length() * pixel * 2.0 * (f64::from(at) - f64::from(number));
                camera.target += right * away;
            }
            moment
        };
        let truth = truth(&device, &plan, Some(&shown(number)), TRUTH);
        let [with, without] = [true, false].map(|reproject| {
            let mut live = renderer(&device, &plan, &Setup { reproject, ..LIVE });
            for at in number - WARM..=number {
                live.show(&shown(at));
                live.draw_live(at, at == number).expect("a frame");
            }
            wide(&live.radiance().expect("radiance"))
        });
        // Where the surface stays in sight: inside.
        let inside = |a: &[[f64; 4]]| error_where(a, &truth, |_, t| t[3] > 0.999);
        println!(
            "{name}: with {:.4}, without {:.4}; all {:.4}, {:.4}",
            inside(&with),
            inside(&without),
            error(&with, &truth),
            error(&without, &truth)
        );
        assert!(gain * inside(&with) < inside(&without), "{name}");
        assert!(error(&with, &truth) < error(&without, &truth), "{name}");
    }
}

/// What an object leaves is background within a few frames, and nothing is ever not finite.
#[test]
fn what_has_moved_away_leaves_no_ghost() {
    let Some(device) = device() else { return };
    let size = [96, 72];
    let (plan, motion) = moving(1.0, false, size);
    for reproject in [true, false] {
        let mut live = renderer(&device, &plan, &Setup { reproject, ..LIVE });
        let before = drawn(&mut live, &plan, &motion, 0..=15);
        // A jump: the camera looks a quarter of the picture aside.
        let mut aside = moment(&plan, &motion, 16);
        let forward = aside.camera.target - aside.camera.eye;
        let right = forward.normalize().cross(aside.camera.up).normalize();
        aside.camera.target += right * forward.length() * 0.15;
        let truth = truth(&device, &plan, Some(&aside), TRUTH);
        // Beside the silhouette jittered frames cover a pixel now and then, and a history of it is borne out.
        let [w, h] = size.map(|side| side as usize);
        let beside = |i: usize| {
            let (x, y) = (i % w, i / w);
            let rows = y.saturating_sub(2)..(y + 3).min(h);
            rows.flat_map(|y| (x.saturating_sub(2)..(x + 3).min(w)).map(move |x| y * w + x))
                .any(|k| truth[k][3] > 0.0)
        };
        let left: Vec<usize> = (0..truth.len())
            .filter(|&i| before[i][3] > 0.9 && truth[i][3] == 0.0)
            .collect();
        let [away, edge]: [Vec<usize>; 2] =
            [false, true].map(|at| left.iter().copied().filter(|&i| beside(i) == at).collect());
        assert!(
            away.len() > 200 && edge.len() > 10,
            "{} {}",
            away.len(),
            edge.len()
        );
        let mut ghosts = Vec::new();
        live.show(&aside);
        for index in 16..32 {
            live.draw_live(index, true).expect("a frame");
            let picture = wide(&live.radiance().expect("radiance"));
            assert!(picture.iter().flatten().all(|x| x.is_finite()));
            let most = |of: &[usize]| of.iter().map(|&i| picture[i][3]).fold(0.0, f64::max);
            ghosts.push([most(&away), most(&edge)]);
        }
        println!("ghosts, away from the silhouette and beside it: {ghosts:.3?}");
        assert!(ghosts.iter().all(|ghost| ghost[0] < 0.02), "{ghosts:?}");
        // Beside it neighbours are covered, and what was there fades at the share of a still scene. A history that has not
        // followed the jump begins with ten times as much.
        let last = ghosts[ghosts.len() - 1][1];
        assert!(
            !reproject || (ghosts.iter().all(|ghost| ghost[1] < 0.12) && last < 0.02),
            "{ghosts:?}"
        );
    }
}

/// After the first frame nothing is allocated and no pipeline made.
#[test]
fn a_live_loop_makes_nothing() {
    let Some(device) = device() else { return };
    let (plan, motion) = moving(1.0, true, [48, 40]);
    let mut live = renderer(&device, &plan, &LIVE);
    drawn(&mut live, &plan, &motion, 0..=0);
    let (tally, bytes) = (device.device.tally(), device.device.bytes_in_use());
    for number in 1..20 {
        live.show(&moment(&plan, &motion, number / 2));
        if number == 9 {
            live.forget_history();
        }
        live.draw_live(number, number % 3 == 0).expect("a frame");
    }
    assert_eq!(device.device.tally(), tally, "allocations and pipelines");
    assert_eq!(device.device.bytes_in_use(), bytes);
}

/// Frames of a mesh that moves, in one submit, which the synchronisation checker sees together; and every way from
/// averaging to live display and back.
#[test]
fn live_frames_do_not_race_with_each_other() {
    let Some(device) = device() else { return };
    for (scattering, single) in [(Scattering::Full, Single::Off), (Scattering::Half, STEPS)] {
        let (mut plan, motion) = moving(1.0, true, [48, 40]);
        (plan.scattering, plan.single) = (scattering, single);
        let mut live = renderer(&device, &plan, &LIVE);
        let at = |number| moment(&plan, &motion, number);
        live.draw_live_pair([&at(0), &at(1)])
            .expect("the first two");
        live.draw_live_pair([&at(2), &at(3)]).expect("two more");
        live.draw_live(4, true).expect("a frame that is read");
        live.draw_live_pair([&at(3), &at(4)])
            .expect("two after that");
        live.render(&mut |_| ()).expect("an average");
        live.draw_live_pair([&at(4), &at(5)]).expect("two anew");
        live.draw_live(5, false).expect("a frame in flight");
        live.forget_history();
        live.draw_live(6, false).expect("a frame without history");
        live.render_pair().expect("an average");
    }
}

/// Averaging goes on as without live display, to the bit, whatever was drawn live before.
#[test]
fn averages_are_what_they_were() {
    let Some(device) = device() else { return };
    let (mut plan, motion) = moving(1.0, true, [64, 48]);
    plan.frames_averaged = 3;
    let pictures = [Setup::default(), LIVE].map(|setup| {
        let mut renderer = renderer(&device, &plan, &setup);
        if setup.live {
            drawn(&mut renderer, &plan, &motion, 2..=4);
        }
        renderer.show(&moment(&plan, &motion, 7));
        renderer.render(&mut |_| ()).expect("a picture");
        (
            renderer.radiance().expect("radiance"),
            renderer.display().expect("display"),
        )
    });
    assert!(pictures[0] == pictures[1]);
}

/// Live frames need a renderer that was made for them.
#[test]
fn others_refuse() {
    let Some(device) = device() else { return };
    let (plan, _) = moving(1.0, false, [48, 40]);
    let mut plain = renderer(&device, &plan, &Setup::default());
    let error = plain.draw_live(0, true).expect_err("no history");
    assert!(error.to_string().contains("live display"), "{error}");
}

/// What live display declares stands in the SPIR-V, and is measured.
#[test]
fn the_ledger_knows_live_frames() {
    let Some(device) = device() else { return };
    let (plan, motion) = moving(1.0, true, [64, 48]);
    for filter in [Filter::Linear, Filter::Texels] {
        let setup = Setup {
            shaders: Shaders::Counting,
            filter: Some(filter),
            ..LIVE
        };
        let mut live = renderer(&device, &plan, &setup);
        drawn(&mut live, &plan, &motion, 0..=3);
        let declared = ledger::declared_live(&plan, filter);
        let stages = live_stages(&plan, filter, Shaders::Counting);
        let counts = live.counts().expect("counts");
        let ledger = Ledger::new(&declared, &stages, &counts).expect("a ledger");
        assert_eq!(ledger.disagreements(), [""; 0], "{filter:?}");
        assert_eq!(ledger.found(), ledger.declared());
        let resolve = ledger
            .subtotals
            .iter()
            .find(|s| s.pass == "resolve")
            .expect("resolve");
        let measured = resolve.measured.expect("measured");
        println!(
            "{filter:?}: resolve declares {}, {measured:?}",
            resolve.declared
        );
        assert_eq!(
            resolve.declared,
            if filter == Filter::Linear { 24.0 } else { 39.0 }
        );
        assert_eq!(measured.most, resolve.declared);
        let plain = ledger::total(&ledger::declared(&plan, filter));
        assert_eq!(f64::from(plain) + resolve.declared - 1.0, ledger.declared());
    }
}

/// Not a test: what the page of the method shows.
#[test]
#[ignore = "prints the table of docs/methods/history.md"]
fn table() {
    let Some(device) = device() else { return };
    for size in [[200, 150], [480, 360]] {
        for (name, turns, waves) in [
            ("still", 0.0, true),
            ("slowly turning camera", 0.2, false),
            ("turning camera", 1.0, false),
            ("moving mesh", 0.0, true),
            ("both", 1.0, true),
        ] {
            let (plan, motion) = moving(turns, waves, size);
            let mut rows = [[0.0; 3]; 2];
            let numbers = [30, 50];
            for number in numbers {
                let truth = truth(&device, &plan, Some(&moment(&plan, &motion, number)), 128);
                for (k, (reproject, warm)) in [(true, 0), (false, WARM), (true, WARM)]
                    .into_iter()
                    .enumerate()
                {
                    let setup = Setup { reproject, ..LIVE };
                    let mut live = renderer(&device, &plan, &setup);
                    // Single frames are of four jitters.
                    let tries: u32 = if warm == 0 { 4 } else { 1 };
                    for t in 0..tries {
                        live.forget_history();
                        for at in number - warm..=number {
                            live.show(&moment(
                                &plan,
                                &motion,
                                if name == "still" { number } else { at },
                            ));
                            live.draw_live(at + 7 * t, at == number).expect("a frame");
                        }
                        let picture = wide(&live.radiance().expect("radiance"));
                        let share = 1.0 / f64::from(tries * numbers.len() as u32);
                        rows[0][k] += share * error(&picture, &truth);
                        rows[1][k] += share * error_where(&picture, &truth, |_, t| t[3] > 0.999);
                    }
                }
            }
            println!(
                "{size:?} {name}: all {:.4?}, inside {:.4?}",
                rows[0], rows[1]
            );
        }
    }
}
