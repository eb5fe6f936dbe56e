//! The caching variant: its passes, its memory, and its filling, batch after batch. Each ends with a measurement of how far the
//! picture that the cache shows still is from what more paths would make of it (`error.rs`).
//!
//! Where the picture at rest is marched, the cache is read only along the camera's rays, and nodes get paths according to
//! their weight in the picture (`focus.rs`); *updates* are the paths of the nodes that get most. Batches double, as a rule:
//! each gives a node as many new paths as it has had.

mod at_rest;
mod brick_records;
mod caching;
mod camera_march;
mod cube_bits;
mod cut_cubes;
mod error;
mod filling;
mod focus;
mod marched;
mod memory;
mod merge_parts;
mod node_tracking;
mod pace;
mod ray_march;
mod reflectance;
mod rim_cubes;
mod sight;
mod spread_light;
mod state;
mod tail_tracking;
mod work_list;
mod work_memory;

pub use caching::Caching;
pub use filling::{Filling, FillingWork};
pub use memory::CacheMemory;
pub use pace::{batch_gathers, equivalent_paths, next_batch_size};
pub use ray_march::RAYS_PER_PIXEL;
pub use state::CacheState;

use std::time::Instant;

use super::gpu_scene::GpuScene;
use super::layout::CacheLayout;
use super::parts::{Changes, Derived};
use super::pass_compiler::PassCompiler;
use super::picture::bundle::{Bundle, BundleProgress};
use super::resources::Resources;
use super::until::Until;
use super::volume_reading::ReadingSlices;
use crate::error::Result;
use crate::gpu::{Frame, Recording};
use at_rest::AtRest;
use cut_cubes::CutCubes;
use error::{Measured, measure, measured_stride, relative_errors};
use node_tracking::NodeTracking;
use pace::history;
use ray_march::RayMarch;
use reflectance::SurfaceReflectance;
use rim_cubes::RimCubes;
use sight::Sight;

pub struct Cache {
    pub memory: CacheMemory,
    at_rest: AtRest,
    tracking: NodeTracking,
    ray_march: RayMarch,
    /// `None` where no surface stops light.
    cut_cubes: Option<CutCubes>,
    /// `None` where no cube can be at the rim.
    rim_cubes: Option<RimCubes>,
    /// `None` where surfaces need no table of their reflectance.
    reflectance: Option<SurfaceReflectance>,
    sight: Sight,
    /// The texel that stands for the light of a node that is neither traced nor interpolated yet.
    guess: [f32; 4],
    /// Whether no batch has ended since the images were allocated or laid out anew, so that they cannot hold light of an
    /// earlier scene.
    is_blank: bool,
    pub filling: Filling,
    pub work: FillingWork,
    under_way: Option<Batch>,
}

/// The paths of a batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Batch {
    /// So many for each node in sight, for the others their share.
    Paths(u32),
    /// Those of earlier batches that nodes lack, as after a change of the view.
    CatchUp,
}

impl Batch {
    /// By how many the number of updates grows.
    fn updates(self) -> u32 {
        match self {
            Batch::Paths(paths) => paths,
            Batch::CatchUp => 0,
        }
    }
}

impl Cache {
    pub fn new(passes: &PassCompiler<'_>, scene: &GpuScene, memory: CacheMemory) -> Result<Cache> {
        // Compiling is most of a start, and these are the largest shaders.
        let (at_rest, (tracking, ray_march)) = rayon::join(
            || AtRest::new(passes),
            || {
                rayon::join(
                    || NodeTracking::new(passes, &memory.layout),
                    || RayMarch::new(passes),
                )
            },
        );
        Ok(Cache {
            sight: Sight::new(scene, &memory.layout),
            memory,
            at_rest: at_rest?,
            tracking: tracking?,
            ray_march: ray_march?,
            cut_cubes: if passes.features.full_light {
                Some(CutCubes::new(passes)?)
            } else {
                None
            },
            rim_cubes: if passes.features.has_rim_cubes {
                Some(RimCubes::new(passes)?)
            } else {
                None
            },
            reflectance: if passes.features.has_reflectance_table() {
                Some(SurfaceReflectance::new(passes)?)
            } else {
                None
            },
            guess: scene.guessed_light(),
            is_blank: true,
            filling: Filling::NONE,
            work: FillingWork::default(),
            under_way: None,
        })
    }

