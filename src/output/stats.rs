//! The statistics of a run, as `--stats` writes them. Field names are a contract with scripts.
//!
//! JSON knows no NaN and no infinity: serde_json writes such numbers as null.

use serde::Serialize;

use crate::engine::Outcome;
use crate::engine::figures::{BrickStats, CacheStats, MemoryStats, PassStats};

#[derive(Debug, Clone, Default, Serialize)]
pub struct Stats {
    pub variant: String,
    /// The reason for the variant.
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
    /// `None` for a variant without a cache.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cache: Option<CacheStats>,
    /// `None` unless the volume does not fit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bricks: Option<BrickStats>,
    /// The views one by one; the first one includes the filling of the cache.
    pub views: Vec<ViewStats>,
    /// `None` if earlier runs have traced no paths for these pictures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub continued: Option<Continued>,
}

/// What earlier runs have done for the cache and the pictures of this run, whose samples, paths and views count it as well;
/// `wall_s`, stages, passes and bricks are of this run alone.
#[derive(Debug, Clone, Serialize)]
pub struct Continued {
    pub paths: u64,
    /// Time spent on the pictures.
    pub wall_s: f64,
}

#[derive(Debug, Clone, Serialize)]
pub struct ViewStats {
    pub spp: u64,
    pub wall_s: f64,
    /// CPU time of all cores.
    pub cpu_s: f64,
    pub relative_error: f64,
}

impl ViewStats {
    pub fn of(outcome: &Outcome) -> ViewStats {
        ViewStats {
            spp: u64::from(outcome.samples),
            wall_s: outcome.took.as_secs_f64(),
            cpu_s: outcome.cpu.as_secs_f64(),
            relative_error: outcome.relative_error,
        }
    }
}

/// The stages that trace paths.
pub const TRY_VARIANTS: &str = "try variants";
pub const FILL_CACHE: &str = "fill the cache";
pub const RENDER: &str = "render";

/// One stage of the CPU's work: loading, planning, compiling, writing.
#[derive(Debug, Clone, Serialize)]
pub struct StageStats {
    pub name: String,
    pub ms: f64,
    /// Milliseconds during which the GPU worked.
    pub gpu_ms: f64,
    /// Parts of the stage that are known in more detail; they do not add up to the whole.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<PartStats>,
}

#[derive(Debug, Clone, Serialize)]
pub struct PartStats {
    pub name: String,
    pub ms: f64,
}
