//! The file of a store: chunks in any order, then the rest, which is compressed as a whole, then its length and
//! checksum.
//!
//! The end is written last, and has to be complete for the store to be valid. A chunk's checksum is in the rest, and
//! is checked whenever the chunk is read.

use std::mem::size_of;
use std::path::{Path, PathBuf};

use bytemuck::{Pod, Zeroable, bytes_of, cast_slice, pod_collect_to_vec, pod_read_unaligned};
use xxhash_rust::xxh3::xxh3_64;

use super::layout::Layout;
use crate::scene::volume::histogram::Histogram;
use crate::scene::volume::macrocells::MACROCELL;
use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::region::Region;
use crate::scene::volume::scan::{Extremes, Scan};
use crate::scene::volume::source::watched::WatchedFile;
use crate::scene::volume::source::{Access, Cursor, Source};
use crate::scene::volume::stored::StoredType;

/// Level of compression: the fastest that does not lose much in size.
pub const LEVEL: i32 = 1;

const MAGIC: [u8; 8] = *b"isostore";

/// The contents of a store.
pub struct Known {
    pub scan: Scan,
    /// The last histogram of floats.
    pub histogram: Option<Histogram>,
    /// `None` if the volume itself can be read in any order.
    pub voxels: Option<Store>,
}

/// The voxels of a store.
#[derive(Debug)]
pub struct Store {
    file: WatchedFile,
    layout: Layout,
    index: Vec<Entry>,
}

/// The place of a chunk in the file.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct Entry {
    pub offset: u64,
    pub bytes: u64,
    /// Checksum of the compressed bytes.
    pub checksum: u64,
}

/// The numbers at the beginning of the rest. Arrays follow: how often each value occurs, the histogram, the
/// macrocells' ranges, the index of the chunks.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Head {
    identity: [u64; 2],
    rounding: f64,
    infinite: u64,
    /// The low edge and the width of the histogram's bins.
    bins: [f64; 2],
    counts: u64,
    histogram: u64,
    macrocells: u64,
    chunks: u64,
    range: [f32; 2],
    voxel_bytes: u64,
}

/// The last bytes of the file.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct End {
    magic: [u8; 8],
    /// Bytes of the compressed rest before it.
    bytes: u64,
    checksum: u64,
}

const END_BYTES: u64 = size_of::<End>() as u64;

/// Everything in a store but its chunks.
pub struct Rest<'a> {
    pub identity: u128,
    pub extremes: Extremes,
    pub counts: &'a [u64],
    pub histogram: Option<Histogram>,
    pub macrocells: &'a [[f32; 2]],
    pub voxel_bytes: usize,
    pub index: &'a [Entry],
}

impl Rest<'_> {
    /// The last bytes of a store.
    pub fn packed(&self) -> std::io::Result<Vec<u8>> {
        let histogram = self.histogram.as_ref();
        let bins = histogram.map_or(&[][..], |h| &h.counts);
        let head = Head {
            identity: [self.identity as u64, (self.identity >> 64) as u64],
            rounding: self.extremes.rounding,
            infinite: self.extremes.infinite,
            bins: histogram.map_or([0.0; 2], |h| [h.low, h.width]),
            counts: self.counts.len() as u64,
            histogram: bins.len() as u64,
            macrocells: self.macrocells.len() as u64,
            chunks: self.index.len() as u64,
            range: self.extremes.range,
            voxel_bytes: self.voxel_bytes as u64,
        };
        let plain = [
            bytes_of(&head),
            cast_slice(self.counts),
            cast_slice(bins),
            cast_slice(self.macrocells),
            cast_slice(self.index),
        ];
        let mut bytes = zstd::bulk::compress(&plain.concat(), LEVEL)?;
        let end = End {
            magic: MAGIC,
            bytes: bytes.len() as u64,
            checksum: xxh3_64(&bytes),
        };
        bytes.extend_from_slice(bytes_of(&end));
        Ok(bytes)
    }
}

