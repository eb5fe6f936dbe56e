//! Textured triangles over an image, with which a user interface is drawn.
//!
//! Their memory is of fixed size, so that a plan can count it before anything has been drawn: a texture with
//! [`ATLAS_SIDE`]² texels for a font and [`SLOTS`] slots of [`SLOT_SIDE`]² texels below them, `MOST_VERTICES` vertices and
//! `MOST_INDICES` indices. Whatever exceeds them is not drawn.

use std::sync::Arc;

use ash::vk;

use super::super::buffer::{Buffer, BufferDesc};
use super::super::device::Device;
use super::super::failure::failure;
use super::super::frame::{CommandKind, Frame};
use super::super::image::{Image, ImageDesc};
use super::super::memory::Memory;
use super::super::pipeline::Pipeline;
use super::super::recording::Recording;
use super::super::shader::Shaders;
use super::super::shared::Shared;
use super::super::types::*;
use super::surface::Surface;
use super::target::Target;
use crate::error::Result;
use crate::shared;

/// Texels along either side of the texture's part for a font.
pub const ATLAS_SIDE: u32 = 1024;
/// Texels along either side of a slot for another texture, and the number of slots.
pub const SLOT_SIDE: u32 = 64;
pub const SLOTS: u32 = 2 * ATLAS_SIDE / SLOT_SIDE;
/// Size of the texture.
const ATLAS: [u32; 2] = [ATLAS_SIDE, ATLAS_SIDE + 2 * SLOT_SIDE];

const MOST_VERTICES: usize = 1 << 16;
const MOST_INDICES: usize = 1 << 18;

/// The first texel of a slot.
pub fn slot_corner(slot: u32) -> [u32; 2] {
    let in_a_row = ATLAS_SIDE / SLOT_SIDE;
    let row = slot / in_a_row;
    [slot % in_a_row * SLOT_SIDE, ATLAS_SIDE + row * SLOT_SIDE]
}

shared! {
    pub struct CanvasVertex {
        /// In pixels from the upper left corner.
        pub position: vec2,
        /// Position in the texture, in texels.
        pub uv: vec2,
        /// Eight bits a channel, red lowest; premultiplied, encoded for display.
        pub color: uint,
    }

    pub struct CanvasPush {
        /// In pixels.
        pub size: vec2,
        /// A texel, as a share of the texture's sides.
        pub texel: vec2,
    }
}

/// Triangles that are drawn inside one rectangle.
pub struct CanvasMesh {
    /// Low and high corner in pixels.
    pub clip: [[u32; 2]; 2],
    pub vertices: Vec<CanvasVertex>,
    pub indices: Vec<u32>,
}

pub struct Canvas {
    /// `None` in a dry run.
    pipeline: Option<Pipeline>,
    vertices: Buffer,
    indices: Buffer,
    atlas: Image,
    staging: Buffer,
    draws: Vec<Draw>,
}

/// Indices `first` to `first + count`, inside a rectangle.
struct Draw {
    scissor: vk::Rect2D,
    first: u32,
    count: u32,
}

impl Canvas {
    pub fn new(memory: &Arc<Memory>, surface: &Surface) -> Result<Canvas> {
        let upload = |name, bytes: usize| BufferDesc::upload(name, bytes as u64);
        let texels = ATLAS[0] as usize * ATLAS[1] as usize;
        let vertices = upload(
            "window: vertices",
            MOST_VERTICES * size_of::<CanvasVertex>(),
        );
        let indices = upload("window: indices", MOST_INDICES * size_of::<u32>());
        let atlas = ImageDesc::flat(
            "window: texture",
            [ATLAS[0], ATLAS[1]],
            vk::Format::R8G8B8A8_UNORM,
        )
        .zeroed();
        Ok(Canvas {
            pipeline: if memory.is_dry_run() {
                None
            } else {
                Some(pipeline(memory.device(), surface.format.format)?)
            },
            vertices: Buffer::new(memory, vertices)?,
            indices: Buffer::new(memory, indices)?,
            atlas: Image::new(memory, atlas)?,
            staging: Buffer::new(memory, upload("window: staging", 4 * texels))?,
            draws: Vec::new(),
        })
    }

    /// Writes texels, RGBA in rows, from `low` on.
    pub fn write_atlas(
        &mut self,
        frame: &mut Frame,
        low: [u32; 2],
        extent: [u32; 2],
        texels: &[u8],
    ) -> Result<()> {
        self.staging.write(texels);
        frame.run(|recording| {
            recording.upload(
                &self.staging,
                &self.atlas,
                [low[0], low[1], 0],
                [extent[0], extent[1], 1],
            )
        })
    }

