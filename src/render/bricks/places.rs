//! Which brick each place on the GPU holds, and which bricks get a place next.
//!
//! The page table has a word for each brick: with `PAGE_RESIDENT`, where the brick is, and whether it was read since the
//! host last looked (`PAGE_READ`); otherwise, how often invocations have asked for it.

use std::cmp::Reverse;

use crate::render::layout::BrickLayout;
use crate::render::shared::{PAGE_READ, PAGE_RESIDENT};

pub struct Places {
    layout: BrickLayout,
    /// The brick in each place.
    held: Vec<Option<u32>>,
    /// The round in which each place was last read, or got its brick.
    read: Vec<u64>,
    /// Number of times that the host has looked at the page table.
    round: u64,
}

/// A brick and the place that it gets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Load {
    pub brick: u32,
    pub place: u32,
}

impl Places {
    /// Places that hold no brick.
    pub fn new(layout: BrickLayout) -> Places {
        let capacity = layout.capacity() as usize;
        Places {
            layout,
            held: vec![None; capacity],
            read: vec![0; capacity],
            round: 0,
        }
    }

    /// Begins a round: takes the marks of bricks that were read from the page table.
    pub fn take_reads(&mut self, pages: &mut [u32]) {
        self.round += 1;
        for (held, read) in self.held.iter().zip(&mut self.read) {
            if let Some(brick) = *held
                && pages[brick as usize] & PAGE_READ != 0
            {
                *read = self.round;
                pages[brick as usize] &= !PAGE_READ;
            }
        }
    }

    /// Places for bricks, the first ones first, as far as there are places to give.
    pub fn assign(&self, bricks: &[u32]) -> Vec<Load> {
        let places = self.places_to_give(bricks.len());
        let load = |(&brick, place)| Load { brick, place };
        bricks.iter().zip(places).map(load).collect()
    }

    /// The first `most` places that may get other bricks, in order: first those without a brick, then those whose brick was not read
    /// in the last dispatch, beginning with the one that has not been read for longest. A brick that was read serves
    /// paths that make progress; invocations that wait get its place once those paths have left it.
    fn places_to_give(&self, most: usize) -> Vec<u32> {
        let is_unread = |place: &u32| {
            let place = *place as usize;
            self.held[place].is_none() || self.read[place] < self.round
        };
        let order = |&place: &u32| {
            let (held, read) = (self.held[place as usize], self.read[place as usize]);
            (held.is_some(), read, place)
        };
        let mut unread: Vec<u32> = (0..self.held.len() as u32).filter(is_unread).collect();
        // A large device has a hundred thousand places, and a dispatch mostly misses a few bricks.
        if most < unread.len() {
            unread.select_nth_unstable_by_key(most, order);
            unread.truncate(most);
        }
        unread.sort_unstable_by_key(order);
        unread
    }

    /// Gives a brick its place, and enters that in the page table.
    pub fn put(&mut self, load: Load, pages: &mut [u32]) {
        let Load { brick, place } = load;
        if let Some(old) = self.held[place as usize].replace(brick) {
            pages[old as usize] = 0;
        }
        self.read[place as usize] = self.round;
        pages[brick as usize] = PAGE_RESIDENT | self.layout.page(place);
    }

    /// Forgets what the places hold.
    pub fn clear(&mut self, pages: &mut [u32]) {
        self.held.fill(None);
        pages.fill(0);
    }

    /// Number of places that hold a brick.
    pub fn resident(&self) -> u32 {
        self.held.iter().flatten().count() as u32
    }
}

/// Takes the requests from the page table: bricks that were asked for, most often first.
pub fn take_requests(pages: &mut [u32]) -> Vec<u32> {
    let mut requests = Vec::new();
    for (brick, word) in pages.iter_mut().enumerate() {
        if *word & PAGE_RESIDENT == 0 && *word > 0 {
            requests.push((std::mem::take(word), brick as u32));
        }
    }
    requests.sort_unstable_by_key(|&(count, brick)| (Reverse(count), brick));
    requests.into_iter().map(|(_, brick)| brick).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Eight bricks, and two places for them.
    fn places() -> (Places, Vec<u32>) {
        let layout = BrickLayout {
            side: 8,
            bricks: [8, 1, 1],
            images: 1,
            places: [2, 1, 1],
            host_bytes: 0,
        };
        (Places::new(layout), vec![0; 8])
    }

    fn load(places: &mut Places, pages: &mut [u32], bricks: &[u32]) -> Vec<Load> {
        let loads = places.assign(bricks);
        for &load in &loads {
            places.put(load, pages);
        }
        loads
    }

    #[test]
    fn bricks_asked_for_most_come_first_and_requests_are_taken() {
        let mut pages = [0, 3, 0, 7, 3, PAGE_RESIDENT | 5, 0, 0];
        assert_eq!(take_requests(&mut pages), [3, 1, 4]);
        assert_eq!(pages, [0, 0, 0, 0, 0, PAGE_RESIDENT | 5, 0, 0]);
    }

    #[test]
    fn the_brick_that_was_not_read_for_longest_makes_room_and_one_that_was_read_stays() {
        let (mut places, mut pages) = places();
        places.take_reads(&mut pages);
        load(&mut places, &mut pages, &[2, 5]);
        assert_eq!(places.resident(), 2);
        // Both were read: there is no place to give.
        pages[2] |= PAGE_READ;
        pages[5] |= PAGE_READ;
        places.take_reads(&mut pages);
        assert_eq!(places.assign(&[1]), []);
        // Brick 5 is read again, brick 2 is not.
        pages[5] |= PAGE_READ;
        places.take_reads(&mut pages);
        let loads = load(&mut places, &mut pages, &[1, 7]);
        assert_eq!(loads, [Load { brick: 1, place: 0 }]);
        assert_eq!(pages[2], 0);
        assert_eq!(pages[1] & PAGE_RESIDENT, PAGE_RESIDENT);
        assert_eq!(pages[5] & (PAGE_RESIDENT | PAGE_READ), PAGE_RESIDENT);
        // Brick 1 is read once more, and nothing in the round after that: brick 5 goes first.
        pages[1] |= PAGE_READ;
        places.take_reads(&mut pages);
        places.take_reads(&mut pages);
        let given = [Load { brick: 0, place: 1 }, Load { brick: 3, place: 0 }];
        assert_eq!(places.assign(&[0, 3, 4]), given);
    }
}
