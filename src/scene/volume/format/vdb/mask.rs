//! A bit for each slot of a node.

use super::stream::Stream;
use crate::scene::volume::parsed::Parsed;

/// Slots in a word.
const WORD: usize = 64;

#[derive(Debug)]
pub struct Mask(Vec<u64>);

impl Mask {
    /// The mask of a node with so many slots, a multiple of 64.
    pub fn read(stream: &mut Stream, slots: usize) -> Parsed<Mask> {
        let bytes = stream.bytes(slots as u64 / 8)?;
        let (words, _) = bytes.as_chunks::<8>();
        Ok(Mask(
            words.iter().map(|word| u64::from_le_bytes(*word)).collect(),
        ))
    }

    pub fn has(&self, slot: usize) -> bool {
        self.0[slot / WORD] >> (slot % WORD) & 1 == 1
    }

    pub fn slots(&self) -> usize {
        WORD * self.0.len()
    }

    /// The number of slots whose bits are set.
    pub fn count(&self) -> usize {
        self.count_before(self.slots())
    }

    /// The same of the slots before one of them.
    pub fn count_before(&self, slot: usize) -> usize {
        let (whole, rest) = (slot / WORD, slot % WORD);
        let ones = self.0[..whole].iter().map(|word| word.count_ones());
        let last = match rest {
            0 => 0,
            _ => (self.0[whole] << (WORD - rest)).count_ones(),
        };
        (ones.sum::<u32>() + last) as usize
    }

    /// The slots whose bits are set, in ascending order.
    pub fn set(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.slots()).filter(|slot| self.has(*slot))
    }
}
