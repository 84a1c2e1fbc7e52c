//! The system's window: its events, and its frames.

use super::panel::{Facts, Panel};
use super::session::{Costs, Loaded, Phase, Session};
use super::timing::{Clock, Frame, Timing};
use super::worker::Worker;
use super::{Error, Settings, Summary, events, paint, save, style};
use crate::frame::present::{Drawn, Presenter};
use crate::frame::watch::Watcher;
use crate::frame::{self, Options, panel as drawn};
use crate::gpu::Tally;
use crate::scene::Request;
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::raw_window_handle::{HasDisplayHandle, HasWindowHandle};
use winit::window::{Window, WindowId};

/// How long after the last event does a still wait before it goes on? So long the panel alone is drawn, and answers at
/// once.
const QUIET: Duration = Duration::from_millis(100);

/// From how long on is a frame so slow that -vv tells what took its time, ms?
const SLOW: f64 = 250.0;

/// How often does a window that cannot be drawn try again?
const HIDDEN: Duration = Duration::from_millis(200);

/// Messages of the validation layer that are kept to be shown.
const MESSAGES: usize = 20;

/// What wakes the event loop.
#[derive(Clone, Copy, Debug)]
pub enum Wake {
    /// Something that the window shows has changed elsewhere.
    Redraw,
}

/// Opens the window and runs it.
pub fn run(options: &Options, request: Request, settings: &Settings) -> Result<Summary, Error> {
    // First: what cannot be drawn is told before a window flashes up, or where none can.
    let loaded = Loaded::new(request)?;
    let proxy = Arc::new(OnceLock::<EventLoopProxy<Wake>>::new());
    let waker = Arc::clone(&proxy);
    let wake = move || {
        // A loop that has ended wants no waking.
        let _ = waker.get().map(|proxy| proxy.send_event(Wake::Redraw));
    };
    let watcher = settings.watch.as_deref();
    let watcher = watcher
        .map(|folder| Watcher::new(folder, wake))
        .transpose()?;
    let event_loop = EventLoop::<Wake>::with_user_event().build().map_err(|error| {
        // The whole of it is several lines of reasons.
        let reason = error.to_string();
        let reason = reason.lines().next().unwrap_or_default();
        // Where in its sources it gave up is of no use here: "os error at FILE:LINE: REASON".
        let reason = reason
            .strip_prefix("os error at ")
            .and_then(|rest| rest.split_once(": "))
            .map_or(reason, |(_, reason)| reason);
        let reason = reason.trim_end_matches('.');
        Error::Start(format!(
            "no display to open a window on ({reason}): run it in a desktop session, set DISPLAY or WAYLAND_DISPLAY, or \
             draw to a file with `marmor render`"
        ))
    })?;
    let _ = proxy.set(event_loop.create_proxy());
    let mut app = App {
        proxy: event_loop.create_proxy(),
        options,
        settings,
        loaded: Some((loaded, watcher)),
        running: None,
        result: Ok(Summary::default()),
    };
    event_loop
        .run_app(&mut app)
        .map_err(|error| Error::Start(format!("the display has gone ({error})")))?;
    app.result
}

struct App<'a> {
    proxy: EventLoopProxy<Wake>,
    options: &'a Options,
    settings: &'a Settings,
    loaded: Option<(Loaded, Option<Watcher>)>,
    running: Option<Running>,
    result: Result<Summary, Error>,
}

impl App<'_> {
    fn end(&mut self, event_loop: &ActiveEventLoop, fault: Option<Error>) {
        if let Some(running) = self.running.take() {
            self.result = Ok(running.summary());
        }
        if let Some(fault) = fault {
            self.result = Err(fault);
        }
        event_loop.exit();
    }
}

