//! Voxels in one file, plain or compressed.
//!
//! The file stays open, and each cursor reads it from a position of its own: even if the file is renamed or deleted
//! by then, it still is the one whose header was read. If its length or its time of modification changes, reading
//! ends with an error: what has been found out about the voxels no longer holds. (Mapping the file instead would let
//! a file that shrinks end the process.)
//!
//! Lengths are checked before memory is allocated for them: a plain file must hold every voxel, and compressed data
//! at least as many bytes as could possibly expand to them.
//!
//! A compressed stream can only be read from its beginning, so a cursor that is sent back begins again.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use bzip2::read::MultiBzDecoder;
use flate2::read::ZlibDecoder;

use super::gzip::Members;
use super::watched::read_at;
use super::{Access, Cursor, Source};
use crate::regular_file::{Version, open_file};
use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::region::Region;
use crate::scene::volume::storage::Storage;
use crate::scene::volume::voxel_type::VoxelType;

/// The largest possible ratio of bytes to those that Deflate packs them into: it spends at least a bit on each 129 bytes
/// (<https://www.zlib.net/zlib_tech.html>).
pub const MOST_DEFLATED: u64 = 1032;

/// The most decoded bytes that may follow the last voxel of a packed file: some writers fill up a block.
const MOST_BEHIND: u64 = 1 << 20;

/// The place of the voxels according to a header.
#[derive(Debug)]
pub struct Data {
    pub path: PathBuf,
    /// Bytes of the file before the data, compressed or not.
    pub start: Start,
    pub encoding: Encoding,
    /// Bytes of the decoded data before the first voxel.
    pub skip: u64,
    pub part: Part,
}

/// One of several volumes of the same size that follow one another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    pub index: u64,
    /// How many there are.
    pub of: u64,
}

impl Part {
    /// The only one.
    pub const WHOLE: Part = Part { index: 0, of: 1 };
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    At(u64),
    /// The last voxel, of the last volume, is at the end of the file.
    FromEnd,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    Raw,
    Gzip,
    Zlib,
    Bzip2,
}

impl Encoding {
    /// The storage that users are told about.
    pub fn storage(self) -> Storage {
        let name = match self {
            Encoding::Raw => None,
            Encoding::Gzip => Some("gzip"),
            Encoding::Zlib => Some("zlib"),
            Encoding::Bzip2 => Some("bzip2"),
        };
        Storage {
            compression: name.map(str::to_string),
            ..Storage::default()
        }
    }

    /// The largest possible ratio of the voxels' bytes to their compressed bytes.
    fn largest_ratio(self) -> u64 {
        match self {
            Encoding::Raw => 1,
            Encoding::Gzip | Encoding::Zlib => MOST_DEFLATED,
            // A block of 900 kB, in which 5 bytes may stand for 259, takes no fewer than 32 bytes.
            Encoding::Bzip2 => 900_000 / 5 * 259 / 32,
        }
    }
}

impl Data {
    /// Opens the file, which need not be the one with the `header`, and checks that it may hold these voxels.
    pub fn open(
        self,
        header: &Path,
        dims: [u32; 3],
        voxel_type: VoxelType,
    ) -> Parsed<Box<dyn Source>> {
        let prefix = if self.path == header {
            String::new()
        } else {
            format!("its data file {}: ", self.path.display())
        };
        let bytes = voxel_bytes(dims, voxel_type)?;
        match self.open_file(bytes, dims, voxel_type) {
            Ok(source) => Ok(Box::new(DataFile { prefix, ..source })),
            Err(fault) => Err(prefix + &fault),
        }
    }

