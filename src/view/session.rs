//! What the window shows: the picture that is wanted, and the two renderers that draw it.
//!
//! While something moves, a small picture is drawn once for each frame of the window and joined with those before it; as
//! soon as all is still, the full one is averaged, frame by frame, exactly as `marmor render` does.

use super::Error;
use super::orbit::around;
use crate::frame::compose::Shown;
use crate::frame::panel::Panel;
use crate::frame::present::{Drawn, Presenter};
use crate::frame::watch::States;
use crate::frame::{self, Options, Renderer, Setup};
use crate::gpu::{self, Device};
use crate::ledger::budget::{self, Chosen};
use crate::ledger::{self, Filter};
use crate::scene::{Camera, Light, MeshSource, Method, Model, Motion, Plan, Request, Single};
use std::sync::Arc;

/// Behind the picture, where the scene puts nothing there: linear RGB of a neutral dark grey, against which both milk and
/// ketchup can be judged.
pub const BACKDROP: [f32; 3] = [0.0137, 0.0144, 0.0152];

/// How long may the device take for a frame while something moves, ms? At 25 a second a drag feels attached to the pointer.
const FLUID: f64 = 40.0;

/// The passes that run where something is covered.
const SHADING: [&str; 2] = [frame::SHADE_PASS, ledger::HALF_SHADE];

/// How many slow frames in a row make it smaller?
const SLOW: u32 = 12;

/// Shares of the picture's width and height that are drawn while something moves.
pub const SCALES: [f64; 4] = [1.0, 0.5, 1.0 / 3.0, 0.25];

/// At which size frames are drawn while something moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Draft {
    /// The largest that is fluid, by the time of the last full frame.
    #[default]
    Auto,
    /// The one at this place in [`SCALES`].
    Fixed(usize),
}

impl Draft {
    /// All that can be chosen.
    pub const ALL: [Draft; 1 + SCALES.len()] = [
        Draft::Auto,
        Draft::Fixed(0),
        Draft::Fixed(1),
        Draft::Fixed(2),
        Draft::Fixed(3),
    ];

    /// The names by which they are asked for, in the same order.
    pub const NAMES: [&str; Draft::ALL.len()] = ["auto", "full", "half", "third", "quarter"];
}

/// Frames that a still is averaged over where the scene does not say: noise and edges are then gone to the eye.
pub const FRAMES: u32 = 64;

/// A renderer and its picture.
struct Stage {
    // Dropped first: it waits for the queue, and then nothing reads its picture.
    renderer: Renderer,
    shown: Shown,
    plan: Plan,
    // Frames it has drawn of its plan.
    frames: u32,
}

/// What was drawn last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// A frame of what moves, at this place in [`SCALES`].
    Draft(usize),
    /// A still: frames averaged so far, and in all.
    Still(u32, u32),
}

/// Time and cost of one pass of the last frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Cost {
    /// The pass.
    pub pass: &'static str,
    /// Device time, ms.
    pub milliseconds: f64,
    /// Declared fetches a pixel, or a texel in passes over the light map.
    pub fetches: u32,
    /// How often its time is that of its fetches alone, where prices are known.
    pub over_floor: Option<f64>,
    /// Whether it is by the pixels that another view covers, the last that was whole.
    pub roughly: bool,
}

/// What the last frame cost.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Costs {
    /// Its passes, in turn.
    pub passes: Vec<Cost>,
    /// Fetches that it declares of a pixel.
    pub fetches: u32,
    /// Width and height of it, pixels.
    pub size: [u32; 2],
}

