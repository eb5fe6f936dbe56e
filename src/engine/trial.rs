//! Chooses between caching and non-caching by a short trial of both on the device, and where the volume streams, between
//! a fine cache and a coarser one that leaves room for more bricks.
//!
//! A cache has to be compiled for and filled before it saves anything, and where surfaces are seen a sample through it
//! still has noise: which variant is faster depends on the scene, the device, the number of pictures and how good they
//! are to be. Pictures of few pixels tell what a sample costs in either variant and how noisy it is, and a first few
//! batches tell how fast a cache fills. The rest is arithmetic (`forecast.rs`).
//!
//! A trial takes time as well. The variant without a cache is tried first, and where it will soon be done, it is taken.
//!
//! Where samples are counted, the plan's choice stands: the same command then gives the same bits.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::forecast::{FEW, Filling, Forecast, MORE, SAMPLES, apart, evenness, verdict};
use super::schedule::{Stop, cache_goal};
use super::{Engine, Host};
use crate::error::Result;
use crate::render::shared::GATHERED;
use crate::render::{Choice, doubling, worth};
use crate::scene::volume::Volume;
use crate::scene::{Scene, Variant};

/// Pixels of the pictures that are tried: a GPU needs many to be busy.
const PIXELS_CPU: f64 = 4096.0;
const PIXELS_GPU: f64 = 262_144.0;
/// Paths a node that tell for the first time how fast a cache fills and how noisy its light is.
const UPDATES: u32 = 8;
/// Trials of caches may take this share of what the work would take without one.
const SHARE: f64 = 0.2;
/// A cache is not tried where the work without one takes less than so many times what it has taken to find that out: to
/// compile for a cache, to fill it a little and to go back takes about twice as long.
const WORTH_A_TRIAL: f64 = 3.0;

/// What an engine is made for.
#[derive(Debug, Clone, Copy)]
pub struct Work<'a> {
    pub stop: Stop,
    /// Pictures of the same light: the views of an orbit.
    pub pictures: u32,
    /// Setting this flag ends the trial; the engine that exists then goes on.
    pub interrupt: &'a AtomicBool,
}

impl Engine {
    /// Brings the scene onto the GPU in the variant that is expected to be the fastest for the work, of those that the
    /// scene allows and that fit. What a trial has put into a cache stays there.
    ///
    /// # Errors
    ///
    /// The same as for [`Engine::new`].
    pub fn for_work(
        host: &Host,
        volume: &Volume,
        scene: &Scene,
        choice: Choice,
        seed: u32,
        work: Work<'_>,
    ) -> Result<Engine> {
        let is_open = scene.render.variant == Variant::Auto && work.stop.count().is_none();
        let caches = match is_open {
            true => host.caches(volume, scene, &choice)?,
            false => Vec::new(),
        };
        if caches.is_empty() {
            return Engine::with_plan(host, volume, scene, choice, seed);
        }
        let mut without_cache = scene.clone();
        without_cache.render.variant = Variant::NonCaching;
        let plain = host.plan(volume, &without_cache)?;
        let without = |reason: &str| {
            let choice = Choice {
                reason: reason.into(),
                ..plain.clone()
            };
            Engine::with_plan(host, volume, scene, choice, seed)
        };
        const TOO_SHORT: &str = "the work is done before a cache would be filled";
        let began = Instant::now();
        let mut engine = without(TOO_SHORT)?;
        let making = began.elapsed().as_secs_f64();
        let uncached = engine.try_samples(&work)?;
        let seconds = uncached.seconds_of(&work);
        if seconds <= WORTH_A_TRIAL * began.elapsed().as_secs_f64() {
            return Ok(engine);
        }
        drop(engine);
        let mut left = SHARE * seconds;
        let mut best: Option<(Choice, Forecast)> = None;
        let mut why = TOO_SHORT.to_string();
        let last = caches.len() - 1;
        for (n, choice) in caches.into_iter().enumerate() {
            let mut engine = Engine::with_plan(host, volume, scene, choice.clone(), seed)?;
            let rival = best.as_ref().map_or(&uncached, |(_, forecast)| forecast);
            let tried = engine.try_cache(rival, &work, making, left)?;
            left -= engine.seconds_filled();
            let Some((cached, is_better)) = tried else {
                continue;
            };
            let said = verdict(&uncached, &cached, &work, 0.0).1;
            if is_better {
                why = format!("{said}; {}", choice.reason);
                if n == last {
                    engine.choice.reason = why;
                    return Ok(engine);
                }
                best = Some((choice, cached));
            } else if best.is_none() {
                why = said;
            }
        }
        let Some((choice, _)) = best else {
            return without(&why);
        };
        let choice = Choice {
            reason: why,
            ..choice
        };
        Engine::with_plan(host, volume, scene, choice, seed)
    }

    /// Takes a few samples, and forgets them.
    fn try_samples(&mut self, work: &Work<'_>) -> Result<Forecast> {
        let forecast = match self.renderer.brick_figures() {
            Some(_) => self.try_in_bricks(work)?,
            None => self.try_few_pixels(work)?,
        };
        self.begin_picture();
        Ok(forecast)
    }

