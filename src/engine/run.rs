//! The loops of a render: batches of paths for the cache, then unit after unit of samples for the picture, until it is
//! enough.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::Engine;
use super::picture::{relative_error, rgb};
use super::schedule::{
    Done, Filled, Stop, cache_goal, next_batch, next_unit, reason_to_stop, units_together,
};
use super::stopwatch::Stopwatch;
use crate::error::{Error, Place, Result};
use crate::render::Until;

/// Where nothing stops by it, the error is looked at for progress alone: a picture's download takes time.
const TIME_TO_LOOK: Duration = Duration::from_millis(500);

/// For work that an interruption has to wait for.
static UNSTOPPABLE: AtomicBool = AtomicBool::new(false);

/// A first sample that is late may take the time asked for once more, and at least this long: a picture a little late
/// is better than none.
const LEAST_DELAY: Duration = Duration::from_secs(5);

/// What is done between two pieces of work.
pub type Between<'a> = &'a mut dyn FnMut(&mut Engine) -> Result<()>;

/// How a render is told when to end, and how it tells how far it has come.
pub struct Run<'a> {
    pub stop: Stop,
    /// Whoever raises it ends the render at the end of the dispatch under way.
    pub interrupt: &'a AtomicBool,
    pub progress: &'a mut dyn FnMut(Progress),
    /// Waits for the first picture, however late it is; otherwise a time that is too short for one is an error.
    pub waits: bool,
    /// Called after each batch of paths and each unit of samples, when one could go on later from what there is.
    pub between: Option<Between<'a>>,
}

/// How far a render has come. Errors are not finite while they are unknown.
#[derive(Debug, Clone, Copy)]
pub enum Progress {
    /// A batch of paths for the cache has ended.
    Filled { updates: u32, relative_error: f64 },
    /// A unit of samples has ended.
    Sampled {
        spp: u32,
        seconds: f64,
        relative_error: f64,
    },
}

/// How a render ended.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// Samples in every pixel.
    pub samples: u32,
    pub took: Duration,
    /// The time of all of the processor's cores, which is what counts where the device is a busy CPU.
    pub cpu: Duration,
    /// Infinite where a single unit says nothing of it.
    pub relative_error: f64,
    /// When there was a picture to see. `None` if it had all its samples before.
    pub first_frame: Option<Instant>,
    /// The end of a sentence: "stopped because …".
    pub why_stopped: String,
}

impl Engine {
    /// Fills the cache, if the variant has one, and takes samples, until `stop` is reached. A stop that never comes,
    /// such as no stop at all, goes on for ever.
    pub fn render(&mut self, stop: Stop) -> Result<Outcome> {
        let never = AtomicBool::new(false);
        let mut run = Run {
            stop,
            interrupt: &never,
            progress: &mut |_| {},
            waits: false,
            between: None,
        };
        let watch = Stopwatch::started();
        self.fill(&mut run, 1)?;
        self.sample(&mut run, &watch)
    }

    /// Fills the cache, batch after batch, until it shows `pictures` that are good enough for the run. Returns whether
    /// it does; if not, the run was interrupted in the middle of a batch.
    pub fn fill(&mut self, run: &mut Run<'_>, pictures: u32) -> Result<bool> {
        let spent = self
            .renderer
            .cache()
            .map_or(Duration::ZERO, |cache| cache.took);
        let deadline = run
            .stop
            .time
            .map(|time| Instant::now() + time.saturating_sub(spent));
        while let Some(samples) = self.next_batch(&run.stop, pictures)
            && let Some(mut caching) = self.renderer.caching()
        {
            let until = Until {
                interrupt: run.interrupt,
                deadline: deadline.filter(|_| !run.waits || caching.updates() > 0),
            };
            if !caching.batch(samples, until)? {
                return Ok(false);
            }
            if let Some(cache) = self.renderer.cache() {
                (run.progress)(Progress::Filled {
                    updates: cache.updates,
                    relative_error: cache.relative_error,
                });
            }
            run.pause(self)?;
        }
        Ok(true)
    }

    /// Paths for each node in sight in the next batch; `None` if the cache is good enough, or there is none. With 0, nodes
    /// that have come in sight get what they lack.
    fn next_batch(&self, stop: &Stop, pictures: u32) -> Option<u32> {
        let cache = self.renderer.cache()?;
        if cache.updates > 0 && !cache.is_caught_up() {
            return Some(0);
        }
        let [width, height] = self.scene.render.size;
        let pixels = f64::from(width) * f64::from(height) * f64::from(pictures);
        let filled = Filled {
            updates: cache.updates,
            took: cache.took,
            is_good: cache.is_known_to(cache_goal(stop)),
            samples_are_smooth: cache.samples_are_smooth(),
            seconds_per_update: cache.seconds_per_update(),
            paths_per_pixel: cache.paths_in_light() as f64 / pixels,
        };
        next_batch(stop, &filled)
    }

