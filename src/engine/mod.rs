//! The one type that a program drives: open a volume, resolve a scene, plan, fill a cache, take samples, change the
//! scene, read picture and figures. The command line and the window are both built on it.

mod batches;
mod budget;
mod change;
mod estimates;
pub mod figures;
mod filling;
mod first_samples;
mod forecast;
mod host;
mod host_memory;
mod picture;
mod progressive;
mod refinement;
mod run;
mod sample_range;
mod saved_light;
mod schedule;
mod setup;
mod slices;
mod stop;
mod stopwatch;
mod task;
mod trial;
mod unseen;
mod verdict;

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::error::Result;
use crate::gpu::{Memory, Timings};
use crate::render::{Film, GpuScene, Renderer, Totals, needed_bricks};
use crate::scene::Scene;
use crate::scene::volume::Volume;
use figures::{BrickStats, CacheStats, MemoryStats};
use filling::SamplesAhead;

pub use batches::cache_goal;
pub use budget::{Budget, BudgetSource, Limit};
pub use change::Changed;
pub use host::{Host, HostOptions};
pub use picture::{Picture, relative_error};
pub use progressive::{ProgressivePicture, SHOWN_CACHE_ERROR};
pub use refinement::Refinement;
pub use run::{Outcome, Progress, Run};
pub use sample_range::SampleRange;
pub use saved_light::SavedLight;
pub use setup::Setup;
pub use stop::{Sampled, Samples, Stop, StopReason};
pub use stopwatch::Stopwatch;
pub use task::Task;
pub use trial::{Trial, Tried};

// What the engine's users see of the renderer.
pub use crate::render::{
    Batch, BrickFigures, BrickLayout, Choice, Peak, Plan, RAYS_PER_PIXEL, Sums, next_batch_size,
};

/// A scene on a device, and the picture of it so far.
pub struct Engine {
    host: Host,
    volume: Volume,
    /// The scene that is rendered.
    scene: Scene,
    /// The scene for the GPU, with all pixels; the renderer may have a version with fewer.
    full: GpuScene,
    renderer: Renderer,
    choice: Choice,
    seed: u32,
    /// Bytes of the budget that are set aside for something else.
    reserved: u64,
    samples_ahead: Option<SamplesAhead>,
    /// Seconds that a sample of every pixel took last; infinite while it is unknown.
    seconds_per_sample: f64,
    memory: Arc<Memory>,
}

impl Engine {
    /// Plans the scene and brings it onto the GPU. `seed` decides the random numbers: the same seed gives the same bits on
    /// the same device.
    ///
    /// # Errors
    ///
    /// If the scene cannot be rendered (it has no pixels, too many surfaces or settings that contradict each other), if no
    /// variant fits the budget or the device's limits, if the volume cannot be read, or if the device fails.
    pub fn new(host: &Host, volume: &Volume, scene: &Scene, seed: u32) -> Result<Engine> {
        let choice = host.plan(volume, scene)?;
        Engine::with_plan(host, volume, scene, choice, seed)
    }

    /// Brings the scene onto the GPU according to `choice`, which [`Host::plan`] has made for that scene.
    pub fn with_plan(
        host: &Host,
        volume: &Volume,
        scene: &Scene,
        choice: Choice,
        seed: u32,
    ) -> Result<Engine> {
        Engine::in_memory(host, &host.memory()?, volume, scene, choice, seed)
    }

    /// Brings the scene onto the GPU through a memory gate that is shared with others.
    pub(crate) fn in_memory(
        host: &Host,
        memory: &Arc<Memory>,
        volume: &Volume,
        scene: &Scene,
        choice: Choice,
        seed: u32,
    ) -> Result<Engine> {
        let bricks = choice
            .plan
            .bricks
            .map(|b| b.with_host_bytes(host.ram_budget()));
        let full = GpuScene::new(scene, volume, seed)
            .with_variant(choice.plan.variant.clone())
            .with_bricks(bricks);
        Ok(Engine {
            renderer: Renderer::new(memory, volume, full.clone())?,
            host: host.clone(),
            volume: volume.clone(),
            scene: scene.clone(),
            full,
            choice,
            seed,
            reserved: 0,
            samples_ahead: None,
            seconds_per_sample: f64::INFINITY,
            memory: memory.clone(),
        })
    }

    pub fn host(&self) -> &Host {
        &self.host
    }

    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The seed of the random numbers.
    pub fn seed(&self) -> u32 {
        self.seed
    }

    /// The variant that renders, the reason for it, and its memory.
    pub fn choice(&self) -> &Choice {
        &self.choice
    }

    /// Samples, units, paths and reads of the volume of the picture so far.
    pub fn totals(&self) -> Totals {
        self.renderer.totals()
    }

    /// Paths traced, for the cache and for the picture.
    pub fn paths(&self) -> u64 {
        self.renderer.paths()
    }

    /// Reads of the volume by those paths.
    pub fn lookups(&self) -> u64 {
        self.renderer.lookups()
    }

    /// Pixels of the whole picture.
    fn pixels(&self) -> f64 {
        let [width, height] = self.scene.render.size.map(f64::from);
        width * height
    }

    /// Whether the volume is on the device in bricks, some of them at a time.
    fn streams(&self) -> bool {
        self.renderer.brick_figures().is_some()
    }

