//! The error of a rectangle of the picture against the exact sum, which is quick enough for so few pixels.

use super::Error;
use crate::frame::{self, Options, Progress, Renderer, Setup};
use crate::gpu::{self, Device};
use crate::report::Image;
use crate::report::compare::{self, compare, relative_errors};
use crate::scene::{Jitter, Multiple, Plan, Scattering};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// Columns and rows of the largest region: half a minute of `exact` on two cores of a CPU.
pub const LARGEST: u32 = 160;
/// Those of the smallest one that is meant as a rectangle; what is smaller was a click.
const SMALLEST: f64 = 6.0;
/// Those of the region around a click.
const CLICKED: f64 = 64.0;

/// Frames of samples that are averaged at most.
const FRAMES: u32 = 64;

/// Side of two tiles of the noise that shifts samples, pixels. A part of a picture that begins there has the samples of the
/// whole, also where it is shaded at half size.
const TILE: u32 = 128;
/// Pixels around the region that shading at half size may read.
const MARGIN: u32 = 2;

/// How long a submit of `exact` should take. The window waits so long for its own frames.
const SUBMIT: Duration = Duration::from_millis(100);

/// Why there is no error to show.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// It is wanted no longer.
    #[error("stopped")]
    Stopped,
    /// Something failed; the message is one line.
    #[error("{0}")]
    Failed(String),
}

impl From<gpu::Error> for Fault {
    fn from(error: gpu::Error) -> Fault {
        match error {
            gpu::Error::Stopped => Fault::Stopped,
            error => Fault::Failed(frame::Error::from(error).to_string()),
        }
    }
}

impl From<frame::Error> for Fault {
    fn from(error: frame::Error) -> Fault {
        Fault::Failed(error.to_string())
    }
}

impl From<compare::Error> for Fault {
    fn from(error: compare::Error) -> Fault {
        Fault::Failed(match error {
            compare::Error::Uncovered { .. } => {
                "nothing is covered there: drag a rectangle on the object".to_owned()
            }
            error => error.to_string(),
        })
    }
}

impl From<Fault> for Error {
    fn from(fault: Fault) -> Error {
        Error::Input(fault.to_string())
    }
}

/// How far a method is from exact in a part of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Columns and rows of the picture: x, y, width, height.
    pub place: [u32; 4],
    /// The method.
    pub method: String,
    /// The relative error of each pixel, row-major; none where nothing is covered.
    pub errors: Vec<Option<f64>>,
    /// The root of the mean of their squares.
    pub rr: f64,
    /// What it took.
    pub time: Duration,
}

/// The region of a picture of `size` pixels that a drag from one corner to the other (pixels) chooses: at most [`LARGEST`]
/// a side, around the same middle. One that is all but a point is a square around it; none lies beside the picture.
pub fn chosen(from: [f64; 2], to: [f64; 2], size: [u32; 2]) -> Option<[u32; 4]> {
    let clicked = (0..2).all(|axis| (to[axis] - from[axis]).abs() < SMALLEST);
    let along = |axis: usize| {
        let whole = f64::from(size[axis]);
        let [low, high] = [from[axis].min(to[axis]), from[axis].max(to[axis])];
        let [low, high] = if clicked {
            let middle = 0.5 * (low + high);
            [middle - 0.5 * CLICKED, middle + 0.5 * CLICKED]
        } else {
            [low, high]
        };
        let [low, high] = [low.max(0.0), high.min(whole)].map(f64::round);
        let side = (high - low).min(f64::from(LARGEST));
        let first = (0.5 * (low + high - side)).floor();
        (side >= 1.0).then_some([first as u32, side as u32])
    };
    let ([x, width], [y, height]) = (along(0)?, along(1)?);
    Some([x, y, width, height])
}

/// The plans of a region: that of its method, which may reach beyond it on any side, the region's corner in that, and
/// that of exact.
pub fn plans(plan: &Plan, place: [u32; 4], frames: u32) -> (Plan, [u32; 2], Plan) {
    let [x, y, width, height] = place;
    let along = |axis: usize, first: u32, side: u32| {
        let start = first.saturating_sub(MARGIN) / TILE * TILE;
        let end = (first + side + MARGIN).min(plan.size[axis]);
        [start, end - start]
    };
    let ([left, columns], [top, rows]) = (along(0, x, width), along(1, y, height));
    let exact = Plan {
        multiple: Multiple::Exact,
        scattering: Scattering::Full,
        frames_averaged: 1,
        jitter: Jitter::Off,
        ..plan.part_of(place)
    };
    let mut method = plan.part_of([left, top, columns, rows]);
    // The margin has another middle.
    method.multiple = plan.part_of(place).multiple;
    method.jitter = Jitter::Samples;
    method.frames_averaged = match method.multiple {
        Multiple::Samples(_) => frames.clamp(1, FRAMES),
        // Its frames are all alike.
        _ => 1,
    };
    (method, [x - left, y - top], exact)
}

