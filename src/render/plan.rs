//! What a render will take of the GPU's memory, before anything is allocated: a dry run of the
//! statements that allocate it.

use std::sync::Arc;

use super::constants::SceneBuffers;
use super::resources::Resources;
use crate::error::Result;
use crate::gpu::{Device, Memory, ResourceBytes};
use crate::scene::Scene;
use crate::scene::volume::Volume;

/// Every resource and its bytes, in order of allocation; all are alive at once.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Plan {
    pub resources: Vec<ResourceBytes>,
}

impl Plan {
    /// Fails where the device's limits, not its free memory, are in the way.
    pub fn new(device: &Arc<Device>, volume: &Volume, scene: &Scene) -> Result<Plan> {
        let dry_run = Memory::dry_run(device, u64::MAX);
        Resources::allocate(&dry_run, volume, &SceneBuffers::unprobed(scene, volume))?;
        Ok(Plan {
            resources: dry_run.resources(),
        })
    }

    pub fn bytes(&self) -> u64 {
        self.resources.iter().map(|r| r.bytes).sum()
    }
}
