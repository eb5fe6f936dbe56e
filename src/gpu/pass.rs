//! A compute pipeline whose layout and workgroup size come from its SPIR-V. Resources are bound by the names that the
//! shader gives them, so that swapped resources cannot go unnoticed.

use std::cell::Cell;
use std::sync::Arc;
use std::time::Instant;

use ash::vk;

use super::buffer::Buffer;
use super::dead_branches::without_dead_branches;
use super::device::Device;
use super::failure::failure;
use super::image::Image;
use super::needs;
use super::pipeline::Pipeline;
use super::reflection::{Reflection, Resource, number_resources};
use super::shader::{PassDesc, Shaders};
use crate::error::{DeviceError, Error, Result};

/// The resource that a name in the shader is bound to.
#[derive(Clone, Copy)]
pub enum Binding<'a> {
    Buffer(&'a Buffer),
    /// A storage image, or an image that is read texel by texel.
    Image(&'a Image),
    /// An image that is sampled with linear filtering, clamped at the border.
    Filtered(&'a Image),
}

impl<'a> Binding<'a> {
    pub(super) fn image(&self) -> Option<&'a Image> {
        match self {
            Binding::Buffer(_) => None,
            Binding::Image(image) | Binding::Filtered(image) => Some(image),
        }
    }
}

pub struct Pass {
    pub name: &'static str,
    pub(super) resources: Vec<Resource>,
    pub(super) push_bytes: u32,
    /// Threads of a workgroup along x, y and z.
    workgroup: [u32; 3],
    pub(super) pipeline: Pipeline,
    /// What a workgroup of the last run in slices took in the slice where it took longest, in milliseconds; `None` before
    /// there was one.
    pub(super) slowest_ms: Cell<Option<f64>>,
}

fn unfit(pass: &str, problem: String) -> Error {
    let part = format!("pass {pass}");
    DeviceError::Program { part, problem }.into()
}

impl Pass {
    /// The error for using the pass otherwise than its shader declares.
    pub(super) fn unfit(&self, problem: String) -> Error {
        unfit(self.name, problem)
    }

    pub fn new(device: &Arc<Device>, shaders: &Shaders, desc: &PassDesc<'_>) -> Result<Pass> {
        let began = Instant::now();
        let mut code = shaders.compile(desc, &device.macros())?;
        let Reflection {
            resources,
            push_bytes,
            workgroup,
        } = number_resources(&mut code)
            .and_then(|()| Reflection::read(&code))
            .map_err(|problem| unfit(desc.name, problem))?;
        check_resources(&resources, workgroup, device)
            .map_err(|problem| unfit(desc.name, problem))?;
        let bindings = resources
            .iter()
            .map(|resource| (resource.binding, resource.kind));
        let stage = vk::ShaderStageFlags::COMPUTE;
        let code = without_dead_branches(&code, desc.specialization)
            .map_err(|problem| unfit(desc.name, problem))?;
        let pipeline = Pipeline::new(device, stage, bindings, push_bytes, |layout| {
            compute_pipeline(device, layout, &code, desc.specialization)
        });
        let pipeline = pipeline.map_err(|e| failure(e, format!("pass {}", desc.name)))?;
        shaders.spend(began.elapsed());
        Ok(Pass {
            name: desc.name,
            resources,
            push_bytes,
            workgroup,
            pipeline,
            slowest_ms: Cell::new(None),
        })
    }

    /// Workgroups that hold at least `threads` threads.
    pub(super) fn groups(&self, threads: [u32; 3]) -> [u32; 3] {
        std::array::from_fn(|a| threads[a].div_ceil(self.workgroup[a]))
    }
}

/// Fails for a shader that exceeds the limits in the table of needs, but for what else the device is known to have.
fn check_resources(
    resources: &[Resource],
    workgroup: [u32; 3],
    device: &Device,
) -> Result<(), String> {
    let count = |kind| {
        resources
            .iter()
            .filter(|resource| resource.kind == kind)
            .count() as u32
    };
    let extra = device.summary.extra_images;
    let images = if device.loads_texels {
        needs::LOADED_IMAGES.saturating_add(extra)
    } else {
        needs::STORAGE_IMAGES
    };
    let uses = [
        ("threads", workgroup.iter().product(), needs::GROUP_THREADS),
        (
            "storage buffers",
            count(vk::DescriptorType::STORAGE_BUFFER),
            needs::STORAGE_BUFFERS,
        ),
        (
            "storage images",
            count(vk::DescriptorType::STORAGE_IMAGE),
            images,
        ),
        (
            "sampled images",
            count(vk::DescriptorType::COMBINED_IMAGE_SAMPLER),
            needs::SAMPLED_IMAGES.saturating_add(extra),
        ),
    ];
    match uses.iter().find(|(_, used, most)| used > most) {
        Some((what, used, most)) => Err(format!(
            "the shader has {used} {what}, and devices are asked for {most} only (gpu/needs.rs)"
        )),
        None => Ok(()),
    }
}

fn compute_pipeline(
    device: &Device,
    layout: vk::PipelineLayout,
    code: &[u32],
    specialization: &[u32],
) -> Result<vk::Pipeline, vk::Result> {
    let module = vk::ShaderModuleCreateInfo::default().code(code);
    // SAFETY: the code is SPIR-V of the compiler, perhaps kept by an earlier run under a checksum; branches were removed by
    // the rules of SPIR-V. The module is destroyed below.
    let module = unsafe { device.raw.create_shader_module(&module, None) }?;
    let entries: Vec<_> = (0..specialization.len() as u32)
        .map(|id| vk::SpecializationMapEntry {
            constant_id: id,
            offset: id * 4,
            size: 4,
        })
        .collect();
    let constants = vk::SpecializationInfo::default()
        .map_entries(&entries)
        .data(bytemuck::cast_slice(specialization));
    let stage = vk::PipelineShaderStageCreateInfo::default()
        .stage(vk::ShaderStageFlags::COMPUTE)
        .module(module)
        .name(c"main")
        .specialization_info(&constants);
    let info = [vk::ComputePipelineCreateInfo::default()
        .flags(vk::PipelineCreateFlags::DISPATCH_BASE)
        .stage(stage)
        .layout(layout)];
    // SAFETY: module and layout are alive; the caller destroys the pipeline, which keeps what it needs
    // of its module.
    let made = unsafe {
        let cache = device.pipelines.raw;
        let made = device.raw.create_compute_pipelines(cache, &info, None);
        device.raw.destroy_shader_module(module, None);
        made
    };
    Ok(made.map_err(|(_, e)| e)?[0])
}
