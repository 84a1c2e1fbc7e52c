//! The panel's triangles, and the textures that they show.
//!
//! Shaders `panel.vert`, `panel.frag`; CPU twin [`crate::cpu::compose`]. Who lays the panel out is of no matter here.

use std::collections::HashMap;
use std::sync::Arc;

use ash::vk;

use super::shaders;
use crate::gpu::{
    self, Binding, Buffer, DescriptorSets, Device, GraphicsDesc, GraphicsPipeline, Image,
    ImageDesc, Location, RenderPass, Sampler,
};

/// A corner of a triangle.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Vertex {
    /// From the window's upper left corner, points.
    pub position: [f32; 2],
    /// Place in the texture, in [0, 1].
    pub place: [f32; 2],
    /// RGBA, encoded as sRGB and premultiplied.
    pub color: [u8; 4],
}

/// Triangles with one texture.
#[derive(Clone, Debug, Default)]
pub struct Triangles {
    /// Columns and rows of the window that they are seen in: x, y, width, height, pixels.
    pub clip: [u32; 4],
    /// The texture.
    pub texture: u64,
    /// Corners.
    pub vertices: Vec<Vertex>,
    /// Three corners for each triangle.
    pub indices: Vec<u32>,
}

/// A texture, or a part of one, that is new.
#[derive(Clone, Debug)]
pub struct Texels {
    /// The texture.
    pub texture: u64,
    /// Where it goes in a texture that exists; none makes it anew.
    pub origin: Option<[u32; 2]>,
    /// Columns and rows.
    pub size: [u32; 2],
    /// RGBA, encoded as sRGB and premultiplied, row-major.
    pub texels: Vec<[u8; 4]>,
    /// Whether it is read between texels.
    pub smooth: bool,
}

/// What a frame draws of a panel.
#[derive(Clone, Debug, Default)]
pub struct Panel {
    /// Pixels per point.
    pub scale: f32,
    /// What is new, in turn.
    pub new: Vec<Texels>,
    /// What is drawn, in turn.
    pub triangles: Vec<Triangles>,
    /// Textures that no later frame shows.
    pub gone: Vec<u64>,
}

/// The pass that draws panels.
pub struct PanelPass {
    pipeline: GraphicsPipeline,
    // Like those of every texture: pipelines are made for it.
    sets: DescriptorSets,
    _any: Image,
    // Of each frame slot.
    buffers: Vec<Buffers>,
    textures: HashMap<u64, Texture>,
    // What frames in flight may still read, and in how many frames it may go.
    leaving: Vec<(usize, Leaving)>,
    samplers: [Sampler; 2],
    device: Arc<Device>,
}

struct Buffers {
    vertices: Buffer,
    indices: Buffer,
    // What copies to textures read.
    staging: Option<Buffer>,
}

struct Texture {
    image: Image,
    smooth: bool,
    // A set a frame slot.
    sets: DescriptorSets,
}

/// A copy of texels to a texture.
pub struct Copy<'a> {
    /// The texture.
    pub texture: &'a Image,
    /// Whether it holds something already, which may be drawn.
    pub holds: bool,
    /// Where the texels are, and the first of them.
    pub from: (&'a Buffer, u64),
    /// Where they go: corner and size.
    pub place: ([u32; 3], [u32; 3]),
}