impl ApplicationHandler<Wake> for App<'_> {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        // Once; a desktop never takes the window away again.
        let Some((loaded, watcher)) = self.loaded.take() else {
            return;
        };
        let proxy = self.proxy.clone();
        match Running::open(
            event_loop,
            proxy,
            self.options,
            self.settings,
            loaded,
            watcher,
        ) {
            Ok(running) => self.running = Some(running),
            Err(fault) => self.end(event_loop, Some(fault)),
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, _: Wake) {
        if let Some(running) = &self.running {
            running.window.request_redraw();
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(running) = &mut self.running else {
            return;
        };
        match running.handle(&event) {
            Ok(true) => {}
            Ok(false) => self.end(event_loop, None),
            Err(fault) => self.end(event_loop, Some(fault)),
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let Some(running) = &self.running else { return };
        match running.next {
            Next::Now => running.window.request_redraw(),
            Next::At(instant) if instant <= Instant::now() => running.window.request_redraw(),
            _ => {}
        }
        event_loop.set_control_flow(match running.next {
            Next::Now => ControlFlow::Poll,
            Next::At(instant) => ControlFlow::WaitUntil(instant),
            Next::Asked => ControlFlow::Wait,
        });
    }
}

/// When the next frame is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Next {
    Now,
    At(Instant),
    /// When something happens.
    Asked,
}

/// The open window. Fields are dropped in turn: what draws before what it draws on.
struct Running {
    // Its thread ends before anything goes that it may use.
    worker: Worker,
    session: Session,
    presenter: Presenter,
    panel: Panel,
    egui: egui_winit::State,
    context: egui::Context,
    timing: Timing,
    next: Next,
    // When something last happened in the window.
    touched: Instant,
    // What the next frame takes in.
    later: Vec<egui::Event>,
    // Of a frame that was skipped: textures of the panel that are still to come, and to go.
    carried: drawn::Panel,
    // What was made of the device when -vv last told of it.
    tally: Tally,
    // The last of the validation layer, and how many there were.
    messages: Vec<String>,
    complaints: usize,
    saves: PathBuf,
    // What the last frame cost that is known to be done; the first of another renderer is not, yet.
    costs: Costs,
    // Whether the picture is to be saved once it is whole.
    saving: bool,
    // Sees the shaders change, where they are watched.
    watcher: Option<Watcher>,
    window: Arc<Window>,
}

impl Running {
    fn open(
        event_loop: &ActiveEventLoop,
        proxy: EventLoopProxy<Wake>,
        options: &Options,
        settings: &Settings,
        loaded: Loaded,
        watcher: Option<Watcher>,
    ) -> Result<Running, Error> {
        let [width, height] = settings.size;
        let attributes = Window::default_attributes()
            .with_title("marmor")
            .with_inner_size(PhysicalSize::new(width, height))
            .with_min_inner_size(PhysicalSize::new(480, 320));
        let window = event_loop
            .create_window(attributes)
            .map_err(|error| Error::Start(format!("the display opens no window ({error})")))?;
        let window = Arc::new(window);
        let handles = window
            .display_handle()
            .and_then(|display| Ok((display.as_raw(), window.window_handle()?.as_raw())))
            .map_err(|error| Error::Start(format!("the window cannot be drawn on ({error})")))?;
        let (device, surface) = frame::open_window(options, handles)?;
        let mut session = Session::of(options, &device, loaded)?;
        session.draft_size = settings.in_motion;
        if let Some(watcher) = &watcher {
            device.set_shader_source(Some(watcher.source()));
            // Of what is drawn first, the folder as it is now is taken.
            let states = watcher.states();
            states.accept();
            session.shaders = Some(states);
        }
        let size = window.inner_size().into();
        let presenter = Presenter::new(&device, &surface, size, settings.present)?;
        let context = egui::Context::default();
        style::dress(&context);
        let side = device.candidate().limits.max_image_dimension2_d as usize;
        let egui = egui_winit::State::new(
            context.clone(),
            egui::ViewportId::ROOT,
            &*window,
            Some(window.scale_factor() as f32),
            None,
            Some(side),
        );
        let panel = Panel::new(&session);
        let wake = move || {
            // Where the loop has ended there is no one to wake.
            let _ = proxy.send_event(Wake::Redraw);
        };
        let worker = Worker::new(options, &device, wake)?;
        window.request_redraw();
        Ok(Running {
            worker,
            session,
            presenter,
            panel,
            egui,
            context,
            timing: Timing::default(),
            next: Next::Now,
            touched: Instant::now(),
            later: Vec::new(),
            carried: drawn::Panel::default(),
            tally: Tally::default(),
            messages: Vec::new(),
            complaints: 0,
            costs: Costs::default(),
            saves: settings.saves.clone(),
            saving: false,
            watcher,
            window,
        })
    }

