//! The shade pass: radiance towards the camera, once per visible pixel, as the last
//! subpass of the camera's render pass.
//!
//! Shaders `shade.vert`, `shade.frag`; CPU twin [`crate::cpu::shade`].

use std::sync::Arc;

use ash::vk;

use super::shaders;
use super::targets::{GBuffer, LightMap};
use crate::gpu::{
    self, Binding, Buffer, DescriptorSets, Device, GraphicsDesc, GraphicsPipeline, Image,
    ImageDesc, RenderPass, Sampler, Shader, Use, submit,
};
use crate::optics::sampling;
use crate::scene::Multiple;

/// Side of the blue-noise tile, in texels: large enough that its repetition does not show.
const BLUE_NOISE_SIZE: u32 = 64;

/// The pass that shades.
pub struct ShadePass {
    sets: DescriptorSets,
    /// Columns of the picture and the pipeline that shades them.
    parts: Vec<([u32; 2], GraphicsPipeline)>,
    height: u32,
    // Referred to by the sets.
    _blue_noise: Image,
    _samplers: [Sampler; 2],
}

impl ShadePass {
    /// Prepares shading from `map` and `gbuffer` in subpass `subpass` of `pass`: each of
    /// `parts` is a range of columns and its method.
    #[allow(clippy::too_many_arguments, reason = "the graph's edges, each by name")]
    pub fn new(
        device: &Arc<Device>,
        uniforms: &[Buffer],
        pass: &RenderPass,
        subpass: u32,
        map: &LightMap,
        gbuffer: &GBuffer,
        parts: &[([u32; 2], Multiple)],
        specular: bool,
    ) -> gpu::Result<Self> {
        let nearest = Sampler::new(
            device,
            "nearest, border 0",
            vk::Filter::NEAREST,
            vk::BorderColor::FLOAT_TRANSPARENT_BLACK,
            None,
        )?;
        let compare = Sampler::new(
            device,
            "shadow, border lit",
            vk::Filter::NEAREST,
            vk::BorderColor::FLOAT_OPAQUE_WHITE,
            Some(vk::CompareOp::LESS_OR_EQUAL),
        )?;
        let blue_noise = blue_noise(device)?;
        let bindings: Vec<_> = uniforms
            .iter()
            .map(|u| {
                vec![
                    Binding::Uniform(u),
                    Binding::Input(&gbuffer.depth),
                    Binding::Input(&gbuffer.normal),
                    Binding::Input(&gbuffer.back),
                    Binding::Sampled(&map.moments, &nearest),
                    Binding::Sampled(&map.depth, &compare),
                    Binding::Sampled(&blue_noise, &nearest),
                ]
            })
            .collect();
        let sets = DescriptorSets::new(device, "shade", vk::ShaderStageFlags::FRAGMENT, &bindings)?;
        let parts = parts
            .iter()
            .map(|&(columns, method)| {
                let (shader, samples) = variant(method);
                let desc = GraphicsDesc {
                    vertex: &shaders::SHADE_VERT,
                    fragment: Some(shader),
                    vertices: None,
                    cull: vk::CullModeFlags::NONE,
                    front: vk::FrontFace::COUNTER_CLOCKWISE,
                    // The triangle lies at the far plane: it passes where something is nearer.
                    depth: (vk::CompareOp::GREATER, false),
                    colors: 1,
                    subpass,
                    constants: &[u32::from(specular), samples],
                };
                Ok((columns, GraphicsPipeline::new(device, &desc, pass, &sets)?))
            })
            .collect::<gpu::Result<_>>()?;
        Ok(ShadePass {
            sets,
            parts,
            height: gbuffer.depth.size()[1],
            _blue_noise: blue_noise,
            _samplers: [nearest, compare],
        })
    }

    /// Shades every covered pixel.
    pub fn record(&self, commands: vk::CommandBuffer, slot: usize) {
        for (columns, pipeline) in &self.parts {
            pipeline.bind(commands, &self.sets, slot);
            pipeline.draw_full_screen(commands, *columns, self.height);
        }
    }
}

/// The shader of a method, and its number of samples.
fn variant(method: Multiple) -> (&'static Shader, u32) {
    match method {
        // `exact` adds its term in a compute pass of its own.
        Multiple::None | Multiple::Exact => (&shaders::SHADE_FRAG_NONE, 0),
        Multiple::Brdf => (&shaders::SHADE_FRAG_BRDF, 0),
        Multiple::Samples(n) => (&shaders::SHADE_FRAG_SAMPLES, n),
    }
}

/// Two channels of blue noise, which shift the sample sequence from pixel to pixel.
fn blue_noise(device: &Arc<Device>) -> gpu::Result<Image> {
    let [x, y] = [1, 2].map(|seed| sampling::blue_noise(BLUE_NOISE_SIZE as usize, seed));
    let texels: Vec<[f32; 2]> = x.into_iter().zip(y).map(|(x, y)| [x, y]).collect();
    let image = Image::new(
        device,
        "blue noise",
        ImageDesc {
            size: [BLUE_NOISE_SIZE; 2],
            format: vk::Format::R32G32_SFLOAT,
            usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST,
        },
    )?;
    submit::upload_image(
        device,
        &image,
        bytemuck::cast_slice(&texels),
        Use::FRAGMENT_SAMPLE,
    )?;
    Ok(image)
}
