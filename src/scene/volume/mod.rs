//! A volume: the meaning of its voxels, and a source from which they are read on demand.
//!
//! Nothing needs all voxels in memory. A format's module parses a header (`format`) and provides the source of the
//! voxels (`source`); one scan of them finds what depends on all of them (`scan`); from then on a [`Reader`]
//! gives the stored values of any region, cropped, converted and in the volume's order, the same way for every format
//! (`grid`).

mod format;
mod grid;
mod histogram;
mod macrocells;
mod open;
mod orientation;
mod outliers;
mod outline;
mod overrides;
mod parsed;
mod quantity;
mod reading;
mod region;
mod scan;
mod series;
mod source;
mod statistics;
mod storage;
mod store;
mod stored;
mod tally;
mod thumbnail;
mod voxel_type;

use std::borrow::Cow;
use std::path::PathBuf;
use std::sync::Arc;

use crate::error::{Error, Location, Result};
use grid::Grid;
pub use grid::Reader;
pub use histogram::Histogram;
pub use macrocells::MACROCELL;
pub(crate) use open::VOXEL_SIZES;
pub use orientation::{Anatomical, Axes};
pub use overrides::{Pick, VolumeOverrides};
pub use quantity::Quantity;
pub use reading::Reading;
pub use region::{BRICK_SIDE, Region};
pub use series::{Preview, Series};
pub use source::Access;
use source::Source;
use source::spool::Spool;
use statistics::Statistics;
pub use storage::{Level, MOST_NAMES, Storage};
use store::Keeping;
pub use store::clean::{Removed, clean};
use store::file::Known;
pub use store::{Copying, Stores};
use stored::Conversion;
pub use stored::{StoredType, Voxels};
pub use thumbnail::Thumbnail;
pub use voxel_type::{Endian, VoxelType};

/// Bytes copied at a time from a source that is read from front to back.
const SPOOLED_BYTES: u64 = 32 << 20;

/// The properties of a volume, and access to its voxels.
///
/// Voxel (i, j, k) sits at the cell centre (i+½, j+½, k+½)·spacing from the box's low corner.
///
/// A clone shares the source of the voxels.
#[derive(Debug, Clone)]
pub struct Volume {
    /// Voxels along x (fastest), y and z; each ≥ 1.
    pub dims: [u32; 3],
    /// Voxels along each axis in the file, before cropping.
    pub file_dims: [u32; 3],
    /// World units along x, y and z; each > 0.
    pub spacing: [f64; 3],
    /// The type of stored values; a voxel's value is `offset + scale·stored`.
    pub stored: StoredType,
    /// Positive, so that stored values and values have the same order.
    pub scale: f64,
    pub offset: f64,
    /// Smallest and largest value present.
    pub range: [f64; 2],
    /// The anatomical directions in which i, j and k grow, if the header or the user says so.
    pub axes: Option<Axes>,
    /// The same as the file or the user has them, before left-handed axes became right-handed.
    pub file_axes: Option<Axes>,
    /// The file's own type.
    pub voxel_type: VoxelType,
    /// How the file stores it, as information for users.
    pub storage: Storage,
    /// Remarks on the loading for the user: one sentence each.
    pub notes: Vec<String>,
    /// Further facts from the file: a name and a value each, for `isolume info`.
    pub facts: Vec<(&'static str, String)>,
    /// `None` if the file does not say it.
    pub quantity: Option<Quantity>,
    /// All files that its voxels are read from.
    pub files: Vec<PathBuf>,
    grid: Arc<Grid>,
    statistics: Arc<Statistics>,
    /// The place of its store, and what has been found out about its values.
    keeping: Option<Arc<Keeping>>,
}

impl Volume {
    /// The box's side lengths in world units.
    pub fn extent(&self) -> [f64; 3] {
        std::array::from_fn(|a| self.dims[a] as f64 * self.spacing[a])
    }

    /// The smallest and largest stored value in each macrocell, x fastest. Along each axis there are
    /// as many as cover all trilinear cells, of which there is one more than voxels.
    pub fn macrocell_ranges(&self) -> &[[f32; 2]] {
        &self.statistics.macrocell_ranges
    }

