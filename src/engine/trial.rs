//! Chooses between caching and non-caching by a short trial of both on the device.
//!
//! A cache has to be compiled for and filled before it saves anything, and where surfaces are seen a sample through it
//! still has noise: which variant is faster depends on the scene, the device, the number of pictures and how good they
//! are to be. Pictures of few pixels tell what a sample costs in either variant and how noisy it is, and a first few
//! batches tell how fast a cache fills. The rest is arithmetic: noise falls with the root of the number of samples.
//!
//! A trial takes time as well. The variant without a cache is tried first, and where it will soon be done, it is taken.
//!
//! Where samples are counted, the plan's choice stands: the same command then gives the same bits.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::schedule::{Stop, UNITS_TO_TRUST, cache_goal};
use super::{Engine, Host};
use crate::error::Result;
use crate::render::shared::GATHERED;
use crate::render::{Choice, doubling, worth};
use crate::scene::volume::Volume;
use crate::scene::{Scene, Variant};

/// Pixels of the pictures that are tried: a GPU needs many to be busy.
const PIXELS_CPU: f64 = 4096.0;
const PIXELS_GPU: f64 = 262_144.0;
/// Samples of a pixel that are tried one by one, and then as many in one unit.
const SAMPLES: u32 = 8;
/// Paths a node that tell how fast a cache fills and how noisy its light is.
const UPDATES: u32 = 8;
/// A trial of the cache may take this share of what the work would take without one.
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

/// What a variant is expected to take for a picture.
#[derive(Debug, Clone, Copy)]
struct Forecast {
    /// Seconds that a sample of every pixel takes.
    seconds_per_sample: f64,
    /// Square of the relative error after one sample.
    variance: f64,
    /// The variance of [`SAMPLES`] samples that are spread evenly, as a share of that of independent samples.
    evenness: f64,
    cache: Option<Filling>,
}

/// What filling the cache is expected to take. Paths are counted by what they are worth ([`worth`]), since those that are
/// gathered at first take less time and tell less than those that are traced.
#[derive(Debug, Clone, Copy)]
struct Filling {
    /// Seconds that the trial itself has taken.
    trial: f64,
    /// Seconds until nodes have had their first [`GATHERED`] paths.
    gathering: f64,
    /// Seconds for each further path of all nodes.
    per_traced_path: f64,
    /// Square of the relative error of what the cache shows after paths that are worth 1.
    variance: f64,
}

impl Filling {
    /// Seconds until nodes have had paths of this worth.
    fn seconds_to(&self, paths: f64) -> f64 {
        let gathered = f64::from(worth(GATHERED));
        self.gathering * paths.min(gathered) / gathered
            + self.per_traced_path * (paths - gathered).max(0.0)
    }

    /// The worth of the paths that nodes have had after so many seconds.
    fn worth_after(&self, seconds: f64) -> f64 {
        let gathered = f64::from(worth(GATHERED));
        match seconds < self.gathering {
            true => gathered * seconds / self.gathering,
            false => gathered + (seconds - self.gathering) / self.per_traced_path,
        }
    }
}

impl Forecast {
    /// Square of the relative error that is reported after so many samples. They come in units of a sixteenth of them, and
    /// only within a unit they are known to be spread evenly.
    fn variance_after(&self, samples: f64) -> f64 {
        let known = f64::from(SAMPLES).log2();
        let unit = (samples / 16.0).max(1.0).log2().min(known);
        self.variance * self.evenness.powf(unit / known) / samples
    }

    /// Samples after which a relative error is reported.
    fn samples_to(&self, error: f64) -> f64 {
        let mut samples = f64::from(UNITS_TO_TRUST);
        while samples.is_finite() && self.variance_after(samples) > error.powi(2) {
            samples *= 1.05;
        }
        samples
    }

    /// Until all pictures have a relative error.
    fn seconds_to(&self, error: f64, pictures: u32) -> f64 {
        let goal = cache_goal(&Stop {
            relative_error: Some(error),
            ..Stop::default()
        });
        let samples = self.samples_to(error);
        let fill = self.cache.map_or(0.0, |cache| {
            // The error is known once nodes trace whole paths, at the ends of batches, which double what there is.
            let wanted = (cache.variance / goal.powi(2)).max(2.0 * f64::from(worth(GATHERED)));
            cache.seconds_to(wanted.log2().ceil().exp2())
        });
        fill + f64::from(pictures) * samples * self.seconds_per_sample
    }

