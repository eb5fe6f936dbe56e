//! The `published` variant: Šmajdek et al., "Combined volume and surface rendering with global illumination caching"
//! (2023), unchanged, as a baseline for measurements. It has a dense cache of one cell a voxel, with a path under way
//! in each; `published_transport.comp` and `published_march.comp` say what it estimates instead of our transport
//! model.
//!
//! Its unit of work is a round: a few steps of every cell's path. A sample is complete when, on average, one path has
//! ended in every cell. The variant does not estimate the noise of its picture.

mod cells;
mod published_march;
mod published_transport;

pub use cells::PublishedCells;

use std::time::Instant;

use bytemuck::Zeroable;

use super::gpu_scene::GpuScene;
use super::pass_compiler::PassCompiler;
use super::picture::totals::Totals;
use super::resources::Resources;
use super::shared::Counters;
use crate::error::Result;
use crate::gpu::Frame;
use published_march::{PublishedMarch, PublishedMarchPush};
use published_transport::{PublishedPush, PublishedTransport};

/// Steps that a path takes in one round.
const STEPS: u32 = 8;
/// The paper keeps each pixel's depth from frame to frame and refines it. A picture after n rounds gets as many
/// iterations as n frames would have made, up to a limit for pictures at rest.
const DEPTH_ITERATIONS_PER_ROUND: u32 = 100;
const MOST_DEPTH_ITERATIONS: u32 = 1000;
/// In place of a majorant of 0, which would divide by 0. Flights become so long that they leave any volume.
const LEAST_MAJORANT: f32 = 1e-30;

pub struct Published {
    pub cells: PublishedCells,
    transport: PublishedTransport,
    march: PublishedMarch,
    /// The largest extinction that the transfer function allows.
    majorant: f32,
    rounds: u32,
    /// The counters as the last round left them.
    counted: Counters,
}

impl Published {
    pub fn new(
        passes: &PassCompiler<'_>,
        scene: &GpuScene,
        cells: PublishedCells,
    ) -> Result<Published> {
        Ok(Published {
            cells,
            transport: PublishedTransport::new(passes)?,
            march: PublishedMarch::new(passes)?,
            majorant: scene.parts.medium.largest_extinction().max(LEAST_MAJORANT),
            rounds: 0,
            counted: Counters::zeroed(),
        })
    }

    /// Advances every cell's path by a few steps.
    pub fn round(&mut self, frame: &mut Frame, r: &Resources, totals: &mut Totals) -> Result<()> {
        if self.rounds == 0 {
            frame.run(|recording| recording.zero(&r.counters))?;
        }
        let push = PublishedPush {
            round: self.rounds,
            steps: STEPS,
            majorant: self.majorant,
        };
        self.transport.run(frame, r, &self.cells, &push)?;
        self.rounds += 1;
        frame.run(|recording| recording.copy(&r.counters, &r.staging))?;
        let counted = r.counters_read();
        let before = std::mem::replace(&mut self.counted, counted);
        totals.paths += counted.finished.wrapping_sub(before.finished) as u64;
        let lookups = u64::from(counted.lookups.wrapping_sub(before.lookups));
        self.transport.state_samples(frame, lookups);
        totals.lookups += lookups;
        totals.samples = (totals.paths / self.cells.count()) as u32;
        if totals.units == 0 {
            self.march(frame, r)?;
            totals.units = 1;
            totals.seen_since = Some(Instant::now());
        }
        Ok(())
    }

    /// Runs a round and forgets its light and its paths.
    pub fn warm_up(&mut self, frame: &mut Frame, r: &Resources) -> Result<()> {
        self.round(frame, r, &mut Totals::default())?;
        self.rounds = 0;
        self.counted = Counters::zeroed();
        frame.run(|recording| recording.clear(&self.cells.images()))
    }

    /// The picture that the cache shows now, into `mean`.
    pub fn march(&self, frame: &mut Frame, r: &Resources) -> Result<()> {
        let iterations = self.rounds.saturating_mul(DEPTH_ITERATIONS_PER_ROUND);
        let push = PublishedMarchPush {
            depth_iterations: iterations.min(MOST_DEPTH_ITERATIONS),
        };
        self.march.run(frame, r, &self.cells, &push)
    }
}
