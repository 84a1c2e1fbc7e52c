//! What stands beside the picture: what is wanted, and what it costs.

mod controls;
mod costs;
mod help;
mod look;

use super::orbit;
use super::session::{Phase, SCALES, Session};
use super::style;
use super::timing::Timing;
use super::worker::Worker;
use crate::gpu::PresentMode;
use crate::scene::{Deformer, Method, Scattering, Viewpoint};
use egui::{
    Color32, CursorIcon, Key, PointerButton, Rect, Response, Sense, Stroke, Ui, pos2, vec2,
};
use glam::DVec2;
use std::time::{Duration, Instant};

/// What the panel shows that it cannot know.
pub struct Facts<'a> {
    /// The last frames of the window.
    pub timing: &'a Timing,
    /// What the passes of the last picture cost.
    pub costs: &'a super::session::Costs,
    /// Device time of composing the window, ms.
    pub compose: Option<f64>,
    /// How frames are shown.
    pub mode: Option<PresentMode>,
    /// What the validation layer has said.
    pub messages: &'a [String],
    /// Whether it watches.
    pub validation: bool,
    /// Whether the picture is to be saved once it is whole.
    pub saving: bool,
}

/// How long after the wheel has turned does something still move, s? So long one waits for the next notch.
const WHEEL: Duration = Duration::from_millis(250);

/// How long a message stays.
const MESSAGE: Duration = Duration::from_secs(6);

/// The panel, and what one does to the picture.
pub struct Panel {
    /// Whether the window is to close.
    pub quits: bool,
    /// Whether the picture is to be saved.
    pub saves: bool,
    viewport: Rect,
    // What is dragged, if anything is.
    dragging: bool,
    moved: Option<Instant>,
    playing: Option<Playing>,
    help: bool,
    costs: bool,
    controls: controls::Memory,
    message: Option<(String, bool, Instant)>,
    /// Whether there is a message that was not laid out yet.
    pub fresh: bool,
    look: look::Look,
}

/// A clip that plays: since when, and from which frame.
#[derive(Clone, Copy)]
struct Playing {
    since: Instant,
    from: u32,
}

impl Panel {
    /// The panel of a session that begins; what moves plays.
    pub fn new(session: &Session) -> Panel {
        let plays = session.motion().is_some() && session.frame_number == 0;
        let playing = plays.then(|| Playing {
            since: Instant::now(),
            from: 0,
        });
        Panel {
            quits: false,
            saves: false,
            viewport: Rect::NOTHING,
            dragging: false,
            moved: None,
            playing,
            help: false,
            costs: true,
            controls: controls::Memory::new(session),
            message: None,
            fresh: false,
            look: look::Look::default(),
        }
    }

    /// Takes in what the worker has to say, before the panel is laid out.
    pub fn hear(&mut self, worker: &mut Worker, session: &mut Session) {
        if let Some(fault) = self.look.hear(worker, session) {
            self.complain(fault);
        }
    }

    /// Has the worker do what is wanted, once the picture is drawn; whether the panel is to be laid out again at once.
    pub fn ask(&mut self, worker: &mut Worker, session: &Session) -> bool {
        self.look.ask(worker, session)
    }

    /// Where the picture has its place, points.
    pub fn viewport(&self) -> Rect {
        self.viewport
    }

    /// Whether something moves, so that drafts are drawn.
    pub fn moving(&self) -> bool {
        self.dragging
            || self.playing.is_some()
            || self.moved.is_some_and(|moved| moved.elapsed() < WHEEL)
    }

    /// Says for a while that something was done.
    pub fn say(&mut self, message: String) {
        self.message = Some((message, false, Instant::now()));
        self.fresh = true;
    }

    /// Says for a while what went wrong.
    pub fn complain(&mut self, message: String) {
        self.message = Some((message, true, Instant::now()));
        self.fresh = true;
    }

