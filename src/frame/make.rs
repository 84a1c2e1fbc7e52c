//! What a plan needs on a device, made once: every image, buffer and pipeline.

use std::ops::Range;
use std::sync::Arc;

use ash::vk;
use bytemuck::Zeroable;

use super::boxes::BoxesPass;
use super::deform::DeformPass;
use super::exact::ExactPass;
use super::fetches::{Build, Counters};
use super::geometry::Geometry;
use super::half::HalfPass;
use super::history::HistoryPass;
use super::light::LightPass;
use super::live::Live;
use super::reduce::ReducePass;
use super::resolve::ResolvePass;
use super::shade::{PartDesc, ShadePass};
use super::targets::{self, Boxes, Canvas, GBuffer, Light, LightMap, PyramidDesc};
use super::uniforms::{LevelTable, Reprojection, Uniforms, VolumeTable};
use super::view::{self, ViewPass};
use super::volume::VolumePass;
use super::{
    EXACT_SUBMIT, FRAMES_IN_FLIGHT, PASSES, Renderer, Setup, Shaders, filter_of, live_stages,
    stages,
};
use crate::gpu::{self, Buffer, Device, Location, Slot, Statistics, Timestamps};
use crate::optics::single::PathFit;
use crate::scene::{LightFrame, Mesh, Multiple, Plan, Scattering, Taps};

