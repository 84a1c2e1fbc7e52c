//! From a plan to a picture: opens a device, renders, reports.

use std::sync::Arc;
use std::time::{Duration, Instant};

use ash::vk;
use raw_window_handle::RawDisplayHandle;

use super::deform::DeformPass;
use super::geometry::{Geometry, VERTEX_STRIDE};
use super::{PassTime, Progress, Renderer, Setup, Shaders};
use crate::gpu::{self, Candidate, Device, Handles, Instance, Surface};
use crate::ledger::{self, Filter, Ledger};
use crate::scene::pyramid::Atlas;
use crate::scene::{Motion, Multiple, Plan, Scattering, limits};

/// Names a Vulkan loader library in place of the system's.
const LOADER_VARIABLE: &str = "MARMOR_VULKAN_LOADER";

/// Which device, and how it is watched.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Part of a device's name, or its index; none takes the most capable.
    pub device: Option<String>,
    /// Whether the Khronos validation layer watches, synchronisation included.
    pub validation: bool,
    /// Whether each pass is timed on its own, at the price of draining the device between passes.
    pub measure: bool,
    /// Bytes of device memory to use at most, as if the device had no more.
    pub memory_limit: Option<u64>,
    /// Whether each frame draws the light map anew, even while light and mesh rest: for measuring alone.
    pub redraw_light: bool,
}

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// No usable device; the message holds the remedy.
    #[error("{0}")]
    NoDevice(String),
    /// The request does not fit the device.
    #[error("{0}")]
    TooLarge(String),
    /// A shader that was to replace the program's own is at fault; the message may have several lines.
    #[error("{0}")]
    Shader(String),
    /// The device was lost, ran out of memory or its driver failed.
    #[error("{0}")]
    Device(String),
}

impl From<gpu::Error> for Error {
    fn from(error: gpu::Error) -> Self {
        match error {
            gpu::Error::NoDevice(message) => Error::NoDevice(message),
            gpu::Error::Unsupported(message) => Error::TooLarge(message),
            gpu::Error::Shader(message) => Error::Shader(message),
            gpu::Error::OutOfMemory { .. } => Error::Device(format!(
                "{error}; lower --size or --light-map, or decimate the mesh"
            )),
            error => Error::Device(error.to_string()),
        }
    }
}

/// A Vulkan device as `marmor devices` shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct DeviceInfo {
    /// Its index for `--device`.
    pub index: usize,
    /// Its name.
    pub name: String,
    /// Discrete GPU, integrated GPU, virtual GPU or CPU.
    pub kind: String,
    /// Driver name and version.
    pub driver: String,
    /// Vulkan version.
    pub api: String,
    /// Size of its largest device-local heap, MiB.
    pub memory_mib: u64,
    /// Required features that it lacks; empty when usable.
    pub lacks: Vec<String>,
    /// Optional features that it lacks, and what happens then.
    pub notes: Vec<String>,
    /// Whether it would be used.
    pub chosen: bool,
}

/// A finished picture and how it came about.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Linear RGBA radiance, premultiplied by coverage, row-major.
    pub radiance: Vec<[f32; 4]>,
    /// sRGB with straight alpha, row-major.
    pub display: Vec<[u8; 4]>,
    /// Name of the device.
    pub device: String,
    /// Driver name and version.
    pub driver: String,
    /// Device time of each pass, as a mean over the frames in which it ran.
    pub passes: Vec<PassTime>,
    /// Mean time of a frame on the wall, ms.
    pub wall_milliseconds: f64,
    /// Declared fetches: pass, term, what is read, and how often per pixel.
    pub fetches: Vec<(String, String, String, u32)>,
    /// What the validation layer said.
    pub validation_messages: Vec<String>,
}

fn instance(options: &Options) -> Result<Arc<Instance>, Error> {
    instance_on(options, None)
}

fn instance_on(
    options: &Options,
    display: Option<RawDisplayHandle>,
) -> Result<Arc<Instance>, Error> {
    let loader = std::env::var(LOADER_VARIABLE).ok();
    Ok(Arc::new(Instance::new(
        options.validation,
        loader.as_deref(),
        display,
    )?))
}

