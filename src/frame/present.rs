//! Presentation: this page is how a picture comes to a window, every wait and every barrier in order.
//!
//! A frame of the window takes a slot of its own, apart from those of the renderer, on the same queue: what it samples was
//! drawn by an earlier submit, and a barrier orders the two. Host and device meet at the slot's fence; device and display
//! at two semaphores, one for the image that the display hands over, one for the image that it gets back.

use std::sync::Arc;

use ash::vk;

use super::Renderer;
use super::compose::{ComposePass, Shown};
use super::panel::{Panel, PanelPass};
use super::targets::overwriting_pass;
use crate::gpu::swapchain::encodes;
use crate::gpu::{
    self, Device, PresentMode, RenderPass, Semaphore, Slot, Surface, Swapchain, Timestamps, Turn,
    Use, barrier, submit,
};

/// Frames of the window recorded ahead of the device, as the renderer's.
const FRAMES_IN_FLIGHT: usize = super::FRAMES_IN_FLIGHT;

/// What shows pictures in a window.
pub struct Presenter {
    // Dropped first: a slot waits for the queue before anything it uses goes.
    slots: Vec<Slot>,
    acquired: Vec<Semaphore>,
    stamps: Vec<Timestamps>,
    pending: Vec<bool>,
    drawing: Option<Drawing>,
    swapchain: Option<Swapchain>,
    surface: Arc<Surface>,
    size: [u32; 2],
    mode: PresentMode,
    // Whether the window has changed since its swapchain was made.
    stale: bool,
    slot: usize,
    milliseconds: Option<f64>,
    device: Arc<Device>,
}

/// What draws into windows of one format, and where.
struct Drawing {
    format: vk::Format,
    compose: ComposePass,
    panel: PanelPass,
    // By the image of the swapchain.
    targets: Vec<RenderPass>,
}

/// What became of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drawn {
    /// It will be shown.
    Shown,
    /// The window has no area, or changed at that moment: draw again.
    Skipped,
}

impl Presenter {
    /// Prepares to show pictures on `surface`, that of a window of `size` pixels.
    ///
    /// # Errors
    /// What the driver says.
    pub fn new(
        device: &Arc<Device>,
        surface: &Arc<Surface>,
        size: [u32; 2],
        mode: PresentMode,
    ) -> gpu::Result<Self> {
        let slots = 0..FRAMES_IN_FLIGHT;
        Ok(Presenter {
            slots: slots
                .clone()
                .map(|k| Slot::new(device, &format!("window {k}")))
                .collect::<gpu::Result<_>>()?,
            acquired: slots
                .clone()
                .map(|k| Semaphore::new(device, &format!("acquired {k}")))
                .collect::<gpu::Result<_>>()?,
            stamps: slots
                .map(|k| Timestamps::new(device, &format!("window stamps {k}"), 1))
                .collect::<gpu::Result<_>>()?,
            pending: vec![false; FRAMES_IN_FLIGHT],
            drawing: None,
            swapchain: None,
            surface: Arc::clone(surface),
            size,
            mode,
            stale: true,
            slot: 0,
            milliseconds: None,
            device: Arc::clone(device),
        })
    }

    /// Says that the window has `size` pixels now.
    pub fn resize(&mut self, size: [u32; 2]) {
        self.stale |= self.size != size;
        self.size = size;
    }

    /// How pictures are shown; none before the first.
    pub fn mode(&self) -> Option<PresentMode> {
        self.swapchain.as_ref().map(Swapchain::mode)
    }

    /// Device time of composing one of the last frames, ms.
    pub fn milliseconds(&self) -> Option<f64> {
        self.milliseconds
    }

    /// Makes the picture of `renderer` one that can be shown; none while the window has no area. The renderer must
    /// outlive what is made.
    ///
    /// # Errors
    /// What the driver says.
    pub fn shown(&mut self, renderer: &Renderer) -> gpu::Result<Option<Shown>> {
        if !self.prepare(renderer)? {
            return Ok(None);
        }
        let drawing = self.drawing.as_ref();
        drawing
            .map(|drawing| drawing.compose.shown(&renderer.canvas.display))
            .transpose()
    }

    /// Makes the pipelines anew, from the shaders as they are. Of those that fail the old ones stay.
    ///
    /// # Errors
    /// [`gpu::Error::Shader`] among others.
    pub fn reload(&mut self) -> gpu::Result<()> {
        // Of frames that draw with the pipelines, before these go.
        for slot in &self.slots {
            slot.wait()?;
        }
        if let Some(drawing) = &mut self.drawing
            && let Some(target) = drawing.targets.first()
        {
            let encodes = encodes(drawing.format);
            drawing.compose.retarget(target, encodes)?;
            drawing.panel.retarget(target, encodes)?;
        }
        Ok(())
    }

