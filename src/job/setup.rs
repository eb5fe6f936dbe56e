//! From an opened scene to a renderer that has it on the GPU: the device, the plan, the memory.

use std::sync::Arc;

use super::device_choice;
use super::plan::Budget;
use super::report::{self, Clock};
use crate::cli::GpuArgs;
use crate::error::{Error, Result};
use crate::gpu::{Device, Memory};
use crate::output::stats::MemoryStats;
use crate::render::{Choice, Renderer, SceneBuffers, choose};
use crate::scene::volume::Volume;
use crate::scene::{Camera, Scene};

/// The device and how much of its memory may be used.
pub struct Host {
    pub device: Arc<Device>,
    pub budget: Budget,
}

impl Host {
    pub fn open(args: &GpuArgs) -> Result<Host> {
        let device = Device::open(&device_choice(args.device.as_ref()))?;
        let budget = Budget::of(&device, args.vram_budget);
        Ok(Host { device, budget })
    }

    /// The variant that the scene gets. Allocates nothing.
    pub fn choose(&self, volume: &Volume, scene: &Scene) -> Result<Choice> {
        let limits = &self.device.summary;
        choose(&self.device, limits, self.budget.bytes, volume, scene)
    }

    pub fn load(
        &self,
        volume: &Volume,
        scene: &Scene,
        choice: Choice,
        seed: u32,
        clock: &mut Clock,
    ) -> Result<Loaded> {
        let (memory, mut buffers) = clock.time("prepare the scene", || -> Result<_> {
            let memory = Memory::new(&self.device, self.budget.bytes)?;
            let buffers = SceneBuffers::new(&self.device, scene, volume, seed)?;
            Ok((memory, buffers))
        })?;
        if let Some(layout) = &choice.plan.cache {
            buffers = buffers.with_cache(layout.clone());
        }
        let renderer = clock.time("compile and upload", || {
            Renderer::new(&memory, volume, &buffers)
        })?;
        clock.part("compile", renderer.compiling);
        Ok(Loaded {
            choice,
            memory,
            buffers,
            renderer,
        })
    }

    /// The same, with nothing left to compile, for measurements.
    pub fn load_warm(
        &self,
        volume: &Volume,
        scene: &Scene,
        choice: Choice,
        seed: u32,
    ) -> Result<Loaded> {
        let mut loaded = self.load(volume, scene, choice, seed, &mut Clock::new())?;
        loaded.renderer.warm_up()?;
        Ok(loaded)
    }

    /// Validation is only on where somebody wants to know: any message is an error then.
    pub fn check_validation(&self) -> Result<()> {
        match self.device.validation_messages().first() {
            Some(message) => Err(Error::Device(format!("Vulkan validation: {message}"))),
            None => Ok(()),
        }
    }
}

/// A scene on the GPU.
pub struct Loaded {
    pub choice: Choice,
    pub memory: Arc<Memory>,
    pub buffers: SceneBuffers,
    pub renderer: Renderer,
}

impl Loaded {
    /// Goes on with the same scene from elsewhere.
    pub fn look_from(&mut self, camera: &Camera) -> Result<()> {
        let next = self.buffers.seen_by(camera);
        self.renderer.change(&self.buffers, &next)?;
        self.buffers = next;
        Ok(())
    }

    /// Goes on with an edited scene that the same passes can show.
    pub fn edit(&mut self, scene: &Scene, volume: &Volume) -> Result<()> {
        let most_texels = self.memory.limits.max_image_3d;
        let next = self.buffers.changed_to(scene, volume);
        let next = next.refitted(volume, most_texels)?;
        self.renderer.change(&self.buffers, &next)?;
        self.buffers = next;
        Ok(())
    }

    pub fn memory_stats(&self) -> MemoryStats {
        report::memory(&self.memory, self.choice.plan.bytes())
    }
}
