//! The caching variant's state: how many paths each node has had, and how far the picture that the
//! cache shows still is from what more paths would make of it.
//!
//! Batches double: each gives a node as many new paths as it has had. The picture marched before a
//! batch and the one after it then differ by (new − old)/2, whose spread is the later picture's own
//! standard error: batch and history are independent and equally noisy. That is measured, for the
//! camera at hand, where averaging over many cells along a ray is part of the answer.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::cell_tracking::CellTracking;
use super::copy;
use super::cut_cells::CutCells;
use super::ray_march::RayMarch;
use super::resources::Resources;
use super::shared::Features;
use crate::error::Result;
use crate::gpu::{Device, Frame, Shaders};

/// Paths a node in the first batch.
const FIRST_BATCH: u32 = 1;
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

    /// Doubles the paths of every node and measures the error. False if `stop` is raised before the
    /// last of them: some nodes have had the batch then, some not, and the next batch is the same.
    pub fn batch(&mut self, frame: &mut Frame, r: &Resources, stop: &AtomicBool) -> Result<bool> {
        let Some(resources) = &r.cache else {
            return Ok(true);
        };
        let began = Instant::now();
        let samples = self.updates.max(FIRST_BATCH);
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
        self.updates += samples;
        self.paths += samples as u64 * resources.active_nodes;
        self.measure(frame, r)?;
        self.took += began.elapsed();
        Ok(true)
    }

    fn measure(&mut self, frame: &mut Frame, r: &Resources) -> Result<()> {
        let [width, height, _] = r.unit_sum.desc.extent;
        let stride = width.max(height).div_ceil(MEASURED_PIXELS);
        let corner = [width.div_ceil(stride), height.div_ceil(stride), 1];
        self.ray_march.measure(frame, r, stride)?;
        let now = copy::download_corner(frame, &r.staging, &r.unit_sum, corner)?;
        if !self.shown.is_empty() {
            self.relative_error = relative_difference(&self.shown, &now);
        }
        self.shown = now;
        Ok(())
    }

    /// The picture that the cache shows now, into `unit_sum`.
    pub fn march(&self, frame: &mut Frame, r: &Resources) -> Result<()> {
        self.ray_march.run(frame, r)
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
