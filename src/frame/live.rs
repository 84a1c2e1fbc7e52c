//! Live display: what it remembers from frame to frame. What it records is on the frame's page.

use ash::vk;

use super::history::HistoryPass;
use super::{FRAMES_IN_FLIGHT, Moment, PASSES, Renderer};
use crate::gpu::{self, Buffer, Image, Use};
use crate::scene::View;

/// What live display has besides, and what it remembers of the frame before.
pub(super) struct Live {
    pub(super) pass: HistoryPass,
    pub(super) motion: Image,
    // Of each frame slot.
    pub(super) reprojections: Vec<Buffer>,
    pub(super) reproject: bool,
    // Frames since the history began.
    pub(super) done: u32,
    // What the frame before was seen by, without jitter, and which shape it drew; none where history begins.
    pub(super) before: Option<(View, usize)>,
    // Whether the previous vertices are older than those of the frame before.
    pub(super) stale: bool,
    // Whether the mesh of the frame that is recorded has previous vertices to be drawn with.
    pub(super) moved: bool,
    // Whether the frame before was read: it is done, and mean and display image are as the copy left them.
    pub(super) read: bool,
}

impl Renderer {
    /// Draws one frame for live display, of the instant that was [shown](Renderer::show): jittered as frame `index` of an
    /// average is, joined with a history of the frames before it, which follows what moves, and encoded. The frame after
    /// [`Renderer::new`], [`Renderer::forget_history`] or [`Renderer::render`] has no history.
    ///
    /// It waits only for the frame before the last one. With `read` it waits for this one, and
    /// [`Renderer::radiance`] and [`Renderer::display`] then are of it; [`Renderer::pass_times`] are of the frames since the
    /// one that was read before.
    ///
    /// # Errors
    /// [`gpu::Error::Unsupported`] of a renderer without [`super::Setup::live`], or as [`Renderer::render`].
    pub fn draw_live(&mut self, index: u32, read: bool) -> gpu::Result<()> {
        let done = self.begin_live()?;
        let slot = self.frames as usize % FRAMES_IN_FLIGHT;
        self.collect(slot)?;
        self.frames += 1;
        self.write_uniforms(slot, index, done)?;
        let mut commands = self.start(slot)?;
        self.record_live_scene(commands, slot, index)?;
        if self.exact.is_some() {
            commands = self.sum_exact(slot, 0, &mut |_| ())?;
        }
        self.record_history(commands, slot, done);
        if read {
            self.record_readback(commands, slot, done);
        }
        self.submit(slot)?;
        self.display_left = Some(if read {
            Use::COPY_SOURCE
        } else {
            Use::COLOR_WRITE
        });
        self.end_live(read);
        if read {
            for slot in 0..FRAMES_IN_FLIGHT {
                self.collect(slot)?;
            }
        }
        Ok(())
    }

    /// Draws two frames for live display in one submit, for the same test as [`Renderer::render_pair`]: those of `moments`,
    /// jittered as frames 0 and 1. Not for `exact`.
    ///
    /// # Errors
    /// As [`Renderer::draw_live`].
    pub fn draw_live_pair(&mut self, moments: [&Moment; 2]) -> gpu::Result<()> {
        for slot in 0..FRAMES_IN_FLIGHT {
            self.collect(slot)?;
        }
        let commands = self.slots[0].begin()?;
        for (slot, moment) in moments.into_iter().enumerate() {
            self.show(moment);
            let done = self.begin_live()?;
            self.write_uniforms(slot, slot as u32, done)?;
            self.stamps[slot].reset(commands);
            if let Some(statistics) = self.statistics.get(slot) {
                statistics.reset(commands);
            }
            self.record_live_scene(commands, slot, slot as u32)?;
            self.record_history(commands, slot, done);
            self.end_live(false);
        }
        self.slots[0].submit()?;
        self.slots[0].wait()
    }

    /// Has the next live frame begin a new history: for a cut, after which nothing is where it was.
    pub fn forget_history(&mut self) {
        if let Some(live) = &mut self.live {
            (live.done, live.before) = (0, None);
        }
    }

    /// How many frames the history holds before the one that is to be drawn, whose times begin anew after one that was
    /// read.
    pub(super) fn begin_live(&mut self) -> gpu::Result<u32> {
        let Some(live) = &self.live else {
            return Err(gpu::Error::Unsupported(
                "this renderer was not made for live display".to_owned(),
            ));
        };
        if live.read {
            self.pass_totals = [0.0; PASSES.len()];
            (self.frames, self.light_draws, self.deforms) = (0, 0, 0);
        }
        Ok(live.done)
    }

    /// What the next live frame must know of the one that was recorded.
    pub(super) fn end_live(&mut self, read: bool) {
        let before = (self.view(0), self.geometry.shape);
        if let Some(live) = &mut self.live {
            live.done = live.done.saturating_add(1);
            (live.before, live.read) = (Some(before), read);
        }
    }

    /// Before the plan's frames are averaged: no live frame is in flight, and their history goes.
    pub(super) fn leave_live(&mut self) -> gpu::Result<()> {
        self.forget_history();
        let in_flight = match &mut self.live {
            Some(live) => !std::mem::replace(&mut live.read, true),
            None => false,
        };
        for slot in (0..FRAMES_IN_FLIGHT).filter(|_| in_flight) {
            self.collect(slot)?;
        }
        Ok(())
    }

    /// A live frame, from the vertices up to radiance; what it draws must have been written for `slot`.
    pub(super) fn record_live_scene(
        &mut self,
        commands: vk::CommandBuffer,
        slot: usize,
        index: u32,
    ) -> gpu::Result<()> {
        let live = self.live.as_mut();
        let stale = live.is_some_and(|live| std::mem::take(&mut live.stale));
        let poses = self.poses(slot)?;
        if self.deform.is_some() && (stale || poses) {
            self.record_deform(commands, slot, [stale, poses]);
        }
        let (geometry, deforms) = (&self.geometry, self.deform.is_some());
        if let Some(live) = &mut self.live {
            let before = live.before.as_ref();
            let same = before.is_some_and(|&(_, was)| geometry.same_vertices(was, geometry.shape));
            live.moved = deforms && same && live.reproject;
        }
        if self.draws_light(index) {
            self.record_light(commands, slot);
        }
        self.record_scene(commands, slot);
        Ok(())
    }
}
