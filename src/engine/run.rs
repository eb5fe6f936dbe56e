//! A render: a cache is filled (`filling.rs`), and then unit after unit of samples is taken for the picture, until its stop is
//! reached.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::Engine;
use super::estimates::Estimates;
use super::schedule::{next_unit, units_together};
use super::stop::{Sampled, Stop, StopReason, with_delay};
use super::stopwatch::Stopwatch;
use crate::error::{Error, Lacking, Result};
use crate::render::{Film, Until};

/// A function that is called between two pieces of work.
pub type Between<'a> = &'a mut dyn FnMut(&mut Engine) -> Result<()>;

/// When a render ends, and where it reports its progress.
pub struct Run<'a> {
    pub stop: Stop,
    /// Setting this flag ends the render at the end of the dispatch under way.
    pub interrupt: Option<&'a AtomicBool>,
    pub progress: &'a mut dyn FnMut(Progress),
    /// Whether to wait for the first picture, however late it is; otherwise a time that is too short for one is an
    /// error.
    pub waits: bool,
    /// Called after each batch of paths and each unit of samples, whenever the state could be saved and continued
    /// later.
    pub between: Option<Between<'a>>,
}

/// The progress of a render. Errors are not finite while they are unknown.
#[derive(Debug, Clone, Copy)]
pub enum Progress {
    /// A batch of paths for the cache has ended.
    Batch { updates: u32, relative_error: f64 },
    /// A unit of samples has ended.
    Unit(Sampled),
}

/// How a render ended.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// Samples in every pixel.
    pub samples: u32,
    pub took: Duration,
    /// CPU time of all cores: it is the measure where the device is a busy CPU.
    pub cpu: Duration,
    /// Infinite where there is a single unit, whose error is unknown.
    pub relative_error: f64,
    /// When there was a picture to see.
    pub first_frame: Instant,
    pub stopped: StopReason,
}

impl Engine {
    /// Fills the cache, if the variant has one, and takes samples until `stop` is reached, as [`sample`](Engine::sample) does.
    /// An empty stop, or one that is never reached, goes on for ever.
    pub fn render(&mut self, stop: Stop) -> Result<Outcome> {
        let mut run = Run {
            stop,
            interrupt: None,
            progress: &mut |_| {},
            waits: false,
            between: None,
        };
        let watch = Stopwatch::started();
        self.fill(&mut run, 1)?;
        self.sample(&mut run, &watch)
    }

    /// Takes unit after unit of samples, in addition to those that the picture has already, until the run's stop or
    /// its interruption. With a shard whose first sample is another one than the picture's, the picture is begun anew. Time
    /// is measured by `watch`; a unit that is under way when the time is over is dropped. Fails with
    /// [`Error::Interrupted`] if there is no picture yet, and with [`Error::TooShort`] if the time is too short for one.
    pub fn sample(&mut self, run: &mut Run<'_>, watch: &Stopwatch) -> Result<Outcome> {
        self.begin_at_first_of(&run.stop);
        let totals = self.renderer.totals();
        let before = watch.elapsed();
        let mut so_far = Sampled {
            first_sample: totals.first_sample,
            samples: totals.samples,
            units: totals.units,
            took: before,
            seconds_per_sample: self.seconds_per_sample,
            // A picture that is continued may be good enough already.
            relative_error: match run.stop.relative_error {
                Some(_) if totals.units > 0 => self.sure_error()?,
                _ => f64::INFINITY,
            },
        };
        let mut estimates = Estimates::from(so_far.took);
        let stopped = loop {
            if let Some(reason) = run.stop.reason(&so_far) {
                break reason;
            }
            if !self.take_units(run, &so_far, watch)? {
                if run.is_interrupted() {
                    break StopReason::Interrupted;
                }
                if so_far.units == 0 {
                    return Err(self.too_short(&run.stop, watch));
                }
                so_far.took = watch.elapsed();
                continue;
            }
            so_far.samples = self.renderer.totals().samples;
            so_far.units = self.renderer.totals().units;
            so_far.took = watch.elapsed();
            if estimates.is_due(&run.stop, &so_far) {
                so_far.relative_error = self.sure_error()?;
                let estimate = watch.elapsed() - so_far.took;
                so_far.took += estimate;
                estimates.made(&run.stop, &so_far, estimate);
            }
            let taken = f64::from(so_far.samples - totals.samples);
            so_far.seconds_per_sample = (so_far.took - before).as_secs_f64() / taken;
            self.seconds_per_sample = so_far.seconds_per_sample;
            (run.progress)(Progress::Unit(so_far));
            run.call_between(self)?;
        };
        self.outcome(run, &so_far, watch, stopped)
    }