/// Measures the error of `plan` in columns and rows `place` (x, y, width, height) of its picture, without jitter but for
/// that of samples, of which as many as `frames` are averaged. `progress` is told the share that is done.
///
/// # Errors
/// [`Fault::Stopped`] once `stop` is true; what does not fit, and what the device says.
pub fn measure(
    (options, device): (&Options, &Arc<Device>),
    plan: &Plan,
    place: [u32; 4],
    frames: u32,
    stop: &Arc<AtomicBool>,
    progress: &mut dyn FnMut(f32),
) -> Result<Region, Fault> {
    let start = Instant::now();
    let (method, corner, exact) = plans(plan, place, frames);
    let draw = |plan: &Plan, progress: &mut dyn FnMut(Progress)| -> Result<_, Fault> {
        frame::check_fit(options, plan, device.candidate(), false)?;
        let mut renderer = Renderer::new(device, plan, &Setup::default())?;
        renderer.stop = Some(Arc::clone(stop));
        renderer.exact_submit = SUBMIT;
        renderer.render(progress)?;
        Ok(renderer.radiance()?)
    };
    let [_, _, width, height] = place;
    let image = |name: String, pixels| Image {
        name,
        size: [width, height],
        pixels,
        has_alpha: true,
        encoded: false,
    };
    let drawn = draw(&method, &mut |_| ())?;
    let rows = drawn.chunks_exact(method.size[0] as usize);
    let rows = rows.skip(corner[1] as usize).take(height as usize);
    let columns = |row: &[[f32; 4]]| {
        let row = row.iter().skip(corner[0] as usize);
        row.take(width as usize).copied().collect::<Vec<_>>()
    };
    let found = image(method.method_name(), rows.flat_map(columns).collect());
    let exact = draw(&exact, &mut |now| {
        if let Progress::Exact { done, of } = now {
            progress(done as f32 / of.max(1) as f32);
        }
    })?;
    let exact = image("exact".to_owned(), exact);
    Ok(Region {
        place,
        errors: relative_errors(&exact, &found)?,
        rr: compare(&exact, &found)?.rr,
        method: match plan.split {
            Some(_) => format!("{} (as right of the line)", found.name),
            None => found.name,
        },
        time: start.elapsed(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Request;

    #[test]
    fn regions_stay_inside_and_small() {
        let size = [640, 360];
        assert_eq!(
            chosen([10.0, 20.0], [50.2, 60.0], size),
            Some([10, 20, 40, 40])
        );
        // From any corner.
        assert_eq!(
            chosen([50.2, 20.0], [10.0, 60.0], size),
            Some([10, 20, 40, 40])
        );
        // A large one shrinks around its middle.
        assert_eq!(
            chosen([0.0, 0.0], [640.0, 360.0], size),
            Some([240, 100, LARGEST, LARGEST])
        );
        assert_eq!(
            chosen([100.0, 100.0], [101.0, 99.0], size),
            Some([69, 68, 64, 64])
        );
        assert_eq!(chosen([-9.0, -9.0], [-20.0, 40.0], size), None);
        assert_eq!(
            chosen([600.0, 300.0], [999.0, 999.0], size),
            Some([600, 300, 40, 60])
        );
    }

    #[test]
    fn parts_begin_where_the_noise_does() {
        let mut request = Request::statue();
        request.size = [400, 300];
        request.multiple = crate::scene::Method::Samples;
        request.split = Some(crate::scene::Method::Brdf);
        let plan = request.plan().expect("a plan");
        let (method, corner, exact) = plans(&plan, [230, 65, 100, 20], 500);
        let part = method.part.expect("a part");
        assert_eq!((part.whole, part.corner), ([400, 300], [128, 0]));
        assert_eq!((method.size, corner), ([204, 87], [102, 65]));
        // The region lies right of the divider.
        assert!(matches!(method.multiple, Multiple::Samples(_)));
        assert_eq!((method.frames_averaged, method.split), (FRAMES, None));
        assert_eq!(exact.part.map(|part| part.corner), Some([230, 65]));
        assert_eq!((exact.size, exact.multiple), ([100, 20], Multiple::Exact));
        let (left, ..) = plans(&plan, [20, 20, 40, 40], 500);
        assert_eq!((left.multiple, left.frames_averaged), (Multiple::Brdf, 1));
        assert!(plans(&plan, [399, 299, 1, 1], 1).0.size == [16, 44]);
    }
}
