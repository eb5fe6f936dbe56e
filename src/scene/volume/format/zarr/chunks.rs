//! The chunks of one channel at one time, read from their files.

use std::collections::HashMap;
use std::io;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use super::array::Array;
use super::crc32c;
use super::pipeline::Shard;
use crate::locked::locked;
use crate::regular_file::{HAS_CHANGED, Version};
use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::source::chunked::{Chunks, Content};
use crate::scene::volume::source::watched::WatchedFile;

/// The index entry of a chunk that was never written.
const MISSING: u64 = u64::MAX;
/// Shards whose index is kept.
const MOST_INDICES: usize = 256;

/// The role of an array's axis in the volume.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// x, y or z: 0, 1 or 2.
    Space(usize),
    /// An axis of channels or times, of which only this index is taken.
    Fixed(u64),
}

#[derive(Debug)]
pub struct ArrayChunks {
    array: Array,
    axes: Vec<Axis>,
    /// The file that says what the axes are, if it is not the array's own.
    metadata: Option<PathBuf>,
    /// Voxels of a chunk along x, y and z that are taken.
    dims: [u32; 3],
    /// The versions of files when they were first read; `None` for a file that did not exist.
    versions: Mutex<HashMap<String, Option<Version>>>,
    indices: Mutex<HashMap<String, Arc<Vec<u8>>>>,
}

impl ArrayChunks {
    pub fn new(
        array: Array,
        axes: Vec<Axis>,
        metadata: Option<PathBuf>,
        dims: [u32; 3],
    ) -> ArrayChunks {
        ArrayChunks {
            array,
            axes,
            metadata,
            dims,
            versions: Mutex::default(),
            indices: Mutex::default(),
        }
    }

    /// The bytes of a chunk as they were written, without their checksum; `None` if it was never written.
    fn packed(&self, chunk: &[u64]) -> Parsed<Option<Vec<u8>>> {
        let packed = match &self.array.shard {
            None => match self.open(&self.array.keys.key(chunk))? {
                Some(file) => Some(file.read(0, file.bytes())?),
                None => None,
            },
            Some(shard) => self.packed_in_shard(shard, chunk)?,
        };
        match (packed, self.array.has_checksum) {
            (Some(packed), true) => match crc32c::checked(packed) {
                Some(packed) => Ok(Some(packed)),
                None => Err("its checksum is wrong: the file is damaged".into()),
            },
            (packed, _) => Ok(packed),
        }
    }

    fn packed_in_shard(&self, shard: &Shard, chunk: &[u64]) -> Parsed<Option<Vec<u8>>> {
        let sides = shard.shape.iter().zip(&self.array.chunk);
        let sides: Vec<u64> = sides.map(|(shard, chunk)| shard / chunk).collect();
        let outer: Vec<u64> = chunk.iter().zip(&sides).map(|(n, side)| n / side).collect();
        let key = self.array.keys.key(&outer);
        let Some(file) = self.open(&key)? else {
            return Ok(None);
        };
        let index = self.index(shard, &key, &file, sides.iter().product())?;
        let place = chunk.iter().zip(&sides);
        let place = place.fold(0, |place, (n, side)| place * side + n % side) as usize;
        let number = |at: usize| shard.endian.number(&index[16 * place + at..][..8]);
        match (number(0), number(8)) {
            (MISSING, MISSING) => Ok(None),
            (offset, count) => file.read(offset, count).map(Some),
        }
    }

    fn index(
        &self,
        shard: &Shard,
        key: &str,
        file: &WatchedFile,
        chunks: u64,
    ) -> Parsed<Arc<Vec<u8>>> {
        if let Some(known) = locked(&self.indices).get(key) {
            return Ok(known.clone());
        }
        let count = chunks * 16 + if shard.has_checksum { 4 } else { 0 };
        let begin = if shard.is_index_at_end {
            file.bytes().saturating_sub(count)
        } else {
            0
        };
        let index = file.read(begin, count)?;
        let index = if shard.has_checksum {
            crc32c::checked(index)
                .ok_or("the checksum of its index is wrong: the file is damaged")?
        } else {
            index
        };
        let index = Arc::new(index);
        let mut indices = locked(&self.indices);
        if indices.len() >= MOST_INDICES {
            indices.clear();
        }
        indices.insert(key.to_string(), index.clone());
        Ok(index)
    }

