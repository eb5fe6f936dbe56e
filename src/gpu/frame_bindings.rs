//! Binding resources for the commands that a frame records.

use ash::vk;

use super::frame::Frame;
use super::pipeline::Pipeline;

impl Frame {
    /// Binds the resources that `writes` describe for the commands that follow. They must be all that the pipeline
    /// takes; their destination set is filled in here.
    pub(super) fn bind_resources(
        &mut self,
        point: vk::PipelineBindPoint,
        pipeline: &Pipeline,
        writes: &mut [vk::WriteDescriptorSet<'_>],
    ) -> Result<(), vk::Result> {
        let set = self.sets.take(pipeline.set_layout)?;
        for write in writes.iter_mut() {
            write.dst_set = set;
        }
        let raw = &self.device.raw;
        // SAFETY: the set is new, so no command uses it; the layout is the one that it was allocated for, and the
        // resources outlive the submission, which `run` waits for.
        unsafe {
            raw.update_descriptor_sets(writes, &[]);
            raw.cmd_bind_descriptor_sets(self.commands, point, pipeline.layout, 0, &[set], &[]);
        }
        Ok(())
    }
}
