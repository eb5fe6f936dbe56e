//! The caching variant's state: how many paths each node has had, and how far the picture that the
//! cache shows still is from what more paths would make of it.
//!
//! Batches double, as a rule: each gives a node as many new paths as it has had. With a history of n paths
//! and a batch of N, what is shown changes by N/(n + N) of the difference between two independent
//! estimates, and n/N of the square of that change is the variance of what is shown then. So the error
//! is measured where it matters: in the picture of the camera at hand, where averaging over many cells
//! along a ray is part of the answer.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::cache_resources::CacheResources;
use super::cell_tracking::CellTracking;
use super::copy;
use super::cut_cells::CutCells;
use super::ray_march::RayMarch;
use super::resources::Resources;
use super::shared::Features;
use crate::error::Result;
use crate::gpu::{Device, Frame, Shaders, Slices};

/// The error is measured on about so many pixels along the picture's longer side.
const MEASURED_PIXELS: u32 = 128;

pub struct Cache {
    pub tracking: CellTracking,
    ray_march: RayMarch,
    /// Only where surfaces stop light.
    cut_cells: Option<CutCells>,
    /// Paths that each node has had.
    pub updates: u32,
    /// Paths traced and reads of the volume in all.
    pub paths: u64,
    pub lookups: u64,
    /// Of the picture that it shows: rms(standard error)/mean. Infinite until there are two batches.
    pub relative_error: f64,
    pub took: Duration,
    /// Paths a node of the batch under way.
    under_way: Option<u32>,
    /// The last measurement.
    shown: Vec<[f32; 4]>,
}

impl Cache {
    pub fn new(device: &Arc<Device>, shaders: &Shaders, features: &Features) -> Result<Cache> {
        Ok(Cache {
            tracking: CellTracking::new(device, shaders, features)?,
            ray_march: RayMarch::new(device, shaders, features)?,
            cut_cells: match features.full_light {
                true => Some(CutCells::new(device, shaders, features)?),
                false => None,
            },
            updates: 0,
            paths: 0,
            lookups: 0,
            relative_error: f64::INFINITY,
            took: Duration::ZERO,
            under_way: None,
            shown: Vec::new(),
        })
    }

    /// What only has to be done when the surfaces or the volume change.
    pub fn prepare(&self, frame: &mut Frame, r: &Resources) -> Result<()> {
        let cuts = r.cache.as_ref().and_then(|c| Some((c, c.cuts.as_ref()?)));
        match (&self.cut_cells, cuts) {
            (Some(pass), Some((cache, cuts))) => pass.run(frame, r, cache, cuts),
            _ => Ok(()),
        }
    }

    /// Forgets all light.
    pub fn clear(&mut self) {
        self.updates = 0;
        self.relative_error = f64::INFINITY;
        self.took = Duration::ZERO;
        self.under_way = None;
        self.shown.clear();
    }

    /// Forgets the batch under way.
    pub fn abandon(&mut self) {
        self.under_way = None;
    }

    /// From elsewhere, the error has to be measured anew; until then the last one stands.
    pub fn look_elsewhere(&mut self) {
        self.shown.clear();
    }

    /// A few steps of a first batch, which the next one begins anew, and a picture of it.
    pub fn warm_up(&mut self, frame: &mut Frame, r: &Resources) -> Result<()> {
        let Some(resources) = &r.cache else {
            return Ok(());
        };
        self.tracking.restart(frame, r)?;
        self.tracking.advance(frame, r, resources, 1, 0)?;
        self.ray_march.measure(frame, r, resources, 1)
    }

    /// Gives every node `samples` more paths and measures the error. False if `stop` is raised before
    /// the last of them: some nodes have had the batch then, some not, and it does not count.
    pub fn batch(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        samples: u32,
        stop: &AtomicBool,
    ) -> Result<bool> {
        self.under_way = None;
        loop {
            if stop.load(Ordering::Relaxed) {
                return Ok(false);
            }
            if self.advance(frame, r, samples)? {
                return Ok(true);
            }
        }
    }

    /// Goes on with a batch for about as long as the slots aim at, or begins one of `samples` paths a
    /// node. Returns whether it has ended, and been measured.
    pub fn advance(&mut self, frame: &mut Frame, r: &Resources, samples: u32) -> Result<bool> {
        let Some(resources) = &r.cache else {
            return Ok(true);
        };
        let began = Instant::now();
        if self.under_way.is_none() {
            self.tracking.restart(frame, r)?;
        }
        let samples = *self.under_way.get_or_insert(samples);
        let progress = self
            .tracking
            .advance(frame, r, resources, samples, self.updates)?;
        self.lookups += progress.lookups as u64;
        if !progress.under_way {
            let history = self.updates;
            self.under_way = None;
            self.updates += samples;
            self.paths += samples as u64 * resources.active_nodes;
            self.measure(frame, r, resources, history as f64 / samples as f64)?;
        }
        self.took += began.elapsed();
        Ok(!progress.under_way)
    }

    /// `history` is n/N.
    fn measure(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        cache: &CacheResources,
        history: f64,
    ) -> Result<()> {
        let [width, height] = r.size;
        let stride = width.max(height).div_ceil(MEASURED_PIXELS);
        let corner = [width.div_ceil(stride), height.div_ceil(stride), 1];
        self.ray_march.measure(frame, r, cache, stride)?;
        let now = copy::download_corner(frame, &r.staging, &r.unit_sum, corner)?;
        if !self.shown.is_empty() {
            self.relative_error = history.sqrt() * relative_difference(&self.shown, &now);
        }
        self.shown = now;
        Ok(())
    }

    /// The picture that the cache shows now, into `unit_sum`, in a submission under way.
    pub fn record_march(&self, frame: &mut Frame, r: &Resources) -> Result<()> {
        match &r.cache {
            Some(cache) => self.ray_march.record(frame, r, cache),
            None => Ok(()),
        }
    }

    /// The next slice of the picture that the cache shows now, into `unit_sum`. Returns whether it was
    /// the last.
    pub fn march(&self, frame: &mut Frame, r: &Resources, slices: &mut Slices) -> Result<bool> {
        match &r.cache {
            Some(cache) => self.ray_march.advance(frame, r, cache, slices),
            None => Ok(true),
        }
    }
}

/// rms(after − before) over RGB, relative to the mean of alpha, the whole picture's brightness.
fn relative_difference(before: &[[f32; 4]], after: &[[f32; 4]]) -> f64 {
    let pairs = before.iter().zip(after);
    let differences = pairs.flat_map(|(b, a)| (0..3).map(|c| f64::from(a[c] - b[c])));
    let squares: f64 = differences.map(|d| d * d).sum();
    let sum: f64 = after.iter().map(|texel| f64::from(texel[3])).sum();
    let count = after.len() as f64;
    match sum > 0.0 {
        true => (squares / (3.0 * count)).sqrt() / (sum / count),
        false => 0.0,
    }
}