/// `None` if the store is of another volume, or of an earlier state of this one.
pub fn open(
    path: &Path,
    identity: u128,
    dims: [u32; 3],
    stored: StoredType,
) -> Parsed<Option<Known>> {
    let file = WatchedFile::open(path)?;
    let plain = rest(&file)?;
    let head_bytes = plain
        .get(..size_of::<Head>())
        .ok_or("it says nothing of what it holds")?;
    let head: Head = pod_read_unaligned(head_bytes);
    if u128::from(head.identity[0]) | u128::from(head.identity[1]) << 64 != identity {
        return Ok(None);
    }
    let mut arrays = Arrays(&plain[size_of::<Head>()..]);
    let counts = arrays.next(head.counts)?;
    let bins = arrays.next(head.histogram)?;
    let ranges: Vec<[f32; 2]> = arrays.next(head.macrocells)?;
    let index: Vec<Entry> = arrays.next(head.chunks)?;
    let layout = Layout::new(dims, stored.bytes());
    let macrocells = dims.map(|n| (n as usize + 1).div_ceil(MACROCELL as usize));
    let is_complete = index.is_empty() || index.len() == layout.total();
    if ranges.len() != macrocells.iter().product::<usize>() || !is_complete {
        return Err("it is of a volume of another size".into());
    }
    let is_sound = |[low, high]: &[f32; 2]| low <= high;
    if head.voxel_bytes != stored.bytes() as u64
        || counts.len() != stored.counted()
        || !adds_up(&counts, dims)
        || !adds_up(&bins, dims)
        || !ranges.iter().chain([&head.range]).all(is_sound)
    {
        return Err("its table contradicts itself".into());
    }
    let [low, width] = head.bins;
    Ok(Some(Known {
        scan: Scan {
            extremes: Extremes {
                range: head.range,
                infinite: head.infinite,
                rounding: head.rounding,
            },
            ranges,
            counts,
            kept: None,
        },
        histogram: (!bins.is_empty()).then_some(Histogram {
            low,
            width,
            counts: bins,
        }),
        voxels: (!index.is_empty()).then_some(Store {
            file,
            layout,
            index,
        }),
    }))
}

/// Whether there are counts for all voxels, or none at all.
fn adds_up(counts: &[u64], dims: [u32; 3]) -> bool {
    let counted: u128 = counts.iter().map(|count| u128::from(*count)).sum();
    counts.is_empty() || counted == dims.map(u128::from).iter().product::<u128>()
}

/// The rest, decompressed.
fn rest(file: &WatchedFile) -> Parsed<Vec<u8>> {
    let before_end = file.bytes().saturating_sub(END_BYTES);
    let end = file.read(before_end, END_BYTES.min(file.bytes()))?;
    let end: Option<End> =
        (end.len() as u64 == END_BYTES).then(|| bytemuck::pod_read_unaligned(&end));
    let end = end.filter(|end| end.magic == MAGIC && end.bytes <= before_end);
    let end = end.ok_or("its end is missing")?;
    let packed = file.read(before_end - end.bytes, end.bytes)?;
    if xxh3_64(&packed) == end.checksum {
        zstd::stream::decode_all(&packed[..]).map_err(|e| e.to_string())
    } else {
        Err("the checksum of its table is wrong".into())
    }
}

struct Arrays<'a>(&'a [u8]);

impl Arrays<'_> {
    fn next<T: Pod>(&mut self, count: u64) -> Parsed<Vec<T>> {
        let bytes = usize::try_from(count)
            .ok()
            .and_then(|count| count.checked_mul(size_of::<T>()));
        let split = bytes.and_then(|bytes| self.0.split_at_checked(bytes));
        let (array, later) = split.ok_or("its table ends too early")?;
        self.0 = later;
        Ok(pod_collect_to_vec(array))
    }
}

