//! A render from top to bottom: load once, then unit after unit of samples.
//!
//! A unit gives every pixel the same number of new samples. Pictures are only taken at the end of a
//! unit: stopping a pixel in the middle of its work would favour its short paths.

use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use super::accumulate::Accumulate;
use super::cache::Cache;
use super::camera_march::CameraMarch;
use super::constants::SceneBuffers;
use super::copy;
use super::delta_tracking::DeltaTracking;
use super::iso_depth::IsoDepth;
use super::majorants::Majorants;
use super::patches::Patches;
use super::published::Published;
use super::resources::Resources;
use super::shared::{self, AccumulatePush, ToneMapPush};
use super::tone_map::ToneMap;
use super::upload::{self, upload_pages, upload_transfer};
use crate::error::Result;
use crate::gpu::{Device, Frame, Image, Memory, SLICE_MS, Shaders, Slices};
use crate::scene::volume::Volume;

pub struct Renderer {
    pub frame: Frame,
    pub totals: Totals,
    pub resources: Resources,
    /// What the compiling of all passes took.
    pub compiling: Duration,
    pub(super) sampling: Sampling,
    accumulate: Accumulate,
    majorants: Majorants,
    patches: Patches,
    /// Only with surfaces.
    pub(super) iso_depth: Option<IsoDepth>,
    tone_map: ToneMap,
    /// Samples a pixel of the unit under way.
    under_way: Option<u32>,
    /// The picture so far is that of another scene.
    is_stale: bool,
    /// Only in the variant that has one.
    pub cache: Option<Cache>,
}

/// How a picture at rest gets its samples.
pub(super) enum Sampling {
    Tracking(DeltaTracking),
    March(CameraMarch),
    Published(Published),
}

impl Sampling {
    fn new(device: &Arc<Device>, shaders: &Shaders, scene: &SceneBuffers) -> Result<Sampling> {
        let features = &scene.features;
        Ok(if scene.published {
            Sampling::Published(Published::new(device, shaders, scene)?)
        } else if features.is_marched() {
            Sampling::March(CameraMarch::new(device, shaders, features)?)
        } else {
            Sampling::Tracking(DeltaTracking::new(device, shaders, features)?)
        })
    }
}

/// What has been done so far.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Totals {
    /// Samples in every pixel.
    pub samples: u32,
    /// Of which the spread between samples is known; `published` has a single one that grows.
    pub units: u32,
    pub paths: u64,
    /// Reads of the volume by tracking.
    pub lookups: u64,
}

impl Renderer {
    pub fn new(memory: &Arc<Memory>, volume: &Volume, scene: &SceneBuffers) -> Result<Renderer> {
        let shaders = Shaders::new(shared::glsl())?;
        Renderer::with_shaders(memory, &shaders, volume, scene)
    }

    /// With passes compiled by `shaders`: a test may have put other text in the place of a file.
    pub fn with_shaders(
        memory: &Arc<Memory>,
        shaders: &Shaders,
        volume: &Volume,
        scene: &SceneBuffers,
    ) -> Result<Renderer> {
        let device = memory.device();
        let features = &scene.features;
        // Compiling is most of a start: the two largest sets of shaders, side by side, and beside the
        // voxels' way to the GPU.
        let (sampling, cache, loaded) = thread::scope(|scope| {
            let sampling = scope.spawn(|| Sampling::new(device, shaders, scene));
            let cache = scene.cache.as_ref();
            let cache = cache.map(|_| scope.spawn(|| Cache::new(device, shaders, scene)));
            let loaded = upload::load(memory, volume, scene);
            (sampling.join(), cache.map(|c| c.join()), loaded)
        });
        let (frame, resources) = loaded?;
        let cache = cache.map(|cache| cache.unwrap_or_else(|panic| resume_unwind(panic)));
        let mut renderer = Renderer {
            frame,
            totals: Totals::default(),
            resources,
            compiling: Duration::ZERO,
            sampling: sampling.unwrap_or_else(|panic| resume_unwind(panic))?,
            accumulate: Accumulate::new(device, shaders, features)?,
            majorants: Majorants::new(device, shaders, features)?,
            patches: Patches::new(device, shaders, features)?,
            iso_depth: match features.surface_count {
                0 => None,
                _ => Some(IsoDepth::new(device, shaders, features)?),
            },
            tone_map: ToneMap::new(device, shaders)?,
            under_way: None,
            is_stale: false,
            cache: cache.transpose()?,
        };
        renderer.prepare(scene, true, true)?;
        renderer.compiling = shaders.time_spent();
        Ok(renderer)
    }