    /// What was said last, unless that was long ago, and whether it tells what went wrong.
    fn told(&self) -> Option<(&String, bool)> {
        let message = self.message.as_ref();
        let told = message.filter(|(.., since)| since.elapsed() < MESSAGE);
        told.map(|(text, wrong, _)| (text, *wrong))
    }

    /// Lays everything out, and does what was asked.
    pub fn show(&mut self, ui: &mut Ui, session: &mut Session, facts: &Facts<'_>) {
        self.play(session);
        let context = ui.ctx().clone();
        // Before a key ends it, and Esc closes it.
        let typed = context.text_edit_focused();
        let listed = egui::Popup::is_any_open(&context);
        let ground = egui::Frame::new().fill(style::GROUND);
        let window = ui.max_rect();
        // A window too small for both keeps the picture.
        let roomy = window.width() > 2.0 * style::WIDTH;
        let mut touched = false;
        if roomy {
            egui::Panel::right("controls")
                .exact_size(style::WIDTH)
                .resizable(false)
                .show_separator_line(false)
                .frame(ground)
                .show(ui, |ui| touched = self.show_controls(ui, session, facts));
        }
        if self.costs && window.height() > 2.2 * style::STRIP {
            egui::Panel::bottom("costs")
                .exact_size(style::STRIP)
                .resizable(false)
                .show_separator_line(false)
                .frame(ground.inner_margin(egui::Margin::symmetric(14, 10)))
                .show(ui, |ui| costs::show(ui, session, facts));
        }
        let central = egui::CentralPanel::default().frame(egui::Frame::NONE);
        central.show(ui, |ui| {
            self.show_viewport(ui, session);
            if let (false, Phase::Still(done, of)) = (roomy, session.phase())
                && done < of
            {
                let mut line = self.viewport;
                line.set_top(line.bottom() - 2.0);
                show_progress(ui, line, session);
            }
            // The panel has a line for what is told; without one, it stands here.
            let told = self.told().filter(|(_, wrong)| *wrong && !roomy);
            let fault = told.map(|(text, _)| text).or(session.fault.as_ref());
            if let Some(fault) = fault {
                show_fault(ui, self.viewport, fault);
            }
        });
        // What is dragged in the panel moves, too.
        let held = context.input(|input| input.pointer.any_down());
        self.dragging |= held && touched;
        self.dragging &= held;
        // A button that has the focus wants no letters; a number that is typed does, and so does a list that is open.
        if !typed && !context.text_edit_focused() && !listed {
            self.keys(&context, session);
        }
        if self.told().is_some() {
            // It goes by itself.
            context.request_repaint_after(MESSAGE);
        }
        if self.help {
            help::show(&context, &mut self.help);
        }
    }

    /// The frame of what plays.
    fn play(&mut self, session: &mut Session) {
        let Some(playing) = self.playing else { return };
        let Some(motion) = session.motion() else {
            self.playing = None;
            return;
        };
        let passed = playing.since.elapsed().as_secs_f64() * motion.fps();
        let number = u64::from(playing.from) + passed as u64;
        session.frame_number = (number % u64::from(motion.frames)) as u32;
    }

    /// Plays on, or stands still.
    pub(super) fn toggle(&mut self, session: &Session) {
        self.playing = match self.playing {
            Some(_) => None,
            None => session.motion().map(|_| Playing {
                since: Instant::now(),
                from: session.frame_number,
            }),
        };
    }

    /// Everything but the picture; whether a setting was touched.
    fn show_controls(&mut self, ui: &mut Ui, session: &mut Session, facts: &Facts<'_>) -> bool {
        let before = session.wanted.clone();
        let inner = egui::Frame::new().inner_margin(egui::Margin {
            left: 16,
            right: 10,
            top: 12,
            bottom: 6,
        });
        inner.show(ui, |ui| {
            self.show_head(ui, session, facts);
            egui::ScrollArea::vertical()
                .auto_shrink([false, false])
                .show(ui, |ui| {
                    ui.set_max_width(style::WIDTH - 36.0);
                    self.look.show_controls(ui, session);
                    self.show_animation(ui, session);
                    controls::show(ui, session, &mut self.controls);
                    self.show_messages(ui, facts);
                });
        });
        session.wanted != before
    }

