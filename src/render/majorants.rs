//! The largest extinction in each block of cells; once a transfer function. `parts/medium.rs` says how large the
//! blocks are.

use super::pass_compiler::PassCompiler;
use super::resources::Resources;
use crate::error::Result;
use crate::gpu::{Binding, Dispatch, Frame, Pass, Work};

pub struct Majorants(Pass);

impl Majorants {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        Ok(Majorants(passes.compile::<()>("majorants")?))
    }

    /// `blocks` is their number along each axis.
    pub fn run(&self, frame: &mut Frame, r: &Resources, blocks: [u32; 3]) -> Result<()> {
        let bindings = [
            ("scene_block", Binding::Buffer(&r.scene)),
            ("transfer", Binding::Image(&r.transfer)),
            ("ranges", Binding::Image(&r.ranges)),
            ("majorants", Binding::Image(&r.majorants)),
        ];
        frame.run_in_slices(&Dispatch {
            pass: &self.0,
            bindings: [&r.volume_bindings()[..], &bindings].concat(),
            push: (),
            threads: blocks,
        })?;
        let work = Work::texels(r.ranges.desc().texels(), r.majorants.desc().texels());
        frame.timings.state_work(self.0.name, work);
        Ok(())
    }
}
