//! What to render with: the best variant that stays within a budget and within the device's limits, with the volume whole, or
//! else in bricks.

mod in_bricks;
mod ladder;
mod plan;
mod refusal;
mod whole;

pub use plan::{Choice, Plan};

use std::sync::Arc;

use super::gpu_scene::GpuScene;
use super::parts::transfer_extent;
use crate::error::{Error, Location, Result};
use crate::gpu::{Device, DeviceSummary};
use crate::scene::volume::Volume;
use crate::scene::{Scene, Variant};
use in_bricks::InBricks;

/// What is planned for.
pub struct Planner<'a> {
    device: &'a Arc<Device>,
    /// Those of the device; in tests, also those of devices that are not at hand.
    limits: &'a DeviceSummary,
    /// Bytes of the GPU's memory.
    budget: u64,
    volume: &'a Volume,
    scene: &'a Scene,
    uncached: GpuScene,
}

impl<'a> Planner<'a> {
    pub fn new(
        device: &'a Arc<Device>,
        limits: &'a DeviceSummary,
        budget: u64,
        volume: &'a Volume,
        scene: &'a Scene,
    ) -> Planner<'a> {
        Planner {
            device,
            limits,
            budget,
            volume,
            scene,
            uncached: GpuScene::new(scene, volume, 0),
        }
    }

    /// The best variant that fits.
    pub fn choose(&self) -> Result<Choice> {
        self.check_points()?;
        match self.choose_whole() {
            Err(Error::Memory(why)) if self.scene.render.variant != Variant::Published => {
                let in_bricks = InBricks::new(self);
                match in_bricks.choose(&self.need_of_whole(&why))? {
                    Some(choice) => Ok(choice),
                    None => Err(in_bricks.refusal()?.unwrap_or(why).into()),
                }
            }
            other => other,
        }
    }

    /// The caches that are worth comparing on the device where [`choose`](Planner::choose) has chosen a plan: the one of that
    /// plan, or where the volume is in bricks, several.
    pub fn caches(&self, chosen: &Choice) -> Result<Vec<Choice>> {
        match (chosen.plan.bricks, chosen.plan.variant.cache()) {
            (Some(_), _) => InBricks::new(self).compared(&chosen.next_better),
            (None, Some(_)) => Ok(vec![chosen.clone()]),
            (None, None) => Ok(Vec::new()),
        }
    }

    /// Fails for a transfer function whose points are more than the device's images have columns, however much memory there is.
    fn check_points(&self) -> Result<()> {
        let points = self.uncached.parts.medium.transfer.len();
        let [columns, _] = transfer_extent(points);
        let (device, widest) = (&self.limits.name, self.limits.max_image_2d);
        if columns <= widest {
            return Ok(());
        }
        Err(Error::input(
            Location::default().with_key("medium.transfer"),
            format!(
                "found {points} points at values of the volume, expected at most {}, since images on {device} are {widest} texels wide at most",
                widest - 1
            ),
        ))
    }

    fn plan(&self, scene: &GpuScene) -> Result<Plan> {
        Plan::new(self.device, self.limits, scene)
    }
}
