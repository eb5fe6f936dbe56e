//! The picture of the published baseline.

use super::cells::PublishedCells;
use crate::error::Result;
use crate::gpu::types::*;
use crate::gpu::{Binding, Dispatch, Frame, Pass, Work};
use crate::render::pass_compiler::PassCompiler;
use crate::render::resources::Resources;
use crate::shared;

shared! {
    pub struct PublishedMarchPush {
        /// Iterations of Algorithm 1 in each pixel.
        pub depth_iterations: uint,
    }
}

pub struct PublishedMarch(Pass);

impl PublishedMarch {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        Ok(PublishedMarch(
            passes.compile::<PublishedMarchPush>("published_march")?,
        ))
    }

    /// Leaves the picture in `mean`.
    pub fn run(
        &self,
        frame: &mut Frame,
        r: &Resources,
        cells: &PublishedCells,
        push: &PublishedMarchPush,
    ) -> Result<()> {
        let bindings = [
            ("scene_block", Binding::Buffer(&r.scene)),
            ("transfer", Binding::Image(&r.transfer)),
            ("clips", Binding::Buffer(&r.clips)),
            ("ranges", Binding::Image(&r.ranges)),
            ("surfaces", Binding::Buffer(&r.surfaces)),
            ("radiance_cells", Binding::Filtered(&cells.radiance)),
            ("mean", Binding::Image(&r.mean)),
        ];
        let [width, height] = r.size;
        frame.run_in_slices(&Dispatch {
            pass: &self.0,
            bindings: [&r.volume_bindings()[..], &r.lights.bindings(), &bindings].concat(),
            push: *push,
            threads: [width, height, 1],
        })?;
        let work = Work::texels(0, r.pixels().into());
        frame.timings.state_work(self.0.name, work);
        Ok(())
    }
}