impl Renderer {
    /// Prepares `plan` on `device`: every image, buffer and pipeline.
    ///
    /// # Errors
    /// [`gpu::Error::OutOfMemory`] naming what did not fit, [`gpu::Error::Unsupported`] where the device cannot count,
    /// [`gpu::Error::Shader`] where its source of shaders gives none, or what the driver says.
    pub fn new(device: &Arc<Device>, plan: &Plan, setup: &Setup) -> gpu::Result<Self> {
        let &Setup {
            keep_gbuffer,
            measure,
            filter,
            shaders,
            live,
            reproject,
        } = setup;
        let filter = filter.unwrap_or_else(|| filter_of(device.candidate()));
        let counters = matches!(shaders, Shaders::Counting | Shaders::Stray)
            .then(|| {
                let stages = match live {
                    true => live_stages(plan, filter, shaders),
                    false => stages(plan, filter, shaders),
                };
                Counters::new(device, plan.size, &stages)
            })
            .transpose()?;
        let build = match (&counters, shaders) {
            (None, Shaders::Floor) => Build::Floor,
            (None, _) => Build::Plain,
            (Some(counters), Shaders::Stray) => Build::Stray(counters),
            (Some(counters), _) => Build::Counting(counters),
        };
        let mesh = &plan.scene.mesh;
        // Positions are kept relative to the middle, so that float32 serves them best.
        let (center, radius) = (plan.center(), plan.radius());
        let moving = plan.motion.as_ref().filter(|motion| motion.deforms());
        let light_frame = plan.light_frame();
        let taps = taps(plan, &light_frame);
        let built = Built::of(plan, &light_frame, taps.as_ref(), is_closed(plan));
        let pyramid = &built.pyramid;

        let slots = (0..FRAMES_IN_FLIGHT)
            .map(|i| Slot::new(device, &format!("frame {i}")))
            .collect::<gpu::Result<Vec<_>>>()?;
        let stamps = (0..FRAMES_IN_FLIGHT)
            .map(|i| Timestamps::new(device, &format!("stamps {i}"), PASSES.len() as u32))
            .collect::<gpu::Result<Vec<_>>>()?;
        let statistics = (0..FRAMES_IN_FLIGHT)
            .filter(|_| measure)
            .filter_map(|i| {
                Statistics::new(device, &format!("statistics {i}"), PASSES.len() as u32).transpose()
            })
            .collect::<gpu::Result<Vec<_>>>()?;
        let blocks_of = |name: &str, size: usize| {
            let uniforms = (0..FRAMES_IN_FLIGHT).map(|i| {
                let size = size as u64;
                let usage = vk::BufferUsageFlags::UNIFORM_BUFFER;
                Buffer::new(
                    device,
                    &format!("{name} {i}"),
                    size,
                    usage,
                    Location::Upload,
                )
            });
            uniforms.collect::<gpu::Result<Vec<_>>>()
        };
        let uniforms = blocks_of("uniforms", size_of::<Uniforms>())?;
        let (mut geometry, deform) = match moving {
            None => (Geometry::new(device, mesh, center)?, None),
            Some(motion) => {
                let geometry = Geometry::moving(device, &motion.model)?;
                let deform = DeformPass::new(device, &motion.model, &geometry, FRAMES_IN_FLIGHT)?;
                (geometry, Some(deform))
            }
        };
        if live && deform.is_some() {
            geometry.keep_before()?;
        }
        let map = LightMap::new(device, plan.light_map, pyramid.as_ref())?;
        let has_rings = plan.methods().any(|m| matches!(m, Multiple::Rings(_)));
        let boxes = has_rings
            .then(|| Boxes::new(device, [plan.light_map; 2]))
            .transpose()?;
        let levels = match (&taps, &map.pyramid) {
            (Some(taps), Some(pyramid)) => {
                LevelTable::new(taps, light_frame.z_half, &pyramid.atlas)
            }
            _ => LevelTable::zeroed(),
        };
        let volumes = taps
            .as_ref()
            .and_then(|taps| taps.volumes.as_ref())
            .map(|volumes| Light::new(device, volumes))
            .transpose()?;
        let volume_places = taps.as_ref().map_or_else(VolumeTable::zeroed, |taps| {
            VolumeTable::new(taps, &light_frame)
        });
        let kept = taps.as_ref().map_or(0.0, Taps::kept);
        let gbuffer = GBuffer::new(device, "", plan.size)?;
        let canvas = Canvas::new(device, plan.size)?;
        let motion = live
            .then(|| targets::motion(device, plan.size))
            .transpose()?;
        let reprojections = match live {
            true => blocks_of("reprojection", size_of::<Reprojection>())?,
            false => Vec::new(),
        };
        let readback = |name, bytes: u64| {
            let size = u64::from(plan.size[0]) * u64::from(plan.size[1]) * bytes;
            Buffer::new(
                device,
                name,
                size,
                vk::BufferUsageFlags::TRANSFER_DST,
                Location::Readback,
            )
        };

        let parts = built.parts.clone();
        let exact_columns = parts
            .iter()
            .find(|part| part.method == Multiple::Exact)
            .map(|part| part.columns);
        let camera = view::render_pass(
            device,
            &gbuffer,
            &canvas.radiance,
            motion.as_ref(),
            keep_gbuffer || exact_columns.is_some(),
        )?;
        // Back faces of a solid are seen by no one who is outside, and by the light never. They are as many
        // as the others.
        let [light_solid, solid] = built.solid;
        let light = LightPass::new(device, &uniforms, &map, light_solid)?;
        let reduce = map
            .pyramid
            .as_ref()
            .map(|pyramid| ReducePass::new(device, &map.moments, pyramid, build))
            .transpose()?;
        let box_levels = boxes
            .as_ref()
            .map(|boxes| BoxesPass::new(device, &map.moments, boxes, build))
            .transpose()?;
        let volume = volumes
            .as_ref()
            .map(|light| VolumePass::new(device, &map.moments, light, build))
            .transpose()?;
        let half_parts = built.half_parts.clone();
        let half = (!half_parts.is_empty())
            .then(|| {
                let size = plan.size.map(|side| side.div_ceil(2));
                HalfPass::new(
                    device,
                    blocks_of("half uniforms", size_of::<Uniforms>())?,
                    size,
                    &map,
                    boxes.as_ref(),
                    volumes.as_ref(),
                    &half_parts,
                    solid,
                    keep_gbuffer,
                    filter,
                    build,
                )
            })
            .transpose()?;
        let view = ViewPass::new(device, &uniforms, &reprojections, &camera, solid)?;
        let shade = ShadePass::new(
            device,
            &uniforms,
            &camera,
            view::SHADE,
            &map,
            boxes.as_ref(),
            volumes.as_ref(),
            &gbuffer,
            half.as_ref().map(|half| &half.radiance),
            &parts,
            plan.specular,
            filter,
            build,
        )?;
        let exact = exact_columns
            .map(|columns| {
                ExactPass::new(device, &uniforms, &map, &gbuffer, &canvas, columns, build)
            })
            .transpose()?;
        // Of a renderer for live display the live frames are counted.
        let mean_build = if live { Build::Plain } else { build };
        let resolve = ResolvePass::new(device, &uniforms, &canvas, built.averages, mean_build)?;
        let live = match motion {
            Some(motion) => Some(Live {
                pass: HistoryPass::new(
                    device,
                    &uniforms,
                    &canvas,
                    &motion,
                    &gbuffer.depth,
                    filter,
                    build,
                )?,
                motion,
                reprojections,
                reproject,
                done: 0,
                before: None,
                stale: false,
                moved: false,
                read: true,
            }),
            None => None,
        };
        Ok(Renderer {
            redraw_light: false,
            exact_submit: EXACT_SUBMIT,
            stop: None,
            slots,
            stamps,
            statistics,
            uniforms,
            geometry,
            deform,
            light,
            reduce,
            box_levels,
            volume,
            half,
            camera,
            view,
            shade,
            exact,
            resolve,
            live,
            map,
            boxes,
            volumes,
            built,
            levels,
            volume_places,
            kept,
            path: PathFit::new(plan.scene.material.eta),
            gbuffer,
            canvas,
            mean_readback: readback("mean readback", 16)?,
            display_readback: readback("display readback", 4)?,
            plan: plan.clone(),
            center,
            radius,
            light_frame,
            pose: moving.map(|motion| motion.pose(plan.time)),
            posed: false,
            drawn: None,
            pending: vec![false; FRAMES_IN_FLIGHT],
            display_left: None,
            pass_totals: [0.0; PASSES.len()],
            last_times: [None; PASSES.len()],
            last_invocations: [[None; PASSES.len()]; FRAMES_IN_FLIGHT],
            collected: 0,
            frames: 0,
            light_draws: 0,
            deforms: 0,
            measure,
            keep_gbuffer,
            marches: parts.iter().any(|part| part.march.is_some()),
            half_marches: half_parts.iter().any(|part| part.march.is_some()),
            counters,
            device: Arc::clone(device),
        })
    }
}

