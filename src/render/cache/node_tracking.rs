//! Paths from the cache's nodes.

use super::focus::Lack;
use super::memory::CacheMemory;
use super::merge_parts::MergeParts;
use super::spread_light::SpreadLight;
use super::work_list::{Half, Portion, WorkList};
use crate::error::Result;
use crate::gpu::types::*;
use crate::gpu::{Binding, Frame, Pass};
use crate::render::bricks::Items;
use crate::render::layout::CacheLayout;
use crate::render::pass_compiler::PassCompiler;
use crate::render::path_queue::{Advanced, PathQueue};
use crate::render::resources::Resources;
use crate::shared;

shared! {
    pub struct NodePush {
        /// Loop iterations after which a slot leaves its path to the next dispatch.
        pub most_iterations: uint,
        pub slots: uint,
        /// The portion's turns; those of the coarse lattice come first.
        pub turns: uint,
        pub coarse_turns: uint,
        /// Parity of the nodes that are filled: the sum of a node's indices is even (0) or odd (1); or `BOTH_HALVES`.
        pub nodes_half: uint,
    }
}

pub struct NodeTracking {
    pass: Pass,
    merge_parts: MergeParts,
    spread_light: SpreadLight,
    pub queue: PathQueue,
    /// The places in the order in which their bricks are worked on.
    order: Vec<u32>,
    work_list: WorkList,
    portion: Portion,
}

impl NodeTracking {
    pub fn new(passes: &PassCompiler<'_>, layout: &CacheLayout) -> Result<Self> {
        Ok(NodeTracking {
            pass: passes.compile::<NodePush>("node_tracking")?,
            merge_parts: MergeParts::new(passes)?,
            spread_light: SpreadLight::new(passes)?,
            queue: PathQueue::new(passes),
            order: layout.along_curve(),
            work_list: WorkList::default(),
            portion: Portion::default(),
        })
    }

    /// Adapts to another layout of the cache.
    pub fn lay_out(&mut self, layout: &CacheLayout) {
        self.order = layout.along_curve();
    }

    /// Forgets all paths and begins a batch in which each brick's nodes get what they lack.
    pub fn begin(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        cache: &mut CacheMemory,
        lacks: impl Iterator<Item = Lack>,
    ) -> Result<()> {
        self.work_list = WorkList::new(cache, &self.order, lacks);
        cache.bricks.upload(frame)?;
        let half = if self.work_list.gathers() {
            Half::Even
        } else {
            Half::Both
        };
        self.portion = self.work_list.next_portion(cache, half);
        self.queue.restart(frame, r, Items::NONE)
    }

    /// Advances all paths of the batch.
    pub fn advance(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        cache: &mut CacheMemory,
    ) -> Result<Advanced> {
        let (pass, portion) = (&self.pass, self.portion);
        let mut progress = self
            .queue
            .advance(frame, r, pass, |recording, most_iterations| {
                let push = NodePush {
                    most_iterations,
                    slots: r.slots(),
                    turns: portion.turns,
                    coarse_turns: portion.coarse_turns,
                    nodes_half: portion.half.word(),
                };
                let bindings = [
                    &r.medium_bindings()[..],
                    &r.surface_bindings(),
                    &cache.bindings(),
                    &r.path_bindings(),
                    &cache.work.bindings(),
                    &[
                        cache.brick_binding(),
                        ("slot_nodes", Binding::Buffer(&cache.work.slot_nodes)),
                    ],
                ]
                .concat();
                recording.dispatch(pass, &bindings, &push, [push.slots, 1, 1])
            })?;
        if !progress.under_way {
            progress.under_way = self.end_portion(frame, r, cache)?;
        }
        Ok(progress)
    }

    /// Takes what the portion's paths have found into the cache, and begins the next portion. Returns whether there is one.
    fn end_portion(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        cache: &mut CacheMemory,
    ) -> Result<bool> {
        let portion = self.portion;
        frame.run(|recording| self.merge_parts.record(recording, r, cache, portion))?;
        self.portion = self.work_list.next_portion(cache, portion.half);
        if self.portion.turns == 0 && portion.half == Half::Even {
            self.spread_light.run(frame, r, cache)?;
            self.work_list.begin_other_half();
            self.portion = self.work_list.next_portion(cache, Half::Odd);
        }
        let goes_on = self.portion.turns > 0;
        if goes_on {
            self.queue.restart(frame, r, Items::NONE)?;
        }
        Ok(goes_on)
    }
}
