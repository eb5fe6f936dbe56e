//! Paths from the cache's nodes.

use super::brick_window::Items;
use super::cache_memory::CacheMemory;
use super::pass_compiler::PassCompiler;
use super::path_queue::{PathQueue, Progress};
use super::resources::Resources;
use super::shared::CellPush;
use crate::error::Result;
use crate::gpu::{Binding, Frame, Pass};

pub struct CellTracking {
    pass: Pass,
    pub queue: PathQueue,
    /// The half of the nodes that is under way (`gathering.glsl`).
    half: u32,
}

impl CellTracking {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        Ok(CellTracking {
            pass: passes.compile("cell_tracking")?,
            queue: PathQueue::new(passes),
            half: 0,
        })
    }

    /// Forgets all paths and starts the queue of nodes anew.
    pub fn restart(&mut self, frame: &mut Frame, r: &Resources) -> Result<()> {
        self.half = 0;
        self.queue.restart(frame, r, Items::NONE)
    }

    /// Takes all paths of the batch that stands in `cache.bricks` further.
    pub fn advance(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        cache: &CacheMemory,
    ) -> Result<Progress> {
        let CellTracking { pass, queue, half } = self;
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
            queue.restart(frame, r, Items::NONE)?;
            progress.under_way = true;
        }
        Ok(progress)
    }
}