    /// Paths that the nodes in sight have had; 0 without a cache.
    pub fn updates(&self) -> u32 {
        let cache = self.renderer.cache();
        cache.map_or(0, |cache| cache.filling.updates)
    }

    /// The time that compiling all passes took.
    pub fn compiling(&self) -> Duration {
        self.renderer.compiling()
    }

    /// Begins the picture anew; the cache stays.
    pub fn begin_picture(&mut self) {
        self.renderer.begin_picture();
    }

    /// Runs each pass for a moment and forgets the results: some drivers finish compiling only then. To be called before
    /// anything is rendered: a picture under way is lost.
    pub fn warm_up(&mut self) -> Result<()> {
        self.renderer.warm_up()
    }

    /// Whether there is a picture of all pixels to see: samples, or what a cache shows without them.
    pub fn has_picture(&self) -> bool {
        let is_whole = self.renderer.size() == self.scene.render.size;
        self.renderer.cache().is_some() || is_whole && self.totals().samples > 0
    }

    /// The picture after the last complete unit of samples; before the first unit, the picture that the cache shows, and
    /// without a cache an empty one.
    pub fn picture(&mut self) -> Result<Picture> {
        self.reduce_to(self.scene.render.size)?;
        let film = match self.march_before_samples()? {
            Some(film) => film,
            None => self.renderer.film()?,
        };
        self.picture_of(film)
    }

    /// The picture that the cache shows at once, without samples; `None` in a variant without a cache.
    pub fn march(&mut self) -> Result<Option<Picture>> {
        self.reduce_to(self.scene.render.size)?;
        match self.renderer.caching() {
            Some(mut caching) => {
                let film = Film::marched(caching.march()?);
                self.picture_of(film).map(Some)
            }
            None => Ok(None),
        }
    }

    /// Sends samples through the middle of each pixel from now on, as [`march`](Engine::march) does with its rays,
    /// until the scene changes: a converged picture of them shows the errors of a march, apart from what it does not
    /// see.
    pub fn sample_pixel_centres(&mut self) -> Result<()> {
        self.full.parts.view.through_centres = true;
        let size = self.renderer.size();
        self.renderer.change(&self.full.reduced_to(size)).map(drop)
    }

    /// [`picture`](Engine::picture), and the sums behind it.
    pub fn picture_with_sums(&mut self) -> Result<(Picture, Sums)> {
        let sums = self.sums()?;
        let film = match self.march_before_samples()? {
            Some(film) => film,
            None => Film {
                stderr: self.renderer.standard_error(&sums),
                mean: sums.mean.clone(),
            },
        };
        Ok((self.picture_of(film)?, sums))
    }

    /// The sums after the last complete unit of samples, with which an engine for the same scene can continue the
    /// picture.
    pub fn sums(&mut self) -> Result<Sums> {
        self.reduce_to(self.scene.render.size)?;
        self.renderer.sums()
    }

    /// Continues a picture from sums that another engine for the same scene had after `totals`, which are added to what this
    /// one has done.
    pub fn resume(&mut self, sums: &Sums, totals: Totals) -> Result<()> {
        self.reduce_to(self.scene.render.size)?;
        self.renderer.resume(sums, totals)
    }

    /// What the cache shows, as long as there are no samples; `None` otherwise.
    fn march_before_samples(&mut self) -> Result<Option<Film>> {
        match (self.totals().samples, self.renderer.caching()) {
            (0, Some(mut caching)) => Ok(Some(Film::marched(caching.march()?))),
            _ => Ok(None),
        }
    }

    fn picture_of(&mut self, film: Film) -> Result<Picture> {
        let hits = self.renderer.first_hits()?;
        Ok(Picture::new(film, hits, &self.scene.render))
    }

    /// Gives all nodes of the cache the same number of paths from now on, as pictures from all sides need it.
    pub fn serve_all_views(&mut self) {
        if let Some(mut caching) = self.renderer.caching() {
            caching.serve_all_views();
        }
    }

    /// The times of the GPU's passes, run by run.
    pub fn timings(&self) -> &Timings {
        self.renderer.timings()
    }

    /// Ends the engine, which gives back its memory, and returns the times of the GPU's passes.
    pub fn into_timings(mut self) -> Timings {
        std::mem::take(self.renderer.timings_mut())
    }

    /// GPU memory as planned and as used.
    pub fn memory_stats(&self) -> MemoryStats {
        figures::memory(&self.memory, self.choice.plan.bytes())
    }

    /// Bytes of GPU memory in use from each moment on.
    pub fn memory_history(&self) -> Vec<(Instant, u64)> {
        self.memory.history()
    }

    /// Figures of the streaming over `wall` seconds; `None` where the volume is whole.
    pub fn brick_stats(&self, wall: f64) -> Option<BrickStats> {
        let figures = self.renderer.brick_figures()?;
        Some(BrickStats {
            total: figures.total,
            needed: needed_bricks(&self.full, &self.volume),
            resident: figures.resident,
            loads: figures.loads,
            bytes_read: figures.bytes_read,
            waited_share: figures.waited.as_secs_f64() / wall,
        })
    }

    /// The cache's size and state, in a variant that has one. `goal` is the relative error at which it counts as
    /// converged.
    pub fn cache_stats(&self, goal: f64) -> Option<CacheStats> {
        figures::cache(&self.renderer, goal)
    }
}