/// What the window shows, and how it came about.
pub struct Session {
    /// What is wanted. Whoever changes it need not ask whether it can be drawn: [`Session::fault`] says so.
    pub wanted: Request,
    /// The frame of an animation's loop that is shown.
    pub frame_number: u32,
    /// At which size frames are drawn while something moves.
    pub draft_size: Draft,
    /// Why what is wanted is not shown.
    pub fault: Option<String>,
    // What is wrong with the shaders as they are, while older ones draw.
    broken: Option<String>,
    // The last warning that was logged, and that nothing was drawn without since.
    warned: Option<String>,
    // Whether what is wanted cannot be drawn, and trying again would be in vain.
    stuck: bool,
    // Whether there is no plan of it.
    refused: bool,
    /// Which state of the shaders is drawn with, where they are watched.
    pub shaders: Option<States>,
    model: Arc<Model>,
    loaded: MeshSource,
    rows: Vec<budget::Row>,
    // What was wanted when the plan was made, and at which frame.
    planned: Option<(Request, u32)>,
    plan: Plan,
    chosen: Option<Chosen>,
    // What the picture lacks.
    warning: String,
    still: Option<Stage>,
    draft: Option<Stage>,
    // Whether the shaders have changed since a renderer was made.
    reload: bool,
    // Whether the plan is one that only serves a drag.
    steered: bool,
    // Share of the pixels that the last whole still covers, and by which camera at which frame.
    covered: f64,
    covered_by: Option<(Camera, u32)>,
    phase: Phase,
    // How many plans there were, and how many times what they draw has changed.
    version: u64,
    drawn: u64,
    auto_scale: usize,
    // Drafts in a row that were not fluid.
    slow: u32,
    prices: Vec<frame::probe::FetchCost>,
    filter: Filter,
    options: Options,
    device: Arc<Device>,
}

/// What is wanted at first, loaded and found fit to be drawn, whatever the device.
pub struct Loaded {
    wanted: Request,
    model: Arc<Model>,
    rows: Vec<budget::Row>,
}

impl Loaded {
    /// Loads what `wanted` names.
    ///
    /// # Errors
    /// What [`Request::plan`] refuses, a budget that no plan keeps, and the methods that are no matter of frames.
    pub fn new(wanted: Request) -> Result<Loaded, Error> {
        let rows = budget::table()?;
        let model = Arc::new(wanted.mesh.load()?);
        // Where all filter; others may want a larger budget.
        planned(&wanted, &model, &rows, Filter::Linear)?;
        Ok(Loaded {
            wanted,
            model,
            rows,
        })
    }
}

impl Session {
    /// Loads what `wanted` names, to be drawn on `device`.
    ///
    /// # Errors
    /// As [`Loaded::new`].
    pub fn new(options: &Options, device: &Arc<Device>, wanted: Request) -> Result<Session, Error> {
        Session::of(options, device, Loaded::new(wanted)?)
    }

    /// Draws what was `loaded` on `device`.
    ///
    /// # Errors
    /// A budget that is too small for the device.
    pub fn of(options: &Options, device: &Arc<Device>, loaded: Loaded) -> Result<Session, Error> {
        let Loaded {
            mut wanted,
            model,
            rows,
        } = loaded;
        let filter = frame::filter_of(device.candidate());
        let time = wanted.time.take();
        let frame_number = 0;
        let (plan, chosen) = planned(&wanted, &model, &rows, filter)?;
        let mut session = Session {
            frame_number,
            draft_size: Draft::Auto,
            fault: None,
            broken: None,
            warned: None,
            stuck: false,
            refused: false,
            shaders: None,
            loaded: wanted.mesh.clone(),
            planned: None,
            warning: String::new(),
            still: None,
            draft: None,
            reload: false,
            steered: false,
            covered: 0.5,
            covered_by: None,
            phase: Phase::Still(0, FRAMES),
            version: 0,
            drawn: 0,
            auto_scale: 1,
            slow: 0,
            prices: Vec::new(),
            device: Arc::clone(device),
            options: options.clone(),
            wanted,
            model,
            rows,
            plan,
            chosen,
            filter,
        };
        if let (Some(time), Some(motion)) = (time, session.motion()) {
            session.frame_number = (motion.within(time) * motion.fps()).round() as u32;
        }
        Ok(session)
    }

