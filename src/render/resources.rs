//! The GPU memory that every variant takes, apart from what only one of them has (`estimator.rs`).
//!
//! Allocating through a dry-run gate gives the plan; allocating through a real one gives the resources: the same
//! statements, so the same sizes.

use std::sync::Arc;

use super::bricks::{VolumeBricks, copy_bricks};
use super::gpu_scene::GpuScene;
use super::light_memory::LightMemory;
use super::parts::transfer_extent;
use super::shared::{Counters, PATCHES, Path};
use super::volume_images::VOLUME_IMAGES;
use crate::error::Result;
use crate::gpu::{Binding, Buffer, BufferDesc, DeviceSummary, Format, Image, ImageDesc, Memory};

/// Copies between host and device go through a buffer of this size, piece by piece, or of the largest size that the
/// device allocates. It holds a row of any image.
const STAGING_BYTES: u64 = 4 << 20;

/// Paths in flight at once. A GPU hides latency with many; a CPU wants them in its cache.
const SLOTS_GPU: u32 = 1 << 17;
const SLOTS_CPU: u32 = 1 << 10;

/// Paths in flight for each place of a brick. Waiting paths share the bricks that are loaded, so memory for a brick
/// is as well spent on them. But each path that waits takes a CPU's time in every dispatch.
const SLOTS_A_PLACE: u32 = 128;
const SLOTS_GPU_IN_BRICKS: u32 = 1 << 18;
const SLOTS_CPU_IN_BRICKS: u32 = 1 << 12;

/// The name of the largest of the picture's images.
pub const UNIT_SUM: &str = "unit sum";
/// The resource whose size is that of the transfer function.
pub const TRANSFER_FUNCTION: &str = "transfer function";

pub struct Resources {
    /// Pixels of the picture. Its images may hold more; the picture is in their upper left corner.
    pub size: [u32; 2],
    /// All voxels in one image, or as many bricks of them as have places.
    pub volumes: Vec<Image>,
    /// The page table and other state of the bricks, if the volume is cut into bricks.
    pub bricks: Option<VolumeBricks>,
    /// For each macrocell, the smallest and the largest stored value.
    pub ranges: Image,
    /// The largest extinction in each block. There is room for the smallest blocks, so that an edit of the medium
    /// needs no memory.
    pub majorants: Image,
    /// Two texels for each patch of the picture, and a row for the whole picture.
    pub patches: Image,
    /// The scene's constants: one `SceneConstants`.
    pub scene: Buffer,
    /// The transfer function over stored values: the rows `TRANSFER_SEGMENTS` to `TRANSFER_CANDIDATES`
    /// (`parts/transfer_table.rs`).
    pub transfer: Image,
    /// A `Surface` for each isosurface.
    pub surfaces: Buffer,
    pub lights: LightMemory,
    pub clips: Buffer,
    /// A `Path` for each slot: the paths in flight between two dispatches.
    pub paths: Buffer,
    /// One `Counters`.
    pub counters: Buffer,
    /// Per pixel, the sum of the samples of the unit under way; coverage in alpha.
    pub unit_sum: Image,
    /// Per pixel, the mean of the samples of all complete units; coverage in alpha.
    pub mean: Image,
    /// Weighted sum of squared differences from the mean.
    pub squares: Image,
    /// Host memory through which data passes between host and device; `STAGING_BYTES` at most.
    pub staging: Buffer,
}

impl Resources {
    /// Pixels of the picture in all.
    pub fn pixels(&self) -> u32 {
        self.size[0] * self.size[1]
    }

    pub fn allocate(memory: &Arc<Memory>, scene: &GpuScene) -> Result<Resources> {
        let constants = scene.constants();
        let parts = &scene.parts;
        let volume = |name| ImageDesc {
            written: scene.bricks.is_some() && copy_bricks::is_by_pass(memory),
            // A preview reads places that have no brick yet.
            zeroed: scene.bricks.is_some(),
            ..ImageDesc::volumetric(name, scene.volume_extent(), parts.field.format())
        };
        let names = &VOLUME_IMAGES[..scene.volume_images()];
        let volumes = names.iter().map(|name| Image::new(memory, volume(name)));
        let macrocells = |name, format| ImageDesc::volumetric(name, constants.macrocells, format);
        let patches = ImageDesc::flat("patches", [2 * PATCHES, PATCHES + 1], Format::R32_UINT)
            .written()
            .zeroed();
        let picture = |name| Image::new(memory, picture_desc(name, parts.view.size));
        let device = |name, bytes| Buffer::new(memory, BufferDesc::device(name, bytes));
        let staging_bytes = STAGING_BYTES.min(memory.limits.max_allocation_bytes);
        let slots = slots(&memory.limits, scene);
        Ok(Resources {
            size: parts.view.size,
            volumes: volumes.collect::<Result<_>>()?,
            bricks: VolumeBricks::allocate(memory, scene)?,
            ranges: Image::new(
                memory,
                macrocells("macrocell ranges", Format::R32G32_SFLOAT),
            )?,
            majorants: Image::new(
                memory,
                macrocells("majorants", Format::R32_SFLOAT).written(),
            )?,
            patches: Image::new(memory, patches)?,
            scene: Buffer::with_data(memory, "scene constants", &[constants])?,
            transfer: Image::new(memory, transfer_desc(parts.medium.transfer.len()))?,
            surfaces: Buffer::with_data(memory, "surfaces", &parts.surfaces.iso)?,
            lights: LightMemory::allocate(memory, &parts.lights)?,
            clips: Buffer::with_data(memory, "clip planes", &parts.clips)?,
            paths: device("paths", bytes_of::<Path>(slots))?,
            counters: device("counters", bytes_of::<Counters>(1))?,
            unit_sum: picture(UNIT_SUM)?,
            mean: picture("mean")?,
            squares: picture("squared differences")?,
            staging: Buffer::new(memory, BufferDesc::host_cached("staging", staging_bytes))?,
        })
    }

