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

/// Voxels in the type and byte order that the format's header names.
pub trait Source: fmt::Debug + Send + Sync {
    /// Whether any region is read as fast as any other, by several threads at once. Otherwise reading
    /// is fastest from the first voxel to the last.
    fn is_random(&self) -> bool;

    /// Whether a region costs no more than its own voxels, however small it is: no voxels around it are decoded as
    /// well.
    fn is_direct(&self) -> bool {
        false
    }

    /// Whether a region is read in runs of a file, so that it takes longer the more of them there are.
    fn is_in_runs(&self) -> bool {
        false
    }

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