    /// The plan that is shown.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// How a budget chose its methods, if one did.
    pub fn chosen(&self) -> Option<&Chosen> {
        self.chosen.as_ref()
    }

    /// What `marmor render` warns of; empty if of nothing.
    pub fn warning(&self) -> &str {
        &self.warning
    }

    /// What moves, if anything does.
    pub fn motion(&self) -> Option<&Arc<Motion>> {
        self.plan.motion.as_ref()
    }

    /// The mesh that is loaded, and what may move it.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The camera that is shown.
    pub fn camera(&self) -> &Camera {
        &self.plan.scene.camera
    }

    /// The light that is wanted, at the frame of the animation that is shown.
    pub fn light(&self) -> Light {
        let mut light = self.wanted.light.clone();
        let Some(motion) = self.motion() else {
            return light;
        };
        let time = motion.time(self.frame_number);
        match self.wanted.animation.light_keys {
            Some(_) => light = motion.light(time),
            None => light.azimuth += motion.light_turned(time),
        }
        if light.azimuth.abs() > 180.0 {
            light.azimuth = around(light.azimuth);
        }
        light
    }

    /// Wants `light` at the frame that is shown; what turns it turns it on from there.
    pub fn aim(&mut self, mut light: Light) {
        if let Some(motion) = self.motion() {
            let turned = motion.light_turned(motion.time(self.frame_number));
            if turned != 0.0 {
                light.azimuth = around(light.azimuth - turned);
            }
        }
        self.wanted.animation.light_keys = None;
        self.wanted.light = light;
    }

    /// What was drawn last.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// How the device filters.
    pub fn filter(&self) -> Filter {
        self.filter
    }

    /// The device.
    pub fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// The number of the plan that is shown: another one where another picture is wanted, whatever is different about it.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// Changes as often as there is something new in the intermediate images: with each frame of what moves, and with the
    /// first and the last of a still, between which they only shift by parts of a texel.
    pub fn drawn(&self) -> u64 {
        self.drawn
    }

    /// Whether it is known what fetches cost here, or never will be.
    pub fn is_priced(&self) -> bool {
        !self.prices.is_empty() || self.device.candidate().timestamp_bits == 0
    }

    /// Takes over what each kind of fetch costs here.
    pub fn price(&mut self, prices: Vec<frame::probe::FetchCost>) {
        self.prices = prices;
    }

    /// Has everything drawn by the shaders as they are now.
    pub fn reload(&mut self) {
        self.reload = true;
    }

    /// Opens another scene, mesh or bundled name in place of this one; on a fault all stays as it is.
    ///
    /// # Errors
    /// As [`Session::new`].
    pub fn open(&mut self, source: &std::path::Path) -> Result<(), Error> {
        let mut wanted = Request::open(source)?;
        if MeshSource::is_mesh(source) {
            // A mesh alone says nothing of light and method: these stay as they are.
            let opened = std::mem::replace(&mut wanted, self.wanted.clone());
            wanted.show(&opened);
        }
        wanted.size = self.wanted.size;
        let session = Session::new(&self.options, &self.device, wanted)?;
        let old = std::mem::replace(self, session);
        self.draft_size = old.draft_size;
        self.auto_scale = old.auto_scale;
        self.prices = old.prices;
        (self.shaders, self.broken) = (old.shaders, old.broken);
        (self.version, self.drawn) = (old.version + 1, old.drawn + 1);
        // Shown until there is something else.
        self.still = old.still;
        self.planned = None;
        Ok(())
    }

    /// Frames that a still is averaged over.
    pub fn frames(&self) -> u32 {
        frames_of(&self.wanted)
    }

    /// Whether the still is whole.
    pub fn converged(&self) -> bool {
        matches!(self.phase, Phase::Still(done, of) if done >= of)
            && !self.behind(false)
            && !self.stuck
    }

    /// Whether there is nothing to do before something happens: the still is whole, or cannot be drawn.
    pub fn settled(&self) -> bool {
        self.converged() || self.is_stuck()
    }

