//! A file's parts, read one after another. All numbers are little-endian.

use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::source::watched::WatchedFile;

/// Bytes that are read at a time while nodes are walked through.
pub const BLOCK: u64 = 1 << 20;

pub struct Stream<'a> {
    file: &'a WatchedFile,
    at: u64,
    block: Vec<u8>,
    /// Offset of the block that was read last, and the bytes that are read at a time.
    begin: u64,
    block_bytes: u64,
}

impl<'a> Stream<'a> {
    /// Reads from an offset on, at least `block_bytes` at a time.
    pub fn new(file: &'a WatchedFile, at: u64, block_bytes: u64) -> Stream<'a> {
        Stream {
            file,
            at,
            block: Vec::new(),
            begin: at,
            block_bytes,
        }
    }

    pub fn at(&self) -> u64 {
        self.at
    }

    pub fn seek(&mut self, at: u64) {
        self.at = at;
    }

    pub fn skip(&mut self, count: u64) {
        self.at = self.at.saturating_add(count);
    }

    /// The next bytes. They must be in the file, which is checked before memory is allocated.
    pub fn bytes(&mut self, count: u64) -> Parsed<&[u8]> {
        let end = self.begin + self.block.len() as u64;
        let wanted = self.at.checked_add(count);
        let is_here = self.at >= self.begin && wanted.is_some_and(|wanted| wanted <= end);
        if !is_here {
            let left = self.file.bytes().saturating_sub(self.at);
            self.block = self
                .file
                .read(self.at, self.block_bytes.min(left).max(count))?;
            self.begin = self.at;
        }
        let first = (self.at - self.begin) as usize;
        self.at += count;
        Ok(&self.block[first..first + count as usize])
    }

    fn array<const N: usize>(&mut self) -> Parsed<[u8; N]> {
        let mut array = [0; N];
        array.copy_from_slice(self.bytes(N as u64)?);
        Ok(array)
    }

    pub fn u8(&mut self) -> Parsed<u8> {
        self.array().map(|[byte]| byte)
    }

    pub fn u32(&mut self) -> Parsed<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub fn u64(&mut self) -> Parsed<u64> {
        self.array().map(u64::from_le_bytes)
    }

    pub fn i64(&mut self) -> Parsed<i64> {
        self.array().map(i64::from_le_bytes)
    }

    pub fn f64(&mut self) -> Parsed<f64> {
        self.array().map(f64::from_le_bytes)
    }

    /// A voxel's indices: 32 bits each, in a type in which boxes do not overflow.
    pub fn place(&mut self) -> Parsed<[i64; 3]> {
        let mut place = [0; 3];
        for index in &mut place {
            *index = self.array().map(i32::from_le_bytes)?.into();
        }
        Ok(place)
    }

    pub fn text(&mut self) -> Parsed<String> {
        let length = self.u32()?;
        let bytes = self.bytes(length.into())?;
        Ok(String::from_utf8_lossy(bytes).into_owned())
    }
}
