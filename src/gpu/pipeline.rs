//! Shaders, render passes and pipelines.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use ash::vk;

use super::kept::{Kept, key};
use super::{DescriptorSets, Device, Image, check};

/// Which build of a shader its SPIR-V is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ShaderBuild {
    /// As it runs.
    Plain,
    /// It also counts what it reads of textures.
    Counting,
    /// Its reads of textures alone.
    Floor,
}

/// Where pipelines take SPIR-V from in place of a shader's own, as words; none for its own, and the compiler's message
/// where the code is at fault. What it gives must be valid and have the interface of the shader's own.
pub type ShaderSource = dyn Fn(&Shader) -> Result<Option<Vec<u32>>, String> + Send + Sync;

/// One entry of the table that `build.rs` writes.
#[derive(Clone, Copy, Debug)]
pub struct Shader {
    /// File name and variant, as "shade.frag samples".
    pub name: &'static str,
    /// The pipeline stage.
    pub stage: vk::ShaderStageFlags,
    /// Which build `spirv` is.
    pub build: ShaderBuild,
    /// Optimised SPIR-V, with names and lines, in little-endian words.
    pub spirv: &'static [u8],
    /// The counting build of the same source: what it reads of textures it counts.
    pub counting: &'static [u8],
    /// Its reads of textures alone, of shaders that shade; else empty.
    pub floor: &'static [u8],
}

impl Shader {
    /// The counting build in place of the plain one.
    pub fn counted(self) -> Shader {
        Shader {
            build: ShaderBuild::Counting,
            spirv: self.counting,
            ..self
        }
    }

    /// Its reads alone in place of the plain build, where there is such a build.
    pub fn floored(self) -> Shader {
        match self.floor {
            [] => self,
            floor => Shader {
                build: ShaderBuild::Floor,
                spirv: floor,
                ..self
            },
        }
    }

    /// The SPIR-V as words.
    pub fn words(&self) -> Vec<u32> {
        let (words, _) = self.spirv.as_chunks::<4>();
        words.iter().map(|&word| u32::from_le_bytes(word)).collect()
    }
}

/// A shader module that lives while pipelines are made.
struct Module<'a> {
    raw: vk::ShaderModule,
    shader: &'a Shader,
    device: &'a Device,
}

/// The SPIR-V that the pipelines of `shader` over `sets` are made of now.
fn code(device: &Device, shader: &Shader, sets: &DescriptorSets) -> super::Result<Vec<u32>> {
    let given = match device.shader_source() {
        Some(source) => source(shader).map_err(super::Error::Shader)?,
        None => None,
    };
    let own = shader.words();
    if let Some(given) = &given {
        // Drivers crash on these.
        let known = |binding: &u32| sets.has(*binding) || bindings(&own).contains(binding);
        if let Some(binding) = bindings(given).iter().find(|binding| !known(binding)) {
            return Err(super::Error::Shader(format!(
                "{}: its pass has no binding {binding}; only a new build of the program can add one",
                shader.name
            )));
        }
    }
    Ok(given.unwrap_or(own))
}

impl<'a> Module<'a> {
    fn new(device: &'a Device, shader: &'a Shader, words: &[u32]) -> super::Result<Self> {
        let info = vk::ShaderModuleCreateInfo::default().code(words);
        // SAFETY: the words come from shaderc, which emits valid SPIR-V.
        let raw = check("vkCreateShaderModule", unsafe {
            device.raw.create_shader_module(&info, None)
        })?;
        device.name(raw, shader.name);
        Ok(Module {
            raw,
            shader,
            device,
        })
    }

    fn stage(&self) -> vk::PipelineShaderStageCreateInfo<'_> {
        vk::PipelineShaderStageCreateInfo::default()
            .stage(self.shader.stage)
            .module(self.raw)
            .name(c"main")
    }
}

impl Drop for Module<'_> {
    fn drop(&mut self) {
        // SAFETY: pipelines do not need their modules once made.
        unsafe { self.device.raw.destroy_shader_module(self.raw, None) };
    }
}

