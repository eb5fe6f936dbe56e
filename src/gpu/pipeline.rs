//! A pipeline and the layouts that it was made for; `bindings.rs` binds its resources.

use std::sync::Arc;

use ash::vk;

use super::device::Device;

pub(super) struct Pipeline {
    device: Arc<Device>,
    pub set_layout: vk::DescriptorSetLayout,
    pub layout: vk::PipelineLayout,
    pub raw: vk::Pipeline,
}

impl Pipeline {
    /// A pipeline whose `stages` take these bindings and `push_bytes` of push constants; `make` creates it from its
    /// layout.
    pub fn new(
        device: &Arc<Device>,
        stages: vk::ShaderStageFlags,
        bindings: impl IntoIterator<Item = (u32, vk::DescriptorType)>,
        push_bytes: u32,
        make: impl FnOnce(vk::PipelineLayout) -> Result<vk::Pipeline, vk::Result>,
    ) -> Result<Pipeline, vk::Result> {
        let mut pipeline = Pipeline {
            device: device.clone(),
            set_layout: vk::DescriptorSetLayout::null(),
            layout: vk::PipelineLayout::null(),
            raw: vk::Pipeline::null(),
        };
        let bindings: Vec<_> = bindings
            .into_iter()
            .map(|(binding, kind)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding)
                    .descriptor_type(kind)
                    .descriptor_count(1)
                    .stage_flags(stages)
            })
            .collect();
        let set = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: `set` is valid; destroyed in Drop.
        pipeline.set_layout = unsafe { device.raw.create_descriptor_set_layout(&set, None) }?;
        let sets = [pipeline.set_layout];
        let ranges = [vk::PushConstantRange::default()
            .stage_flags(stages)
            .size(push_bytes)];
        let layout = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(&sets)
            .push_constant_ranges(match push_bytes {
                0 => &[],
                _ => &ranges,
            });
        // SAFETY: the set layout is alive; destroyed in Drop.
        pipeline.layout = unsafe { device.raw.create_pipeline_layout(&layout, None) }?;
        pipeline.raw = make(pipeline.layout)?;
        Ok(pipeline)
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        let raw = &self.device.raw;
        // SAFETY: a recording borrows the pipeline until its work has ended, so nothing uses it.
        unsafe {
            raw.destroy_pipeline(self.raw, None);
            raw.destroy_pipeline_layout(self.layout, None);
            raw.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}