/// What the images, buffers and pipelines of a plan depend on. Plans for which it is the same, and the mesh, differ in
/// uniforms alone.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Built {
    size: [u32; 2],
    light_map: u32,
    pyramid: Option<PyramidDesc>,
    volumes: Option<VolumesBuilt>,
    parts: Vec<PartDesc>,
    half_parts: Vec<PartDesc>,
    specular: bool,
    averages: bool,
    // Whether the light, and the camera, see front faces alone.
    solid: [bool; 2],
}

/// What the images and pipelines of volumes depend on.
#[derive(Clone, Debug, PartialEq)]
struct VolumesBuilt {
    image: [u32; 3],
    cells: [u64; 2],
    radii: Vec<usize>,
}

impl Built {
    /// Of `plan`, whose mixture, if it has one, has `taps` on a map in `light_frame`, and whose mesh is `closed`
    /// ([`is_closed`]).
    fn of(plan: &Plan, light_frame: &LightFrame, taps: Option<&Taps>, closed: bool) -> Built {
        let outside = match &plan.motion {
            Some(motion) => motion.seen_from_outside,
            None => plan.scene.mesh.is_outside(plan.scene.camera.eye),
        };
        let volumes = taps.and_then(|taps| taps.volumes.as_ref());
        Built {
            size: plan.size,
            light_map: plan.light_map,
            pyramid: taps.map(|taps| PyramidDesc {
                levels: taps.span(0..taps.moments()),
                fourth: (!taps.fourth.is_empty()).then(|| taps.span(taps.fourth.clone())),
            }),
            volumes: volumes.map(|volumes| VolumesBuilt {
                image: volumes.image,
                cells: [volumes.light_cells(), volumes.cells()],
                radii: volumes.volumes.iter().map(|v| v.weights.len()).collect(),
            }),
            parts: parts(plan, light_frame),
            half_parts: half_parts(plan, light_frame),
            specular: plan.specular,
            averages: plan.frames_averaged > 1,
            solid: [closed, closed && outside],
        }
    }
}

/// What the mixture of `plan`, if it has one, taps in a map in `light_frame`.
fn taps(plan: &Plan, light_frame: &LightFrame) -> Option<Taps> {
    plan.methods().find_map(|method| match method {
        Multiple::Mixture(mixture) => Some(plan.taps(mixture, light_frame)),
        _ => None,
    })
}

/// Whether the mesh of `plan` encloses solids, in all its shapes. What moves stays closed.
fn is_closed(plan: &Plan) -> bool {
    match plan.motion.as_ref().filter(|motion| motion.deforms()) {
        Some(motion) if motion.model.shapes.len() > 1 => {
            motion.model.shapes.iter().all(Mesh::is_solid)
        }
        _ => plan.scene.mesh.is_solid(),
    }
}

