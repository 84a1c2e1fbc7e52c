//! What one fetch costs on a device, by kind and format: the yardstick of the roofline.
//!
//! Shader `probe.frag`. A full screen of so many fetches is timed against the same without them, and the difference is
//! theirs: all cores or units of the device together.

use std::sync::Arc;

use ash::vk;

use super::shaders;
use super::targets::overwriting_pass;
use crate::gpu::{
    self, Binding, DescriptorSets, Device, GraphicsDesc, GraphicsPipeline, Image, ImageDesc,
    RenderPass, Sampler, Shader, Slot, Timestamps, Use, barrier,
};
use crate::ledger::{Access, Filter};

/// Texels and pixels along a side: as many as the shade pass of a common window has.
const SIDE: u32 = 512;
/// Cells along a side of the volume.
const CELLS: u32 = 64;
/// Fetches a pixel: enough that they outweigh the pixel itself.
const READS: u32 = 16;

/// What one kind of fetch has cost.
#[derive(Clone, Debug, PartialEq)]
pub struct FetchCost {
    /// The kind and format.
    pub access: Access,
    /// One for each round, ns.
    pub nanoseconds: Vec<f64>,
}

/// The images and pipelines to time fetches by.
pub struct Probe {
    kinds: Vec<Kind>,
    pass: RenderPass,
    target: Image,
    stamps: Timestamps,
    slot: Slot,
    device: Arc<Device>,
}

struct Kind {
    cost: FetchCost,
    /// Without and with the fetches.
    pipelines: [GraphicsPipeline; 2],
    sets: DescriptorSets,
    // Referred to by the set.
    _image: Image,
    _sampler: Sampler,
}

impl Probe {
    /// Prepares every kind that `filter` lets the frame use.
    ///
    /// # Errors
    /// What the driver says.
    pub fn new(device: &Arc<Device>, filter: Filter) -> gpu::Result<Self> {
        let target = Image::new(
            device,
            "probe target",
            ImageDesc {
                size: [SIDE; 2],
                format: vk::Format::R32G32B32A32_SFLOAT,
                usage: vk::ImageUsageFlags::COLOR_ATTACHMENT,
            },
        )?;
        let pass = overwriting_pass(device, "probe", &[&target])?;
        let kinds = Access::ALL
            .into_iter()
            .filter(|access| filter == Filter::Linear || !access.filters())
            .map(|access| Kind::new(device, &pass, access))
            .collect::<gpu::Result<Vec<_>>>()?;
        Ok(Probe {
            stamps: Timestamps::new(device, "probe", 2 * kinds.len() as u32)?,
            slot: Slot::new(device, "probe")?,
            kinds,
            pass,
            target,
            device: Arc::clone(device),
        })
    }

    /// Times each kind once; with `counts` false only to warm up.
    ///
    /// # Errors
    /// [`gpu::Error::DeviceLost`] among others.
    pub fn round(&mut self, counts: bool) -> gpu::Result<()> {
        let commands = self.slot.begin()?;
        self.stamps.reset(commands);
        let mut before = Use::DISCARD;
        for (pair, (kind, with)) in
            (0..).zip(self.kinds.iter().flat_map(|kind| [(kind, 0), (kind, 1)]))
        {
            barrier::image(
                &self.device,
                commands,
                c"WAW: the probe before draws here",
                &self.target,
                before,
                Use::COLOR_WRITE,
            );
            before = Use::COLOR_WRITE.discarding();
            self.stamps.start(commands, pair);
            self.pass.begin(commands, &[]);
            kind.pipelines[with].bind(commands, &kind.sets, 0);
            kind.pipelines[with].draw_full_screen(commands, [0, SIDE], SIDE);
            self.pass.end(commands);
            self.stamps.end(commands, pair);
        }
        self.slot.submit()?;
        self.slot.wait()?;
        for (pair, kind) in (0..).zip(&mut self.kinds) {
            let [without, with] = [2 * pair, 2 * pair + 1].map(|at| self.stamps.milliseconds(at));
            if let (true, Some(without), Some(with)) = (counts, without, with) {
                let fetches = f64::from(SIDE * SIDE * READS);
                let nanoseconds = 1e6 * (with - without).max(0.0) / fetches;
                kind.cost.nanoseconds.push(nanoseconds);
            }
        }
        Ok(())
    }