    /// Sets the triangles that are drawn from now on.
    pub fn fill(&mut self, meshes: &[CanvasMesh]) {
        let (mut vertices, mut indices) = (Vec::new(), Vec::new());
        self.draws.clear();
        for mesh in meshes {
            let [low, high] = mesh.clip;
            if vertices.len() + mesh.vertices.len() > MOST_VERTICES
                || indices.len() + mesh.indices.len() > MOST_INDICES
                || (0..2).any(|a| high[a] <= low[a])
            {
                continue;
            }
            let first_vertex = vertices.len() as u32;
            self.draws.push(Draw {
                scissor: rectangle([low, high]),
                first: indices.len() as u32,
                count: mesh.indices.len() as u32,
            });
            vertices.extend_from_slice(&mesh.vertices);
            indices.extend(mesh.indices.iter().map(|i| i + first_vertex));
        }
        self.vertices.write(&vertices);
        self.indices.write(&indices);
    }
}

/// The macros by which the shaders name the resources' binding numbers 0, 1, …, and the resources' types.
const RESOURCES: [(&str, vk::DescriptorType); 3] = [
    ("VERTICES", vk::DescriptorType::STORAGE_BUFFER),
    ("INDICES", vk::DescriptorType::STORAGE_BUFFER),
    ("ATLAS", vk::DescriptorType::COMBINED_IMAGE_SAMPLER),
];

/// Binding numbers and descriptor types.
fn bindings() -> [(u32, vk::DescriptorType); RESOURCES.len()] {
    std::array::from_fn(|n| (n as u32, RESOURCES[n].1))
}

const STAGES: [vk::ShaderStageFlags; 2] =
    [vk::ShaderStageFlags::VERTEX, vk::ShaderStageFlags::FRAGMENT];

fn all_stages() -> vk::ShaderStageFlags {
    STAGES[0] | STAGES[1]
}

fn pipeline(device: &Arc<Device>, format: vk::Format) -> Result<Pipeline> {
    let shared = [CanvasVertex::GLSL, CanvasPush::GLSL].concat();
    let numbers = bindings().map(|(binding, _)| binding.to_string());
    let macros: [_; RESOURCES.len()] =
        std::array::from_fn(|n| (RESOURCES[n].0, numbers[n].as_str()));
    let stages = Shaders::new(shared).compile_drawing("canvas", &macros)?;
    let push_bytes = size_of::<CanvasPush>() as u32;
    let pipeline = Pipeline::new(device, all_stages(), bindings(), push_bytes, |layout| {
        let mut modules = Vec::new();
        let mut build = || {
            for code in &stages {
                let info = vk::ShaderModuleCreateInfo::default().code(code);
                // SAFETY: the code is SPIR-V of the compiler, perhaps kept by an earlier run under a checksum; destroyed
                // below.
                modules.push(unsafe { device.raw.create_shader_module(&info, None) }?);
            }
            graphics_pipeline(device, layout, &modules, format)
        };
        let built = build();
        for module in modules {
            // SAFETY: pipelines keep what they need of their modules.
            unsafe { device.raw.destroy_shader_module(module, None) };
        }
        built
    });
    pipeline.map_err(|e| failure(e, "the user interface cannot be drawn"))
}

fn graphics_pipeline(
    device: &Device,
    layout: vk::PipelineLayout,
    modules: &[vk::ShaderModule],
    format: vk::Format,
) -> Result<vk::Pipeline, vk::Result> {
    let stages: Vec<_> = STAGES
        .iter()
        .zip(modules)
        .map(|(&kind, &module)| {
            vk::PipelineShaderStageCreateInfo::default()
                .stage(kind)
                .module(module)
                .name(c"main")
        })
        .collect();
    let vertex_input = vk::PipelineVertexInputStateCreateInfo::default();
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
        .topology(vk::PrimitiveTopology::TRIANGLE_LIST);
    let viewport = vk::PipelineViewportStateCreateInfo::default()
        .viewport_count(1)
        .scissor_count(1);
    let rasterization = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
    let samples = vk::PipelineMultisampleStateCreateInfo::default()
        .rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let over = [vk::PipelineColorBlendAttachmentState::default()
        .blend_enable(true)
        .src_color_blend_factor(vk::BlendFactor::ONE)
        .dst_color_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_ALPHA)
        .src_alpha_blend_factor(vk::BlendFactor::ONE)
        .dst_alpha_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_ALPHA)
        .color_write_mask(vk::ColorComponentFlags::RGBA)];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&over);
    let changing = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&changing);
    let formats = [format];
    let mut rendering =
        vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats);
    let info = [vk::GraphicsPipelineCreateInfo::default()
        .stages(&stages)
        .vertex_input_state(&vertex_input)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&rasterization)
        .multisample_state(&samples)
        .color_blend_state(&blend)
        .dynamic_state(&dynamic)
        .layout(layout)
        .push_next(&mut rendering)];
    // SAFETY: modules and layout are alive; the caller destroys the pipeline.
    let made = unsafe {
        device
            .raw
            .create_graphics_pipelines(device.pipelines.raw, &info, None)
    };
    Ok(made.map_err(|(_, e)| e)?[0])
}