/// Kept for its drop alone.
enum Leaving {
    Texture(#[allow(dead_code, reason = "held until no frame reads it")] Texture),
    Sets(#[allow(dead_code, reason = "held until no frame reads them")] DescriptorSets),
}

/// Vertices that a buffer has room for at first: a panel of some dozen widgets.
const FIRST_VERTICES: usize = 1 << 15;

/// Words before the first vertex.
const HEADER: usize = 2;

impl PanelPass {
    /// Prepares to draw in passes such as `pass`, whose format encodes sRGB by itself if it `encodes`.
    pub fn new(
        device: &Arc<Device>,
        pass: &RenderPass,
        slots: usize,
        encodes: bool,
    ) -> gpu::Result<Self> {
        let border = vk::BorderColor::FLOAT_TRANSPARENT_BLACK;
        let sampler = |name, filter| Sampler::new(device, name, filter, border, None);
        let samplers = [
            sampler("panel, texel by texel", vk::Filter::NEAREST)?,
            sampler("panel, between texels", vk::Filter::LINEAR)?,
        ];
        let buffers = (0..slots)
            .map(|slot| Buffers::new(device, slot, [FIRST_VERTICES, 2 * FIRST_VERTICES]))
            .collect::<gpu::Result<Vec<_>>>()?;
        let any = texture(device, "panel, none", [1, 1])?;
        let sets = sets(device, &buffers, &any, &samplers[0])?;
        Ok(PanelPass {
            pipeline: pipeline(device, pass, &sets, encodes)?,
            sets,
            _any: any,
            buffers,
            textures: HashMap::new(),
            leaving: Vec::new(),
            samplers,
            device: Arc::clone(device),
        })
    }

    /// Draws in passes such as `pass` from now on. The device must be done with all frames.
    pub fn retarget(&mut self, pass: &RenderPass, encodes: bool) -> gpu::Result<()> {
        self.pipeline = pipeline(&self.device, pass, &self.sets, encodes)?;
        Ok(())
    }

    /// Takes over what the frame of `slot`, with which the device is done, draws in a window of `size` pixels.
    ///
    /// # Errors
    /// [`gpu::Error::OutOfMemory`] among others.
    pub fn write(&mut self, slot: usize, panel: &Panel, size: [u32; 2]) -> gpu::Result<()> {
        // What left as long ago as there are slots is read by none.
        self.leaving.retain_mut(|(frames, _)| {
            *frames = frames.saturating_sub(1);
            *frames > 0
        });
        let sum = |count: fn(&Triangles) -> usize| panel.triangles.iter().map(count).sum::<usize>();
        let counts = [sum(|t| t.vertices.len()), sum(|t| t.indices.len())];
        if !self.buffers[slot].hold(counts) {
            self.buffers[slot] = Buffers::new(&self.device, slot, counts.map(|n| 2 * n))?;
            // All sets refer to the buffers of all slots.
            for texture in self.textures.values_mut() {
                let new = sets(
                    &self.device,
                    &self.buffers,
                    &texture.image,
                    &self.samplers[usize::from(texture.smooth)],
                )?;
                let old = std::mem::replace(&mut texture.sets, new);
                self.leaving
                    .push((self.buffers.len() + 1, Leaving::Sets(old)));
            }
        }

        let points = size.map(|side| 2.0 * panel.scale / side.max(1) as f32);
        let mut words: Vec<u32> = points.map(f32::to_bits).to_vec();
        let mut indices = Vec::with_capacity(counts[1]);
        for triangles in &panel.triangles {
            let first = ((words.len() - HEADER) / 5) as u32;
            words.extend_from_slice(bytemuck::cast_slice(&triangles.vertices));
            indices.extend(triangles.indices.iter().map(|index| first + index));
        }
        let buffers = &mut self.buffers[slot];
        buffers.vertices.write(bytemuck::cast_slice(&words))?;
        buffers.indices.write(bytemuck::cast_slice(&indices))?;

        // Textures that are new, and the texels of all that is.
        for new in panel.new.iter().filter(|new| new.origin.is_none()) {
            let image = texture(&self.device, &format!("panel {}", new.texture), new.size)?;
            let sampler = &self.samplers[usize::from(new.smooth)];
            let sets = sets(&self.device, &self.buffers, &image, sampler)?;
            let made = Texture {
                image,
                smooth: new.smooth,
                sets,
            };
            if let Some(old) = self.textures.insert(new.texture, made) {
                self.leaving
                    .push((self.buffers.len() + 1, Leaving::Texture(old)));
            }
        }
        let texels = panel.new.iter().flat_map(|new| &new.texels);
        let staged: Vec<[u8; 4]> = texels.copied().collect();
        self.buffers[slot].staging = match staged.is_empty() {
            true => None,
            false => {
                let mut staging = Buffer::new(
                    &self.device,
                    "panel staging",
                    4 * staged.len() as u64,
                    vk::BufferUsageFlags::TRANSFER_SRC,
                    Location::Upload,
                )?;
                staging.write(bytemuck::cast_slice(&staged))?;
                Some(staging)
            }
        };
        Ok(())
    }

    /// The copies that bring what is new of `panel` to its textures, in turn: the texture, whether it holds something
    /// already, the buffer with the first of the texels, and the place they go to (corner and size).
    pub fn copies<'a>(
        &'a self,
        slot: usize,
        panel: &'a Panel,
    ) -> impl Iterator<Item = Copy<'a>> + 'a {
        let staging = self.buffers[slot].staging.as_ref();
        let mut next = 0;
        panel.new.iter().filter_map(move |new| {
            let first = next;
            next += u64::from(new.size[0]) * u64::from(new.size[1]);
            let [x, y] = new.origin.unwrap_or_default();
            let [width, height] = new.size;
            Some(Copy {
                texture: &self.textures.get(&new.texture)?.image,
                holds: new.origin.is_some(),
                from: (staging?, first),
                place: ([x, y, 0], [width, height, 1]),
            })
        })
    }

    /// Draws the panel; inside the render pass, whose scissor it leaves anywhere.
    pub fn record(&self, commands: vk::CommandBuffer, slot: usize, panel: &Panel) {
        let mut first = 0;
        for triangles in &panel.triangles {
            let last = first + triangles.indices.len() as u32;
            let [_, _, width, height] = triangles.clip;
            if let Some(texture) = self.textures.get(&triangles.texture)
                && width > 0
                && height > 0
            {
                self.pipeline.bind(commands, &texture.sets, slot);
                self.pipeline
                    .draw_clipped(commands, first..last, triangles.clip);
            }
            first = last;
        }
    }

    /// Lets go of what no later frame shows, once the frame that was recorded is done.
    pub fn forget(&mut self, panel: &Panel) {
        for gone in &panel.gone {
            if let Some(texture) = self.textures.remove(gone) {
                self.leaving
                    .push((self.buffers.len() + 1, Leaving::Texture(texture)));
            }
        }
    }
}

impl Buffers {
    fn new(
        device: &Arc<Device>,
        slot: usize,
        [vertices, indices]: [usize; 2],
    ) -> gpu::Result<Self> {
        let buffer = |name: &str, words: usize| {
            let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
            let name = format!("panel {name} {slot}");
            Buffer::new(
                device,
                &name,
                4 * words.max(1) as u64,
                usage,
                Location::Upload,
            )
        };
        Ok(Buffers {
            vertices: buffer("vertices", HEADER + 5 * vertices)?,
            indices: buffer("indices", indices)?,
            staging: None,
        })
    }

