//! Copies a volume into its store, or only the results of the scan of it.
//!
//! One layer of chunks is compressed by all cores while the next one is read: a compressed file is inflated by a
//! single core.

use std::fs;
use std::io::{BufWriter, Write};

use rayon::prelude::*;
use xxhash_rust::xxh3::xxh3_64;

use super::file::{Entry, LEVEL, Rest};
use super::layout::Layout;
use super::{Copying, Keeping, PREFIX, StoreFile, Stores};
use crate::error::{Error, Origin, Result};
use crate::scene::volume::Volume;
use crate::scene::volume::grid::Reader;
use crate::scene::volume::region::Region;
use crate::temporary::{self, Temporary};

impl Keeping {
    /// Writes the store, with the voxels if the volume itself cannot be read in any order.
    ///
    /// # Errors
    ///
    /// If the volume cannot be read, if the folder cannot be written or is full, or if the callback returns an error.
    pub fn write(&self, volume: &Volume) -> Result<()> {
        let layout = Layout::new(volume.dims, volume.stored.bytes());
        let mut temporary = self
            .store_file
            .create()
            .map_err(|e| self.no_room(volume, &e))?;
        let mut copy = Copy {
            file: BufWriter::new(temporary.file.as_file_mut()),
            offset: 0,
            index: Vec::new(),
        };
        if !volume.is_direct() {
            copy.index = vec![bytemuck::Zeroable::zeroed(); layout.total()];
            self.copy_voxels(volume, &layout, &mut copy)?;
        }
        let rest = Rest {
            identity: self.store_file.identity,
            extremes: self.extremes,
            counts: &volume.statistics.counts,
            histogram: volume.statistics.histogram(),
            macrocells: &volume.statistics.macrocell_ranges,
            voxel_bytes: volume.stored.bytes(),
            index: &copy.index,
        };
        let written = rest
            .packed()
            .and_then(|rest| copy.file.write_all(&rest))
            .and_then(|()| copy.file.flush())
            .and_then(|()| copy.file.get_ref().sync_all());
        drop(copy);
        written
            .and_then(|()| temporary.persist(&self.store_file.path()))
            .map_err(|e| self.no_room(volume, &e))
    }

    fn copy_voxels(&self, volume: &Volume, layout: &Layout, copy: &mut Copy) -> Result<()> {
        let stores = &self.store_file.stores;
        let mut layers = Layers::new(volume, layout);
        let mut next = layers.next();
        let count = f64::from(layout.counts()[2]);
        let mut done = 0.0;
        while let Some(layer) = next.transpose()? {
            stores.tell(volume, done / count)?;
            let (packed, following) = rayon::join(|| layer.packed(layout), || layers.next());
            let written = packed.and_then(|packed| copy.add(layout, packed));
            written.map_err(|e| self.no_room(volume, &e))?;
            next = following;
            done += 1.0;
        }
        stores.tell(volume, 1.0)
    }

    fn no_room(&self, volume: &Volume, error: &std::io::Error) -> Error {
        let problem = format!(
            "its store cannot be written in {}: {error}; name a folder with room for its voxels by --cache-dir, or \
             decompress the file",
            self.store_file.stores.folder.display()
        );
        Error::input(Origin::File(volume.grid.name.clone()), problem)
    }
}

impl Stores {
    fn tell(&self, volume: &Volume, share: f64) -> Result<()> {
        (self.tell)(&Copying {
            volume: &volume.grid.name,
            folder: &self.folder,
            share,
        })
    }
}

impl StoreFile {
    /// Makes a temporary file, after removing those that killed processes have left.
    fn create(&self) -> std::io::Result<Temporary> {
        let folder = &self.stores.folder;
        fs::create_dir_all(folder)?;
        let prefix = format!("{PREFIX}{}-", self.name);
        temporary::remove_abandoned(folder, &prefix);
        temporary::create(folder, &prefix)
    }
}

