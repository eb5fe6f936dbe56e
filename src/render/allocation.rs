//! All GPU memory of a render, in order of allocation. A plan is a dry run of this.

use std::sync::Arc;

use super::estimator::VariantMemory;
use super::gpu_scene::GpuScene;
use super::picture::iso_depth::FirstSurface;
use super::resources::Resources;
use crate::error::Result;
use crate::gpu::Memory;

pub struct Allocation {
    pub resources: Resources,
    pub first_surface: Option<FirstSurface>,
    pub variant: VariantMemory,
}

impl Allocation {
    pub fn make(memory: &Arc<Memory>, scene: &GpuScene) -> Result<Allocation> {
        Ok(Allocation {
            resources: Resources::allocate(memory, scene)?,
            first_surface: FirstSurface::allocate(memory, scene)?,
            variant: VariantMemory::allocate(memory, scene)?,
        })
    }
}

impl GpuScene {
    /// Whether it takes the same memory as `other`, a scene of the same volume: all sizes follow from these parts.
    pub fn takes_memory_of(&self, other: &GpuScene) -> bool {
        let points = |scene: &GpuScene| scene.parts.medium.transfer.len();
        self.variant == other.variant
            && points(self) == points(other)
            && self.parts.view.size == other.parts.view.size
    }
}