/// The numbers of the bindings that SPIR-V decorates.
fn bindings(words: &[u32]) -> Vec<u32> {
    const HEADER: usize = 5;
    const DECORATE: u32 = 71;
    const BINDING: u32 = 33;
    let mut found = Vec::new();
    let mut rest = words.get(HEADER..).unwrap_or_default();
    // An instruction's first word holds its length and what it is.
    while let Some(instruction) =
        rest.get(..rest.first().map_or(1, |word| (word >> 16).max(1)) as usize)
    {
        if let [first, _, BINDING, number] = *instruction
            && first & 0xffff == DECORATE
        {
            found.push(number);
        }
        rest = &rest[instruction.len()..];
    }
    found
}

/// Values of specialisation constants; constant_id is the place in the list.
fn specialization(values: &[u32]) -> (Vec<vk::SpecializationMapEntry>, Vec<u8>) {
    let entries = (0..values.len())
        .map(|i| vk::SpecializationMapEntry {
            constant_id: i as u32,
            offset: 4 * i as u32,
            size: 4,
        })
        .collect();
    (entries, bytemuck::cast_slice(values).to_vec())
}

/// A pipeline layout of at most one set and one block of push constants.
fn layout(
    device: &Device,
    name: &str,
    sets: &DescriptorSets,
    push: Option<(vk::ShaderStageFlags, u32)>,
) -> super::Result<vk::PipelineLayout> {
    let layouts = [sets.layout];
    let ranges = push.map(|(stage_flags, size)| {
        [vk::PushConstantRange {
            stage_flags,
            offset: 0,
            size,
        }]
    });
    let mut info = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts);
    if let Some(ranges) = &ranges {
        info = info.push_constant_ranges(ranges);
    }
    // SAFETY: the set layout is alive.
    let raw = check("vkCreatePipelineLayout", unsafe {
        device.raw.create_pipeline_layout(&info, None)
    })?;
    device.name(raw, name);
    Ok(raw)
}

