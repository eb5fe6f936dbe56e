//! What the cache that a run has left is good for: frames of a moving camera, a view from elsewhere, an isovalue that is
//! dragged.

use std::time::Duration;

use super::bias::bias_apart;
use super::entrant_run::EntrantRun;
use super::report::{BiasApart, IsovalueEdit, Orbit, Point, seconds_to};
use super::{Bench, patient_run};
use crate::compare::{Comparison, LinearImage, compare_images};
use crate::engine::figures::quantile;
use crate::engine::{Batch, Engine, RAYS_PER_PIXEL, Refinement, Stop, Stopwatch};
use crate::error::{Error, Result};
use crate::interrupt::{INTERRUPTED, is_interrupted};
use crate::scene::{LightModel, Scene};

/// Views of the orbit.
const VIEWS: u32 = 24;
/// Share of the longest time during which pictures of a warm cache are taken: they are soon good enough.
const WARM_SHARE: f64 = 0.25;
/// Distance from which isovalues are dragged, as a share of the range of all values.
const DRAGGED: f64 = 0.02;

/// What a warm cache shows of a view that it does not know better than others; as in [`RunReport`](super::report::RunReport).
#[derive(Default)]
pub struct NewView {
    pub points: Vec<Point>,
    pub same_rays: Option<Comparison>,
    pub bias_apart: Option<BiasApart>,
}

/// What the cache of a run is good for; nothing without a cache, or after Ctrl-C.
#[derive(Default)]
pub struct Warm {
    pub orbit: Option<Orbit>,
    pub new_view: NewView,
    pub isovalue: Option<IsovalueEdit>,
}

/// Name of the picture of a run's new view.
pub fn new_view_file(prefix: &str) -> String {
    format!("{prefix}.new-view.exr")
}

