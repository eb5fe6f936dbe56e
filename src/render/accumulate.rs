//! Folds a unit of samples into the running mean and its spread.

use super::pass_compiler::PassCompiler;
use super::resources::Resources;
use super::shared::AccumulatePush;
use crate::error::Result;
use crate::gpu::{Binding, Frame, Pass, Work};

pub struct Accumulate(Pass);

impl Accumulate {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        Ok(Accumulate(passes.compile("accumulate")?))
    }

    pub fn record(&self, frame: &mut Frame, r: &Resources, push: &AccumulatePush) -> Result<()> {
        let bindings = [
            ("scene_block", Binding::Buffer(&r.scene)),
            ("unit_sum", Binding::Image(&r.unit_sum)),
            ("mean", Binding::Image(&r.mean)),
            ("squares", Binding::Image(&r.squares)),
        ];
        frame.pass(&self.0, &bindings, push, [r.size[0], r.size[1], 1])?;
        let pixels = u64::from(r.size[0]) * u64::from(r.size[1]);
        frame.state_work(Work {
            reads: 3 * pixels,
            writes: 2 * pixels,
            ..Work::default()
        });
        Ok(())
    }
}