/// Names and keeps what the driver has `made` in `call`; on a fault nothing stays behind.
fn kept(
    device: &Device,
    (call, name): (&'static str, &str),
    key: u64,
    layout: vk::PipelineLayout,
    made: Result<Vec<vk::Pipeline>, (Vec<vk::Pipeline>, vk::Result)>,
) -> super::Result<Arc<Kept>> {
    device.made().pipelines.fetch_add(1, Ordering::Relaxed);
    match check(call, made.map_err(|(_, result)| result)) {
        Ok(raw) => {
            // Before another thread can have it.
            device.name(raw[0], name);
            Ok(device.pipelines.keep(&device.raw, key, raw[0], layout))
        }
        Err(error) => {
            // SAFETY: no pipeline was made over it.
            unsafe { device.raw.destroy_pipeline_layout(layout, None) };
            Err(error)
        }
    }
}

/// A compute pipeline.
pub struct ComputePipeline {
    kept: Arc<Kept>,
    device: Arc<Device>,
}

impl ComputePipeline {
    /// Makes the pipeline of `shader` over `sets`, with `push_bytes` of push constants, unless there is one.
    ///
    /// # Errors
    /// What the driver says.
    pub fn new(
        device: &Arc<Device>,
        shader: &Shader,
        sets: &DescriptorSets,
        push_bytes: u32,
        constants: &[u32],
    ) -> super::Result<Self> {
        let words = code(device, shader, sets)?;
        let key = key((shader.name, &words, sets.signature(), push_bytes, constants));
        let own = |kept| ComputePipeline {
            kept,
            device: Arc::clone(device),
        };
        if let Some(kept) = device.pipelines.find(key) {
            return Ok(own(kept));
        }
        let module = Module::new(device, shader, &words)?;
        let push = (push_bytes > 0).then_some((vk::ShaderStageFlags::COMPUTE, push_bytes));
        let layout = layout(device, shader.name, sets, push)?;
        let (entries, data) = specialization(constants);
        let values = vk::SpecializationInfo::default()
            .map_entries(&entries)
            .data(&data);
        let info = vk::ComputePipelineCreateInfo::default()
            .stage(module.stage().specialization_info(&values))
            .layout(layout);
        // SAFETY: module and layout are alive and match.
        let made = unsafe {
            device
                .raw
                .create_compute_pipelines(vk::PipelineCache::null(), &[info], None)
        };
        let call = ("vkCreateComputePipelines", shader.name);
        kept(device, call, key, layout, made).map(own)
    }

    /// Binds the pipeline and the set of frame slot `slot`.
    pub fn bind(&self, commands: vk::CommandBuffer, sets: &DescriptorSets, slot: usize) {
        bind(
            &self.device,
            commands,
            vk::PipelineBindPoint::COMPUTE,
            &self.kept,
            sets.set(slot),
        );
    }

    /// Sets the push constants.
    pub fn push(&self, commands: vk::CommandBuffer, data: &[u8]) {
        // SAFETY: the layout has a range of this size for compute.
        unsafe {
            self.device.raw.cmd_push_constants(
                commands,
                self.kept.layout,
                vk::ShaderStageFlags::COMPUTE,
                0,
                data,
            );
        }
    }

    /// Dispatches at least `groups` groups, in lines of as many as any device takes.
    pub fn dispatch_groups(&self, commands: vk::CommandBuffer, groups: u32) {
        // 65535 is the smallest limit that Vulkan allows.
        let columns = groups.clamp(1, 1 << 15);
        // SAFETY: the pipeline and its set are bound.
        unsafe {
            self.device
                .raw
                .cmd_dispatch(commands, columns, groups.div_ceil(columns), 1);
        }
    }

    /// Dispatches enough groups of 8x8 to cover `size`.
    pub fn dispatch_8x8(&self, commands: vk::CommandBuffer, size: [u32; 2]) {
        self.dispatch(commands, size.map(|side| side.div_ceil(8)));
    }

    /// Dispatches `groups` workgroups.
    pub fn dispatch(&self, commands: vk::CommandBuffer, groups: [u32; 2]) {
        // SAFETY: the pipeline and its set are bound.
        unsafe {
            self.device
                .raw
                .cmd_dispatch(commands, groups[0], groups[1], 1);
        }
    }
}

fn bind(
    device: &Device,
    commands: vk::CommandBuffer,
    point: vk::PipelineBindPoint,
    pipeline: &Kept,
    set: vk::DescriptorSet,
) {
    // SAFETY: `commands` is being recorded; the pipeline's layout is that of the set.
    unsafe {
        device.raw.cmd_bind_pipeline(commands, point, pipeline.raw);
        device
            .raw
            .cmd_bind_descriptor_sets(commands, point, pipeline.layout, 0, &[set], &[]);
    }
}

/// A render pass and its framebuffer.
pub struct RenderPass {
    pub(crate) raw: vk::RenderPass,
    framebuffer: vk::Framebuffer,
    size: [u32; 2],
    // What other passes have in common with it, over which its pipelines can be used.
    signature: u64,
    device: Arc<Device>,
}

impl RenderPass {
    /// Makes the pass over `attachments`. Its area is what all of them have, from their corners.
    ///
    /// # Errors
    /// What the driver says.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        info: &vk::RenderPassCreateInfo<'_>,
        attachments: &[&Image],
    ) -> super::Result<Self> {
        let size = attachments
            .iter()
            .map(|image| image.size())
            .reduce(|a, b| [a[0].min(b[0]), a[1].min(b[1])])
            .unwrap_or([1, 1]);
        // SAFETY: the description is well-formed; the validation layer checks it in every test.
        let raw = check("vkCreateRenderPass", unsafe {
            device.raw.create_render_pass(info, None)
        })?;
        let mut pass = RenderPass {
            raw,
            framebuffer: vk::Framebuffer::null(),
            size,
            signature: compatibility(info),
            device: Arc::clone(device),
        };
        device.name(raw, name);
        let views: Vec<_> = attachments.iter().map(|image| image.view).collect();
        let info = vk::FramebufferCreateInfo::default()
            .render_pass(raw)
            .attachments(&views)
            .width(size[0])
            .height(size[1])
            .layers(1);
        // SAFETY: pass and views are alive and match.
        pass.framebuffer = check("vkCreateFramebuffer", unsafe {
            device.raw.create_framebuffer(&info, None)
        })?;
        device.name(pass.framebuffer, name);
        Ok(pass)
    }

    /// Begins the pass over its whole area, with one clear value an attachment.
    pub fn begin(&self, commands: vk::CommandBuffer, clear: &[vk::ClearValue]) {
        let extent = vk::Extent2D {
            width: self.size[0],
            height: self.size[1],
        };
        let area = vk::Rect2D {
            offset: vk::Offset2D::default(),
            extent,
        };
        let info = vk::RenderPassBeginInfo::default()
            .render_pass(self.raw)
            .framebuffer(self.framebuffer)
            .render_area(area)
            .clear_values(clear);
        let viewport = vk::Viewport {
            x: 0.0,
            y: 0.0,
            width: self.size[0] as f32,
            height: self.size[1] as f32,
            min_depth: 0.0,
            max_depth: 1.0,
        };
        // SAFETY: `commands` is being recorded outside a render pass.
        unsafe {
            self.device
                .raw
                .cmd_begin_render_pass(commands, &info, vk::SubpassContents::INLINE);
            self.device.raw.cmd_set_viewport(commands, 0, &[viewport]);
            self.device.raw.cmd_set_scissor(commands, 0, &[area]);
        }
    }

    /// Goes to the next subpass.
    pub fn next(&self, commands: vk::CommandBuffer) {
        // SAFETY: the pass is begun and has another subpass.
        unsafe {
            self.device
                .raw
                .cmd_next_subpass(commands, vk::SubpassContents::INLINE)
        };
    }

    /// Ends the pass.
    pub fn end(&self, commands: vk::CommandBuffer) {
        // SAFETY: the pass is begun and in its last subpass.
        unsafe { self.device.raw.cmd_end_render_pass(commands) };
    }
}

