//! What coarser cells and shorter floats lose: the paper's Table 1. The same view is marched through
//! each cache, which adds no noise of its own, and compared with that of the whole cache in 32 bits.

use std::time::Duration;

use super::Bench;
use super::entrants::Subject;
use super::report::{CacheSetting, RunReport};
use super::run::voxels;
use crate::cli::{BenchVariant, Stop};
use crate::compare::{LinearImage, measure as compare};
use crate::error::{Error, Result};
use crate::job::report;
use crate::job::trace::{self, INTERRUPTED, rgb};
use crate::output::progress::Progress;
use crate::render::{Renderer, doubling};
use crate::scene::CacheFormat::{F16, F32};

/// The first is what the others are measured against; the second gets as many paths as that, so that
/// rounding is all that tells them apart.
const SETTINGS: [BenchVariant; 5] = [
    BenchVariant::caching(1.0, F32),
    BenchVariant::caching(1.0, F16),
    BenchVariant::caching(0.5, F32),
    BenchVariant::caching(0.25, F32),
    BenchVariant::caching(0.125, F32),
];

/// Empty where the whole cache does not fit, or takes too long to fill.
pub fn measure(
    bench: &mut Bench<'_>,
    subject: &Subject,
    runs: &[RunReport],
    skipped: &mut Vec<String>,
) -> Result<Vec<CacheSetting>> {
    let mut settings: Vec<CacheSetting> = Vec::new();
    let mut whole: Option<LinearImage> = None;
    for variant in &SETTINGS {
        let entrant = match subject.entrant(&bench.host, bench.volume, variant) {
            Ok(entrant) => entrant,
            Err(Error::Memory(why)) if settings.is_empty() => {
                skipped.push(format!("cache settings: {why}"));
                break;
            }
            Err(other) => return Err(other),
        };
        if settings.is_empty()
            && let Err(why) = bench.in_time(&entrant, runs)
        {
            skipped.push(format!("cache settings: {why}"));
            break;
        }
        bench.say(&format!(
            "{}cache settings: {}",
            subject.prefix, entrant.word
        ));
        let seed = bench.args.seed;
        let (scene, choice) = (&entrant.scene, entrant.choice);
        let mut loaded = bench.host.load_warm(bench.volume, scene, choice, seed)?;
        match settings.as_slice() {
            [whole] => fill_as_often(whole.paths_per_cell, &mut loaded.renderer)?,
            _ => fill_for(bench.longest(), &mut loaded.renderer)?,
        }
        let image = marched(&mut loaded.renderer, scene.render.size, &entrant.word)?;
        let alike = match &whole {
            Some(whole) => Some(compare(whole, &image, scene.render.exposure)?),
            None => None,
        };
        let (Some(cache), Some(filled)) = (
            report::cache(&loaded.renderer, &loaded.choice.plan, 0.0),
            &loaded.renderer.cache,
        ) else {
            break;
        };
        if trace::interrupted() {
            break;
        }
        settings.push(CacheSetting {
            variant: entrant.word,
            paths_per_cell: filled.updates,
            relative_error: cache.relative_error,
            psnr: alike.as_ref().map(|a| a.psnr),
            ssim: alike.as_ref().and_then(|a| a.ssim),
            bytes: cache.bytes,
            active_cells: cache.active_cells,
            bytes_per_active_cell: cache.bytes as f64 / cache.active_cells as f64,
            bytes_per_voxel: cache.bytes as f64 / voxels(bench),
        });
        whole.get_or_insert(image);
    }
    Ok(settings)
}

/// For a cache's share of a render of that length, however good it gets.
fn fill_for(time: Duration, renderer: &mut Renderer) -> Result<()> {
    let stop = Stop {
        relative_error: Some(f64::MIN_POSITIVE),
        ..Stop::after(time)
    };
    let mut silent = Progress::new(true, trace::goal(&stop));
    trace::fill_until(&stop, renderer, 1, &mut silent)
}

fn fill_as_often(updates: u32, renderer: &mut Renderer) -> Result<()> {
    let mut done = 0;
    while done < updates && !trace::interrupted() {
        let batch = doubling(done).min(updates - done);
        renderer.fill_cache(batch, &INTERRUPTED)?;
        done += batch;
    }
    Ok(())
}

fn marched(renderer: &mut Renderer, [width, height]: [u32; 2], name: &str) -> Result<LinearImage> {
    Ok(LinearImage {
        name: name.into(),
        width: width as usize,
        height: height as usize,
        rgb: rgb(&renderer.march()?),
        stderr: None,
    })
}
