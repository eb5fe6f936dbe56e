//! DICOM's run-length packing: each byte of a pixel has a segment of its own, packed as PackBits.
//! The standard describes it in part 5, annex G.

use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::source::codec::packbits;

/// A replicated byte takes two bytes, which stand for at most 128.
pub const LARGEST_RATIO: u64 = 64;

const HEADER: usize = 64;

/// Unpacks a frame of `count` pixels of `size` bytes each, the least significant first.
pub fn unpack(packed: &[u8], count: usize, size: usize) -> Parsed<Vec<u8>> {
    let damaged = |why: String| format!("its run-length packed pixels are damaged: {why}");
    let header = packed
        .first_chunk::<HEADER>()
        .ok_or_else(|| damaged(format!("{} bytes, expected a header of 64", packed.len())))?;
    let word = |n: usize| header.as_chunks().0[n];
    let segments = u32::from_le_bytes(word(0)) as usize;
    if segments != size {
        return Err(damaged(format!("{segments} segments, expected {size}")));
    }
    let mut pixels = vec![0; count * size];
    for segment in 0..segments {
        let begin = u32::from_le_bytes(word(1 + segment)) as usize;
        let end = if segment + 1 < segments {
            u32::from_le_bytes(word(2 + segment)) as usize
        } else {
            packed.len()
        };
        let bytes = packed
            .get(begin..end)
            .ok_or_else(|| damaged(format!("segment {segment} is from byte {begin} to {end}")))?;
        let unpacked = packbits::decode(bytes, count);
        if unpacked.len() < count {
            return Err(damaged(format!(
                "segment {segment} holds {} bytes, expected {count}",
                unpacked.len()
            )));
        }
        // The first segment has the most significant bytes.
        let places = pixels.iter_mut().skip(size - 1 - segment).step_by(size);
        places.zip(unpacked).for_each(|(place, byte)| *place = byte);
    }
    Ok(pixels)
}