impl Drop for RenderPass {
    fn drop(&mut self) {
        // SAFETY: owners wait for the device's last use before they drop the pass.
        unsafe {
            self.device.raw.destroy_framebuffer(self.framebuffer, None);
            self.device.raw.destroy_render_pass(self.raw, None);
        }
    }
}

/// Stands for all that compatible render passes have in common (Vulkan 1.3, 8.2): formats and samples of what their
/// attachments refer to, subpass by subpass, and the dependencies; for none of the layouts, loads and stores.
fn compatibility(info: &vk::RenderPassCreateInfo<'_>) -> u64 {
    // SAFETY: the slices were lent to `info` for its lifetime, and it tells their lengths; so with what they refer to.
    unsafe fn slice<'a, T>(first: *const T, count: u32) -> &'a [T] {
        if first.is_null() {
            return &[];
        }
        unsafe { std::slice::from_raw_parts(first, count as usize) }
    }
    // SAFETY: as above.
    let (attachments, subpasses, dependencies) = unsafe {
        (
            slice(info.p_attachments, info.attachment_count),
            slice(info.p_subpasses, info.subpass_count),
            slice(info.p_dependencies, info.dependency_count),
        )
    };
    let attachments: Vec<_> = attachments.iter().map(|a| (a.format, a.samples)).collect();
    let subpasses: Vec<_> = subpasses
        .iter()
        .map(|subpass| {
            // SAFETY: as above.
            let (inputs, colors, depth) = unsafe {
                (
                    slice(subpass.p_input_attachments, subpass.input_attachment_count),
                    slice(subpass.p_color_attachments, subpass.color_attachment_count),
                    slice(subpass.p_depth_stencil_attachment, 1),
                )
            };
            [inputs, colors, depth].map(|all| all.iter().map(|a| a.attachment).collect::<Vec<_>>())
        })
        .collect();
    let dependencies: Vec<_> = dependencies
        .iter()
        .map(|d| {
            (
                [d.src_subpass, d.dst_subpass],
                [d.src_stage_mask, d.dst_stage_mask],
                [d.src_access_mask, d.dst_access_mask],
                d.dependency_flags,
            )
        })
        .collect();
    key((attachments, subpasses, dependencies))
}