    /// Until the work is done, or its time is over.
    fn seconds_of(&self, work: &Work<'_>) -> f64 {
        let to_error = work
            .stop
            .relative_error
            .map(|error| self.seconds_to(error, work.pictures));
        let time = work.stop.time.map(|time| time.as_secs_f64());
        to_error
            .unwrap_or(f64::INFINITY)
            .min(time.unwrap_or(f64::INFINITY))
    }

    /// Of each picture when so many seconds are over; the cache gets half of them at most.
    fn error_after(&self, seconds: f64, pictures: u32) -> f64 {
        let fill = self.cache.map_or(0.0, |_| 0.5 * seconds);
        let cached = self
            .cache
            .map_or(0.0, |cache| cache.variance / cache.worth_after(fill));
        let samples = (seconds - fill) / (f64::from(pictures) * self.seconds_per_sample);
        (self.variance_after(samples) + cached).sqrt()
    }
}

/// Whether the cache is worth its filling, and why: the end of a sentence. To go on with it takes `head_start` seconds less
/// than to begin with it, compared with going back.
fn verdict(
    uncached: &Forecast,
    cached: &Forecast,
    work: &Work<'_>,
    head_start: f64,
) -> (bool, String) {
    let Work { stop, pictures, .. } = *work;
    if let Some(error) = stop.relative_error {
        let [without, with] = [uncached, cached].map(|f| f.seconds_to(error, pictures));
        let time = stop.time.map_or(f64::INFINITY, |time| time.as_secs_f64());
        if without.min(with) <= time {
            let said = format!(
                "a relative error of {error} is expected after {with:.1} s with a cache and {without:.1} s without one"
            );
            return (with < without + head_start, said);
        }
    }
    let seconds = stop.time.map_or(f64::INFINITY, |time| time.as_secs_f64());
    let [without, with] = [uncached, cached].map(|f| f.error_after(seconds, pictures));
    let said = format!(
        "after {seconds} s a relative error of {with:.4} is expected with a cache and of {without:.4} without one"
    );
    (with < without, said)
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
        let is_open = scene.render.variant == Variant::Auto
            && choice.plan.variant.cache().is_some()
            && work.stop.count().is_none();
        if !is_open {
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
        let mut engine = Engine::with_plan(host, volume, scene, choice.clone(), seed)?;
        let Some(filling) = engine.try_filling(&work, SHARE * seconds)? else {
            drop(engine);
            return without(TOO_SHORT);
        };
        let cached = Forecast {
            cache: Some(filling),
            ..engine.try_samples(&work)?
        };
        let head_start = making + filling.trial;
        let (is_worth_it, why) = verdict(&uncached, &cached, &work, head_start);
        if !is_worth_it {
            drop(engine);
            return without(&why);
        }
        engine.choice.reason = format!("{why}; {}", choice.reason);
        Ok(engine)
    }

    /// Takes a few samples of few pixels, and forgets them.
    fn try_samples(&mut self, work: &Work<'_>) -> Result<Forecast> {
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
        for _ in 0..SAMPLES {
            self.renderer.unit(1, work.interrupt)?;
        }
        let samples = f64::from(self.totals().samples.max(1));
        // What a cache is wrong by is in all samples alike, and is counted with its filling.
        let shared = self.renderer.cache().map(|cache| cache.relative_error);
        let shared = shared.filter(|error| error.is_finite()).unwrap_or(0.0);
        let variance = (self.relative_error()?.powi(2) - shared.powi(2)).max(0.0);
        // One unit: small ones wait for their longest path, as only the first of a picture do.
        let units = self.totals().units;
        let began = Instant::now();
        self.renderer.unit(SAMPLES, work.interrupt)?;
        let took = began.elapsed().as_secs_f64();
        let both = (self.relative_error()?.powi(2) - shared.powi(2)).max(0.0);
        let evenness = match self.totals().units - units {
            1 => evenness(variance, both),
            _ => 1.0,
        };
        self.reduce_to(size)?;
        self.begin_picture();
        Ok(Forecast {
            seconds_per_sample: took / f64::from(SAMPLES) * pixels(size) / pixels(small),
            variance: samples * variance,
            evenness,
            cache: None,
        })
    }

    /// Gives the cache its first paths. `None` if that takes longer than `most` seconds.
    fn try_filling(&mut self, work: &Work<'_>, most: f64) -> Result<Option<Filling>> {
        while let Some(cache) = self.renderer.cache()
            && cache.updates < UPDATES
        {
            if cache.took.as_secs_f64() > most {
                return Ok(None);
            }
            let samples = doubling(cache.updates);
            if let Some(mut caching) = self.renderer.caching()
                && !caching.batch(samples, work.interrupt)?
            {
                break;
            }
        }
        Ok(self.renderer.cache().map(|cache| {
            let took = cache.took.as_secs_f64();
            let gathering = cache.seconds_to(GATHERED);
            Filling {
                trial: took,
                gathering: took + gathering,
                per_traced_path: (cache.seconds_to(2 * GATHERED) - gathering) / f64::from(GATHERED),
                variance: cache.relative_error.powi(2) * f64::from(worth(cache.updates)),
            }
        }))
    }
}