    fn summary(&self) -> Summary {
        tracing::info!(
            "closed: {} frames, the longest {:.0} ms, {} validation messages",
            self.timing.count,
            self.timing.longest,
            self.complaints
        );
        Summary {
            frames: self.timing.count,
            longest: self.timing.longest,
            messages: self.complaints,
        }
    }

    /// Takes an event in; false closes the window.
    fn handle(&mut self, event: &WindowEvent) -> Result<bool, Error> {
        let response = self.egui.on_window_event(&self.window, event);
        match event {
            WindowEvent::CloseRequested | WindowEvent::Destroyed => return Ok(false),
            WindowEvent::RedrawRequested => {
                return self.redraw().map(|()| !self.panel.quits);
            }
            WindowEvent::Resized(size) => {
                self.presenter.resize((*size).into());
                self.next = Next::Now;
            }
            WindowEvent::DroppedFile(path) => {
                match self.session.open(path) {
                    Ok(()) => {
                        self.panel = Panel::new(&self.session);
                        self.panel.say(format!("opened {}", path.display()));
                    }
                    Err(fault @ Error::Device(_)) => return Err(fault),
                    Err(fault) => self.panel.complain(fault.to_string()),
                }
                self.next = Next::Now;
            }
            _ => {}
        }
        if response.repaint {
            self.touched = Instant::now();
            self.next = Next::Now;
        }
        Ok(true)
    }

    fn redraw(&mut self) -> Result<(), Error> {
        let mut clock = Clock::start();
        self.presenter.resize(self.window.inner_size().into());
        self.hear();
        // The panel first: it says what is wanted, and where the picture has its place.
        let (triangles, repaint) = self.lay_out();

        let (scale, size) = (triangles.scale, self.window.inner_size().into());
        let [x, y, width, height] = paint::pixels(self.panel.viewport(), scale, size);
        let visible = width > 0 && height > 0;
        if visible {
            // A window of another size wants another picture.
            self.session.fit([width, height]);
        }
        let moving = self.panel.moving();
        let quiet = moving || self.touched.elapsed() > QUIET || self.timing.count < 2;
        let draws = visible && quiet && (moving || !self.session.converged());
        let status = |session: &Session| (session.phase(), session.waits(), session.fault.clone());
        let told = status(&self.session);
        clock.lap("panel");
        if draws {
            self.session.draw(&mut self.presenter, moving)?;
        }
        clock.lap("picture");
        let place = [x, y, width, height].map(|side| side as i32);
        if let (true, true, Some(fault)) = (draws, self.session.is_empty(), &self.session.fault) {
            // There is no picture to show it beside.
            return Err(Error::Input(fault.clone()));
        }
        self.window.pre_present_notify();
        let drawn = self
            .session
            .present(&mut self.presenter, place, &triangles)?;
        if drawn == Drawn::Skipped {
            self.carried.new = triangles.new;
            self.carried.gone = triangles.gone;
        }
        clock.lap("window");
        self.save_if_whole()?;
        // Not beside a picture: each takes its time.
        if visible && quiet && !draws {
            self.session.warm(&mut self.presenter)?;
        }
        let news = self.panel.ask(&mut self.worker, &self.session);
        clock.lap("what follows");

        let now = Instant::now();
        let settled = self.session.settled();
        self.next = if drawn == Drawn::Skipped {
            Next::At(now + HIDDEN)
        } else if moving
            || news
            || repaint.is_zero()
            || !self.later.is_empty()
            || std::mem::take(&mut self.panel.fresh)
            || told != status(&self.session)
        {
            // What has changed since the panel was laid out, it has yet to tell.
            Next::Now
        } else if !settled {
            if quiet {
                Next::Now
            } else {
                Next::At(self.touched + QUIET + Duration::from_millis(1))
            }
        } else {
            now.checked_add(repaint.min(Duration::from_secs(3600)))
                .map_or(Next::Asked, Next::At)
        };
        self.timing.push(Frame {
            milliseconds: clock.milliseconds(),
            picture: draws,
        });
        if clock.milliseconds() > SLOW {
            let (count, phase) = (self.timing.count, self.session.phase());
            tracing::debug!("frame {count}, {phase:?}, was slow: {clock}");
        }
        self.tell_tally();
        Ok(())
    }