    /// Whether what is wanted cannot be drawn.
    pub fn is_stuck(&self) -> bool {
        self.stuck && !self.behind(false)
    }

    /// Whether something else is wanted than the still that is shown, and no frame of it was drawn yet.
    pub fn waits(&self) -> bool {
        matches!(self.phase, Phase::Still(..)) && self.behind(false)
    }

    /// Whether what is wanted is drawn, if only by older shaders where the new ones do not compile.
    pub fn draws(&self) -> bool {
        !self.stuck
    }

    /// Whether nothing was ever drawn.
    pub fn is_empty(&self) -> bool {
        self.still.is_none() && self.draft.is_none()
    }

    /// Whether something other than what is shown is wanted.
    fn behind(&self, moving: bool) -> bool {
        let same = self
            .planned
            .as_ref()
            .is_some_and(|(request, frame)| *request == self.wanted && *frame == self.frame_number);
        !same || self.reload || (self.steered && !moving)
    }

    /// Has the picture drawn at `size` pixels.
    pub fn fit(&mut self, size: [u32; 2]) {
        self.wanted.size = size;
    }

    /// Draws the next frame of what is wanted: one of what moves if it is `moving`, else one more of the still, unless that
    /// is whole.
    ///
    /// # Errors
    /// What the device cannot recover from; all else is [`Session::fault`].
    pub fn draw(&mut self, presenter: &mut Presenter, moving: bool) -> Result<(), Error> {
        if self.behind(moving) {
            let planned = self.replan(moving);
            self.refused = planned.is_err();
            self.stuck = self.refused;
            match planned {
                Ok(()) => self.fault.clone_from(&self.broken),
                Err(error) => self.fault = Some(error.to_string()),
            }
            self.planned = Some((self.wanted.clone(), self.frame_number));
            if !moving && !self.stuck {
                self.phase = Phase::Still(0, self.frames());
            }
        }
        let drawn = if moving {
            self.draw_draft(presenter)
        } else {
            self.draw_still(presenter)
        };
        if drawn.is_ok() && self.stuck && !self.refused {
            // A draft that was not drawn says nothing of the still.
            self.stuck = false;
            self.fault.clone_from(&self.broken);
        }
        self.settle(drawn)
    }

    /// Turns what only this picture suffers from into a [`Session::fault`], and then says what `T` says of nothing.
    fn settle<T: Default>(&mut self, drawn: Result<T, Error>) -> Result<T, Error> {
        match drawn {
            Err(Error::Device(gpu::Error::Shader(message))) => self.suffer_shaders(message),
            Err(Error::Device(error)) if !error.is_fatal() => {
                self.suffer(frame::Error::from(error).to_string());
            }
            Err(Error::Input(message)) => self.suffer(message),
            drawn => {
                if self.fault.is_none() {
                    self.warned = None;
                }
                return drawn;
            }
        }
        self.stuck = true;
        Ok(T::default())
    }

    /// Makes what the compiler says of the shaders the fault, which lasts until they change.
    fn suffer_shaders(&mut self, message: String) {
        self.broken = Some(message.clone());
        self.suffer(message);
    }

    /// Makes `message` the fault, and logs it, once for as long as it lasts.
    fn suffer(&mut self, message: String) {
        if self.warned.as_ref() != Some(&message) {
            tracing::warn!("{message}");
            self.warned = Some(message.clone());
        }
        self.fault = Some(message);
    }

