//! Voxels in an unnamed temporary file, for reading small regions in any order from a source that has to decode more
//! than those. The system removes the file when the program ends, however that happens.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::PathBuf;

use super::file::FileAt;
use super::{Access, Cursor, Source};
use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::region::Region;

/// Stored values, in the byte order of this machine, x fastest.
#[derive(Debug)]
pub struct Spool {
    file: File,
    dims: [u32; 3],
    voxel_bytes: usize,
}

impl Spool {
    /// An empty spool in the system's folder for temporary files.
    pub fn new(dims: [u32; 3], voxel_bytes: usize) -> Parsed<Spool> {
        let file = tempfile::tempfile().map_err(|e| no_room(&e))?;
        Ok(Spool {
            file,
            dims,
            voxel_bytes,
        })
    }

    /// Writes the voxels of a region.
    pub fn write(&mut self, region: Region, bytes: &[u8]) -> Parsed<()> {
        let mut rest = bytes;
        for (first, count) in region.runs(self.dims) {
            let (run, later) = rest.split_at(count * self.voxel_bytes);
            let start = SeekFrom::Start(first * self.voxel_bytes as u64);
            let written = self.file.seek(start).and_then(|_| self.file.write_all(run));
            written.map_err(|e| no_room(&e))?;
            rest = later;
        }
        Ok(())
    }
}

fn no_room(error: &std::io::Error) -> String {
    format!(
        "its voxels could not be kept in a temporary file in {}: {error}; point TMPDIR to a folder with room for all \
         of them, or decompress the file",
        std::env::temp_dir().display()
    )
}

impl Source for Spool {
    fn access(&self) -> Access {
        Access::Rows
    }

    fn files(&self) -> Vec<PathBuf> {
        Vec::new()
    }

    fn cursor(&self) -> Box<dyn Cursor + '_> {
        Box::new(self)
    }
}

impl Cursor for &Spool {
    fn read(&mut self, region: Region, bytes: &mut [u8]) -> Parsed<()> {
        let mut rest = bytes;
        for (first, count) in region.runs(self.dims) {
            let (run, later) = rest.split_at_mut(count * self.voxel_bytes);
            let mut at = FileAt {
                file: &self.file,
                offset: first * self.voxel_bytes as u64,
            };
            at.read_exact(run)
                .map_err(|e| format!("the temporary file of its voxels cannot be read: {e}"))?;
            rest = later;
        }
        Ok(())
    }
}
