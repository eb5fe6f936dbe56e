//! Bricks of a volume that does not fit, loaded onto the GPU when invocations ask for them.
//!
//! Shaders find voxels through a page table (`glsl/include/volume_bricks.glsl`). An invocation that misses a brick
//! counts its request in the brick's page, and what it has computed is void: it repeats its work once the brick is
//! there. So the host only has to ensure that some invocation makes progress: after a dispatch that has missed bricks
//! it loads those requested most, in the places of bricks that have not been read since the host last looked. If all
//! have been read and no invocation makes progress, too many invocations need too many bricks at once, and only some
//! of them may work for a while (`admission.rs`); in the end a single one, which needs the bricks along one ray.

mod admission;
pub(super) mod copy_bricks;
mod exchange;
mod host;
mod loader;
mod needed;
mod places;

pub use admission::{Admission, Items};
pub use needed::needed_bricks;

use std::cell::RefCell;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::gpu_scene::GpuScene;
use super::layout::BrickLayout;
use super::pass_compiler::PassCompiler;
use super::shared::Streaming;
use crate::error::{Error, MemoryError, Result};
use crate::gpu::{Binding, Buffer, BufferDesc, Frame, Image, Memory, Recording};
use crate::scene::volume::Volume;
use admission::{ALL, Loads, NoRoom};
use exchange::{DeviceSide, Exchange, HostSide};
use host::HostBricks;
use loader::Loader;
use needed::which_are_needed;
use places::Places;

/// The bricks of a volume, those of them that are on the GPU, and the page table by which shaders find them.
pub struct VolumeBricks {
    layout: BrickLayout,
    device: DeviceSide,
    done: Buffer,
    host: HostSide,
    marks: Marks,
    /// In a `RefCell`, since passes hold shared references to the bricks while they change this state.
    state: RefCell<State>,
}

struct State {
    exchange: Exchange,
    places: Places,
    loader: Loader,
    /// Number of pixel invocations that can usually run at once without needing more bricks than there are places.
    pixels_at_once: u32,
    /// Time for which the device waited for bricks.
    waited: Duration,
}