    /// Makes the plan of what is wanted.
    fn replan(&mut self, moving: bool) -> Result<(), Error> {
        if self.wanted.mesh != self.loaded {
            self.model = Arc::new(self.wanted.mesh.load()?);
            self.loaded = self.wanted.mesh.clone();
            self.frame_number = 0;
        }
        let mut asked = self.wanted.clone();
        let same_motion = |(before, _): &(Request, u32)| {
            before.animation == asked.animation
                && before.unit == asked.unit
                && before.mesh == asked.mesh
        };
        let steered = self.planned.as_ref().is_some_and(same_motion)
            && moving
            && asked.animation.light_keys.is_none()
            && asked.animation.camera_keys.is_none()
            && self.plan.motion.is_some();
        let (plan, chosen) = match self.plan.motion.clone().filter(|_| steered) {
            // Quick enough to follow a drag; what it leaves out is made up for as soon as all is still.
            Some(motion) => {
                check(&asked)?;
                asked.frames_averaged = Some(self.frames());
                let mut plan = asked
                    .plan_steered(&motion)?
                    .at(motion.time(self.frame_number));
                if let Some(chosen) = &self.chosen {
                    chosen.row.choice.apply(&mut plan);
                }
                (plan, self.chosen)
            }
            None => {
                let motion = self
                    .motion()
                    .filter(|motion| Arc::ptr_eq(&motion.model, &self.model));
                if let Some(motion) = motion {
                    asked.time = Some(motion.time(self.frame_number)).filter(|time| *time > 0.0);
                }
                planned(&asked, &self.model, &self.rows, self.filter)?
            }
        };
        (self.plan, self.chosen, self.steered) = (plan, chosen, steered);
        if !moving {
            self.warning = frame::warnings(&self.plan).join("; ");
        }
        self.version += 1;
        Ok(())
    }

    /// The plan as it is drawn while something moves.
    fn draft_plan(&self, scale: usize) -> Plan {
        let share = SCALES[scale];
        let mut plan = self.plan.clone();
        plan.size = plan
            .size
            .map(|side| ((f64::from(side) * share).round() as u32).max(1));
        if share < 1.0 {
            plan.light_map = (plan.light_map / 2).max(16);
        }
        plan.frames_averaged = 1;
        // Between pixels of a small picture edges must not show what lies behind them as black.
        let backdrop = BACKDROP.map(f64::from);
        plan.background = Some(plan.background.unwrap_or(backdrop));
        plan
    }

    /// The place in [`SCALES`] at which the next draft is drawn.
    fn scale(&self) -> usize {
        match self.draft_size {
            Draft::Fixed(scale) => scale.min(SCALES.len() - 1),
            Draft::Auto => self.auto_scale,
        }
    }

    /// While nothing happens: makes what the next drag will draw with, and has the driver compile it, so that it begins
    /// at once.
    ///
    /// # Errors
    /// As [`Session::draw`].
    pub fn warm(&mut self, presenter: &mut Presenter) -> Result<(), Error> {
        let plan = self.draft_plan(self.scale());
        let fits = self
            .draft
            .as_ref()
            .is_some_and(|stage| stage.plan.size == plan.size);
        if fits || !self.converged() || self.fault.is_some() {
            return Ok(());
        }
        let warmed = self.warm_draft(presenter, &plan);
        self.settle(warmed)
    }

    /// Draws a draft that is not shown.
    fn warm_draft(&mut self, presenter: &mut Presenter, plan: &Plan) -> Result<(), Error> {
        let Some(stage) = self.stage(presenter, plan, true)? else {
            return Ok(());
        };
        stage.renderer.draw_live(stage.frames, false)?;
        stage.renderer.forget_history();
        stage.frames += 1;
        Ok(())
    }

    fn draw_draft(&mut self, presenter: &mut Presenter) -> Result<(), Error> {
        let (scale, frame_number) = (self.scale(), self.frame_number);
        let plan = self.draft_plan(scale);
        let Some(stage) = self.stage(presenter, &plan, true)? else {
            return Ok(());
        };
        if let Some(motion) = &plan.motion {
            let moment = motion.moment(motion.time(frame_number), plan.light_map);
            stage.renderer.show(&moment);
        }
        stage.renderer.draw_live(stage.frames, false)?;
        stage.frames = stage.frames.wrapping_add(1);
        let time = stage.time();
        self.phase = Phase::Draft(scale);
        // What plays may never stand still long enough to be measured so.
        let slow = self.draft_size == Draft::Auto && time > FLUID;
        self.slow = if slow { self.slow + 1 } else { 0 };
        if self.slow > SLOW && scale + 1 < SCALES.len() {
            (self.auto_scale, self.slow) = (scale + 1, 0);
        }
        self.drawn += 1;
        Ok(())
    }