    /// Writes an edited scene that the same passes and images serve. The transfer function is an image, which
    /// `upload.rs` writes.
    pub fn write(&mut self, scene: &GpuScene) -> Result<()> {
        let parts = &scene.parts;
        self.size = parts.view.size;
        self.scene.rewrite(&[scene.constants()])?;
        self.surfaces.rewrite(&parts.surfaces.iso)?;
        self.lights.write(&parts.lights)?;
        self.clips.rewrite(&parts.clips)
    }

    /// Makes room for a transfer function of `points` points.
    pub fn resize_transfer(&mut self, points: usize) -> Result<()> {
        self.transfer.resize(transfer_desc(points).extent)
    }

    /// Makes room for a picture of another size; what its images held is gone.
    pub fn resize(&mut self, [width, height]: [u32; 2]) -> Result<()> {
        if self.bricks.is_none() {
            let slots = slots_for_pixels(self.mean.limits(), [width, height]);
            self.paths.resize(bytes_of::<Path>(slots))?;
        }
        for image in [&mut self.unit_sum, &mut self.mean, &mut self.squares] {
            image.resize([width, height, 1])?;
        }
        match &mut self.bricks {
            Some(bricks) => bricks.resize([width, height]),
            None => Ok(()),
        }
    }

    /// The resources of every shader that includes `volume.glsl`.
    pub fn volume_bindings(&self) -> Vec<(&'static str, Binding<'_>)> {
        let images = self.volumes.iter().map(Binding::Image);
        let volumes = VOLUME_IMAGES.into_iter().zip(images);
        let bricks = self.bricks.iter().flat_map(VolumeBricks::bindings);
        volumes.chain(bricks).collect()
    }

    /// The resources that tracking and marching through the medium read.
    pub fn medium_bindings(&self) -> Vec<(&'static str, Binding<'_>)> {
        let others = [
            ("scene_block", Binding::Buffer(&self.scene)),
            ("transfer", Binding::Image(&self.transfer)),
            ("clips", Binding::Buffer(&self.clips)),
            ("majorants", Binding::Image(&self.majorants)),
        ];
        [
            &self.volume_bindings()[..],
            &others,
            &self.lights.bindings(),
        ]
        .concat()
    }

    /// The resources that surfaces need in addition.
    pub fn surface_bindings(&self) -> [(&'static str, Binding<'_>); 2] {
        [
            ("ranges", Binding::Image(&self.ranges)),
            ("surfaces", Binding::Buffer(&self.surfaces)),
        ]
    }

    /// The resource by which rays from the camera find where to begin and to end.
    pub fn camera_binding(&self) -> (&'static str, Binding<'_>) {
        ("patches", Binding::Image(&self.patches))
    }

    /// The resources that paths keep between dispatches.
    pub fn path_bindings(&self) -> [(&'static str, Binding<'_>); 2] {
        [
            ("paths", Binding::Buffer(&self.paths)),
            ("counters", Binding::Buffer(&self.counters)),
        ]
    }

    /// The counters that have been copied to the staging buffer.
    pub fn counters_read(&self) -> Counters {
        self.staging.read()
    }

    /// Paths in flight at once.
    pub fn slots(&self) -> u32 {
        (self.paths.desc().bytes / bytes_of::<Path>(1)) as u32
    }
}

/// An image with a texel for each pixel. It is read before all of its texels are written.
pub fn picture_desc(name: &'static str, size: [u32; 2]) -> ImageDesc {
    ImageDesc::flat(name, size, Format::R32G32B32A32_SFLOAT)
        .written()
        .zeroed()
}

fn transfer_desc(points: usize) -> ImageDesc {
    let size = transfer_extent(points);
    ImageDesc::flat(TRANSFER_FUNCTION, size, Format::R32G32B32A32_SFLOAT)
}

/// Paths in flight at once.
pub fn slots(limits: &DeviceSummary, scene: &GpuScene) -> u32 {
    match &scene.bricks {
        Some(layout) => {
            let most = if limits.kind.is_software() {
                SLOTS_CPU_IN_BRICKS
            } else {
                SLOTS_GPU_IN_BRICKS
            };
            SLOTS_A_PLACE
                .saturating_mul(layout.capacity())
                .clamp(SLOTS_CPU, most)
        }
        None => slots_for_pixels(limits, scene.parts.view.size),
    }
}

/// A whole volume needs no more paths in flight than the picture has pixels.
fn slots_for_pixels(limits: &DeviceSummary, [width, height]: [u32; 2]) -> u32 {
    let most = if limits.kind.is_software() {
        SLOTS_CPU
    } else {
        SLOTS_GPU
    };
    let pixels = u64::from(width) * u64::from(height);
    pixels.next_multiple_of(64).min(u64::from(most)) as u32
}

pub fn bytes_of<T>(count: u32) -> u64 {
    u64::from(count) * size_of::<T>() as u64
}
