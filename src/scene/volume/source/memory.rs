//! Voxels that are already in memory: those of a volume that a program has made, or of a small compressed file that
//! has been read once.

use std::path::PathBuf;

use super::{Access, Cursor, Source};
use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::region::Region;
use crate::scene::volume::stored::Voxels;

#[derive(Debug)]
pub struct Memory {
    pub dims: [u32; 3],
    /// In the byte order of this machine, x fastest.
    pub voxels: Voxels,
}

impl Source for Memory {
    fn access(&self) -> Access {
        Access::Direct
    }

    fn files(&self) -> Vec<PathBuf> {
        Vec::new()
    }

    fn cursor(&self) -> Box<dyn Cursor + '_> {
        Box::new(self)
    }

    fn resident(&self) -> Option<&Voxels> {
        Some(&self.voxels)
    }
}

impl Cursor for &Memory {
    fn read(&mut self, region: Region, bytes: &mut [u8]) -> Parsed<()> {
        let size = self.voxels.stored().bytes();
        let all = self.voxels.bytes();
        let mut rest = bytes;
        for (first, count) in region.runs(self.dims) {
            let (run, later) = rest.split_at_mut(count * size);
            run.copy_from_slice(&all[first as usize * size..][..run.len()]);
            rest = later;
        }
        Ok(())
    }
}
