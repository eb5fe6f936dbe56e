//! The cost of rendering: figures of the GPU's passes, its memory and the cache.
//!
//! Field names are a contract with scripts, which read them in the files of `--stats`. JSON knows no NaN and no
//! infinity: such numbers become null there.

use serde::Serialize;

use crate::gpu::{Memory, PassTotal, Timings, Work};
use crate::render::{Peak, Renderer};

/// One kind of GPU pass over all its runs.
#[derive(Debug, Clone, Serialize)]
pub struct PassStats {
    pub name: String,
    pub runs: usize,
    pub gpu_ms_median: f64,
    pub gpu_ms_p95: f64,
    pub gpu_ms_total: f64,
    /// The share of the total time in which the device would have done the same work at its peak rates ([`Peak`]).
    /// `None` where the peak has not been measured, or a pass states no work.
    pub peak_share: Option<f64>,
}

#[derive(Debug, Clone, Default, Serialize)]
pub struct MemoryStats {
    pub budget_bytes: u64,
    pub planned_bytes: u64,
    /// The most that was allocated at once.
    pub peak_bytes: u64,
    /// What was alive then.
    pub resources: Vec<ResourceStats>,
}

#[derive(Debug, Clone, Serialize)]
pub struct ResourceStats {
    pub name: String,
    pub bytes: u64,
}

#[derive(Debug, Clone, Serialize)]
pub struct CacheStats {
    /// Cells along each axis.
    pub dims: [u32; 3],
    pub format: String,
    pub bytes: u64,
    pub cells: u64,
    pub active_cells: u64,
    /// Paths that a cell has had, on average over the bricks; while a brick is young, only every eighth of its cells has had
    /// them.
    pub updates_per_cell: f64,
    /// Relative error of the picture that the cache shows; not finite while it is unknown.
    pub relative_error: f64,
    pub converged: bool,
    /// Seconds that filling has taken, if the cache has converged by then; `None` if it has not.
    pub seconds_to_converge: Option<f64>,
}

/// Bricks of a volume that does not fit.
#[derive(Debug, Clone, Serialize)]
pub struct BrickStats {
    pub total: u32,
    /// Bricks in which the medium scatters or a surface shows.
    pub needed: u32,
    /// Bricks on the GPU at the end.
    pub resident: u32,
    pub loads: u64,
    /// Bytes read from the volume's file.
    pub bytes_read: u64,
    /// Share of the whole time in which the device waited for bricks.
    pub waited_share: f64,
}

impl PassStats {
    /// The figures of a pass from the times of its runs in milliseconds.
    pub fn from_runs(name: impl Into<String>, milliseconds: &[f64]) -> PassStats {
        let mut sorted = milliseconds.to_vec();
        sorted.sort_by(f64::total_cmp);
        PassStats {
            name: name.into(),
            runs: sorted.len(),
            gpu_ms_median: quantile(&sorted, 0.5),
            gpu_ms_p95: quantile(&sorted, 0.95),
            gpu_ms_total: sorted.iter().sum(),
            peak_share: None,
        }
    }
}

/// A quantile, interpolated between the closest ranks; NaN where nothing ran.
pub fn quantile(sorted: &[f64], fraction: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else {
        return f64::NAN;
    };
    let rank = fraction * last as f64;
    let (low, high) = (sorted[rank.floor() as usize], sorted[rank.ceil() as usize]);
    low + (high - low) * rank.fract()
}

/// One entry for each pass, in order of first appearance, with its share of the device's peak if that has been
/// measured.
pub fn passes(timings: &Timings, peak: Option<&Peak>) -> Vec<PassStats> {
    let stats = |total: &PassTotal| {
        let runs = timings.spans().iter().filter(|s| s.pass == total.pass);
        let ms: Vec<f64> = runs.map(|s| s.duration_us / 1e3).collect();
        PassStats {
            runs: total.runs as usize,
            gpu_ms_total: total.duration_us / 1e3,
            peak_share: peak.and_then(|peak| peak_share(peak, &total.work, total.duration_us)),
            ..PassStats::from_runs(total.pass, &ms)
        }
    };
    timings.passes().iter().map(stats).collect()
}

/// The share of the device's peak that a pass has reached which did `work` in `us` microseconds.
pub fn peak_share(peak: &Peak, work: &Work, us: f64) -> Option<f64> {
    (work.is_known() && us > 0.0).then(|| 1e6 * peak.seconds(work) / us)
}

pub fn memory(memory: &Memory, planned_bytes: u64) -> MemoryStats {
    let resources = memory
        .resources_at_peak()
        .into_iter()
        .map(|r| ResourceStats {
            name: r.name.into(),
            bytes: r.bytes,
        });
    MemoryStats {
        budget_bytes: memory.budget,
        planned_bytes,
        peak_bytes: memory.peak(),
        resources: resources.collect(),
    }
}

/// The cache's size and state; `None` in a variant without one. For `published` only the cells' size is known, and no
/// error.
pub(super) fn cache(renderer: &Renderer, goal: f64) -> Option<CacheStats> {
    if let Some(cells) = renderer.published_cells() {
        return Some(CacheStats {
            dims: cells.dims(),
            format: "f32".into(),
            bytes: cells.bytes(),
            cells: cells.count(),
            active_cells: cells.count(),
            updates_per_cell: renderer.totals().paths as f64 / cells.count() as f64,
            relative_error: f64::INFINITY,
            converged: false,
            seconds_to_converge: None,
        });
    }
    let cache = renderer.cache()?;
    let layout = &cache.memory.layout;
    let converged = cache.filling.is_known_to(goal);
    Some(CacheStats {
        dims: layout.nodes,
        format: layout.format().name().into(),
        bytes: cache.memory.bytes(),
        cells: layout.all_nodes(),
        active_cells: layout.active_nodes(),
        updates_per_cell: cache.mean_updates(),
        relative_error: cache.filling.relative_error,
        converged,
        seconds_to_converge: converged.then_some(cache.filling.took.as_secs_f64()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const PEAK: Peak = Peak {
        samples_cached: 1e6,
        reads_cached: 4e6,
        writes: 1e5,
        copied_bytes: 1e9,
    };

    fn share(us: f64, work: Work) -> Option<f64> {
        peak_share(&PEAK, &work, us)
    }

    #[test]
    fn a_pass_at_the_peak_rate_has_a_share_of_1_and_twice_the_work_twice_the_share() {
        assert_eq!(share(1e6, Work::samples(1_000_000)), Some(1.0));
        assert_eq!(share(1e6, Work::samples(250_000)), Some(0.25));
        assert_eq!(share(1e6, Work::samples(500_000)), Some(0.5));
        assert_eq!(share(2e6, Work::samples(500_000)), Some(0.25));
    }

    #[test]
    fn what_nobody_counted_has_no_share() {
        assert_eq!(share(1e6, Work::default()), None);
        assert_eq!(share(0.0, Work::default()), None);
    }

    /// Of kinds of work that go on side by side, the slowest decides.
    #[test]
    fn the_kind_of_work_that_takes_longest_decides() {
        assert_eq!(share(1e6, Work::texels(2_000_000, 80_000)), Some(0.8));
    }
}
