//! A render of one variant, of which pictures are taken at the given times.

use std::time::Duration;

use super::entrants::Entrant;
use super::reference::Reference;
use super::report::Point;
use super::{Bench, patient_run};
use crate::compare::{LinearImage, compare_images};
use crate::engine::figures::CacheStats;
use crate::engine::{Engine, Picture, Stop, Stopwatch, cache_goal};
use crate::error::{Error, Result};
use crate::interrupt::is_interrupted;
use crate::output::Provenance;
use crate::output::progress::ProgressLine;

/// A picture at some time, and its figures.
pub struct Snapshot {
    pub point: Point,
    pub image: LinearImage,
}

/// The references with which a run is compared.
#[derive(Clone, Copy)]
pub struct References<'a> {
    pub picture: &'a Reference,
    /// The reference whose rays are those of a march.
    pub centres: Option<&'a Reference>,
}

/// Name of the picture that a run, whose files' names begin like this, has at a time.
pub fn snapshot_file(prefix: &str, at: Duration) -> String {
    format!("{prefix}.{}s.exr", at.as_secs_f64())
}

/// A render of which pictures are taken at the given times.
pub(super) struct EntrantRun<'a> {
    pub engine: Engine,
    pub watch: Stopwatch,
    pub entrant: &'a Entrant,
    /// Prefix of the names of its files.
    pub prefix: String,
    pub references: References<'a>,
}

impl EntrantRun<'_> {
    pub(super) fn take_snapshots(&mut self, bench: &mut Bench<'_>) -> Result<Vec<Snapshot>> {
        let longest = bench.longest();
        let mut progress = ProgressLine::new(bench.args.quiet, Stop::after(longest));
        let mut snapshots = Vec::new();
        for asked in bench.seconds.clone() {
            // A first batch for a large cache may take longer than the first of the given times.
            if self.watch.elapsed() >= asked {
                continue;
            }
            bench.wake();
            match self.render_until(asked, &mut progress) {
                Err(Error::Interrupted) => break,
                other => other?,
            }
            if is_interrupted() {
                break;
            }
            let picture = self.engine.picture()?;
            let name = snapshot_file(&self.prefix, asked);
            snapshots.push(self.snapshot(bench, &picture, asked, Some(name))?);
        }
        progress.finish();
        Ok(snapshots)
    }

    /// Fills the cache with its share of the time, then continues the picture. Where a sample has little noise of its
    /// own, a better cache is worth a new picture; elsewhere the samples so far are worth more.
    fn render_until(&mut self, asked: Duration, progress: &mut ProgressLine) -> Result<()> {
        let mut show = |step| progress.show(step);
        let mut run = patient_run(Stop::after(asked), &mut show);
        let engine = &mut self.engine;
        let before = decisive_updates(engine);
        self.watch.go_on();
        engine.fill(&mut run, 1)?;
        if decisive_updates(engine) != before && engine.totals().units > 0 {
            engine.begin_picture();
        }
        let outcome = engine.sample(&mut run, &self.watch);
        self.watch.pause();
        outcome.map(drop)
    }

    /// Compares the current picture with the reference; a picture with a name is written.
    pub(super) fn snapshot(
        &mut self,
        bench: &mut Bench<'_>,
        picture: &Picture,
        asked: Duration,
        file: Option<String>,
    ) -> Result<Snapshot> {
        let image = LinearImage::from_picture(&self.prefix, picture);
        let error = compare_images(&self.references.picture.image, &image, bench.exposure)?;
        if let Some(name) = &file {
            let device = bench.host.summary().name.clone();
            let from = Provenance::new(self.entrant.text.clone(), bench.seed, device);
            bench.write_picture(name, picture, &from)?;
        }
        let seconds = self.watch.elapsed().as_secs_f64();
        let noise = self.references.picture.report.noise.as_ref();
        let has_cache = self.entrant.choice.plan.variant.cache().is_some();
        let point = Point {
            asked_s: asked.as_secs_f64(),
            seconds,
            cpu_s: self.watch.cpu().as_secs_f64(),
            file,
            samples: self.engine.totals().samples,
            paths_per_cell: has_cache.then(|| self.engine.updates()),
            efficiency: 1.0 / (error.mse * seconds),
            within_reference_noise: noise.is_some_and(|noise| error.mse <= 2.0 * noise.mse),
            error,
        };
        Ok(Snapshot { point, image })
    }

    pub(super) fn cache(&self) -> Option<CacheStats> {
        let goal = cache_goal(&Stop::after(self.watch.elapsed()));
        self.engine.cache_stats(goal)
    }
}

/// Paths that the cache's nodes have had, where the picture's error comes from the cache alone.
fn decisive_updates(engine: &Engine) -> Option<u32> {
    engine.samples_are_smooth().then(|| engine.updates())
}
