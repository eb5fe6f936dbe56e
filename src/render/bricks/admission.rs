//! Which invocations of a dispatch may work while bricks of the volume are missing.
//!
//! Usually all may. Where too many invocations need too many bricks at once, none of them finds all that it needs.
//! Then only a range of their indices is admitted, which shrinks until one of them makes progress, in the end to a
//! single invocation.

use crate::render::shared::Streaming;

/// What the invocations of a dispatch work on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Order {
    /// Slots with a path each, which are not done before the queue is empty: any of them may make progress.
    Slots,
    /// Pixels or the like. Each is done in one dispatch, and neighbours need the same bricks, so the range moves
    /// through them in order of their indices.
    Pixels,
}

/// The items (see `picture/bundle.rs`) that may be worked on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Items {
    /// Units in the bundle.
    pub units: u32,
    /// The first item to be worked on; in a queue, the item that its number 0 stands for.
    pub first: u32,
    /// Items from this one on have to wait.
    pub end: u32,
}

impl Items {
    /// For work that is not made of items, and does not look at these.
    pub const NONE: Items = Items {
        units: 1,
        first: 0,
        end: 0,
    };
}

/// What the host did about bricks that were missed.
#[derive(Debug, Clone, Copy)]
pub struct Loads {
    /// Bricks that have been loaded.
    pub loaded: usize,
    /// Whether there were places for all bricks that invocations have asked for. Those that have not been loaded are
    /// then only late.
    pub has_room: bool,
}

/// A single invocation needs more bricks than there is room for.
#[derive(Debug, PartialEq, Eq)]
pub struct NoRoom;

/// The invocations that are admitted: a range of their indices. Each piece of work has its own, because other work may run
/// between two of its dispatches.
#[derive(Debug)]
pub struct Admission {
    order: Order,
    pub first: u32,
    /// Invocations in the range; `ALL` stands for the whole dispatch.
    pub count: u32,
    /// Dispatches without progress since the last progress, or since the range shrank.
    stalled: u32,
    /// For pixels: the number of invocations with which the next work on them starts, the size to which the range was last
    /// set while pixels were left. `None` for slots.
    pub enough: Option<u32>,
}

/// Value of [`Admission::count`] that admits every invocation of a dispatch.
pub const ALL: u32 = u32::MAX;
/// Dispatches without progress, but with bricks that were loaded, that are tolerated before a range of slots shrinks: a path
/// may need several bricks before it advances.
const PATIENCE: u32 = 2;

impl Admission {
    /// Admits all slots, to new work on them.
    pub fn of_slots() -> Admission {
        Admission {
            order: Order::Slots,
            first: 0,
            count: ALL,
            stalled: 0,
            enough: None,
        }
    }

    /// Admits the first `count` pixels, or the like, to new work on them.
    pub fn of_pixels(count: u32) -> Admission {
        Admission {
            order: Order::Pixels,
            count,
            enough: Some(count),
            ..Admission::of_slots()
        }
    }

    pub fn admits_all(&self) -> bool {
        self.count == ALL
    }

    /// Moves, widens or shrinks the range after a dispatch.
    pub fn follow(&mut self, report: &Streaming, loads: Loads) -> Result<(), NoRoom> {
        if report.advanced > 0 {
            self.stalled = 0;
        }
        match (self.order, report.missed) {
            (Order::Slots, 0) => *self = Admission::of_slots(),
            (Order::Slots, _) => return self.follow_slots(report, loads),
            (Order::Pixels, 0) => self.pass(report),
            (Order::Pixels, _) => return self.follow_pixels(report, loads),
        }
        Ok(())
    }

    fn follow_slots(&mut self, report: &Streaming, loads: Loads) -> Result<(), NoRoom> {
        if report.advanced > 0 {
            self.count = self.count.saturating_mul(2);
            if self.admits_all() {
                self.first = 0;
            }
            return Ok(());
        }
        self.stalled += 1;
        if loads.loaded > 0 && (self.stalled <= PATIENCE || self.count == 1) {
            return Ok(());
        }
        self.shrink(report)
    }

