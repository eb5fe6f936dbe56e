//! A volume: what its voxels mean, and a source from which they are read whenever somebody wants them.
//!
//! Nothing needs all voxels in memory. A format's module parses a header ([`format`]) and says where the
//! voxels come from ([`source`]); one walk through them finds what can only be known of all of them
//! ([`settle`]); from then on a [`Reader`] gives the stored values of any region, cropped, converted
//! and in the volume's order, the same way for every format ([`grid`]).

mod format;
mod grid;
pub mod histogram;
mod macrocells;
mod open;
mod orientation;
mod reading;
mod region;
mod settle;
mod source;
mod stored;
mod voxel_type;

use std::borrow::Cow;
use std::path::Path;
use std::sync::{Arc, Mutex};

use bytemuck::{cast_slice, cast_slice_mut};

use crate::error::Result;
use grid::Grid;
pub use grid::Reader;
pub use histogram::Histogram;
pub use macrocells::MACROCELL;
pub use orientation::{Anatomical, Axes};
pub use reading::Reading;
pub use region::Region;
pub use stored::StoredType;
pub use voxel_type::{Endian, VoxelType};

/// Voxel (i, j, k) sits at the cell centre (i+½, j+½, k+½)·spacing from the box's low corner.
///
/// A clone shares the source of the voxels.
#[derive(Debug, Clone)]
pub struct Volume {
    /// Voxels along x (fastest), y and z; each ≥ 1.
    pub dims: [u32; 3],
    /// World units along x, y and z; each > 0.
    pub spacing: [f64; 3],
    /// The type of stored values; a voxel's value is `offset + scale·stored`.
    pub stored: StoredType,
    /// > 0, so that stored values and values have the same order.
    pub scale: f64,
    pub offset: f64,
    /// Smallest and largest value present.
    pub range: [f64; 2],
    /// Where i, j and k grow, if the header or the user says so.
    pub axes: Option<Axes>,
    /// The file's own type.
    pub voxel_type: VoxelType,
    /// What the user should know about the loading: one sentence each.
    pub notes: Vec<String>,
    grid: Arc<Grid>,
    statistics: Arc<Statistics>,
}

/// What is known of the stored values since all of them were seen.
#[derive(Debug)]
struct Statistics {
    macrocell_ranges: Vec<[f32; 2]>,
    /// How often each value occurs; empty for floats.
    counts: Vec<u64>,
    /// The last histogram of floats, for which the voxels were read again.
    histogram: Mutex<Option<Histogram>>,
}

/// Stored values in memory, x fastest.
///
/// 8 and 16 bits stay what they are (signed ones shifted by half their range into `offset`);
/// everything else is f32.
#[derive(Debug, Clone, PartialEq)]
pub enum Voxels {
    U8(Vec<u8>),
    U16(Vec<u16>),
    F32(Vec<f32>),
}

/// What the user says about a file; it counts more than what the file says.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct VolumeOverrides {
    /// Raw files only, x fastest.
    pub dims: Option<[u32; 3]>,
    /// Raw files only.
    pub voxel_type: Option<VoxelType>,
    /// Raw files only; little if absent.
    pub endian: Option<Endian>,
    pub spacing: Option<[f64; 3]>,
    /// Where the file's i, j and k grow: left-handed ones are reversed like a header's.
    pub axes: Option<Axes>,
    /// The file's voxels [low, high) along i, j and k; only these are kept.
    pub crop: Option<[[u32; 3]; 2]>,
}

impl Volume {
    /// Opens a volume of any format, told by the file's name, and walks through its voxels once.
    ///
    /// # Errors
    ///
    /// One sentence that names the file and says what is wrong with it.
    pub fn load(path: &Path, overrides: &VolumeOverrides) -> Result<Volume> {
        Volume::load_watched(path, overrides, &Reading::default())
    }

    /// The same while somebody watches.
    pub fn load_watched(
        path: &Path,
        overrides: &VolumeOverrides,
        reading: &Reading,
    ) -> Result<Volume> {
        open::load(path, overrides, reading)
    }

    /// A volume made in memory; its values are the voxels as they are.
    ///
    /// # Errors
    ///
    /// The number of voxels is not the product of `dims`, or 0; a spacing is no length above 0; no
    /// value is finite.
    pub fn from_values(dims: [u32; 3], spacing: [f64; 3], voxels: Voxels) -> Result<Volume> {
        open::from_values(dims, spacing, voxels)
    }

    /// The box's side lengths in world units.
    pub fn extent(&self) -> [f64; 3] {
        std::array::from_fn(|a| self.dims[a] as f64 * self.spacing[a])
    }

    /// The smallest and largest stored value in each macrocell, x fastest. Along each axis there are
    /// as many as cover all trilinear cells, of which there is one more than voxels.
    pub fn macrocell_ranges(&self) -> &[[f32; 2]] {
        &self.statistics.macrocell_ranges
    }

    /// Boxes of at most `most_bytes` of stored values (at least one of them) that cover the volume, in
    /// the order in which its source is read fastest.
    pub fn pieces(&self, most_bytes: u64) -> impl Iterator<Item = Region> {
        self.grid.pieces(most_bytes as usize / self.stored.bytes())
    }

    /// Reads one region after another.
    pub fn reader(&self) -> Reader<'_> {
        self.grid.reader()
    }

    /// Fills `bytes` with the stored values of a region: [`Reader::read`] with a reader of its own.
    ///
    /// # Errors
    ///
    /// Those of [`Reader::read`].
    pub fn read(&self, region: Region, bytes: &mut [u8]) -> Result<()> {
        self.reader().read(region, bytes)
    }

    /// All stored values: borrowed where they are in memory, as those given to
    /// [`from_values`](Volume::from_values), otherwise read.
    ///
    /// # Errors
    ///
    /// Those of [`Reader::read`].
    pub fn voxels(&self) -> Result<Cow<'_, Voxels>> {
        if let Some(voxels) = self.grid.resident() {
            return Ok(Cow::Borrowed(voxels));
        }
        let mut voxels = Voxels::zeros(self.stored, self.dims.map(|n| n as usize).iter().product());
        let mut reader = self.reader();
        reader.read(Region::whole(self.dims), voxels.bytes_mut())?;
        Ok(Cow::Owned(voxels))
    }
}

impl Voxels {
    fn zeros(stored: StoredType, count: usize) -> Voxels {
        match stored {
            StoredType::U8 => Voxels::U8(vec![0; count]),
            StoredType::U16 => Voxels::U16(vec![0; count]),
            StoredType::F32 => Voxels::F32(vec![0.0; count]),
        }
    }

    pub fn len(&self) -> usize {
        match self {
            Voxels::U8(voxels) => voxels.len(),
            Voxels::U16(voxels) => voxels.len(),
            Voxels::F32(voxels) => voxels.len(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    pub fn stored(&self) -> StoredType {
        match self {
            Voxels::U8(_) => StoredType::U8,
            Voxels::U16(_) => StoredType::U16,
            Voxels::F32(_) => StoredType::F32,
        }
    }

    fn bytes(&self) -> &[u8] {
        match self {
            Voxels::U8(voxels) => voxels,
            Voxels::U16(voxels) => cast_slice(voxels),
            Voxels::F32(voxels) => cast_slice(voxels),
        }
    }

    fn bytes_mut(&mut self) -> &mut [u8] {
        match self {
            Voxels::U8(voxels) => voxels,
            Voxels::U16(voxels) => cast_slice_mut(voxels),
            Voxels::F32(voxels) => cast_slice_mut(voxels),
        }
    }
}
