//! Chooses between caching and non-caching by a short trial of both on the device, and where the volume streams, between
//! a fine cache and a coarser one that leaves room for more bricks.
//!
//! A cache has to be compiled for and filled before it saves anything, and where surfaces are seen a sample through it
//! still has noise: which variant is faster depends on the scene, the device, the number of pictures and how good they
//! are to be. Pictures of few pixels tell what a sample costs in either variant and how noisy it is, and a first few
//! batches tell how fast a cache fills. The rest is arithmetic (`forecast/`).
//!
//! A trial takes time as well. The variant without a cache is tried first, and where it will soon be done, it is taken.
//!
//! Where samples are counted, the plan's choice stands: the same command then gives the same bits.

use std::time::{Duration, Instant};

use super::batches::FEWEST_UPDATES;
use super::forecast::{CachedForecast, Forecast, SampleForecast};
use super::setup::Setup;
use super::task::Task;
use super::verdict::{Verdict, reason};
use super::{Engine, Stopwatch};
use crate::error::Result;
use crate::render::{Batch, Cache, Choice, Until, next_batch_size};
use crate::scene::Variant;

/// Trials of caches take this share of what the work would take without one, at most.
const SHARE: f64 = 0.2;
/// A cache is not tried where the work without one takes less than so many times what compiling and loading for it have
/// taken: to do the same for a cache, and to go back, takes three to four times as long.
const WORTH_A_TRIAL: f64 = 10.0;

/// The choice of a variant, and the engine with which it begins.
pub struct Trial<'a> {
    setup: Setup<'a>,
    engine: Engine,
    /// What there is to decide; `None` where it is clear with what to render.
    open: Option<Open<'a>>,
}

/// How a trial has ended.
pub struct Tried {
    pub engine: Engine,
    /// The time that the work which goes on has taken; it stands still.
    pub watch: Stopwatch,
    /// Whether an interruption came before it was known which variant is the fastest.
    pub was_interrupted: bool,
}

/// A choice that is open.
struct Open<'a> {
    task: Task<'a>,
    /// The plan's choice, and the one without a cache.
    chosen: Choice,
    plain: Choice,
    /// Seconds that it took to make the engine without a cache.
    making: f64,
}

const TOO_SHORT: &str = "the work is too short to fill a cache for it";
const TOO_SLOW: &str = "it would have taken too long to try a cache";

