//! Paths from the cells of the published baseline.

use super::cells::PublishedCells;
use crate::error::Result;
use crate::gpu::types::*;
use crate::gpu::{Binding, Dispatch, Frame, Pass, Work};
use crate::render::pass_compiler::PassCompiler;
use crate::render::resources::Resources;
use crate::shared;

shared! {
    pub struct PublishedPush {
        /// Dispatches over all cells so far.
        pub round: uint,
        /// Steps that each path takes in this dispatch.
        pub steps: uint,
        /// The largest extinction anywhere.
        pub majorant: float,
    }
}

pub struct PublishedTransport(Pass);

impl PublishedTransport {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        Ok(PublishedTransport(
            passes.compile::<PublishedPush>("published_transport")?,
        ))
    }

    /// Advances each cell's path by a few steps.
    pub fn run(
        &self,
        frame: &mut Frame,
        r: &Resources,
        cells: &PublishedCells,
        push: &PublishedPush,
    ) -> Result<()> {
        let bindings = [
            ("scene_block", Binding::Buffer(&r.scene)),
            ("transfer", Binding::Image(&r.transfer)),
            ("clips", Binding::Buffer(&r.clips)),
            ("counters", Binding::Buffer(&r.counters)),
            ("radiance_cells", Binding::Image(&cells.radiance)),
            ("position_cells", Binding::Image(&cells.position)),
            ("direction_cells", Binding::Image(&cells.direction)),
            ("throughput_cells", Binding::Image(&cells.throughput)),
        ];
        frame.run_in_slices(&Dispatch {
            pass: &self.0,
            bindings: [&r.volume_bindings()[..], &r.lights.bindings(), &bindings].concat(),
            push: *push,
            threads: cells.radiance.desc().extent,
        })
    }

    /// States how many samples of the volume the runs since this was last done have taken.
    pub fn state_samples(&self, frame: &mut Frame, samples: u64) {
        frame
            .timings
            .state_work(self.0.name, Work::samples(samples));
    }
}
