//! Passes that find a bit for each cube of the cache (`cube_bits.glsl`).

use super::memory::CacheMemory;
use crate::error::Result;
use crate::gpu::types::*;
use crate::gpu::{Binding, Buffer, Dispatch, Frame, Pass, Work};
use crate::render::resources::Resources;
use crate::render::shared::NODES;
use crate::shared;

shared! {
    pub struct CubePush {
        pub bricks: uint,
        /// Bricks in a row of workgroups.
        pub row: uint,
    }
}

/// Finds the bits by `pass`, which takes `bindings` besides the volume, and returns how many are set; `bits` is `None`
/// where none can be. No queue of paths may be under way.
pub fn mark(
    frame: &mut Frame,
    r: &Resources,
    cache: &CacheMemory,
    pass: &Pass,
    bits: Option<&Buffer>,
    bindings: &[(&'static str, Binding<'_>)],
) -> Result<u32> {
    let Some(bits) = bits else {
        return Ok(0);
    };
    let own = [
        ("scene_block", Binding::Buffer(&r.scene)),
        ("clips", Binding::Buffer(&r.clips)),
        ("ranges", Binding::Image(&r.ranges)),
        ("counters", Binding::Buffer(&r.counters)),
        ("bits", Binding::Buffer(bits)),
        ("pages", Binding::Image(&cache.pages)),
        cache.brick_binding(),
    ];
    let bindings = [&r.volume_bindings()[..], &own, bindings].concat();
    let ([bricks, row], threads) = cache.for_each_brick();
    let push = CubePush { bricks, row };
    frame.run(|recording| {
        recording.zero(&r.counters)?;
        recording.zero(bits)
    })?;
    let dispatch = Dispatch {
        pass,
        bindings,
        push,
        threads,
    };
    r.run_in_slices(frame, &dispatch)?;
    let cubes = u64::from(NODES) * u64::from(bricks);
    let work = Work::texels(cubes, 0);
    frame.timings.state_work(pass.name, work);
    frame.run(|recording| recording.copy(&r.counters, &r.staging))?;
    Ok(r.counters_read().marked_cubes)
}
