//! Counts the time spent on rendering.

use std::time::{Duration, Instant};

use cpu_time::ProcessTime;

/// Counts wall time, and CPU time of all cores together. It can be stopped while the picture is looked at.
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

    /// Adds wall and CPU time that were counted elsewhere.
    pub fn add(&mut self, wall: Duration, cpu: Duration) {
        self.before = self.before.saturating_add(wall);
        self.cpu_before = self.cpu_before.saturating_add(cpu);
    }

    pub fn elapsed(&self) -> Duration {
        let now = self.running_since.map(|(wall, _)| wall.elapsed());
        self.before.saturating_add(now.unwrap_or_default())
    }

    /// The time of all threads: a driver that renders on the CPU has its own.
    pub fn cpu(&self) -> Duration {
        let now = self.running_since.map(|(_, cpu)| cpu.elapsed());
        self.cpu_before.saturating_add(now.unwrap_or_default())
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
