//! A compute pipeline whose layout and workgroup size come from its SPIR-V. Resources are bound by
//! the names that the shader gives them, so that a swap cannot go unnoticed.

use std::sync::Arc;
use std::time::Instant;

use ash::vk;
use rspirv_reflect::{PushConstantInfo, Reflection};

use super::buffer::Buffer;
use super::device::{Device, failure};
use super::image::Image;
use super::shader::Shaders;
use crate::error::{Error, Result};

/// What a pass is made from.
pub struct PassDesc<'a> {
    /// The shader's file name without `.comp`; also the name in timings and messages.
    pub name: &'static str,
    /// Values of the specialization constants 0, 1, …
    pub specialization: &'a [u32],
}

/// What stands behind a name in the shader.
#[derive(Clone, Copy)]
pub enum Binding<'a> {
    Buffer(&'a Buffer),
    /// A storage image, or one read texel by texel.
    Image(&'a Image),
    /// Sampled with linear filtering, clamped at the border.
    Filtered(&'a Image),
}

pub struct Pass {
    device: Arc<Device>,
    pub name: &'static str,
    pub(super) slots: Vec<Slot>,
    pub(super) push_bytes: u32,
    /// Threads of a workgroup along x, y and z.
    workgroup: [u32; 3],
    set_layout: vk::DescriptorSetLayout,
    pub(super) layout: vk::PipelineLayout,
    pub(super) pipeline: vk::Pipeline,
}

pub(super) struct Slot {
    pub name: String,
    pub binding: u32,
    pub kind: vk::DescriptorType,
}

impl Pass {
    pub fn new(device: &Arc<Device>, shaders: &Shaders, desc: &PassDesc<'_>) -> Result<Pass> {
        let began = Instant::now();
        let code = shaders.compile(desc.name)?;
        let failed = |e: String| Error::Device(format!("pass {}: {e}", desc.name));
        let reflection = Reflection::new_from_spirv(bytemuck::cast_slice(&code))
            .map_err(|e| failed(format!("{e:?}")))?;
        let slots = slots(&reflection).map_err(failed)?;
        let (x, y, z) = reflection
            .get_compute_group_size()
            .ok_or_else(|| failed("the shader states no local size".into()))?;
        let push: Option<PushConstantInfo> = reflection
            .get_push_constant_range()
            .map_err(|e| failed(e.to_string()))?;
        let mut pass = Pass {
            device: device.clone(),
            name: desc.name,
            slots,
            push_bytes: push.map_or(0, |p| p.size),
            workgroup: [x, y, z],
            set_layout: vk::DescriptorSetLayout::null(),
            layout: vk::PipelineLayout::null(),
            pipeline: vk::Pipeline::null(),
        };
        pass.build(&code, desc.specialization)
            .map_err(|e| failure(e, format!("pass {}: {e}", desc.name)))?;
        shaders.spend(began.elapsed());
        Ok(pass)
    }

    /// Workgroups that hold at least `threads` threads.
    pub(super) fn groups(&self, threads: [u32; 3]) -> [u32; 3] {
        std::array::from_fn(|a| threads[a].div_ceil(self.workgroup[a]))
    }

    fn build(&mut self, code: &[u32], specialization: &[u32]) -> Result<(), vk::Result> {
        let raw = &self.device.raw;
        let bindings: Vec<_> = self
            .slots
            .iter()
            .map(|slot| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(slot.binding)
                    .descriptor_type(slot.kind)
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::COMPUTE)
            })
            .collect();
        let set = vk::DescriptorSetLayoutCreateInfo::default()
            .flags(vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR)
            .bindings(&bindings);
        // SAFETY: `set` is valid; destroyed in Drop.
        self.set_layout = unsafe { raw.create_descriptor_set_layout(&set, None) }?;
        let sets = [self.set_layout];
        let ranges = [vk::PushConstantRange::default()
            .stage_flags(vk::ShaderStageFlags::COMPUTE)
            .size(self.push_bytes)];
        let layout = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(&sets)
            .push_constant_ranges(match self.push_bytes {
                0 => &[],
                _ => &ranges,
            });
        // SAFETY: the set layout is alive; destroyed in Drop.
        self.layout = unsafe { raw.create_pipeline_layout(&layout, None) }?;
        let module = vk::ShaderModuleCreateInfo::default().code(code);
        // SAFETY: the code is SPIR-V from the compiler; destroyed below.
        let module = unsafe { raw.create_shader_module(&module, None) }?;
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
            .layout(self.layout)];
        // SAFETY: module and layout are alive; the pipeline is destroyed in Drop.
        let made = unsafe {
            let made = raw.create_compute_pipelines(vk::PipelineCache::null(), &info, None);
            raw.destroy_shader_module(module, None);
            made
        };
        self.pipeline = made.map_err(|(_, e)| e)?[0];
        Ok(())
    }
}

fn slots(reflection: &Reflection) -> Result<Vec<Slot>, String> {
    let sets = reflection
        .get_descriptor_sets()
        .map_err(|e| e.to_string())?;
    if sets.keys().any(|&set| set != 0) {
        return Err("only descriptor set 0 is used".into());
    }
    let bindings = sets.into_values().flatten();
    Ok(bindings
        .map(|(binding, info)| Slot {
            name: info.name,
            binding,
            kind: vk::DescriptorType::from_raw(info.ty.0 as i32),
        })
        .collect())
}

impl Drop for Pass {
    fn drop(&mut self) {
        let raw = &self.device.raw;
        // SAFETY: frames wait for their work before they return, so nothing uses the pipeline.
        unsafe {
            raw.destroy_pipeline(self.pipeline, None);
            raw.destroy_pipeline_layout(self.layout, None);
            raw.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}