    /// How often values occur, in at most `most_bins` bins. Integer data whose values fit get one bin a
    /// value, so that no value is split between two. Integers were counted when the volume was
    /// opened; floats are counted when they are first asked for, which takes a scan of the voxels.
    ///
    /// # Errors
    ///
    /// The same as for [`Reader::read`].
    pub fn histogram(&self, most_bins: usize) -> Result<Histogram> {
        let empty = self.bins_between(self.range, most_bins);
        self.statistics
            .fill(empty, &self.grid, |stored| self.value(stored))
    }

    /// The meaning of a stored value.
    fn value(&self, stored: f64) -> f64 {
        self.offset + self.scale * stored
    }

    fn bins_between(&self, [low, high]: [f64; 2], most_bins: usize) -> Histogram {
        let steps = (high - low) / self.scale;
        let is_integer = self.stored != StoredType::F32;
        if high <= low {
            Histogram::empty(low - 0.5, 1.0, 1)
        } else if is_integer && steps < most_bins as f64 {
            let half = 0.5 * self.scale;
            Histogram::empty(low - half, self.scale, steps.round() as usize + 1)
        } else {
            Histogram::empty(low, (high - low) / most_bins as f64, most_bins)
        }
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
    /// The same as for [`Reader::read`].
    pub fn read(&self, region: Region, bytes: &mut [u8]) -> Result<()> {
        self.reader().read(region, bytes)
    }

    /// The same volume with a source from which small regions are read as fast as large ones, in any order. If its
    /// own source has to decode more than the region, this is its store, which is written if there is none yet, or,
    /// without a place for one, a copy of its stored values in a temporary file.
    ///
    /// # Errors
    ///
    /// The same as for [`Reader::read`]; or there is no room for the copy; or the callback of [`Stores`] has ended
    /// it.
    pub fn in_any_order(&self) -> Result<Volume> {
        match &self.keeping {
            Some(keeping) if self.grid.source.resident().is_none() => self.kept(keeping),
            _ if self.is_direct() => Ok(self.clone()),
            _ => self.spooled(),
        }
    }

    /// What it costs to read a region.
    pub fn access(&self) -> Access {
        self.grid.source.access()
    }

    fn is_direct(&self) -> bool {
        self.access().is_direct()
    }

    fn kept(&self, keeping: &Keeping) -> Result<Volume> {
        let fault = |fault: String| Error::input(Location::file(&self.grid.name), fault);
        let is_enough = |known: &Known| known.voxels.is_some() || self.is_direct();
        // A damaged store is replaced.
        let found = keeping.store_file.find(self.stored).unwrap_or(None);
        let mut known = found.filter(is_enough);
        if known.is_none() {
            match keeping.write(self) {
                // Failing to keep what a scan can find again is not worth an error.
                Err(error) if error.is_about_input() && self.is_direct() => {
                    return Ok(self.clone());
                }
                written => written?,
            }
            known = keeping.store_file.find(self.stored).map_err(fault)?;
        }
        match known.and_then(|known| known.voxels) {
            Some(store) => Ok(self.with_source(Box::new(store))),
            None if self.is_direct() => Ok(self.clone()),
            None => Err(fault("its store was removed by somebody else".into())),
        }
    }

    fn spooled(&self) -> Result<Volume> {
        let fault = |fault: String| Error::input(Location::file(&self.grid.name), fault);
        let mut spool = Spool::new(self.dims, self.stored.bytes()).map_err(fault)?;
        let mut reader = self.reader();
        let mut bytes = Vec::new();
        for piece in self.pieces(SPOOLED_BYTES) {
            bytes.resize(piece.voxels() * self.stored.bytes(), 0);
            reader.read(piece, &mut bytes)?;
            spool.write(piece, &bytes).map_err(fault)?;
        }
        Ok(self.with_source(Box::new(spool)))
    }

    /// The same volume with another source of its stored values.
    fn with_source(&self, source: Box<dyn Source>) -> Volume {
        Volume {
            grid: Arc::new(Grid {
                source,
                region: Region::whole(self.dims),
                is_mirrored: false,
                conversion: Conversion::none(self.stored),
                filler: None,
                name: self.grid.name.clone(),
            }),
            ..self.clone()
        }
    }

    /// All stored values: borrowed where they are in memory, as those given to
    /// [`from_values`](Volume::from_values), otherwise read.
    ///
    /// # Errors
    ///
    /// The same as for [`Reader::read`].
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
