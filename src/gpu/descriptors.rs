//! Descriptor sets that live as long as one submission.
//!
//! A command binds its resources through a set that is allocated and written while the frame is recorded, and given
//! back with all others when the frame is recorded again: a set has no life of its own to keep track of. Pools are
//! added when a frame needs more sets than ever before, and kept. Push descriptors would save the pools, but they are
//! an extension that not every driver has, and on those that do a dispatch costs the same either way.

use std::sync::Arc;

use ash::vk;

use super::device::Device;

/// Capacity of a pool. A set of any pipeline fits into an empty one.
const SETS: u32 = 64;
const DESCRIPTORS: [(vk::DescriptorType, u32); 3] = [
    (vk::DescriptorType::STORAGE_BUFFER, 8 * SETS),
    (vk::DescriptorType::STORAGE_IMAGE, 4 * SETS),
    (vk::DescriptorType::COMBINED_IMAGE_SAMPLER, 4 * SETS),
];

pub(super) struct DescriptorSets {
    device: Arc<Device>,
    pools: Vec<vk::DescriptorPool>,
    /// The pool that sets are taken from; those before it are full, those behind it empty.
    current: usize,
}

impl DescriptorSets {
    pub fn new(device: &Arc<Device>) -> DescriptorSets {
        DescriptorSets {
            device: device.clone(),
            pools: Vec::new(),
            current: 0,
        }
    }

    /// Takes all sets back; the device must have finished with them.
    pub fn reset(&mut self) -> Result<(), vk::Result> {
        for &pool in &self.pools {
            let flags = vk::DescriptorPoolResetFlags::empty();
            // SAFETY: the submission that used the sets has been waited for.
            unsafe { self.device.raw.reset_descriptor_pool(pool, flags) }?;
        }
        self.current = 0;
        Ok(())
    }

    /// A set whose descriptors are not written yet, valid until the next reset.
    pub fn take(
        &mut self,
        layout: vk::DescriptorSetLayout,
    ) -> Result<vk::DescriptorSet, vk::Result> {
        loop {
            let is_new = self.current == self.pools.len();
            if is_new {
                self.add_pool()?;
            }
            match self.allocate(layout) {
                Err(vk::Result::ERROR_OUT_OF_POOL_MEMORY | vk::Result::ERROR_FRAGMENTED_POOL)
                    if !is_new =>
                {
                    self.current += 1;
                }
                done => return done,
            }
        }
    }

    fn add_pool(&mut self) -> Result<(), vk::Result> {
        let sizes = DESCRIPTORS.map(|(kind, count)| {
            vk::DescriptorPoolSize::default()
                .ty(kind)
                .descriptor_count(count)
        });
        let info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(SETS)
            .pool_sizes(&sizes);
        // SAFETY: `info` is valid; destroyed in Drop.
        let pool = unsafe { self.device.raw.create_descriptor_pool(&info, None) }?;
        self.pools.push(pool);
        Ok(())
    }

    fn allocate(&self, layout: vk::DescriptorSetLayout) -> Result<vk::DescriptorSet, vk::Result> {
        let layouts = [layout];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(self.pools[self.current])
            .set_layouts(&layouts);
        // SAFETY: pool and layout are alive; the frame alone uses the pool.
        Ok(unsafe { self.device.raw.allocate_descriptor_sets(&info) }?[0])
    }
}

impl Drop for DescriptorSets {
    fn drop(&mut self) {
        for &pool in &self.pools {
            // SAFETY: frames wait for what they submit, so no set is in use.
            unsafe { self.device.raw.destroy_descriptor_pool(pool, None) };
        }
    }
}