impl<'a> Trial<'a> {
    /// Brings the scene onto the GPU according to the plan's `choice`, or, where that may not be the fastest for the work,
    /// without a cache. Nothing is sampled yet. Without `task`, the choice has been made before.
    ///
    /// # Errors
    ///
    /// The same as for [`Engine::new`].
    pub fn begin(setup: Setup<'a>, choice: Choice, task: Option<Task<'a>>) -> Result<Trial<'a>> {
        let scene = setup.scene;
        let may_cache = choice.plan.bricks.is_some() || choice.plan.variant.cache().is_some();
        let open = task.filter(|task| {
            scene.render.variant == Variant::Auto && task.stop.divides_time() && may_cache
        });
        let (engine, open) = match open {
            None => (setup.engine(choice)?, None),
            Some(task) => {
                let mut without_cache = scene.clone();
                without_cache.render.variant = Variant::NonCaching;
                let plain = setup.host.plan(setup.volume, &without_cache)?;
                let began = Instant::now();
                let engine = setup.engine(plain.clone())?;
                let open = Open {
                    task,
                    chosen: choice,
                    plain,
                    making: began.elapsed().as_secs_f64(),
                };
                (engine, Some(open))
            }
        };
        Ok(Trial {
            setup,
            engine,
            open,
        })
    }

    /// Whether there is anything to try.
    pub fn is_open(&self) -> bool {
        self.open.is_some()
    }

    /// The time that the engine's passes took to compile.
    pub fn compiling(&self) -> Duration {
        self.engine.compiling()
    }

    /// The engine in the variant that is expected to be the fastest for the work, of those that the scene allows and that
    /// fit. What a trial has put into a cache stays there, unless a finer one was tried before it and is taken, and so do the
    /// first samples of a picture that were taken at full size.
    ///
    /// The variant without a cache is tried first, and where the work takes long enough, the caches that the plan leaves open.
    ///
    /// # Errors
    ///
    /// The same as for [`Engine::new`].
    pub fn end(mut self) -> Result<Tried> {
        let Some(Open {
            task,
            chosen,
            plain,
            making,
        }) = self.open.take()
        else {
            return Ok(Tried::decided(self.engine, Stopwatch::paused()));
        };
        let mut watch = Stopwatch::started();
        let short = WORTH_A_TRIAL * making;
        let until = task.until(task.stop.time);
        let tried = self.engine.try_samples(&task, short, until)?;
        watch.pause();
        let totals = self.engine.totals();
        // The samples of a small trial picture are discarded, and their time does not count. If the time was too short even
        // for these, it counts.
        if tried.is_some() && totals.samples == 0 {
            watch = Stopwatch::paused();
        }
        let Some(uncached) = tried else {
            return Ok(Tried::in_vain(self.engine, watch, &task, TOO_SHORT.into()));
        };
        if uncached.variance.is_finite() && uncached.seconds_of(&task) <= short {
            self.engine.choice.reason = TOO_SHORT.into();
            return Ok(Tried::decided(self.engine, watch));
        }
        let setup = self.setup;
        let caches = setup.host.caches(setup.volume, setup.scene, &chosen)?;
        if caches.is_empty() {
            self.engine.choice.reason = chosen.reason;
            return Ok(Tried::decided(self.engine, watch));
        }
        let begun = match totals.samples {
            0 => None,
            _ => Some(self.engine.sums()?),
        };
        drop(self.engine);
        match setup.best_of(caches, &uncached, &task, making, &mut watch)? {
            Contest::Won(engine, watch) => Ok(Tried::decided(*engine, watch)),
            Contest::Lost { why } => {
                let mut engine = setup.engine(plain)?;
                if let Some(sums) = begun {
                    engine.resume(&sums, totals)?;
                }
                Ok(Tried::in_vain(engine, watch, &task, why))
            }
        }
    }
}

impl Tried {
    fn decided(engine: Engine, watch: Stopwatch) -> Tried {
        Tried {
            engine,
            watch,
            was_interrupted: false,
        }
    }

    /// The variant without a cache, which was taken because of `why`, or because the work was interrupted.
    fn in_vain(mut engine: Engine, watch: Stopwatch, task: &Task<'_>, why: String) -> Tried {
        let was_interrupted = task.is_interrupted();
        engine.choice.reason = if was_interrupted {
            "it was interrupted".into()
        } else {
            why
        };
        Tried {
            engine,
            watch,
            was_interrupted,
        }
    }
}

/// Whether a cache is expected to be faster than none.
enum Contest {
    /// With a cache that is better, and the time that the work which goes on has taken.
    Won(Box<Engine>, Stopwatch),
    Lost {
        why: String,
    },
}

/// What a trial has found out about a cache.
struct TriedCache {
    forecast: CachedForecast,
    is_better: bool,
}

