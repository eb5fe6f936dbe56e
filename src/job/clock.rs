//! Statistics and profile of a run, from what the renderer and the clock remember.

use std::time::{Duration, Instant};

use crate::gpu::{Memory, Span, Timings};
use crate::output::stats::{
    CacheStats, MemoryStats, PartStats, PassStats, ResourceStats, StageStats,
};
use crate::output::trace::Trace;
use crate::render::{Plan, PublishedResources, Renderer};

/// What the CPU did one after another.
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

    /// Says more of the last stage.
    pub fn part(&mut self, name: &str, took: Duration) {
        if let Some(stage) = self.stages.last_mut() {
            stage.parts.push(PartStats {
                name: name.into(),
                ms: took.as_secs_f64() * 1e3,
            });
        }
    }

    /// Stages of one name are added up, in order of first appearance.
    pub fn stages(&self, timings: &Timings) -> Vec<StageStats> {
        let offset_us = (timings.began - self.began).as_secs_f64() * 1e6;
        let mut stages: Vec<StageStats> = Vec::new();
        for stage in &self.stages {
            let during = |span: &&Span| {
                let from_start = offset_us + span.start_us - stage.start_us;
                (0.0..stage.duration_us).contains(&from_start)
            };
            let busy = timings.spans.iter().filter(during);
            let gpu_ms = busy.fold(0.0, |ms, span| ms + span.duration_us / 1e3);
            let ms = stage.duration_us / 1e3;
            match stages.iter_mut().find(|s| s.name == stage.name) {
                Some(sum) => {
                    sum.ms += ms;
                    sum.gpu_ms += gpu_ms;
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

/// One entry for each pass, in order of first appearance.
pub fn passes(timings: &Timings) -> Vec<PassStats> {
    let mut names: Vec<&'static str> = Vec::new();
    for span in &timings.spans {
        if !names.contains(&span.pass) {
            names.push(span.pass);
        }
    }
    let of = |name: &'static str| {
        let runs = timings.spans.iter().filter(|s| s.pass == name);
        let ms: Vec<f64> = runs.map(|s| s.duration_us / 1e3).collect();
        PassStats::from_runs(name, &ms)
    };
    names.into_iter().map(of).collect()
}

pub fn memory(memory: &Memory, planned_bytes: u64) -> MemoryStats {
    let resources = memory.resources().into_iter().map(|r| ResourceStats {
        name: r.name.into(),
        bytes: r.bytes,
    });
    MemoryStats {
        budget_bytes: memory.budget,
        planned_bytes,
        peak_bytes: memory.peak(),
        resources: resources.collect(),
    }
}

/// `goal` is the relative error at which the cache counts as converged.
pub fn cache(renderer: &Renderer, plan: &Plan, goal: f64) -> Option<CacheStats> {
    if let Some(cells) = &renderer.resources.published {
        return Some(published_cells(cells, renderer.totals.paths));
    }
    let (cache, layout) = (renderer.cache.as_ref()?, plan.cache.as_ref()?);
    let converged = cache.is_known_to(goal);
    Some(CacheStats {
        dims: layout.nodes,
        format: layout.format().name().into(),
        bytes: renderer.resources.cache.as_ref()?.bytes(),
        cells: layout.all_nodes(),
        active_cells: layout.active_nodes(),
        updates_per_cell: cache.mean_updates(),
        relative_error: cache.relative_error,
        converged,
        seconds_to_converge: converged.then_some(cache.took.as_secs_f64()),
    })
}

/// It knows its size and no error.
fn published_cells(cells: &PublishedResources, paths: u64) -> CacheStats {
    CacheStats {
        dims: cells.radiance.desc.extent,
        format: "f32".into(),
        bytes: cells.bytes(),
        cells: cells.count(),
        active_cells: cells.count(),
        updates_per_cell: paths as f64 / cells.count() as f64,
        relative_error: f64::INFINITY,
        converged: false,
        seconds_to_converge: None,
    }
}

pub fn trace(clock: &Clock, timings: &Timings, memory: &Memory) -> Trace {
    let mut trace = Trace::default();
    let offset_us = (timings.began - clock.began).as_secs_f64() * 1e6;
    for stage in &clock.stages {
        trace.add_cpu(stage.name, stage.start_us, stage.duration_us);
    }
    for Span {
        pass,
        start_us,
        duration_us,
    } in &timings.spans
    {
        trace.add_gpu(*pass, offset_us + start_us, *duration_us);
    }
    for (at, bytes) in memory.history() {
        trace.add_memory((at - clock.began).as_secs_f64() * 1e6, bytes);
    }
    trace
}