/// Lists the Vulkan devices.
///
/// # Errors
/// [`Error::NoDevice`] where there is no loader or no device.
pub fn devices(options: &Options) -> Result<Vec<DeviceInfo>, Error> {
    let instance = instance(options)?;
    let list = Candidate::list(&instance)?;
    let chosen = match Candidate::choose(&list, options.device.as_deref()) {
        Ok(candidate) => Some(candidate.index),
        // What was asked for by name must exist; that none is usable, the list itself says.
        Err(error) if options.device.is_some() => return Err(error.into()),
        Err(_) => None,
    };
    Ok(list
        .iter()
        .map(|c| {
            let mut notes = Vec::new();
            let mut note = |lacking: bool, text: &str| {
                if lacking {
                    notes.push(text.to_owned());
                }
            };
            note(
                !c.snorm_normals,
                "no R16G16_SNORM attachment: normals are half floats",
            );
            note(
                !c.linear_floats,
                "no filtering of 32-bit floats: rings and mixture read four texels a tap, and eight of a volume",
            );
            note(
                !c.fragment_stores,
                "no stores from fragment shaders: fetches cannot be measured",
            );
            note(
                !c.statistics,
                "no pipeline statistics: bench reports no invocations",
            );
            note(c.timestamp_bits == 0, "no timestamps: passes are not timed");
            DeviceInfo {
                index: c.index,
                name: c.name.clone(),
                kind: match c.kind {
                    vk::PhysicalDeviceType::DISCRETE_GPU => "discrete GPU",
                    vk::PhysicalDeviceType::INTEGRATED_GPU => "integrated GPU",
                    vk::PhysicalDeviceType::VIRTUAL_GPU => "virtual GPU",
                    vk::PhysicalDeviceType::CPU => "CPU",
                    _ => "other",
                }
                .to_owned(),
                driver: c.driver.clone(),
                api: c.api.clone(),
                memory_mib: c.memory >> 20,
                lacks: c.lacks.clone(),
                notes,
                chosen: chosen == Some(c.index),
            }
        })
        .collect())
}

/// Opens the device that `options` ask for.
///
/// # Errors
/// [`Error::NoDevice`] where nothing matches.
pub fn open_device(options: &Options) -> Result<Arc<Device>, Error> {
    let instance = instance(options)?;
    open(&instance, options, &Candidate::list(&instance)?)
}

/// Opens the device that `options` ask for, if it can show pictures in a window, and the window's surface. The window
/// must outlive both.
///
/// # Errors
/// [`Error::NoDevice`] where nothing matches, or nothing shows pictures there.
pub fn open_window(
    options: &Options,
    (display, window): Handles,
) -> Result<(Arc<Device>, Arc<Surface>), Error> {
    let instance = instance_on(options, Some(display))?;
    let surface = Arc::new(Surface::new(&instance, (display, window))?);
    let mut list = Candidate::list(&instance)?;
    surface.strike_out(&mut list)?;
    Ok((open(&instance, options, &list)?, surface))
}

fn open(
    instance: &Arc<Instance>,
    options: &Options,
    list: &[Candidate],
) -> Result<Arc<Device>, Error> {
    let candidate = Candidate::choose(list, options.device.as_deref())?;
    tracing::info!(
        "device {}: {}, {}",
        candidate.index,
        candidate.name,
        candidate.driver
    );
    Ok(Device::new(instance, &candidate)?)
}

/// How the device that `options` ask for filters; opens none.
///
/// # Errors
/// As [`open_device`].
pub fn filter(options: &Options) -> Result<Filter, Error> {
    let instance = instance(options)?;
    let list = Candidate::list(&instance)?;
    let candidate = Candidate::choose(&list, options.device.as_deref())?;
    Ok(super::filter_of(&candidate))
}

/// Renders `plan`.
///
/// # Errors
/// [`Error::TooLarge`] before anything is allocated where the plan cannot fit the device.
pub fn render(
    options: &Options,
    plan: &Plan,
    progress: &mut dyn FnMut(Progress),
) -> Result<Picture, Error> {
    let device = open_device(options)?;
    check_fit(options, plan, device.candidate(), false)?;
    let mut renderer = Renderer::new(
        &device,
        plan,
        &Setup {
            measure: options.measure,
            ..Setup::default()
        },
    )?;
    renderer.redraw_light = options.redraw_light;
    warn(plan);
    if options.measure && plan.methods().all(|method| method != Multiple::Exact) {
        // Drivers compile on first use: a frame that does not count. `exact` is no matter of
        // frame times, and too long to be run twice.
        renderer.render_frames(0..1, &mut |_| ())?;
        // Nor does its light map: of a picture of one frame it belongs to the time.
        renderer.forget_light();
    }
    let wall = renderer.render(progress)?;
    picture(plan, &renderer, wall)
}