impl EntrantRun<'_> {
    pub(super) fn warm(&mut self, bench: &mut Bench<'_>) -> Result<Warm> {
        if !self.fill_everywhere()? {
            return Ok(Warm::default());
        }
        Ok(Warm {
            orbit: Some(self.orbit()?),
            new_view: self.new_view(bench)?,
            isovalue: self.dragged_isovalue(bench)?,
        })
    }

    /// Makes the cache as good for all views as it is for the scene's own. False if there is no cache, or if Ctrl-C
    /// came before the end.
    fn fill_everywhere(&mut self) -> Result<bool> {
        match self.engine.caching() {
            Some(mut caching) => {
                caching.serve_all_views();
                caching.batch(Batch::CatchUp, &INTERRUPTED)
            }
            None => Ok(false),
        }
    }

    /// Milliseconds that all marches so far have taken on the GPU.
    fn marched_ms(&self) -> f64 {
        let total = self.engine.timings().total("ray_march");
        total.map_or(0.0, |total| total.duration_us / 1e3)
    }

    fn orbit(&mut self) -> Result<Orbit> {
        let mut march_ms = Vec::new();
        let mut frame_ms = Vec::new();
        let mut cpu_ms = Vec::new();
        for view in 1..=VIEWS {
            // The last is not yet the scene's own view, which comes next.
            let share = f64::from(view) / f64::from(VIEWS + 1);
            let watch = Stopwatch::started();
            let before = self.marched_ms();
            self.show_at_once(&Scene {
                camera: self.entrant.scene.camera.orbited(share),
                ..self.entrant.scene.clone()
            })?;
            frame_ms.push(watch.elapsed().as_secs_f64() * 1e3);
            cpu_ms.push(watch.cpu().as_secs_f64() * 1e3);
            march_ms.push(self.marched_ms() - before);
        }
        for times in [&mut march_ms, &mut frame_ms, &mut cpu_ms] {
            times.sort_by(f64::total_cmp);
        }
        Ok(Orbit {
            frames: march_ms.len(),
            march_ms_median: quantile(&march_ms, 0.5),
            march_ms_p99: quantile(&march_ms, 0.99),
            frame_ms_median: quantile(&frame_ms, 0.5),
            frame_ms_p99: quantile(&frame_ms, 0.99),
            frame_cpu_ms_median: quantile(&cpu_ms, 0.5),
        })
    }

    /// Returns to the scene's own view, which the cache does not know better than others. Also compares the march
    /// with a reference of the same rays.
    fn new_view(&mut self, bench: &mut Bench<'_>) -> Result<NewView> {
        let name = new_view_file(&self.prefix);
        let Some((marched, points)) = self.come_back(bench, Some(name))? else {
            return Ok(NewView::default());
        };
        let centres = self.references.centres;
        let same_rays =
            centres.map(|centres| compare_images(&centres.image, &marched, bench.exposure));
        let seen = centres.and_then(|centres| Some((&centres.image, centres.seen.as_deref()?)));
        Ok(NewView {
            points,
            same_rays: same_rays.transpose()?,
            bias_apart: seen.map(|(image, seen)| bias_apart(image, seen, &marched)),
        })
    }

    /// Drags the isovalues to those of the scene. `None` where that is not done in place: without a surface, or in
    /// `full` light, whose cache begins anew.
    fn dragged_isovalue(&mut self, bench: &mut Bench<'_>) -> Result<Option<IsovalueEdit>> {
        let mut beside = self.entrant.scene.clone();
        if beside.surfaces.iso.is_empty() || beside.surfaces.light == LightModel::Full {
            return Ok(None);
        }
        let [low, high] = bench.volume.range;
        for iso in &mut beside.surfaces.iso {
            iso.value += DRAGGED * (high - low);
        }
        self.show_at_once(&beside)?;
        let points = self.come_back(bench, None)?.map(|(_, points)| points);
        Ok(points.map(|points| IsovalueEdit {
            seconds_to_40_db: seconds_to(40.0, &points),
            points,
        }))
    }

    /// Returns from an edited scene to the scene itself: first the march that is shown at once, then, as in the window,
    /// more rays of it and what samples make of them. Returns that march, and the figures of all. `None` without a cache.
    fn come_back(
        &mut self,
        bench: &mut Bench<'_>,
        file: Option<String>,
    ) -> Result<Option<(LinearImage, Vec<Point>)>> {
        let most = bench.longest().mul_f64(WARM_SHARE);
        bench.wake();
        self.watch = Stopwatch::started();
        self.show_at_once(&self.entrant.scene)?;
        self.watch.pause();
        let Some(mut picture) = self.engine.march()? else {
            return Ok(None);
        };
        let marched = self.snapshot(bench, &picture, Duration::ZERO, file)?;
        let mut points = vec![marched.point];
        let mut refinement = None;
        for asked in bench.seconds.clone() {
            if asked > most && points.len() > 1 {
                break;
            }
            if self.watch.elapsed() >= asked {
                continue;
            }
            bench.wake();
            self.watch.go_on();
            let refined = self.refine_until(asked, &mut refinement);
            self.watch.pause();
            match refined {
                Err(Error::Interrupted) => break,
                other => picture.show(&other?),
            }
            if is_interrupted() {
                break;
            }
            points.push(self.snapshot(bench, &picture, asked, None)?.point);
        }
        Ok(Some((marched.image, points)))
    }

    /// Marches more rays of each pixel, and then takes samples, until so much time is over. Returns the picture.
    fn refine_until(
        &mut self,
        asked: Duration,
        refinement: &mut Option<Refinement>,
    ) -> Result<Vec<[f32; 4]>> {
        while let Some(mut caching) = self.engine.caching()
            && refinement.is_none()
        {
            if self.watch.elapsed() >= asked {
                return caching.marched();
            }
            caching.march_another_ray()?;
            if caching.rays() == RAYS_PER_PIXEL {
                *refinement = Some(Refinement::of(caching.marched()?));
            }
        }
        let mut compare = |engine: &mut Engine| {
            let samples = engine.totals().samples;
            if let Some(refinement) = refinement
                && refinement.is_due(samples)
            {
                refinement.compare(samples, &engine.film()?.mean);
            }
            Ok(())
        };
        let mut silent = |_| {};
        let mut run = patient_run(Stop::after(asked), &mut silent);
        run.between = Some(&mut compare);
        self.engine.sample(&mut run, &self.watch)?;
        let samples = self.engine.totals().samples;
        let mean = self.engine.film()?.mean;
        Ok(match refinement {
            Some(refinement) => refinement.picture(samples, &mean),
            None => mean,
        })
    }

    /// Marches an edited scene through the existing cache.
    fn show_at_once(&mut self, scene: &Scene) -> Result<()> {
        self.engine.change_in_place(scene)?.must_be_possible()?;
        match self.engine.caching() {
            Some(mut caching) => caching.march_in_place(),
            None => Ok(()),
        }
    }
}
