//! The renderer. This page is the frame: every pass and every barrier, in order.
//!
//! Passes live in files of their own and know only the resources they are given
//! ([`targets`]); what orders them is here and nowhere else.

mod alone;
mod boxes;
mod boxes_ways;
mod capture;
pub mod cases;
mod compile;
pub mod compose;
mod deform;
mod exact;
mod fetches;
mod geometry;
mod half;
mod history;
mod light;
mod live;
mod make;
pub mod measure;
pub mod panel;
pub mod present;
pub mod probe;
mod reduce;
mod resolve;
mod run;
mod shade;
pub mod targets;
pub mod uniforms;
mod view;
mod volume;
pub mod watch;

/// The table of compiled shaders, written by `build.rs`.
#[allow(missing_docs, clippy::unreadable_literal)]
pub mod shaders {
    use crate::gpu::{Shader, ShaderBuild};
    include!(concat!(env!("OUT_DIR"), "/shaders.rs"));
}

use std::ffi::CStr;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use ash::vk;
use glam::DVec3;

pub use alone::{Reduced, Window, compose_alone, reduce_alone};
pub use boxes_ways::{SHARED_SIDE, Way, boxes_alone};
pub use capture::Target;
pub use fetches::{Shaders, live_stages, stages, window_stages};
pub use run::{
    Animator, Counted, DeviceInfo, Error, Options, Picture, check_fit, count, count_on, devices,
    filter, open_device, open_window, render, warnings,
};

use crate::gpu::{
    self, Buffer, Candidate, Device, Image, RenderPass, Slot, Statistics, Timestamps, Use, barrier,
    submit,
};
use crate::ledger::{EXACT_TEXELS, Filter, HALF_SHADE as HALF_SHADE_PASS};
use crate::optics::sampling::r2;
use crate::optics::single::PathFit;
use crate::scene::volume::Volumes;
use crate::scene::{Jitter, LightFrame, Moment, Multiple, Plan, Pose, View};
use boxes::BoxesPass;
use deform::DeformPass;
use exact::ExactPass;
use fetches::{COUNTING, Counters};
use geometry::Geometry;
use half::HalfPass;
use light::LightPass;
use live::Live;
use reduce::ReducePass;
use resolve::ResolvePass;
use shade::ShadePass;
use targets::{Boxes, Canvas, GBuffer, Light, LightMap, Pyramid};
use uniforms::{LevelTable, Reprojection, Uniforms, VolumeTable};
use view::ViewPass;
use volume::VolumePass;

/// Frames recorded ahead of the device: how long may the host run before it waits? One
/// frame more than the device works on keeps both busy; a third would only add latency.
const FRAMES_IN_FLIGHT: usize = 2;

/// How long should one submit of `exact` take, unless [`Renderer::exact_submit`] says otherwise? Short enough that a
/// desktop on the same device stays alive and no watchdog fires, long enough that submitting costs nothing.
const EXACT_SUBMIT: Duration = Duration::from_millis(400);

/// How many pairs of pixel and texel may a slab of the picture make with one row of the light
/// map, which is the least that a submit of `exact` sums? Lavapipe takes about 0.1 s for them.
const EXACT_PAIRS: u64 = 1 << 24;

/// The passes, in the order of the frame; each has a label and a pair of timestamps.
const PASSES: [(&str, &CStr); 14] = [
    ("deform", c"deform"),
    ("light", c"light"),
    ("reduce", c"reduce"),
    ("boxes", c"boxes"),
    ("volume", c"volume"),
    ("half back", c"half back"),
    ("half view", c"half view"),
    (HALF_SHADE_PASS, c"half shade"),
    ("back", c"back"),
    ("view", c"view"),
    (SHADE_PASS, c"shade"),
    ("exact", c"exact"),
    ("resolve", c"resolve"),
    ("readback", c"readback"),
];
const DEFORM: u32 = 0;
const LIGHT: u32 = 1;
const REDUCE: u32 = 2;
const BOXES: u32 = 3;
const VOLUME: u32 = 4;
const HALF_BACK: u32 = 5;
const HALF_VIEW: u32 = 6;
const HALF_SHADE: u32 = 7;
const BACK: u32 = 8;
const VIEW: u32 = 9;
const SHADE: u32 = 10;
const EXACT: u32 = 11;
const RESOLVE: u32 = 12;
const READBACK: u32 = 13;

/// The passes that draw, and whose fragments can be counted.
const DRAWS: [u32; 8] = [
    LIGHT, HALF_BACK, HALF_VIEW, HALF_SHADE, BACK, VIEW, SHADE, RESOLVE,
];

/// The passes that are subpasses of a camera: back faces, G-buffer and shading.
const CAMERAS: [[u32; 3]; 2] = [[HALF_BACK, HALF_VIEW, HALF_SHADE], [BACK, VIEW, SHADE]];

/// Whatever the display image was used for, once it is written anew.
const DISPLAYED: Use = Use::COLOR_WRITE
    .and(Use::COPY_SOURCE)
    .and(Use::FRAGMENT_SAMPLE)
    .discarding();

/// The name of the pass that shades.
pub(crate) const SHADE_PASS: &str = "shade";

/// How far a picture is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Averaged frames submitted.
    Frame {
        /// So far.
        done: u32,
        /// In all.
        of: u32,
    },
    /// Rows of light maps summed by `exact`, over all slabs of the picture and all frames.
    Exact {
        /// So far.
        done: u64,
        /// In all.
        of: u64,
    },
}

/// Device time of a pass.
#[derive(Clone, Debug, PartialEq)]
pub struct PassTime {
    /// The pass, named as its label.
    pub pass: String,
    /// Mean over the frames in which it ran, ms.
    pub milliseconds: f64,
    /// In how many frames it ran.
    pub frames: u32,
}

