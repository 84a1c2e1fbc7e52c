//! The view pass: the G-buffer, as the first two subpasses of the render pass that shades.
//!
//! Shaders `view.vert`, `view.frag`; CPU twin [`crate::cpu::view`]. For live display the second subpass also writes
//! motion.

use std::sync::Arc;

use ash::vk;

use super::geometry::{Geometry, POSITION_OFFSETS, VERTEX_OFFSETS, VERTEX_STRIDE};
use super::shaders;
use super::targets::GBuffer;
use crate::gpu::{
    self, Binding, Buffer, DescriptorSets, Device, GraphicsDesc, GraphicsPipeline, Image,
    RenderPass, barrier,
};

/// Subpass that draws depth and normal of the nearest back faces.
const BACK: u32 = 0;
/// Subpass that draws depth and normal.
const VIEW: u32 = 1;
/// The attachment of motion, where there is one.
const MOTION: u32 = 5;
/// Subpass that shades.
pub const SHADE: u32 = 2;

/// The render pass of the camera: back faces, G-buffer and shading, one subpass each, so
/// that the G-buffer need never leave the tile. With an image for `motion`, depth and motion are kept for what joins
/// frames.
pub fn render_pass(
    device: &Arc<Device>,
    gbuffer: &GBuffer,
    radiance: &Image,
    motion: Option<&Image>,
    keep_gbuffer: bool,
) -> gpu::Result<RenderPass> {
    const ATTACH_DEPTH: vk::ImageLayout = vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
    const READ_DEPTH: vk::ImageLayout = vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL;
    const ATTACH_COLOR: vk::ImageLayout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
    const READ_COLOR: vk::ImageLayout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;

    let store_gbuffer = if keep_gbuffer {
        vk::AttachmentStoreOp::STORE
    } else {
        vk::AttachmentStoreOp::DONT_CARE
    };
    let store_depth = match motion {
        Some(_) => vk::AttachmentStoreOp::STORE,
        None => store_gbuffer,
    };
    let attachment = |image: &gpu::Image, store, before, after| {
        vk::AttachmentDescription::default()
            .format(image.format())
            .samples(vk::SampleCountFlags::TYPE_1)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(store)
            .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
            .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
            .initial_layout(before)
            .final_layout(after)
    };
    let mut attachments = vec![
        attachment(&gbuffer.back, store_gbuffer, ATTACH_DEPTH, READ_DEPTH),
        attachment(
            &gbuffer.back_normal,
            store_gbuffer,
            ATTACH_COLOR,
            READ_COLOR,
        ),
        attachment(&gbuffer.depth, store_depth, ATTACH_DEPTH, READ_DEPTH),
        attachment(&gbuffer.normal, store_gbuffer, ATTACH_COLOR, READ_COLOR),
        attachment(
            radiance,
            vk::AttachmentStoreOp::STORE,
            ATTACH_COLOR,
            ATTACH_COLOR,
        ),
    ];
    attachments.extend(motion.map(|motion| {
        attachment(
            motion,
            vk::AttachmentStoreOp::STORE,
            ATTACH_COLOR,
            ATTACH_COLOR,
        )
    }));
    let refer = |attachment, layout| vk::AttachmentReference { attachment, layout };
    let back = refer(0, ATTACH_DEPTH);
    let back_normal = [refer(1, ATTACH_COLOR)];
    let depth = refer(2, ATTACH_DEPTH);
    let depth_again = refer(2, READ_DEPTH);
    let normal_and_motion = [refer(3, ATTACH_COLOR), refer(MOTION, ATTACH_COLOR)];
    let (normal, kept): (_, &[u32]) = match motion {
        Some(_) => (&normal_and_motion[..], &[MOTION]),
        None => (&normal_and_motion[..1], &[]),
    };
    let shaded = [refer(4, ATTACH_COLOR)];
    // In the order of shade.frag's input_attachment_index.
    let inputs = [
        refer(2, READ_DEPTH),
        refer(3, READ_COLOR),
        refer(0, READ_DEPTH),
        refer(1, READ_COLOR),
    ];
    let graphics =
        vk::SubpassDescription::default().pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS);
    let subpasses = [
        graphics
            .color_attachments(&back_normal)
            .depth_stencil_attachment(&back),
        graphics
            .color_attachments(normal)
            .depth_stencil_attachment(&depth)
            .preserve_attachments(&[0, 1]),
        graphics
            .color_attachments(&shaded)
            .depth_stencil_attachment(&depth_again)
            .input_attachments(&inputs)
            .preserve_attachments(kept),
    ];

    use vk::{AccessFlags as A, PipelineStageFlags as S};
    let tests = S::EARLY_FRAGMENT_TESTS | S::LATE_FRAGMENT_TESTS;
    let dependencies = [
        // RAW: single scattering reads the back faces' depth and normal at its own pixel.
        vk::SubpassDependency::default()
            .src_subpass(BACK)
            .dst_subpass(SHADE)
            .src_stage_mask(tests | S::COLOR_ATTACHMENT_OUTPUT)
            .src_access_mask(A::DEPTH_STENCIL_ATTACHMENT_WRITE | A::COLOR_ATTACHMENT_WRITE)
            .dst_stage_mask(S::FRAGMENT_SHADER)
            .dst_access_mask(A::INPUT_ATTACHMENT_READ)
            .dependency_flags(vk::DependencyFlags::BY_REGION),
        // RAW: shading reads depth and normal at its own pixel, and tests the depth.
        vk::SubpassDependency::default()
            .src_subpass(VIEW)
            .dst_subpass(SHADE)
            .src_stage_mask(tests | S::COLOR_ATTACHMENT_OUTPUT)
            .src_access_mask(A::DEPTH_STENCIL_ATTACHMENT_WRITE | A::COLOR_ATTACHMENT_WRITE)
            .dst_stage_mask(tests | S::FRAGMENT_SHADER)
            .dst_access_mask(A::DEPTH_STENCIL_ATTACHMENT_READ | A::INPUT_ATTACHMENT_READ)
            .dependency_flags(vk::DependencyFlags::BY_REGION),
    ];
    // For measuring only.
    let drains = [BACK, VIEW, SHADE].map(barrier::drain_dependency);
    let dependencies = [&dependencies[..], &drains[..]].concat();
    let info = vk::RenderPassCreateInfo::default()
        .attachments(&attachments)
        .subpasses(&subpasses)
        .dependencies(&dependencies);
    let mut images = vec![
        &gbuffer.back,
        &gbuffer.back_normal,
        &gbuffer.depth,
        &gbuffer.normal,
        radiance,
    ];
    images.extend(motion);
    RenderPass::new(device, "view and shade", &info, &images)
}

