//! One variant, from its first path to the last of the given times.

use std::time::{Duration, Instant};

use super::edits;
use super::entrants::{Entrant, Subject};
use super::reference::Reference;
use super::report::{Point, RunReport, Similarity, SimilarityPoint, seconds_to};
use super::warm::NewView;
use super::{Bench, patient_run};
use crate::compare::{LinearImage, measure as compare};
use crate::engine::batches::cache_goal;
use crate::engine::figures::{self, CacheStats};
use crate::engine::{Engine, Picture, Stop, Stopwatch};
use crate::error::{Error, Result};
use crate::interrupt::is_interrupted;
use crate::output::Provenance;
use crate::output::progress::Progress;

/// A picture at one of the given times.
pub struct Look {
    pub asked: Duration,
    is_late: bool,
    pub image: LinearImage,
}

/// The references with which a run is compared.
#[derive(Clone, Copy)]
pub struct References<'a> {
    pub picture: &'a Reference,
    /// The reference whose rays are those of a march.
    pub centres: Option<&'a Reference>,
}

/// The run's figures and its pictures.
pub fn measure(
    bench: &mut Bench<'_>,
    subject: &Subject,
    entrant: &Entrant,
    references: References<'_>,
) -> Result<(RunReport, Vec<Look>)> {
    let began = Instant::now();
    let mut run = Run {
        engine: entrant.load(&bench.host, bench.volume, bench.args.seed)?,
        watch: Stopwatch::paused(),
        entrant,
        prefix: format!("{}{}", subject.prefix, entrant.file_word()),
        references,
    };
    let load_s = began.elapsed().as_secs_f64();
    let looks = run.look_at_all(bench)?;
    let took = run.watch.elapsed().as_secs_f64();
    let (paths, lookups) = (run.engine.paths(), run.engine.lookups());
    let cache = run.cache();
    let passes = figures::passes(run.engine.timings(), bench.peak.as_ref());
    let is_warm = run.fill_everywhere()?;
    let (orbit, new_view) = match is_warm {
        true => (Some(run.orbit()?), run.new_view(bench)?),
        false => (None, NewView::default()),
    };
    let isovalue = match is_warm {
        true => run.dragged_isovalue(bench)?,
        false => None,
    };
    let edit = edits::measure(&mut run.engine)?;
    let (points, looks): (Vec<Point>, Vec<Look>) = looks.into_iter().unzip();
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
        looks,
    ))
}

pub fn voxels(bench: &Bench<'_>) -> f64 {
    bench.volume.dims.iter().map(|&n| f64::from(n)).product()
}

/// How alike the pictures of two runs are at the same times.
pub fn similarity(
    entrant: &Entrant,
    subject: &Subject,
    uncached: &[Look],
    looks: &[Look],
) -> Result<Similarity> {
    let mut points = Vec::new();
    for look in looks.iter().filter(|look| !look.is_late) {
        let same_time = |other: &&Look| other.asked == look.asked && !other.is_late;
        if let Some(other) = uncached.iter().find(same_time) {
            let alike = compare(&other.image, &look.image, subject.exposure())?;
            points.push(SimilarityPoint {
                asked_s: look.asked.as_secs_f64(),
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

/// A render of which pictures are taken at the given times.
pub(super) struct Run<'a> {
    pub engine: Engine,
    pub watch: Stopwatch,
    pub entrant: &'a Entrant,
    /// Prefix of the names of its files.
    pub prefix: String,
    pub references: References<'a>,
}

impl Run<'_> {
    fn look_at_all(&mut self, bench: &mut Bench<'_>) -> Result<Vec<(Point, Look)>> {
        let longest = bench.longest();
        let mut progress = Progress::new(bench.args.quiet, Stop::after(longest));
        let mut looks = Vec::new();
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
            let name = format!("{}.{}s.exr", self.prefix, asked.as_secs_f64());
            looks.push(self.look(bench, &picture, asked, Some(name))?);
        }
        progress.finish();
        Ok(looks)
    }

    /// Fills the cache with its share of the time, then continues the picture. Where a sample has little noise of its
    /// own, a better cache is worth a new picture; elsewhere the samples so far are worth more.
    fn render_until(&mut self, asked: Duration, progress: &mut Progress) -> Result<()> {
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

    /// Compares the current picture with the reference; a picture with a name is kept.
    pub(super) fn look(
        &mut self,
        bench: &mut Bench<'_>,
        picture: &Picture,
        asked: Duration,
        file: Option<String>,
    ) -> Result<(Point, Look)> {
        let exposure = self.entrant.scene.render.exposure;
        let image = LinearImage::from_picture(&self.prefix, picture);
        let error = compare(&self.references.picture.image, &image, exposure)?;
        if let Some(name) = &file {
            let device = bench.host.summary().name.clone();
            let from = Provenance::new(self.entrant.text.clone(), bench.args.seed, device);
            bench
                .outputs
                .exr(&bench.folder.file(name), picture, &from)?;
        }
        let seconds = self.watch.elapsed().as_secs_f64();
        let noise = self.references.picture.report.noise.as_ref();
        let point = Point {
            asked_s: asked.as_secs_f64(),
            seconds,
            cpu_s: self.watch.cpu().as_secs_f64(),
            file,
            samples: self.engine.totals().samples,
            paths_per_cell: self.engine.renderer().cache().map(|c| c.updates),
            efficiency: 1.0 / (error.mse * seconds),
            within_reference_noise: noise.is_some_and(|noise| error.mse <= 2.0 * noise.mse),
            error,
        };
        let is_late = point.is_late();
        Ok((
            point,
            Look {
                asked,
                is_late,
                image,
            },
        ))
    }

    fn cache(&self) -> Option<CacheStats> {
        let goal = cache_goal(&Stop::after(self.watch.elapsed()));
        self.engine.cache_stats(goal)
    }
}

/// Paths that the cache's cells have had, where the picture's error comes from the cache alone.
fn decisive_updates(engine: &Engine) -> Option<u32> {
    let cache = engine.renderer().cache()?;
    cache.samples_are_smooth().then_some(cache.updates)
}
