//! Voxels of several values each, of which one is the volume's: the colours of a pixel, the components of a vector, the
//! directions of a diffusion scan.

use std::path::PathBuf;

use super::{Access, Cursor, Source};
use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::region::Region;

/// Bytes that are read at a time, of all values.
const READ_BYTES: usize = 256 << 10;

#[derive(Debug)]
pub struct Interleaved {
    /// All values: those of one voxel follow one another along x.
    pub source: Box<dyn Source>,
    /// Values of a voxel.
    pub count: u32,
    /// Index of the one that is the volume's.
    pub picked: u32,
    pub value_bytes: usize,
}

impl Source for Interleaved {
    fn access(&self) -> Access {
        match self.source.access() {
            Access::Sequential => Access::Sequential,
            // The other values of each voxel are read as well.
            Access::Decoded | Access::Rows | Access::Direct => Access::Decoded,
        }
    }

    fn files(&self) -> Vec<PathBuf> {
        self.source.files()
    }

    fn cursor(&self) -> Box<dyn Cursor + '_> {
        Box::new(Picking {
            of: self,
            cursor: self.source.cursor(),
            values: Vec::new(),
        })
    }
}

struct Picking<'a> {
    of: &'a Interleaved,
    cursor: Box<dyn Cursor + 'a>,
    /// All values of some voxels.
    values: Vec<u8>,
}

impl Cursor for Picking<'_> {
    fn read(&mut self, region: Region, bytes: &mut [u8]) -> Parsed<()> {
        let voxel_bytes = self.of.count as usize * self.of.value_bytes;
        let mut rest = bytes;
        for piece in region.pieces(READ_BYTES / voxel_bytes) {
            let (picked, later) = rest.split_at_mut(piece.voxels() * self.of.value_bytes);
            if voxel_bytes > READ_BYTES {
                self.cursor.read(self.of.one_value(piece), picked)?
            } else {
                self.read_all(piece, picked)?
            }
            rest = later;
        }
        Ok(())
    }
}

impl Picking<'_> {
    /// Reads all values of some voxels, and keeps one of each.
    fn read_all(&mut self, piece: Region, picked: &mut [u8]) -> Parsed<()> {
        let Interleaved {
            count,
            picked: n,
            value_bytes: size,
            ..
        } = *self.of;
        self.values.resize(picked.len() * count as usize, 0);
        let all = Region {
            low: along_x(piece.low, |low| low * count),
            dims: along_x(piece.dims, |width| width * count),
        };
        self.cursor.read(all, &mut self.values)?;
        let voxels = self.values.chunks_exact(count as usize * size);
        for (kept, voxel) in picked.chunks_exact_mut(size).zip(voxels) {
            kept.copy_from_slice(&voxel[n as usize * size..][..size]);
        }
        Ok(())
    }
}

impl Interleaved {
    /// The picked value of a single voxel, as a region of all values.
    fn one_value(&self, voxel: Region) -> Region {
        Region {
            low: along_x(voxel.low, |x| x * self.count + self.picked),
            dims: voxel.dims,
        }
    }
}

fn along_x([x, y, z]: [u32; 3], change: impl Fn(u32) -> u32) -> [u32; 3] {
    [change(x), y, z]
}
