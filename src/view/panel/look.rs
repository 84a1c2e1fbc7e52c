//! What is looked at in place of the picture, or over it: its settings, its image and its legend.

use super::controls;
use crate::view::Error;
use crate::view::lens::{self, Legend, Lens, Moments, Offer, Shown, Slice};
use crate::view::region::{self, Region};
use crate::view::session::Session;
use crate::view::style;
use crate::view::worker::{Fetches, Job, Report, Worker};
use egui::{
    Align2, Color32, CursorIcon, PointerButton, Pos2, Rect, Response, Stroke, StrokeKind,
    TextureHandle, TextureOptions, Ui, pos2, vec2,
};

/// Around an image that stands in place of the picture, points.
const FRAME: f32 = 22.0;
/// Below it, for its legend, points.
const FOOT: f32 = 84.0;
/// Width of the scale in a legend, points.
const SCALE: f32 = 230.0;

/// Jobs of the worker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Task {
    Fetches,
    Error,
    Prices,
}

/// Of which picture something is: see [`Session::version`].
type Version = u64;

/// What is looked at.
#[derive(Default)]
pub struct Look {
    lens: Lens,
    // Whether the next drag on the picture chooses a region.
    armed: bool,
    // The corners of the region that is being chosen, points.
    corners: Option<[Pos2; 2]>,
    chosen: Option<[u32; 4]>,
    // The last one: corner and size, pixels.
    last: Option<[u32; 4]>,
    running: Option<(Task, Version)>,
    progress: f32,
    fetches: Option<(Version, Fetches)>,
    region: Option<(Version, Region)>,
    // The last job that failed, and why.
    failed: Option<(Task, Version, String)>,
    priceless: bool,
    offer: Option<(Version, Offer)>,
    texture: Option<TextureHandle>,
    // What the texture shows, and of which picture or frame.
    made: Option<(Lens, u64)>,
    legend: Option<Legend>,
    size: [u32; 2],
}

impl Look {
    /// Whether the picture is seen as it is.
    pub fn is_plain(&self) -> bool {
        self.lens == Lens::Picture
    }

    /// Goes to the next way of looking.
    pub fn next(&mut self, session: &Session) {
        let next = self.lens.next(self.offer(session));
        self.to(next);
    }

    /// Has the next drag choose a region.
    pub fn arm(&mut self) {
        self.to(Lens::Error);
    }

    /// Goes back to the picture.
    pub fn close(&mut self) {
        self.to(Lens::Picture);
    }

    fn to(&mut self, lens: Lens) {
        self.lens = lens;
        self.armed = lens == Lens::Error;
        (self.corners, self.chosen) = (None, None);
    }

    fn offer(&mut self, session: &Session) -> &Offer {
        let version = session.version();
        if self.offer.as_ref().is_some_and(|(own, _)| *own != version) {
            self.offer = None;
        }
        let offer = self
            .offer
            .get_or_insert_with(|| (version, Offer::of(session.plan())));
        &offer.1
    }

    /// Takes in what the worker says; returns what went wrong.
    pub fn hear(&mut self, worker: &mut Worker, session: &mut Session) -> Option<String> {
        let mut fault = None;
        for report in worker.reports() {
            let Some((task, version)) = self.running else {
                continue;
            };
            match report {
                Report::Progress(share) => self.progress = share,
                Report::Fetches(fetches) => self.fetches = Some((version, fetches)),
                Report::Error(region) => {
                    self.region = Some((version, region));
                    self.made = None;
                }
                Report::Prices(prices) => session.price(prices),
                Report::Failed(message) => {
                    self.priceless |= task == Task::Prices;
                    self.failed = Some((task, version, message.clone()));
                    fault = Some(message);
                }
                Report::Stopped => {}
            }
        }
        if !worker.is_busy() {
            self.running = None;
        }
        fault
    }

