//! Bricks of a volume that does not fit, on their way onto the GPU when somebody has asked for them.
//!
//! Shaders find voxels through a page table (`glsl/include/volume_bricks.glsl`). One that misses a brick counts its
//! question in the brick's page, and what it has computed is void: it does the same again once the brick is there. So
//! the host only has to see to it that somebody comes further: after a dispatch that has missed bricks it loads those
//! asked for most, in the places of those that nobody has read since it last looked. If all have been read and nobody
//! comes further, too many want too much at once, and only a part of the invocations may work for a while; in the end a
//! single one, which needs the bricks along one ray.

use std::cell::RefCell;
use std::sync::Arc;
use std::time::{Duration, Instant};

use bytemuck::Zeroable;

use super::brick_layout::BrickLayout;
use super::brick_window::{Items, Loads, NoRoom, Order, Window};
use super::gpu_scene::GpuScene;
use super::host_bricks::HostBricks;
use super::plan_in_bricks::bricks_that_matter;
use super::shared::{PAGE_READ, PAGE_RESIDENT, Streaming};
use crate::error::{Error, MemoryError, Result};
use crate::gpu::{Binding, Buffer, BufferDesc, Frame, Image, Memory, Piece, Placement};
use crate::scene::volume::Volume;

/// Bricks are brought onto the GPU through a buffer of this size, or of a quarter of all places.
const STAGING_BYTES: u64 = 8 << 20;
/// Offsets in a buffer at which every device copies to every format.
const ALIGNMENT: usize = 16;

/// The page table of a volume in bricks, and what goes with it.
pub struct VolumeBricks {
    pages: Buffer,
    streaming: Buffer,
    done: Buffer,
    marks: Marks,
    state: RefCell<State>,
}

/// What may have been done: pixels, or bricks of the cache.
#[derive(Debug, Clone, Copy)]
struct Marks {
    size: [u32; 2],
    bricks: usize,
}

impl Marks {
    fn bytes(&self) -> u64 {
        let [width, height] = self.size.map(u64::from);
        4 * (width * height).max(self.bricks as u64)
    }
}

struct State {
    layout: BrickLayout,
    /// Copies of `pages` and `streaming` that the host reads and writes.
    host_pages: Buffer,
    host_streaming: Buffer,
    staging: Buffer,
    /// Bytes of a brick in the staging buffer.
    room: usize,
    /// Once the volume is known.
    host: Option<HostBricks>,
    /// The brick in each place.
    held: Vec<Option<u32>>,
    /// When each place was last read, or got its brick, in rounds.
    read: Vec<u64>,
    round: u64,
    window: Window,
    items: Items,
    /// What the last dispatch has told.
    told: Streaming,
    /// `host_pages` says what the device does not know yet.
    has_news: bool,
    /// Number of the piece of work under way.
    work: u32,
    figures: BrickFigures,
}

/// What has been done so far.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BrickFigures {
    /// Bricks of the whole volume, and those on the GPU.
    pub total: u32,
    pub resident: u32,
    /// Those that anybody may ask for, as far as one knew at the beginning.
    pub matter: u32,
    pub loads: u64,
    pub bytes_read: u64,
    /// While the device waited for bricks.
    pub waited: Duration,
}

impl VolumeBricks {
    /// `None` where the scene's volume is whole.
    pub fn allocate(memory: &Arc<Memory>, scene: &GpuScene) -> Result<Option<VolumeBricks>> {
        let Some(layout) = scene.bricks else {
            return Ok(None);
        };
        let buffer = |name, bytes, placement| {
            let desc = BufferDesc {
                name,
                bytes,
                placement,
            };
            Buffer::new(memory, desc)
        };
        let page_bytes = 4 * u64::from(layout.total());
        let voxel_bytes = scene.parts.field.stored.bytes();
        let room = room(&layout, voxel_bytes) as u64;
        let staging = STAGING_BYTES.min(u64::from(layout.capacity().div_ceil(4)) * room);
        let staging = staging.max(room);
        let streaming_bytes = size_of::<Streaming>() as u64;
        let capacity = layout.capacity() as usize;
        let marks = Marks {
            size: scene.parts.view.size,
            bricks: scene.variant.cache().map_or(0, |cache| cache.active.len()),
        };
        Ok(Some(VolumeBricks {
            pages: buffer("volume pages", page_bytes, Placement::Device)?,
            streaming: buffer("streaming", streaming_bytes, Placement::Device)?,
            done: buffer("done marks", marks.bytes(), Placement::Device)?,
            marks,
            state: RefCell::new(State {
                layout,
                host_pages: buffer("volume pages, host", page_bytes, Placement::Readback)?,
                host_streaming: buffer("streaming, host", streaming_bytes, Placement::Readback)?,
                staging: buffer("brick staging", staging, Placement::Readback)?,
                room: room as usize,
                host: None,
                held: vec![None; capacity],
                read: vec![0; capacity],
                round: 0,
                window: Window::new(),
                items: Items::NONE,
                told: Streaming::zeroed(),
                has_news: false,
                work: 0,
                figures: BrickFigures {
                    total: layout.total(),
                    ..BrickFigures::default()
                },
            }),
        }))
    }