/// Figures of the streaming so far.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BrickFigures {
    /// Bricks of the whole volume.
    pub total: u32,
    /// Bricks on the GPU now.
    pub resident: u32,
    /// Bricks brought to the GPU, repeatedly loaded ones counted each time.
    pub loads: u64,
    /// Bytes of the volume read for them.
    pub bytes_read: u64,
    /// Time for which the device waited for bricks.
    pub waited: Duration,
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
        let marks = Marks {
            size: scene.parts.view.size,
            bricks: scene.variant.cache().map_or(0, |cache| cache.active.len()),
        };
        let done = BufferDesc::device("done marks", marks.bytes());
        Ok(Some(VolumeBricks {
            layout,
            device: DeviceSide::allocate(memory, &layout)?,
            done: Buffer::new(memory, done)?,
            host: HostSide::allocate(memory, &layout)?,
            marks,
            state: RefCell::new(State {
                exchange: Exchange::new(),
                places: Places::new(layout),
                loader: Loader::allocate(memory, layout, scene.parts.field.stored.bytes())?,
                pixels_at_once: ALL,
                waited: Duration::ZERO,
            }),
        }))
    }

    pub fn compile(&mut self, passes: &PassCompiler<'_>) -> Result<()> {
        self.state.get_mut().loader.compile(passes)
    }

    /// Opens the volume; no brick is on the GPU yet.
    pub fn open(&mut self, frame: &mut Frame, volume: &Volume, scene: &GpuScene) -> Result<()> {
        let state = self.state.get_mut();
        let needed = which_are_needed(scene, volume, self.layout.side);
        state
            .loader
            .open(HostBricks::new(volume, self.layout, needed)?);
        let no_pages = vec![0; self.layout.total() as usize];
        state.exchange.write_pages(&self.host, &no_pages);
        self.begin(frame)?;
        frame.run(|recording| self.record_state(recording, &Admission::of_slots()))
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
        self.state.get_mut().exchange.forget_marks();
        self.done.resize(marks.bytes())
    }

    pub fn bindings(&self) -> [(&'static str, Binding<'_>); 3] {
        [
            ("volume_pages", Binding::Buffer(&self.device.pages)),
            self.streaming_binding(),
            ("done", Binding::Buffer(&self.done)),
        ]
    }

    pub fn streaming_binding(&self) -> (&'static str, Binding<'_>) {
        ("streaming", Binding::Buffer(&self.device.streaming))
    }

    pub fn figures(&self) -> BrickFigures {
        let state = self.state.borrow();
        BrickFigures {
            total: self.layout.total(),
            resident: state.places.resident(),
            loads: state.loader.loads,
            bytes_read: state.loader.bytes_read(),
            waited: state.waited,
        }
    }

    /// Begins a new piece of work, of which nothing is done.
    pub fn begin(&self, frame: &mut Frame) -> Result<()> {
        let mut state = self.state.borrow_mut();
        let begins_anew = state.exchange.begin();
        let mut pages = self.host.pages(&self.layout);
        state.places.take_reads(&mut pages);
        state.exchange.write_pages(&self.host, &pages);
        if begins_anew {
            frame.run(|recording| recording.zero(&self.done))
        } else {
            Ok(())
        }
    }

    /// Begins new work on pixels. Returns those that may do it first.
    pub fn begin_pixels(&self, frame: &mut Frame) -> Result<Admission> {
        self.begin(frame)?;
        let state = self.state.borrow();
        Ok(Admission::of_pixels(if state.exchange.previews {
            ALL
        } else {
            state.pixels_at_once
        }))
    }

    /// The mark that invocations get once they are done in the work that was begun last.
    pub fn done_mark(&self) -> u32 {
        self.state.borrow().exchange.done_mark
    }

    /// Sets the time that bringing bricks may take between two dispatches from now on.
    pub fn set_slice_ms(&self, ms: f64) {
        self.state.borrow_mut().loader.time_limit = Duration::from_secs_f64(ms / 1e3);
    }

    /// Begins a preview: until its end, no invocation waits for bricks, and other voxels stand in for missing ones.
    pub fn begin_preview(&self) {
        self.state.borrow_mut().exchange.previews = true;
    }

    /// Ends a preview, and brings bricks that it has missed; [`VolumeBricks::record_report`] must have been recorded
    /// after its last dispatch.
    pub fn end_preview(&self, frame: &mut Frame, images: &[Image]) -> Result<()> {
        let mut state = self.state.borrow_mut();
        state.exchange.previews = false;
        state
            .load_missed(frame, images, &self.host, &self.layout)
            .map(drop)
    }

    /// Decides which items the next dispatch works on.
    pub fn allow(&self, items: Items) {
        self.state.borrow_mut().exchange.items = items;
    }

    /// The report of the last dispatch.
    pub fn report(&self) -> Streaming {
        self.state.borrow().exchange.report
    }

    /// Records, before a dispatch, the copies that tell it which bricks are there and which invocations may work.
    pub fn record_state<'r>(
        &'r self,
        recording: &mut Recording<'_, 'r>,
        admission: &Admission,
    ) -> Result<()> {
        let exchange = &mut self.state.borrow_mut().exchange;
        exchange.record_state(recording, &self.host, &self.device, admission)
    }

    /// Records, after a dispatch, the copies that [`VolumeBricks::serve`] reads.
    pub fn record_report<'r>(&'r self, recording: &mut Recording<'_, 'r>) -> Result<()> {
        self.host.record_report(recording, &self.device)
    }

    /// Brings bricks that the last dispatch has missed onto the GPU, and decides who may work in the next;
    /// [`VolumeBricks::record_report`] must have been recorded after it. Returns whether the dispatch has to be repeated,
    /// because bricks were missed or because not all invocations worked.
    ///
    /// # Errors
    ///
    /// If the volume cannot be read, or if a single invocation needs more bricks at once than there is room for.
    pub fn serve(
        &self,
        frame: &mut Frame,
        images: &[Image],
        admission: &mut Admission,
    ) -> Result<bool> {
        let mut state = self.state.borrow_mut();
        state.exchange.read_report(&self.host);
        let report = state.exchange.report;
        let is_done = report.missed == 0 && admission.admits_all();
        if state.exchange.previews || is_done {
            return Ok(false);
        }
        let loads = state.load_missed(frame, images, &self.host, &self.layout)?;
        let followed = admission.follow(&report, loads);
        followed.map_err(|NoRoom| no_room(&self.layout))?;
        if let Some(pixels) = admission.enough {
            state.pixels_at_once = pixels;
        }
        Ok(true)
    }
}

impl State {
    /// Brings bricks that were missed, and prepares the page table that says where they are.
    fn load_missed(
        &mut self,
        frame: &mut Frame,
        images: &[Image],
        host: &HostSide,
        layout: &BrickLayout,
    ) -> Result<Loads> {
        let began = Instant::now();
        let mut pages = host.pages(layout);
        self.places.take_reads(&mut pages);
        let loads = self
            .loader
            .load(frame, images, &mut self.places, &mut pages);
        if loads.is_err() {
            // Some places do not hold the brick that the page table names.
            self.places.clear(&mut pages);
        }
        self.exchange.write_pages(host, &pages);
        self.waited += began.elapsed();
        loads
    }
}

fn no_room(layout: &BrickLayout) -> Error {
    let room = layout.capacity();
    MemoryError::VolumeBricks { room }.into()
}
