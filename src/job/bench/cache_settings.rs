//! The loss by coarser lattices and shorter floats: the paper's Table 1. The same view is marched through each cache,
//! which adds no noise of its own, and compared with that of the finest cache in 32 bits. Paths of a few seconds leave
//! more noise than a coarser cache loses, so each cache is filled twice.

use std::time::Duration;

use super::entrants::{Entrant, Subject};
use super::measure::voxels;
use super::report::{CacheSetting, RunReport};
use super::{Bench, patient_run};
use crate::cli::{BenchVariant, message};
use crate::compare::{LinearImage, compare_images, without_noise};
use crate::engine::{Batch, Engine, Stop, next_batch_size};
use crate::error::{Error, Result};
use crate::interrupt::{INTERRUPTED, is_interrupted};
use crate::scene::CacheFormat::{F16, F32};

/// The setting with which the others are compared.
const FINEST: BenchVariant = BenchVariant::caching(1.0, F32);
/// A cache that gets the same paths, so that it differs by rounding alone.
const ROUNDED: BenchVariant = BenchVariant::caching(1.0, F16);
const COARSE: [BenchVariant; 3] = [
    BenchVariant::caching(0.5, F32),
    BenchVariant::caching(0.25, F32),
    BenchVariant::caching(0.125, F32),
];

/// Measures all settings; the result is empty where the finest cache does not fit, or takes too long to fill.
pub fn measure(
    bench: &Bench<'_>,
    subject: &Subject,
    runs: &[RunReport],
    skipped: &mut Vec<String>,
) -> Result<Vec<CacheSetting>> {
    let finest = match subject.entrant(&bench.host, bench.volume, &FINEST) {
        Err(why @ Error::Memory(_)) => Err(message(&why)),
        Err(other) => return Err(other),
        Ok(finest) => bench.in_time(&finest, runs).map(|()| finest),
    };
    let finest = match finest {
        Ok(finest) => finest,
        Err(why) => {
            skipped.push(format!("cache settings: {why}"));
            return Ok(Vec::new());
        }
    };
    let settings = Settings { bench, subject };
    let mut found = Vec::new();
    match settings.measure(&finest, &mut found) {
        Ok(()) | Err(Error::Interrupted) => Ok(found),
        Err(why @ Error::Memory(_)) => {
            skipped.push(format!("cache settings: {}", message(&why)));
            Ok(found)
        }
        Err(other) => Err(other),
    }
}

struct Settings<'a> {
    bench: &'a Bench<'a>,
    subject: &'a Subject,
}

/// The picture that a cache shows, and the cache's figures.
struct Shown {
    image: LinearImage,
    setting: CacheSetting,
}

impl Settings<'_> {
    fn measure(&self, finest: &Entrant, found: &mut Vec<CacheSetting>) -> Result<()> {
        let [finest, finest_again] = self.shown_twice(finest, 0)?;
        found.push(finest.setting);
        let updates = found[0].paths_per_cell;
        let rounded = self.shown(&self.entrant(&ROUNDED)?, 0, |engine| {
            fill_as_often(updates, engine)
        })?;
        found.push(self.compared(&finest.image, rounded)?);
        for variant in &COARSE {
            let [coarse, coarse_again] = self.shown_twice(&self.entrant(variant)?, 2)?;
            let without_noise = without_noise(
                [&finest.image, &finest_again.image],
                [&coarse.image, &coarse_again.image],
                self.bench.exposure,
            )?;
            found.push(CacheSetting {
                without_noise: Some(without_noise),
                ..self.compared(&finest.image, coarse)?
            });
        }
        Ok(())
    }

    fn compared(&self, finest: &LinearImage, shown: Shown) -> Result<CacheSetting> {
        let alike = compare_images(finest, &shown.image, self.bench.exposure)?;
        Ok(CacheSetting {
            psnr: Some(alike.psnr),
            ssim: alike.ssim,
            ..shown.setting
        })
    }

    fn entrant(&self, variant: &BenchVariant) -> Result<Entrant> {
        let Bench { host, volume, .. } = self.bench;
        self.subject.entrant(host, volume, variant)
    }

    /// The pictures of two caches that have been filled for the longest of the bench's times.
    fn shown_twice(&self, entrant: &Entrant, first_seed: u32) -> Result<[Shown; 2]> {
        let fill = |engine: &mut Engine| fill_for(self.bench.longest(), engine);
        let first = self.shown(entrant, first_seed, fill)?;
        Ok([first, self.shown(entrant, first_seed + 1, fill)?])
    }

    /// `seed` is added to the bench's own.
    fn shown(
        &self,
        entrant: &Entrant,
        seed: u32,
        fill: impl FnOnce(&mut Engine) -> Result<()>,
    ) -> Result<Shown> {
        let Bench { host, volume, .. } = self.bench;
        let prefix = &self.subject.prefix;
        let seed = self.bench.seed.wrapping_add(seed);
        let word = &entrant.word;
        self.bench
            .say(&format!("{prefix}cache settings: {word}, with seed {seed}"));
        let mut engine = entrant.load(host, volume, seed)?;
        fill(&mut engine)?;
        if is_interrupted() {
            return Err(Error::Interrupted);
        }
        Ok(Shown {
            image: marched(&mut engine, &entrant.word)?,
            setting: setting(&entrant.word, &engine, voxels(self.bench)),
        })
    }
}

/// A setting that has not been compared with anything yet.
fn setting(variant: &str, engine: &Engine, voxels: f64) -> CacheSetting {
    let Some(stats) = engine.cache_stats(0.0) else {
        unreachable!("an engine of the caching variant has a cache");
    };
    CacheSetting {
        variant: variant.into(),
        paths_per_cell: engine.updates(),
        relative_error: stats.relative_error,
        psnr: None,
        ssim: None,
        without_noise: None,
        bytes: stats.bytes,
        active_cells: stats.active_cells,
        bytes_per_active_cell: stats.bytes as f64 / stats.active_cells as f64,
        bytes_per_voxel: stats.bytes as f64 / voxels,
    }
}

/// Fills the cache for its share of a render of that length, however good it gets: none is without an error.
fn fill_for(time: Duration, engine: &mut Engine) -> Result<()> {
    let stop = Stop {
        relative_error: Some(0.0),
        ..Stop::after(time)
    };
    let mut silent = |_| {};
    engine
        .fill(&mut patient_run(stop, &mut silent), 1)
        .map(drop)
}

/// Gives the nodes as many paths as another cache has had, in the same batches, with what bricks lack in between.
fn fill_as_often(updates: u32, engine: &mut Engine) -> Result<()> {
    let mut done = 0;
    while done < updates
        && !is_interrupted()
        && let Some(mut caching) = engine.caching()
    {
        let batch = next_batch_size(done).min(updates - done);
        caching.batch(Batch::Paths(batch), &INTERRUPTED)?;
        caching.batch(Batch::CatchUp, &INTERRUPTED)?;
        done += batch;
    }
    Ok(())
}

fn marched(engine: &mut Engine, name: &str) -> Result<LinearImage> {
    let picture = engine.march()?;
    let picture = picture.expect("an engine of the caching variant has a cache");
    Ok(LinearImage {
        stderr: None,
        ..LinearImage::from_picture(name, &picture)
    })
}