    fn show_head(&mut self, ui: &mut Ui, session: &Session, facts: &Facts<'_>) {
        ui.horizontal(|ui| {
            ui.label(
                egui::RichText::new("marmor")
                    .size(21.0)
                    .color(Color32::WHITE),
            );
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                if ui.button("?").on_hover_text("Keys (F1)").clicked() {
                    self.help ^= true;
                }
                let save = ui.button("Save").on_hover_text(
                    "PNG, EXR and a scene file that marmor render draws the same picture from (P)",
                );
                self.saves |= save.clicked();
            });
        });
        let name = &session.device().candidate().name;
        ui.add(egui::Label::new(egui::RichText::new(name).small().color(style::DIM)).truncate());
        ui.add_space(4.0);
        let (text, color) = match session.phase() {
            Phase::Draft(scale) => {
                let per_second = facts.timing.median(9).map_or(0.0, |ms| 1e3 / ms.max(0.1));
                let share = [
                    "full size",
                    "half size",
                    "a third of the size",
                    "a quarter of the size",
                ][scale.min(SCALES.len() - 1)];
                (
                    format!("moving   {share}   {per_second:.0} fps"),
                    style::WARM,
                )
            }
            Phase::Still(..) if session.waits() => {
                let of = session.frames();
                (format!("waiting   0 of {of} frames"), style::WARM)
            }
            Phase::Still(done, of) if done >= of => {
                (format!("converged   {of} frames"), style::TEXT)
            }
            Phase::Still(done, of) => (format!("converging   {done} of {of} frames"), style::WARM),
        };
        let (text, color) = match (&session.fault, session.draws()) {
            (None, _) => (text, color),
            (Some(_), true) => (format!("older shaders   {text}"), style::FAULT),
            (Some(_), false) => ("not shown".to_owned(), style::FAULT),
        };
        ui.label(egui::RichText::new(text).color(color));
        let (rect, _) = ui.allocate_exact_size(vec2(style::WIDTH - 42.0, 3.0), Sense::hover());
        ui.painter().rect_filled(rect, 1.5, style::RAISED);
        show_progress(ui, rect, session);
        // A line of its own, there or not, lest the settings below move under the pointer.
        let (text, color) = match (self.told(), facts.saving) {
            (Some((text, true)), _) => (text.as_str(), style::FAULT),
            (Some((text, false)), _) => (text.as_str(), style::WARM),
            (None, true) => ("saves when converged; P again does not", style::WARM),
            (None, false) => (session.warning(), style::WARM),
        };
        ui.add(egui::Label::new(egui::RichText::new(text).small().color(color)).truncate())
            .on_hover_text(text);
        ui.add_space(2.0);
    }

    fn show_animation(&mut self, ui: &mut Ui, session: &mut Session) {
        let Some(motion) = session.motion().cloned() else {
            return;
        };
        controls::section(ui, "Animation");
        if let Some(rig) = session
            .model()
            .rig
            .as_ref()
            .filter(|rig| !rig.clips.is_empty())
        {
            let names: Vec<String> = rig.clips.iter().map(|clip| clip.name.clone()).collect();
            let clip = &mut session.wanted.animation.clip;
            let own = clip.clone().unwrap_or_else(|| names[0].clone());
            controls::row(ui, "clip", |ui| {
                egui::ComboBox::from_id_salt("clip")
                    .selected_text(&own)
                    .show_ui(ui, |ui| {
                        for name in &names {
                            if ui.selectable_label(*name == own, name).clicked() {
                                *clip = Some(name.clone());
                            }
                        }
                    });
            });
        }
        for deformer in &session.wanted.animation.deformers {
            let Deformer {
                amplitude, period, ..
            } = deformer;
            controls::row(ui, "deformer", |ui| {
                ui.monospace(format!(
                    "{} {amplitude:.3} every {period:.2} s",
                    deformer.kind.name()
                ));
            });
        }
        ui.horizontal(|ui| {
            let word = if self.playing.is_some() {
                "Pause"
            } else {
                "Play"
            };
            let play = egui::Button::new(word).min_size(vec2(style::NAMES - 22.0, 19.0));
            if ui.add(play).on_hover_text("Space").clicked() {
                self.toggle(session);
            }
            ui.add_space(10.0);
            let mut number = session.frame_number;
            let last = motion.frames.saturating_sub(1);
            let slider = controls::slider(&mut number, 0..=last).show_value(false);
            let slider = ui.add(slider);
            if slider.changed() {
                session.frame_number = number;
                self.playing = None;
            }
            self.dragging |= slider.dragged();
            ui.monospace(format!("{:.2} s", motion.time(session.frame_number)));
        });
    }

    fn show_messages(&self, ui: &mut Ui, facts: &Facts<'_>) {
        if !facts.validation {
            return;
        }
        controls::section(ui, "Validation");
        match facts.messages {
            [] => {
                ui.label(egui::RichText::new("no message").color(style::DIM));
            }
            messages => {
                for message in messages.iter().rev() {
                    ui.label(egui::RichText::new(message).small().color(style::FAULT));
                }
            }
        }
    }

    /// The picture's place, and what one does there.
    fn show_viewport(&mut self, ui: &mut Ui, session: &mut Session) {
        let rect = ui.max_rect();
        self.viewport = rect;
        let response = ui.interact(rect, ui.id().with("picture"), Sense::click_and_drag());
        let chooses = match self.look.show(ui, rect, &response, session) {
            Ok(chooses) => chooses,
            Err(fault) => {
                self.complain(fault.to_string());
                false
            }
        };
        let divided = self.look.is_plain() && self.show_divider(ui, rect, session);
        // In a long frame the button may have gone up again: what it has moved before counts.
        if (response.dragged() || response.drag_stopped()) && !divided && !chooses {
            self.drag(ui, &response, session);
            self.dragging = true;
        }
        if response.hovered() {
            self.scroll(ui, rect, session);
        }
        if response.double_clicked() {
            self.frame_all(session);
        }
        match self.moved {
            Some(moved) if moved.elapsed() < WHEEL => ui.ctx().request_repaint_after(WHEEL),
            _ => self.moved = None,
        }
    }

    /// Turns or moves what is dragged on the picture.
    fn drag(&mut self, ui: &Ui, response: &Response, session: &mut Session) {
        let held = |button| response.dragged_by(button) || response.drag_stopped_by(button);
        let (by, modifiers, light) = ui.input(|input| {
            (
                input.pointer.delta(),
                input.modifiers,
                input.key_down(Key::L),
            )
        });
        let by = DVec2::new(f64::from(by.x), f64::from(by.y));
        if held(PointerButton::Secondary) || modifiers.ctrl || light {
            session.aim(orbit::turned_light(&session.light(), by));
        } else if held(PointerButton::Middle) || modifiers.shift {
            let height = f64::from(response.rect.height());
            self.steer(session, orbit::panned(session.camera(), by, height));
        } else {
            self.steer(session, orbit::turned(session.camera(), by));
        }
    }

    /// Zooms, turns or moves as wheel and trackpad ask.
    fn scroll(&mut self, ui: &Ui, rect: Rect, session: &mut Session) {
        let (scroll, zoom, modifiers, notched) = ui.input(|input| {
                let notched = input.events.iter().any(|event| {
                    matches!(event, egui::Event::MouseWheel { unit, .. } if *unit != egui::MouseWheelUnit::Point)
                });
                (input.smooth_scroll_delta(), input.zoom_delta(), input.modifiers, notched)
            });
        let radius = session.plan().radius();
        // A wheel zooms, as a pinch does; two fingers on a trackpad turn, or with shift move.
        self.controls.wheel = notched || (self.controls.wheel && scroll != egui::Vec2::ZERO);
        let pinched = (f64::from(zoom) - 1.0).abs() > 1e-4;
        let by = DVec2::new(f64::from(scroll.x), f64::from(scroll.y));
        let steered = if pinched {
            Some(orbit::zoomed(session.camera(), f64::from(zoom), radius))
        } else if by == DVec2::ZERO {
            None
        } else if self.controls.wheel {
            let factor = (0.004 * (by.x + by.y)).exp();
            Some(orbit::zoomed(session.camera(), factor, radius))
        } else if modifiers.shift {
            Some(orbit::panned(
                session.camera(),
                by,
                f64::from(rect.height()),
            ))
        } else {
            Some(orbit::turned(session.camera(), by))
        };
        if let Some(steered) = steered {
            self.steer(session, steered);
            self.moved = Some(Instant::now());
        }
    }

    fn steer(&mut self, session: &mut Session, viewpoint: Viewpoint) {
        session.wanted.animation.camera_keys = None;
        session.wanted.viewpoint = viewpoint;
    }

    /// All of the object in the picture, seen from where it is seen now.
    fn frame_all(&mut self, session: &mut Session) {
        if let Viewpoint::Orbit {
            azimuth, elevation, ..
        } = orbit::turned(session.camera(), DVec2::ZERO)
        {
            let fitted = Viewpoint::Orbit {
                azimuth,
                elevation,
                distance: None,
                target: None,
            };
            self.steer(session, fitted);
        }
    }

    /// The line between two methods; whether it is dragged.
    fn show_divider(&mut self, ui: &mut Ui, rect: Rect, session: &mut Session) -> bool {
        let plan = session.plan();
        let Some(left) = plan.split else { return false };
        let names = [left.to_string(), plan.method_name()];
        let share = session.wanted.split_at;
        let x = rect.left() + rect.width() * share as f32;
        let line = Rect::from_min_max(pos2(x - 5.0, rect.top()), pos2(x + 5.0, rect.bottom()));
        let handle = ui.interact(line, ui.id().with("divider"), Sense::drag());
        if handle.hovered() || handle.dragged() {
            ui.ctx().set_cursor_icon(CursorIcon::ResizeHorizontal);
        }
        if handle.dragged() || handle.drag_stopped() {
            if let Some(pointer) = handle.interact_pointer_pos() {
                let at = (pointer.x - rect.left()) / rect.width().max(1.0);
                session.wanted.split_at = f64::from(at.clamp(0.0, 1.0));
            }
            self.dragging = true;
        }
        let strong = handle.hovered() || handle.dragged();
        let ink = if strong {
            style::WARM
        } else {
            Color32::from_white_alpha(150)
        };
        let painter = ui.painter();
        painter.vline(x, rect.y_range(), Stroke::new(1.0, ink));
        let middle = pos2(x, rect.bottom() - 36.0);
        painter.circle_filled(middle, 7.0, ink);
        for (side, name) in [-1.0, 1.0].into_iter().zip(names) {
            let ink = Color32::from_white_alpha(190);
            let name = painter.layout_no_wrap(name, style::numbers(), ink);
            let (left, room) = if side < 0.0 {
                (x - 12.0 - name.size().x, x - 12.0 - rect.left())
            } else {
                (x + 12.0, rect.right() - x - 12.0)
            };
            // A side too narrow for its name does without.
            if name.size().x <= room {
                painter.galley(pos2(left, rect.top() + 12.0), name, ink);
            }
        }
        handle.dragged()
    }

    fn keys(&mut self, context: &egui::Context, session: &mut Session) {
        // In a long frame a key goes down several times.
        let presses = |key| {
            context.input(|input| {
                let plain = !input.modifiers.command && !input.modifiers.alt;
                if plain { input.num_presses(key) } else { 0 }
            })
        };
        let pressed = |key| presses(key) > 0;
        let odd = |key| presses(key) % 2 == 1;
        self.help ^= odd(Key::F1);
        if pressed(Key::Escape) {
            self.help = false;
            self.look.close();
        }
        for _ in 0..presses(Key::D) {
            self.look.next(session);
        }
        if pressed(Key::E) {
            self.look.arm();
        }
        self.saves ^= odd(Key::P);
        if odd(Key::Space) {
            self.toggle(session);
        }
        if pressed(Key::F) {
            self.frame_all(session);
        }
        self.costs ^= odd(Key::C);
        for _ in 0..presses(Key::M) {
            const TURN: [Method; 5] = [
                Method::Mixture,
                Method::Samples,
                Method::Rings,
                Method::Brdf,
                Method::None,
            ];
            let own = TURN
                .iter()
                .position(|method| *method == session.wanted.multiple);
            session.wanted.multiple = TURN[own.map_or(0, |own| (own + 1) % TURN.len())];
            session.wanted.fetch_budget = None;
            controls::shade_whole_if_opaque(&mut session.wanted);
        }
        if odd(Key::S) {
            let split = &mut session.wanted.split;
            *split = match split {
                Some(_) => None,
                None => Some(Method::Brdf),
            };
            // A budget chooses for the whole picture, and half size shades none that is split.
            session.wanted.fetch_budget = None;
            session.wanted.scattering = Scattering::Full;
        }
        session.wanted.specular ^= odd(Key::Num1);
        if odd(Key::Num2) {
            self.controls.toggle_single(&mut session.wanted);
        }
        if odd(Key::Num3) {
            self.controls.toggle_multiple(&mut session.wanted);
        }
        for (key, stops) in [(Key::OpenBracket, -0.25_f64), (Key::CloseBracket, 0.25)] {
            let presses = presses(key);
            if presses > 0 {
                let stops = session.wanted.exposure.log2() + stops * presses as f64;
                // Steps there and back end where they began.
                session.wanted.exposure = ((1e6 * stops).round() * 1e-6).exp2();
            }
        }
        let arrows = [
            (Key::ArrowLeft, DVec2::new(-1.0, 0.0)),
            (Key::ArrowRight, DVec2::new(1.0, 0.0)),
            (Key::ArrowUp, DVec2::new(0.0, -1.0)),
            (Key::ArrowDown, DVec2::new(0.0, 1.0)),
        ];
        for (key, by) in arrows {
            if pressed(key) {
                // Five degrees a press.
                let by = 12.5 * presses(key) as f64 * by;
                session.aim(orbit::turned_light(&session.light(), by));
                self.moved = Some(Instant::now());
            }
        }
        // By the modifiers of the press: in a long frame they are let go again by its end.
        let closes = |event: &egui::Event| matches!(event, egui::Event::Key { key: Key::Q, pressed: true, modifiers, .. } if modifiers.command);
        let closes = context.input(|input| input.events.iter().any(closes));
        self.quits |= closes;
    }
}

/// In `rect`, how much of the still is drawn.
fn show_progress(ui: &Ui, mut rect: Rect, session: &Session) {
    let share = match session.phase() {
        Phase::Still(done, of) if !session.waits() => done as f32 / of.max(1) as f32,
        _ => 0.0,
    };
    rect.set_width(rect.width() * share);
    ui.painter().rect_filled(rect, 1.5, style::WARM);
}

/// What went wrong, over the lower edge of the picture's place `rect`.
fn show_fault(ui: &Ui, rect: Rect, text: &str) {
    let color = style::FAULT;
    let font = egui::FontId::proportional(13.0);
    let width = (rect.width() - 40.0).max(80.0);
    let galley = ui.painter().layout(text.to_owned(), font, color, width);
    let size = galley.size() + vec2(20.0, 12.0);
    let at = pos2(
        rect.center().x - 0.5 * size.x,
        rect.bottom() - 12.0 - size.y,
    );
    let ground = Rect::from_min_size(at, size);
    ui.painter()
        .rect_filled(ground, 4.0, style::GROUND.gamma_multiply(0.92));
    ui.painter().galley(at + vec2(10.0, 6.0), galley, color);
}