    /// Draws a frame of the window: the picture that `renderer` has drawn last, in columns and rows `place` (x, y, width,
    /// height; pixels) as large as its shape allows, over `backdrop` (linear RGB), and over both the panel. It waits for the
    /// last frame but one, and for the display to hand over an image.
    ///
    /// Of a frame that is skipped nothing is taken over: what is new of the panel must come again. An error after the display
    /// has handed an image over leaves that image taken, so that whoever gets one closes the window.
    ///
    /// # Errors
    /// [`gpu::Error::DeviceLost`] among others.
    #[rustfmt::skip] // A barrier is read as a sentence.
    pub fn draw(
        &mut self,
        (renderer, shown): (&mut Renderer, &Shown),
        place: [i32; 4],
        backdrop: [f32; 3],
        panel: &Panel,
    ) -> gpu::Result<Drawn> {
        if !self.prepare(renderer)? {
            return Ok(Drawn::Skipped);
        }
        let slot = self.slot;
        self.slots[slot].wait()?;
        if std::mem::take(&mut self.pending[slot]) {
            self.milliseconds = self.stamps[slot].milliseconds(0);
        }
        let (Some(swapchain), Some(drawing)) = (&self.swapchain, &mut self.drawing) else {
            return Ok(Drawn::Skipped);
        };
        let size = swapchain.size();
        let image = match swapchain.acquire(&self.acquired[slot])? {
            Turn::Granted(image) => image,
            Turn::Suboptimal(image) => { self.stale = true; image }
            Turn::OutOfDate => { self.stale = true; return Ok(Drawn::Skipped) }
            Turn::NotYet => return Ok(Drawn::Skipped),
        };
        let pane = beside(place, size);
        let place = fitted(place, shown.size());
        drawing.compose.write(slot, place, backdrop)?;
        drawing.panel.write(slot, panel, size)?;

        let (device, target) = (&*self.device, &swapchain.images()[image]);
        let commands = self.slots[slot].begin()?;
        self.stamps[slot].reset(commands);
        device.begin_label(commands, c"panel, new textures");
        record_textures(device, commands, &drawing.panel, slot, panel);
        device.end_label(commands);

        // compose: one render pass, of which picture and panel draw all: what the picture leaves, the panel covers.
        if let Some(left) = renderer.take_display() {
            barrier::image(
                device, commands, c"RAW: the window samples the display image",
                &renderer.canvas.display, left, Use::FRAGMENT_SAMPLE,
            );
        }
        barrier::image(
            device, commands, c"layout: the display has handed the image over, by semaphore",
            target, Use::ACQUIRED, Use::COLOR_WRITE,
        );
        device.begin_label(commands, c"compose");
        self.stamps[slot].start(commands, 0);
        drawing.targets[image].begin(commands, &[]);
        drawing.compose.record(commands, slot, shown, [place[2], place[3]], pane);
        device.begin_label(commands, c"panel");
        drawing.panel.record(commands, slot, panel);
        device.end_label(commands);
        drawing.targets[image].end(commands);
        self.stamps[slot].end(commands, 0);
        device.end_label(commands);
        barrier::image(
            device, commands, c"layout: the display reads the image, by semaphore",
            target, Use::COLOR_WRITE, Use::PRESENTED,
        );
        self.slots[slot].submit_between(&self.acquired[slot], swapchain.finished(image))?;
        self.pending[slot] = true;
        drawing.panel.forget(panel);
        self.slot = (slot + 1) % FRAMES_IN_FLIGHT;
        match swapchain.present(image)? {
            Turn::Granted(()) | Turn::NotYet => {}
            Turn::Suboptimal(()) | Turn::OutOfDate => self.stale = true,
        }
        Ok(Drawn::Shown)
    }

    /// Whether there is something to draw into: makes it, where the window is new or has changed. `any` has a picture.
    fn prepare(&mut self, any: &Renderer) -> gpu::Result<bool> {
        if !self.stale {
            return Ok(self.swapchain.is_some());
        }
        // Of frames that draw to the images, before these go.
        for slot in &self.slots {
            slot.wait()?;
        }
        if let Some(drawing) = &mut self.drawing {
            drawing.targets.clear();
        }
        let old = self.swapchain.take();
        self.swapchain = Swapchain::new(&self.device, &self.surface, self.size, self.mode, old)?;
        // A window without area is asked again with every frame.
        let Some(swapchain) = &self.swapchain else {
            return Ok(false);
        };
        self.stale = false;
        tracing::info!(
            "window: {:?} pixels, {}",
            swapchain.size(),
            swapchain.mode().name()
        );
        let targets = swapchain.images().iter();
        let targets = targets.map(|image| overwriting_pass(&self.device, "compose", &[image]));
        let targets = targets.collect::<gpu::Result<Vec<_>>>()?;
        let format = swapchain.images()[0].format();
        let encodes = encodes(format);
        match &mut self.drawing {
            Some(drawing) => {
                if drawing.format != format {
                    drawing.compose.retarget(&targets[0], encodes)?;
                    drawing.panel.retarget(&targets[0], encodes)?;
                    drawing.format = format;
                }
                drawing.targets = targets;
            }
            None => {
                let (device, display, pass) = (&self.device, &any.canvas.display, &targets[0]);
                self.drawing = Some(Drawing {
                    format,
                    compose: ComposePass::new(device, pass, display, FRAMES_IN_FLIGHT, encodes)?,
                    panel: PanelPass::new(device, pass, FRAMES_IN_FLIGHT, encodes)?,
                    targets,
                });
            }
        }
        Ok(true)
    }
}

