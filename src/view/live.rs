//! The scene on the GPU: the renderer, and what it was last told. A change of the scene goes through
//! [`Live::follow`], which says whether the cache outlived it, or that other passes are needed.

use std::sync::Arc;

use super::load::Document;
use super::picture::Picture;
use crate::error::{Error, Result};
use crate::gpu::Memory;
use crate::render::{Choice, Plan, Renderer, SceneBuffers, choose};
use crate::scene::{Scene, Variant};

/// What a renderer is made for.
pub struct Order {
    pub memory: Arc<Memory>,
    /// Its size is that of the picture.
    pub scene: Scene,
    pub seed: u32,
    /// Samples a pixel of a picture at rest, at most.
    pub samples: u32,
    /// Bytes that the window takes.
    pub for_window: u64,
}

pub struct Live {
    pub renderer: Renderer,
    pub choice: Choice,
    pub picture: Picture,
    /// What the GPU shows, with all pixels.
    pub scene: Scene,
    full: SceneBuffers,
    /// What the GPU was told, which may have fewer.
    told: SceneBuffers,
    memory: Arc<Memory>,
    /// Bytes that the window takes.
    pub for_window: u64,
}

/// What became of the cache when the scene changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Followed {
    Kept,
    Cleared,
    /// Other passes have to be compiled.
    Impossible,
}

impl Live {
    pub fn build(order: Order, document: &Document) -> Result<Live> {
        let Order {
            memory,
            scene,
            seed,
            samples,
            for_window,
        } = order;
        if scene.render.variant == Variant::Published {
            return Err(Error::input(
                "render.variant: found \"published\", a baseline that `isolume render` measures \
                 against; the window shows \"auto\", \"caching\" and \"non-caching\"",
            ));
        }
        let volume = &document.opened.volume;
        let device = memory.device();
        let budget = memory.budget.saturating_sub(for_window);
        let choice = choose(device, &device.summary, budget, volume, &scene)?;
        let mut buffers = SceneBuffers::new(device, &scene, volume, seed)?;
        if let Some(layout) = &choice.plan.cache {
            buffers = buffers.with_cache(layout.clone());
        }
        let mut renderer = Renderer::new(&memory, volume, &buffers)?;
        renderer.guess_light(&buffers)?;
        Ok(Live {
            picture: Picture::new(&renderer, &device.summary, samples),
            for_window,
            renderer,
            choice,
            scene,
            told: buffers.clone(),
            full: buffers,
            memory,
        })
    }

    /// Brings the GPU up to `scene`, whose picture has the size of now.
    pub fn follow(&mut self, scene: &Scene, document: &Document) -> Result<Followed> {
        if self.differs_in_tone_alone(scene) {
            self.scene = scene.clone();
            self.picture.is_toned_otherwise = true;
            return Ok(Followed::Kept);
        }
        let Some(next) = self.next(scene, document)? else {
            return Ok(Followed::Impossible);
        };
        if next.cache != self.full.cache || next.transfer.len() != self.full.transfer.len() {
            let plan = self.plan(&next, document)?;
            if plan.bytes() + self.for_window > self.memory.budget {
                return Ok(Followed::Impossible);
            }
            self.choice.plan = plan;
        }
        let has_new_cache = next.cache != self.full.cache;
        self.scene = scene.clone();
        self.full = next;
        let lasts = self.tell(self.full.reduced_to(self.told.constants.size))?;
        if has_new_cache {
            self.renderer.guess_light(&self.full)?;
        }
        self.picture.restart();
        Ok(match lasts {
            true => Followed::Kept,
            false => Followed::Cleared,
        })
    }

    fn differs_in_tone_alone(&self, scene: &Scene) -> bool {
        let mut same = self.scene.clone();
        same.render.exposure = scene.render.exposure;
        same.render.tone = scene.render.tone;
        same == *scene
    }

    /// The scene for the GPU, if the passes that there are can show it.
    fn next(&self, scene: &Scene, document: &Document) -> Result<Option<SceneBuffers>> {
        let elsewhere = Scene {
            camera: scene.camera,
            ..self.scene.clone()
        };
        if *scene == elsewhere {
            return Ok(Some(self.full.seen_by(&scene.camera)));
        }
        let settings = |s: &Scene| {
            let r = &s.render;
            (r.variant, r.cache_scale, r.cache_format, r.max_bounces)
        };
        let volume = &document.opened.volume;
        let next = self.full.changed_to(scene, volume);
        if next.features != self.full.features
            || next.environment != self.full.environment
            || settings(scene) != settings(&self.scene)
        {
            return Ok(None);
        }
        let most_texels = self.memory.device().summary.max_image_3d;
        next.refitted(volume, most_texels).map(Some)
    }

    fn plan(&self, buffers: &SceneBuffers, document: &Document) -> Result<Plan> {
        let device = self.memory.device();
        let volume = &document.opened.volume;
        Plan::of(device, &device.summary, volume, buffers)
    }

    /// Whether the budget allows pictures of another size, with what the window takes then.
    pub fn has_room_for(
        &self,
        size: [u32; 2],
        for_window: u64,
        document: &Document,
    ) -> Result<bool> {
        let plan = self.plan(&self.full.reduced_to(size), document)?;
        Ok(plan.bytes() + for_window <= self.memory.budget)
    }

    /// Makes pictures of another size from now on.
    pub fn resize(&mut self, size: [u32; 2], for_window: u64, document: &Document) -> Result<()> {
        self.scene.render.size = size;
        self.full = self.full.reduced_to(size).seen_by(&self.scene.camera);
        self.choice.plan = self.plan(&self.full, document)?;
        self.for_window = for_window;
        self.renderer.resize(size)?;
        self.tell(self.full.clone())?;
        self.picture.restart();
        Ok(())
    }

    /// Bytes planned for all that there is, the window included.
    pub fn planned_bytes(&self) -> u64 {
        self.choice.plan.bytes() + self.for_window
    }

    /// Tells the GPU of the same scene with fewer pixels, or with all of them again.
    pub fn reduce_to(&mut self, size: [u32; 2]) -> Result<()> {
        if self.told.constants.size != size {
            self.tell(self.full.reduced_to(size))?;
        }
        Ok(())
    }

    fn tell(&mut self, buffers: SceneBuffers) -> Result<bool> {
        let lasts = self.renderer.change(&self.told, &buffers)?;
        self.told = buffers;
        Ok(lasts)
    }
}
