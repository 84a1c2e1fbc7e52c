//! The resolve pass: the running mean over jittered frames, tone mapped and encoded.
//!
//! Shaders `shade.vert`, `resolve.frag`; CPU twin [`crate::cpu::resolve`].

use std::sync::Arc;

use ash::vk;

use super::shaders;
use super::targets::Canvas;
use crate::gpu::{
    self, Binding, Buffer, DescriptorSets, Device, GraphicsDesc, GraphicsPipeline, RenderPass,
    Sampler,
};

/// The pass that accumulates and encodes.
///
/// It draws the whole screen: on llvmpipe in two thirds of the time of a compute shader that does the same.
pub struct ResolvePass {
    /// By which of the means is written, and whether for display, too.
    targets: [[RenderPass; 2]; 2],
    /// By which of the means is written; of each a set a frame slot.
    sets: [DescriptorSets; 2],
    /// Without and with the encoding for display.
    pipelines: [GraphicsPipeline; 2],
    size: [u32; 2],
    // Referred to by the sets.
    _sampler: Sampler,
}

impl ResolvePass {
    /// Prepares the pass over `canvas`.
    pub fn new(device: &Arc<Device>, uniforms: &[Buffer], canvas: &Canvas) -> gpu::Result<Self> {
        let border = vk::BorderColor::FLOAT_TRANSPARENT_BLACK;
        let sampler = Sampler::new(device, "nearest", vk::Filter::NEAREST, border, None)?;
        let [first, second] = &canvas.means;
        let of = |old: &gpu::Image| {
            let bindings: Vec<_> = uniforms
                .iter()
                .map(|u| {
                    vec![
                        Binding::Uniform(u),
                        Binding::Sampled(&canvas.radiance, &sampler),
                        Binding::Sampled(old, &sampler),
                    ]
                })
                .collect();
            let stages = vk::ShaderStageFlags::FRAGMENT;
            DescriptorSets::new(device, "resolve", stages, &bindings)
        };
        let sets = [of(second)?, of(first)?];
        let onto = |mean| {
            let accumulate = render_pass(device, "accumulate", &[mean])?;
            let encode = render_pass(device, "accumulate and encode", &[mean, &canvas.display])?;
            Ok::<_, gpu::Error>([accumulate, encode])
        };
        let targets = [onto(first)?, onto(second)?];
        let pipeline = |encode: bool| {
            let fragment = match encode {
                false => &shaders::RESOLVE_FRAG,
                true => &shaders::RESOLVE_FRAG_ENCODE,
            };
            let desc = GraphicsDesc {
                vertex: &shaders::SHADE_VERT,
                fragment: Some(fragment),
                vertices: None,
                cull: vk::CullModeFlags::NONE,
                front: vk::FrontFace::COUNTER_CLOCKWISE,
                depth: (vk::CompareOp::ALWAYS, false),
                colors: 1 + usize::from(encode),
                subpass: 0,
                constants: &[],
            };
            // Passes onto either mean are compatible.
            GraphicsPipeline::new(device, &desc, &targets[0][usize::from(encode)], &sets[0])
        };
        let pipelines = [pipeline(false)?, pipeline(true)?];
        Ok(ResolvePass {
            targets,
            sets,
            pipelines,
            size: canvas.display.size(),
            _sampler: sampler,
        })
    }

    /// Writes mean `mean`, the other one and the frame taken together, and with `encode` the display image.
    pub fn record(&self, commands: vk::CommandBuffer, slot: usize, mean: usize, encode: bool) {
        let pass = &self.targets[mean][usize::from(encode)];
        let pipeline = &self.pipelines[usize::from(encode)];
        pass.begin(commands, &[]);
        pipeline.bind(commands, &self.sets[mean], slot);
        pipeline.draw_full_screen(commands, [0, self.size[0]], self.size[1]);
        pass.end(commands);
    }
}

/// A pass that writes every pixel of `images`, whatever they held.
fn render_pass(
    device: &Arc<Device>,
    name: &str,
    images: &[&gpu::Image],
) -> gpu::Result<RenderPass> {
    let layout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
    let attachments: Vec<_> = images
        .iter()
        .map(|image| {
            vk::AttachmentDescription::default()
                .format(image.format())
                .samples(vk::SampleCountFlags::TYPE_1)
                .load_op(vk::AttachmentLoadOp::DONT_CARE)
                .store_op(vk::AttachmentStoreOp::STORE)
                .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
                .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
                // The same before and after: transitions are barriers on the frame's page.
                .initial_layout(layout)
                .final_layout(layout)
        })
        .collect();
    let colors: Vec<_> = (0..images.len() as u32)
        .map(|attachment| vk::AttachmentReference { attachment, layout })
        .collect();
    let subpasses = [vk::SubpassDescription::default()
        .pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS)
        .color_attachments(&colors)];
    let info = vk::RenderPassCreateInfo::default()
        .attachments(&attachments)
        .subpasses(&subpasses);
    RenderPass::new(device, name, &info, images)
}