/// What a graphics pipeline of this program may differ in.
#[derive(Clone, Copy)]
pub struct GraphicsDesc<'a> {
    /// Vertex shader.
    pub vertex: &'a Shader,
    /// Fragment shader; none where only depth is written.
    pub fragment: Option<&'a Shader>,
    /// Of each vertex buffer, bytes per vertex and the byte offsets of its vec3 attributes, whose locations go on from
    /// those of the buffer before; none for a full-screen triangle.
    pub vertices: &'a [(u32, &'a [u32])],
    /// Which faces are dropped.
    pub cull: vk::CullModeFlags,
    /// Which winding is the front.
    pub front: vk::FrontFace,
    /// Depth comparison, and whether depth is written.
    pub depth: (vk::CompareOp, bool),
    /// Number of colour attachments of the subpass.
    pub colors: usize,
    /// Index of the subpass.
    pub subpass: u32,
    /// Specialisation constants of the fragment shader.
    pub constants: &'a [u32],
    /// Whether it draws over what is there, its colour premultiplied by its coverage; else in place of it.
    pub blends: bool,
}

impl<'a> GraphicsDesc<'a> {
    /// Draws triangles whose corners the vertex shader makes up, in place of whatever the one colour attachment of the
    /// first subpass holds, without a depth.
    pub fn flat(vertex: &'a Shader, fragment: &'a Shader, constants: &'a [u32]) -> Self {
        GraphicsDesc {
            vertex,
            fragment: Some(fragment),
            vertices: &[],
            cull: vk::CullModeFlags::NONE,
            front: vk::FrontFace::COUNTER_CLOCKWISE,
            depth: (vk::CompareOp::ALWAYS, false),
            colors: 1,
            subpass: 0,
            constants,
            blends: false,
        }
    }
}

/// A graphics pipeline with dynamic viewport and scissor.
pub struct GraphicsPipeline {
    kept: Arc<Kept>,
    device: Arc<Device>,
}