    /// Works out what follows from those parts of the scene that have changed, and forgets what is no longer right.
    pub fn prepare(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        scene: &GpuScene,
        changes: Changes,
    ) -> Result<()> {
        self.sight.change_view(scene);
        self.guess = scene.guessed_light();
        if changes.invalidates(Derived::NodePaths) {
            self.abandon();
        }
        if let Some(pass) = &self.reflectance
            && changes.invalidates(Derived::Reflectance)
        {
            pass.run(frame, r, &self.memory)?;
        }
        if !changes.invalidates(Derived::CachedLight) {
            return Ok(());
        }
        self.clear();
        // The marks of cubes do not depend on lights.
        if !changes.invalidates(Derived::CacheLayout) {
            return Ok(());
        }
        if let Some(pass) = &self.rim_cubes {
            let rim = f64::from(pass.run(frame, r, &self.memory)?);
            if let AtRest::March(march) = &mut self.at_rest
                && scene.parts.surfaces.iso.is_empty()
            {
                march.set_left_share(rim / self.memory.layout.active_nodes().max(1) as f64);
            }
        }
        match &self.cut_cubes {
            Some(pass) => pass.run(frame, r, &self.memory),
            None => Ok(()),
        }
    }

    /// Gives the cache another layout; the light is gone.
    pub fn lay_out(
        &mut self,
        frame: &mut Frame,
        r: &mut Resources,
        layout: &CacheLayout,
    ) -> Result<()> {
        self.memory.lay_out(layout)?;
        self.tracking.lay_out(layout);
        self.clear();
        self.is_blank = true;
        if let Some(bricks) = &mut r.bricks {
            bricks.resize_cache(layout.active.len())?;
        }
        self.memory.upload_layout(frame, &mut r.staging)
    }

    /// See [`Caching::guess_light`](super::Caching::guess_light); the guess is one texel, everywhere.
    pub fn guess(&self, frame: &mut Frame) -> Result<()> {
        frame.run(|recording| {
            recording.clear_to(&[&self.memory.light], self.guess)?;
            recording.clear(&self.memory.flux.iter().collect::<Vec<_>>())
        })
    }

    /// Whether a picture at rest is marched.
    pub fn is_marched(&self) -> bool {
        matches!(self.at_rest, AtRest::March(_))
    }

    /// Whether a sample of the picture at rest has next to no noise of its own.
    pub fn samples_are_smooth(&self) -> bool {
        self.at_rest.is_smooth()
    }

    /// Goes on with a bundle of units of the picture at rest, or begins one.
    pub fn sample(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        bundle: Bundle,
    ) -> Result<BundleProgress> {
        self.at_rest.advance(frame, r, &self.memory, bundle)
    }

    /// States the work of marches at rest since this was last done.
    pub fn collect(&self, frame: &mut Frame, r: &Resources) -> Result<()> {
        self.at_rest.collect(frame, r, &self.memory)
    }

    /// Forgets all light.
    pub fn clear(&mut self) {
        self.sight.clear(&self.memory.layout);
        self.filling = Filling::NONE;
        self.under_way = None;
    }

    /// Forgets the batch under way.
    pub fn abandon(&mut self) {
        self.under_way = None;
    }

    /// Runs a few steps of a batch and of a unit for a trial; the next ones begin anew.
    pub fn warm_up(&mut self, frame: &mut Frame, r: &Resources) -> Result<()> {
        self.weigh_bricks(frame, r, Until::NEVER)?;
        self.begin_batch(frame, r, Batch::Paths(1))?;
        self.abandon();
        self.tracking.advance(frame, r, &mut self.memory)?;
        let request = ray_march::for_error(1);
        self.ray_march
            .march_for(frame, r, &self.memory, request, Until::NEVER)?;
        self.at_rest.warm_up(frame, r, &self.memory)?;
        self.sample(frame, r, Bundle::TRIAL).map(drop)
    }

    /// Goes on with the batch under way for about the target time of a dispatch, or begins this one. To catch up may take two
    /// batches. Returns whether the batch has ended and its error has been measured; the batch is abandoned if `until` comes
    /// while one of these waits for bricks of the volume.
    pub fn advance(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        batch: Batch,
        until: Until<'_>,
    ) -> Result<bool> {
        let began = Instant::now();
        if self.under_way.is_none() {
            if !self.weigh_bricks(frame, r, until)? {
                return Ok(false);
            }
            if batch == Batch::CatchUp && self.is_caught_up() {
                return Ok(true);
            }
            self.begin_batch(frame, r, batch)?;
        }
        let batch = *self.under_way.get_or_insert(batch);
        let before = self.filling.updates;
        let progress = self.tracking.advance(frame, r, &mut self.memory)?;
        let finished = u64::from(progress.finished);
        self.work.lookups += u64::from(progress.lookups);
        self.work.paths += finished;
        if !progress.under_way {
            let now = self.measure_view(frame, r, |cache, frame| {
                measure(frame, r, &cache.memory, &cache.ray_march, until)
            })?;
            let Some(now) = now else {
                self.abandon();
                return Ok(false);
            };
            self.end_batch(batch, now);
        }
        let took = began.elapsed();
        self.filling.took += took;
        // Of nodes that catch up, some gather and some do not.
        if let Batch::Paths(paths) = batch {
            let pace = if self.memory.layout.gathers && batch_gathers(before, paths) {
                &mut self.filling.gathering
            } else {
                &mut self.filling.tracing
            };
            pace.add(finished, took);
        }
        let is_over = batch != Batch::CatchUp || !self.sight.focus.lags(self.filling.updates);
        Ok(!progress.under_way && is_over)
    }