    /// Takes unit after unit of samples, on top of those that the picture has already, until the run's stop or its
    /// interruption. Time is what `watch` shows; a unit that is under way when it is over is dropped. Fails with
    /// [`Error::Interrupted`] if there is no picture yet, and with [`Error::Input`] if the time is too short for one.
    pub fn sample(&mut self, run: &mut Run<'_>, watch: &Stopwatch) -> Result<Outcome> {
        let mut first_frame = None;
        let totals = self.renderer.totals();
        let mut done = Done {
            first_sample: totals.first_sample,
            samples: totals.samples,
            units: totals.units,
            took: watch.elapsed(),
            // A picture that goes on may be good enough already.
            relative_error: match run.stop.relative_error {
                Some(_) if totals.units > 0 => self.relative_error()?,
                _ => f64::INFINITY,
            },
        };
        let mut looked = done.took;
        let why_stopped = loop {
            if let Some(reason) = reason_to_stop(&run.stop, &done) {
                break reason;
            }
            let until = self.until(run, &done, watch);
            let samples = next_unit(&run.stop, &done);
            let units = match self.renderer.brick_figures() {
                Some(_) => units_together(&run.stop, &done),
                None => 1,
            };
            if !self.renderer.units(samples, units, until)? {
                match run.is_interrupted() {
                    true => break "it was interrupted".into(),
                    false if done.units == 0 => return Err(too_short(&run.stop, watch)),
                    false => done.took = watch.elapsed(),
                }
                continue;
            }
            first_frame.get_or_insert_with(Instant::now);
            done.samples = self.renderer.totals().samples;
            done.units = self.renderer.totals().units;
            if run.stop.relative_error.is_some() || watch.elapsed() >= looked + TIME_TO_LOOK {
                done.relative_error = self.relative_error()?;
                looked = watch.elapsed();
            }
            done.took = watch.elapsed();
            (run.progress)(Progress::Sampled {
                spp: done.samples,
                seconds: done.took.as_secs_f64(),
                relative_error: done.relative_error,
            });
            run.pause(self)?;
        };
        if done.units == 0 {
            return Err(Error::Interrupted);
        }
        Ok(Outcome {
            samples: done.samples,
            took: done.took,
            cpu: watch.cpu(),
            relative_error: self.relative_error()?,
            first_frame,
            why_stopped,
        })
    }

    /// Until when the next unit may take.
    fn until<'a>(&self, run: &Run<'a>, done: &Done, watch: &Stopwatch) -> Until<'a> {
        let is_first = done.units == 0;
        let time = match (run.stop.time, self.renderer.cache()) {
            _ if is_first && run.waits => None,
            // Without light there is no picture, however long one waits.
            (Some(time), Some(cache)) if cache.updates == 0 => Some(time),
            (Some(time), _) if is_first => Some(time + time.max(LEAST_DELAY)),
            (time, _) => time,
        };
        // Whoever interrupts the filling of a cache still gets the picture that it shows.
        let has_light = self.renderer.cache().is_some_and(|c| c.updates > 0);
        Until {
            interrupt: match has_light && is_first {
                true => &UNSTOPPABLE,
                false => run.interrupt,
            },
            deadline: time.map(|time| Instant::now() + time.saturating_sub(watch.elapsed())),
        }
    }

    /// Relative error of the picture so far; infinite while a single unit of samples says nothing about it.
    pub fn relative_error(&mut self) -> Result<f64> {
        if self.renderer.totals().units == 1 {
            return Ok(f64::INFINITY);
        }
        let film = self.renderer.film()?;
        Ok(relative_error(&rgb(&film.mean), &film.stderr))
    }
}

fn too_short(stop: &Stop, watch: &Stopwatch) -> Error {
    let time = stop.time.unwrap_or_default().as_secs_f64();
    let problem = format!(
        "after {:.1} s not every pixel has had its first sample: nothing was written; give it more time or fewer pixels, \
         or limit paths by render.max_bounces",
        watch.elapsed().as_secs_f64(),
    );
    Error::input(Place::flag(format!("--time {time}")), problem)
}

impl Run<'_> {
    fn pause(&mut self, engine: &mut Engine) -> Result<()> {
        match &mut self.between {
            Some(between) => between(engine),
            None => Ok(()),
        }
    }

    pub fn is_interrupted(&self) -> bool {
        self.interrupt.load(Ordering::Relaxed)
    }
}