/// What is left of the variance of n samples where they are one unit: `singles` is the variance of a mean of n units of one
/// sample each, and `both` that which is reported once a unit of n samples has followed.
///
/// The sum of squared differences is n (n − 1) `singles` at first. A unit that differs by d from the mean adds n d²/2 to it
/// (West's rule with equal weights), and the sum is then 2n · n `both`. The square of d is on average the variance of the
/// mean and that of the unit.
fn evenness(singles: f64, both: f64) -> f64 {
    const LEAST: f64 = 0.05;
    let n = f64::from(SAMPLES);
    let squared_difference = 4.0 * n * both - 2.0 * (n - 1.0) * singles;
    let unit = squared_difference - singles;
    match singles > 0.0 {
        true => (unit / singles).clamp(LEAST, 1.0),
        false => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    const UNCACHED: Forecast = Forecast {
        seconds_per_sample: 0.1,
        variance: 1.0,
        evenness: 1.0,
        cache: None,
    };
    const CACHED: Forecast = Forecast {
        seconds_per_sample: 0.1,
        variance: 0.04,
        evenness: 1.0,
        cache: Some(Filling {
            trial: 0.2,
            gathering: 1.0,
            per_traced_path: 0.1,
            variance: 1e-4,
        }),
    };

    static GOES_ON: AtomicBool = AtomicBool::new(false);

    fn is_chosen(cached: Forecast, stop: Stop, pictures: u32, head_start: f64) -> bool {
        let work = Work {
            stop,
            pictures,
            interrupt: &GOES_ON,
        };
        verdict(&UNCACHED, &cached, &work, head_start).0
    }

    fn is_cached(stop: Stop, pictures: u32) -> bool {
        is_chosen(CACHED, stop, pictures, 0.0)
    }

    #[test]
    fn a_cache_is_for_pictures_that_have_to_be_good_or_many() {
        let to = |error| Stop {
            relative_error: Some(error),
            ..Stop::default()
        };
        assert!(!is_cached(to(0.2), 1));
        assert!(is_cached(to(0.2), 100));
        assert!(is_cached(to(0.02), 1));
        // Most of its filling is done.
        assert!(is_chosen(CACHED, to(0.2), 1, 10.0));
    }

    #[test]
    fn even_samples_are_known_by_the_spread_between_units() {
        let n = f64::from(SAMPLES);
        for left in [0.2, 1.0] {
            let (singles, unit) = (1.0 / n, left / n);
            let squares = n * (n - 1.0) * singles + 0.5 * n * (singles + unit);
            let both = squares / (2.0 * n * n);
            assert!((evenness(singles, both) - left).abs() < 1e-9);
        }
        let even = Forecast {
            evenness: 0.25,
            ..UNCACHED
        };
        assert!((UNCACHED.samples_to(0.05) / 400.0 - 1.0).abs() < 0.1);
        let fewer = even.samples_to(0.05) / UNCACHED.samples_to(0.05);
        assert!((0.25..0.6).contains(&fewer), "{fewer}");
    }

    #[test]
    fn where_the_time_ends_first_the_error_then_decides() {
        let both = |seconds| Stop {
            relative_error: Some(1e-4),
            ..Stop::after(Duration::from_secs(seconds))
        };
        assert!(is_cached(both(60), 1));
        let slow = Forecast {
            seconds_per_sample: 3.0,
            ..CACHED
        };
        assert!(!is_chosen(slow, both(60), 1, 0.0));
    }
}