    /// Decides how many paths the nodes of each brick get.
    fn begin_batch(&mut self, frame: &mut Frame, r: &Resources, batch: Batch) -> Result<()> {
        if self.is_blank {
            self.guess(frame)?;
        }
        let goal = self.filling.updates + batch.updates();
        let lacks = self.sight.focus.lacks(goal);
        self.tracking.begin(frame, r, &mut self.memory, lacks)
    }

    /// Finds out which nodes are in sight, unless that is known. Returns whether it is then: `until` has not come before.
    fn weigh_bricks(&mut self, frame: &mut Frame, r: &Resources, until: Until<'_>) -> Result<bool> {
        if self.sight.view.is_weighed {
            return Ok(true);
        }
        if self.filling.updates == 0 {
            // The light of an older scene is not marked as a guess, and must not be read.
            self.sight.focus.all_from = if !self.is_blank {
                Some(1)
            } else {
                self.sight.expects_motion.then(|| next_batch_size(0) + 1)
            };
        }
        let Some(longest) = self.sight.weighing_stride() else {
            self.sight.focus.share_evenly();
            self.sight.view.is_weighed = true;
            return Ok(true);
        };
        let bricks = self.memory.bricks_mut().iter_mut();
        bricks.for_each(|brick| brick.squared_weight = 0);
        self.memory.bricks.upload(frame)?;
        let stride = measured_stride(r).min(longest);
        let request = ray_march::for_weights(stride);
        let are_weighed = self.measure_view(frame, r, |cache, frame| {
            cache
                .ray_march
                .march_for(frame, r, &cache.memory, request, until)
        })?;
        if !are_weighed {
            return Ok(false);
        }
        self.memory.bricks.download(frame)?;
        let bricks = self.memory.bricks_mut().iter();
        let weights: Vec<u32> = bricks.map(|brick| brick.squared_weight).collect();
        let read: Vec<bool> = weights.iter().map(|&weight| weight > 0).collect();
        let in_sight = self.memory.layout.with_neighbours(&read);
        self.sight
            .focus
            .share_by_weight(weights.into_iter(), &in_sight);
        self.sight.view.is_weighed = true;
        Ok(true)
    }

    /// Marches to learn about the view; while the camera moves, as a preview.
    fn measure_view<T>(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        march: impl FnOnce(&Self, &mut Frame) -> Result<T>,
    ) -> Result<T> {
        if !self.sight.in_motion {
            return march(self, frame);
        }
        self.sight.view.is_preview |= r.bricks.is_some();
        r.without_waiting(frame, |frame| march(self, frame))
    }

    fn end_batch(&mut self, batch: Batch, now: Measured) {
        self.under_way = None;
        self.is_blank = false;
        let filling = &mut self.filling;
        // A picture with missing bricks of the volume differs for that reason too, so it is not compared.
        if let Some(before) = &self.sight.view.measured
            && let Batch::Paths(paths) = batch
            && !self.sight.view.is_preview
        {
            let had = history(filling.updates, self.memory.layout.gathers);
            [filling.relative_error, filling.error_at_rest] =
                relative_errors(before, &now, had, paths);
        }
        filling.updates += batch.updates();
        self.work.batches += 1;
        self.sight.focus.reach(filling.updates);
        self.sight.view.measured = Some(now);
    }

    /// The picture that the cache shows now, into `unit_sum`.
    pub fn record_march<'r>(
        &'r self,
        recording: &mut Recording<'_, 'r>,
        r: &'r Resources,
    ) -> Result<()> {
        self.ray_march.record(recording, r, &self.memory)
    }

    /// The next slice of the picture that the cache shows now, added to the mean of `rays` rays in `unit_sum`. Returns
    /// whether it was the last.
    pub fn march(
        &self,
        frame: &mut Frame,
        r: &Resources,
        rays: u32,
        slices: &mut ReadingSlices,
    ) -> Result<bool> {
        self.ray_march.advance(frame, r, &self.memory, rays, slices)
    }
}
