//! The report of a session: lines on stderr for a log, and figures at its end.

use std::time::{Duration, Instant};

use serde::Serialize;

use super::live::Live;
use super::recent::Recent;
use super::response::{Response, ResponseStats};
use super::stage::Stage;
use crate::engine::SHOWN_CACHE_ERROR;
use crate::engine::figures::{self, CacheStats, MemoryStats, PassStats};
use crate::gpu::Timings;
use crate::output::say;

pub struct Report {
    began: Instant,
    is_quiet: bool,
    /// Milliseconds of each pass on the GPU.
    passes: Vec<(&'static str, Recent)>,
    pub response: Response,
    /// Milliseconds between frames while something moves.
    moving: Recent,
    /// Milliseconds of a frame at rest, of the work for it and the presenting.
    resting: Recent,
    last_frame: Option<Instant>,
    first_picture: Option<Duration>,
    counts: Counts,
}

/// How often each of these has happened in the session.
#[derive(Clone, Default, Serialize)]
struct Counts {
    frames: u64,
    cache_clears: u32,
    builds: u32,
    resizes: u32,
    pictures_finished: u32,
}

/// The contents of the `--stats` file.
#[derive(Serialize)]
pub struct SessionStats {
    variant: String,
    reason: String,
    device: String,
    driver: String,
    seconds: f64,
    /// Seconds from the window's opening to the first picture in it.
    first_picture_s: Option<f64>,
    #[serde(flatten)]
    counts: Counts,
    /// Milliseconds between frames while something moves: median, 95th percentile and longest.
    moving_frame_ms_median: f64,
    moving_frame_ms_p95: f64,
    moving_frame_ms_max: Option<f64>,
    /// Milliseconds that the window is busy at a time, and sees no input, while it improves a picture at rest.
    resting_frame_ms_median: f64,
    resting_frame_ms_p95: f64,
    resting_frame_ms_max: Option<f64>,
    moving_scale: f64,
    /// The response from an input to the first frame that shows its effect.
    response: ResponseStats,
    relative_error: f64,
    passes: Vec<PassStats>,
    memory: MemoryStats,
    #[serde(skip_serializing_if = "Option::is_none")]
    cache: Option<CacheStats>,
}

impl Report {
    pub fn new(is_quiet: bool) -> Report {
        Report {
            began: Instant::now(),
            is_quiet,
            passes: Vec::new(),
            response: Response::default(),
            moving: Recent::default(),
            resting: Recent::default(),
            last_frame: None,
            first_picture: None,
            counts: Counts::default(),
        }
    }

    pub fn say(&self, line: &str) {
        if !self.is_quiet {
            say(line);
        }
    }

    pub fn window_opened(&mut self) {
        self.began = Instant::now();
    }

    pub fn built(&mut self, live: &Live) {
        self.counts.builds += 1;
        self.say(&format!(
            "showing: {}, because {}",
            live.engine.choice().plan.variant.description(),
            live.engine.choice().reason
        ));
    }

    pub fn cache_cleared(&mut self) {
        self.counts.cache_clears += 1;
        self.say("cache cleared");
    }

    pub fn resized(&mut self, [width, height]: [u32; 2]) {
        self.counts.resizes += 1;
        self.say(&format!("picture: {width}x{height}"));
    }

    pub fn finished(&mut self, live: &Live) {
        self.counts.pictures_finished += 1;
        self.say(&format!(
            "picture finished: {} samples, relative error {:.4}",
            live.engine.totals().samples,
            live.picture.relative_error
        ));
    }

    /// Notes that a frame was presented.
    pub fn frame(&mut self, is_moving: bool, has_picture: bool) {
        self.counts.frames += 1;
        self.response.presented(has_picture);
        let now = Instant::now();
        if has_picture && self.first_picture.is_none() {
            let took = now - self.began;
            self.first_picture = Some(took);
            self.say(&format!("first picture after {:.2} s", took.as_secs_f64()));
        }
        if let Some(last) = self.last_frame.filter(|_| is_moving) {
            self.moving.add((now - last).as_secs_f64() * 1e3);
        }
        self.last_frame = is_moving.then_some(now);
    }

    /// Notes how long a frame has taken whose picture is at rest and not finished.
    pub fn rested(&mut self, took: Duration) {
        self.resting.add(took.as_secs_f64() * 1e3);
    }

    /// Takes the times that a frame has gathered.
    pub fn take_times(&mut self, timings: &mut Timings) {
        for span in timings.take() {
            let index = self.passes.iter().position(|(name, _)| *name == span.pass);
            let index = index.unwrap_or_else(|| {
                self.passes.push((span.pass, Recent::default()));
                self.passes.len() - 1
            });
            self.passes[index].1.add(span.duration_us / 1e3);
        }
    }

    pub fn passes(&self) -> &[(&'static str, Recent)] {
        &self.passes
    }

    pub fn moving_ms(&self) -> f64 {
        self.moving.mean()
    }

    pub fn stats(&self, stage: &Stage, live: Option<&Live>) -> SessionStats {
        let summary = &stage.device().summary;
        let choice = live.map(|live| live.engine.choice());
        SessionStats {
            variant: choice.map_or(String::new(), |c| c.plan.variant.word().into()),
            reason: choice.map_or(String::new(), |c| c.reason.clone()),
            device: summary.name.clone(),
            driver: summary.driver.clone(),
            seconds: self.began.elapsed().as_secs_f64(),
            first_picture_s: self.first_picture.map(|t| t.as_secs_f64()),
            counts: self.counts.clone(),
            moving_frame_ms_median: self.moving.quantile(0.5),
            moving_frame_ms_p95: self.moving.quantile(0.95),
            moving_frame_ms_max: self.moving.highest,
            resting_frame_ms_median: self.resting.quantile(0.5),
            resting_frame_ms_p95: self.resting.quantile(0.95),
            resting_frame_ms_max: self.resting.highest,
            moving_scale: live.map_or(f64::NAN, |live| live.picture.scale),
            response: self.response.stats(),
            relative_error: live.map_or(f64::NAN, |live| live.picture.relative_error),
            passes: self.passes.iter().map(pass_stats).collect(),
            memory: figures::memory(&stage.memory, stage.planned.most_bytes()),
            cache: live.and_then(|live| live.engine.cache_stats(SHOWN_CACHE_ERROR)),
        }
    }
}

fn pass_stats((name, ms): &(&'static str, Recent)) -> PassStats {
    PassStats {
        name: name.to_string(),
        runs: ms.count,
        gpu_ms_median: ms.quantile(0.5),
        gpu_ms_p95: ms.quantile(0.95),
        gpu_ms_total: ms.total,
        peak_share: None,
    }
}