    /// Begins the picture anew with the first sample of a shard, unless it goes on with that shard.
    fn begin_at_first_of(&mut self, stop: &Stop) {
        let totals = self.totals();
        if let Some(range) = stop.shard()
            && (totals.samples == 0 || totals.first_sample != range.first)
        {
            self.renderer.begin_at_sample(range.first);
        }
    }

    /// Takes the next unit of samples, or several together where the volume streams. Returns whether it has ended before it
    /// had to stop.
    fn take_units(&mut self, run: &Run<'_>, so_far: &Sampled, watch: &Stopwatch) -> Result<bool> {
        let until = self.until(run, so_far, watch);
        let samples = next_unit(&run.stop, so_far);
        let units = if self.streams() {
            units_together(&run.stop, so_far)
        } else {
            1
        };
        self.renderer.units(samples, units, until)
    }

    /// The outcome of a run. Fails if the picture has no sample.
    fn outcome(
        &mut self,
        run: &Run<'_>,
        so_far: &Sampled,
        watch: &Stopwatch,
        stopped: StopReason,
    ) -> Result<Outcome> {
        let Some(first_frame) = self.totals().seen_since else {
            return Err(if run.is_interrupted() {
                Error::Interrupted
            } else {
                Error::value(format!("the picture has no sample, since {stopped}"))
            });
        };
        Ok(Outcome {
            samples: so_far.samples,
            took: so_far.took,
            cpu: watch.cpu(),
            relative_error: self.relative_error()?,
            first_frame,
            stopped,
        })
    }

    /// When the next unit has to stop.
    fn until<'a>(&self, run: &Run<'a>, so_far: &Sampled, watch: &Stopwatch) -> Until<'a> {
        let is_first = so_far.units == 0;
        let has_light = self.updates() > 0;
        let time = match (run.stop.time, self.renderer.cache()) {
            _ if is_first && run.waits => None,
            // Without light in the cache there is no picture, however long the sample takes.
            (Some(_), Some(_)) if !has_light => Some(Duration::ZERO),
            // The cache's first paths may have been late already.
            (Some(time), Some(_)) if is_first => Some(with_delay(time.max(so_far.took))),
            (Some(_), None) if is_first => run.stop.late(),
            (time, _) => time,
        };
        Until {
            // An interruption waits for the end of the first unit, so that there is a picture to write.
            interrupt: run.interrupt.filter(|_| !(has_light && is_first)),
            ..run.until(time, watch.elapsed())
        }
    }

    fn too_short(&self, stop: &Stop, watch: &Stopwatch) -> Error {
        Error::TooShort {
            time: stop.time.unwrap_or_default(),
            spent: watch.elapsed(),
            lacking: match self.renderer.cache() {
                None => Lacking::Sample,
                Some(cache) if cache.filling.updates == 0 => Lacking::CachePaths,
                Some(_) => Lacking::SampleThroughCache,
            },
        }
    }

    /// Relative error of the picture so far; infinite while a single unit of samples says nothing about it, or samples have met
    /// no light although there is some.
    pub fn relative_error(&mut self) -> Result<f64> {
        let film = self.film_with_spread()?;
        Ok(film.map_or(f64::INFINITY, |film| self.relative_error_of(&film)))
    }

    /// The same as far as a stop may rely on it ([`sure_error_of`](Engine::sure_error_of)).
    pub(super) fn sure_error(&mut self) -> Result<f64> {
        let film = self.film_with_spread()?;
        Ok(film.map_or(f64::INFINITY, |film| self.sure_error_of(&film)))
    }

    /// `None` while a single unit of samples has no spread.
    fn film_with_spread(&mut self) -> Result<Option<Film>> {
        match self.renderer.totals().units {
            1 => Ok(None),
            _ => self.renderer.film().map(Some),
        }
    }
}

impl<'a> Run<'a> {
    /// Until the interruption, or until so much `time` is over, of which work has `spent` some.
    pub(super) fn until(&self, time: Option<Duration>, spent: Duration) -> Until<'a> {
        let left = time.map(|time| time.saturating_sub(spent));
        Until::within(self.interrupt, left)
    }

    pub(super) fn call_between(&mut self, engine: &mut Engine) -> Result<()> {
        match &mut self.between {
            Some(between) => between(engine),
            None => Ok(()),
        }
    }

    pub fn is_interrupted(&self) -> bool {
        self.interrupt
            .is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}
