//! Progress on stderr: a bar on a terminal, a line now and then in a log, nothing when quiet.

use std::io::{self, IsTerminal, Write};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{FormattedDuration, ProgressBar, ProgressStyle};

use super::say;
use crate::engine::{self, Sampling, Stop};
use crate::locked::locked;
use crate::scene::volume::Copying;

/// Seconds until the stop is reached, estimated from the progress so far.
pub fn remaining(stop: &Stop, done: &Sampling) -> Option<f64> {
    let spp = f64::from(done.spp);
    let until = |samples: f64| (samples - spp) * done.seconds_per_sample;
    let by_spp = stop.count().map(|goal| until(f64::from(goal)));
    let by_time = stop.time.map(|goal| goal.as_secs_f64() - done.seconds);
    // The error falls as 1/√n.
    let by_error = stop
        .relative_error
        .map(|goal| until(spp * (done.relative_error / goal).powi(2)));
    [by_spp, by_time, by_error]
        .into_iter()
        .flatten()
        .filter(|seconds| seconds.is_finite())
        .reduce(f64::min)
        .map(|seconds| seconds.max(0.0))
}

pub struct ProgressLine {
    stop: Stop,
    shown: Shown,
}

enum Shown {
    Nothing,
    Bar(ProgressBar),
    Lines {
        log: Box<dyn Write + Send>,
        next_at: f64,
    },
}

/// Seconds between two lines where stderr is not a terminal.
const LINE_SECONDS: f64 = 10.0;
/// The bar's resolution.
const BAR_STEPS: u64 = 1000;

impl ProgressLine {
    pub fn new(quiet: bool, stop: Stop) -> ProgressLine {
        if quiet {
            ProgressLine {
                stop,
                shown: Shown::Nothing,
            }
        } else if io::stderr().is_terminal() {
            ProgressLine {
                stop,
                shown: Shown::Bar(bar()),
            }
        } else {
            ProgressLine::log(stop, Box::new(io::stderr()))
        }
    }

    /// Progress as a line now and then, for a stderr that is not a terminal.
    pub fn log(stop: Stop, log: Box<dyn Write + Send>) -> ProgressLine {
        ProgressLine {
            stop,
            shown: Shown::Lines {
                log,
                next_at: LINE_SECONDS,
            },
        }
    }

    /// To be called when a picture is begun or continued, whose seconds are counted anew.
    pub fn begin_picture(&mut self) {
        if let Shown::Lines { next_at, .. } = &mut self.shown {
            *next_at = LINE_SECONDS;
        }
    }

    /// Shows the engine's progress.
    pub fn show(&mut self, progress: engine::Progress) {
        match progress {
            engine::Progress::Filled {
                updates,
                relative_error,
            } => self.filled(updates, relative_error),
            engine::Progress::Sampled(done) => self.sampled(&done),
        }
    }

    fn sampled(&mut self, done: &Sampling) {
        let remaining = remaining(&self.stop, done);
        let seconds = done.seconds;
        match &mut self.shown {
            Shown::Nothing => {}
            Shown::Bar(bar) => {
                let share = remaining.map_or(0.0, |remaining| seconds / (seconds + remaining));
                bar.set_position((share * BAR_STEPS as f64) as u64);
                bar.set_message(status(done, remaining));
            }
            Shown::Lines { log, next_at } => {
                if seconds >= *next_at {
                    *next_at = seconds + LINE_SECONDS;
                    print(log, &status(done, remaining));
                }
            }
        }
    }

    /// Shows the progress of the cache's filling, before the first sample.
    fn filled(&mut self, updates: u32, relative_error: f64) {
        let mut status = format!("cache: {updates} paths a cell in sight");
        if relative_error.is_finite() {
            status += &format!(", relative error {relative_error:.4}");
        }
        match &mut self.shown {
            Shown::Nothing => {}
            Shown::Bar(bar) => bar.set_message(status),
            Shown::Lines { log, .. } => print(log, &status),
        }
    }

    /// Removes the bar from the terminal.
    pub fn finish(self) {
        if let Shown::Bar(bar) = self.shown {
            bar.finish_and_clear();
        }
    }
}

/// Shows the progress of copies of volumes, one after another.
pub fn copying(quiet: bool) -> impl Fn(&Copying) + Send + Sync {
    let is_terminal = io::stderr().is_terminal();
    // The bar, and when a line was printed last.
    let shown: Mutex<Option<(ProgressBar, Instant)>> = Mutex::new(None);
    move |copying| {
        if quiet {
            return;
        }
        let Copying {
            volume,
            folder,
            share,
        } = copying;
        let percent = format!("copying {volume}: {:.0} %", 100.0 * share);
        let mut shown = locked(&shown);
        let (bar, last) = shown.get_or_insert_with(|| {
            let folder = folder.display();
            let line = format!("copying {volume} to {folder}, where the next run will find it");
            say(line);
            (bar(), Instant::now())
        });
        if is_terminal {
            bar.set_position((share * BAR_STEPS as f64) as u64);
            bar.set_message(percent);
        } else if last.elapsed().as_secs_f64() >= LINE_SECONDS {
            *last = Instant::now();
            say(percent);
        }
        if *share >= 1.0 {
            bar.finish_and_clear();
            *shown = None;
        }
    }
}

/// A closed stderr must not end a render.
fn print(log: &mut impl Write, line: &str) {
    let _ = writeln!(log, "{line}");
}

fn bar() -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:30} {msg}").expect("the template is constant");
    ProgressBar::new(BAR_STEPS).with_style(style)
}

fn status(done: &Sampling, remaining: Option<f64>) -> String {
    let mut status = format!("{} spp", done.spp);
    if done.relative_error.is_finite() {
        status += &format!(", relative error {:.4}", done.relative_error);
    }
    if let Some(left) = remaining.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok()) {
        status += &format!(", {} left", FormattedDuration(left));
    }
    status
}