/// Everything one plan needs on one device; made once, then no frame allocates.
pub struct Renderer {
    /// Whether each frame poses the mesh, if it moves, and draws the light map anew, even if both are as they were in the
    /// frame before. They are then what they were: for measuring alone.
    pub redraw_light: bool,
    /// How long one submit of `exact` should take. Whoever draws on the same device waits for it.
    pub exact_submit: Duration,
    /// Once it is true, [`Renderer::render`] ends with [`gpu::Error::Stopped`], before its next frame or submit of `exact`.
    pub stop: Option<Arc<AtomicBool>>,
    // Dropped first: a slot waits for the queue before anything it uses goes.
    slots: Vec<Slot>,
    stamps: Vec<Timestamps>,
    // Only where it measures.
    statistics: Vec<Statistics>,
    uniforms: Vec<Buffer>,
    geometry: Geometry,
    deform: Option<DeformPass>,
    light: LightPass,
    reduce: Option<ReducePass>,
    box_levels: Option<BoxesPass>,
    volume: Option<VolumePass>,
    half: Option<HalfPass>,
    camera: RenderPass,
    view: ViewPass,
    shade: ShadePass,
    exact: Option<ExactPass>,
    resolve: ResolvePass,
    live: Option<Live>,
    map: LightMap,
    boxes: Option<Boxes>,
    volumes: Option<Light>,
    built: make::Built,
    levels: LevelTable,
    volume_places: VolumeTable,
    kept: f64,
    path: PathFit,
    gbuffer: GBuffer,
    canvas: Canvas,
    mean_readback: Buffer,
    display_readback: Buffer,
    plan: Plan,
    center: DVec3,
    radius: f64,
    light_frame: LightFrame,
    pose: Option<Pose>,
    // Whether the vertices stand in that pose.
    posed: bool,
    // Where the map lay when it was last drawn: all that may change it.
    drawn: Option<LightFrame>,
    pending: Vec<bool>,
    // How the display image was left; none before it was written.
    display_left: Option<Use>,
    pass_totals: [f64; PASSES.len()],
    // Of the frame that was collected last.
    last_times: [Option<f64>; PASSES.len()],
    // Of each slot's last frame: llvmpipe gives another answer to whoever asks twice.
    last_invocations: [[Option<u64>; PASSES.len()]; FRAMES_IN_FLIGHT],
    collected: usize,
    frames: u32,
    light_draws: u32,
    deforms: u32,
    measure: bool,
    keep_gbuffer: bool,
    marches: bool,
    half_marches: bool,
    counters: Option<Counters>,
    device: Arc<Device>,
}

/// What a renderer is asked for besides its plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setup {
    /// Whether the G-buffer is stored, so that [`Renderer::read`] can fetch it.
    pub keep_gbuffer: bool,
    /// Whether each subpass is drained around its stamps, so that its time is its own; a frame may take longer for it.
    pub measure: bool,
    /// How bilinear taps are read, which must not ask for more than the device offers; none for what it offers.
    pub filter: Option<Filter>,
    /// Which build of the shaders runs.
    pub shaders: Shaders,
    /// Whether it draws for live display, too: [`Renderer::draw_live`].
    pub live: bool,
    /// Whether the history of live frames follows what moves, as it should. Without it they go on from the same pixel,
    /// whatever moves: for tests that compare.
    pub reproject: bool,
}

impl Default for Setup {
    fn default() -> Self {
        Setup {
            keep_gbuffer: false,
            measure: false,
            filter: None,
            shaders: Shaders::Plain,
            live: false,
            reproject: true,
        }
    }
}

impl Renderer {
    /// Goes to another instant of what moves: the frames that follow are of it. It makes nothing on the device.
    pub fn show(&mut self, moment: &Moment) {
        self.plan.scene.light.clone_from(&moment.light);
        self.plan.scene.camera.clone_from(&moment.camera);
        self.light_frame.clone_from(&moment.light_frame);
        if self.deform.is_some() && self.pose.as_ref() != Some(&moment.pose) {
            self.pose = Some(moment.pose.clone());
            self.posed = false;
            // The map may lie as it did, but shows another mesh.
            self.drawn = None;
        }
    }

    /// Moves the divider of a picture that is split, to `share` of its width, in [0, 1]: the frames that follow have it
    /// there. It makes nothing on the device, and a part may be left without columns. Live frames go on from their history;
    /// where it is of the other method it fades.
    ///
    /// A picture of one part, that of a plan whose divider leaves the other part empty among them, stays as it is: its
    /// other method has nothing on the device.
    pub fn set_split_at(&mut self, share: f64) {
        if !self.shade.is_divided() {
            return;
        }
        self.plan.split_at = share.clamp(0.0, 1.0);
        let (column, width) = (self.plan.divider(), self.plan.size[0]);
        self.shade.divide(column);
        if let Some(exact) = &mut self.exact {
            exact.move_to(match self.plan.multiple {
                Multiple::Exact => [column, width],
                _ => [0, column],
            });
        }
    }

    /// The point that positions on the device are relative to, mm.
    pub fn center(&self) -> DVec3 {
        self.center
    }

    /// The view of frame `index`, relative to [`Renderer::center`].
    pub fn view(&self, index: u32) -> View {
        self.plan.view_at(self.center, self.radius, index)
    }

    /// The light map's frame in frame `index`, relative to [`Renderer::center`].
    pub fn light_frame(&self, index: u32) -> LightFrame {
        self.plan.light_frame_at(&self.light_frame, index)
    }

    /// Renders and averages the plan's frames; returns the mean time of a frame on the wall.
    ///
    /// # Errors
    /// [`gpu::Error::DeviceLost`] among others, and [`gpu::Error::Stopped`] where it is told to stop.
    pub fn render(&mut self, progress: &mut dyn FnMut(Progress)) -> gpu::Result<Duration> {
        self.render_frames(0..self.plan.frames_averaged, progress)
    }

