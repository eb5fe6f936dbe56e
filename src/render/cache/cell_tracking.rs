//! Paths from the cache's nodes.

use super::memory::CacheMemory;
use super::spread_light::SpreadLight;
use crate::error::Result;
use crate::gpu::types::*;
use crate::gpu::{Binding, Frame, Pass};
use crate::render::bricks::Items;
use crate::render::pass_compiler::PassCompiler;
use crate::render::path_queue::{PathQueue, Progress};
use crate::render::resources::Resources;
use crate::render::shared::{BOTH_HALVES, Brick, GATHERED};
use crate::shared;

shared! {
    pub struct CellPush {
        /// Loop iterations after which a slot leaves its path to the next dispatch.
        pub work: uint,
        pub slots: uint,
        /// Bricks that have memory.
        pub bricks: uint,
        /// Parity of the nodes that are filled: the sum of a node's indices is even (0) or odd (1); or `BOTH_HALVES`.
        pub nodes_half: uint,
    }
}

pub struct CellTracking {
    pass: Pass,
    spread_light: SpreadLight,
    pub queue: PathQueue,
    /// The half of the nodes that is under way (`gathering.glsl`), or both: where no node gathers, none waits for another.
    half: u32,
}

impl CellTracking {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        Ok(CellTracking {
            pass: passes.compile::<CellPush>("cell_tracking")?,
            spread_light: SpreadLight::new(passes)?,
            queue: PathQueue::new(passes),
            half: 0,
        })
    }

    /// Forgets all paths and starts the queue of nodes anew.
    pub fn restart(&mut self, frame: &mut Frame, r: &Resources, cache: &CacheMemory) -> Result<()> {
        self.half = match cache.layout.may_gather() && cache.bricks().iter().any(is_young) {
            true => 0,
            false => BOTH_HALVES,
        };
        self.queue.restart(frame, r, Items::NONE)
    }

    /// Advances all paths of the batch that `cache.bricks` describes.
    pub fn advance(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        cache: &CacheMemory,
    ) -> Result<Progress> {
        let CellTracking {
            pass,
            spread_light,
            queue,
            half,
        } = self;
        let mut progress = queue.advance(frame, r, pass, |frame, work| {
            let push = CellPush {
                work,
                slots: r.slots(),
                bricks: cache.active_bricks(),
                nodes_half: *half,
            };
            let flux = cache.flux.as_ref().unwrap_or(&cache.light);
            let bindings = [
                &r.medium_bindings()[..],
                &r.surface_bindings(),
                &cache.bindings(),
                &r.path_bindings(),
                &[
                    ("light_out", Binding::Image(&cache.light)),
                    ("flux_out", Binding::Image(flux)),
                    ("node_works", Binding::Buffer(&cache.work)),
                    cache.brick_binding(),
                ],
            ]
            .concat();
            frame.pass(pass, &bindings, &push, [push.slots, 1, 1])
        })?;
        if !progress.under_way && *half == 0 {
            *half = 1;
            spread_light.run(frame, r, cache)?;
            queue.restart(frame, r, Items::NONE)?;
            progress.under_way = true;
        }
        Ok(progress)
    }
}

/// Whether a brick's nodes gather in this batch if any do (`gathering.glsl`), and get paths on the coarse lattice alone
/// (`coarse.glsl`).
fn is_young(brick: &Brick) -> bool {
    brick.samples > 0 && brick.first_sample + brick.samples <= GATHERED
}
