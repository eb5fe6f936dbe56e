//! Merges what the parts of nodes' paths have found with the nodes' earlier light.

use super::memory::CacheMemory;
use super::work_list::Portion;
use crate::error::Result;
use crate::gpu::types::*;
use crate::gpu::{Binding, Pass, Recording, Work};
use crate::render::pass_compiler::PassCompiler;
use crate::render::resources::Resources;
use crate::render::shared::NODES;
use crate::shared;

shared! {
    pub struct MergePush {
        /// The portion's turns of the coarse lattice, which come first.
        pub coarse_turns: uint,
        /// As in `NodePush`.
        pub nodes_half: uint,
    }
}

pub struct MergeParts(Pass);

impl MergeParts {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        Ok(MergeParts(passes.compile::<MergePush>("merge_parts")?))
    }

    pub fn record<'r>(
        &'r self,
        recording: &mut Recording<'_, 'r>,
        r: &'r Resources,
        cache: &'r CacheMemory,
        portion: Portion,
    ) -> Result<()> {
        let bindings = [
            &[
                ("scene_block", Binding::Buffer(&r.scene)),
                cache.brick_binding(),
            ][..],
            &cache.bindings(),
            &cache.work.bindings(),
            &cache.output_bindings(),
        ]
        .concat();
        let push = MergePush {
            coarse_turns: portion.coarse_turns,
            nodes_half: portion.half.word(),
        };
        let threads = NODES * portion.turns;
        recording.dispatch(&self.0, &bindings, &push, [threads, 1, 1])?;
        recording.state_work(Work::texels(u64::from(threads), 0));
        Ok(())
    }
}