    /// Renders and averages frames `range`, as [`Renderer::render`]: more than one only where the plan averages more
    /// than one. A frame depends only on its number.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn render_frames(
        &mut self,
        range: Range<u32>,
        progress: &mut dyn FnMut(Progress),
    ) -> gpu::Result<Duration> {
        let (first, frames) = (range.start, range.end.saturating_sub(range.start));
        self.leave_live()?;
        self.pass_totals = [0.0; PASSES.len()];
        (self.frames, self.light_draws, self.deforms) = (frames, 0, 0);
        let start = Instant::now();
        for index in range {
            let done = index - first;
            let last = done + 1 == frames;
            self.go_on()?;
            self.average(index, done, [last; 2], progress)?;
            progress(Progress::Frame {
                done: done + 1,
                of: frames,
            });
        }
        for slot in 0..FRAMES_IN_FLIGHT {
            self.collect(slot)?;
        }
        Ok(start.elapsed() / frames.max(1))
    }

    /// Refuses to, where it is told to stop. What was submitted runs to its end, and another picture can be drawn.
    fn go_on(&self) -> gpu::Result<()> {
        match &self.stop {
            Some(stop) if stop.load(Ordering::Relaxed) => Err(gpu::Error::Stopped),
            _ => Ok(()),
        }
    }

    /// Draws frame `index` of the plan's average onto the mean of those before it, which were drawn one by one, 0 first, and
    /// encodes the mean so far. It waits only for the frame before the last one. What [`Renderer::render`] draws with as
    /// many frames is the same, bit for bit.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn accumulate(&mut self, index: u32) -> gpu::Result<()> {
        if index == 0 {
            self.leave_live()?;
        }
        self.frames = index + 1;
        self.average(index, index, [true, false], &mut |_| ())
    }

    /// Draws frame `index` as the one after `done` others of a mean; if it `encodes`, also for display; if it is to be
    /// `read`, to the host, too.
    fn average(
        &mut self,
        index: u32,
        done: u32,
        [encodes, read]: [bool; 2],
        progress: &mut dyn FnMut(Progress),
    ) -> gpu::Result<()> {
        let slot = done as usize % FRAMES_IN_FLIGHT;
        self.collect(slot)?;
        self.write_uniforms(slot, index, done)?;

        let mut commands = self.start(slot)?;
        self.posed &= !self.redraw_light;
        if self.poses(slot)? {
            self.record_deform(commands, slot, [false, true]);
        }
        if self.draws_light(index) {
            self.record_light(commands, slot);
        }
        self.record_scene(commands, slot);
        if self.exact.is_some() {
            commands = self.sum_exact(slot, done, progress)?;
        }
        self.record_resolve(commands, slot, done, encodes);
        if read {
            self.record_readback(commands, slot, done);
        }
        self.submit(slot)?;
        if encodes {
            self.display_left = Some(if read {
                Use::COPY_SOURCE
            } else {
                Use::COLOR_WRITE
            });
        }
        Ok(())
    }

    /// Reads the mean and the display image back, as the frame after `done` others of an average has left them: then
    /// [`Renderer::radiance`] and [`Renderer::display`] are of it. It waits for the device.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    #[rustfmt::skip] // A barrier is read as a sentence.
    pub fn read_mean(&mut self, done: u32) -> gpu::Result<()> {
        let slot = (done as usize + 1) % FRAMES_IN_FLIGHT;
        self.collect(slot)?;
        let commands = self.start(slot)?;
        if let Some(left) = self.display_left.replace(Use::COPY_SOURCE) {
            barrier::image(
                &self.device, commands, c"layout: the readback finds it as resolve leaves it",
                &self.canvas.display, left, Use::COLOR_WRITE,
            );
        }
        self.record_readback(commands, slot, done);
        barrier::image(
            &self.device, commands, c"layout: the next frame goes on from the mean as if nobody had read it",
            &self.canvas.means[mean_of(done)], Use::COPY_SOURCE, Use::COLOR_WRITE,
        );
        // Its stamps are of no frame.
        self.slots[slot].submit()?;
        self.slots[slot].wait()
    }

    /// How the display image was left, where it is not left to be sampled; it will be.
    fn take_display(&mut self) -> Option<Use> {
        let left = self.display_left.replace(Use::FRAGMENT_SAMPLE);
        left.filter(|&left| left != Use::FRAGMENT_SAMPLE)
    }

    /// Renders and averages frames 0 and 1 in one submit.
    ///
    /// The synchronisation checker of the validation layer does not look across submits: this
    /// shows it the hazards between one frame and the next, for a test. Not for `exact`.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn render_pair(&mut self) -> gpu::Result<()> {
        self.leave_live()?;
        for slot in 0..2 {
            self.collect(slot)?;
            self.write_uniforms(slot, slot as u32, slot as u32)?;
        }
        let commands = self.slots[0].begin()?;
        for slot in 0..2 {
            self.stamps[slot].reset(commands);
            if let Some(statistics) = self.statistics.get(slot) {
                statistics.reset(commands);
            }
            // Both, so that the checker sees a mesh move while the frame before draws it.
            self.posed = false;
            if self.poses(slot)? {
                self.record_deform(commands, slot, [false, true]);
            }
            if self.draws_light(slot as u32) {
                self.record_light(commands, slot);
            }
            self.record_scene(commands, slot);
            self.record_resolve(commands, slot, slot as u32, true);
        }
        self.record_readback(commands, 1, 1);
        self.slots[0].submit()?;
        self.slots[0].wait()
    }

    /// Fills the uniforms of a slot that the device is done with: frame `index`, the one after
    /// `done` others of the mean.
    fn write_uniforms(&mut self, slot: usize, index: u32, done: u32) -> gpu::Result<()> {
        let sequence = match self.plan.jitter {
            Jitter::Off => r2([0.0; 2], 0),
            Jitter::Samples | Jitter::All => r2([0.0; 2], index),
        };
        let (view, light) = (self.view(index), self.light_frame(index));
        let of = |view: &View| {
            Uniforms::new(
                &self.plan,
                view,
                &light,
                self.map.moments.size(),
                (&self.levels, &self.volume_places, self.kept, &self.path),
                done,
                sequence.into(),
            )
        };
        let (full, half_view) = (of(&view), view.halved(self.plan.size).0);
        // Jitter is no motion.
        let steady = self.view(0);
        if let Some(live) = &mut self.live {
            let before = live.before.as_ref().filter(|_| live.reproject);
            let before = before.map_or(&steady, |(view, _)| view);
            let block = Reprojection::new(self.plan.size, &steady, before);
            live.reprojections[slot].write(bytemuck::bytes_of(&block))?;
        }
        if self.half.is_some() {
            let uniforms = of(&half_view);
            if let Some(half) = &mut self.half {
                half.uniforms[slot].write(bytemuck::bytes_of(&uniforms))?;
            }
        }
        self.uniforms[slot].write(bytemuck::bytes_of(&full))
    }

    /// Whether the frame that is to be recorded poses the mesh, which is then set for `slot`: the first of each instant
    /// does.
    fn poses(&mut self, slot: usize) -> gpu::Result<bool> {
        let (Some(deform), Some(pose)) = (&mut self.deform, &self.pose) else {
            return Ok(false);
        };
        if std::mem::replace(&mut self.posed, true) {
            return Ok(false);
        }
        deform.write(slot, pose, self.center)?;
        self.deforms += 1;
        if let Some(live) = &mut self.live {
            live.stale = true;
        }
        self.geometry.shape = pose.shape;
        Ok(true)
    }

    /// deform: if it `keeps` them, the vertices of the frame before are copied, for their motion; and if it `poses`, those
    /// of this instant are made.
    #[rustfmt::skip] // A barrier is read as a sentence.
    fn record_deform(&self, commands: vk::CommandBuffer, slot: usize, [keeps, poses]: [bool; 2]) {
        let (device, vertices) = (&*self.device, self.geometry.vertices());
        let Some(deform) = &self.deform else { return };
        // A live frame may also have copied them, and not posed them itself.
        let mut drawn = Use::VERTEX_INPUT.and(Use::COMPUTE_STORAGE);
        if self.geometry.before().is_some() {
            drawn = drawn.and(Use::COPY_SOURCE);
        }
        if let Some(before) = self.geometry.before().filter(|_| keeps) {
            barrier::buffer(
                device, commands, c"WAR: the previous frame draws with the vertices before its own",
                before, Use::VERTEX_INPUT, Use::COPY_TARGET,
            );
            barrier::buffer(
                device, commands, c"RAW: the copy reads the vertices that the previous frame has made",
                vertices, Use::COMPUTE_STORAGE, Use::COPY_SOURCE,
            );
            submit::record_buffer_copy(device, commands, vertices, before);
            barrier::buffer(
                device, commands, c"RAW: view draws with the vertices before",
                before, Use::COPY_TARGET, Use::VERTEX_INPUT,
            );
        }
        if !poses {
            return;
        }
        barrier::buffer(
            device, commands, c"WAR, WAW: the previous frame draws the vertices that its own deform has written",
            vertices, drawn, Use::COMPUTE_STORAGE,
        );
        self.begin(commands, slot, DEFORM);
        deform.record(commands, slot, self.geometry.shape);
        self.end(commands, slot, DEFORM);
        barrier::buffer(
            device, commands, c"RAW: light, back faces and view draw the vertices",
            vertices, Use::COMPUTE_STORAGE, Use::VERTEX_INPUT,
        );
    }

    /// Whether frame `index`, which is to be recorded, draws the light map: not where it would draw what the last one
    /// has drawn. All frames share the map, in flight or not, and are recorded in the order in which they run.
    fn draws_light(&mut self, index: u32) -> bool {
        let frame = self.light_frame(index);
        let draws = self.redraw_light || self.drawn.as_ref() != Some(&frame);
        if draws {
            self.drawn = Some(frame);
            self.light_draws += 1;
        }
        draws
    }

    /// Has the next frame draw the light map, wherever it lies.
    pub fn forget_light(&mut self) {
        self.drawn = None;
    }

    /// What reads the light map: the shade pass, and in compute `exact` and what makes volumes.
    fn map_read(&self) -> Use {
        if self.exact.is_some() || self.volumes.is_some() {
            Use::FRAGMENT_SAMPLE.and(Use::COMPUTE_SAMPLE)
        } else {
            Use::FRAGMENT_SAMPLE
        }
    }

    /// The frame, up to what is made of the light alone. Frames in which neither light nor mesh has moved go
    /// without: the map stays as its last barriers have left it, to be sampled.
    #[rustfmt::skip] // A barrier is read as a sentence.
    fn record_light(&self, commands: vk::CommandBuffer, slot: usize) {
        let device = &*self.device;
        let map = &self.map;
        let map_read = self.map_read();
        let counters = self.counters.as_ref();
        record_counted(device, commands, counters);
        // Between the levels of a pyramid lie zeros from when it was made, and these are kept.
        let moments_before = if map.pyramid.is_some() { map_read } else { map_read.discarding() };
        let fourth = map.pyramid.as_ref().and_then(|p| p.fourth.as_ref());

        // light: what the light sees.
        barrier::image(
            device, commands, c"WAR: the previous frame shades from the light depth",
            &map.depth, Use::FRAGMENT_SAMPLE_DEPTH.discarding(), Use::DEPTH_WRITE,
        );
        barrier::image(
            device, commands, c"WAR: the previous frame shades from the light moments",
            &map.moments, moments_before, Use::COLOR_WRITE,
        );
        if let Some(fourth) = fourth {
            barrier::image(
                device, commands, c"WAR: the previous frame smooths the light's fourth moment",
                &fourth.moments, map_read, Use::COLOR_WRITE,
            );
        }
        self.begin(commands, slot, LIGHT);
        self.light.record(commands, slot, &self.geometry);
        self.end(commands, slot, LIGHT);
        barrier::image(
            device, commands, c"RAW: shading compares with the light depth",
            &map.depth, Use::DEPTH_WRITE, Use::FRAGMENT_SAMPLE_DEPTH,
        );
        // reduce, boxes: the pyramids that the mixture and the rings read.
        let mut moments_left = Use::COLOR_WRITE;
        if let (Some(pyramid), Some(reduce)) = (&map.pyramid, &self.reduce) {
            self.begin(commands, slot, REDUCE);
            record_reduce(device, commands, &map.moments, pyramid, reduce, counters, [Use::COLOR_WRITE, map_read]);
            self.end(commands, slot, REDUCE);
            moments_left = map_read;
        }
        if let (Some(boxes), Some(levels)) = (&self.boxes, &self.box_levels) {
            self.begin(commands, slot, BOXES);
            record_boxes(device, commands, &map.moments, boxes, levels, counters, [moments_left, map_read]);
            self.end(commands, slot, BOXES);
        } else if self.reduce.is_none() {
            barrier::image(
                device, commands, c"RAW: shading samples the light moments",
                &map.moments, Use::COLOR_WRITE, map_read,
            );
        }

        // volume: light in space, which the mixture reads where moments are too few.
        if let (Some(light), Some(pass)) = (&self.volumes, &self.volume) {
            self.begin(commands, slot, VOLUME);
            record_volumes(device, commands, light, pass, &self.light_frame);
            self.end(commands, slot, VOLUME);
        }
    }

    /// The frame, from the camera up to radiance.
    #[rustfmt::skip] // A barrier is read as a sentence.
    fn record_scene(&self, commands: vk::CommandBuffer, slot: usize) {
        let device = &*self.device;
        let (gbuffer, canvas) = (&self.gbuffer, &self.canvas);
        record_counted(device, commands, self.counters.as_ref());
        // What reads the G-buffer: the shade pass, and `exact` in compute. A render pass also stores its
        // attachments at its end, which is a write.
        let mut depth_read = Use::DEPTH_INPUT.and(Use::DEPTH_WRITE);
        let mut normal_read = Use::COLOR_INPUT.and(Use::COLOR_WRITE);
        if self.exact.is_some() {
            depth_read = depth_read.and(Use::COMPUTE_SAMPLE_DEPTH);
            normal_read = normal_read.and(Use::COMPUTE_SAMPLE);
        }
        // And the history of live display.
        if self.live.is_some() {
            depth_read = depth_read.and(Use::FRAGMENT_SAMPLE_DEPTH);
        }

        // half: the same three subpasses at half size, where both terms of scattering are shaded.
        if let Some(half) = &self.half {
            barrier::image(
                device, commands, c"WAR, WAW: the previous frame reads and stores the back faces' depth at half size",
                &half.gbuffer.back, Use::DEPTH_INPUT.and(Use::DEPTH_WRITE).discarding(), Use::DEPTH_WRITE,
            );
            barrier::image(
                device, commands, c"WAR, WAW: the previous frame reads and stores the view depth at half size",
                &half.gbuffer.depth, Use::DEPTH_INPUT.and(Use::DEPTH_WRITE).discarding(), Use::DEPTH_WRITE,
            );
            barrier::image(
                device, commands, c"WAR, WAW: the previous frame reads and stores the normals at half size",
                &half.gbuffer.normal, Use::COLOR_INPUT.and(Use::COLOR_WRITE).discarding(), Use::COLOR_WRITE,
            );
            barrier::image(
                device, commands, c"WAR, WAW: the previous frame reads and stores the back faces' normals at half size",
                &half.gbuffer.back_normal, Use::COLOR_INPUT.and(Use::COLOR_WRITE).discarding(), Use::COLOR_WRITE,
            );
            barrier::image(
                device, commands, c"WAR: the previous frame brings the half radiance to full size",
                &half.radiance, Use::FRAGMENT_SAMPLE.discarding(), Use::COLOR_WRITE,
            );
            let back = self.half_marches || self.keep_gbuffer;
            self.record_camera(commands, slot, CAMERAS[0], (&half.camera, &half.view, &half.shade), back);
            barrier::image(
                device, commands, c"RAW: shading samples the half radiance",
                &half.radiance, Use::COLOR_WRITE, Use::FRAGMENT_SAMPLE,
            );
        }

        // view and shade: one render pass of three subpasses (view.rs has their dependencies).
        barrier::image(
            device, commands, c"WAR, WAW: the previous frame reads and stores the back faces' depth",
            &gbuffer.back, Use::DEPTH_INPUT.and(Use::DEPTH_WRITE).discarding(), Use::DEPTH_WRITE,
        );
        barrier::image(
            device, commands, c"WAR, WAW: the previous frame reads and stores the view depth",
            &gbuffer.depth, depth_read.discarding(), Use::DEPTH_WRITE,
        );
        barrier::image(
            device, commands, c"WAR, WAW: the previous frame reads and stores the normals",
            &gbuffer.normal, normal_read.discarding(), Use::COLOR_WRITE,
        );
        barrier::image(
            device, commands, c"WAR, WAW: the previous frame reads and stores the back faces' normals",
            &gbuffer.back_normal, Use::COLOR_INPUT.and(Use::COLOR_WRITE).discarding(), Use::COLOR_WRITE,
        );
        barrier::image(
            device, commands, c"WAR: the previous frame resolves the radiance",
            &canvas.radiance, Use::FRAGMENT_SAMPLE.discarding(), Use::COLOR_WRITE,
        );
        if let Some(live) = &self.live {
            barrier::image(
                device, commands, c"WAR: the previous frame follows the motion",
                &live.motion, Use::FRAGMENT_SAMPLE.discarding(), Use::COLOR_WRITE,
            );
        }
        let back = self.marches || self.keep_gbuffer;
        self.record_camera(commands, slot, CAMERAS[1], (&self.camera, &self.view, &self.shade), back);
        let mut depth_next = Use::COMPUTE_SAMPLE_DEPTH;
        if let Some(live) = &self.live {
            barrier::image(
                device, commands, c"RAW: the history follows the motion",
                &live.motion, Use::COLOR_WRITE, Use::FRAGMENT_SAMPLE,
            );
            depth_next = depth_next.and(Use::FRAGMENT_SAMPLE_DEPTH);
        }
        if self.exact.is_none() && self.live.is_some() {
            barrier::image(
                device, commands, c"RAW: the history looks for the nearest surface",
                &gbuffer.depth, Use::DEPTH_WRITE.left_in(Use::DEPTH_INPUT), Use::FRAGMENT_SAMPLE_DEPTH,
            );
        }
        if self.exact.is_none() {
            barrier::image(
                device, commands, c"RAW: resolve samples the radiance",
                &canvas.radiance, Use::COLOR_WRITE, Use::FRAGMENT_SAMPLE,
            );
        } else {
            barrier::image(
                device, commands, c"RAW, WAW: exact adds to the radiance",
                &canvas.radiance, Use::COLOR_WRITE, Use::COMPUTE_STORAGE,
            );
            barrier::image(
                device, commands, c"RAW: exact, and a history, read the view depth",
                &gbuffer.depth, Use::DEPTH_WRITE.left_in(Use::DEPTH_INPUT), depth_next,
            );
            barrier::image(
                device, commands, c"RAW: exact reads the normals",
                &gbuffer.normal, Use::COLOR_WRITE.left_in(Use::COLOR_INPUT), Use::COMPUTE_SAMPLE,
            );
        }
    }

    /// A camera's render pass, of the passes `back`, `view` and `shade`: with back faces, which tell single scattering
    /// where the view ray leaves the object, or without.
    fn record_camera(
        &self,
        commands: vk::CommandBuffer,
        slot: usize,
        [back, view, shade]: [u32; 3],
        (camera, geometry, shading): (&RenderPass, &ViewPass, &ShadePass),
        draws_back: bool,
    ) {
        let moved = self.live.as_ref().is_some_and(|live| live.moved);
        camera.begin(commands, &view::clear_values());
        if draws_back {
            self.begin(commands, slot, back);
            geometry.record_back(commands, slot, &self.geometry);
            self.end(commands, slot, back);
        }
        camera.next(commands);
        self.begin(commands, slot, view);
        geometry.record(commands, slot, &self.geometry, moved);
        self.end(commands, slot, view);
        camera.next(commands);
        self.begin(commands, slot, shade);
        shading.record(commands, slot);
        self.end(commands, slot, shade);
        camera.end(commands);
    }

    /// exact: the sum over the light map, in submits of about [`Renderer::exact_submit`], each a band of
    /// the map's rows for a slab of the picture's; goes on in the command buffer it returns.
    #[rustfmt::skip] // A barrier is read as a sentence.
    fn sum_exact(
        &mut self,
        slot: usize,
        frame: u32,
        progress: &mut dyn FnMut(Progress),
    ) -> gpu::Result<vk::CommandBuffer> {
        self.submit(slot)?;
        self.collect(slot)?;

        let (rows, [width, height]) = (self.plan.light_map, self.plan.size);
        // Whole workgroups of eight lines.
        let slab = 8 * (EXACT_PAIRS / (8 * u64::from(width) * u64::from(rows))).clamp(1, 1 << 13) as u32;
        let units = u64::from(height.div_ceil(slab)) * u64::from(rows);
        let mut finished = u64::from(frame) * units;
        // One row first: how fast the device is, only a measurement tells. A counting build has the bands of the ledger.
        let most = (EXACT_TEXELS / rows).max(1);
        let mut band = if self.counters.is_some() { most } else { 1 };
        for line in (0..height).step_by(slab as usize) {
            let lines = [line, (line + slab).min(height)];
            let mut done = 0;
            while done < rows {
                self.go_on()?;
                let next = (done + band).min(rows);
                let commands = self.start(slot)?;
                barrier::image(
                    &self.device, commands, c"RAW, WAW: each band adds to the one before",
                    &self.canvas.radiance, Use::COMPUTE_STORAGE, Use::COMPUTE_STORAGE,
                );
                record_counted(&self.device, commands, self.counters.as_ref());
                let start = Instant::now();
                self.begin(commands, slot, EXACT);
                if let Some(exact) = &self.exact {
                    exact.record(commands, slot, [done, next], lines);
                }
                self.end(commands, slot, EXACT);
                self.submit(slot)?;
                self.collect(slot)?;
                let seconds = start.elapsed().as_secs_f64() / f64::from(next - done);
                // At most eightfold, lest the first measurement was of a device half asleep.
                let wanted = self.exact_submit.as_secs_f64() / seconds.max(1e-6);
                if self.counters.is_none() {
                    band = (wanted as u32).min(most).clamp(1, 8 * band);
                }
                finished += u64::from(next - done);
                done = next;
                progress(Progress::Exact { done: finished, of: units * u64::from(self.frames) });
            }
        }
        let commands = self.start(slot)?;
        barrier::image(
            &self.device, commands, c"RAW: resolve samples what exact has added to",
            &self.canvas.radiance, Use::COMPUTE_STORAGE, Use::FRAGMENT_SAMPLE,
        );
        Ok(commands)
    }

    /// resolve: the running mean after `done` other frames, and after the last its encoding.
    #[rustfmt::skip] // A barrier is read as a sentence.
    fn record_resolve(&self, commands: vk::CommandBuffer, slot: usize, done: u32, last: bool) {
        let canvas = &self.canvas;
        let (old, new) = (&canvas.means[mean_of(done + 1)], &canvas.means[mean_of(done)]);
        // The first frame begins anew: it finds both as the last average has left them, and nothing in them counts.
        let any = Use::COLOR_WRITE.and(Use::FRAGMENT_SAMPLE).and(Use::COPY_SOURCE).discarding();
        let [written, sampled] = if done == 0 { [any; 2] } else { [Use::COLOR_WRITE, Use::FRAGMENT_SAMPLE.discarding()] };
        barrier::image(
            &self.device, commands, c"RAW: the mean goes on from the previous frame",
            old, written, Use::FRAGMENT_SAMPLE,
        );
        barrier::image(
            &self.device, commands, c"WAR: the previous frame goes on from the mean before it",
            new, sampled, Use::COLOR_WRITE,
        );
        if last {
            barrier::image(
                &self.device, commands, c"WAW, WAR: a frame before this one encodes the display image, which was copied or shown",
                &canvas.display, DISPLAYED, Use::COLOR_WRITE,
            );
        }
        self.begin(commands, slot, RESOLVE);
        self.resolve.record(commands, slot, mean_of(done), last);
        self.end(commands, slot, RESOLVE);
    }

    /// resolve, for live display: the frame joined with the history after `done` others, and its encoding.
    #[rustfmt::skip] // A barrier is read as a sentence.
    fn record_history(&self, commands: vk::CommandBuffer, slot: usize, done: u32) {
        let canvas = &self.canvas;
        let Some(live) = &self.live else { return };
        let (old, new) = (&canvas.means[mean_of(done + 1)], &canvas.means[mean_of(done)]);
        // One that begins anew finds both images as whatever frame was last has left them.
        let any = Use::COLOR_WRITE.and(Use::FRAGMENT_SAMPLE).and(Use::COPY_SOURCE).discarding();
        let written = if live.read { Use::COPY_SOURCE } else { Use::COLOR_WRITE };
        let [written, sampled] = if done == 0 { [any; 2] } else { [written, Use::FRAGMENT_SAMPLE.discarding()] };
        barrier::image(
            &self.device, commands, c"RAW: history goes on from the previous frame",
            old, written, Use::FRAGMENT_SAMPLE,
        );
        barrier::image(
            &self.device, commands, c"WAR: the previous frame goes on from the history before it",
            new, sampled, Use::COLOR_WRITE,
        );
        barrier::image(
            &self.device, commands, c"WAW, WAR: the previous frame encodes the display image, which was copied or shown",
            &canvas.display, DISPLAYED, Use::COLOR_WRITE,
        );
        self.begin(commands, slot, RESOLVE);
        live.pass.record(commands, slot, mean_of(done));
        self.end(commands, slot, RESOLVE);
    }

    /// readback: the mean of the frame after `done` others, and the display image, to the host.
    #[rustfmt::skip] // A barrier is read as a sentence.
    fn record_readback(&self, commands: vk::CommandBuffer, slot: usize, done: u32) {
        let canvas = &self.canvas;
        let mean = &canvas.means[mean_of(done)];
        barrier::image(
            &self.device, commands, c"RAW: the copy reads the mean",
            mean, Use::COLOR_WRITE, Use::COPY_SOURCE,
        );
        barrier::image(
            &self.device, commands, c"RAW: the copy reads the display image",
            &canvas.display, Use::COLOR_WRITE, Use::COPY_SOURCE,
        );
        for counts in self.counters.iter().flat_map(Counters::buffers) {
            barrier::buffer(
                &self.device, commands, c"RAW: the host reads the counts",
                counts, COUNTING, Use::HOST_READ,
            );
        }
        self.begin(commands, slot, READBACK);
        submit::record_readback(&self.device, commands, mean, &self.mean_readback);
        submit::record_readback(&self.device, commands, &canvas.display, &self.display_readback);
        self.end(commands, slot, READBACK);
    }

    /// Starts recording on a slot that the device is done with, its stamps forgotten.
    fn start(&mut self, slot: usize) -> gpu::Result<vk::CommandBuffer> {
        let commands = self.slots[slot].begin()?;
        self.stamps[slot].reset(commands);
        if let Some(statistics) = self.statistics.get(slot) {
            statistics.reset(commands);
        }
        Ok(commands)
    }

    /// Submits what the slot has recorded; its times are pending until [`Renderer::collect`].
    fn submit(&mut self, slot: usize) -> gpu::Result<()> {
        self.slots[slot].submit()?;
        self.pending[slot] = true;
        Ok(())
    }

    /// Opens a pass: label and timestamp.
    fn begin(&self, commands: vk::CommandBuffer, slot: usize, pass: u32) {
        self.device.begin_label(commands, PASSES[pass as usize].1);
        self.stamps[slot].start(commands, pass);
        self.drain(commands, pass);
        if let Some(statistics) = self.statistics.get(slot).filter(|_| DRAWS.contains(&pass)) {
            statistics.start(commands, pass);
        }
    }

    /// Closes a pass.
    fn end(&self, commands: vk::CommandBuffer, slot: usize, pass: u32) {
        if let Some(statistics) = self.statistics.get(slot).filter(|_| DRAWS.contains(&pass)) {
            statistics.end(commands, pass);
        }
        self.drain(commands, pass);
        self.stamps[slot].end(commands, pass);
        self.device.end_label(commands);
    }

    /// When measuring, keeps the work of a subpass from being carried past its stamps.
    fn drain(&self, commands: vk::CommandBuffer, pass: u32) {
        if self.measure && CAMERAS.as_flattened().contains(&pass) {
            barrier::drain(&self.device, commands);
        }
    }

    /// Waits for the slot's last submit and adds up its times.
    fn collect(&mut self, slot: usize) -> gpu::Result<()> {
        self.slots[slot].wait()?;
        if std::mem::take(&mut self.pending[slot]) {
            for (pass, total) in (0..).zip(&mut self.pass_totals) {
                let time = self.stamps[slot].milliseconds(pass);
                *total += time.unwrap_or(0.0);
                self.last_times[pass as usize] = time;
                let statistics = self.statistics.get(slot);
                let counted = statistics.filter(|_| DRAWS.contains(&pass) && time.is_some());
                self.last_invocations[slot][pass as usize] =
                    counted.and_then(|s| s.invocations(pass));
            }
            self.collected = slot;
        }
        Ok(())
    }

    /// Device time of each pass that ran, as a mean over the frames in which it did.
    pub fn pass_times(&self) -> Vec<PassTime> {
        (0..)
            .zip(PASSES)
            .zip(self.pass_totals)
            .filter(|(_, total)| *total > 0.0)
            .map(|((pass, (name, _)), total)| {
                let frames = match pass {
                    DEFORM => self.deforms,
                    LIGHT | REDUCE | BOXES | VOLUME => self.light_draws,
                    READBACK => 1,
                    _ => self.frames,
                };
                PassTime {
                    pass: name.to_owned(),
                    milliseconds: total / f64::from(frames.max(1)),
                    frames,
                }
            })
            .collect()
    }

    /// Of each pass that ran in the last frame that is known to be done: its name, its device time (ms), and how often its
    /// fragment shader ran, where [`Renderer::invocations`] knows.
    pub fn last_passes(&self) -> Vec<(&'static str, f64, Option<u64>)> {
        let passes = PASSES
            .iter()
            .zip(self.last_times)
            .zip(self.last_invocations[self.collected]);
        let ran = passes.filter_map(|(((name, _), time), count)| Some((*name, time?, count)));
        ran.collect()
    }

    /// How often the fragment shader of `pass` ran in the last frame; none where it does not measure, where the device
    /// does not count, and of passes that dispatch.
    pub fn invocations(&self, pass: &str) -> Option<u64> {
        let pass = PASSES.iter().position(|(name, _)| *name == pass)?;
        let slot = self.frames.checked_sub(1)? as usize % FRAMES_IN_FLIGHT;
        self.last_invocations[slot][pass]
    }

    /// Linear RGBA radiance averaged over the frames, premultiplied by coverage, row-major.
    ///
    /// # Errors
    /// [`gpu::Error::Vulkan`] where the host cannot see it.
    pub fn radiance(&self) -> gpu::Result<Vec<[f32; 4]>> {
        Ok(bytemuck::pod_collect_to_vec(self.mean_readback.read()?))
    }

    /// The picture encoded for display: sRGB, straight alpha, row-major.
    ///
    /// # Errors
    /// As [`Renderer::radiance`].
    pub fn display(&self) -> gpu::Result<Vec<[u8; 4]>> {
        Ok(bytemuck::pod_collect_to_vec(self.display_readback.read()?))
    }
}