/// What `renderer` has drawn of `plan`, in `wall` a frame.
fn picture(plan: &Plan, renderer: &Renderer, wall: Duration) -> Result<Picture, Error> {
    let device = &renderer.device;
    let filter = super::filter_of(device.candidate());
    let declared = match renderer.live {
        Some(_) => ledger::declared_live(plan, filter),
        None => ledger::declared(plan, filter),
    };
    let radiance = renderer.radiance()?;
    if let Some(at) = radiance
        .iter()
        .position(|pixel| pixel.iter().any(|x| !x.is_finite()))
    {
        let (x, y) = (at as u32 % plan.size[0], at as u32 / plan.size[0]);
        return Err(Error::TooLarge(format!(
            "{}: pixel ({x}, {y}) is not finite in float32; the material, the light or the unit \
             is too extreme",
            plan.scene.name
        )));
    }
    Ok(Picture {
        size: plan.size,
        radiance,
        display: renderer.display()?,
        device: device.candidate().name.clone(),
        driver: device.candidate().driver.clone(),
        passes: renderer.pass_times(),
        wall_milliseconds: wall.as_secs_f64() * 1e3,
        fetches: declared
            .into_iter()
            .map(|f| {
                (
                    f.pass.to_owned(),
                    f.term.to_owned(),
                    f.what.to_owned(),
                    f.per_pixel,
                )
            })
            .collect(),
        validation_messages: device.instance().take_messages(),
    })
}

/// What draws the frames of an animation, one by one, each by its number alone.
pub struct Animator {
    renderer: Renderer,
    plan: Plan,
    motion: Arc<Motion>,
    live: bool,
    // The jitter of the next live frame.
    index: u32,
}

/// Live frames drawn before the first one that is asked for. A tenth of a picture is new in each, so that less than a
/// fifth of one is older.
const LEAD: u32 = 16;

impl Animator {
    /// Prepares `plan`, in which `motion` moves: every image, buffer and pipeline. If it is to be `live`, each frame is drawn
    /// once, and joined with those drawn before it.
    ///
    /// # Errors
    /// As [`render`].
    pub fn new(
        options: &Options,
        plan: &Plan,
        motion: &Arc<Motion>,
        live: bool,
    ) -> Result<Animator, Error> {
        let device = open_device(options)?;
        check_fit(options, plan, device.candidate(), live)?;
        let setup = Setup {
            measure: options.measure,
            live,
            ..Setup::default()
        };
        let renderer = Renderer::new(&device, plan, &setup)?;
        warn(plan);
        Ok(Animator {
            renderer,
            plan: plan.clone(),
            motion: Arc::clone(motion),
            live,
            index: 0,
        })
    }

