//! The loops of a render: batches of paths for the cache, then unit after unit of samples for the
//! picture, until it is enough.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use cpu_time::ProcessTime;

use super::schedule::{Done, Filled, cache_goal, next_batch, next_unit, reason_to_stop};
use crate::cli::Stop;
use crate::error::{Error, Result};
use crate::output::progress::{Goal, Progress};
use crate::output::relative_error;
use crate::output::stats::ViewStats;
use crate::render::Renderer;

/// Where nothing stops by it, the error is looked at for progress alone: a picture's download takes time.
const TIME_TO_LOOK: Duration = Duration::from_millis(500);

pub static INTERRUPTED: AtomicBool = AtomicBool::new(false);
/// For work that Ctrl-C has to wait for.
static UNSTOPPABLE: AtomicBool = AtomicBool::new(false);

/// Counts the time spent on rendering, of the wall and of the CPU's cores together. It can stand still
/// while somebody looks at the picture.
pub struct Stopwatch {
    before: Duration,
    cpu_before: Duration,
    running_since: Option<(Instant, ProcessTime)>,
}

impl Stopwatch {
    pub fn paused() -> Stopwatch {
        Stopwatch {
            before: Duration::ZERO,
            cpu_before: Duration::ZERO,
            running_since: None,
        }
    }

    pub fn started() -> Stopwatch {
        let mut watch = Stopwatch::paused();
        watch.go_on();
        watch
    }

    pub fn elapsed(&self) -> Duration {
        let now = self.running_since.map(|(wall, _)| wall.elapsed());
        self.before + now.unwrap_or_default()
    }

    /// Of all threads: a driver that renders on the CPU has its own.
    pub fn cpu(&self) -> Duration {
        let now = self.running_since.map(|(_, cpu)| cpu.elapsed());
        self.cpu_before + now.unwrap_or_default()
    }

    pub fn pause(&mut self) {
        (self.before, self.cpu_before) = (self.elapsed(), self.cpu());
        self.running_since = None;
    }

    pub fn go_on(&mut self) {
        self.running_since
            .get_or_insert_with(|| (Instant::now(), ProcessTime::now()));
    }
}

/// What rendering left, besides the picture.
pub struct Outcome {
    pub samples: u32,
    pub took: Duration,
    pub relative_error: f64,
    /// `None` if the picture had all its samples before.
    pub first_frame: Option<Instant>,
    pub why_stopped: String,
}

impl Outcome {
    pub fn stats(&self) -> ViewStats {
        ViewStats {
            spp: self.samples as u64,
            wall_s: self.took.as_secs_f64(),
            relative_error: self.relative_error,
        }
    }
}

pub fn goal(stop: &Stop) -> Goal {
    Goal {
        spp: stop.spp.map(|n| n.get() as u64),
        seconds: stop.time.map(|t| t.as_secs_f64()),
        relative_error: stop.relative_error,
    }
}

pub fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

pub fn catch_interrupts() {
    // Fails only where a handler is set already, and that one does the same.
    let _ = ctrlc::set_handler(|| INTERRUPTED.store(true, Ordering::Relaxed));
}

/// Batch after batch, until the cache shows `pictures` that are good enough for `stop`.
pub fn fill_until(
    stop: &Stop,
    renderer: &mut Renderer,
    pictures: u32,
    progress: &mut Progress,
) -> Result<()> {
    while let Some(filled) = filled(stop, renderer, pictures)
        && let Some(samples) = next_batch(stop, &filled)
        && renderer.fill_cache(samples, &INTERRUPTED)?
    {
        if let Some(cache) = &renderer.cache {
            progress.filled(cache.updates, cache.relative_error);
        }
    }
    Ok(())
}

fn filled(stop: &Stop, renderer: &Renderer, pictures: u32) -> Option<Filled> {
    let cache = renderer.cache.as_ref()?;
    let cells = renderer.resources.cache.as_ref()?.active_nodes as f64 * cache.mean_share();
    let [width, height, _] = renderer.resources.mean.desc.extent;
    let pixels = f64::from(width) * f64::from(height) * f64::from(pictures);
    Some(Filled {
        updates: cache.updates,
        took: cache.took,
        is_good: cache.is_known_to(cache_goal(stop)),
        is_marched: renderer.is_marched(),
        seconds_per_update: cache.seconds_per_update(),
        pixels_per_cell: pixels / cells.max(1.0),
    })
}

/// Unit after unit, until `stop` or Ctrl-C, on top of those that the picture has already. `--time` is
/// what `watch` shows.
pub fn trace_until(
    stop: &Stop,
    renderer: &mut Renderer,
    watch: &Stopwatch,
    progress: &mut Progress,
) -> Result<Outcome> {
    let mut first_frame = None;
    let mut done = Done {
        samples: renderer.totals.samples,
        units: renderer.totals.units,
        took: watch.elapsed(),
        relative_error: f64::INFINITY,
    };
    let mut looked = done.took;
    let why_stopped = loop {
        if let Some(reason) = reason_to_stop(stop, &done) {
            break reason;
        }
        // Whoever interrupts the filling of a cache still gets the picture that it shows.
        let has_light = renderer.cache.as_ref().is_some_and(|c| c.updates > 0);
        let interrupt = match has_light && done.units == 0 {
            true => &UNSTOPPABLE,
            false => &INTERRUPTED,
        };
        if !renderer.unit(next_unit(stop, &done), interrupt)? {
            break "of Ctrl-C".into();
        }
        first_frame.get_or_insert_with(Instant::now);
        done.samples = renderer.totals.samples;
        done.units = renderer.totals.units;
        if stop.relative_error.is_some() || watch.elapsed() >= looked + TIME_TO_LOOK {
            done.relative_error = error_of(renderer)?;
            looked = watch.elapsed();
        }
        done.took = watch.elapsed();
        progress.update(
            done.samples as u64,
            done.took.as_secs_f64(),
            done.relative_error,
        );
    };
    if done.units == 0 {
        return Err(Error::Interrupted);
    }
    Ok(Outcome {
        samples: done.samples,
        took: done.took,
        relative_error: error_of(renderer)?,
        first_frame,
        why_stopped,
    })
}

/// Of the picture so far; infinite while a single unit says nothing of it.
fn error_of(renderer: &mut Renderer) -> Result<f64> {
    if renderer.totals.units == 1 {
        return Ok(f64::INFINITY);
    }
    let film = renderer.film()?;
    Ok(relative_error(&rgb(&film.mean), &film.stderr))
}

pub fn rgb(texels: &[[f32; 4]]) -> Vec<[f32; 3]> {
    texels.iter().map(|&[r, g, b, _]| [r, g, b]).collect()
}