impl Store {
    fn chunk(&self, at: [u32; 3]) -> Parsed<Vec<u8>> {
        let entry = self.index[self.layout.index(at)];
        let expected = self.layout.region(at).voxels() * self.layout.voxel_bytes;
        let damaged = |what: String| {
            format!(
                "its store {} is damaged: {what}; remove it, and the next run makes it anew",
                self.file.path().display()
            )
        };
        let packed = self.file.read(entry.offset, entry.bytes);
        let packed = packed.map_err(damaged)?;
        if xxh3_64(&packed) != entry.checksum {
            return Err(damaged(format!("the checksum of chunk {at:?} is wrong")));
        }
        match zstd::bulk::decompress(&packed, expected) {
            Ok(voxels) if voxels.len() == expected => Ok(voxels),
            Ok(voxels) => Err(damaged(format!(
                "chunk {at:?} decodes to {} bytes, expected {expected}",
                voxels.len()
            ))),
            Err(e) => Err(damaged(format!("chunk {at:?} does not decode ({e})"))),
        }
    }

    /// Copies the part of a region that lies in a chunk.
    fn put(&self, at: [u32; 3], part: Region, region: Region, bytes: &mut [u8]) -> Parsed<()> {
        let voxels = self.chunk(at)?;
        let size = self.layout.voxel_bytes;
        let [from, to] =
            [self.layout.region(at), region].map(|whole| part.outside(&whole).rows(whole.dims));
        let row = part.dims[0] as usize * size;
        for (from, to) in from.zip(to) {
            bytes[to * size..][..row].copy_from_slice(&voxels[from * size..][..row]);
        }
        Ok(())
    }
}

impl Source for Store {
    fn access(&self) -> Access {
        Access::Direct
    }

    fn files(&self) -> Vec<PathBuf> {
        vec![self.file.path().to_path_buf()]
    }

    fn cursor(&self) -> Box<dyn Cursor + '_> {
        Box::new(self)
    }
}

impl Cursor for &Store {
    fn read(&mut self, region: Region, bytes: &mut [u8]) -> Parsed<()> {
        let [x, y, z] = [0, 1, 2].map(|a| self.layout.spans(region, a));
        for k in &z {
            for j in &y {
                for i in &x {
                    let spans = [i, j, k];
                    let part = Region {
                        low: spans.map(|span| span.low),
                        dims: spans.map(|span| span.high - span.low),
                    };
                    self.put(spans.map(|span| span.chunk), part, region, bytes)?;
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A store of 2×2×2 voxels of one byte each, which all are 7, without its chunks.
    fn opened(change: impl FnOnce(&mut Rest<'_>)) -> Parsed<Option<Known>> {
        let mut counts = [0; 256];
        counts[7] = 8;
        let mut rest = Rest {
            identity: 1,
            extremes: Extremes {
                range: [7.0; 2],
                infinite: 0,
                rounding: 0.0,
            },
            counts: &counts,
            histogram: None,
            macrocells: &[[7.0; 2]],
            voxel_bytes: 1,
            index: &[],
        };
        change(&mut rest);
        let file = tempfile::NamedTempFile::new().expect("a file");
        std::fs::write(&file, rest.packed().expect("a table")).expect("a file");
        open(file.path(), 1, [2; 3], StoredType::U8)
    }

    #[test]
    fn a_table_that_contradicts_itself_is_damage() {
        assert!(opened(|_| ()).expect("a store").is_some());
        assert!(opened(|rest| rest.identity = 2).expect("a store").is_none());
        let changes: [fn(&mut Rest<'_>); 6] = [
            |rest| rest.voxel_bytes = 0,
            |rest| rest.counts = &[8],
            |rest| rest.counts = &[1; 256],
            |rest| rest.counts = &[u64::MAX; 256],
            |rest| rest.macrocells = &[[1.0, f32::NAN]],
            |rest| rest.extremes.range = [8.0, 7.0],
        ];
        for change in changes {
            assert!(opened(change).is_err());
        }
    }
}
