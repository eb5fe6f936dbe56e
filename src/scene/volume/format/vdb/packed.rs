//! The values of a node's slots, as they are compressed: `openvdb/io/Compression.h`.
//!
//! Of inactive slots, only which of two values each has is stored, if there are no more than two. What is left goes
//! through a codec, unless that would make it larger.

use super::mask::Mask;
use super::number::Number;
use super::stream::Stream;
use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::source::codec::Codec;

/// A grid's way of compression.
#[derive(Debug, Clone, Copy)]
pub struct Compression {
    codec: Codec,
    /// Whether inactive slots are left out.
    is_masked: bool,
}

impl Compression {
    pub fn read(stream: &mut Stream) -> Parsed<Compression> {
        const ZIP: u32 = 1;
        const ACTIVE_MASK: u32 = 2;
        const BLOSC: u32 = 4;
        let flags = stream.u32()?;
        let codec = match flags {
            _ if flags & !(ZIP | ACTIVE_MASK | BLOSC) != 0 => {
                return Err(format!(
                    "it has the compression {flags:#x}, expected one of zip and Blosc"
                ));
            }
            _ if flags & BLOSC != 0 => Codec::Blosc,
            _ if flags & ZIP != 0 => Codec::Zlib,
            _ => Codec::Plain,
        };
        Ok(Compression {
            codec,
            is_masked: flags & ACTIVE_MASK != 0,
        })
    }

    /// The codec's name, for users; `None` if there is none.
    pub fn name(self) -> Option<String> {
        (self.codec != Codec::Plain).then(|| self.codec.name().to_string())
    }
}

/// The values of a node's slots, of which only the head has been read.
pub struct Packed<'m> {
    number: Number,
    codec: Codec,
    mask: &'m Mask,
    /// Bytes of the stored numbers before the codec.
    plain_bytes: u64,
    /// The two values of slots that are left out, and the slots that have the second; `None` if no slot is left out.
    left_out: Option<([Vec<u8>; 2], Option<Mask>)>,
}

impl<'m> Packed<'m> {
    /// Reads what stands before the stored values. `mask` says which slots are active.
    pub fn read(
        stream: &mut Stream,
        number: Number,
        compression: Compression,
        background: &[u8],
        mask: &'m Mask,
    ) -> Parsed<Packed<'m>> {
        let kind = stream.u8()?;
        let (plus, minus) = (|| background.to_vec(), || number.negated(background));
        // Named in OpenVDB by what is stored: a mask or none, and values of inactive slots.
        let values = match kind {
            // NO_MASK_OR_INACTIVE_VALS
            0 => Some([plus(), plus()]),
            // NO_MASK_AND_MINUS_BG, MASK_AND_NO_INACTIVE_VALS
            1 | 3 => Some([minus(), plus()]),
            // NO_MASK_AND_ONE_INACTIVE_VAL, MASK_AND_ONE_INACTIVE_VAL
            2 | 4 => Some([number.read(stream)?, plus()]),
            // MASK_AND_TWO_INACTIVE_VALS
            5 => Some([number.read(stream)?, number.read(stream)?]),
            // NO_MASK_AND_ALL_VALS
            6 => None,
            other => {
                return Err(format!(
                    "it has a node of kind {other}, expected 0 to 6: the file is damaged"
                ));
            }
        };
        let has_choice = matches!(kind, 3..=5);
        let choice = if has_choice {
            Some(Mask::read(stream, mask.slots())?)
        } else {
            None
        };
        let values = values.filter(|_| compression.is_masked);
        let stored = match values {
            Some(_) => mask.count(),
            None => mask.slots(),
        };
        Ok(Packed {
            number,
            codec: compression.codec,
            mask,
            plain_bytes: (stored * number.bytes_in_arrays()) as u64,
            left_out: values
                .filter(|_| stored < mask.slots())
                .map(|values| (values, choice)),
        })
    }

    /// The bytes that the stored numbers have in the file, and whether a codec has made these.
    fn stored_bytes(&self, stream: &mut Stream) -> Parsed<(u64, bool)> {
        /// What Blosc adds to data that it cannot compress.
        const OVERHEAD: u64 = 16;
        let plain = self.plain_bytes;
        if self.codec == Codec::Plain || plain == 0 && self.number.leaves_out_empty() {
            return Ok((plain, false));
        }
        // What a codec would have made larger is stored as it is, with its size as a negative number.
        let size = stream.i64()?;
        let bytes = size.unsigned_abs();
        let is_packed = size > 0;
        if is_packed && bytes <= plain + OVERHEAD || !is_packed && bytes == plain {
            return Ok((bytes, is_packed));
        }
        Err(format!(
            "a node takes {bytes} bytes, expected at most {plain} and 16 more: the file is damaged"
        ))
    }

    /// Goes on behind the values.
    pub fn skip(&self, stream: &mut Stream) -> Parsed<()> {
        let (bytes, _) = self.stored_bytes(stream)?;
        stream.skip(bytes);
        Ok(())
    }

    /// The values of all slots.
    pub fn unpack(self, stream: &mut Stream) -> Parsed<Vec<u8>> {
        let (bytes, is_packed) = self.stored_bytes(stream)?;
        let stored = stream.bytes(bytes)?.to_vec();
        let plain = if is_packed {
            self.codec.decode(stored, self.plain_bytes as usize)?
        } else {
            stored
        };
        let stored = self.number.array(plain);
        let Some(([first, second], choice)) = self.left_out else {
            return Ok(stored);
        };
        let mut stored = stored.chunks_exact(self.number.bytes());
        let mut values = Vec::with_capacity(self.mask.slots() * self.number.bytes());
        for slot in 0..self.mask.slots() {
            let is_second = || choice.as_ref().is_some_and(|mask| mask.has(slot));
            let value = if self.mask.has(slot) {
                stored.next().unwrap_or(&second)
            } else if is_second() {
                &second
            } else {
                &first
            };
            values.extend_from_slice(value);
        }
        Ok(values)
    }
}
