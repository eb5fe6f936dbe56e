//! The bricks on the GPU: which one each place holds, and which get a place next.

use std::time::{Duration, Instant};

use bytemuck::Zeroable;

use super::host::HostBricks;
use super::place_bricks::PlaceBricks;
use super::window::{Items, Loads, Window};
use crate::error::Result;
use crate::gpu::{Buffer, Frame, Image, Piece};
use crate::render::layout::BrickLayout;
use crate::render::packed::pack;
use crate::render::shared::{PAGE_READ, PAGE_RESIDENT, Streaming};

/// The most bricks that are brought between two looks at the clock, while a window waits for its next frame.
const PIECE: usize = 32;

/// Figures of the streaming so far.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BrickFigures {
    /// Bricks of the whole volume, and those on the GPU.
    pub total: u32,
    pub resident: u32,
    /// Bricks in which there was something to see at the beginning.
    pub matter: u32,
    pub loads: u64,
    pub bytes_read: u64,
    /// Time for which the device waited for bricks.
    pub waited: Duration,
}

/// What is known of the bricks on the GPU, and of the dispatches that read them.
pub struct BrickPlaces {
    pub(super) layout: BrickLayout,
    /// Copies of `pages` and `streaming` that the host reads and writes.
    pub(super) host_pages: Buffer,
    pub(super) host_streaming: Buffer,
    pub(super) staging: Buffer,
    pub(super) place: PlaceBricks,
    /// Bytes of a brick in the staging buffer.
    pub(super) room: usize,
    /// `None` until the volume is known.
    pub(super) host: Option<HostBricks>,
    /// The brick in each place.
    pub(super) held: Vec<Option<u32>>,
    /// The round in which each place was last read, or got its brick.
    pub(super) read: Vec<u64>,
    pub(super) round: u64,
    pub(super) window: Window,
    pub(super) items: Items,
    /// The report of the last dispatch.
    pub(super) told: Streaming,
    /// Whether `host_pages` has changes that the device does not know yet.
    pub(super) has_news: bool,
    /// Whether invocations do without missing bricks instead of waiting for them.
    pub(super) previews: bool,
    /// The time that bringing bricks may take between two dispatches; [`PIECE`] bricks are brought in any case.
    pub(super) patience: Duration,
    /// Number of the piece of work under way.
    pub(super) work: u32,
    pub(super) figures: BrickFigures,
}

impl BrickPlaces {
    /// Prepares what the next dispatch has to know: the page table, and which invocations may work.
    pub(super) fn tell(&mut self, pages: &[u32]) {
        self.host_pages.write(pages);
        self.has_news = true;
        self.write_streaming();
    }

    /// Brings bricks that were missed, and prepares the page table that says where they are.
    pub(super) fn load_missed(&mut self, frame: &mut Frame, image: &Image) -> Result<Loads> {
        let began = Instant::now();
        let mut words = self.take_reads();
        let loads = self.load(frame, image, &mut words);
        if loads.is_err() {
            // Some places do not hold the brick that the page table names.
            self.held.fill(None);
            words.fill(0);
        }
        self.tell(&words);
        self.figures.waited += began.elapsed();
        loads
    }

    pub(super) fn write_streaming(&mut self) {
        self.host_streaming.write(&[Streaming {
            first_missed: u32::MAX,
            first: self.window.first,
            count: self.window.count,
            work: self.work,
            units: self.items.units,
            first_item: self.items.first,
            end_item: self.items.end,
            oldest_item: u32::MAX,
            previews: self.previews as u32,
            ..Streaming::zeroed()
        }]);
    }

