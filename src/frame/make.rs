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
use super::{FRAMES_IN_FLIGHT, PASSES, Renderer, Setup, Shaders, filter_of, live_stages, stages};
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
        let taps = plan.methods().find_map(|method| match method {
            Multiple::Mixture(mixture) => Some(plan.taps(mixture, &light_frame)),
            _ => None,
        });
        let pyramid = taps.as_ref().map(|taps| PyramidDesc {
            levels: taps.span(0..taps.moments()),
            fourth: (!taps.fourth.is_empty()).then(|| taps.span(taps.fourth.clone())),
        });

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

        let parts = parts(plan, &light_frame);
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
        let solid = match moving {
            // What moves stays closed; shapes may differ.
            Some(motion) if motion.model.shapes.len() > 1 => {
                motion.model.shapes.iter().all(Mesh::is_solid)
            }
            _ => mesh.is_solid(),
        };
        let light = LightPass::new(device, &uniforms, &map, solid)?;
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
        let solid = match &plan.motion {
            Some(motion) => motion.seen_from_outside && solid,
            None => mesh.is_solid_from(plan.scene.camera.eye),
        };
        let half_parts = half_parts(plan, &light_frame);
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
        let averages = plan.frames_averaged > 1;
        let resolve = ResolvePass::new(device, &uniforms, &canvas, averages, mean_build)?;
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
            pass_totals: [0.0; PASSES.len()],
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
    let width = plan.size[0];
    match plan.split {
        // Two halves of one method are one part, and `exact` sums one part.
        Some(left) if left != plan.multiple => {
            vec![
                part([0, width / 2], left),
                part([width / 2, width], plan.multiple),
            ]
        }
        _ => vec![part([0, width], plan.multiple)],
    }
}