/// What is new of the panel's textures, one copy after another.
#[rustfmt::skip] // A barrier is read as a sentence.
pub(super) fn record_textures(
    device: &Device,
    commands: vk::CommandBuffer,
    pass: &PanelPass,
    slot: usize,
    panel: &Panel,
) {
    for copy in pass.copies(slot, panel) {
        let before = if copy.holds { Use::FRAGMENT_SAMPLE } else { Use::DISCARD };
        barrier::image(
            device, commands, c"WAR: the previous frame draws with the texture",
            copy.texture, before, Use::COPY_TARGET,
        );
        submit::record_part_upload(device, commands, copy.from, copy.texture, copy.place);
        barrier::image(
            device, commands, c"RAW: the panel draws with the texture",
            copy.texture, Use::COPY_TARGET, Use::FRAGMENT_SAMPLE,
        );
    }
}

/// How far beyond its place is the picture's backdrop drawn, pixels? The panel ends somewhere within a pixel.
const SEAM: i64 = 2;

/// Columns and rows of a window of `size` pixels that the picture at `place` and its seam fill.
fn beside([x, y, width, height]: [i32; 4], size: [u32; 2]) -> [u32; 4] {
    let span = |first: i32, length: i32, side: u32| {
        let within = |at: i64| at.clamp(0, i64::from(side)) as u32;
        let from = within(i64::from(first) - SEAM);
        let to = within(i64::from(first) + i64::from(length) + SEAM);
        (from, to - from)
    };
    let ((left, columns), (top, rows)) = (span(x, width, size[0]), span(y, height, size[1]));
    [left, top, columns, rows]
}

/// Columns and rows within `place` that a picture of `size` pixels fills without being distorted. All of them where a pixel
/// of it makes the difference: sizes of drafts are rounded.
fn fitted(place: [i32; 4], size: [u32; 2]) -> [i32; 4] {
    let [x, y, width, height] = place.map(f64::from);
    let [columns, rows] = size.map(|side| f64::from(side.max(1)));
    let (across, down) = (width / columns, height / rows);
    if (width * rows - height * columns).abs() <= (columns + rows) * across.max(down) {
        return place;
    }
    let scale = across.min(down);
    let (columns, rows) = ((columns * scale).round(), (rows * scale).round());
    let middle = |first: f64, side: f64, own: f64| first + (0.5 * (side - own)).floor();
    [
        middle(x, width, columns),
        middle(y, height, rows),
        columns,
        rows,
    ]
    .map(|at| at as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_not_distorted() {
        // Its own size, and that of every draft of it.
        for (width, height) in [(800, 600), (1283, 97), (61, 499), (333, 251)] {
            let place = [7, 9, width, height];
            for share in [1.0, 0.5, 1.0 / 3.0, 0.25] {
                let draft =
                    [width, height].map(|side| ((f64::from(side) * share).round() as u32).max(1));
                assert_eq!(fitted(place, draft), place, "{share}");
            }
        }
        // While the window gets narrower, lower or larger.
        assert_eq!(fitted([10, 20, 400, 600], [800, 600]), [10, 170, 400, 300]);
        assert_eq!(fitted([10, 20, 800, 300], [800, 600]), [210, 20, 400, 300]);
        assert_eq!(fitted([0, 0, 1000, 600], [400, 300]), [100, 0, 800, 600]);
        assert_eq!(fitted([5, 6, 0, 0], [800, 600])[2..], [0, 0]);
    }

    #[test]
    fn what_is_drawn_lies_in_the_window() {
        assert_eq!(beside([0, 0, 10, 8], [10, 8]), [0, 0, 10, 8]);
        assert_eq!(beside([5, 6, 10, 8], [100, 80]), [3, 4, 14, 12]);
        assert_eq!(beside([-50, 70, 10, 80], [100, 80]), [0, 68, 0, 12]);
    }
}
