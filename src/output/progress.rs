//! Progress on stderr: a bar on a terminal, a line now and then in a log, nothing when quiet.

use std::io::{self, IsTerminal, Write};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{FormattedDuration, ProgressBar, ProgressStyle};

use super::{escaped, say};
use crate::engine::{self, Sampled, Stop};
use crate::locked::locked;
use crate::scene::volume::Copying;

pub struct ProgressLine {
    stop: Stop,
    /// The beginning of what is said of a picture, if there are several.
    which: String,
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
        let shown = if quiet {
            Shown::Nothing
        } else if io::stderr().is_terminal() {
            Shown::Bar(bar())
        } else {
            return ProgressLine::log(stop, Box::new(io::stderr()));
        };
        ProgressLine::with(stop, shown)
    }

    /// Progress as a line now and then, for a stderr that is not a terminal.
    pub fn log(stop: Stop, log: Box<dyn Write + Send>) -> ProgressLine {
        let next_at = LINE_SECONDS;
        ProgressLine::with(stop, Shown::Lines { log, next_at })
    }

    fn with(stop: Stop, shown: Shown) -> ProgressLine {
        ProgressLine {
            stop,
            which: String::new(),
            shown,
        }
    }

    /// To be called when a picture is begun or continued, whose seconds are counted anew: the one with this number, from 1
    /// on, of so many.
    pub fn begin_picture(&mut self, number: u32, of: usize) {
        if of > 1 {
            self.which = format!("picture {number} of {of}: ");
        }
        if let Shown::Lines { next_at, .. } = &mut self.shown {
            *next_at = LINE_SECONDS;
        }
    }

    /// Shows the engine's progress.
    pub fn show(&mut self, progress: engine::Progress) {
        match progress {
            engine::Progress::Batch {
                updates,
                relative_error,
            } => self.filled(updates, relative_error),
            engine::Progress::Unit(so_far) => self.sampled(&so_far),
        }
    }

    fn sampled(&mut self, so_far: &Sampled) {
        let left = self.stop.seconds_left(so_far);
        let seconds = so_far.took.as_secs_f64();
        let status = || format!("{}{}", self.which, status(so_far, left));
        match &mut self.shown {
            Shown::Nothing => {}
            Shown::Bar(bar) => {
                let share = left.map_or(0.0, |left| seconds / (seconds + left));
                bar.set_position((share * BAR_STEPS as f64) as u64);
                bar.set_message(status());
            }
            Shown::Lines { log, next_at } => {
                if seconds >= *next_at {
                    *next_at = seconds + LINE_SECONDS;
                    print(log, &status());
                }
            }
        }
    }

    /// Shows the progress of the cache's filling, before the first sample.
    fn filled(&mut self, updates: u32, relative_error: f64) {
        let mut status = format!("cache: {updates} paths a node in sight");
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
        let percent = escaped(&format!("copying {volume}: {:.0} %", 100.0 * share));
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

fn status(so_far: &Sampled, left: Option<f64>) -> String {
    let mut status = format!("{} spp", so_far.samples);
    if so_far.relative_error.is_finite() {
        status += &format!(", relative error {:.4}", so_far.relative_error);
    }
    if let Some(left) = left.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok()) {
        status += &format!(", {} left", FormattedDuration(left));
    }
    status
}
