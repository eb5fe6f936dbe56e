//! A bit for each slot of a node.

use super::stream::Stream;
use crate::scene::volume::parsed::Parsed;

#[derive(Debug)]
pub struct Mask(Vec<u8>);

impl Mask {
    pub fn read(stream: &mut Stream, slots: usize) -> Parsed<Mask> {
        stream
            .bytes(slots as u64 / 8)
            .map(|bits| Mask(bits.to_vec()))
    }

    pub fn has(&self, slot: usize) -> bool {
        self.0[slot / 8] >> (slot % 8) & 1 == 1
    }

    pub fn count(&self) -> usize {
        self.0.iter().map(|bits| bits.count_ones() as usize).sum()
    }

    pub fn slots(&self) -> usize {
        8 * self.0.len()
    }

    /// The slots whose bits are set, in ascending order.
    pub fn set(&self) -> impl Iterator<Item = usize> + '_ {
        let of_byte = |(n, bits): (usize, &u8)| {
            let bits = *bits;
            (0..8)
                .filter(move |bit| bits >> bit & 1 == 1)
                .map(move |bit| 8 * n + bit)
        };
        self.0.iter().enumerate().flat_map(of_byte)
    }
}