/// Which of the two means the frame after `done` others writes; it reads the other one.
fn mean_of(done: u32) -> usize {
    done as usize % 2
}

/// How `candidate` reads between texels of 32-bit floats.
pub fn filter_of(candidate: &Candidate) -> Filter {
    match candidate.linear_floats {
        true => Filter::Linear,
        false => Filter::Texels,
    }
}

/// boxes: the MIP pyramid, level by level. `before` has left level 0, which `after` reads.
#[rustfmt::skip] // A barrier is read as a sentence.
fn record_boxes(
    device: &Device,
    commands: vk::CommandBuffer,
    moments: &Image,
    boxes: &Boxes,
    pass: &BoxesPass,
    counters: Option<&Counters>,
    [before, after]: [Use; 2],
) {
    barrier::image(
        device, commands, c"RAW: level 1 is made of the light moments",
        moments, before, Use::COMPUTE_STORAGE,
    );
    barrier::image(
        device, commands, c"WAR: the previous frame shades from the boxes",
        &boxes.image, Use::FRAGMENT_SAMPLE.discarding(), Use::COMPUTE_STORAGE,
    );
    for level in 0..boxes.image.levels() {
        pass.record_level(commands, level);
        record_counted(device, commands, counters);
        barrier::levels(
            device, commands, c"RAW: the next level is made of this one, and shading samples it",
            &boxes.image, level..level + 1, Use::COMPUTE_STORAGE,
            Use::COMPUTE_STORAGE,
        );
    }
    barrier::image(
        device, commands, c"RAW: shading samples the boxes",
        &boxes.image, Use::COMPUTE_STORAGE, Use::FRAGMENT_SAMPLE,
    );
    barrier::image(
        device, commands, c"RAW, WAR: shading samples the light moments, which level 1 has read",
        moments, Use::COMPUTE_STORAGE, after,
    );
}

