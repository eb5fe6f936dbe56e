//! The device that renders, and how much of its memory may be used.

use std::sync::Arc;

use super::budget::{self, Budget, Limit};
use super::host_memory;
use super::picture::Picture;
use crate::error::{DeviceError, Error, Location, Result};
use crate::gpu::{Device, DeviceChoice, DeviceSummary, Memory, Shaders, Validation};
use crate::render::shared;
use crate::render::{Choice, GpuScene, Peak, Plan, Planner, needed_bricks, peak};
use crate::scene::volume::Volume;
use crate::scene::{Scene, surface};

/// Which device to open, and how. By default the best one, with as much memory as its driver leaves.
#[derive(Debug, Clone, Default)]
pub struct HostOptions {
    /// The device's name, a part of it, or its index in `isolume info`.
    pub device: Option<String>,
    pub vram_budget: Option<Limit>,
    /// The most host memory for voxels where the volume streams; by default half of what is free
    /// beside the budget of a device that is a CPU.
    pub ram_budget: Option<Limit>,
    /// Whether Vulkan's validation layers watch; [`Host::check_validation`] returns what they have found.
    pub validation: bool,
}

/// An open device with a budget, all of which each engine may take: drop one before making another, or give each a host with
/// its share. Clones share the device.
#[derive(Clone)]
pub struct Host {
    device: Arc<Device>,
    budget: Budget,
    /// Bytes of the host's memory that were free when the device was opened.
    free: u64,
    /// Those of them that are for voxels.
    ram_budget: u64,
}

impl Host {
    /// Fails where there is no usable Vulkan device.
    pub fn open(options: &HostOptions) -> Result<Host> {
        Ok(Host::with_device(
            Device::open(&options.device_choice())?,
            options.vram_budget,
            options.ram_budget,
        ))
    }

    pub(crate) fn with_device(
        device: Arc<Device>,
        vram_budget: Option<Limit>,
        ram_budget: Option<Limit>,
    ) -> Host {
        let free = host_memory::free();
        let budget = Budget::of(&device, vram_budget, free);
        Host {
            ram_budget: budget::of_host(ram_budget, free, device.summary.kind, &budget),
            free,
            budget,
            device,
        }
    }

    /// The device's name and limits.
    pub fn summary(&self) -> &DeviceSummary {
        &self.device.summary
    }

    pub fn budget(&self) -> &Budget {
        &self.budget
    }

    /// Bytes of the host's memory for voxels, where the volume streams.
    pub fn ram_budget(&self) -> u64 {
        self.ram_budget
    }

    /// The variant that the scene gets, the reason, and every byte that it will take. Allocates nothing. Fails where
    /// not even the smallest variant fits, or where the one that the scene asks for does not.
    pub fn plan(&self, volume: &Volume, scene: &Scene) -> Result<Choice> {
        self.plan_beside(volume, scene, 0)
    }

    /// Volume bricks in which the medium scatters or a surface shows.
    pub fn needed_bricks(&self, volume: &Volume, scene: &Scene) -> u32 {
        needed_bricks(&GpuScene::new(scene, volume, 0), volume)
    }

    /// Fails where the host has too little memory for the picture of this size that a plan for the volume is for, without or
    /// with the sums behind it.
    pub fn check_picture(
        &self,
        volume: &Volume,
        plan: &Plan,
        size: [u32; 2],
        with_sums: bool,
    ) -> Result<()> {
        let kind = self.device.summary.kind;
        let of_device = if kind.shares_host_memory() {
            plan.bytes()
        } else {
            0
        };
        let of_bricks = plan.bricks.as_ref().map_or(0, |layout| {
            let all = u64::from(layout.total()) * layout.brick_bytes(volume.stored.bytes());
            all.min(self.ram_budget)
        });
        let bytes = Picture::host_bytes(size, with_sums);
        let planned = of_device.saturating_add(of_bricks);
        Ok(host_memory::check_picture(size, bytes, self.free, planned)?)
    }

    /// Plans with `reserved` bytes of the budget in use for something else.
    pub(crate) fn plan_beside(
        &self,
        volume: &Volume,
        scene: &Scene,
        reserved: u64,
    ) -> Result<Choice> {
        check(scene)?;
        let budget = self.budget.bytes.saturating_sub(reserved);
        self.planner(budget, volume, scene).choose()
    }

    /// The caches that are worth a trial for a scene that leaves the variant open and has got this plan.
    pub(crate) fn caches(
        &self,
        volume: &Volume,
        scene: &Scene,
        choice: &Choice,
    ) -> Result<Vec<Choice>> {
        self.planner(self.budget.bytes, volume, scene)
            .caches(choice)
    }

    fn planner<'a>(&'a self, budget: u64, volume: &'a Volume, scene: &'a Scene) -> Planner<'a> {
        Planner::new(&self.device, &self.device.summary, budget, volume, scene)
    }

    /// The device's peak rates, measured now, in a few tenths of a second and in 34 MB of its memory; fails if the budget is
    /// smaller. On a CPU that other programs use as well, a render takes longer than alone, while the fastest of many short
    /// dispatches hardly does: shares of the peak are then too low.
    pub fn peak(&self) -> Result<Peak> {
        peak(
            &self.device,
            &Shaders::new(shared::glsl()),
            self.budget.bytes,
        )
    }

    /// A gate for memory within the budget.
    pub(crate) fn memory(&self) -> Result<Arc<Memory>> {
        Memory::new(&self.device, self.budget.bytes)
    }

    pub(crate) fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// Fails with the first message of Vulkan's validation layers, if they are on and have found anything.
    pub fn check_validation(&self) -> Result<()> {
        match self.device.validation_messages().first() {
            Some(message) => Err(DeviceError::Validation(message.clone()).into()),
            None => Ok(()),
        }
    }
}

impl HostOptions {
    pub(crate) fn device_choice(&self) -> DeviceChoice {
        DeviceChoice {
            wanted: self.device.clone(),
            validation: Validation::when(self.validation),
            ..DeviceChoice::default()
        }
    }
}

/// Fails for a scene with more surfaces than a path can keep track of, for a cache in which light would have a number of
/// bounces, and for a picture without pixels.
pub(super) fn check(scene: &Scene) -> Result<()> {
    if scene.render.size.contains(&0) {
        return Err(Error::value("a picture has at least 1x1 pixels"));
    }
    if let Some(conflict) = scene.render.conflict() {
        return Err(Error::input(
            Location::default().with_key("render.max_bounces"),
            conflict,
        ));
    }
    if let Some(excess) = surface::excess(scene.surfaces.iso.len()) {
        return Err(Error::input(
            Location::default().with_key("surfaces.iso"),
            excess,
        ));
    }
    Ok(())
}
