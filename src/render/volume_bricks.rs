//! Bricks of a volume that does not fit, loaded onto the GPU when invocations ask for them.
//!
//! Shaders find voxels through a page table (`glsl/include/volume_bricks.glsl`). An invocation that misses a brick
//! counts its request in the brick's page, and what it has computed is void: it repeats its work once the brick is
//! there. So the host only has to ensure that some invocation makes progress: after a dispatch that has missed bricks
//! it loads those requested most, in the places of bricks that have not been read since the host last looked. If all
//! have been read and no invocation makes progress, too many invocations need too many bricks at once, and only some
//! of them may work for a while (`brick_window.rs`); in the end a single one, which needs the bricks along one ray.

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

/// Size of the buffer through which bricks are brought onto the GPU, unless a quarter of all places is less.
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

/// Sizes of the marks of finished work: one for each pixel, or for each brick of the cache.
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
    /// `None` until the volume is known.
    host: Option<HostBricks>,
    /// The brick in each place.
    held: Vec<Option<u32>>,
    /// The round in which each place was last read, or got its brick.
    read: Vec<u64>,
    round: u64,
    window: Window,
    items: Items,
    /// The report of the last dispatch.
    told: Streaming,
    /// Whether `host_pages` has changes that the device does not know yet.
    has_news: bool,
    /// Number of the piece of work under way.
    work: u32,
    figures: BrickFigures,
}

/// Figures of the streaming so far.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BrickFigures {
    /// Bricks of the whole volume, and those on the GPU.
    pub total: u32,
    pub resident: u32,
    /// Bricks that shaders may ask for, as far as the scene at the beginning tells.
    pub matter: u32,
    pub loads: u64,
    pub bytes_read: u64,
    /// Time for which the device waited for bricks.
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

    /// Opens the volume; no brick is on the GPU yet.
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

    /// Begins a new piece of work, of which nothing is done.
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

    /// The report of the last dispatch.
    pub fn told(&self) -> Streaming {
        self.state.borrow().told
    }

    /// Records, before a dispatch, the copies that tell it which bricks are there and which invocations may work.
    pub fn record_news(&self, frame: &mut Frame) -> Result<()> {
        let mut state = self.state.borrow_mut();
        if std::mem::take(&mut state.has_news) {
            frame.copy(&state.host_pages, &self.pages)?;
        }
        frame.copy(&state.host_streaming, &self.streaming)
    }

    /// Records, after a dispatch, the copies that [`VolumeBricks::serve`] reads.
    pub fn record_told(&self, frame: &mut Frame) -> Result<()> {
        let state = self.state.borrow();
        frame.copy(&self.streaming, &state.host_streaming)?;
        frame.copy(&self.pages, &state.host_pages)
    }

    /// Brings bricks that the last dispatch has missed onto the GPU; [`VolumeBricks::record_told`] must have been
    /// recorded after it. Returns whether the dispatch has to be repeated, because bricks were missed or because not
    /// all invocations worked.
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
            // Some places do not hold the brick that the page table names.
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
    /// Prepares what the next dispatch has to know: the page table, and which invocations may work.
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

    /// The page table as the last dispatch has left it. Its marks of bricks that were read are moved to `read`.
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