    /// Works out what follows from the scene on the GPU: from its medium, if that is new; from its view; and for
    /// the cache, if that begins anew.
    fn prepare(
        &mut self,
        scene: &SceneBuffers,
        has_new_medium: bool,
        cache_begins: bool,
    ) -> Result<()> {
        let (frame, r) = (&mut self.frame, &self.resources);
        let majorant_cells = scene.constants.majorant_cells;
        if has_new_medium && scene.features.has_medium {
            self.majorants.run(frame, r, majorant_cells)?;
        }
        self.patches.run(frame, r, majorant_cells)?;
        match &self.cache {
            Some(cache) if cache_begins => cache.prepare(frame, r),
            _ => Ok(()),
        }
    }

    /// Goes on with another scene of the same volume, sky image and features, and a picture that its
    /// images have room for; `before` is the one so far. Returns whether the cache's light is still
    /// right; if not, it is gone.
    pub fn change(&mut self, before: &SceneBuffers, scene: &SceneBuffers) -> Result<bool> {
        let r = &mut self.resources;
        let frame = &mut self.frame;
        if r.write(before, scene)?
            && let Some(cache) = &r.cache
        {
            frame.run(|f| {
                f.clear(&cache.images().collect::<Vec<_>>())?;
                f.adopt(&[&cache.pages])
            })?;
            upload_pages(frame, r, scene)?;
        }
        if before.transfer != scene.transfer {
            upload_transfer(frame, r, scene)?;
        }
        let has_new_medium = before.transfer != scene.transfer
            || before.constants.density != scene.constants.density;
        let lasts = before.shares_light_with(scene);
        if let Some(cache) = &mut self.cache {
            cache.look_elsewhere(scene);
            if before.constants.cache_unit != scene.constants.cache_unit {
                cache.abandon(); // paths on their way are as bright as the lights were
            }
            if !lasts {
                cache.clear();
            }
        }
        self.prepare(scene, has_new_medium, !lasts)?;
        self.begin_picture();
        Ok(lasts)
    }

    /// Runs each pass for a moment and forgets what it did: some drivers finish compiling only then, and
    /// whoever measures does not want to measure that.
    pub fn warm_up(&mut self) -> Result<()> {
        let (frame, r) = (&mut self.frame, &mut self.resources);
        if let Some(cache) = &mut self.cache {
            cache.warm_up(frame, r)?;
        }
        match &mut self.sampling {
            Sampling::Tracking(tracking) => tracking.warm_up(frame, r)?,
            Sampling::March(march) => march.warm_up(frame, r)?,
            Sampling::Published(published) => published.warm_up(frame, r)?,
        }
        let push = AccumulatePush {
            samples: 1.0,
            samples_so_far: 1.0,
        };
        frame.run(|f| self.accumulate.record(f, r, &push))?;
        self.begin_picture();
        Ok(())
    }

    /// Fills a cache that knows nothing with a guess, so that there is something to see until paths have
    /// replaced it: light that is dimmed everywhere alike.
    pub fn guess_light(&mut self, scene: &SceneBuffers) -> Result<()> {
        let guess = scene.guessed_light();
        match &self.resources.cache {
            Some(cache) => self.frame.run(|f| f.clear_to(&[&cache.light], guess)),
            None => Ok(()),
        }
    }

    /// Makes room for pictures of another size.
    pub fn resize(&mut self, size: [u32; 2]) -> Result<()> {
        self.resources.resize(size)?;
        if let Some(cache) = &mut self.cache {
            cache.abandon();
        }
        self.frame.run(|f| f.clear(&self.resources.picture()))?;
        self.begin_picture();
        Ok(())
    }

    /// Begins the picture anew; the cache stays.
    pub fn begin_picture(&mut self) {
        self.totals.samples = 0;
        self.totals.units = 0;
        self.under_way = None;
        self.is_stale = true;
    }

    /// How long a piece of work may take from now on, while somebody is waiting for a frame.
    pub fn take_slices_of(&mut self, ms: f64) {
        match &mut self.sampling {
            Sampling::Tracking(tracking) => tracking.slots.target_ms = ms,
            Sampling::March(march) => march.slice_ms = ms,
            Sampling::Published(_) => {}
        }
        if let Some(cache) = &mut self.cache {
            cache.tracking.slots.target_ms = ms;
        }
    }

    /// A batch of `samples` paths for each node in sight (`Cache::batch`). False if `stop` is raised before its end.
    pub fn fill_cache(&mut self, samples: u32, stop: &AtomicBool) -> Result<bool> {
        match &mut self.cache {
            Some(cache) => cache.batch(&mut self.frame, &mut self.resources, samples, stop),
            None => Ok(true),
        }
    }

    /// Goes on with a batch for a slice of time, or begins one. Returns whether it has ended.
    pub fn advance_cache(&mut self, samples: u32) -> Result<bool> {
        match &mut self.cache {
            Some(cache) => cache.advance(&mut self.frame, &mut self.resources, samples),
            None => Ok(true),
        }
    }