    /// Draws frame `number`: as many jittered frames of that instant as the plan averages. What was drawn before plays no
    /// part. If it is live, it draws the instant once, and goes on from the frame drawn before; the first one goes on
    /// from the 16 of the loop that lead up to it.
    ///
    /// # Errors
    /// As [`render`].
    pub fn draw(
        &mut self,
        number: u32,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Picture, Error> {
        let wall = if self.live {
            if self.index == 0 {
                // Of a loop that is shorter it draws some again.
                let first = u64::from(number) + u64::from(LEAD) * u64::from(self.motion.frames);
                for before in (1..=u64::from(LEAD)).rev() {
                    let number = (first - before) % u64::from(self.motion.frames);
                    self.draw_live(number as u32, before == 1)?;
                }
            }
            self.draw_live(number, true)?
        } else {
            self.show(number);
            self.renderer.render(progress)?
        };
        picture(&self.plan, &self.renderer, wall)
    }

    fn show(&mut self, number: u32) {
        let time = self.motion.time(number);
        let moment = self.motion.moment(time, self.plan.light_map);
        self.renderer.show(&moment);
    }

    fn draw_live(&mut self, number: u32, read: bool) -> Result<Duration, Error> {
        self.show(number);
        let start = Instant::now();
        self.renderer.draw_live(self.index, read)?;
        self.index = self.index.wrapping_add(1);
        Ok(start.elapsed())
    }
}

/// What a counting build of a plan's shaders has read.
#[derive(Clone, Debug)]
pub struct Counted {
    /// Name of the device.
    pub device: String,
    /// Driver name and version.
    pub driver: String,
    /// The three accounts.
    pub ledger: Ledger,
    /// What the validation layer said.
    pub validation_messages: Vec<String>,
}

/// Renders `plan`, which is not split, by the counting build, and accounts for what it reads. Of averaged frames two
/// are enough: those after the first read alike.
///
/// # Errors
/// As [`render`], and [`Error::TooLarge`] where the device cannot count.
pub fn count(
    options: &Options,
    plan: &Plan,
    progress: &mut dyn FnMut(Progress),
) -> Result<Counted, Error> {
    let device = open_device(options)?;
    check_fit(options, plan, device.candidate(), false)?;
    Ok(Counted {
        ledger: count_on(&device, plan, progress)?,
        device: device.candidate().name.clone(),
        driver: device.candidate().driver.clone(),
        validation_messages: device.instance().take_messages(),
    })
}

/// As [`count`], on a `device` that is open, for a plan that fits it; what its validation layer says stays there.
///
/// # Errors
/// As [`count`].
pub fn count_on(
    device: &Arc<Device>,
    plan: &Plan,
    progress: &mut dyn FnMut(Progress),
) -> Result<Ledger, Error> {
    let shaders = Shaders::Counting;
    let setup = Setup {
        shaders,
        ..Setup::default()
    };
    let mut renderer = Renderer::new(device, plan, &setup)?;
    renderer.render_frames(0..plan.frames_averaged.min(2), progress)?;
    let filter = super::filter_of(device.candidate());
    let stages = super::stages(plan, filter, shaders);
    let declared = ledger::declared(plan, filter);
    Ledger::new(&declared, &stages, &renderer.counts()?).map_err(Error::Device)
}

/// Refuses, before anything is allocated, what cannot fit.
///
/// # Errors
/// [`Error::TooLarge`], which names what does not fit, and the remedy.
pub fn check_fit(
    options: &Options,
    plan: &Plan,
    candidate: &Candidate,
    live: bool,
) -> Result<(), Error> {
    let limits = &candidate.limits;
    let limit = limits
        .max_image_dimension2_d
        .min(limits.max_framebuffer_width)
        .min(limits.max_framebuffer_height);
    let largest = plan.size[0].max(plan.size[1]);
    if largest > limit {
        return Err(Error::TooLarge(format!(
            "--size {}x{}: {} draws at most {limit} pixels a side; lower --size",
            plan.size[0], plan.size[1], candidate.name
        )));
    }
    if plan.light_map > limit {
        return Err(Error::TooLarge(format!(
            "--light-map {}: {} draws at most {limit} texels a side; lower --light-map",
            plan.light_map, candidate.name
        )));
    }
    let moving = plan.motion.as_ref().filter(|motion| motion.deforms());
    let vertices = moving.map_or(plan.scene.mesh.positions.len(), |motion| {
        let shapes = motion.model.shapes.iter();
        shapes.map(|shape| shape.positions.len()).max().unwrap_or(0)
    });
    let most = candidate.limits.max_draw_indexed_index_value;
    if vertices as u64 > u64::from(most) {
        return Err(Error::TooLarge(format!(
            "{}: {vertices} vertices; {} indexes at most {most}; decimate the mesh",
            plan.scene.name, candidate.name
        )));
    }
    let pixels = u64::from(plan.size[0]) * u64::from(plan.size[1]);
    let texels = u64::from(plan.light_map).pow(2);
    // Bytes a pixel: G-buffer 16, radiance and two means 48, display 4, readback 20; a texel: 20, the
    // boxes a third of 16, and the atlas of the mixture, twice the map at most in either image of 16
    // bytes and of 4.
    let mut images = pixels * 88 + texels * 20;
    if live {
        // Motion.
        images += pixels * 8;
    }
    if plan.scattering == Scattering::Half {
        // A G-buffer of 16 bytes and radiance of 16 in a quarter of the pixels.
        let [width, height] = plan.size.map(|side| u64::from(side.div_ceil(2)));
        images += width * height * 32;
    }
    for method in plan.methods() {
        match method {
            Multiple::Rings(_) => images += texels * 6,
            Multiple::Mixture(mixture) => {
                let taps = plan.taps(mixture, &plan.light_frame());
                let atlas = Atlas::new([plan.light_map; 2], taps.level(taps.moments() - 1) + 1);
                let [width, height] = atlas.size;
                if width.max(height) > limit {
                    return Err(Error::TooLarge(format!(
                        "--light-map {}: the levels of the mixture need an image of {width}x{height}, \
                         {} has at most {limit} a side; lower --light-map, or choose another --multiple",
                        plan.light_map, candidate.name
                    )));
                }
                let bytes = if taps.fourth.is_empty() { 32 } else { 40 };
                images += u64::from(width) * u64::from(height) * bytes - texels * 16;
                if let Some(volumes) = &taps.volumes {
                    let most = limits.max_image_dimension3_d;
                    let [x, y, z] = volumes.image;
                    if x.max(y).max(z) > most {
                        return Err(Error::TooLarge(format!(
                            "--volumes {}: they need an image of {x}x{y}x{z}, {} has at most {most} a side; \
                             lower --volumes",
                            mixture.volumes, candidate.name
                        )));
                    }
                    // Cells of 4 bytes: the image, the grids, and two steps between them.
                    let image = u64::from(x) * u64::from(y) * u64::from(z);
                    images += 4 * (image + volumes.light_cells() + 2 * volumes.cells());
                }
            }
            _ => {}
        }
    }
    let mesh = match moving {
        Some(motion) => {
            let before = if live {
                u64::from(VERTEX_STRIDE) * vertices as u64
            } else {
                0
            };
            Geometry::moving_bytes(&motion.model) + DeformPass::bytes(&motion.model) + before
        }
        None => Geometry::bytes(&plan.scene.mesh),
    };
    let memory = options
        .memory_limit
        .unwrap_or(u64::MAX)
        .min(candidate.memory);
    if images + mesh > memory {
        let (what, remedy) = if mesh > images {
            (
                format!(
                    "{}: {} triangles",
                    plan.scene.name,
                    plan.scene.mesh.triangles.len()
                ),
                "decimate the mesh",
            )
        } else {
            (
                format!(
                    "{}x{} pixels, light map {}",
                    plan.size[0], plan.size[1], plan.light_map
                ),
                "lower --size or --light-map",
            )
        };
        return Err(Error::TooLarge(format!(
            "{what}: needs {} MiB, {} offers {} MiB; {remedy}, or choose another --device",
            (images + mesh).div_ceil(1 << 20),
            candidate.name,
            memory >> 20
        )));
    }
    Ok(())
}

fn warn(plan: &Plan) {
    for warning in warnings(plan) {
        tracing::warn!("{warning}");
    }
}

/// What a picture of `plan` lacks, a line each: light maps too coarse, volumes too large.
pub fn warnings(plan: &Plan) -> Vec<String> {
    let mut all = Vec::from_iter(coarse(plan));
    all.extend(few_volumes(plan));
    all
}

/// Fewer levels than asked for have volumes: the others would need more cells than there may be, or are the finest
/// level, which keeps its moments.
fn few_volumes(plan: &Plan) -> Vec<String> {
    let mut all = Vec::new();
    for method in plan.methods() {
        if let Multiple::Mixture(mixture) = method {
            let taps = plan.taps(mixture, &plan.light_frame());
            let used = taps.levels.count - taps.first_volume;
            if used < mixture.volumes {
                all.push(format!(
                    "{used} of {} levels are read from volumes, where {} were asked for: finer ones have too many cells",
                    taps.levels.count,
                    mixture.volumes
                ));
            }
        }
    }
    all
}

/// The light map is too coarse for the material: R_d is then blurred to a texel.
fn coarse(plan: &Plan) -> Option<String> {
    let material = &plan.scene.material;
    let sigma_t = (material.sigma_s + material.sigma_a).max_element();
    let texel = plan.light_frame().texel;
    if texel * sigma_t <= 1.0 {
        return None;
    }
    let needed = (f64::from(plan.light_map) * texel * sigma_t).ceil();
    let remedy = if needed <= f64::from(*limits::LIGHT_MAP.end()) {
        format!("--light-map {needed} resolves it")
    } else {
        "no light map resolves it; is the unit right?".to_owned()
    };
    Some(format!(
        "a light texel of {texel:.3} mm is coarser than the mean free path of {:.3} mm, so \
         scattering is blurred to a texel; {remedy}",
        1.0 / sigma_t,
    ))
}