    /// Begins with no brick on the GPU.
    pub fn open(&mut self, frame: &mut Frame, volume: &Volume, scene: &GpuScene) -> Result<()> {
        let state = self.state.get_mut();
        let matters = bricks_that_matter(scene, volume, state.layout.side);
        state.figures.matter = matters.iter().filter(|&&matters| matters).count() as u32;
        state.host = Some(HostBricks::new(volume, state.layout, matters)?);
        let no_pages = vec![0u32; state.layout.total() as usize];
        state.host_pages.write(&no_pages);
        self.begin(frame, Order::Slots)?;
        frame.run(|f| self.record_news(f))
    }

    /// Makes room for pictures of another size.
    pub fn resize(&mut self, size: [u32; 2]) -> Result<()> {
        self.mark(Marks { size, ..self.marks })
    }

    /// Makes room for another number of bricks of the cache.
    pub fn resize_cache(&mut self, bricks: usize) -> Result<()> {
        self.mark(Marks {
            bricks,
            ..self.marks
        })
    }

    fn mark(&mut self, marks: Marks) -> Result<()> {
        self.marks = marks;
        self.state.get_mut().work = 0;
        self.done.resize(marks.bytes())
    }

    pub fn bindings(&self) -> [(&'static str, Binding<'_>); 3] {
        [
            ("volume_pages", Binding::Buffer(&self.pages)),
            self.streaming_binding(),
            ("done", Binding::Buffer(&self.done)),
        ]
    }

    pub fn streaming_binding(&self) -> (&'static str, Binding<'_>) {
        ("streaming", Binding::Buffer(&self.streaming))
    }

    pub fn figures(&self) -> BrickFigures {
        self.state.borrow().figures
    }

    /// Begins a piece of work, of which nothing is done.
    pub fn begin(&self, frame: &mut Frame, order: Order) -> Result<()> {
        let mut state = self.state.borrow_mut();
        state.window.begin(order);
        state.work = state.work.wrapping_add(1);
        let begins_anew = state.work <= 1;
        state.work = state.work.max(1);
        let words = state.take_reads();
        state.tell(&words);
        match begins_anew {
            true => frame.run(|f| f.zero(&self.done)),
            false => Ok(()),
        }
    }

    /// Decides which items the next dispatch works on.
    pub fn allow(&self, items: Items) {
        let mut state = self.state.borrow_mut();
        state.items = items;
        state.write_streaming();
    }

    /// What the last dispatch has told.
    pub fn told(&self) -> Streaming {
        self.state.borrow().told
    }

    /// Records, before a dispatch, what it has to know.
    pub fn record_news(&self, frame: &mut Frame) -> Result<()> {
        let mut state = self.state.borrow_mut();
        if std::mem::take(&mut state.has_news) {
            frame.copy(&state.host_pages, &self.pages)?;
        }
        frame.copy(&state.host_streaming, &self.streaming)
    }

    /// Records, behind a dispatch, what [`VolumeBricks::serve`] reads.
    pub fn record_told(&self, frame: &mut Frame) -> Result<()> {
        let state = self.state.borrow();
        frame.copy(&self.streaming, &state.host_streaming)?;
        frame.copy(&self.pages, &state.host_pages)
    }

    /// Brings bricks that the last dispatch has missed onto the GPU; [`VolumeBricks::record_told`] was recorded behind it.
    /// Returns whether the dispatch has to be repeated, because something was missed or because not all invocations
    /// worked.
    ///
    /// # Errors
    ///
    /// If the volume cannot be read, or if a single invocation needs more bricks at once than there is room for.
    pub fn serve(&self, frame: &mut Frame, image: &Image) -> Result<bool> {
        let mut state = self.state.borrow_mut();
        let mapped = state.host_streaming.mapped().unwrap_or_default();
        let told: Streaming = bytemuck::pod_read_unaligned(&mapped[..size_of::<Streaming>()]);
        state.told = told;
        if told.missed == 0 && state.window.is_whole() {
            state.write_streaming();
            return Ok(false);
        }
        let began = Instant::now();
        let mut words = state.take_reads();
        let loads = match told.missed {
            0 => Ok(Loads {
                wanted: 0,
                loaded: 0,
            }),
            _ => state.load(frame, image, &mut words),
        };
        if loads.is_err() {
            // Some places hold others than the page table says.
            state.held.fill(None);
            words.fill(0);
        }
        let followed = loads.and_then(|loads| {
            let followed = state.window.follow(&told, loads);
            followed.map_err(|NoRoom| no_room(&state.layout))
        });
        state.tell(&words);
        state.figures.waited += began.elapsed();
        followed.map(|()| true)
    }
}