    fn open_file(self, bytes: u64, dims: [u32; 3], voxel_type: VoxelType) -> Parsed<DataFile> {
        let (file, metadata) = open_file(&self.path)?;
        let far = || format!("skipping {} bytes leads past any file's end", self.skip);
        let before = bytes.checked_mul(self.part.index);
        let begin = before.and_then(|before| before.checked_add(self.skip));
        let begin = begin.ok_or_else(far)?;
        let end = begin.checked_add(bytes).ok_or_else(far)?;
        let all = bytes.saturating_mul(self.part.of);
        let start = match self.start {
            Start::At(start) => start,
            Start::FromEnd => metadata.len().saturating_sub(all),
        };
        let source = DataFile {
            path: self.path,
            file,
            version: Version::of(&metadata),
            prefix: String::new(),
            start,
            encoding: self.encoding,
            begin,
            end,
            is_last: self.part.index + 1 == self.part.of,
            dims,
            voxel_type,
        };
        let found = metadata.len().saturating_sub(start);
        if source.encoding == Encoding::Raw && found < end {
            return Err(source.truncated(found));
        }
        if found.saturating_mul(source.encoding.largest_ratio()) < end {
            return Err(format!(
                "its {found} compressed bytes cannot hold the {end} expected for {}: the file is \
                 truncated, or its header wrong",
                shape(dims, voxel_type)
            ));
        }
        Ok(source)
    }
}

/// The size of all voxels.
pub fn voxel_bytes(dims: [u32; 3], voxel_type: VoxelType) -> Parsed<u64> {
    let [x, y, z] = dims.map(u64::from);
    if x == 0 || y == 0 || z == 0 {
        return Err(format!(
            "the volume is {x}×{y}×{z} voxels, expected at least 1 along each axis"
        ));
    }
    x.checked_mul(y)
        .and_then(|n| n.checked_mul(z))
        .and_then(|n| n.checked_mul(voxel_type.bytes() as u64))
        .ok_or_else(|| format!("a volume of {x}×{y}×{z} voxels is beyond 2^64 bytes"))
}

/// "512×512×460 uint16", for messages.
pub fn shape([x, y, z]: [u32; 3], voxel_type: VoxelType) -> String {
    format!("{x}×{y}×{z} {voxel_type}")
}

#[derive(Debug)]
struct DataFile {
    path: PathBuf,
    file: File,
    version: Version,
    /// Text before the fault of a file that the user has not named.
    prefix: String,
    /// Bytes of the file before the data, compressed or not.
    start: u64,
    encoding: Encoding,
    /// Decoded bytes before the first voxel, and up to the end of the last.
    begin: u64,
    end: u64,
    /// Whether no other volume follows.
    is_last: bool,
    dims: [u32; 3],
    voxel_type: VoxelType,
}

impl Source for DataFile {
    fn access(&self) -> Access {
        match self.encoding {
            Encoding::Raw => Access::Rows,
            Encoding::Gzip | Encoding::Zlib | Encoding::Bzip2 => Access::Sequential,
        }
    }

    fn files(&self) -> Vec<PathBuf> {
        vec![self.path.clone()]
    }

    fn cursor(&self) -> Box<dyn Cursor + '_> {
        Box::new(Position {
            source: self,
            stream: self.stream(),
            decoded: 0,
        })
    }
}

impl DataFile {
    fn stream(&self) -> Stream<'_> {
        let file = FileAt {
            file: &self.file,
            offset: self.start,
        };
        match self.encoding {
            Encoding::Raw => Stream::Plain(file),
            Encoding::Gzip => Stream::Inflated(Box::new(Members::new(file))),
            Encoding::Bzip2 => Stream::Inflated(Box::new(MultiBzDecoder::new(file))),
            Encoding::Zlib => Stream::Inflated(Box::new(ZlibDecoder::new(file))),
        }
    }

    /// The fault of data of which only `found` decoded bytes exist.
    fn truncated(&self, found: u64) -> String {
        format!(
            "holds {} bytes of voxels, expected {} for {}: the file is truncated, or its header wrong",
            found.saturating_sub(self.begin),
            self.end - self.begin,
            shape(self.dims, self.voxel_type)
        )
    }
}

struct Position<'a> {
    source: &'a DataFile,
    stream: Stream<'a>,
    /// Decoded bytes before the cursor.
    decoded: u64,
}

