//! Binding resources for the commands that are recorded.

use ash::vk;

use super::frame::Frame;
use super::pipeline::Pipeline;
use super::recording::Recording;

impl<'r> Recording<'_, 'r> {
    /// Binds the resources that `writes` describe for the commands that follow. They must be all that the pipeline
    /// takes and borrowed for `'r`, which a write cannot say; their destination set is filled in here.
    pub(super) fn bind_resources(
        &mut self,
        point: vk::PipelineBindPoint,
        pipeline: &'r Pipeline,
        writes: &mut [vk::WriteDescriptorSet<'_>],
    ) -> Result<(), vk::Result> {
        let Frame {
            device,
            commands,
            sets,
            ..
        } = &mut *self.frame;
        let set = sets.take(pipeline.set_layout)?;
        for write in writes.iter_mut() {
            write.dst_set = set;
        }
        let raw = &device.raw;
        // SAFETY: the set is new, so no command uses it; the layout is the one that it was allocated for, and the
        // resources are borrowed until the submission's work has ended.
        unsafe {
            raw.update_descriptor_sets(writes, &[]);
            raw.cmd_bind_descriptor_sets(*commands, point, pipeline.layout, 0, &[set], &[]);
        }
        Ok(())
    }
}
