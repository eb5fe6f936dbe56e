//! The codecs with which parts of a volume are compressed.
//!
//! A part is decoded as a whole, and its decoded length is known beforehand. Memory grows with the bytes that are
//! really decoded: a damaged file may promise anything. Decoders from other crates are kept from ending the program
//! should they panic on damaged data.

pub mod blosc;
mod blosclz;
mod lzw;
pub mod packbits;

use std::io::Read;

use bzip2::read::MultiBzDecoder;
use ruzstd::decoding::StreamingDecoder;
use zune_inflate::errors::DecodeErrorStatus;
use zune_inflate::{DeflateDecoder, DeflateOptions};

use crate::panic_guard::guarded;
use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::source::gzip::Members;

/// The largest ratio of a part's bytes to its compressed bytes that is believed: Zstandard repeats one byte 128 Ki times in
/// a block of 4 bytes; bzip2 alone could pack more. Headers that promise more are refused before anything is decoded.
pub const LARGEST_RATIO: u64 = 32 << 10;
/// Bytes that are reserved for each compressed one. Parts that need more grow on the way.
const RESERVED: usize = 8;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Codec {
    Plain,
    /// Deflate in zlib's format.
    Zlib,
    Gzip,
    Zstd,
    Bzip2,
    /// A block of LZ4 behind its decoded length, as Zarr has it.
    Lz4,
    Blosc,
    /// In TIFF's variant: the high bits first, and codes that grow one step early.
    Lzw,
    PackBits,
}

impl Codec {
    /// The codec's name, for users.
    pub fn name(self) -> &'static str {
        match self {
            Codec::Plain => "none",
            Codec::Zlib => "deflate",
            Codec::Gzip => "gzip",
            Codec::Zstd => "zstd",
            Codec::Bzip2 => "bzip2",
            Codec::Lz4 => "LZ4",
            Codec::Blosc => "blosc",
            Codec::Lzw => "LZW",
            Codec::PackBits => "PackBits",
        }
    }

    /// Decodes a part that is `expected` bytes long, and fails if it is shorter; bytes after those are not looked at.
    pub fn decode(self, mut packed: Vec<u8>, expected: usize) -> Parsed<Vec<u8>> {
        let decoded = match self {
            Codec::Plain => {
                packed.truncate(expected);
                Ok(packed)
            }
            _ => guarded(|| self.unpack(&packed, expected)),
        };
        match decoded {
            Ok(decoded) if decoded.len() == expected => Ok(decoded),
            Ok(decoded) => Err(format!(
                "a chunk of it, compressed with {}, decodes to {} bytes, expected {expected}: the file is \
                 damaged",
                self.name(),
                decoded.len()
            )),
            Err(fault) => Err(format!(
                "a chunk of it, compressed with {}, is damaged: {fault}",
                self.name()
            )),
        }
    }

    fn unpack(self, packed: &[u8], expected: usize) -> Parsed<Vec<u8>> {
        match self {
            Codec::Plain => Ok(packed.to_vec()),
            Codec::Zlib => inflate(packed, expected),
            Codec::Gzip => all_of(Members::new(packed), packed, expected),
            Codec::Zstd => {
                let decoder = StreamingDecoder::new(packed).map_err(|e| e.to_string())?;
                all_of(decoder, packed, expected)
            }
            Codec::Bzip2 => all_of(MultiBzDecoder::new(packed), packed, expected),
            Codec::Lz4 => {
                let block = packed
                    .get(4..)
                    .ok_or("it is shorter than its header of 4 bytes")?;
                lz4(block, expected)
            }
            Codec::Blosc => blosc::decode(packed, expected),
            Codec::Lzw => lzw::decode(packed, expected),
            Codec::PackBits => Ok(packbits::decode(packed, expected)),
        }
    }
}

/// A block of LZ4. Its decoder needs all its place beforehand, so a promise that no block can keep is refused.
fn lz4(block: &[u8], expected: usize) -> Parsed<Vec<u8>> {
    const LARGEST_LZ4_RATIO: usize = 256;
    if block.len().saturating_mul(LARGEST_LZ4_RATIO) < expected {
        return Err(format!(
            "{} bytes of LZ4 cannot hold the {expected} expected",
            block.len()
        ));
    }
    lz4_flex::block::decompress(block, expected).map_err(|e| e.to_string())
}

fn reserved(packed: &[u8], expected: usize) -> Vec<u8> {
    Vec::with_capacity(expected.min(packed.len().saturating_mul(RESERVED)))
}

fn all_of(decoder: impl Read, packed: &[u8], expected: usize) -> Parsed<Vec<u8>> {
    let mut decoded = reserved(packed, expected);
    match decoder.take(expected as u64).read_to_end(&mut decoded) {
        Ok(_) => Ok(decoded),
        Err(e) => Err(e.to_string()),
    }
}

/// Inflates the data at once, which is faster than as a stream.
fn inflate(packed: &[u8], expected: usize) -> Parsed<Vec<u8>> {
    let options = DeflateOptions::default()
        .set_size_hint(expected.min(packed.len().saturating_mul(RESERVED)))
        .set_limit(expected);
    let mut decoded = match DeflateDecoder::new_with_options(packed, options).decode_zlib() {
        Ok(decoded) => decoded,
        Err(e) => match e.error {
            DecodeErrorStatus::OutputLimitExceeded(..) => e.data,
            error => return Err(format!("{error:?}")),
        },
    };
    decoded.truncate(expected);
    Ok(decoded)
}