impl GraphicsPipeline {
    /// Makes the pipeline for one subpass of `pass`, unless there is one.
    ///
    /// # Errors
    /// What the driver says.
    pub fn new(
        device: &Arc<Device>,
        desc: &GraphicsDesc<'_>,
        pass: &RenderPass,
        sets: &DescriptorSets,
    ) -> super::Result<Self> {
        let name = desc.fragment.unwrap_or(desc.vertex).name;
        let code = |shader: &Shader| code(device, shader, sets);
        let vertex_words = code(desc.vertex)?;
        let fragment_words = desc.fragment.map(code).transpose()?;
        let key = key((
            (name, &vertex_words, &fragment_words, desc.constants),
            (desc.vertices, desc.cull, desc.front, desc.depth),
            (desc.colors, desc.blends, desc.subpass, pass.signature),
            sets.signature(),
        ));
        let own = |kept| GraphicsPipeline {
            kept,
            device: Arc::clone(device),
        };
        if let Some(kept) = device.pipelines.find(key) {
            return Ok(own(kept));
        }

        let vertex = Module::new(device, desc.vertex, &vertex_words)?;
        let fragment = desc
            .fragment
            .zip(fragment_words.as_ref())
            .map(|(shader, words)| Module::new(device, shader, words))
            .transpose()?;
        let layout = layout(device, name, sets, None)?;
        let (entries, data) = specialization(desc.constants);
        let values = vk::SpecializationInfo::default()
            .map_entries(&entries)
            .data(&data);
        let mut stages = vec![vertex.stage()];
        stages.extend(
            fragment
                .as_ref()
                .map(|f| f.stage().specialization_info(&values)),
        );

        let bindings: Vec<_> = (0..)
            .zip(desc.vertices)
            .map(
                |(binding, &(stride, _))| vk::VertexInputBindingDescription {
                    binding,
                    stride,
                    input_rate: vk::VertexInputRate::VERTEX,
                },
            )
            .collect();
        let offsets = (0..)
            .zip(desc.vertices)
            .flat_map(|(binding, (_, offsets))| {
                offsets.iter().map(move |offset| (binding, offset))
            });
        let attributes: Vec<_> = (0..)
            .zip(offsets)
            .map(
                |(location, (binding, &offset))| vk::VertexInputAttributeDescription {
                    location,
                    binding,
                    format: vk::Format::R32G32B32_SFLOAT,
                    offset,
                },
            )
            .collect();
        let vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&bindings)
            .vertex_attribute_descriptions(&attributes);
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default()
            .viewport_count(1)
            .scissor_count(1);
        let raster = vk::PipelineRasterizationStateCreateInfo::default()
            .polygon_mode(vk::PolygonMode::FILL)
            .cull_mode(desc.cull)
            .front_face(desc.front)
            .line_width(1.0);
        let samples = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(true)
            .depth_compare_op(desc.depth.0)
            .depth_write_enable(desc.depth.1);
        let (one, rest) = (vk::BlendFactor::ONE, vk::BlendFactor::ONE_MINUS_SRC_ALPHA);
        let attachment = vk::PipelineColorBlendAttachmentState::default()
            .blend_enable(desc.blends)
            .src_color_blend_factor(one)
            .dst_color_blend_factor(rest)
            .src_alpha_blend_factor(one)
            .dst_alpha_blend_factor(rest)
            .color_write_mask(vk::ColorComponentFlags::RGBA);
        let attachments = vec![attachment; desc.colors];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&attachments);
        let dynamic = vk::PipelineDynamicStateCreateInfo::default()
            .dynamic_states(&[vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR]);

        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&samples)
            .depth_stencil_state(&depth)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(layout)
            .render_pass(pass.raw)
            .subpass(desc.subpass);
        // SAFETY: everything `info` points to is alive and matches the pass.
        let made = unsafe {
            device
                .raw
                .create_graphics_pipelines(vk::PipelineCache::null(), &[info], None)
        };
        let call = ("vkCreateGraphicsPipelines", name);
        kept(device, call, key, layout, made).map(own)
    }

    /// Binds the pipeline and the set of frame slot `slot`.
    pub fn bind(&self, commands: vk::CommandBuffer, sets: &DescriptorSets, slot: usize) {
        bind(
            &self.device,
            commands,
            vk::PipelineBindPoint::GRAPHICS,
            &self.kept,
            sets.set(slot),
        );
    }

    /// Draws the vertices `range`, within columns and rows `clip` (x, y, width, height) of the target.
    pub fn draw_clipped(&self, commands: vk::CommandBuffer, range: Range<u32>, clip: [u32; 4]) {
        let scissor = vk::Rect2D {
            offset: vk::Offset2D {
                x: clip[0] as i32,
                y: clip[1] as i32,
            },
            extent: vk::Extent2D {
                width: clip[2],
                height: clip[3],
            },
        };
        // SAFETY: the pipeline and its set are bound inside its subpass.
        unsafe {
            self.device.raw.cmd_set_scissor(commands, 0, &[scissor]);
            let count = range.end - range.start;
            self.device.raw.cmd_draw(commands, count, 1, range.start, 0);
        }
    }

    /// Draws one triangle that covers the screen, within `x0..x1` of its columns.
    pub fn draw_full_screen(&self, commands: vk::CommandBuffer, columns: [u32; 2], height: u32) {
        let scissor = vk::Rect2D {
            offset: vk::Offset2D {
                x: columns[0] as i32,
                y: 0,
            },
            extent: vk::Extent2D {
                width: columns[1] - columns[0],
                height,
            },
        };
        // SAFETY: the pipeline and its set are bound inside its subpass.
        unsafe {
            self.device.raw.cmd_set_scissor(commands, 0, &[scissor]);
            self.device.raw.cmd_draw(commands, 3, 1, 0, 0);
        }
    }
}