/// reduce: the pyramid level by level, then all levels smoothed at once.
/// `before` has written level 0; `after` reads the pyramid.
#[rustfmt::skip] // A barrier is read as a sentence.
fn record_reduce(
    device: &Device,
    commands: vk::CommandBuffer,
    moments: &Image,
    pyramid: &Pyramid,
    reduce: &ReducePass,
    counters: Option<&Counters>,
    [before, after]: [Use; 2],
) {
    let fourth = pyramid.fourth.as_ref();
    let moments: Vec<_> = std::iter::once(moments).chain(fourth.map(|f| &f.moments)).collect();
    let smoothed = || std::iter::once(&pyramid.smoothed).chain(fourth.map(|f| &f.smoothed));

    record_halving(device, commands, &moments, pyramid.atlas.levels(), reduce, counters, before);
    for image in smoothed() {
        barrier::image(
            device, commands, c"WAR: the previous frame shades from the smoothed moments",
            image, Use::FRAGMENT_SAMPLE, Use::COMPUTE_WRITE,
        );
    }
    reduce.smooth(commands);
    for image in smoothed() {
        barrier::image(
            device, commands, c"RAW: shading samples the smoothed moments",
            image, Use::COMPUTE_WRITE, Use::FRAGMENT_SAMPLE,
        );
    }
    for image in moments {
        barrier::image(
            device, commands, c"RAW: shading samples the light moments; WAR: smoothing has read them",
            image, Use::COMPUTE_STORAGE, after,
        );
    }
}