impl Renderer {
    /// Draws `plan` from the next frame on, if all that was made on the device serves it, too: if it differs in nothing but
    /// light, camera, time, divider, coefficients of the material, exposure and background, and these change no level, no pipeline
    /// and no image. Returns whether it does; if not, it goes on as before, and `plan` needs a renderer of its own.
    pub fn adopt(&mut self, plan: &Plan) -> bool {
        let deforming = |plan: &Plan| plan.motion.clone().filter(|motion| motion.deforms());
        let same_mesh = match (deforming(&self.plan), deforming(plan)) {
            (Some(own), Some(new)) => Arc::ptr_eq(&own, &new) || own.model == new.model,
            // Its vertices were uploaded relative to the centre.
            (None, None) => self.center == plan.center() && self.plan.scene.mesh == plan.scene.mesh,
            _ => false,
        };
        if !same_mesh {
            return false;
        }
        let light_frame = plan.light_frame();
        let taps = taps(plan, &light_frame);
        let mut built = Built::of(plan, &light_frame, taps.as_ref(), self.built.solid[0]);
        // Where the divider stands is no matter of pipelines.
        for (new, own) in built.parts.iter_mut().zip(&self.built.parts) {
            new.columns = own.columns;
        }
        if built != self.built {
            return false;
        }
        if let (Some(taps), Some(pyramid)) = (&taps, &self.map.pyramid) {
            self.levels = LevelTable::new(taps, light_frame.z_half, &pyramid.atlas);
            self.volume_places = VolumeTable::new(taps, &light_frame);
            self.kept = taps.kept();
            if let (Some(light), Some(volumes)) = (&mut self.volumes, &taps.volumes) {
                light.desc.clone_from(volumes);
            }
        }
        let eta = plan.scene.material.eta;
        if eta != self.plan.scene.material.eta {
            self.path = PathFit::new(eta);
            // The map holds what enters through the surface.
            self.drawn = None;
        }
        if let Some(motion) = deforming(plan) {
            let pose = Some(motion.pose(plan.time));
            if pose != self.pose || self.center != plan.center() {
                (self.pose, self.posed, self.drawn) = (pose, false, None);
            }
        }
        (self.center, self.radius) = (plan.center(), plan.radius());
        self.light_frame = light_frame;
        self.plan.clone_from(plan);
        self.set_split_at(plan.split_at);
        true
    }
}

/// What is shaded at half size, where the plan asks for it.
pub(super) fn half_parts(plan: &Plan, light_frame: &LightFrame) -> Vec<PartDesc> {
    match plan.scattering {
        Scattering::Full => Vec::new(),
        Scattering::Half => {
            let columns = [0, plan.size[0].div_ceil(2)];
            vec![PartDesc {
                halved: true,
                ..part(plan, light_frame, columns, plan.multiple)
            }]
        }
    }
}

/// Columns of a picture shaded by `method`.
pub(super) fn part(
    plan: &Plan,
    light_frame: &LightFrame,
    columns: [u32; 2],
    method: Multiple,
) -> PartDesc {
    PartDesc {
        columns,
        method,
        march: plan.march(method),
        counts: match method {
            Multiple::None | Multiple::Brdf | Multiple::Exact => [0; 5],
            Multiple::Samples(n) => [n, 0, 0, 0, 0],
            Multiple::Rings(n) => [plan.rings(n), 0, 0, 0, 0],
            Multiple::Mixture(mixture) => {
                let taps = plan.taps(mixture, light_frame);
                let Range { start, end } = taps.fourth;
                let blended = taps.moments() - taps.first_volume;
                let alone = taps.levels.count - taps.moments();
                [start, end - start, taps.first_volume - end, blended, alone]
            }
        },
        halved: false,
        upsampled: false,
    }
}

/// The parts of the picture, on a light map in `light_frame`.
pub(super) fn parts(plan: &Plan, light_frame: &LightFrame) -> Vec<PartDesc> {
    let part = |columns, method| match plan.scattering {
        Scattering::Full => part(plan, light_frame, columns, method),
        Scattering::Half => PartDesc {
            columns,
            method: Multiple::None,
            counts: [0; 5],
            march: None,
            halved: false,
            upsampled: true,
        },
    };
    plan.parts()
        .map(|(columns, method)| part(columns, method))
        .collect()
}