    fn follow_pixels(&mut self, report: &Streaming, loads: Loads) -> Result<(), NoRoom> {
        if loads.has_room || (self.count == 1 && loads.loaded > 0) {
            return Ok(());
        }
        self.shrink(report)?;
        self.enough = Some(self.count);
        Ok(())
    }

    /// Moves on from a range all of whose pixels are done.
    fn pass(&mut self, report: &Streaming) {
        if report.advanced == 0 {
            // The range held no unfinished pixel, so the next dispatch covers all pixels; usually all of them are finished
            // by then.
            (self.first, self.count) = (0, ALL);
            return;
        }
        self.first = self.first.saturating_add(self.count);
        self.count = self.count.saturating_add((self.count / 4).max(1));
        self.enough = Some(self.count);
    }

    fn shrink(&mut self, report: &Streaming) -> Result<(), NoRoom> {
        if self.count == 1 {
            return Err(NoRoom);
        }
        self.stalled = 0;
        self.first = report.first_missed;
        self.count = (self.count.min(report.missed) / 2).max(1);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    fn report(missed: u32, first_missed: u32, advanced: u32) -> Streaming {
        Streaming {
            missed,
            first_missed,
            advanced,
            ..Streaming::zeroed()
        }
    }

    const SOME: Loads = Loads {
        loaded: 5,
        has_room: false,
    };
    const NONE: Loads = Loads {
        loaded: 0,
        has_room: false,
    };
    const LATE: Loads = Loads {
        loaded: 5,
        has_room: true,
    };

    #[test]
    fn slots_work_all_at_once_until_none_comes_further() {
        let mut admission = Admission::of_slots();
        admission
            .follow(&report(100, 7, 3), NONE)
            .expect("progress");
        assert!(admission.admits_all());
        for _ in 0..=PATIENCE {
            admission.follow(&report(100, 7, 0), SOME).expect("room");
        }
        assert_eq!((admission.first, admission.count), (7, 50));
        admission.follow(&report(0, ALL, 50), SOME).expect("room");
        assert!(admission.admits_all());
    }

    #[test]
    fn a_single_slot_without_room_is_an_error() {
        let mut admission = Admission::of_slots();
        let mut rounds = 0;
        while admission.follow(&report(100, 7, 0), NONE).is_ok() {
            rounds += 1;
            assert!(rounds < 100);
        }
        assert_eq!((admission.first, admission.count), (7, 1));
    }

    #[test]
    fn pixels_are_gone_through_in_order_as_many_at_once_as_find_their_bricks() {
        let mut admission = Admission::of_pixels(ALL);
        admission.follow(&report(80, 20, 10), SOME).expect("room");
        assert_eq!((admission.first, admission.count), (20, 40));
        admission.follow(&report(0, ALL, 40), SOME).expect("room");
        assert_eq!((admission.first, admission.count), (60, 50));
        admission.follow(&report(0, ALL, 0), SOME).expect("room");
        assert!(admission.admits_all() && admission.first == 0);
        assert_eq!(admission.enough, Some(50));
    }

    #[test]
    fn a_range_of_one_pixel_grows_again() {
        let mut admission = Admission::of_pixels(ALL);
        admission.follow(&report(3, 20, 1000), NONE).expect("room");
        assert_eq!((admission.first, admission.count), (20, 1));
        for _ in 0..12 {
            admission.follow(&report(0, ALL, 1), SOME).expect("room");
        }
        assert!(admission.count > 16, "{}", admission.count);
    }

    #[test]
    fn pixels_whose_bricks_are_late_are_no_fewer() {
        let mut admission = Admission::of_pixels(ALL);
        admission.follow(&report(80, 20, 10), LATE).expect("room");
        assert!(admission.admits_all());
    }
}
