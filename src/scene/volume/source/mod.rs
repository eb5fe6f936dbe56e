//! The sources of voxels. Every format provides one of these, and all further steps are the same for all of them.

pub mod chunked;
pub mod codec;
pub mod file;
pub mod gzip;
pub mod interleaved;
pub mod memory;
pub mod spool;
pub mod watched;

use std::fmt;
use std::path::PathBuf;

use chunked::Chunked;

use super::parsed::Parsed;
use super::region::Region;
use super::stored::Voxels;

/// What it costs to read a region.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// All voxels before it are decoded: reading is fastest from the first voxel to the last.
    Sequential,
    /// Voxels around it are decoded as well; any region is read as fast as any other, by several threads at once.
    Decoded,
    /// Its own voxels alone, row by row of a file: it takes longer the more rows there are.
    Rows,
    /// Its own voxels alone.
    Direct,
}

impl Access {
    /// Whether a region costs no more than its own voxels, however small it is.
    pub fn is_direct(self) -> bool {
        matches!(self, Access::Rows | Access::Direct)
    }
}

/// Voxels in the type and byte order that the format's header names.
pub trait Source: fmt::Debug + Send + Sync {
    fn access(&self) -> Access;

    /// All files that voxels are read from; none for voxels in memory.
    fn files(&self) -> Vec<PathBuf>;

    /// A new position from which to read. There may be many at once.
    fn cursor(&self) -> Box<dyn Cursor + '_>;

    /// All voxels, if they are in memory in this form.
    fn resident(&self) -> Option<&Voxels> {
        None
    }

    /// The chunks, if voxels are stored in chunks: they are then not read in regions of any shape, but by chunks.
    fn chunked(&self) -> Option<&Chunked> {
        None
    }
}

pub trait Cursor: Send {
    /// Fills `bytes` with the voxels of a region that lies within the source, x fastest. A fault is a sentence that
    /// names a file only if the user has not named it.
    fn read(&mut self, region: Region, bytes: &mut [u8]) -> Parsed<()>;
}
