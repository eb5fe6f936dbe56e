//! Units of samples that are worked off together.
//!
//! Where the whole volume is on the device, a unit is done for all pixels before the next one begins. Where the
//! volume streams, that would bring every brick onto the device once a unit, which takes far longer than the unit's
//! paths. So several units of the same size are done together, pixel after pixel: the paths of a pixel and of its
//! neighbours need the same bricks, and the more paths there are, the more of them each loaded brick serves. An
//! *item* is a unit of a pixel, and what slots take from their queue. Each pixel still gets its units one after
//! another, with the same random numbers, into its mean: the picture stays the same to the last bit.
//!
//! The sums of all units in a bundle share the memory of a single unit's sums. So items are done in turn: those of
//! later pixels begin once the earlier pixels have all of their units, and these are in the mean.

use super::sums::Sums;
use crate::render::bricks::Items;

/// The most units in a bundle: the more there are, the fewer pixels have room for their sums at once. Items, and as many
/// again as there are pixels, are counted in 32 bits.
pub fn most_together(pixels: u32) -> u32 {
    let countable = (u32::MAX / pixels).saturating_sub(1).max(1);
    pixels.min(64).min(countable)
}

/// Several units, each with the same number of samples for every pixel.
#[derive(Debug, Clone, Copy)]
pub struct Bundle {
    /// Samples in a unit.
    pub samples: u32,
    pub units: u32,
    /// Index of the first sample of the first unit.
    pub first_sample: u32,
    /// Whether the bundle begins now, or goes on.
    pub begins: bool,
}

/// A bundle that has begun.
pub struct BundleUnderWay {
    pub bundle: Bundle,
    /// Pixels, in the order of work, all of whose units are in the mean.
    pub folded: u32,
    /// Reads of the volume by its paths so far.
    pub lookups: u64,
    /// The picture before, if the mean gets the units of some pixels before those of others.
    pub before: Option<Sums>,
}

/// The progress of a bundle.
#[derive(Debug, Clone, Copy)]
pub struct BundleProgress {
    /// Pixels, in the order of work, all of whose units have their sums in `unit_sum`.
    pub pixels: u32,
    /// Reads of the volume by tracking in this step.
    pub lookups: u32,
}

impl Bundle {
    /// One sample, which is not kept.
    pub const TRIAL: Bundle = Bundle {
        samples: 1,
        units: 1,
        first_sample: 0,
        begins: true,
    };

    /// The items whose sums have room in a picture of this size, once all pixels before `pixels` are in the mean.
    pub fn items_from(&self, pixels: u32, size: [u32; 2]) -> Items {
        let all = size[0] * size[1];
        let first = pixels * self.units;
        Items {
            units: self.units,
            first,
            end: (all * self.units).min(first + all - all % self.units),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_of_the_largest_pictures_can_be_counted() {
        for size in [[1, 1], [7, 5], [8192, 8192], [12000, 8000], [16384, 16384]] {
            let pixels = size[0] * size[1];
            let bundle = Bundle {
                units: most_together(pixels),
                ..Bundle::TRIAL
            };
            let (mut done, mut sheets) = (0, 0);
            while done < pixels {
                let items = bundle.items_from(done, size);
                assert!(items.first < items.end, "{size:?} stays at pixel {done}");
                done = items.end / bundle.units;
                sheets += 1;
            }
            assert!(
                done == pixels && sheets <= bundle.units + 1,
                "{size:?}: {sheets}"
            );
        }
    }
}