    fn draw_still(&mut self, presenter: &mut Presenter) -> Result<(), Error> {
        let frames = self.frames();
        if self.converged() {
            return Ok(());
        }
        let plan = self.plan.clone();
        let Some(stage) = self.stage(presenter, &plan, false)? else {
            return Ok(());
        };
        if stage.frames < frames {
            stage.renderer.accumulate(stage.frames)?;
            stage.frames += 1;
        }
        let done = stage.frames;
        // The first frames compile.
        if done > 2 {
            // All but what the light alone costs falls with the area; a draft's light map costs a quarter.
            let fluid = FLUID / stage.time().max(1e-3);
            let fits = SCALES.iter().position(|scale| scale * scale <= fluid);
            self.auto_scale = fits.unwrap_or(SCALES.len() - 1);
        }
        self.phase = Phase::Still(done, frames);
        self.drawn += u64::from(done == 1 || done == frames);
        if done == frames {
            let [width, height] = self.plan.size;
            tracing::info!("still: {frames} frames, {width}x{height} pixels");
            if let Some(read) = self.read()? {
                let covered = read.radiance.iter().filter(|pixel| pixel[3] > 0.0);
                self.covered = covered.count() as f64 / read.radiance.len().max(1) as f64;
                self.covered_by = Some((self.plan.scene.camera.clone(), self.frame_number));
            }
        }
        Ok(())
    }

    /// The stage of drafts or of stills, ready for `plan`; none while the window has no area.
    fn stage(
        &mut self,
        presenter: &mut Presenter,
        plan: &Plan,
        live: bool,
    ) -> Result<Option<&mut Stage>, Error> {
        if std::mem::take(&mut self.reload) {
            self.shaders.iter().for_each(States::follow);
            match self.renew(presenter) {
                Err(Error::Device(gpu::Error::Shader(message))) => {
                    // Those of before go on, for whatever is drawn meanwhile.
                    self.shaders.iter().for_each(States::hold);
                    self.suffer_shaders(message);
                }
                renewed => {
                    renewed?;
                    self.shaders.iter().for_each(States::accept);
                }
            }
        }
        let slot = match live {
            true => &mut self.draft,
            false => &mut self.still,
        };
        if !slot.as_mut().is_some_and(|own| own.serves(plan, live)) {
            // The old one stays until then, lest a fault leave nothing to show.
            let new = Stage::new(&self.options, &self.device, presenter, plan, live)?;
            if new.is_none() {
                return Ok(None);
            }
            *slot = new;
        }
        Ok(slot.as_mut())
    }

    /// Makes the renderers anew, from the shaders as they are; if that fails, the old ones stay.
    fn renew(&mut self, presenter: &mut Presenter) -> Result<(), Error> {
        if self.fault == self.broken {
            self.fault = None;
        }
        self.broken = None;
        let mut anew = |old: &Option<Stage>, live| match old {
            Some(old) => Stage::new(&self.options, &self.device, presenter, &old.plan, live),
            None => Ok(None),
        };
        let (still, draft) = (anew(&self.still, false)?, anew(&self.draft, true)?);
        presenter.reload()?;
        // All or none, lest one that has not drawn yet be shown.
        self.still = still.or(self.still.take());
        self.draft = draft.or(self.draft.take());
        Ok(())
    }

    fn shown(&mut self) -> Option<&mut Stage> {
        // One that has drawn nothing yet has nothing to show.
        let drawn = |stage: &&mut Stage| stage.frames > 0;
        let still = self.still.as_mut().filter(drawn);
        let draft = self.draft.as_mut().filter(drawn);
        match self.phase {
            Phase::Draft(_) => draft.or(still),
            Phase::Still(..) => still.or(draft),
        }
    }

