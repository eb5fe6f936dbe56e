//! The statistics of a run, as `--stats` writes them. Field names are a contract with scripts.
//!
//! JSON knows no NaN and no infinity: serde_json writes such numbers as null.

use serde::Serialize;

#[derive(Debug, Clone, Default, Serialize)]
pub struct Stats {
    pub variant: String,
    /// Why that variant.
    pub reason: String,
    pub device: String,
    pub driver: String,
    pub spp: u64,
    pub seed: u64,
    pub wall_s: f64,
    pub first_frame_s: f64,
    pub passes: Vec<PassStats>,
    pub stages: Vec<StageStats>,
    pub memory: MemoryStats,
    pub paths: u64,
    pub lookups_per_path: f64,
    pub relative_error: f64,
    /// Only for a variant that has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cache: Option<CacheStats>,
    /// One by one; the first with the filling of the cache.
    pub views: Vec<ViewStats>,
}

#[derive(Debug, Clone, Serialize)]
pub struct ViewStats {
    pub spp: u64,
    pub wall_s: f64,
    pub relative_error: f64,
}

/// One kind of GPU pass over all its runs.
#[derive(Debug, Clone, Serialize)]
pub struct PassStats {
    pub name: String,
    pub runs: usize,
    pub gpu_ms_median: f64,
    pub gpu_ms_p95: f64,
    pub gpu_ms_total: f64,
}

impl PassStats {
    /// From the duration of each run.
    pub fn from_runs(name: impl Into<String>, milliseconds: &[f64]) -> PassStats {
        let mut sorted = milliseconds.to_vec();
        sorted.sort_by(f64::total_cmp);
        PassStats {
            name: name.into(),
            runs: sorted.len(),
            gpu_ms_median: quantile(&sorted, 0.5),
            gpu_ms_p95: quantile(&sorted, 0.95),
            gpu_ms_total: sorted.iter().sum(),
        }
    }
}

/// Interpolated between the closest ranks; NaN where nothing ran.
pub fn quantile(sorted: &[f64], fraction: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else {
        return f64::NAN;
    };
    let rank = fraction * last as f64;
    let (low, high) = (sorted[rank.floor() as usize], sorted[rank.ceil() as usize]);
    low + (high - low) * rank.fract()
}

/// One stage of the work, as the CPU sees it: loading, planning, compiling, writing.
#[derive(Debug, Clone, Serialize)]
pub struct StageStats {
    pub name: String,
    pub ms: f64,
    /// While the GPU worked.
    pub gpu_ms: f64,
    /// What is known of it in more detail: it does not add up to the whole.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<PartStats>,
}

#[derive(Debug, Clone, Serialize)]
pub struct PartStats {
    pub name: String,
    pub ms: f64,
}

#[derive(Debug, Clone, Default, Serialize)]
pub struct MemoryStats {
    pub budget_bytes: u64,
    pub planned_bytes: u64,
    pub peak_bytes: u64,
    pub resources: Vec<ResourceStats>,
}

#[derive(Debug, Clone, Serialize)]
pub struct ResourceStats {
    pub name: String,
    pub bytes: u64,
}

#[derive(Debug, Clone, Serialize)]
pub struct CacheStats {
    pub dims: [u32; 3],
    pub format: String,
    pub bytes: u64,
    pub cells: u64,
    pub active_cells: u64,
    /// Paths that a cell has had, on average over all active ones.
    pub updates_per_cell: f64,
    /// Not finite where it is unknown.
    pub relative_error: f64,
    pub converged: bool,
    /// `None` if it has not.
    pub seconds_to_converge: Option<f64>,
}