    /// At -vv: what is held of the device, whenever something was made.
    fn tell_tally(&mut self) {
        if !tracing::enabled!(tracing::Level::DEBUG) {
            return;
        }
        let device = self.session.device();
        let tally = device.tally();
        if tally != self.tally {
            self.tally = tally;
            let [held, used] = [device.bytes_held(), device.bytes_in_use()]
                .map(|bytes| bytes as f64 / f64::from(1 << 20));
            tracing::debug!("{tally}; device memory {held:.1} MiB, {used:.1} of them in use");
        }
    }

    /// Takes in what was said elsewhere since the last frame.
    fn hear(&mut self) {
        for message in self.session.device().instance().take_messages() {
            tracing::warn!("validation: {message}");
            self.complaints += 1;
            if self.messages.len() == MESSAGES {
                self.messages.remove(0);
            }
            self.messages.push(message);
        }
        if self.watcher.as_ref().is_some_and(Watcher::changed) {
            tracing::info!("the shaders have changed");
            self.session.reload();
        }
        self.panel.hear(&mut self.worker, &mut self.session);
    }

    /// Lays the panel out, and does what was asked of it; what of it is drawn, and when it wants to be laid out again.
    fn lay_out(&mut self) -> (drawn::Panel, Duration) {
        let mut input = self.egui.take_egui_input(&self.window);
        input.events.splice(0..0, std::mem::take(&mut self.later));
        self.later = events::split(&mut input.events);
        let device = Arc::clone(self.session.device());
        if let Some(costs) = self.session.costs() {
            self.costs = costs;
        }
        let facts = Facts {
            timing: &self.timing,
            costs: &self.costs,
            compose: self.presenter.milliseconds(),
            mode: self.presenter.mode(),
            messages: &self.messages,
            validation: device.instance().validation(),
            saving: self.saving,
        };
        let (panel, session) = (&mut self.panel, &mut self.session);
        let output = self
            .context
            .run_ui(input, |ui| panel.show(ui, session, &facts));
        self.egui
            .handle_platform_output(&self.window, output.platform_output);
        let scale = output.pixels_per_point;
        let triangles = self.context.tessellate(output.shapes, scale);
        let size: [u32; 2] = self.window.inner_size().into();
        let mut triangles = paint::panel(output.textures_delta, triangles, scale, size);
        // What a whole texture takes the place of is not copied any more.
        let whole = |old: &drawn::Texels| {
            let mut new = triangles.new.iter();
            new.any(|new| new.texture == old.texture && new.origin.is_none())
        };
        self.carried.new.retain(|old| !whole(old));
        triangles
            .new
            .splice(0..0, std::mem::take(&mut self.carried.new));
        triangles.gone.append(&mut self.carried.gone);
        // Whoever asks again does not want it any more.
        self.saving ^= std::mem::take(&mut self.panel.saves);
        let repaint = output
            .viewport_output
            .get(&egui::ViewportId::ROOT)
            .map_or(Duration::MAX, |viewport| viewport.repaint_delay);
        (triangles, repaint)
    }

    /// Saves the picture, if that was asked for and it is whole.
    fn save_if_whole(&mut self) -> Result<(), Error> {
        if self.saving && self.session.is_stuck() {
            self.saving = false;
            self.panel
                .complain("not saved: what is wanted is not shown".to_owned());
        }
        if !self.saving || !self.session.converged() {
            return Ok(());
        }
        self.saving = false;
        let Some(read) = self.session.read()? else {
            return Ok(());
        };
        match save::save(&self.saves, &self.session.request(), &read) {
            Ok(path) => self.panel.say(format!("saved {}", path.display())),
            Err(fault) => self.panel.complain(fault.to_string()),
        }
        debug_assert!(matches!(self.session.phase(), Phase::Still(..)));
        Ok(())
    }
}
