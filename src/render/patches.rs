//! The nearest and the farthest distance at which the camera's rays can meet anything, patch by patch of the picture;
//! once a view.

use super::pass_compiler::PassCompiler;
use super::resources::Resources;
use crate::error::Result;
use crate::gpu::{Binding, Frame, Pass, Work};

pub struct Patches(Pass);

impl Patches {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        Ok(Patches(passes.compile::<()>("patches")?))
    }

    /// `blocks` is the number of blocks with a majorant along each axis.
    pub fn run(&self, frame: &mut Frame, r: &Resources, blocks: [u32; 3]) -> Result<()> {
        let bindings = [
            ("scene_block", Binding::Buffer(&r.scene)),
            ("transfer", Binding::Image(&r.transfer)),
            ("clips", Binding::Buffer(&r.clips)),
            ("ranges", Binding::Image(&r.ranges)),
            ("majorants", Binding::Image(&r.majorants)),
            ("surfaces", Binding::Buffer(&r.surfaces)),
            ("patches", Binding::Image(&r.patches)),
        ];
        let bindings = [&r.volume_bindings()[..], &bindings].concat();
        frame.run(|recording| {
            recording.clear(&[&r.patches])?;
            recording.dispatch(&self.0, &bindings, &(), blocks)?;
            recording.state_work(Work::texels(r.majorants.desc().texels(), 0));
            Ok(())
        })
    }
}
