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
    pass: RenderPass,
    sets: DescriptorSets,
    pipeline: GraphicsPipeline,
}

impl LightPass {
    /// Prepares drawing into `map` with one uniform buffer a frame slot.
    pub fn new(device: &Arc<Device>, uniforms: &[Buffer], map: &LightMap) -> gpu::Result<Self> {
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
        let attachments = [
            attachment(&map.moments, color_layout),
            attachment(&map.depth, depth_layout),
        ];
        let color = [vk::AttachmentReference {
            attachment: 0,
            layout: color_layout,
        }];
        let depth = vk::AttachmentReference {
            attachment: 1,
            layout: depth_layout,
        };
        let subpasses = [vk::SubpassDescription::default()
            .pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS)
            .color_attachments(&color)
            .depth_stencil_attachment(&depth)];
        let info = vk::RenderPassCreateInfo::default()
            .attachments(&attachments)
            .subpasses(&subpasses);
        let pass = RenderPass::new(device, "light", &info, &[&map.moments, &map.depth])?;

        let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
        let bindings: Vec<_> = uniforms.iter().map(|u| vec![Binding::Uniform(u)]).collect();
        let sets = DescriptorSets::new(device, "light", stages, &bindings)?;
        let pipeline = GraphicsPipeline::new(
            device,
            &GraphicsDesc {
                vertex: &shaders::LIGHT_VERT,
                fragment: Some(&shaders::LIGHT_FRAG),
                vertices: Some((VERTEX_STRIDE, &VERTEX_OFFSETS)),
                cull: vk::CullModeFlags::NONE,
                // Rows of the map grow with v, which mirrors the picture and turns the winding.
                front: vk::FrontFace::CLOCKWISE,
                depth: (vk::CompareOp::LESS, true),
                colors: 1,
                subpass: 0,
                constants: &[],
            },
            &pass,
            &sets,
        )?;
        Ok(LightPass {
            pass,
            sets,
            pipeline,
        })
    }

    /// Draws the map, whose images are in their attachment layouts.
    pub fn record(&self, commands: vk::CommandBuffer, slot: usize, geometry: &Geometry) {
        let clear = [
            vk::ClearValue {
                color: vk::ClearColorValue { float32: [0.0; 4] },
            },
            vk::ClearValue {
                depth_stencil: vk::ClearDepthStencilValue {
                    depth: 1.0,
                    stencil: 0,
                },
            },
        ];
        self.pass.begin(commands, &clear);
        self.pipeline.bind(commands, &self.sets, slot);
        geometry.draw(commands);
        self.pass.end(commands);
    }
}
