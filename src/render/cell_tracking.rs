//! Paths from the cache's nodes.

use std::sync::Arc;

use super::cache_resources::CacheResources;
use super::resources::Resources;
use super::shared::{CellPush, Features};
use super::slots::{Progress, Slots};
use crate::error::Result;
use crate::gpu::{Binding, Device, Frame, Pass, PassDesc, Shaders, Specialization};

pub struct CellTracking {
    pass: Pass,
    pub slots: Slots,
    /// Of the nodes, which is under way (`gathering.glsl`).
    half: u32,
}

impl CellTracking {
    pub fn new(device: &Arc<Device>, shaders: &Shaders, features: &Features) -> Result<Self> {
        let desc = PassDesc {
            name: "cell_tracking",
            specialization: &features.words(),
            macros: &features.formats(),
        };
        Ok(CellTracking {
            pass: Pass::new(device, shaders, &desc)?,
            slots: Slots::new(),
            half: 0,
        })
    }

    /// Forgets all paths and starts the queue of nodes anew.
    pub fn restart(&mut self, frame: &mut Frame, r: &Resources) -> Result<()> {
        self.half = 0;
        self.slots.restart(frame, r)
    }

    /// Takes all paths of the batch that stands in `cache.bricks` further.
    pub fn advance(
        &mut self,
        frame: &mut Frame,
        r: &Resources,
        cache: &CacheResources,
    ) -> Result<Progress> {
        let CellTracking { pass, slots, half } = self;
        let mut progress = slots.advance(frame, r, |frame, work| {
            let push = CellPush {
                work,
                slots: r.slots(),
                bricks: cache.active_bricks,
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
            slots.restart(frame, r)?;
            progress.under_way = true;
        }
        Ok(progress)
    }
}
