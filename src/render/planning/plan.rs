//! What a render will take of the GPU's memory, before anything is allocated: a dry run of the statements that allocate.

use std::sync::Arc;

use crate::error::Result;
use crate::gpu::{Device, DeviceSummary, Memory, ResourceBytes};
use crate::render::allocation::Allocation;
use crate::render::gpu_scene::GpuScene;
use crate::render::layout::BrickLayout;
use crate::render::variant::Variant;

/// Every resource and its bytes, in order of allocation; all are alive at once.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Plan {
    pub resources: Vec<ResourceBytes>,
    #[serde(skip)]
    pub variant: Variant,
    /// How the volume is cut into bricks, if it does not fit.
    #[serde(skip)]
    pub bricks: Option<BrickLayout>,
}

/// The variant to render with, and why.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    pub plan: Plan,
    /// Why, as the end of a sentence: "caching, because …".
    pub reason: String,
    /// What the next better variant would need.
    pub next_better: String,
}

impl Plan {
    /// Plans a scene. Fails where the device's limits, not its free memory, are in the way.
    pub fn new(device: &Arc<Device>, limits: &DeviceSummary, scene: &GpuScene) -> Result<Plan> {
        let dry_run = Memory::dry_run(device, limits.clone());
        Allocation::make(&dry_run, scene)?;
        Ok(Plan {
            resources: dry_run.resources_at_peak(),
            variant: scene.variant.clone(),
            bricks: scene.bricks,
        })
    }

    pub fn bytes(&self) -> u64 {
        self.resources.iter().map(|r| r.bytes).sum()
    }
}
