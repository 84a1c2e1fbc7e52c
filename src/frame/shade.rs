//! The shade pass: radiance towards the camera, once per visible pixel, as the last
//! subpass of the camera's render pass.
//!
//! Shaders `shade.vert`, `shade.frag`; CPU twin [`crate::cpu::shade`].

use std::sync::Arc;

use ash::vk;

use super::fetches::Build;
use super::shaders;
use super::targets::{Boxes, GBuffer, Light, LightMap};
use crate::gpu::{
    self, Binding, Buffer, DescriptorSets, Device, GraphicsDesc, GraphicsPipeline, Image,
    ImageDesc, RenderPass, Sampler, Shader, Use, submit,
};
use crate::ledger::Filter;
use crate::optics::sampling;
use crate::scene::{Exits, March, Multiple};

/// The pass that shades.
pub struct ShadePass {
    parts: Vec<Part>,
    height: u32,
    // Referred to by the sets.
    _blue_noise: Image,
    _samplers: [Sampler; 4],
}

/// Columns of the picture, and what shades them.
struct Part {
    columns: [u32; 2],
    sets: DescriptorSets,
    pipeline: GraphicsPipeline,
}

/// How a part of the picture is shaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PartDesc {
    /// Its first column, and one past its last.
    pub columns: [u32; 2],
    /// Its method.
    pub method: Multiple,
    /// How many samples, or rings; of the mixture, how many levels read three moments, then four,
    /// then three again, then three and a volume, then a volume alone.
    pub counts: [u32; 5],
    /// The march of single scattering, if there is one.
    pub march: Option<March>,
    /// Whether it is shaded at half size, with its distance in place of coverage.
    pub halved: bool,
    /// Whether all of that is shaded at half size, and this part brings it back to its own.
    pub upsampled: bool,
}

impl ShadePass {
    /// Prepares shading from `map`, `boxes`, `light`, `gbuffer` and what is shaded at `half` size in subpass `subpass` of `pass`. A device
    /// whose `filter` is not linear reads four texels for each bilinear tap.
    #[allow(clippy::too_many_arguments, reason = "the graph's edges, each by name")]
    pub fn new(
        device: &Arc<Device>,
        uniforms: &[Buffer],
        pass: &RenderPass,
        subpass: u32,
        map: &LightMap,
        boxes: Option<&Boxes>,
        light: Option<&Light>,
        gbuffer: &GBuffer,
        half: Option<&Image>,
        parts: &[PartDesc],
        specular: bool,
        filter: Filter,
        build: Build<'_>,
    ) -> gpu::Result<Self> {
        let zero = |name, filter| {
            let border = vk::BorderColor::FLOAT_TRANSPARENT_BLACK;
            Sampler::new(device, name, filter, border, None)
        };
        let nearest = zero("nearest, border 0", vk::Filter::NEAREST)?;
        let bilinear = match filter {
            Filter::Linear => zero("bilinear, border 0", vk::Filter::LINEAR)?,
            Filter::Texels => zero("texels of bilinear taps, border 0", vk::Filter::NEAREST)?,
        };
        let compare = Sampler::new(
            device,
            "shadow, border lit",
            vk::Filter::NEAREST,
            vk::BorderColor::FLOAT_OPAQUE_WHITE,
            Some(vk::CompareOp::LESS_OR_EQUAL),
        )?;
        let none_lit = Sampler::new(
            device,
            "nearest, border 1",
            vk::Filter::NEAREST,
            vk::BorderColor::FLOAT_OPAQUE_WHITE,
            None,
        )?;
        let blue_noise = blue_noise(device)?;
        let parts = parts
            .iter()
            .map(|part| {
                // Level 0 of the rings is a bilinear tap of the map itself.
                let rings = matches!(part.method, Multiple::Rings(_));
                let sampler = if rings { &bilinear } else { &nearest };
                let mut own = Vec::new();
                match part.method {
                    _ if part.upsampled => {
                        own.extend(half.map(|image| Binding::Sampled(image, &nearest)));
                    }
                    Multiple::Samples(_) => own.push(Binding::Sampled(&blue_noise, &nearest)),
                    Multiple::Rings(_) => {
                        own.extend(boxes.map(|b| Binding::Sampled(&b.image, &bilinear)));
                    }
                    Multiple::Mixture(_) => {
                        let pyramid = map.pyramid.as_ref();
                        own.extend(pyramid.map(|p| Binding::Sampled(&p.smoothed, &bilinear)));
                        let fourth = pyramid.and_then(|p| p.fourth.as_ref());
                        own.push(fourth.map_or(Binding::Unused, |f| {
                            Binding::Sampled(&f.smoothed, &bilinear)
                        }));
                        own.extend(light.map(|l| Binding::Sampled(&l.image, &bilinear)));
                    }
                    Multiple::None | Multiple::Brdf | Multiple::Exact => {}
                }
                // A device that cannot filter 32-bit floats reads the nearest exit.
                let exits = match part.march.map(|march| march.exits) {
                    Some(Exits::Depth) => Binding::Sampled(&map.depth, &none_lit),
                    Some(Exits::Linear) if filter == Filter::Linear => {
                        Binding::Sampled(&map.moments, &bilinear)
                    }
                    _ => Binding::Sampled(&map.moments, &nearest),
                };
                let shader = build.shader(match build {
                    Build::Stray(_) => &shaders::SHADE_FRAG_STRAY,
                    Build::Plain | Build::Floor | Build::Counting(_) => variant(part, filter),
                });
                let bindings: Vec<_> = uniforms
                    .iter()
                    .map(|u| {
                        let shared = [
                            Binding::Uniform(u),
                            Binding::Input(&gbuffer.depth),
                            Binding::Input(&gbuffer.normal),
                            Binding::Input(&gbuffer.back),
                            Binding::Sampled(&map.moments, sampler),
                            Binding::Sampled(&map.depth, &compare),
                            Binding::Input(&gbuffer.back_normal),
                            exits,
                        ];
                        build.bindings(
                            &shader,
                            shared.into_iter().chain(own.iter().copied()).collect(),
                        )
                    })
                    .collect();
                let stages = vk::ShaderStageFlags::FRAGMENT;
                let sets = DescriptorSets::new(device, "shade", stages, &bindings)?;
                let constants = constants(part, specular);
                let desc = GraphicsDesc {
                    // The triangle lies at the far plane: it passes where something is nearer.
                    depth: (vk::CompareOp::GREATER, false),
                    subpass,
                    ..GraphicsDesc::flat(&shaders::SHADE_VERT, &shader, &constants)
                };
                Ok(Part {
                    columns: part.columns,
                    pipeline: GraphicsPipeline::new(device, &desc, pass, &sets)?,
                    sets,
                })
            })
            .collect::<gpu::Result<_>>()?;
        Ok(ShadePass {
            parts,
            height: gbuffer.depth.size()[1],
            _blue_noise: blue_noise,
            _samplers: [nearest, bilinear, compare, none_lit],
        })
    }

