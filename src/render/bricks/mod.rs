//! Bricks of a volume that does not fit, loaded onto the GPU when invocations ask for them.
//!
//! Shaders find voxels through a page table (`glsl/include/volume_bricks.glsl`). An invocation that misses a brick
//! counts its request in the brick's page, and what it has computed is void: it repeats its work once the brick is
//! there. So the host only has to ensure that some invocation makes progress: after a dispatch that has missed bricks
//! it loads those requested most, in the places of bricks that have not been read since the host last looked. If all
//! have been read and no invocation makes progress, too many invocations need too many bricks at once, and only some
//! of them may work for a while (`window.rs`); in the end a single one, which needs the bricks along one ray.

mod host;
mod needed;
pub(super) mod place_bricks;
mod places;
mod window;

pub use needed::needed_bricks;
pub use places::BrickFigures;
pub use window::{Items, Order};

use std::cell::RefCell;
use std::sync::Arc;
use std::time::Duration;

use bytemuck::Zeroable;

use super::gpu_scene::GpuScene;
use super::layout::BrickLayout;
use super::pass_compiler::PassCompiler;
use super::shared::Streaming;
use crate::error::{Error, MemoryError, Result};
use crate::gpu::{Binding, Buffer, BufferDesc, Frame, Image, Memory, Placement};
use crate::scene::volume::Volume;
use host::HostBricks;
use needed::bricks_that_matter;
use place_bricks::PlaceBricks;
use places::BrickPlaces;
use window::{NoRoom, Window};

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
    state: RefCell<BrickPlaces>,
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
            state: RefCell::new(BrickPlaces {
                layout,
                host_pages: buffer("volume pages, host", page_bytes, Placement::Readback)?,
                host_streaming: buffer("streaming, host", streaming_bytes, Placement::Readback)?,
                staging: buffer("brick staging", staging, Placement::Readback)?,
                place: PlaceBricks::allocate(memory, (staging / room) as usize)?,
                room: room as usize,
                host: None,
                held: vec![None; capacity],
                read: vec![0; capacity],
                round: 0,
                window: Window::new(),
                items: Items::NONE,
                told: Streaming::zeroed(),
                has_news: false,
                previews: false,
                patience: Duration::MAX,
                work: 0,
                figures: BrickFigures {
                    total: layout.total(),
                    ..BrickFigures::default()
                },
            }),
        }))
    }

    pub fn compile(&mut self, passes: &PassCompiler<'_>) -> Result<()> {
        self.state.get_mut().place.compile(passes)
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
        if begins_anew {
            frame.run(|f| f.zero(&self.done))
        } else {
            Ok(())
        }
    }

    /// Sets the time that bringing bricks may take between two dispatches from now on.
    pub fn take_slices_of(&self, ms: f64) {
        self.state.borrow_mut().patience = Duration::from_secs_f64(ms / 1e3);
    }

    /// Begins a preview: until its end, no invocation waits for bricks, and other voxels stand in for missing ones.
    pub fn begin_preview(&self) {
        self.state.borrow_mut().previews = true;
    }

    /// Ends a preview, and brings bricks that it has missed; [`VolumeBricks::record_told`] must have been recorded after
    /// its last dispatch.
    pub fn end_preview(&self, frame: &mut Frame, image: &Image) -> Result<()> {
        let mut state = self.state.borrow_mut();
        state.previews = false;
        state.load_missed(frame, image).map(drop)
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
        let told: Streaming = state.host_streaming.read();
        state.told = told;
        if state.previews || told.missed == 0 && state.window.is_whole() {
            state.write_streaming();
            return Ok(false);
        }
        let loads = state.load_missed(frame, image)?;
        let followed = state.window.follow(&told, loads);
        followed.map_err(|NoRoom| no_room(&state.layout))?;
        state.write_streaming();
        Ok(true)
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