enum Stream<'a> {
    Plain(FileAt<'a>),
    Inflated(Box<dyn Read + Send + 'a>),
}

impl Cursor for Position<'_> {
    fn read(&mut self, region: Region, bytes: &mut [u8]) -> Parsed<()> {
        let DataFile {
            file,
            version,
            prefix,
            ..
        } = self.source;
        let read = self.read_runs(region, bytes);
        // What was read of a file that has changed means nothing, faults included.
        let read = version.check(file).and(read);
        read.map_err(|fault| format!("{prefix}{fault}"))
    }
}

impl Position<'_> {
    fn read_runs(&mut self, region: Region, bytes: &mut [u8]) -> Parsed<()> {
        let size = self.source.voxel_type.bytes();
        let mut rest = bytes;
        for (first, count) in region.runs(self.source.dims) {
            let (run, later) = rest.split_at_mut(count * size);
            self.go_to(self.source.begin + first * size as u64)?;
            self.fill(run)?;
            rest = later;
        }
        if self.decoded == self.source.end {
            self.check_end()?;
        }
        Ok(())
    }

    fn fill(&mut self, bytes: &mut [u8]) -> Parsed<()> {
        let mut filled = 0;
        while filled < bytes.len() {
            let read = match &mut self.stream {
                Stream::Plain(file) => file.read(&mut bytes[filled..]),
                Stream::Inflated(stream) => stream.read(&mut bytes[filled..]),
            };
            match read {
                Ok(0) => return Err(self.ends_early()),
                Ok(count) => {
                    filled += count;
                    self.decoded += count as u64;
                }
                Err(e) => self.fault(e)?,
            }
        }
        Ok(())
    }

    fn go_to(&mut self, target: u64) -> Parsed<()> {
        if target < self.decoded {
            self.stream = self.source.stream();
            self.decoded = 0;
        }
        match &mut self.stream {
            Stream::Plain(file) => {
                file.offset = self.source.start + target;
                self.decoded = target;
            }
            Stream::Inflated(stream) if target > self.decoded => {
                let distance = target - self.decoded;
                match io::copy(&mut stream.take(distance), &mut io::sink()) {
                    Ok(skipped) => self.decoded += skipped,
                    Err(e) => self.fault(e)?,
                }
            }
            Stream::Inflated(_) => {}
        }
        if self.decoded < target {
            Err(self.ends_early())
        } else {
            Ok(())
        }
    }

    /// Decompresses up to the stream's checksum, which verifies the voxels. The rest is not worth reading where a crop ends
    /// before the last voxel, or where other volumes follow.
    fn check_end(&mut self) -> Parsed<()> {
        let Stream::Inflated(stream) = &mut self.stream else {
            return Ok(());
        };
        if !self.source.is_last {
            return Ok(());
        }
        let behind = io::copy(&mut stream.take(MOST_BEHIND), &mut io::sink()).map_err(|e| {
            format!("the file is damaged: all voxels could be read, but not what follows ({e})")
        })?;
        self.decoded += behind;
        if behind == MOST_BEHIND {
            return Err(format!(
                "holds more than {} bytes after the voxels of {}, expected none: its header is wrong",
                MOST_BEHIND - 1,
                shape(self.source.dims, self.source.voxel_type)
            ));
        }
        Ok(())
    }

    fn ends_early(&self) -> String {
        self.source.truncated(self.decoded)
    }

    fn fault(&self, error: io::Error) -> Parsed<()> {
        match error.kind() {
            io::ErrorKind::Interrupted => Ok(()),
            io::ErrorKind::UnexpectedEof => Err(self.ends_early()),
            _ => Err(format!(
                "cannot read beyond byte {} of the voxels: {error}",
                self.decoded
            )),
        }
    }
}

/// Reads a file from an offset on, independently of other readers.
pub struct FileAt<'a> {
    pub file: &'a File,
    pub offset: u64,
}

impl Read for FileAt<'_> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let count = read_at(self.file, bytes, self.offset)?;
        self.offset += count as u64;
        Ok(count)
    }
}