    /// Has the worker do what is wanted, and nothing else. Whether there is something new to look at, which the next frame
    /// draws.
    pub fn ask(&mut self, worker: &mut Worker, session: &Session) -> bool {
        let version = session.version();
        let wanted = |(task, of): (Task, Version)| {
            of == version && (task != Task::Error || self.lens == Lens::Error)
        };
        if worker.is_busy() && !self.running.is_some_and(wanted) {
            worker.cancel();
            self.running = None;
        }
        if let Some(place) = self.chosen.take() {
            let job = Job::Error {
                plan: Box::new(session.plan().clone()),
                place,
                frames: session.frames(),
            };
            self.region = None;
            self.start(worker, Task::Error, version, job);
        } else if !worker.is_busy() && session.converged() && session.fault.is_none() {
            let failed = self.has_failed(Task::Fetches, version);
            let known = self.fetches.as_ref().is_some_and(|(of, _)| *of == version);
            let priced = session.is_priced() || self.priceless;
            if self.lens == Lens::Fetches && !known && failed.is_none() {
                let plan = Box::new(session.plan().clone());
                self.start(worker, Task::Fetches, version, Job::Fetches(plan));
            } else if !priced {
                self.start(worker, Task::Prices, version, Job::Prices);
            }
        }
        let drawn = (self.lens, session.drawn());
        self.lens.target().is_some() && self.made.is_some_and(|made| made != drawn)
    }

    fn start(&mut self, worker: &mut Worker, task: Task, version: Version, job: Job) {
        worker.ask(job);
        self.running = Some((task, version));
        (self.progress, self.failed) = (0.0, None);
    }

    fn has_failed(&self, task: Task, version: Version) -> Option<&str> {
        let failed = self.failed.as_ref();
        let failed = failed.filter(|(own, of, _)| (*own, *of) == (task, version));
        failed.map(|(_, _, message)| message.as_str())
    }

    /// What is looked at, and what that needs.
    pub fn show_controls(&mut self, ui: &mut Ui, session: &Session) {
        let offer = self.offer(session).clone();
        let mut lens = self.lens.within(&offer);
        controls::section(ui, "Look at");
        controls::row(ui, "view", |ui| {
            egui::ComboBox::from_id_salt("lens")
                .selected_text(lens.name())
                .width(170.0)
                .show_ui(ui, |ui| {
                    for each in offer.lenses() {
                        let own = each.name() == lens.name();
                        if ui.selectable_label(own, each.name()).clicked() && !own {
                            lens = each;
                        }
                    }
                });
        });
        match &mut lens {
            Lens::Moments(moments) => show_moments(ui, moments, &offer),
            Lens::Volumes(slice) => show_slice(ui, slice, &offer),
            Lens::Picture | Lens::LightDepth | Lens::Fetches | Lens::Error => {}
        }
        let lens = lens.within(&offer);
        if lens.name() == self.lens.name() {
            self.lens = lens;
        } else {
            self.to(lens);
        }
    }

