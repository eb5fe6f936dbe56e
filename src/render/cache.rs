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

use super::cell_tracking::CellTracking;
use super::copy;
use super::cut_cells::CutCells;
use super::ray_march::RayMarch;
use super::resources::{CacheResources, Resources};
use super::shared::Features;
use crate::error::Result;
use crate::gpu::{Device, Frame, Shaders};

/// The error is measured on about so many pixels along the picture's longer side.
const MEASURED_PIXELS: u32 = 128;

pub struct Cache {
    tracking: CellTracking,
    ray_march: RayMarch,
    /// Paths that each node has had.
    pub updates: u32,
    /// Paths traced and reads of the volume in all.
    pub paths: u64,
    pub lookups: u64,
    /// Of the picture that it shows: rms(standard error)/mean. Infinite until there are two batches.
    pub relative_error: f64,
    pub took: Duration,
    /// The last measurement.
    shown: Vec<[f32; 4]>,
}

impl Cache {
    pub fn new(device: &Arc<Device>, shaders: &Shaders, features: &Features) -> Result<Cache> {
        Ok(Cache {
            tracking: CellTracking::new(device, shaders, features)?,
            ray_march: RayMarch::new(device, shaders, features)?,
            updates: 0,
            paths: 0,
            lookups: 0,
            relative_error: f64::INFINITY,
            took: Duration::ZERO,
            shown: Vec::new(),
        })
    }

    /// What only has to be done when the surfaces or the volume change.
    pub fn prepare(
        device: &Arc<Device>,
        shaders: &Shaders,
        features: &Features,
        frame: &mut Frame,
        r: &Resources,
    ) -> Result<()> {
        match r.cache.as_ref().and_then(|c| Some((c, c.cuts.as_ref()?))) {
            Some((cache, cuts)) => {
                CutCells::new(device, shaders, features)?.run(frame, r, cache, cuts)
            }
            None => Ok(()),
        }
    }

    /// Forgets all light.
    pub fn clear(&mut self) {
        self.updates = 0;
        self.relative_error = f64::INFINITY;
        self.took = Duration::ZERO;
        self.shown.clear();
    }

    /// A few steps of a first batch, which the next one begins anew, and a picture of it.
    pub fn warm_up(&mut self, frame: &mut Frame, r: &Resources) -> Result<()> {
        let Some(resources) = &r.cache else {
            return Ok(());
        };
        self.tracking.restart(frame, r)?;
        self.tracking.advance(frame, r, resources, 1, 0)?;
        self.ray_march.run(frame, r, resources)
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
        let Some(resources) = &r.cache else {
            return Ok(true);
        };
        let began = Instant::now();
        self.tracking.restart(frame, r)?;
        let mut under_way = true;
        while under_way {
            if stop.load(Ordering::Relaxed) {
                return Ok(false);
            }
            let progress = self
                .tracking
                .advance(frame, r, resources, samples, self.updates)?;
            under_way = progress.under_way;
            self.lookups += progress.lookups as u64;
        }
        let history = self.updates;
        self.updates += samples;
        self.paths += samples as u64 * resources.active_nodes;
        self.measure(frame, r, resources, history as f64 / samples as f64)?;
        self.took += began.elapsed();
        Ok(true)
    }

    /// `history` is n/N.
    fn measure(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        cache: &CacheResources,
        history: f64,
    ) -> Result<()> {
        let [width, height, _] = r.unit_sum.desc.extent;
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

    /// The picture that the cache shows now, into `unit_sum`.
    pub fn march(&self, frame: &mut Frame, r: &Resources) -> Result<()> {
        match &r.cache {
            Some(cache) => self.ray_march.run(frame, r, cache),
            None => Ok(()),
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
