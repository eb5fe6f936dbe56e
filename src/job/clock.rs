//! The CPU's work, stage by stage, and the profile that shows it beside the GPU's.

use std::time::{Duration, Instant};

use crate::engine::Peak;
use crate::engine::figures::peak_share;
use crate::gpu::{Span, Timings};
use crate::output::stats::{PartStats, StageStats};
use crate::output::trace::Trace;

/// The stages of the CPU's work, one after another.
pub struct Clock {
    pub began: Instant,
    stages: Vec<Stage>,
}

struct Stage {
    name: &'static str,
    start_us: f64,
    duration_us: f64,
    parts: Vec<PartStats>,
}

impl Clock {
    pub fn new() -> Clock {
        Clock {
            began: Instant::now(),
            stages: Vec::new(),
        }
    }

    pub fn time<T>(&mut self, name: &'static str, work: impl FnOnce() -> T) -> T {
        let start = self.began.elapsed();
        let result = work();
        self.stages.push(Stage {
            name,
            start_us: start.as_secs_f64() * 1e6,
            duration_us: (self.began.elapsed() - start).as_secs_f64() * 1e6,
            parts: Vec::new(),
        });
        result
    }

    /// Adds a detail to the last stage.
    pub fn part(&mut self, name: &str, took: Duration) {
        if let Some(stage) = self.stages.last_mut() {
            stage.parts.push(PartStats {
                name: name.into(),
                ms: took.as_secs_f64() * 1e3,
            });
        }
    }

    /// All stages in order of first appearance; those of one name are added up.
    pub fn stages(&self, timings: &Timings) -> Vec<StageStats> {
        let offset_us = (timings.began - self.began).as_secs_f64() * 1e6;
        let mut stages: Vec<StageStats> = Vec::new();
        for stage in &self.stages {
            let during = |span: &&Span| {
                let from_start = offset_us + span.start_us - stage.start_us;
                (0.0..stage.duration_us).contains(&from_start)
            };
            let busy = timings.spans().iter().filter(during);
            let gpu_ms = busy.fold(0.0, |ms, span| {
                ms + timings.weight(span.pass) * span.duration_us / 1e3
            });
            let ms = stage.duration_us / 1e3;
            match stages.iter_mut().find(|s| s.name == stage.name) {
                Some(sum) => {
                    sum.ms += ms;
                    sum.gpu_ms += gpu_ms;
                    sum.parts.extend(stage.parts.iter().cloned());
                }
                None => stages.push(StageStats {
                    name: stage.name.into(),
                    ms,
                    gpu_ms,
                    parts: stage.parts.clone(),
                }),
            }
        }
        stages
    }
}

/// The profile: stages of the CPU, passes of the GPU, and memory, from the run's beginning on.
pub fn trace(
    clock: &Clock,
    timings: &Timings,
    memory: &[(Instant, u64)],
    peak: Option<&Peak>,
) -> Trace {
    let mut trace = Trace::default();
    let offset_us = (timings.began - clock.began).as_secs_f64() * 1e6;
    for stage in &clock.stages {
        trace.add_cpu(stage.name, stage.start_us, stage.duration_us);
    }
    for span in timings.spans() {
        let share = peak.and_then(|peak| peak_share(peak, &span.work, span.duration_us));
        let start_us = offset_us + span.start_us;
        trace.add_gpu(span.pass, start_us, span.duration_us, share);
    }
    for &(at, bytes) in memory {
        trace.add_memory((at - clock.began).as_secs_f64() * 1e6, bytes);
    }
    trace
}