    /// Draws it over the picture, which has its place in `rect`; whether `response`, the picture's, chooses a region.
    ///
    /// # Errors
    /// What the device says.
    pub fn show(
        &mut self,
        ui: &Ui,
        rect: Rect,
        response: &Response,
        session: &mut Session,
    ) -> Result<bool, Error> {
        self.lens = self.lens.within(&self.offer(session).clone());
        if self.lens == Lens::Picture {
            (self.texture, self.made, self.legend) = (None, None, None);
            return Ok(false);
        }
        let chooses = self.lens == Lens::Error && self.choose(ui, rect, response, session);
        let version = session.version();
        let place = match self.lens {
            Lens::Fetches | Lens::Error => {
                let shown = match self.lens {
                    Lens::Fetches => of_version(&self.fetches, version)
                        .map(|fetches| (lens::fetches(fetches), [0; 2])),
                    _ => of_version(&self.region, version)
                        .map(|region| (lens::error(region), [region.place[0], region.place[1]])),
                };
                let Some((shown, corner)) = shown else {
                    (self.made, self.legend) = (None, None);
                    self.show_waiting(ui, rect, version);
                    return Ok(chooses);
                };
                let place = in_points(ui, rect, corner, shown.size);
                if self.made != Some((self.lens, version)) {
                    self.made = Some((self.lens, version));
                    self.take(ui, Some(shown));
                }
                place
            }
            lens => {
                // The whole picture makes room for it.
                ui.painter().rect_filled(rect, 0.0, style::BACKDROP);
                let drawn = (lens, session.drawn());
                if self.made != Some(drawn) {
                    let target = lens.target();
                    let read = target
                        .map(|target| session.intermediate(target))
                        .transpose();
                    // What cannot be read is not tried again until there is another.
                    self.made = Some(drawn);
                    let shown = read?
                        .flatten()
                        .and_then(|read| lens::shown(lens, &read.plan, &read.texels));
                    self.take(ui, shown);
                }
                let mut room = rect.shrink(FRAME);
                room.max.y -= FOOT - FRAME;
                fitted(room, self.size)
            }
        };
        if let (Some(texture), Some(legend)) = (&self.texture, &self.legend) {
            // Rows of a light map grow upwards.
            let [top, bottom] = match self.lens.target() {
                Some(_) => [1.0, 0.0],
                None => [0.0, 1.0],
            };
            let whole = Rect::from_min_max(pos2(0.0, top), pos2(1.0, bottom));
            ui.painter()
                .image(texture.id(), place, whole, Color32::WHITE);
            if self.lens == Lens::Error {
                outline(ui, place);
            }
            show_legend(ui, rect, legend);
        }
        Ok(chooses)
    }

    /// Keeps `shown` as a texture.
    fn take(&mut self, ui: &Ui, shown: Option<Shown>) {
        let Some(shown) = shown else {
            (self.texture, self.legend) = (None, None);
            return;
        };
        let pixels = shown.pixels.iter();
        let pixels = pixels.map(|[r, g, b, _]| Color32::from_rgb(*r, *g, *b));
        let size = shown.size.map(|side| side as usize);
        let image = egui::ColorImage::new(size, pixels.collect());
        match &mut self.texture {
            Some(texture) => texture.set(image, TextureOptions::NEAREST),
            None => {
                let texture = ui
                    .ctx()
                    .load_texture("lens", image, TextureOptions::NEAREST);
                self.texture = Some(texture);
            }
        }
        self.size = shown.size;
        self.legend = Some(shown.legend);
    }

    /// Lets a drag, or a click, choose a region; whether this drag is one that does.
    fn choose(&mut self, ui: &Ui, rect: Rect, response: &Response, session: &Session) -> bool {
        if self.armed && response.hovered() {
            ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
        }
        let (from, at) = ui.input(|input| {
            let pointer = &input.pointer;
            (pointer.press_origin(), pointer.interact_pos())
        });
        if self.armed && response.drag_started_by(PointerButton::Primary) {
            self.corners = from.zip(at).map(|(from, at)| [from, at]);
        }
        if let (Some(corners), Some(at)) = (&mut self.corners, at) {
            corners[1] = at;
        }
        let mut done = None;
        if self.armed && response.clicked() {
            done = at.map(|at| [at, at]);
        } else if response.drag_stopped() {
            done = self.corners;
        }
        if let Some(corners) = done {
            self.corners = None;
            let scale = ui.ctx().pixels_per_point();
            let [from, to] = corners.map(|corner| {
                let at = (corner - rect.min) * scale;
                [f64::from(at.x), f64::from(at.y)]
            });
            self.chosen = region::chosen(from, to, session.plan().size);
            self.armed = self.chosen.is_none();
            self.last = self.chosen;
            return true;
        }
        self.corners.is_some()
    }