    /// The file of a chunk, if there is one; it must not have changed since it was first read.
    fn open(&self, key: &str) -> Parsed<Option<WatchedFile>> {
        let path = self.array.folder.join(key);
        // A link to nothing was written, and its contents are elsewhere, as in git-annex.
        let found = std::fs::symlink_metadata(&path);
        let is_missing = found.is_err_and(|error| error.kind() == io::ErrorKind::NotFound);
        let file = if is_missing {
            None
        } else {
            Some(WatchedFile::open(&path)?)
        };
        let version = file.as_ref().map(WatchedFile::version);
        let mut versions = locked(&self.versions);
        if *versions.entry(key.to_string()).or_insert(version) == version {
            Ok(file)
        } else {
            Err(HAS_CHANGED.into())
        }
    }

    /// The wanted voxels of a decoded chunk, x fastest.
    fn taken(&self, chunk: &[u8]) -> Vec<u8> {
        let size = self.array.voxel_type.bytes();
        // Bytes from a voxel to the next along each axis of the array.
        let mut steps = vec![0; self.axes.len()];
        let mut step = size;
        for &axis in self.array.order.iter().rev() {
            steps[axis] = step;
            step *= self.array.chunk[axis] as usize;
        }
        let (mut begin, mut along) = (0, [0; 3]);
        for (n, axis) in self.axes.iter().enumerate() {
            match axis {
                Axis::Space(a) => along[*a] = steps[n],
                Axis::Fixed(at) => begin += (at % self.array.chunk[n]) as usize * steps[n],
            }
        }
        let [width, height, depth] = self.dims.map(|side| side as usize);
        let mut voxels = Vec::with_capacity(width * height * depth * size);
        for z in 0..depth {
            for y in 0..height {
                let row = &chunk[begin + z * along[2] + y * along[1]..];
                if along[0] == size {
                    voxels.extend_from_slice(&row[..width * size])
                } else {
                    let places = (0..width).map(|x| x * along[0]);
                    places.for_each(|at| voxels.extend_from_slice(&row[at..at + size]));
                }
            }
        }
        voxels
    }
}

impl Chunks for ArrayChunks {
    fn files(&self) -> Vec<PathBuf> {
        let mut files: Vec<PathBuf> = self.array.files().collect();
        files.sort();
        self.metadata.iter().cloned().chain(files).collect()
    }

    fn decode(&self, at: [u32; 3]) -> Parsed<Content> {
        let along = self.axes.iter().zip(&self.array.chunk);
        let chunk: Vec<u64> = along
            .map(|(axis, size)| match axis {
                Axis::Space(a) => u64::from(at[*a]),
                Axis::Fixed(n) => n / size,
            })
            .collect();
        let named = |fault| format!("chunk {chunk:?}: {fault}");
        match self.packed(&chunk).map_err(named)? {
            Some(packed) => {
                let expected = self.array.chunk_bytes() as usize;
                let decoded = self.array.codec.decode(packed, expected);
                let decoded = decoded.map_err(named)?;
                Ok(Content::Voxels(self.taken(&decoded)))
            }
            // Its size is only a promise of the metadata, so it takes no memory.
            None => Ok(Content::Uniform(self.array.fill.clone())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chunk of 64 GiB.
    #[test]
    fn a_chunk_that_was_never_written_takes_no_memory() {
        let folder = tempfile::tempdir().unwrap();
        let metadata = r#"{"shape": [4096, 4096, 4096], "chunks": [4096, 4096, 4096], "dtype": "|u1", "fill_value": 7,
                           "order": "C", "compressor": null}"#;
        std::fs::write(folder.path().join(".zarray"), metadata).unwrap();
        let array = Array::read(folder.path()).unwrap();
        let axes = [2, 1, 0].map(Axis::Space).to_vec();
        let chunks = ArrayChunks::new(array, axes, None, [4096; 3]);
        let content = chunks.decode([0; 3]).unwrap();
        assert!(matches!(content, Content::Uniform(voxel) if voxel == [7]));
    }
}