/// The pyramid, level by level; leaves the images to compute.
#[rustfmt::skip] // A barrier is read as a sentence.
fn record_halving(
    device: &Device,
    commands: vk::CommandBuffer,
    moments: &[&Image],
    levels: u32,
    reduce: &ReducePass,
    counters: Option<&Counters>,
    before: Use,
) {
    for image in moments {
        barrier::image(
            device, commands, c"RAW: level 1 and smoothing read level 0; WAR: the previous frame reads the others",
            image, before, Use::COMPUTE_STORAGE,
        );
    }
    // A dispatch writes none of the texels of an image that it reads.
    for level in 1..levels {
        reduce.decimate(commands, level);
        record_counted(device, commands, counters);
        for image in moments {
            barrier::image(
                device, commands, c"RAW: the next level and smoothing read this one",
                image, Use::COMPUTE_STORAGE, Use::COMPUTE_STORAGE,
            );
        }
    }
}

/// In a counting build, between dispatches of one shader and between frames.
#[rustfmt::skip] // A barrier is read as a sentence.
fn record_counted(device: &Device, commands: vk::CommandBuffer, counters: Option<&Counters>) {
    for counts in counters.into_iter().flat_map(Counters::buffers) {
        barrier::buffer(
            device, commands, c"WAW: the next dispatch, or frame, goes on counting",
            counts, COUNTING, COUNTING,
        );
    }
}