    /// The picture that the cache shows at once, row 0 on top.
    pub fn march(&mut self) -> Result<Vec<[f32; 4]>> {
        self.march_in_place()?;
        let r = &self.resources;
        copy::download(&mut self.frame, &r.staging, &r.unit_sum)
    }

    /// Leaves that picture in `unit_sum`.
    pub fn march_in_place(&mut self) -> Result<()> {
        let mut slices = Slices::new(SLICE_MS);
        while !self.advance_march(&mut slices)? {}
        Ok(())
    }

    /// All of it in one piece of work, encoded for display: for pictures of few pixels.
    pub fn march_at_once(&mut self, to: &Image, push: &ToneMapPush) -> Result<()> {
        self.under_way = None;
        let (r, cache, tone_map) = (&self.resources, &self.cache, &self.tone_map);
        self.frame.run(|f| {
            if let Some(cache) = cache {
                cache.record_march(f, r)?;
            }
            tone_map.record(f, &r.unit_sum, to, push)
        })
    }

    /// A slice of that picture, which is in `unit_sum` after the last. Returns whether it was that. A
    /// unit under way is lost.
    pub fn advance_march(&mut self, slices: &mut Slices) -> Result<bool> {
        self.under_way = None;
        match &self.cache {
            Some(cache) => cache.march(&mut self.frame, &self.resources, slices),
            None => Ok(true),
        }
    }

    /// Encodes for display what a march has just left, or the mean so far.
    pub fn tone_map(&mut self, marched: bool, to: &Image, push: &ToneMapPush) -> Result<()> {
        let r = &self.resources;
        let from = match marched {
            true => &r.unit_sum,
            false => &r.mean,
        };
        let tone_map = &self.tone_map;
        self.frame.run(|f| tone_map.record(f, from, to, push))
    }

    /// Gives every pixel `samples` more samples. Returns false, and leaves the picture as it was, if
    /// `stop` is raised before the last path ends. In `published`, a unit is a round instead, whatever
    /// `samples` says.
    pub fn unit(&mut self, samples: u32, stop: &AtomicBool) -> Result<bool> {
        self.under_way = None;
        // A march knows the spread between single samples, which are its units.
        let units = if self.is_marched() { samples } else { 1 };
        for unit in 0..units {
            loop {
                if stop.load(Ordering::Relaxed) {
                    return Ok(unit > 0);
                }
                if self.advance_unit(samples)? {
                    break;
                }
            }
        }
        Ok(true)
    }

    /// Goes on with a unit for a slice of time, or begins one. Returns whether it has ended.
    pub fn advance_unit(&mut self, samples: u32) -> Result<bool> {
        self.clear_if_stale()?;
        let (frame, r) = (&mut self.frame, &self.resources);
        let begins = self.under_way.is_none();
        let samples = *self.under_way.get_or_insert(samples);
        let first = self.totals.samples;
        let ended = match &mut self.sampling {
            Sampling::Tracking(tracking) => {
                let progress = tracking.advance(frame, r, samples, first, begins)?;
                self.totals.lookups += progress.lookups as u64;
                (!progress.under_way).then_some(samples)
            }
            Sampling::March(march) => march.advance(frame, r, first, begins)?.then_some(1),
            Sampling::Published(published) => {
                published.round(frame, r, &mut self.totals)?;
                return Ok(true);
            }
        };
        match ended {
            Some(samples) => self.accumulate(samples).map(|()| true),
            None => Ok(false),
        }
    }

    /// Folds the unit that has just ended into the picture.
    fn accumulate(&mut self, samples: u32) -> Result<()> {
        let r = &self.resources;
        let [width, height] = r.size;
        self.under_way = None;
        self.totals.samples += samples;
        self.totals.units += 1;
        self.totals.paths += samples as u64 * width as u64 * height as u64;
        let push = AccumulatePush {
            samples: samples as f32,
            samples_so_far: self.totals.samples as f32,
        };
        self.frame.run(|f| self.accumulate.record(f, r, &push))
    }

    /// Whether a picture at rest is marched.
    pub fn is_marched(&self) -> bool {
        matches!(self.sampling, Sampling::March(_))
    }

    pub(super) fn clear_if_stale(&mut self) -> Result<()> {
        let r = &self.resources;
        match std::mem::take(&mut self.is_stale) {
            true => self.frame.run(|f| f.clear(&[&r.mean, &r.squares])),
            false => Ok(()),
        }
    }

    /// Paths traced, for the cache and for the picture.
    pub fn paths(&self) -> u64 {
        self.totals.paths + self.cache.as_ref().map_or(0, |c| c.paths)
    }

    /// Reads of the volume by them.
    pub fn lookups(&self) -> u64 {
        self.totals.lookups + self.cache.as_ref().map_or(0, |c| c.lookups)
    }
}
