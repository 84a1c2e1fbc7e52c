//! The renderer's side of the fetch ledger: which shaders a plan runs, and their counting build.

use std::collections::HashSet;
use std::sync::Arc;

use ash::vk;

use super::make::{half_parts, parts};
use super::shade::{self, PartDesc};
use super::{Renderer, SHADE_PASS, history, reduce, resolve, shaders};
use crate::gpu::{self, Binding, Buffer, Device, Location, Shader, Use};
use crate::ledger::{self, Counts, Filter, Stage};
use crate::scene::{Multiple, Plan};

/// The binding of the counts in the sets of a counting build, beyond those of every pass.
const COUNTS: usize = 15;

/// How the counts are used: by any stage that reads textures.
pub const COUNTING: Use = Use::FRAGMENT_STORAGE.and(Use::COMPUTE_STORAGE);

/// Which build of the shaders runs.
#[derive(Clone, Copy)]
pub enum Build<'a> {
    /// The one that draws pictures.
    Plain,
    /// The one that also counts what it reads.
    Counting(&'a Counters),
    /// One whose shade pass only reads.
    Floor,
    /// A counting build whose shade pass reads a texture that nobody declared, for tests.
    Stray(&'a Counters),
}

/// What a renderer does with its shaders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shaders {
    /// It draws.
    #[default]
    Plain,
    /// It draws, and counts what its shaders read.
    Counting,
    /// In place of shading it only reads what shading reads: for the time that takes.
    Floor,
    /// The same, with a read in the shade pass that nobody declared: for tests.
    Stray,
}

/// Where the counting build stores its counts, a buffer for each shader.
pub struct Counters {
    stages: Vec<(&'static str, u32, Buffer)>,
}

impl Counters {
    /// Makes room for a picture of `size` pixels.
    ///
    /// # Errors
    /// [`gpu::Error::Unsupported`] where fragment shaders cannot store.
    pub fn new(device: &Arc<Device>, size: [u32; 2], stages: &[Stage]) -> gpu::Result<Self> {
        if !device.candidate().fragment_stores {
            return Err(gpu::Error::Unsupported(format!(
                "{} cannot store from fragment shaders, so fetches cannot be measured on it; choose \
                 another with --device",
                device.candidate().name
            )));
        }
        let mut names = HashSet::new();
        // The bands of `exact` share theirs.
        let stages = stages.iter().filter(|stage| names.insert(stage.shader));
        let stages = stages.map(|stage| {
            let [columns, rows] = match (stage.texels, stage.pass) {
                (Some(_), _) => [1, 1],
                (None, ledger::HALF_SHADE) => size.map(|side| side.div_ceil(2)),
                (None, _) => size,
            };
            let entries = columns as usize * rows as usize;
            // The columns, and the counts.
            let mut data = vec![[0u32; 4]; 1 + entries];
            data[0][0] = columns;
            let mut buffer = Buffer::new(
                device,
                &format!("counts of {}", stage.shader),
                size_of_val(data.as_slice()) as u64,
                vk::BufferUsageFlags::STORAGE_BUFFER,
                Location::Readback,
            )?;
            buffer.write(bytemuck::cast_slice(&data))?;
            Ok((stage.shader, columns, buffer))
        });
        Ok(Counters {
            stages: stages.collect::<gpu::Result<_>>()?,
        })
    }

    /// The buffers, for barriers.
    pub fn buffers(&self) -> impl Iterator<Item = &Buffer> {
        self.stages.iter().map(|(.., buffer)| buffer)
    }

    /// What the last frame has counted.
    ///
    /// # Errors
    /// What the driver says.
    pub fn read(&self) -> gpu::Result<Vec<Counts>> {
        let counts = self.stages.iter().map(|(shader, columns, buffer)| {
            let words: Vec<[u32; 4]> = bytemuck::pod_collect_to_vec(buffer.read()?);
            Ok(Counts {
                shader,
                columns: *columns,
                reads: words[1..].to_vec(),
            })
        });
        counts.collect()
    }
}

impl<'a> Build<'a> {
    fn counters(self) -> Option<&'a Counters> {
        match self {
            Build::Plain | Build::Floor => None,
            Build::Counting(counters) | Build::Stray(counters) => Some(counters),
        }
    }

    /// The SPIR-V of `shader` in this build.
    pub fn shader(self, shader: &Shader) -> Shader {
        match self {
            Build::Plain => *shader,
            Build::Floor => shader.floored(),
            Build::Counting(_) | Build::Stray(_) => shader.counted(),
        }
    }