    /// Shows what was drawn last in columns and rows `place` (x, y, width, height) of the window, and over it `panel`.
    ///
    /// # Errors
    /// What the device cannot recover from.
    pub fn present(
        &mut self,
        presenter: &mut Presenter,
        place: [i32; 4],
        panel: &Panel,
    ) -> Result<Drawn, Error> {
        let Some(stage) = self.shown() else {
            return Ok(Drawn::Skipped);
        };
        Ok(presenter.draw((&mut stage.renderer, &stage.shown), place, BACKDROP, panel)?)
    }

    /// Moves the divider of a split picture, without making anything anew.
    pub fn split_at(&mut self, share: f64) {
        self.wanted.split_at = share;
    }

    /// What a picture of the whole still reads back as: its size, linear radiance and bytes for display.
    ///
    /// # Errors
    /// What the device says.
    pub fn read(&mut self) -> Result<Option<Read>, Error> {
        let Some(stage) = self.still.as_mut().filter(|stage| stage.frames > 0) else {
            return Ok(None);
        };
        stage.renderer.read_mean(stage.frames - 1)?;
        Ok(Some(Read {
            size: stage.plan.size,
            radiance: stage.renderer.radiance()?,
            display: stage.renderer.display()?,
        }))
    }

    /// The request whose picture `marmor render` draws as the still is.
    pub fn request(&self) -> Request {
        let time = self.motion().map(|motion| motion.time(self.frame_number));
        Request {
            frames_averaged: Some(self.frames()),
            time: time.filter(|time| *time > 0.0),
            ..self.wanted.clone()
        }
    }

    /// An intermediate image of the last frame, for looking at.
    ///
    /// # Errors
    /// What the device says.
    pub fn intermediate(&mut self, target: frame::Target) -> Result<Option<Intermediate>, Error> {
        let Some(stage) = self.shown() else {
            return Ok(None);
        };
        let texels = stage.renderer.read(target)?;
        Ok(Some(Intermediate {
            texels,
            plan: stage.plan.clone(),
        }))
    }

    /// What the last frame cost that is known to be done; none before there is one.
    pub fn costs(&mut self) -> Option<Costs> {
        let (filter, prices) = (self.filter, self.prices.clone());
        let (draft, covered) = (matches!(self.phase, Phase::Draft(_)), self.covered);
        let seen = self.covered_by.as_ref().is_some_and(|(camera, at)| {
            *camera == self.plan.scene.camera && *at == self.frame_number
        });
        let stage = self.shown()?;
        let declared = match draft {
            true => ledger::declared_live(&stage.plan, filter),
            false => ledger::declared(&stage.plan, filter),
        };
        let passes = stage.renderer.last_passes();
        let [width, height] = stage.plan.size.map(f64::from);
        let fetched = frame::cases::Fetched {
            plan: &stage.plan,
            declared: &declared,
            filter,
            covered: covered * width * height,
            costs: &prices,
        };
        let costs = passes.iter().map(|&(pass, milliseconds, _)| {
            // Of a split picture the ledger declares what the dearer side reads, and how many pixels that has nobody knows.
            let shared = stage.plan.split.is_some() && pass == frame::SHADE_PASS;
            let floor = fetched.floor(pass).filter(|_| !shared);
            let lines = declared.iter().filter(|line| line.pass == pass);
            let read = lines.filter(|line| ledger::counts(line.term) || line.term == ledger::TEXEL);
            Cost {
                pass,
                milliseconds,
                fetches: read.map(|line| line.per_pixel).sum(),
                over_floor: floor.map(|floor| milliseconds / floor),
                roughly: !seen && SHADING.contains(&pass),
            }
        });
        let costs = Costs {
            passes: costs.collect(),
            fetches: ledger::total(&declared),
            size: stage.plan.size,
        };
        (!costs.passes.is_empty()).then_some(costs)
    }

    /// Fetches a pixel that the plan declares.
    pub fn fetches(&self) -> u32 {
        ledger::total(&ledger::declared(&self.plan, self.filter))
    }
}

