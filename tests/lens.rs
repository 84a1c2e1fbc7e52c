//! The error of a part of a picture is that of the whole there, and what measures it can be stopped.

mod common;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use common::device::{TestDevice, device, render};
use marmor::frame::{Options, Renderer, Setup, Target};
use marmor::gpu;
use marmor::report::Image;
use marmor::report::compare::compare;
use marmor::scene::{Bundled, Jitter, MeshSource, Method, Multiple, Plan, Request, Scattering};
use marmor::view::lens::{Lens, Moments, Offer, shown};
use marmor::view::region::{self, Fault};
use marmor::view::worker::{Job, Report, Worker};

/// Longer than a loaded machine takes.
const PATIENCE: Duration = Duration::from_secs(60);

fn plan(method: Method, size: [u32; 2]) -> Plan {
    let mut request = Request::of_mesh("test".to_owned(), MeshSource::Bundled(Bundled::Statue5k));
    (request.size, request.light_map) = (size, 64);
    (request.multiple, request.volumes) = (method, 2);
    request.plan().expect("a plan")
}

fn exact(plan: &Plan) -> Plan {
    Plan {
        multiple: Multiple::Exact,
        scattering: Scattering::Full,
        jitter: Jitter::Off,
        frames_averaged: 1,
        ..plan.clone()
    }
}

/// Pixels `place` of a picture `columns` wide.
fn cut(pixels: &[[f32; 4]], columns: u32, [x, y, width, height]: [u32; 4]) -> Vec<[f32; 4]> {
    let rows = pixels.chunks_exact(columns as usize);
    let rows = rows.skip(y as usize).take(height as usize);
    rows.flat_map(|row| &row[x as usize..(x + width) as usize])
        .copied()
        .collect()
}

fn image(name: &str, size: [u32; 2], pixels: Vec<[f32; 4]>) -> Image {
    Image {
        name: name.to_owned(),
        size,
        pixels,
        has_alpha: true,
        encoded: false,
    }
}

#[test]
fn a_part_of_an_exact_picture_is_the_whole_there() {
    let Some(device) = device() else { return };
    let whole = exact(&plan(Method::Samples, [48, 36]));
    let drawn = render(&device, &whole);
    for place in [[0, 0, 48, 36], [11, 5, 23, 27], [30, 20, 1, 1]] {
        let part = render(&device, &whole.part_of(place));
        let expected = cut(&drawn, 48, place);
        assert_eq!(part.len(), expected.len());
        let covered = expected.iter().filter(|pixel| pixel[3] > 0.0).count();
        assert!(covered * 6 > expected.len(), "{place:?}: {covered} covered");
        let largest = expected.iter().flatten().fold(0.0_f32, |a, &b| a.max(b));
        for (at, (found, expected)) in part.iter().zip(&expected).enumerate() {
            for (a, b) in found.iter().zip(expected) {
                // Rounding may put a vertex on the next of the rasteriser's 256 steps a pixel, over which radiance changes
                // by two hundredths here.
                assert!(
                    (a - b).abs() < 1e-4 * largest,
                    "{place:?}, pixel {at}: {found:?} is not {expected:?}"
                );
            }
        }
    }
}

/// The error over `place` as the worker measures it, and that of two whole pictures there.
fn errors(device: &TestDevice, plan: &Plan, place: [u32; 4], frames: u32) -> [f64; 2] {
    let options = Options::default();
    let stop = Arc::new(AtomicBool::new(false));
    let mut shares = Vec::new();
    let on = (&options, &device.device);
    let mut progress = |share| shares.push(share);
    let region = region::measure(on, plan, place, frames, &stop, &mut progress).expect("an error");
    assert!(shares.is_sorted() && shares.last() == Some(&1.0));
    assert_eq!((region.place, &region.method), (place, &plan.method_name()));
    let of_pixels = region.errors.iter().flatten().map(|error| error * error);
    let covered = region.errors.iter().flatten().count() as f64;
    assert!(((of_pixels.sum::<f64>() / covered).sqrt() - region.rr).abs() < 1e-9);
    let method = Plan {
        jitter: Jitter::Samples,
        frames_averaged: frames,
        ..plan.clone()
    };
    let [_, _, width, height] = place;
    let [exact, method] = [exact(plan), method].map(|plan| {
        let drawn = render(device, &plan);
        image("whole", [width, height], cut(&drawn, plan.size[0], place))
    });
    let whole = compare(&exact, &method).expect("comparable").rr;
    [region.rr, whole]
}

#[test]
fn the_error_of_a_region_is_that_of_whole_pictures_there() {
    let Some(device) = device() else { return };
    // Wider than a tile of noise, so that a part that begins elsewhere would have other samples.
    let place = [70, 31, 24, 18];
    let size = [144, 72];
    let mut half = plan(Method::Samples, size);
    half.scattering = Scattering::Half;
    let samples = plan(Method::Samples, size);
    let cases = [
        (samples, 3),
        (half, 2),
        (plan(Method::Mixture, size), 2),
        (plan(Method::Brdf, size), 1),
    ];
    for (plan, frames) in cases {
        let [region, whole] = errors(&device, &plan, place, frames);
        assert!(region > 0.0);
        assert!(
            (region - whole).abs() < 1e-3 * whole,
            "{}: {region} is not {whole}",
            plan.method_name()
        );
    }
}

