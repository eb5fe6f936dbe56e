//! The time from an edit of the transfer function until its first picture can begin: what the window does between a
//! point's move and the passes that show it.

use super::report::Edit;
use crate::engine::figures::quantile;
use crate::engine::{Changed, Engine, Stopwatch};
use crate::error::Result;
use crate::scene::Variant;

const EDITS: usize = 16;
/// The factor by which every second edit dims opacities; the others undo it.
const DIMMED: f64 = 0.75;

/// Edits the loaded scene and leaves it as it was, with an empty cache. `None` where there is no medium, where the edit
/// needs a new engine, and in `published`, which the window does not show.
pub fn measure(engine: &mut Engine) -> Result<Option<Edit>> {
    let scene = engine.scene().clone();
    if scene.render.variant == Variant::Published || scene.medium.is_none() {
        return Ok(None);
    }
    let mut dimmed = scene.clone();
    for point in dimmed.medium.iter_mut().flat_map(|m| &mut m.transfer) {
        point.opacity *= DIMMED;
    }
    let (mut ms, mut cpu_ms) = (Vec::new(), Vec::new());
    for edited in [&dimmed, &scene].into_iter().cycle().take(EDITS) {
        let watch = Stopwatch::started();
        if engine.change_in_place(edited)? == Changed::Impossible {
            return Ok(None);
        }
        ms.push(watch.elapsed().as_secs_f64() * 1e3);
        cpu_ms.push(watch.cpu().as_secs_f64() * 1e3);
    }
    for times in [&mut ms, &mut cpu_ms] {
        times.sort_by(f64::total_cmp);
    }
    Ok(Some(Edit {
        ms_min: ms[0],
        ms_median: quantile(&ms, 0.5),
        cpu_ms_median: quantile(&cpu_ms, 0.5),
    }))
}