/// A picture, read back.
pub struct Read {
    /// Columns and rows.
    pub size: [u32; 2],
    /// Linear RGBA radiance, premultiplied by coverage, row-major.
    pub radiance: Vec<[f32; 4]>,
    /// sRGB with straight alpha, row-major.
    pub display: Vec<[u8; 4]>,
}

/// An intermediate image, read back, and the plan that it belongs to.
pub struct Intermediate {
    /// Up to four floats a texel, row-major.
    pub texels: Vec<[f32; 4]>,
    /// What was drawn.
    pub plan: Plan,
}

impl Stage {
    /// Whether it draws `plan`, from now on if not before.
    fn serves(&mut self, plan: &Plan, live: bool) -> bool {
        if self.plan == *plan {
            return true;
        }
        let adopts = self.renderer.adopt(plan);
        if adopts {
            self.plan.clone_from(plan);
            if !live {
                self.frames = 0;
            }
        }
        adopts
    }

    /// Device time of the last frame that is known to be done, ms.
    fn time(&self) -> f64 {
        let passes = self.renderer.last_passes();
        passes.iter().map(|(_, milliseconds, _)| milliseconds).sum()
    }

    fn new(
        options: &Options,
        device: &Arc<Device>,
        presenter: &mut Presenter,
        plan: &Plan,
        live: bool,
    ) -> Result<Option<Stage>, Error> {
        frame::check_fit(options, plan, device.candidate(), live)?;
        let setup = Setup {
            live,
            measure: true,
            ..Setup::default()
        };
        let renderer = Renderer::new(device, plan, &setup)?;
        let shown = presenter.shown(&renderer)?;
        Ok(shown.map(|shown| Stage {
            renderer,
            shown,
            plan: plan.clone(),
            frames: 0,
        }))
    }
}

/// Frames that a still of `request` is averaged over.
fn frames_of(request: &Request) -> u32 {
    request.frames_averaged.unwrap_or(FRAMES)
}

/// Refuses what no frame of a window can draw.
fn check(request: &Request) -> Result<(), Error> {
    if request.fetch_budget.is_none()
        && (request.multiple == Method::Exact || request.split == Some(Method::Exact))
    {
        return Err(Error::Input(
            "exact takes minutes: choose another method, and see its error against exact in the window (E), or `marmor render --multiple exact`"
                .to_owned(),
        ));
    }
    if request.single == Single::Traced {
        return Err(Error::Input(
            "traced single scattering is for `marmor render`; choose --single 8".to_owned(),
        ));
    }
    Ok(())
}

/// The plan of `request` for `model`, and how a budget chose its methods.
fn planned(
    request: &Request,
    model: &Arc<Model>,
    rows: &[budget::Row],
    filter: Filter,
) -> Result<(Plan, Option<Chosen>), Error> {
    check(request)?;
    // The still's frames: to add them up is one fetch more.
    let request = Request {
        frames_averaged: Some(frames_of(request)),
        ..request.clone()
    };
    let plan = request.plan_of(model)?;
    let Some(budget) = request.fetch_budget else {
        return Ok((plan, None));
    };
    let (plan, chosen) = budget::choose(rows, &plan, budget, filter)?;
    Ok((plan, Some(chosen)))
}

impl From<gpu::Error> for Error {
    fn from(error: gpu::Error) -> Self {
        Error::Device(error)
    }
}

impl From<frame::Error> for Error {
    fn from(error: frame::Error) -> Self {
        match error {
            frame::Error::TooLarge(message) | frame::Error::Shader(message) => {
                Error::Input(message)
            }
            error => Error::Start(error.to_string()),
        }
    }
}

impl From<crate::scene::Error> for Error {
    fn from(error: crate::scene::Error) -> Self {
        Error::Input(error.to_string())
    }
}

impl From<budget::Error> for Error {
    fn from(error: budget::Error) -> Self {
        Error::Input(error.to_string())
    }
}