impl Setup<'_> {
    /// Looks for the best of these caches that is better than none. Apart from compiling for them, caches that are tried
    /// share a time that is short beside the work's. If that was in vain, `watch` has it as well. `making`: seconds that it
    /// takes to make an engine.
    fn best_of(
        &self,
        caches: Vec<Choice>,
        uncached: &SampleForecast,
        task: &Task<'_>,
        making: f64,
        watch: &mut Stopwatch,
    ) -> Result<Contest> {
        let sampled = watch.elapsed().as_secs_f64();
        let end = sampled + SHARE * uncached.seconds_of(task);
        let mut best: Option<(Choice, CachedForecast)> = None;
        let mut why = TOO_SLOW.to_string();
        let last = caches.len() - 1;
        for (n, mut choice) in caches.into_iter().enumerate() {
            let mut engine = self.engine(choice.clone())?;
            // Some drivers compile a pass when it first runs, which tells nothing of how long it takes.
            engine.warm_up()?;
            // What is kept of the picture without a cache need not be sampled again.
            let (rival, to_go_back) = match &best {
                None => (Forecast::Uncached(*uncached), making - sampled),
                Some((_, best)) => (Forecast::Cached(*best), making),
            };
            let mut filling = Stopwatch::paused();
            let left = (end - watch.elapsed().as_secs_f64()).max(0.0);
            let until = task.until(Duration::try_from_secs_f64(left).ok());
            watch.go_on();
            let tried = engine.try_cache(&rival, task, to_go_back, until, &mut filling)?;
            watch.pause();
            let Some(tried) = tried else {
                break;
            };
            let reason = reason(uncached, &tried.forecast, task);
            if tried.is_better {
                choice.reason = format!("{reason}; {}", choice.reason);
                if n == last {
                    engine.choice = choice;
                    return Ok(Contest::Won(Box::new(engine), filling));
                }
                best = Some((choice, tried.forecast));
            } else if best.is_none() {
                why = reason;
            }
        }
        match best {
            // The engines with caches are gone: after an interruption only the samples taken without a cache exist.
            _ if task.is_interrupted() => Ok(Contest::Lost { why }),
            Some((choice, _)) => {
                let spent = std::mem::replace(watch, Stopwatch::paused());
                Ok(Contest::Won(Box::new(self.engine(choice)?), spent))
            }
            None => Ok(Contest::Lost { why }),
        }
    }
}

impl Engine {
    /// Fills and samples the cache, with the time of its filling on `watch`, and tells whether it is better than `rival`.
    /// `to_go_back` is the seconds that returning to the rival costs: making its engine again, minus the sampling that need
    /// not be repeated. It is negative if the latter is more. `None` if `until` comes before the result.
    ///
    /// While nodes have only gathered, the estimated error of the cache is uncertain. So as long as the cache is the better
    /// choice it is filled further, which is no loss if it is taken, until it is good enough or `until` comes. Where the
    /// volume streams, it is filled until its error is known, even beyond `until`.
    fn try_cache(
        &mut self,
        rival: &Forecast,
        task: &Task<'_>,
        to_go_back: f64,
        until: Until<'_>,
        watch: &mut Stopwatch,
    ) -> Result<Option<TriedCache>> {
        if task.pictures > 1 {
            self.serve_all_views();
        }
        while self.updates() < FEWEST_UPDATES {
            if !self.fill_on(until, watch)? {
                return Ok(None);
            }
        }
        let Some(samples) = self.try_samples(task, 0.0, until)? else {
            return Ok(None);
        };
        self.begin_picture();
        loop {
            let cached = CachedForecast {
                samples,
                fill: self.filling().expect("only caches are tried"),
            };
            let head_start = to_go_back + self.seconds_filled();
            let is_better = Verdict::of(rival, &cached, task).cache_is_better(head_start);
            let is_known = |cache: &Cache| cache.filling.is_known_to(f64::INFINITY);
            let is_decided = if until.is_over() {
                // To be wrong costs most where paths wait for bricks.
                !self.streams() || self.renderer.cache().is_some_and(is_known)
            } else {
                self.is_filled_for(Some(cached), &task.stop, task.pictures)
            };
            if !is_better || is_decided || !self.fill_on(task.interrupt.into(), watch)? {
                return Ok(Some(TriedCache {
                    forecast: cached,
                    is_better,
                }));
            }
        }
    }

    /// Gives the cache its next batch of paths. Returns false if `until` comes before that is done.
    fn fill_on(&mut self, until: Until<'_>, watch: &mut Stopwatch) -> Result<bool> {
        let updates = self.updates();
        let Some(mut caching) = self.renderer.caching() else {
            return Ok(false);
        };
        watch.go_on();
        let is_done = caching.batch(Batch::Paths(next_batch_size(updates)), until);
        watch.pause();
        is_done
    }
}