impl State {
    /// What the next dispatch is to be told of bricks, and which invocations may work.
    fn tell(&mut self, pages: &[u32]) {
        self.host_pages.write(pages);
        self.has_news = true;
        self.write_streaming();
    }

    fn write_streaming(&mut self) {
        self.host_streaming.write(&[Streaming {
            first_missed: u32::MAX,
            first: self.window.first,
            count: self.window.count,
            work: self.work,
            units: self.items.units,
            first_item: self.items.first,
            end_item: self.items.end,
            oldest_item: u32::MAX,
            ..Streaming::zeroed()
        }]);
    }

    /// The page table as the last dispatch has left it. Who was read by it is noted, and nobody has been read since.
    fn take_reads(&mut self) -> Vec<u32> {
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

    /// Loads the bricks that were asked for most, and notes in the page table where they are then.
    fn load(&mut self, frame: &mut Frame, image: &Image, words: &mut [u32]) -> Result<Loads> {
        let mut wanted: Vec<(u32, u32)> = Vec::new();
        for (brick, word) in words.iter_mut().enumerate() {
            if *word & PAGE_RESIDENT == 0 && *word > 0 {
                wanted.push((std::mem::take(word), brick as u32));
            }
        }
        wanted.sort_unstable_by_key(|&(count, brick)| (std::cmp::Reverse(count), brick));
        let places = self.places_to_give();
        let loads: Vec<(u32, usize)> = wanted.iter().map(|&(_, brick)| brick).zip(places).collect();
        for &(brick, place) in &loads {
            if let Some(old) = self.held[place].replace(brick) {
                words[old as usize] = 0;
            }
            self.read[place] = self.round;
            let [x, y, z] = self.layout.place(place as u32);
            words[brick as usize] = PAGE_RESIDENT | x | y << 10 | z << 20;
        }
        self.bring(frame, image, &loads)?;
        self.figures.resident = self.held.iter().flatten().count() as u32;
        Ok(Loads {
            wanted: wanted.len(),
            loaded: loads.len(),
        })
    }

    /// Places for other bricks, in the order in which they are given up: those without a brick, and those that nobody has
    /// read in the last dispatch, those first that have not been read for longest. A brick that was read serves paths
    /// that come further, and whoever waits gets its place once they have left it.
    fn places_to_give(&self) -> Vec<usize> {
        let is_unread =
            |&place: &usize| self.held[place].is_none() || self.read[place] < self.round;
        let mut unread: Vec<usize> = (0..self.held.len()).filter(is_unread).collect();
        unread.sort_by_key(|&place| (self.held[place].is_some(), self.read[place]));
        unread
    }

    /// Copies bricks to their places.
    fn bring(&mut self, frame: &mut Frame, image: &Image, loads: &[(u32, usize)]) -> Result<()> {
        let (Some(host), room) = (&mut self.host, self.room) else {
            return Ok(());
        };
        let at_once = (self.staging.desc.bytes as usize / room).max(1);
        for loads in loads.chunks(at_once) {
            let bricks: Vec<u32> = loads.iter().map(|&(brick, _)| brick).collect();
            if let Some(mapped) = self.staging.mapped_mut() {
                host.fill(&bricks, mapped, room)?;
            }
            let piece = |(n, &(brick, place)): (usize, &(u32, usize))| Piece {
                offset: (n * room) as u64,
                low: self
                    .layout
                    .place(place as u32)
                    .map(|i| i * self.layout.pitch()),
                extent: host.region(brick).dims,
            };
            let pieces: Vec<Piece> = loads.iter().enumerate().map(piece).collect();
            frame.run(|f| f.upload_pieces(&self.staging, image, &pieces))?;
        }
        self.figures.loads += loads.len() as u64;
        self.figures.bytes_read = host.bytes_read;
        Ok(())
    }
}

fn no_room(layout: &BrickLayout) -> Error {
    let room = layout.capacity();
    MemoryError::VolumeBricks { room }.into()
}

/// Bytes of a brick in the staging buffer.
fn room(layout: &BrickLayout, voxel_bytes: usize) -> usize {
    let texels = (layout.pitch() as usize).pow(3);
    (texels * voxel_bytes).next_multiple_of(ALIGNMENT)
}