struct Copy<'a> {
    file: BufWriter<&'a mut fs::File>,
    offset: u64,
    index: Vec<Entry>,
}

impl Copy<'_> {
    fn add(&mut self, layout: &Layout, chunks: Vec<([u32; 3], Vec<u8>)>) -> std::io::Result<()> {
        for (at, packed) in chunks {
            self.file.write_all(&packed)?;
            let bytes = packed.len() as u64;
            self.index[layout.index(at)] = Entry {
                offset: self.offset,
                bytes,
                checksum: xxh3_64(&packed),
            };
            self.offset += bytes;
        }
        Ok(())
    }
}

/// The layers of chunks of a volume, in the order in which its source is read fastest.
struct Layers<'a> {
    reader: Reader<'a>,
    layout: &'a Layout,
    /// In the order of reading.
    rest: Box<dyn Iterator<Item = u32> + Send>,
    is_mirrored: bool,
    /// The slice that the last layer read shares with the next one.
    shared: Vec<u8>,
}

struct Layer {
    region: Region,
    bytes: Vec<u8>,
}

impl<'a> Layers<'a> {
    fn new(volume: &'a Volume, layout: &'a Layout) -> Layers<'a> {
        let layers = 0..layout.counts()[2];
        let is_mirrored = volume.grid.is_mirrored;
        Layers {
            reader: volume.reader(),
            layout,
            rest: if is_mirrored {
                Box::new(layers.rev())
            } else {
                Box::new(layers)
            },
            is_mirrored,
            shared: Vec::new(),
        }
    }

    fn next(&mut self) -> Option<Result<Layer>> {
        self.rest.next().map(|k| self.read(k))
    }

    /// Reads a layer except for the slice that it shares with the previous layer, since a stream does not give it
    /// twice.
    fn read(&mut self, k: u32) -> Result<Layer> {
        let [width, height, _] = self.layout.dims;
        let column = self.layout.region([0, 0, k]);
        let region = Region {
            low: [0, 0, column.low[2]],
            dims: [width, height, column.dims[2]],
        };
        let slice = width as usize * height as usize * self.layout.voxel_bytes;
        let mut bytes = vec![0; region.dims[2] as usize * slice];
        let mut wanted = region;
        let (first, last) = (0..slice, bytes.len() - slice..bytes.len());
        let (place, kept) = if self.is_mirrored {
            (last, first)
        } else {
            (first, last)
        };
        let mut fresh = 0..bytes.len();
        if !self.shared.is_empty() {
            bytes[place].copy_from_slice(&self.shared);
            wanted.dims[2] -= 1;
            if self.is_mirrored {
                fresh.end -= slice
            } else {
                wanted.low[2] += 1;
                fresh.start += slice;
            }
        }
        if wanted.dims[2] > 0 {
            self.reader.read(wanted, &mut bytes[fresh])?;
        }
        self.shared = bytes[kept].to_vec();
        Ok(Layer { region, bytes })
    }
}

impl Layer {
    fn packed(&self, layout: &Layout) -> std::io::Result<Vec<([u32; 3], Vec<u8>)>> {
        let [x, y, _] = layout.counts();
        let k = self.region.low[2] / layout.step[2];
        let all: Vec<[u32; 3]> = (0..y)
            .flat_map(|j| (0..x).map(move |i| [i, j, k]))
            .collect();
        let pack = |at: [u32; 3]| {
            let chunk = layout.region(at);
            let size = layout.voxel_bytes;
            let row = chunk.dims[0] as usize * size;
            let mut voxels = Vec::with_capacity(chunk.voxels() * size);
            for from in chunk.outside(&self.region).rows(self.region.dims) {
                voxels.extend_from_slice(&self.bytes[from * size..][..row]);
            }
            Ok((at, zstd::bulk::compress(&voxels, LEVEL)?))
        };
        all.into_par_iter().map(pack).collect()
    }
}