#[test]
fn exact_stops_between_two_submits_and_goes_on_anew() {
    let Some(device) = device() else { return };
    let plan = exact(&plan(Method::Samples, [48, 36]));
    let mut renderer = Renderer::new(&device.device, &plan, &Setup::default()).expect("a renderer");
    let stop = Arc::new(AtomicBool::new(false));
    renderer.stop = Some(Arc::clone(&stop));
    renderer.exact_submit = Duration::ZERO;
    let mut submits = 0;
    let stopped = renderer.render(&mut |_| {
        submits += 1;
        stop.store(submits == 3, Ordering::Relaxed);
    });
    assert!(matches!(stopped, Err(gpu::Error::Stopped)), "{stopped:?}");
    assert!(!gpu::Error::Stopped.is_fatal());
    assert_eq!(submits, 3, "submits");
    stop.store(false, Ordering::Relaxed);
    renderer.render(&mut |_| ()).expect("a picture");
    assert_eq!(
        renderer.radiance().expect("radiance"),
        render(&device, &plan)
    );

    let stopped = region::measure(
        (&Options::default(), &device.device),
        &plan,
        [0, 0, 48, 36],
        1,
        &Arc::new(AtomicBool::new(true)),
        &mut |_| (),
    );
    assert!(matches!(stopped, Err(Fault::Stopped)), "{stopped:?}");
}

/// What the worker says last of the job it was asked for.
fn answer(worker: &mut Worker) -> Report {
    let start = Instant::now();
    while start.elapsed() < PATIENCE {
        if let Some(report) = worker.reports().pop()
            && !matches!(report, Report::Progress(_))
        {
            return report;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    panic!("the worker says nothing");
}

#[test]
fn the_newest_job_wins_and_all_end() {
    let Some(device) = device() else { return };
    let options = Options::default();
    let mut worker = Worker::new(&options, &device.device, || ()).expect("a worker");
    let error = |plan: Plan| Job::Error {
        place: [0, 0, plan.size[0], plan.size[1]],
        plan: Box::new(plan),
        frames: 1,
    };
    let mut long = plan(Method::Brdf, [160, 160]);
    long.light_map = 1024;
    worker.ask(error(long.clone()));
    std::thread::sleep(Duration::from_millis(50));
    assert!(worker.is_busy());
    let small = plan(Method::Mixture, [40, 30]);
    worker.ask(Job::Fetches(Box::new(small.clone())));
    match answer(&mut worker) {
        Report::Fetches(fetches) => {
            assert_eq!(fetches.size, small.size);
            assert_eq!(fetches.ledger.pixels.len(), 40 * 30);
            assert_eq!(fetches.ledger.disagreements(), Vec::<String>::new());
        }
        other => panic!("{other:?}"),
    }
    assert!(!worker.is_busy());
    // What cannot be is one line.
    let mut nothing = small.part_of([0, 0, 8, 8]);
    nothing.scene.camera.target = 2.0 * nothing.scene.camera.eye;
    worker.ask(error(nothing));
    match answer(&mut worker) {
        Report::Failed(message) => assert!(message.starts_with("nothing is covered"), "{message}"),
        other => panic!("{other:?}"),
    }
    // One that has just begun ends with it.
    worker.ask(error(long));
    std::thread::sleep(Duration::from_millis(50));
    let start = Instant::now();
    drop(worker);
    assert!(start.elapsed() < PATIENCE / 2);
}

#[test]
fn what_is_looked_at_is_what_the_device_has() {
    let Some(device) = device() else { return };
    for method in [Method::Mixture, Method::Rings] {
        let plan = plan(method, [48, 36]);
        let mut renderer =
            Renderer::new(&device.device, &plan, &Setup::default()).expect("a renderer");
        renderer.render(&mut |_| ()).expect("a picture");
        let offer = Offer::of(&plan);
        let mut lenses = offer.lenses();
        for level in 0..offer.levels {
            for power in 0..=4 {
                for smoothed in [false, true] {
                    let moments = Moments {
                        power,
                        level,
                        smoothed,
                    };
                    lenses.push(Lens::Moments(moments).within(&offer));
                }
            }
        }
        for lens in lenses {
            let Some(target) = lens.target() else {
                continue;
            };
            let texels = renderer.read(target).expect("an image");
            let shown = shown(lens, &plan, &texels);
            let shown = shown.unwrap_or_else(|| panic!("{lens:?} shows nothing"));
            let pixels = shown.size[0] as usize * shown.size[1] as usize;
            assert_eq!(shown.pixels.len(), pixels, "{lens:?}");
            let first = shown.pixels[pixels / 2];
            assert!(
                pixels < 16 || shown.pixels.iter().any(|pixel| *pixel != first),
                "{lens:?} is of one colour"
            );
        }
        assert_eq!(
            renderer.read(Target::LightDepth).expect("depth").len(),
            64 * 64
        );
    }
}