/// What the attachments are cleared to, in their order: no surface, no radiance, and no motion, which is for a pass that
/// has it.
pub fn clear_values() -> [vk::ClearValue; 6] {
    let far = vk::ClearValue {
        depth_stencil: vk::ClearDepthStencilValue {
            depth: 1.0,
            stencil: 0,
        },
    };
    let zero = vk::ClearValue {
        color: vk::ClearColorValue { float32: [0.0; 4] },
    };
    [far, zero, far, zero, zero, zero]
}

/// The draws of the first two subpasses.
pub struct ViewPass {
    sets: DescriptorSets,
    back: GraphicsPipeline,
    front: GraphicsPipeline,
    moves: bool,
}

impl ViewPass {
    /// Prepares the draws for `pass`, with one uniform buffer a frame slot, of a mesh that is
    /// [solid](crate::scene::Mesh::is_solid_from) or not. `before`, empty or one a frame slot too, holds what motion
    /// is made of, and `pass` then has an image for it.
    pub fn new(
        device: &Arc<Device>,
        uniforms: &[Buffer],
        before: &[Buffer],
        pass: &RenderPass,
        solid: bool,
    ) -> gpu::Result<Self> {
        let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
        let mut bindings: Vec<_> = uniforms.iter().map(|u| vec![Binding::Uniform(u)]).collect();
        for (set, before) in bindings.iter_mut().zip(before) {
            set.push(Binding::Uniform(before));
        }
        let moves = !before.is_empty();
        let sets = DescriptorSets::new(device, "view", stages, &bindings)?;
        let front = GraphicsDesc {
            vertex: &shaders::VIEW_VERT,
            fragment: Some(&shaders::VIEW_FRAG),
            vertices: &[(VERTEX_STRIDE, &VERTEX_OFFSETS)],
            // An open sheet is seen from both sides. A solid's back face is seen only at a silhouette, where the
            // grid that vertices are snapped to may bring it before the front face that it meets there: a
            // pixel as dark as the far side.
            cull: if solid {
                vk::CullModeFlags::BACK
            } else {
                vk::CullModeFlags::NONE
            },
            front: vk::FrontFace::COUNTER_CLOCKWISE,
            depth: (vk::CompareOp::LESS, true),
            colors: 1,
            subpass: VIEW,
            constants: &[],
            blends: false,
        };
        let back = GraphicsDesc {
            cull: vk::CullModeFlags::FRONT,
            subpass: BACK,
            ..front
        };
        // Depths are equal: positions are made by the same arithmetic, which view.vert holds invariant.
        let with_motion = GraphicsDesc {
            vertex: &shaders::VIEW_VERT_MOTION,
            fragment: Some(&shaders::VIEW_FRAG_MOTION),
            vertices: &[
                (VERTEX_STRIDE, &VERTEX_OFFSETS),
                (VERTEX_STRIDE, &POSITION_OFFSETS),
            ],
            colors: 2,
            ..front
        };
        let front = if moves { with_motion } else { front };
        Ok(ViewPass {
            back: GraphicsPipeline::new(device, &back, pass, &sets)?,
            front: GraphicsPipeline::new(device, &front, pass, &sets)?,
            moves,
            sets,
        })
    }

    /// Draws depth and normal of the nearest back faces, in the first subpass.
    pub fn record_back(&self, commands: vk::CommandBuffer, slot: usize, geometry: &Geometry) {
        self.back.bind(commands, &self.sets, slot);
        geometry.draw(commands);
    }

    /// Draws depth and normal, in the second subpass, and motion where it is asked for: with that of a mesh that has
    /// `moved` since the frame before, or of the camera alone.
    pub fn record(
        &self,
        commands: vk::CommandBuffer,
        slot: usize,
        geometry: &Geometry,
        moved: bool,
    ) {
        self.front.bind(commands, &self.sets, slot);
        match self.moves {
            true => geometry.draw_moved(commands, moved),
            false => geometry.draw(commands),
        }
    }
}