    /// What each kind has cost so far.
    pub fn costs(&self) -> Vec<FetchCost> {
        self.kinds.iter().map(|kind| kind.cost.clone()).collect()
    }
}

impl Kind {
    fn new(device: &Arc<Device>, pass: &RenderPass, access: Access) -> gpu::Result<Kind> {
        use vk::ImageUsageFlags as U;
        let (format, shader): (_, &Shader) = match access {
            Access::BilinearRgba | Access::NearestRgba => {
                (vk::Format::R32G32B32A32_SFLOAT, &shaders::PROBE_FRAG)
            }
            Access::BilinearScalar => (vk::Format::R32_SFLOAT, &shaders::PROBE_FRAG),
            Access::NearestDepth => (vk::Format::D32_SFLOAT, &shaders::PROBE_FRAG),
            Access::TexelRgba => (vk::Format::R32G32B32A32_SFLOAT, &shaders::PROBE_FRAG_TEXEL),
            Access::TexelPair => (vk::Format::R32G32_SFLOAT, &shaders::PROBE_FRAG_TEXEL),
            Access::Gather => (vk::Format::D32_SFLOAT, &shaders::PROBE_FRAG_GATHER),
            Access::Trilinear => (vk::Format::R32_SFLOAT, &shaders::PROBE_FRAG_VOLUME),
            Access::StorageRgba => (
                vk::Format::R32G32B32A32_SFLOAT,
                &shaders::PROBE_FRAG_STORAGE,
            ),
            Access::StorageScalar => (vk::Format::R32_SFLOAT, &shaders::PROBE_FRAG_STORAGE_SCALAR),
        };
        let storage = matches!(access, Access::StorageRgba | Access::StorageScalar);
        let depth = format == vk::Format::D32_SFLOAT;
        let desc = ImageDesc {
            size: [if access == Access::Trilinear {
                CELLS
            } else {
                SIDE
            }; 2],
            format,
            usage: match (storage, depth) {
                (true, _) => U::STORAGE | U::TRANSFER_DST,
                (_, true) => U::SAMPLED | U::DEPTH_STENCIL_ATTACHMENT | U::TRANSFER_DST,
                _ => U::SAMPLED | U::TRANSFER_DST,
            },
        };
        let name = format!("probed: {}, {}", access.kind(), access.format());
        let image = match access {
            Access::Trilinear => Image::solid(device, &name, desc, CELLS)?,
            _ => Image::new(device, &name, desc)?,
        };
        let linear = access.filters();
        let sampler = Sampler::new(
            device,
            &name,
            if linear {
                vk::Filter::LINEAR
            } else {
                vk::Filter::NEAREST
            },
            vk::BorderColor::FLOAT_TRANSPARENT_BLACK,
            (access == Access::Gather).then_some(vk::CompareOp::LESS_OR_EQUAL),
        )?;
        let (binding, after) = match (storage, depth) {
            (true, _) => (Binding::Storage(&image), Use::FRAGMENT_STORAGE),
            (_, true) => (
                Binding::Sampled(&image, &sampler),
                Use::FRAGMENT_SAMPLE_DEPTH,
            ),
            _ => (Binding::Sampled(&image, &sampler), Use::FRAGMENT_SAMPLE),
        };
        // What the texels hold does not matter to their reading.
        let mut slot = Slot::new(device, "probe")?;
        let commands = slot.begin()?;
        barrier::image(
            device,
            commands,
            c"layout: a new image is to be read",
            &image,
            Use::DISCARD,
            after,
        );
        slot.submit()?;
        slot.wait()?;
        let stages = vk::ShaderStageFlags::FRAGMENT;
        let sets = DescriptorSets::new(device, "probe", stages, &[vec![binding]])?;
        let pipeline = |reads| {
            let constants = [reads];
            let desc = GraphicsDesc::flat(&shaders::SHADE_VERT, shader, &constants);
            GraphicsPipeline::new(device, &desc, pass, &sets)
        };
        Ok(Kind {
            cost: FetchCost {
                access,
                nanoseconds: Vec::new(),
            },
            pipelines: [pipeline(0)?, pipeline(READS)?],
            sets,
            _image: image,
            _sampler: sampler,
        })
    }
}