/// volume: the base grid, which samples the light moments, the others one by one, the volumes axis by axis, and
/// their image.
#[rustfmt::skip] // A barrier is read as a sentence.
fn record_volumes(
    device: &Device,
    commands: vk::CommandBuffer,
    light: &Light,
    pass: &VolumePass,
    frame: &LightFrame,
) {
    let Volumes { grids, volumes, .. } = &light.desc;
    barrier::buffer(
        device, commands, c"WAR, WAW: the previous frame makes and blurs its grids",
        &light.grids, Use::COMPUTE_STORAGE, Use::COMPUTE_STORAGE,
    );
    pass.deposit(commands, &grids[0], frame);
    // A dispatch writes none of the cells that it reads.
    for pair in grids.windows(2) {
        barrier::buffer(
            device, commands, c"RAW: the next grid is made of this one",
            &light.grids, Use::COMPUTE_STORAGE, Use::COMPUTE_STORAGE,
        );
        pass.halve(commands, &pair[0], &pair[1]);
    }
    barrier::buffer(
        device, commands, c"RAW: the blur along the columns reads the grids",
        &light.grids, Use::COMPUTE_STORAGE, Use::COMPUTE_STORAGE,
    );
    barrier::buffer(
        device, commands, c"WAR: the previous frame copies the volumes",
        &light.steps[0], Use::COPY_SOURCE, Use::COMPUTE_STORAGE,
    );
    let blur = |axis| {
        for volume in volumes {
            pass.blur(commands, &grids[volume.grid], volume, axis);
        }
    };
    blur(0);
    barrier::buffer(
        device, commands, c"RAW: the blur along the rows reads the first step",
        &light.steps[0], Use::COMPUTE_STORAGE, Use::COMPUTE_STORAGE,
    );
    barrier::buffer(
        device, commands, c"WAR: the previous frame blurs its second step along the depth",
        &light.steps[1], Use::COMPUTE_STORAGE, Use::COMPUTE_STORAGE,
    );
    blur(1);
    barrier::buffer(
        device, commands, c"RAW: the blur along the depth reads the second step",
        &light.steps[1], Use::COMPUTE_STORAGE, Use::COMPUTE_STORAGE,
    );
    barrier::buffer(
        device, commands, c"WAR: it writes what the blur along the rows has read",
        &light.steps[0], Use::COMPUTE_STORAGE, Use::COMPUTE_STORAGE,
    );
    blur(2);
    barrier::buffer(
        device, commands, c"RAW: the copy reads the volumes",
        &light.steps[0], Use::COMPUTE_STORAGE, Use::COPY_SOURCE,
    );
    barrier::image(
        device, commands, c"WAR: the previous frame shades from the volumes",
        &light.image, Use::FRAGMENT_SAMPLE, Use::COPY_TARGET,
    );
    for volume in volumes {
        let place = (volume.origin, grids[volume.grid].size);
        let from = (&light.steps[0], u64::from(volume.first));
        submit::record_part_upload(device, commands, from, &light.image, place);
    }
    barrier::image(
        device, commands, c"RAW: shading samples the volumes",
        &light.image, Use::COPY_TARGET, Use::FRAGMENT_SAMPLE,
    );
}