    /// What is done meanwhile, and what one may do.
    fn show_waiting(&self, ui: &Ui, rect: Rect, version: Version) {
        if let Some(corners) = self.corners {
            outline(
                ui,
                Rect::from_two_pos(corners[0], corners[1]).intersect(rect),
            );
        }
        let task = match self.lens {
            Lens::Fetches => Task::Fetches,
            _ => Task::Error,
        };
        if let (Some([x, y, width, height]), Task::Error) = (self.last, task)
            && self.running == Some((task, version))
        {
            outline(ui, in_points(ui, rect, [x, y], [width, height]));
        }
        let runs = self.running == Some((task, version)) || self.chosen.is_some();
        let wrong = self.has_failed(task, version);
        let (title, fact) = match (task, wrong, runs) {
            (_, Some(message), _) => ("not measured", message),
            (Task::Error, _, true) => ("error against exact", "summing over the light map"),
            (Task::Error, _, false) if self.armed => (
                "error against exact",
                "drag a rectangle on the picture, or click",
            ),
            (Task::Error, ..) => ("error against exact", "E, then drag another rectangle"),
            (_, _, true) => ("fetches a pixel", "counting"),
            (_, _, false) => ("fetches a pixel", "once the picture has converged"),
        };
        let legend = Legend {
            title: title.to_owned(),
            facts: vec![fact.to_owned()],
            scale: None,
            wrong: wrong.is_some(),
        };
        let ground = show_legend(ui, rect, &legend);
        if runs && task == Task::Error {
            let mut bar = Rect::from_min_size(
                pos2(ground.left(), ground.bottom() - 3.0),
                vec2(ground.width(), 3.0),
            );
            ui.painter().rect_filled(bar, 1.5, style::RAISED);
            bar.set_width(ground.width() * self.progress.clamp(0.0, 1.0));
            ui.painter().rect_filled(bar, 1.5, style::WARM);
        }
    }
}

fn of_version<T>(kept: &Option<(Version, T)>, version: Version) -> Option<&T> {
    let kept = kept.as_ref().filter(|(of, _)| *of == version);
    kept.map(|(_, kept)| kept)
}

fn show_moments(ui: &mut Ui, moments: &mut Moments, offer: &Offer) {
    controls::row(ui, "moment", |ui| {
        let most = if offer.fourth.is_some() { 4 } else { 3 };
        for power in 0..=most {
            ui.selectable_value(&mut moments.power, power, lens::moment_name(power));
        }
    });
    if offer.levels > 1 {
        controls::row(ui, "level", |ui| {
            ui.add(egui::Slider::new(&mut moments.level, 0..=offer.levels - 1))
        });
    }
    if offer.smoothed.is_some() {
        let smoothed = offer.is_smoothed(moments.power, moments.level);
        controls::row(ui, "smoothed", |ui| {
            let mut on = moments.smoothed && smoothed;
            let what = "As the mixture reads it; levels that it does not read are not smoothed";
            let box_of = egui::Checkbox::new(&mut on, "");
            if ui
                .add_enabled(smoothed, box_of)
                .on_hover_text(what)
                .changed()
            {
                moments.smoothed = on;
            }
        });
    }
}

fn show_slice(ui: &mut Ui, slice: &mut Slice, offer: &Offer) {
    if offer.slices.len() > 1 {
        controls::row(ui, "volume", |ui| {
            for volume in 0..offer.slices.len() as u32 {
                ui.selectable_value(&mut slice.volume, volume, volume.to_string());
            }
        });
    }
    if let Some(slices) = offer.slices.get(slice.volume as usize) {
        controls::row(ui, "slice", |ui| {
            ui.add(egui::Slider::new(&mut slice.slice, 0..=slices - 1))
        });
    }
}

/// The largest place in `room` for an image of `size` texels, in its middle.
fn fitted(room: Rect, size: [u32; 2]) -> Rect {
    let [width, height] = size.map(|side| side.max(1) as f32);
    let scale = (room.width() / width).min(room.height() / height).max(0.0);
    Rect::from_center_size(room.center(), vec2(width * scale, height * scale))
}

/// Where columns and rows from `corner` of the picture lie, which has its place in `rect`.
fn in_points(ui: &Ui, rect: Rect, corner: [u32; 2], size: [u32; 2]) -> Rect {
    let scale = ui.ctx().pixels_per_point();
    // The picture begins at a whole pixel.
    let first = (rect.min.to_vec2() * scale).round();
    let [x, y] = corner.map(|side| side as f32);
    let [width, height] = size.map(|side| side as f32);
    Rect::from_min_size(
        ((first + vec2(x, y)) / scale).to_pos2(),
        vec2(width, height) / scale,
    )
}