    /// Whether the picture has two parts.
    pub fn is_divided(&self) -> bool {
        self.parts.len() == 2
    }

    /// Has the right one of two parts begin at `column`, from the next frame that is recorded. A picture of one part
    /// stays as it is.
    pub fn divide(&mut self, column: u32) {
        if let [left, right] = &mut self.parts[..] {
            (left.columns[1], right.columns[0]) = (column, column);
        }
    }

    /// Shades every covered pixel.
    pub fn record(&self, commands: vk::CommandBuffer, slot: usize) {
        // The divider may have left a part without columns.
        let seen = |part: &&Part| part.columns[0] < part.columns[1];
        for part in self.parts.iter().filter(seen) {
            part.pipeline.bind(commands, &part.sets, slot);
            part.pipeline
                .draw_full_screen(commands, part.columns, self.height);
        }
    }
}

/// The values of the specialisation constants of `shade.frag`.
pub fn constants(part: &PartDesc, specular: bool) -> [u32; 8] {
    let [a, b, c, d, e] = part.counts;
    let steps = part.march.map_or(0, |march| march.steps);
    let halved = u32::from(part.halved);
    [u32::from(specular), a, b, c, d, e, steps, halved]
}

/// The shader of a part.
pub fn variant(part: &PartDesc, filter: Filter) -> &'static Shader {
    use shaders as s;
    let exits = part.march.map(|march| march.exits);
    macro_rules! variant {
        ($plain:ident, $single:ident, $depth:ident) => {
            match exits {
                None => &s::$plain,
                Some(Exits::Linear | Exits::Nearest) => &s::$single,
                Some(Exits::Depth) => &s::$depth,
            }
        };
    }
    let fourth = part.counts[1] > 0;
    let volumes = part.counts[3] > 0;
    match (part.method, filter) {
        _ if part.upsampled => &s::SHADE_FRAG_HALF,
        // `exact` adds its term in a compute pass of its own.
        (Multiple::None | Multiple::Exact, _) => variant!(
            SHADE_FRAG_NONE,
            SHADE_FRAG_NONE_SINGLE,
            SHADE_FRAG_NONE_SINGLE_DEPTH
        ),
        (Multiple::Brdf, _) => variant!(
            SHADE_FRAG_BRDF,
            SHADE_FRAG_BRDF_SINGLE,
            SHADE_FRAG_BRDF_SINGLE_DEPTH
        ),
        (Multiple::Samples(_), _) => variant!(
            SHADE_FRAG_SAMPLES,
            SHADE_FRAG_SAMPLES_SINGLE,
            SHADE_FRAG_SAMPLES_SINGLE_DEPTH
        ),
        (Multiple::Rings(_), Filter::Linear) => variant!(
            SHADE_FRAG_RINGS,
            SHADE_FRAG_RINGS_SINGLE,
            SHADE_FRAG_RINGS_SINGLE_DEPTH
        ),
        (Multiple::Rings(_), Filter::Texels) => variant!(
            SHADE_FRAG_RINGS_NEAREST,
            SHADE_FRAG_RINGS_NEAREST_SINGLE,
            SHADE_FRAG_RINGS_NEAREST_SINGLE_DEPTH
        ),
        (Multiple::Mixture(_), Filter::Linear) if volumes && !fourth => variant!(
            SHADE_FRAG_MIXTURE_VOLUMES,
            SHADE_FRAG_MIXTURE_VOLUMES_SINGLE,
            SHADE_FRAG_MIXTURE_VOLUMES_SINGLE_DEPTH
        ),
        (Multiple::Mixture(_), Filter::Linear) if volumes => variant!(
            SHADE_FRAG_MIXTURE_FOURTH_VOLUMES,
            SHADE_FRAG_MIXTURE_FOURTH_VOLUMES_SINGLE,
            SHADE_FRAG_MIXTURE_FOURTH_VOLUMES_SINGLE_DEPTH
        ),
        (Multiple::Mixture(_), Filter::Texels) if volumes && !fourth => variant!(
            SHADE_FRAG_MIXTURE_NEAREST_VOLUMES,
            SHADE_FRAG_MIXTURE_NEAREST_VOLUMES_SINGLE,
            SHADE_FRAG_MIXTURE_NEAREST_VOLUMES_SINGLE_DEPTH
        ),
        (Multiple::Mixture(_), Filter::Texels) if volumes => variant!(
            SHADE_FRAG_MIXTURE_NEAREST_FOURTH_VOLUMES,
            SHADE_FRAG_MIXTURE_NEAREST_FOURTH_VOLUMES_SINGLE,
            SHADE_FRAG_MIXTURE_NEAREST_FOURTH_VOLUMES_SINGLE_DEPTH
        ),
        (Multiple::Mixture(_), Filter::Linear) if !fourth => variant!(
            SHADE_FRAG_MIXTURE,
            SHADE_FRAG_MIXTURE_SINGLE,
            SHADE_FRAG_MIXTURE_SINGLE_DEPTH
        ),
        (Multiple::Mixture(_), Filter::Linear) => variant!(
            SHADE_FRAG_MIXTURE_FOURTH,
            SHADE_FRAG_MIXTURE_FOURTH_SINGLE,
            SHADE_FRAG_MIXTURE_FOURTH_SINGLE_DEPTH
        ),
        (Multiple::Mixture(_), Filter::Texels) if !fourth => variant!(
            SHADE_FRAG_MIXTURE_NEAREST,
            SHADE_FRAG_MIXTURE_NEAREST_SINGLE,
            SHADE_FRAG_MIXTURE_NEAREST_SINGLE_DEPTH
        ),
        (Multiple::Mixture(_), Filter::Texels) => variant!(
            SHADE_FRAG_MIXTURE_NEAREST_FOURTH,
            SHADE_FRAG_MIXTURE_NEAREST_FOURTH_SINGLE,
            SHADE_FRAG_MIXTURE_NEAREST_FOURTH_SINGLE_DEPTH
        ),
    }
}

/// Two channels of blue noise, which shift the sample sequence from pixel to pixel.
fn blue_noise(device: &Arc<Device>) -> gpu::Result<Image> {
    let image = Image::new(
        device,
        "blue noise",
        ImageDesc {
            size: [sampling::NOISE_SIZE as u32; 2],
            format: vk::Format::R32G32_SFLOAT,
            usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST,
        },
    )?;
    submit::upload_image(
        device,
        &image,
        bytemuck::cast_slice(sampling::noise()),
        Use::FRAGMENT_SAMPLE,
    )?;
    Ok(image)
}