    /// Begins the picture with all its pixels: fewer would need as many bricks, and say little about the time.
    fn try_in_bricks(&mut self, work: &Work<'_>) -> Result<Forecast> {
        self.renderer.unit(1, work.interrupt)?;
        let few = self.time_units(1, FEW, work)?;
        let more = self.time_units(1, MORE, work)?;
        let (seconds_per_sample, seconds_per_bundle) = apart(few, more);
        Ok(Forecast {
            seconds_per_sample,
            seconds_per_bundle,
            variance: f64::from(self.totals().samples) * self.variance_of_samples()?,
            evenness: 1.0,
            cache: None,
        })
    }

    /// Takes samples of few pixels.
    fn try_few_pixels(&mut self, work: &Work<'_>) -> Result<Forecast> {
        let size = self.scene.render.size;
        let pixels = |size: [u32; 2]| f64::from(size[0]) * f64::from(size[1]);
        let most = match self.host.summary().kind.is_software() {
            true => PIXELS_CPU,
            false => PIXELS_GPU,
        };
        let scale = (most / pixels(size)).sqrt().min(1.0);
        let small = size.map(|n| ((f64::from(n) * scale) as u32).max(1));
        self.reduce_to(small)?;
        self.renderer.unit(1, work.interrupt)?;
        self.begin_picture();
        self.renderer.units(1, SAMPLES, work.interrupt)?;
        let samples = f64::from(self.totals().samples.max(1));
        let variance = self.variance_of_samples()?;
        // One unit: small ones wait for their longest path, as only the first of a picture do.
        let units = self.totals().units;
        let took = self.time_units(SAMPLES, 1, work)?;
        let evenness = match self.totals().units - units {
            1 => evenness(variance, self.variance_of_samples()?),
            _ => 1.0,
        };
        self.reduce_to(size)?;
        Ok(Forecast {
            seconds_per_sample: took / f64::from(SAMPLES) * pixels(size) / pixels(small),
            seconds_per_bundle: 0.0,
            variance: samples * variance,
            evenness,
            cache: None,
        })
    }

    /// Square of the relative error of the samples so far. What a cache is wrong by is in all of them alike, and is counted
    /// with its filling.
    fn variance_of_samples(&mut self) -> Result<f64> {
        let shared = self.renderer.cache().map(|cache| cache.relative_error);
        let shared = shared.filter(|error| error.is_finite()).unwrap_or(0.0);
        Ok((self.relative_error()?.powi(2) - shared.powi(2)).max(0.0))
    }

    /// Seconds that units of so many samples take, together where the volume streams.
    fn time_units(&mut self, samples: u32, units: u32, work: &Work<'_>) -> Result<f64> {
        let began = Instant::now();
        self.renderer.units(samples, units, work.interrupt)?;
        Ok(began.elapsed().as_secs_f64())
    }

    /// Tries the cache, and tells whether it is better than `rival`, which would have to be made again in `making` seconds.
    /// `None` if its first paths take longer than `most` seconds.
    ///
    /// The error of a cache with few paths is a guess. So as long as the cache is the better one it is filled further, which
    /// costs nothing if it stays so, until it is good enough or a trial must not take longer.
    fn try_cache(
        &mut self,
        rival: &Forecast,
        work: &Work<'_>,
        making: f64,
        most: f64,
    ) -> Result<Option<(Forecast, bool)>> {
        if work.pictures > 1 {
            self.look_from_everywhere();
        }
        while self.renderer.cache().is_some_and(|c| c.updates < UPDATES) {
            if self.seconds_filled() > most || !self.fill_on(work)? {
                return Ok(None);
            }
        }
        let samples = self.try_samples(work)?;
        loop {
            let cached = Forecast {
                cache: self.filling(),
                ..samples
            };
            let took = self.seconds_filled();
            let is_better = verdict(rival, &cached, work, making + took).0;
            let goal = cache_goal(&work.stop);
            let is_good = self
                .renderer
                .cache()
                .is_some_and(|cache| cache.is_known_to(goal));
            if !is_better || is_good || took > most || !self.fill_on(work)? {
                return Ok(Some((cached, is_better)));
            }
        }
    }

    /// Doubles the paths of the cache's nodes. Returns false if that was interrupted.
    fn fill_on(&mut self, work: &Work<'_>) -> Result<bool> {
        let updates = self.renderer.cache().map_or(0, |cache| cache.updates);
        match self.renderer.caching() {
            Some(mut caching) => caching.batch(doubling(updates), work.interrupt),
            None => Ok(false),
        }
    }

    /// Time that filling the cache has taken so far.
    fn seconds_filled(&self) -> f64 {
        let cache = self.renderer.cache();
        cache.map_or(0.0, |cache| cache.took.as_secs_f64())
    }

    /// What filling the cache is expected to take.
    fn filling(&self) -> Option<Filling> {
        self.renderer.cache().map(|cache| {
            let next = cache.updates.max(GATHERED);
            let further = cache.seconds_to(2 * next) - cache.seconds_to(next);
            let per_traced_path = further / f64::from(next);
            let traced = worth(cache.updates).saturating_sub(worth(GATHERED));
            let took = cache.took.as_secs_f64();
            let gathering = took + cache.seconds_to(GATHERED);
            Filling {
                gathering: (gathering - per_traced_path * f64::from(traced)).max(0.0),
                per_traced_path,
                variance: cache.relative_error.powi(2) * f64::from(worth(cache.updates)),
            }
        })
    }
}
