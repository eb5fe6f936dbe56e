//! The bytes of the voxels, decompressed, read front to back.
//!
//! Lengths are checked before anybody allocates for them: a raw file must hold every voxel, and
//! compressed data at least as many bytes as could possibly expand to them.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

use flate2::read::{MultiGzDecoder, ZlibDecoder};

use super::header::{Encoding, Header, Parsed, Start, open};
use super::reading::Reading;

/// Deflate spends at least a bit on each 129 bytes: <https://www.zlib.net/zlib_tech.html>.
const MAX_DEFLATE_RATIO: u64 = 1032;

pub(super) struct Source<'a> {
    reader: Reader,
    /// Decoded bytes left behind.
    position: u64,
    /// Decoded bytes before the first voxel, and after the last.
    begin: u64,
    end: u64,
    header: &'a Header,
    reading: &'a Reading,
}

enum Reader {
    File(File),
    Inflate(Box<dyn Read>),
}

impl<'a> Source<'a> {
    pub fn open(header: &'a Header, reading: &'a Reading) -> Parsed<Source<'a>> {
        let data = &header.data;
        let bytes = header.bytes()?;
        let (mut file, length) = open(&data.path)?;
        let end = data
            .skip
            .checked_add(bytes)
            .ok_or_else(|| format!("skipping {} bytes leads past any file's end", data.skip))?;
        let start = match data.start {
            Start::At(start) => start,
            Start::FromEnd => length.saturating_sub(bytes),
        };
        let found = length.saturating_sub(start);
        if data.encoding == Encoding::Raw && found < end {
            return Err(truncated(
                found.saturating_sub(data.skip),
                bytes,
                &header.shape(),
            ));
        }
        if found.saturating_mul(MAX_DEFLATE_RATIO) < end {
            return Err(format!(
                "its {found} compressed bytes cannot hold the {end} expected for {}: the file is \
                 truncated, or its header wrong",
                header.shape()
            ));
        }
        file.seek(SeekFrom::Start(start))
            .map_err(|e| e.to_string())?;
        Ok(Source {
            reader: match data.encoding {
                Encoding::Raw => Reader::File(file),
                Encoding::Gzip => Reader::Inflate(Box::new(MultiGzDecoder::new(file))),
                Encoding::Zlib => Reader::Inflate(Box::new(ZlibDecoder::new(file))),
            },
            position: 0,
            begin: data.skip,
            end,
            header,
            reading,
        })
    }

    /// Whether the file is known to hold all that the header promises.
    pub fn length_is_certain(&self) -> bool {
        matches!(self.reader, Reader::File(_))
    }

    /// Fills `bytes` from `offset` bytes after the first voxel's start, at or after where the last
    /// read ended.
    pub fn read(&mut self, offset: u64, bytes: &mut [u8]) -> Parsed<()> {
        self.skip_to(self.begin + offset)?;
        self.reading.advance(bytes.len() as u64)?;
        let mut filled = 0;
        while filled < bytes.len() {
            match self.reader.read(&mut bytes[filled..]) {
                Ok(0) => return Err(self.ends_early()),
                Ok(count) => {
                    filled += count;
                    self.position += count as u64;
                }
                Err(e) => self.fault(e)?,
            }
        }
        Ok(())
    }

    /// Decompresses up to the stream's checksum, which tells whether the voxels are what was written;
    /// after a crop the rest is not worth reading.
    pub fn finish(mut self) -> Parsed<()> {
        if self.position < self.end || self.length_is_certain() {
            return Ok(());
        }
        self.reader.read(&mut [0]).map(|_| ()).map_err(|e| {
            format!("the file is damaged: all voxels could be read, but not what follows ({e})")
        })
    }

    fn skip_to(&mut self, target: u64) -> Parsed<()> {
        let distance = target - self.position;
        if distance == 0 {
            return Ok(());
        }
        let skipped = match &mut self.reader {
            Reader::File(file) => file.seek_relative(distance as i64).map(|()| distance),
            Reader::Inflate(stream) => io::copy(&mut stream.take(distance), &mut io::sink()),
        };
        match skipped {
            Ok(skipped) => self.position += skipped,
            Err(e) => self.fault(e)?,
        }
        if self.position < target {
            Err(self.ends_early())
        } else {
            Ok(())
        }
    }

    fn ends_early(&self) -> String {
        let found = self.position.saturating_sub(self.begin);
        truncated(found, self.end - self.begin, &self.header.shape())
    }

    fn fault(&self, error: io::Error) -> Parsed<()> {
        match error.kind() {
            io::ErrorKind::Interrupted => Ok(()),
            io::ErrorKind::UnexpectedEof => Err(self.ends_early()),
            _ => Err(format!(
                "cannot read beyond byte {} of the voxels: {error}",
                self.position
            )),
        }
    }
}

impl Read for Reader {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        match self {
            Reader::File(file) => file.read(bytes),
            Reader::Inflate(stream) => stream.read(bytes),
        }
    }
}

fn truncated(found: u64, expected: u64, shape: &str) -> String {
    format!(
        "holds {found} bytes of voxels, expected {expected} for {shape}: the file is truncated, or \
         its header wrong"
    )
}
