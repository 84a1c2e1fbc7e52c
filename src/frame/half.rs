//! Scattering at half the width and height: a camera's render pass of its own, whose radiance the picture's own
//! shade pass brings back.
//!
//! Shaders and CPU twins are those of [`super::view`] and [`super::shade`], for a quarter of the pixels.

use std::sync::Arc;

use super::fetches::Build;
use super::shade::{PartDesc, ShadePass};
use super::targets::{self, Boxes, GBuffer, Light, LightMap};
use super::view::{self, ViewPass};
use crate::gpu::{self, Buffer, Device, Image, RenderPass};
use crate::ledger::Filter;

/// The camera at half size: its targets and its passes.
pub struct HalfPass {
    /// Of each frame slot, the uniforms: those of the frame, seen in half as many columns and rows.
    pub uniforms: Vec<Buffer>,
    /// What it sees.
    pub gbuffer: GBuffer,
    /// What is scattered there, and how far away it is.
    pub radiance: Image,
    /// Its render pass.
    pub camera: RenderPass,
    /// Draws the G-buffer.
    pub view: ViewPass,
    /// Shades.
    pub shade: ShadePass,
}

impl HalfPass {
    /// Prepares shading `parts`, in a picture of `size` pixels, of a mesh that is solid for the camera or not.
    #[allow(clippy::too_many_arguments, reason = "the graph's edges, each by name")]
    pub fn new(
        device: &Arc<Device>,
        uniforms: Vec<Buffer>,
        size: [u32; 2],
        map: &LightMap,
        boxes: Option<&Boxes>,
        light: Option<&Light>,
        parts: &[PartDesc],
        solid: bool,
        keep_gbuffer: bool,
        filter: Filter,
        build: Build<'_>,
    ) -> gpu::Result<Self> {
        let gbuffer = GBuffer::new(device, "half ", size)?;
        let radiance = targets::scattered(device, size)?;
        let camera = view::render_pass(device, &gbuffer, &radiance, None, keep_gbuffer)?;
        let view = ViewPass::new(device, &uniforms, &[], &camera, solid)?;
        let shade = ShadePass::new(
            device,
            &uniforms,
            &camera,
            view::SHADE,
            map,
            boxes,
            light,
            &gbuffer,
            None,
            parts,
            // The reflection at the surface is the picture's own.
            false,
            filter,
            build,
        )?;
        Ok(HalfPass {
            uniforms,
            gbuffer,
            radiance,
            camera,
            view,
            shade,
        })
    }
}
