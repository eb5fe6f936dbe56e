//! Continuing with an edited scene: what has to be done again follows from the parts that have changed.

use super::Engine;
use super::host::check;
use crate::error::{Error, Result, unless_refused};
use crate::render::{Changes, Derived, GpuScene, Plan, Variant};
use crate::scene::Scene;

/// How much of the work done so far outlives an edit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[must_use = "an edit that is impossible in place has changed nothing"]
pub enum Changed {
    /// All of it: the scene is the same.
    Nothing,
    /// All of it; only the conversion of the picture for a display has changed.
    Display,
    /// The cached light, if there is any; the picture begins anew.
    Picture,
    /// Compiled passes and memory only.
    Light,
    /// Nothing: other passes or other memory are needed, and the engine still has the scene that it had.
    Impossible,
}

impl Changed {
    /// For edits that need neither other passes nor other memory: fails if this one does.
    pub fn must_be_possible(self) -> Result<()> {
        match self {
            Changed::Impossible => Err(Error::value(
                "the engine cannot show the edited scene with the passes and the memory that it has",
            )),
            _ => Ok(()),
        }
    }
}

impl Engine {
    /// Continues with another scene, if the existing passes can show it within the planned memory. After an error the engine
    /// may have changed half way, and can only be dropped.
    pub fn change_in_place(&mut self, scene: &Scene) -> Result<Changed> {
        check(scene)?;
        let next = self.full.changed_to(scene, &self.volume);
        let changes = next.changes_from(&self.full);
        if !changes.invalidates(Derived::Picture) {
            self.scene = scene.clone();
            self.full = next;
            return Ok(if changes.invalidates(Derived::Display) {
                Changed::Display
            } else {
                Changed::Nothing
            });
        }
        match self.fitted(next, changes)? {
            Some(next) if self.make_room_for(&next)? => self.adopt(scene, next),
            _ => Ok(Changed::Impossible),
        }
    }

    /// The next scene with a layout of the cache that fits it; `None` if the passes that there are cannot show it.
    fn fitted(&self, next: GpuScene, changes: Changes) -> Result<Option<GpuScene>> {
        // The baseline's cells and their majorant are made for one medium under one light.
        let is_published = self.full.variant == Variant::Published;
        let may_cache_now = next.has_scattered_light() && !self.full.has_scattered_light();
        if changes.invalidates(Derived::Plan)
            || may_cache_now && self.full.variant == Variant::NonCaching
            || is_published && changes.invalidates(Derived::NodePaths)
        {
            return Ok(None);
        }
        let next = if changes.invalidates(Derived::CacheLayout) {
            unless_refused(next.refitted(&self.volume, self.host.summary().max_image_3d))?
        } else {
            Some(next)
        };
        Ok(next.filter(|next| self.full.passes_serve(next)))
    }

    /// Goes on with a scene for which there are passes and memory.
    fn adopt(&mut self, scene: &Scene, next: GpuScene) -> Result<Changed> {
        let has_new_layout = next.variant != self.full.variant;
        let mut lasts = true;
        if has_new_layout && pixels(&next) > pixels(&self.full) {
            // A cache that shrinks gives way before the picture grows: the budget may not hold both.
            lasts = self
                .renderer
                .change(&next.reduced_to(self.renderer.size()))?;
        }
        // While a picture is temporarily rendered with fewer pixels (`reduce_to`), its size is kept.
        let size = if next.parts.view.size == self.full.parts.view.size {
            self.renderer.size()
        } else {
            self.renderer.resize(next.parts.view.size)?;
            next.parts.view.size
        };
        self.scene = scene.clone();
        self.full = next;
        self.samples_ahead = None;
        self.seconds_per_sample = f64::INFINITY;
        lasts &= self.renderer.change(&self.full.reduced_to(size))?;
        if has_new_layout && let Some(mut caching) = self.renderer.caching() {
            caching.guess_light()?;
        }
        Ok(if lasts {
            Changed::Picture
        } else {
            Changed::Light
        })
    }

    /// Plans for `next` where it may need other memory, and adopts that plan if it is within the budget. Returns whether there
    /// is room.
    fn make_room_for(&mut self, next: &GpuScene) -> Result<bool> {
        if next.takes_memory_of(&self.full) {
            return Ok(true);
        }
        let Some(plan) = unless_refused(self.plan_for(next))? else {
            return Ok(false);
        };
        let fits = plan.bytes() + self.reserved <= self.memory.budget;
        if fits {
            self.choice.plan = plan;
        }
        Ok(fits)
    }

    fn plan_for(&self, scene: &GpuScene) -> Result<Plan> {
        Plan::new(self.host.device(), self.host.summary(), scene)
    }

    /// Whether the budget and the device's limits allow pictures of another size beside `reserved` bytes for something else.
    pub fn has_room_for(&self, size: [u32; 2], reserved: u64) -> Result<bool> {
        let plan = unless_refused(self.plan_for(&self.full.reduced_to(size)))?;
        Ok(plan.is_some_and(|plan| plan.bytes() + reserved <= self.memory.budget))
    }

    /// Sets bytes of the budget aside for something else.
    pub fn reserve(&mut self, bytes: u64) {
        self.reserved = bytes;
    }

    pub fn reserved(&self) -> u64 {
        self.reserved
    }

    /// Renders the same picture with fewer pixels from now on, at least one, or with all of them again. [`picture`](Engine::picture),
    /// [`sums`](Engine::sums), [`march`](Engine::march) and [`resume`](Engine::resume) go back to all, which drops the samples of
    /// fewer.
    pub fn reduce_to(&mut self, size: [u32; 2]) -> Result<()> {
        if self.renderer.size() != size {
            self.renderer.change(&self.full.reduced_to(size))?;
        }
        Ok(())
    }
}

fn pixels(scene: &GpuScene) -> u64 {
    scene.parts.view.size.map(u64::from).iter().product()
}
