//! A queue of paths, worked off by slots, dispatch after dispatch.
//!
//! A slot is a thread's room for a path in flight; it takes the next item from the queue when its paths have
//! ended. One dispatch advances each slot's path by a bounded number of iterations. The host chooses it so that a
//! dispatch stays far below the two seconds after which Windows resets a GPU, and checks between dispatches whether
//! anything is left to do.

use std::time::Instant;

use bytemuck::Zeroable;

use super::bricks::{Admission, Items};
use super::pass_compiler::PassCompiler;
use super::resources::Resources;
use super::shared::{Counters, LAVAPIPE_ITERATIONS};
use crate::error::Result;
use crate::gpu::{Frame, Pass, Recording, Work};

const LEAST_ITERATIONS: u32 = 16;
/// The most iterations of a slot in a dispatch: half of a thread's share of LAVAPIPE_ITERATIONS, which eight threads have
/// together. The other half is left for loops that are too short to be counted.
const MOST_ITERATIONS: u32 = (LAVAPIPE_ITERATIONS / 8 / 2).next_power_of_two();

pub struct PathQueue {
    /// Loop iterations that a slot makes in the next dispatch.
    iterations: u32,
    /// The value of `iterations` with which the next queue begins: so many keep a dispatch within its time even if all
    /// slots have a path, as measured or extrapolated. (Near a queue's end few slots have one, and dispatches are short.)
    iterations_at_full_load: u32,
    /// The iterations of all dispatches of the queue, and their time.
    spent_iterations: u32,
    spent_ms: f64,
    /// Whether no dispatch has been made of the queue.
    is_new: bool,
    /// The slots that may work, where the volume streams.
    admission: Admission,
    /// The first item of the queue.
    first_item: u32,
    /// The counters as the last dispatch left them.
    counted: Counters,
    /// Tracking reads one texel for a value, not the eight that are interpolated (`tentative_value` in
    /// `tracking.glsl`).
    reads_one_texel: bool,
}

/// The results of a dispatch.
pub struct Advanced {
    /// Reads of the volume by tracking.
    pub lookups: u32,
    /// Paths that have ended.
    pub finished: u32,
    /// Whether some path is still on its way.
    pub under_way: bool,
    /// Where the volume streams, all items before this one have ended.
    pub first_item: u32,
}

impl PathQueue {
    /// The queue of a pass that `passes` compiles.
    pub fn new(passes: &PassCompiler<'_>) -> PathQueue {
        PathQueue {
            iterations: LEAST_ITERATIONS,
            iterations_at_full_load: LEAST_ITERATIONS,
            spent_iterations: 0,
            spent_ms: 0.0,
            is_new: true,
            admission: Admission::of_slots(),
            first_item: 0,
            counted: Counters::zeroed(),
            reads_one_texel: passes.features.is_linear,
        }
    }

    /// Forgets all paths and starts the queue anew, with these items where the volume streams.
    pub fn restart(&mut self, frame: &mut Frame, r: &Resources, items: Items) -> Result<()> {
        self.counted = Counters::zeroed();
        self.iterations = self.iterations_at_first(frame.slice_ms);
        self.spent_iterations = 0;
        self.spent_ms = 0.0;
        self.is_new = true;
        self.admission = Admission::of_slots();
        if let Some(bricks) = &r.bricks {
            bricks.begin(frame)?;
            bricks.allow(items);
            self.first_item = items.first;
        }
        Ok(())
    }

    /// If the last queue took little time in all, the next one probably fits into a single dispatch, which saves a GPU the
    /// overhead of several. The next queue may hold much more, so its first dispatch has at most `TIMES` the iterations for
    /// full load.
    fn iterations_at_first(&self, slice_ms: f64) -> u32 {
        const TIMES: u32 = 8;
        if self.spent_ms < slice_ms / f64::from(TIMES) {
            self.spent_iterations.clamp(
                self.iterations_at_full_load,
                (TIMES * self.iterations_at_full_load).min(MOST_ITERATIONS),
            )
        } else {
            self.iterations_at_full_load
        }
    }

    /// Advances all paths by the dispatch of `pass` that `record` records, given the number of iterations.
    pub fn advance<'r>(
        &mut self,
        frame: &mut Frame,
        r: &'r Resources,
        pass: &'r Pass,
        record: impl FnOnce(&mut Recording<'_, 'r>, u32) -> Result<()>,
    ) -> Result<Advanced> {
        let began = Instant::now();
        let is_new = std::mem::take(&mut self.is_new);
        frame.run(|recording| {
            if is_new {
                recording.zero(&r.counters)?;
                recording.zero(&r.paths)?;
            }
            r.record_reading(recording, &self.admission, |recording| {
                record(recording, self.iterations)
            })?;
            recording.copy(&r.counters, &r.staging)
        })?;
        let took_ms = began.elapsed().as_secs_f64() * 1e3;
        self.spent_iterations = self.spent_iterations.saturating_add(self.iterations);
        self.spent_ms += took_ms;
        let counted = r.counters_read();
        let before = std::mem::replace(&mut self.counted, counted);
        let lookups = counted.lookups.wrapping_sub(before.lookups);
        frame
            .timings
            .state_work(pass.name, self.stated_work(lookups));
        let unfinished = counted.unfinished.wrapping_sub(before.unfinished);
        let (mut waits, mut waiting, mut first_item) = (false, 0, 0);
        if let Some(bricks) = &r.bricks {
            waits = bricks.serve(frame, &r.volumes, &mut self.admission)?;
            let report = bricks.report();
            waiting = report.missed;
            first_item = report.oldest_item.min(self.first_item + counted.next);
        }
        let most_were_busy = 2 * unfinished.saturating_sub(waiting) >= r.slots();
        // Paths that wait for bricks say nothing about the time that work takes.
        if most_were_busy || !waits {
            let share = took_ms / frame.slice_ms;
            self.adapt(share, r.slots(), lookups, most_were_busy);
        }
        Ok(Advanced {
            lookups,
            finished: counted.finished.wrapping_sub(before.finished),
            under_way: unfinished > 0 || waits,
            first_item,
        })
    }

    fn stated_work(&self, lookups: u32) -> Work {
        let lookups = u64::from(lookups);
        if self.reads_one_texel {
            Work::texels(lookups, 0)
        } else {
            Work::samples(lookups)
        }
    }

    /// Adapts the length of dispatches to the last one, which took `share` of the time that it should.
    fn adapt(&mut self, share: f64, slots: u32, lookups: u32, most_were_busy: bool) {
        // What the dispatch would have taken had all slots been busy. Its lookups tell how many were: about one comes in two
        // iterations.
        let all = f64::from(slots) * f64::from(self.iterations);
        let of_all = share * (all / (2.0 * f64::from(lookups.max(1)))).max(1.0);
        if of_all < 0.5 {
            self.iterations_at_full_load = self
                .iterations_at_full_load
                .max((2 * self.iterations).min(MOST_ITERATIONS));
        }
        if share < 0.5 {
            let times = if share < 1.0 / 16.0 { 8 } else { 2 };
            self.iterations = (self.iterations * times).min(MOST_ITERATIONS);
        } else if share > 1.5 {
            self.iterations = (self.iterations / 2).max(LEAST_ITERATIONS);
        }
        if most_were_busy {
            self.iterations_at_full_load = self.iterations;
        }
    }
}