    /// The page table as the last dispatch has left it. Its marks of bricks that were read are moved to `read`.
    pub(super) fn take_reads(&mut self) -> Vec<u32> {
        let bytes = 4 * self.layout.total() as usize;
        let mapped = &self.host_pages.mapped().unwrap_or_default()[..bytes];
        let mut words: Vec<u32> = bytemuck::pod_collect_to_vec(mapped);
        self.round += 1;
        for (place, held) in self.held.iter().enumerate() {
            if let Some(brick) = *held
                && words[brick as usize] & PAGE_READ != 0
            {
                self.read[place] = self.round;
                words[brick as usize] &= !PAGE_READ;
            }
        }
        words
    }

    /// Loads the bricks that were asked for most, and enters their places in the page table.
    fn load(&mut self, frame: &mut Frame, image: &Image, words: &mut [u32]) -> Result<Loads> {
        let mut wanted: Vec<(u32, u32)> = Vec::new();
        for (brick, word) in words.iter_mut().enumerate() {
            if *word & PAGE_RESIDENT == 0 && *word > 0 {
                wanted.push((std::mem::take(word), brick as u32));
            }
        }
        wanted.sort_unstable_by_key(|&(count, brick)| (std::cmp::Reverse(count), brick));
        let places = self.places_to_give();
        let mut loads: Vec<(u32, usize)> =
            wanted.iter().map(|&(_, brick)| brick).zip(places).collect();
        if self.patience == Duration::MAX && self.host.as_ref().is_some_and(HostBricks::reads_rows)
        {
            // All of them will be brought: in the file's order, so that those in a row are read together.
            loads.sort_unstable();
        }
        let at_once = match self.patience {
            Duration::MAX => usize::MAX,
            _ => PIECE,
        };
        let at_once = at_once.min(self.staging.desc.bytes as usize / self.room);
        let (began, mut loaded) = (Instant::now(), 0);
        for loads in loads.chunks(at_once) {
            if loaded > 0 && began.elapsed() >= self.patience {
                break;
            }
            for &(brick, place) in loads {
                if let Some(old) = self.held[place].replace(brick) {
                    words[old as usize] = 0;
                }
                self.read[place] = self.round;
                words[brick as usize] = PAGE_RESIDENT | pack(self.layout.place(place as u32));
            }
            self.bring(frame, image, loads)?;
            loaded += loads.len();
        }
        self.figures.resident = self.held.iter().flatten().count() as u32;
        Ok(Loads {
            loaded,
            has_room: loads.len() == wanted.len(),
        })
    }

    /// Places that may get other bricks, in order: first those without a brick, then those whose brick was not read
    /// in the last dispatch, beginning with the one that has not been read for longest. A brick that was read serves
    /// paths that make progress; invocations that wait get its place once those paths have left it.
    fn places_to_give(&self) -> Vec<usize> {
        let is_unread =
            |&place: &usize| self.held[place].is_none() || self.read[place] < self.round;
        let mut unread: Vec<usize> = (0..self.held.len()).filter(is_unread).collect();
        unread.sort_by_key(|&place| (self.held[place].is_some(), self.read[place]));
        unread
    }

    /// Copies bricks to their places, of which the staging buffer has room for all.
    fn bring(&mut self, frame: &mut Frame, image: &Image, loads: &[(u32, usize)]) -> Result<()> {
        let (Some(host), room) = (&mut self.host, self.room) else {
            return Ok(());
        };
        let bricks: Vec<u32> = loads.iter().map(|&(brick, _)| brick).collect();
        if let Some(mapped) = self.staging.mapped_mut() {
            host.fill(&bricks, mapped, room)?;
        }
        let layout = &self.layout;
        let piece = |(n, &(brick, place)): (usize, &(u32, usize))| Piece {
            offset: (n * room) as u64,
            low: layout.place(place as u32).map(|i| i * layout.pitch()),
            extent: host.region(brick).dims,
        };
        let pieces: Vec<Piece> = loads.iter().enumerate().map(piece).collect();
        self.place.run(frame, &self.staging, image, &pieces)?;
        self.figures.loads += loads.len() as u64;
        self.figures.bytes_read = host.bytes_read;
        Ok(())
    }
}
