//! The time of a run as tables for a terminal: the stages of the CPU one after another, and the GPU's passes
//! meanwhile.

use super::stats::{FILL_CACHE, RENDER, Stats, TRY_VARIANTS};

/// Tables of stages and passes. The stages add up to the wall time, with a row for the time that none of them covers.
/// `paths`: those of this run, where the picture has others of earlier runs.
pub fn text(stats: &Stats, paths: u64) -> String {
    let wall_ms = 1e3 * stats.wall_s;
    let share = |ms: f64| 100.0 * ms / wall_ms;
    let mut text = format!(
        "{:<22} {:>12} {:>8} {:>14}\n",
        "stage", "ms", "share", "GPU busy, ms"
    );
    for stage in &stats.stages {
        let (name, ms) = (&stage.name, stage.ms);
        text += &format!(
            "{name:<22} {ms:>12.1} {:>6.1} % {:>14.1}\n",
            share(ms),
            stage.gpu_ms
        );
        for part in &stage.parts {
            text += &format!("  {:<20} {:>12.1}\n", part.name, part.ms);
        }
    }
    let covered: f64 = stats.stages.iter().map(|stage| stage.ms).sum();
    let gap = wall_ms - covered;
    let not_covered = "not covered";
    text += &format!("{not_covered:<22} {gap:>12.1} {:>6.1} %\n", share(gap));
    text += &format!("{:<22} {wall_ms:>12.1}\n", "in all");

    let heads = [
        "runs",
        "median, ms",
        "p95, ms",
        "total, ms",
        "share",
        "of the peak",
    ];
    text += &format!("{:<22}", "GPU pass");
    text += &heads.map(|head| format!(" {head:>12}")).concat();
    text += "\n";
    for pass in &stats.passes {
        text += &format!(
            "{:<22} {:>12} {:>12.3} {:>12.3} {:>12.1} {:>10.1} % {:>12}\n",
            pass.name,
            pass.runs,
            pass.gpu_ms_median,
            pass.gpu_ms_p95,
            pass.gpu_ms_total,
            share(pass.gpu_ms_total),
            match pass.peak_share {
                Some(share) => format!("{:.1} %", 100.0 * share),
                None => "–".into(),
            }
        );
    }
    text + &rates(stats, paths)
}

/// Rates per second of the stages that trace `paths`.
fn rates(stats: &Stats, paths: u64) -> String {
    let tracing = |name: &str| [TRY_VARIANTS, FILL_CACHE, RENDER].contains(&name);
    let stages = stats.stages.iter().filter(|stage| tracing(&stage.name));
    let seconds = stages.map(|stage| stage.ms).sum::<f64>() / 1e3;
    let paths = paths as f64;
    let memory = &stats.memory;
    format!(
        "{:.3e} paths/s, {:.3e} reads of the volume/s, {:.1} reads a path; {} bytes planned, {} at \
         the peak, {} allowed\n",
        paths / seconds,
        paths * stats.lookups_per_path / seconds,
        stats.lookups_per_path,
        memory.planned_bytes,
        memory.peak_bytes,
        memory.budget_bytes,
    )
}