fn rectangle([low, high]: [[u32; 2]; 2]) -> vk::Rect2D {
    vk::Rect2D {
        offset: vk::Offset2D {
            x: low[0] as i32,
            y: low[1] as i32,
        },
        extent: vk::Extent2D {
            width: high[0] - low[0],
            height: high[1] - low[1],
        },
    }
}

impl<'r> Recording<'_, 'r> {
    /// Draws the canvas's triangles over the target.
    pub fn draw(&mut self, canvas: &'r Canvas, target: &'r Target<'_>) -> Result<()> {
        self.begin_images(std::iter::once(&canvas.atlas))?;
        self.record_command(
            "interface",
            CommandKind::Pass,
            vk::PipelineStageFlags2::ALL_COMMANDS,
            |recording| {
                let Some(pipeline) = &canvas.pipeline else {
                    return Ok(());
                };
                recording.bind_canvas(canvas, pipeline)?;
                recording.record_draws(canvas, pipeline, target);
                Ok(())
            },
        )
    }

    fn bind_canvas(&mut self, canvas: &'r Canvas, pipeline: &'r Pipeline) -> Result<()> {
        let buffers = [&canvas.vertices, &canvas.indices].map(|buffer| {
            [vk::DescriptorBufferInfo::default()
                .buffer(buffer.handle())
                .range(vk::WHOLE_SIZE)]
        });
        let texture = [vk::DescriptorImageInfo::default()
            .sampler(self.frame.device.linear)
            .image_view(canvas.atlas.view())
            .image_layout(vk::ImageLayout::GENERAL)];
        let mut writes = bindings().map(|(binding, kind)| {
            let write = vk::WriteDescriptorSet::default()
                .dst_binding(binding)
                .descriptor_type(kind);
            match buffers.get(binding as usize) {
                Some(buffer) => write.buffer_info(buffer),
                None => write.image_info(&texture),
            }
        });
        self.bind_resources(vk::PipelineBindPoint::GRAPHICS, pipeline, &mut writes)
            .map_err(|e| self.failed(e))
    }

    fn record_draws(&self, canvas: &'r Canvas, pipeline: &'r Pipeline, target: &'r Target<'_>) {
        let [width, height] = target.extent;
        let whole = rectangle([[0, 0], target.extent]);
        let attachments = [vk::RenderingAttachmentInfo::default()
            .image_view(target.view)
            .image_layout(vk::ImageLayout::GENERAL)
            .load_op(vk::AttachmentLoadOp::LOAD)
            .store_op(vk::AttachmentStoreOp::STORE)];
        let rendering = vk::RenderingInfo::default()
            .render_area(whole)
            .layer_count(1)
            .color_attachments(&attachments);
        let viewport = [vk::Viewport {
            width: width as f32,
            height: height as f32,
            max_depth: 1.0,
            ..Default::default()
        }];
        let push = CanvasPush {
            size: target.extent.map(|n| n as f32),
            texel: ATLAS.map(|n| 1.0 / n as f32),
        };
        let (raw, commands) = self.raw();
        // SAFETY: the command buffer is recording, and everything is borrowed until its work has ended.
        unsafe {
            raw.cmd_begin_rendering(commands, &rendering);
            raw.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, pipeline.raw);
            raw.cmd_set_viewport(commands, 0, &viewport);
            raw.cmd_push_constants(
                commands,
                pipeline.layout,
                all_stages(),
                0,
                bytemuck::bytes_of(&push),
            );
            for draw in &canvas.draws {
                raw.cmd_set_scissor(commands, 0, &[draw.scissor]);
                raw.cmd_draw(commands, draw.count, 1, draw.first, 0);
            }
            raw.cmd_end_rendering(commands);
        }
    }
}
