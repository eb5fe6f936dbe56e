//! Brings bricks of the volume to their places in its images, by way of a staging buffer.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::admission::Loads;
use super::copy_bricks::CopyBricks;
use super::host::HostBricks;
use super::places::{Load, Places, take_requests};
use crate::error::Result;
use crate::gpu::{Buffer, BufferDesc, Frame, Image, Memory, Piece};
use crate::render::layout::{BrickLayout, Place};
use crate::render::pass_compiler::PassCompiler;

/// Size of the staging buffer, unless a quarter of all places is less.
const STAGING_BYTES: u64 = 8 << 20;
/// Offsets in a buffer at which every device copies to every format.
const ALIGNMENT: u64 = 16;
/// The most bricks that are brought between two looks at the clock, while a window waits for its next frame.
const PIECE: usize = 32;

pub struct Loader {
    layout: BrickLayout,
    staging: Buffer,
    /// Bytes of a brick in the staging buffer.
    brick_stride: u64,
    copy: CopyBricks,
    /// `None` until the volume is known.
    host: Option<HostBricks>,
    /// The time that bringing bricks may take between two dispatches; [`PIECE`] bricks are brought in any case.
    pub time_limit: Duration,
    /// Bricks that have been brought so far.
    pub loads: u64,
}

impl Loader {
    pub fn allocate(
        memory: &Arc<Memory>,
        layout: BrickLayout,
        voxel_bytes: usize,
    ) -> Result<Loader> {
        let brick_stride = layout.brick_bytes(voxel_bytes).next_multiple_of(ALIGNMENT);
        let quarter = u64::from(layout.capacity().div_ceil(4)) * brick_stride;
        let bytes = STAGING_BYTES.min(quarter).max(brick_stride);
        let desc = BufferDesc::host_cached("brick staging", bytes);
        Ok(Loader {
            layout,
            staging: Buffer::new(memory, desc)?,
            brick_stride,
            copy: CopyBricks::allocate(memory, (bytes / brick_stride) as usize)?,
            host: None,
            time_limit: Duration::MAX,
            loads: 0,
        })
    }

    pub fn compile(&mut self, passes: &PassCompiler<'_>) -> Result<()> {
        self.copy.compile(passes)
    }

    pub fn open(&mut self, host: HostBricks) {
        self.host = Some(host);
    }

    pub fn bytes_read(&self) -> u64 {
        self.host.as_ref().map_or(0, |host| host.bytes_read)
    }

    /// Brings the bricks that were asked for most, and enters their places in the page table.
    pub fn load(
        &mut self,
        frame: &mut Frame,
        images: &[Image],
        places: &mut Places,
        pages: &mut [u32],
    ) -> Result<Loads> {
        let wanted = take_requests(pages);
        let mut loads = places.assign(&wanted);
        let is_unlimited = self.time_limit == Duration::MAX;
        if is_unlimited && self.host.as_ref().is_some_and(HostBricks::reads_rows) {
            // All of them will be brought: in the file's order, so that those in a row are read together.
            loads.sort_unstable();
        }
        let most = (self.staging.desc().bytes / self.brick_stride) as usize;
        let at_once = if is_unlimited { most } else { most.min(PIECE) };
        let (began, mut loaded) = (Instant::now(), 0);
        for loads in loads.chunks(at_once) {
            if loaded > 0 && began.elapsed() >= self.time_limit {
                break;
            }
            for &load in loads {
                places.put(load, pages);
            }
            self.bring(frame, images, loads)?;
            loaded += loads.len();
        }
        Ok(Loads {
            loaded,
            has_room: loads.len() == wanted.len(),
        })
    }

    /// Copies bricks to their places, of which the staging buffer has room for all.
    fn bring(&mut self, frame: &mut Frame, images: &[Image], loads: &[Load]) -> Result<()> {
        let host = self.host.as_mut();
        let host = host.expect("the volume is open before its bricks are asked for");
        let bricks: Vec<u32> = loads.iter().map(|load| load.brick).collect();
        if let Some(mapped) = self.staging.mapped_mut() {
            host.fill(&bricks, mapped, self.brick_stride as usize)?;
        }
        let layout = &self.layout;
        let piece = |(n, load): (u64, &Load)| {
            let Place { image, position } = layout.place(load.place);
            let piece = Piece {
                offset: n * self.brick_stride,
                low: position.map(|i| i * layout.pitch()),
                extent: host.region(load.brick).dims,
            };
            (image, piece)
        };
        let pieces: Vec<(usize, Piece)> = (0..).zip(loads).map(piece).collect();
        for (n, image) in images.iter().enumerate() {
            let there = pieces.iter().filter(|(image, _)| *image == n);
            let there: Vec<Piece> = there.map(|(_, piece)| *piece).collect();
            if !there.is_empty() {
                self.copy.run(frame, &self.staging, image, &there)?;
            }
        }
        self.loads += loads.len() as u64;
        Ok(())
    }
}