fn outline(ui: &Ui, place: Rect) {
    let painter = ui.painter();
    let dark = Stroke::new(3.0, Color32::from_black_alpha(110));
    painter.rect_stroke(place, 0.0, dark, StrokeKind::Outside);
    let line = Stroke::new(1.0, style::WARM);
    painter.rect_stroke(place, 0.0, line, StrokeKind::Outside);
}

/// Draws `legend` at the foot of `rect`, and returns its ground.
fn show_legend(ui: &Ui, rect: Rect, legend: &Legend) -> Rect {
    const MARGIN: f32 = 10.0;
    const LINE: f32 = 16.0;
    let painter = ui.painter();
    let ink = |wrong| if wrong { style::FAULT } else { style::DIM };
    let title = painter.layout_no_wrap(
        legend.title.clone(),
        egui::FontId::proportional(13.0),
        style::TEXT,
    );
    let widest = (rect.width() - 4.0 * MARGIN).max(60.0);
    let facts = legend.facts.iter();
    let facts: Vec<_> = facts
        .map(|fact| painter.layout(fact.clone(), style::numbers(), ink(legend.wrong), widest))
        .collect();
    let widths = facts.iter().chain([&title]).map(|text| text.size().x);
    let mut inner = widths.fold(0.0, f32::max);
    let facts_height: f32 = facts.iter().map(|text| text.size().y + 2.0).sum();
    let mut height = LINE + 3.0 + facts_height;
    if legend.scale.is_some() {
        inner = inner.max(SCALE);
        height += 8.0 + 5.0 + LINE;
    }
    let size = vec2(inner, height) + 2.0 * vec2(MARGIN, MARGIN * 0.8);
    let ground = Rect::from_min_size(rect.left_bottom() + vec2(MARGIN, -MARGIN - size.y), size);
    painter.rect_filled(ground, 4.0, style::GROUND.gamma_multiply(0.9));
    let mut at = ground.min + vec2(MARGIN, MARGIN * 0.8);
    painter.galley(at, title, style::TEXT);
    at.y += LINE + 3.0;
    if let Some(scale) = &legend.scale {
        let bar = Rect::from_min_size(at, vec2(inner, 8.0));
        let colors = scale.colors.all();
        let step = bar.width() / colors.len().max(1) as f32;
        for (place, [r, g, b, _]) in (0u16..).zip(&colors) {
            let left = bar.left() + step * f32::from(place);
            // As far as the bar goes, lest what lies behind show at the soft edges: the next one covers the rest.
            let strip = Rect::from_min_max(pos2(left, bar.top()), bar.max);
            painter.rect_filled(strip, 0.0, Color32::from_rgb(*r, *g, *b));
        }
        at.y += 8.0 + 5.0;
        let [low, high] = &scale.ends;
        let ends = [
            (at, Align2::LEFT_TOP, low),
            (pos2(bar.right(), at.y), Align2::RIGHT_TOP, high),
        ];
        for (at, align, words) in ends {
            painter.text(at, align, words, style::numbers(), style::TEXT);
        }
        at.y += LINE;
    }
    for fact in facts {
        let below = fact.size().y + 2.0;
        painter.galley(at, fact, ink(legend.wrong));
        at.y += below;
    }
    ground
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_keeps_its_shape_and_its_middle() {
        let room = Rect::from_min_max(pos2(10.0, 20.0), pos2(210.0, 120.0));
        for (size, seen) in [([64, 64], [100.0, 100.0]), ([40, 10], [200.0, 50.0])] {
            let place = fitted(room, size);
            assert_eq!(place.size(), vec2(seen[0], seen[1]));
            assert_eq!(place.center(), room.center());
        }
        // Without room there is none, and nothing is upside down.
        let none = Rect::from_min_max(pos2(9.0, 9.0), pos2(8.0, 5.0));
        assert_eq!(fitted(none, [8, 8]).size(), vec2(0.0, 0.0));
    }
}
