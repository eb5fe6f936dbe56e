//! The report of a render at its end: the files of `--stats` and `--profile`, and the last line.

use std::time::{Duration, Instant};

use super::clock::{self, Clock};
use super::views::View;
use crate::cli::{RenderArgs, why_stopped};
use crate::engine::{Engine, Host, Outcome, Stop, StopReason, cache_goal, figures};
use crate::error::Result;
use crate::gpu::Timings;
use crate::interrupt;
use crate::output::stats::{Continued, Stats, ViewStats};
use crate::output::{Outputs, say, time_table};
use crate::scene::Variant;

/// A picture that has samples, and how it ended.
pub struct RenderedPicture<'a> {
    pub view: &'a View,
    pub outcome: Outcome,
    /// The time that runs before this one have spent on it.
    pub earlier: Duration,
}

/// The pictures of a render that have samples.
pub struct Taken<'a> {
    pub pictures: Vec<RenderedPicture<'a>>,
    /// The number of the first picture of an orbit that an interruption has prevented.
    pub missing: Option<u32>,
    /// Whether an interruption has ended the work before its time: a trial, the filling of the cache, or a picture.
    pub is_interrupted: bool,
}

pub struct Summary<'a> {
    args: &'a RenderArgs,
    /// The names of the pictures' files.
    files: String,
    /// The variant that the user asked for.
    asked: Variant,
    stats: Stats,
    /// What the statistics' `spp` counts: samples per pixel, or, in `published`, updates per cell.
    counted: &'static str,
    /// As in [`Taken`].
    missing: Option<u32>,
    /// As in [`Taken`].
    is_interrupted: bool,
    /// The time that runs before this one have spent on these pictures.
    earlier: Duration,
    /// Paths of runs before this one, which `stats` counts as well.
    restored_paths: u64,
    timings: Timings,
    /// Device memory taken, by time.
    memory: Vec<(Instant, u64)>,
    stopped: StopReason,
}

impl<'a> Summary<'a> {
    /// The summary of at least one picture.
    pub fn of(
        args: &'a RenderArgs,
        clock: &Clock,
        engine: Engine,
        restored_paths: u64,
        taken: &Taken<'_>,
        stop: &Stop,
    ) -> Summary<'a> {
        let Taken {
            pictures,
            missing,
            is_interrupted,
        } = taken;
        let (first, last) = (&pictures[0], &pictures[pictures.len() - 1]);
        let earlier: Duration = pictures.iter().map(|picture| picture.earlier).sum();
        let mut stats = stats(args, clock, &engine, pictures, cache_goal(stop));
        stats.continued = (restored_paths > 0).then_some(Continued {
            paths: restored_paths,
            wall_s: earlier.as_secs_f64(),
        });
        Summary {
            args,
            files: names(first.view, last.view),
            asked: engine.scene().render.variant,
            stats,
            counted: if engine.choice().plan.variant.has_samples() {
                "samples per pixel"
            } else {
                "updates per cell"
            },
            missing: *missing,
            is_interrupted: *is_interrupted,
            earlier,
            restored_paths,
            memory: engine.memory_history(),
            stopped: last.outcome.stopped.clone(),
            timings: engine.into_timings(),
        }
    }

    /// Compares the passes with the device's peak, for which the engine has given back its memory, and writes the
    /// files.
    pub fn write_aside(&mut self, outputs: &mut Outputs, host: &Host, clock: &Clock) -> Result<()> {
        // If the peak cannot be measured, shares of it are unknown; everything else is still reported.
        let peak = self.is_asked_for().then(|| host.peak().ok()).flatten();
        self.stats.passes = figures::passes(&self.timings, peak.as_ref());
        if let Some(path) = &self.args.stats {
            outputs.json(path, &self.stats)?;
        }
        if let Some(path) = &self.args.profile {
            let trace = clock::trace(clock, &self.timings, &self.memory, peak.as_ref());
            outputs.json(path, &trace)?;
        }
        Ok(())
    }

    /// The table of passes, if files were asked for, and the last line.
    pub fn print(&self) {
        if self.is_asked_for() {
            let paths = self.stats.paths.saturating_sub(self.restored_paths);
            say(time_table::text(&self.stats, paths).trim_end());
        }
        say(self.last_line());
    }

    /// The render's exit status. A signal that comes when all is rendered ends nothing.
    pub fn status(&self) -> u8 {
        if self.is_interrupted {
            interrupt::status()
        } else {
            0
        }
    }

    fn last_line(&self) -> String {
        let Summary {
            stats,
            files,
            counted,
            ..
        } = self;
        let seconds = stats.wall_s + self.earlier.as_secs_f64();
        let error = error_in_words(stats.relative_error);
        let why = if self.is_interrupted {
            self.why_interrupted()
        } else {
            why_stopped(&self.stopped)
        };
        format!(
            "{files}: {} {counted} in {seconds:.1} s, relative error {error}, stopped because {why}; {} on {}{}",
            stats.spp,
            stats.variant,
            stats.device,
            why_variant(self.asked, &stats.reason),
        )
    }

    /// The signal, and the first picture of an orbit that is missing because of it.
    fn why_interrupted(&self) -> String {
        let signal = interrupt::reason();
        match (self.missing, self.args.orbit) {
            (Some(number), Some(all)) => format!("{signal} before picture {number} of {all}"),
            _ => signal.into(),
        }
    }

    fn is_asked_for(&self) -> bool {
        self.args.stats.is_some() || self.args.profile.is_some()
    }
}