    /// Whether there is room for so many vertices and indices.
    fn hold(&self, [vertices, indices]: [usize; 2]) -> bool {
        4 * (HEADER + 5 * vertices) as u64 <= self.vertices.size()
            && 4 * indices as u64 <= self.indices.size()
    }
}

fn pipeline(
    device: &Arc<Device>,
    pass: &RenderPass,
    sets: &DescriptorSets,
    encodes: bool,
) -> gpu::Result<GraphicsPipeline> {
    let constants = [u32::from(encodes)];
    let desc = GraphicsDesc {
        blends: true,
        ..GraphicsDesc::flat(&shaders::PANEL_VERT, &shaders::PANEL_FRAG, &constants)
    };
    GraphicsPipeline::new(device, &desc, pass, sets)
}

fn texture(device: &Arc<Device>, name: &str, size: [u32; 2]) -> gpu::Result<Image> {
    let desc = ImageDesc {
        size,
        // Bytes as they are: what they encode is the shader's to know.
        format: vk::Format::R8G8B8A8_UNORM,
        usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST,
    };
    Image::new(device, name, desc)
}

fn sets(
    device: &Arc<Device>,
    buffers: &[Buffers],
    image: &Image,
    sampler: &Sampler,
) -> gpu::Result<DescriptorSets> {
    let bindings: Vec<_> = buffers
        .iter()
        .map(|of| {
            vec![
                Binding::StorageBuffer(&of.vertices),
                Binding::StorageBuffer(&of.indices),
                Binding::Sampled(image, sampler),
            ]
        })
        .collect();
    let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
    DescriptorSets::new(device, "panel", stages, &bindings)
}
