//! The light pass: depth and depth moments of what the light sees.
//!
//! Shaders `light.vert`, `light.frag`; CPU twin [`crate::cpu::light`].

use std::sync::Arc;

use ash::vk;

use super::geometry::{Geometry, VERTEX_OFFSETS, VERTEX_STRIDE};
use super::shaders;
use super::targets::LightMap;
use crate::gpu::{
    self, Binding, Buffer, DescriptorSets, Device, GraphicsDesc, GraphicsPipeline, RenderPass,
};

/// The pass that draws the light map.
pub struct LightPass {
    colors: usize,
    pass: RenderPass,
    sets: DescriptorSets,
    pipeline: GraphicsPipeline,
}

impl LightPass {
    /// Prepares drawing into `map` with one uniform buffer a frame slot; of a `solid` front faces alone.
    pub fn new(
        device: &Arc<Device>,
        uniforms: &[Buffer],
        map: &LightMap,
        solid: bool,
    ) -> gpu::Result<Self> {
        let attachment = |image: &gpu::Image, layout| {
            vk::AttachmentDescription::default()
                .format(image.format())
                .samples(vk::SampleCountFlags::TYPE_1)
                .load_op(vk::AttachmentLoadOp::CLEAR)
                .store_op(vk::AttachmentStoreOp::STORE)
                .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
                .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
                // The same before and after: transitions are barriers on the frame's page.
                .initial_layout(layout)
                .final_layout(layout)
        };
        let color_layout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
        let depth_layout = vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
        let fourth = map.pyramid.as_ref().and_then(|p| p.fourth.as_ref());
        let colors: Vec<_> = std::iter::once(&map.moments)
            .chain(fourth.map(|f| &f.moments))
            .collect();
        let mut attachments = vec![attachment(&map.depth, depth_layout)];
        attachments.extend(colors.iter().map(|image| attachment(image, color_layout)));
        let depth = vk::AttachmentReference {
            attachment: 0,
            layout: depth_layout,
        };
        let color: Vec<_> = (1..=colors.len() as u32)
            .map(|attachment| vk::AttachmentReference {
                attachment,
                layout: color_layout,
            })
            .collect();
        let subpasses = [vk::SubpassDescription::default()
            .pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS)
            .color_attachments(&color)
            .depth_stencil_attachment(&depth)];
        let info = vk::RenderPassCreateInfo::default()
            .attachments(&attachments)
            .subpasses(&subpasses);
        let mut images = vec![&map.depth];
        images.extend(&colors);
        let pass = RenderPass::new(device, "light", &info, &images)?;

        let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
        let bindings: Vec<_> = uniforms.iter().map(|u| vec![Binding::Uniform(u)]).collect();
        let sets = DescriptorSets::new(device, "light", stages, &bindings)?;
        let pipeline = GraphicsPipeline::new(
            device,
            &GraphicsDesc {
                vertex: &shaders::LIGHT_VERT,
                fragment: Some(match fourth {
                    None => &shaders::LIGHT_FRAG,
                    Some(_) => &shaders::LIGHT_FRAG_FOURTH,
                }),
                vertices: &[(VERTEX_STRIDE, &VERTEX_OFFSETS)],
                // An open sheet is lit from both sides.
                cull: match solid {
                    true => vk::CullModeFlags::BACK,
                    false => vk::CullModeFlags::NONE,
                },
                // Rows of the map grow with v, which mirrors the picture and turns the winding.
                front: vk::FrontFace::CLOCKWISE,
                depth: (vk::CompareOp::LESS, true),
                colors: colors.len(),
                subpass: 0,
                constants: &[],
                blends: false,
            },
            &pass,
            &sets,
        )?;
        Ok(LightPass {
            colors: colors.len(),
            pass,
            sets,
            pipeline,
        })
    }

    /// Draws the map, whose images are in their attachment layouts.
    pub fn record(&self, commands: vk::CommandBuffer, slot: usize, geometry: &Geometry) {
        let mut clear = vec![vk::ClearValue {
            depth_stencil: vk::ClearDepthStencilValue {
                depth: 1.0,
                stencil: 0,
            },
        }];
        clear.resize(1 + self.colors, vk::ClearValue::default());
        self.pass.begin(commands, &clear);
        self.pipeline.bind(commands, &self.sets, slot);
        geometry.draw(commands);
        self.pass.end(commands);
    }
}