/// All statistics but those of the passes, which are compared with the device's peak once the engine has given back
/// its memory.
fn stats(
    args: &RenderArgs,
    clock: &Clock,
    engine: &Engine,
    taken: &[RenderedPicture<'_>],
    cache_goal: f64,
) -> Stats {
    let outcomes: Vec<&Outcome> = taken.iter().map(|taken| &taken.outcome).collect();
    let (first, last) = (outcomes[0], outcomes[outcomes.len() - 1]);
    let choice = engine.choice();
    let device = engine.host().summary();
    let wall_s = clock.began.elapsed().as_secs_f64();
    Stats {
        variant: choice.plan.variant.word().into(),
        reason: choice.reason.clone(),
        device: device.name.clone(),
        driver: device.driver.clone(),
        spp: u64::from(last.samples),
        seed: u64::from(args.seed),
        wall_s,
        first_frame_s: first.first_frame.duration_since(clock.began).as_secs_f64(),
        passes: Vec::new(),
        stages: clock.stages(engine.timings()),
        memory: engine.memory_stats(),
        paths: engine.paths(),
        lookups_per_path: engine.lookups() as f64 / engine.paths() as f64,
        relative_error: last.relative_error,
        cache: engine.cache_stats(cache_goal),
        bricks: engine.brick_stats(wall_s),
        views: outcomes.into_iter().map(ViewStats::of).collect(),
        continued: None,
    }
}

/// The reason for the variant, where the program has picked it.
fn why_variant(asked: Variant, reason: &str) -> String {
    match asked {
        Variant::Auto => format!(", because {reason}"),
        _ => String::new(),
    }
}

/// The files of all pictures from the first to the last one.
fn names(first: &View, last: &View) -> String {
    let names = first.files.iter().zip(&last.files).map(|(first, last)| {
        if first == last {
            first.display().to_string()
        } else {
            format!("{} to {}", first.display(), last.display())
        }
    });
    names.collect::<Vec<_>>().join(", ")
}

/// A relative error, which is unknown after a single unit of samples, or where they have met no light.
pub fn error_in_words(relative_error: f64) -> String {
    if relative_error.is_finite() {
        format!("{relative_error:.4}")
    } else {
        "unknown".into()
    }
}
