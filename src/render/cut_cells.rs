//! Which of the cache's cells are cut by a surface; whenever the volume or an isovalue changes.

use std::sync::Arc;

use super::cache_resources::CacheResources;
use super::resources::Resources;
use super::shared::{BRICK, CutPush, Features};
use crate::error::Result;
use crate::gpu::{Binding, Buffer, Device, Frame, Pass, PassDesc, Shaders, Specialization};

/// Bricks in a row of workgroups: Vulkan promises no more than 65535 rows, and there may be millions of bricks.
const ROW: u32 = 1024;

pub struct CutCells(Pass);

impl CutCells {
    pub fn new(device: &Arc<Device>, shaders: &Shaders, features: &Features) -> Result<Self> {
        let desc = PassDesc {
            name: "cut_cells",
            specialization: &features.words(),
            macros: &features.formats(),
        };
        Ok(CutCells(Pass::new(device, shaders, &desc)?))
    }

    pub fn run(
        &self,
        frame: &mut Frame,
        r: &Resources,
        cache: &CacheResources,
        cuts: &Buffer,
    ) -> Result<()> {
        let bindings = [
            ("scene_block", Binding::Buffer(&r.scene)),
            ("volume", Binding::Image(&r.volume)),
            ("clips", Binding::Buffer(&r.clips)),
            ("ranges", Binding::Image(&r.ranges)),
            ("surfaces", Binding::Buffer(&r.surfaces)),
            cache.brick_binding(),
            ("cuts", Binding::Buffer(cuts)),
        ];
        let push = CutPush {
            bricks: cache.active_bricks,
            row: ROW,
        };
        let rows = push.bricks.div_ceil(ROW);
        frame.run_in_slices(
            &self.0,
            &bindings,
            &push,
            [ROW * BRICK, rows * BRICK, BRICK],
        )
    }
}
