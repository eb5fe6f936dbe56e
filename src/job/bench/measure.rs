//! One variant, from its first path to the last of the given times, and what its cache is good for after that.

use std::time::Instant;

use super::Bench;
use super::edits;
use super::entrant_run::{EntrantRun, References, Snapshot};
use super::entrants::{Entrant, Subject};
use super::report::{Point, RunReport, Similarity, SimilarityPoint, seconds_to};
use super::warm::Warm;
use crate::compare::compare_images;
use crate::engine::Stopwatch;
use crate::engine::figures;
use crate::error::Result;

/// The run's figures and its pictures at the given times.
pub fn measure(
    bench: &mut Bench<'_>,
    subject: &Subject,
    entrant: &Entrant,
    references: References<'_>,
) -> Result<(RunReport, Vec<Snapshot>)> {
    let began = Instant::now();
    let mut run = EntrantRun {
        engine: entrant.load(&bench.host, bench.volume, bench.seed)?,
        watch: Stopwatch::paused(),
        entrant,
        prefix: subject.prefix_of(entrant),
        references,
    };
    let load_s = began.elapsed().as_secs_f64();
    let snapshots = run.take_snapshots(bench)?;
    let took = run.watch.elapsed().as_secs_f64();
    let (paths, lookups) = (run.engine.paths(), run.engine.lookups());
    let cache = run.cache();
    let passes = figures::passes(run.engine.timings(), bench.peak.as_ref());
    let Warm {
        orbit,
        new_view,
        isovalue,
    } = run.warm(bench)?;
    let edit = edits::measure(&mut run.engine)?;
    let points: Vec<Point> = snapshots.iter().map(|s| s.point.clone()).collect();
    Ok((
        RunReport {
            variant: entrant.word.clone(),
            plan: entrant.choice.plan.variant.description(),
            reason: entrant.choice.reason.clone(),
            load_s,
            seconds_to_30_db: seconds_to(30.0, &points),
            seconds_to_40_db: seconds_to(40.0, &points),
            points,
            paths_per_second: paths as f64 / took,
            lookups_per_path: lookups as f64 / paths as f64,
            passes,
            memory: run.engine.memory_stats(),
            bytes_per_active_cell: cache
                .as_ref()
                .filter(|c| c.active_cells > 0)
                .map(|c| c.bytes as f64 / c.active_cells as f64),
            bytes_per_voxel: cache.as_ref().map(|c| c.bytes as f64 / voxels(bench)),
            cache,
            orbit,
            new_view: new_view.points,
            same_rays: new_view.same_rays,
            bias_apart: new_view.bias_apart,
            edit,
            isovalue,
        },
        snapshots,
    ))
}

pub fn voxels(bench: &Bench<'_>) -> f64 {
    bench.volume.dims.iter().map(|&n| f64::from(n)).product()
}

/// How alike the pictures of two runs are at the same times.
pub fn similarity(
    bench: &Bench<'_>,
    entrant: &Entrant,
    uncached: &[Snapshot],
    snapshots: &[Snapshot],
) -> Result<Similarity> {
    let mut points = Vec::new();
    for snapshot in snapshots.iter().filter(|s| !s.point.is_late()) {
        let asked_s = snapshot.point.asked_s;
        let same_time =
            |other: &&Snapshot| other.point.asked_s == asked_s && !other.point.is_late();
        if let Some(other) = uncached.iter().find(same_time) {
            let alike = compare_images(&other.image, &snapshot.image, bench.exposure)?;
            points.push(SimilarityPoint {
                asked_s,
                psnr: alike.psnr,
                ssim: alike.ssim,
            });
        }
    }
    Ok(Similarity {
        variant: entrant.word.clone(),
        points,
    })
}