    /// The bindings of `shader`: its own, and in a counting build the counts.
    pub fn bindings(self, shader: &Shader, own: Vec<Binding<'a>>) -> Vec<Binding<'a>> {
        let counts = self.counters().and_then(|counters| {
            let of = |(name, ..): &&(&str, u32, Buffer)| *name == shader.name;
            counters.stages.iter().find(of)
        });
        let mut bindings = own;
        if let Some((.., buffer)) = counts {
            bindings.resize(COUNTS, Binding::Unused);
            bindings.push(Binding::StorageBuffer(buffer));
        }
        bindings
    }
}

/// The shaders that `plan` runs and that read textures, on a device that filters as `filter`, in the order of the
/// frame. Of a split picture, those of both parts.
pub fn stages(plan: &Plan, filter: Filter, shaders: Shaders) -> Vec<Stage> {
    let mut stages = scene_stages(plan, filter, shaders);
    // The last frame's encodes as well.
    let averages = u32::from(plan.frames_averaged > 1);
    stages.push(stage(
        "resolve",
        resolve::shader(true),
        &[averages],
        &[],
        None,
    ));
    stages
}

/// The same of a frame of `plan` for live display.
pub fn live_stages(plan: &Plan, filter: Filter, shaders: Shaders) -> Vec<Stage> {
    let mut stages = scene_stages(plan, filter, shaders);
    let constants = &history::CONSTANTS;
    stages.push(stage(
        "resolve",
        history::shader(filter),
        constants,
        &[],
        None,
    ));
    stages
}

/// What a frame of a window runs besides.
pub fn window_stages() -> [Stage; 2] {
    // Either way of encoding reads as often.
    [&shaders::COMPOSE_FRAG, &shaders::PANEL_FRAG]
        .map(|shader| stage("compose", shader, &[1], &[], None))
}

fn stage(
    pass: &'static str,
    shader: &Shader,
    constants: &[u32],
    given: &[u64],
    texels: Option<u32>,
) -> Stage {
    Stage {
        pass,
        shader: shader.name,
        words: shader.words(),
        constants: constants.to_vec(),
        given: given.to_vec(),
        texels,
    }
}

/// Those up to radiance.
fn scene_stages(plan: &Plan, filter: Filter, shaders: Shaders) -> Vec<Stage> {
    let mut stages = Vec::new();
    let mut add = |pass, shader: &Shader, constants: &[u32], given: &[u64], texels| {
        stages.push(stage(pass, shader, constants, given, texels));
    };
    let frame = plan.light_frame();
    for method in plan.methods() {
        match method {
            Multiple::Rings(_) => add("boxes", &shaders::BOXES_COMP, &[], &[], Some(1)),
            Multiple::Mixture(mixture) => {
                let taps = plan.taps(mixture, &frame);
                let fourth = !taps.fourth.is_empty();
                let texels = reduce::HALVE_OUTPUTS.pow(2);
                if taps.level(taps.moments() - 1) > 0 {
                    add("reduce", reduce::halving(fourth), &[], &[], Some(texels));
                }
                let texels = Some(reduce::SMOOTH_OUTPUTS);
                add("reduce", &shaders::SMOOTH_COMP, &[], &[], texels);
                if fourth {
                    add("reduce", &shaders::SMOOTH_COMP_FOURTH, &[], &[], texels);
                }
                if let Some(volumes) = &taps.volumes {
                    let reach = u64::from(volumes.grids[0].reach());
                    add("volume", &shaders::VOLUME_COMP, &[], &[reach; 2], Some(1));
                }
            }
            _ => {}
        }
    }
    for part in &half_parts(plan, &frame) {
        let shader = match shaders {
            Shaders::Floor => shade::variant(part, filter).floored(),
            _ => *shade::variant(part, filter),
        };
        add(
            ledger::HALF_SHADE,
            &shader,
            // The surface's reflection is the picture's own.
            &shade::constants(part, false),
            &[],
            None,
        );
    }
    let parts = parts(plan, &frame);
    for part in &parts {
        let shader = match shaders {
            Shaders::Stray => shaders::SHADE_FRAG_STRAY,
            Shaders::Floor => shade::variant(part, filter).floored(),
            Shaders::Plain | Shaders::Counting => *shade::variant(part, filter),
        };
        add(
            SHADE_PASS,
            &shader,
            &shade::constants(part, plan.specular),
            &[],
            None,
        );
    }
    let exact = |part: &PartDesc| part.method == Multiple::Exact;
    if parts.iter().any(exact) {
        let side = plan.light_map;
        let rows = (ledger::EXACT_TEXELS / side).max(1);
        for first in (0..side).step_by(rows as usize) {
            let rows = u64::from(rows.min(side - first));
            add(
                "exact",
                &shaders::EXACT_COMP,
                &[],
                &[rows, side.into()],
                None,
            );
        }
    }
    stages
}

impl Renderer {
    /// What the last frame has read, by shader; empty unless the renderer counts.
    ///
    /// # Errors
    /// What the driver says.
    pub fn counts(&self) -> gpu::Result<Vec<Counts>> {
        self.counters
            .as_ref()
            .map_or(Ok(Vec::new()), Counters::read)
    }
}
