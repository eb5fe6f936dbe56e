//! DICOM's run-length packing: each byte of a pixel has a segment of its own, packed like PackBits.
//! The standard describes it in part 5, annex G.

use crate::scene::volume::parsed::Parsed;

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
        // The first segment has the most significant bytes.
        let filled = fill(bytes, &mut pixels, size - 1 - segment, size);
        if filled < count {
            return Err(damaged(format!(
                "segment {segment} holds {filled} bytes, expected {count}"
            )));
        }
    }
    Ok(pixels)
}

/// Unpacks one segment to every `size`-th byte from `first` on. Returns the number of bytes.
fn fill(mut packed: &[u8], pixels: &mut [u8], first: usize, size: usize) -> usize {
    let count = pixels.len() / size;
    let mut filled = 0;
    while filled < count {
        let Some((control, rest)) = packed.split_first() else {
            return filled;
        };
        let left = count - filled;
        match *control as i8 {
            -128 => packed = rest,
            control @ 0.. => {
                let length = (control as usize + 1).min(rest.len());
                let used = length.min(left);
                let places = pixels[filled * size + first..].iter_mut().step_by(size);
                places
                    .zip(&rest[..used])
                    .for_each(|(pixel, byte)| *pixel = *byte);
                filled += used;
                packed = &rest[length..];
            }
            control => {
                let Some((byte, rest)) = rest.split_first() else {
                    return filled;
                };
                let used = (1 - isize::from(control)) as usize;
                let used = used.min(left);
                let places = pixels[filled * size + first..].iter_mut().step_by(size);
                places.take(used).for_each(|pixel| *pixel = *byte);
                filled += used;
                packed = rest;
            }
        }
    }
    filled
}
