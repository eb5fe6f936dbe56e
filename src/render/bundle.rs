//! Units of samples that are worked off together.
//!
//! Where the volume is whole, a unit is done for all pixels before the next one begins. Where it streams, that would
//! bring every brick onto the device once a unit, which takes far longer than its paths. So several units of the same
//! size are done together, pixel after pixel: a pixel's paths, and its neighbours', need the same bricks, and the more of
//! them there are, the more of them a brick serves. An *item* is a unit of a pixel, and what slots take from their queue.
//! Each pixel still gets its units one after another, with the same random numbers, into its mean: the picture stays the
//! same to the last bit.
//!
//! The sums of units have no more room than those of a single unit of all pixels. Items take it in turn: those of later
//! pixels begin once earlier pixels have all of their units, and these are in the mean.

use super::brick_window::Items;

/// Units that are done together at most: the more there are, the fewer pixels have room for their sums at once.
pub const MOST_TOGETHER: u32 = 64;

/// A number of units of the same number of samples for every pixel.
#[derive(Debug, Clone, Copy)]
pub struct Bundle {
    /// Of a unit.
    pub samples: u32,
    pub units: u32,
    /// Index of the first sample of all.
    pub first_sample: u32,
    /// Whether it begins now, or goes on.
    pub begins: bool,
}

/// How far a bundle has come.
#[derive(Debug, Clone, Copy)]
pub struct Sampled {
    /// Pixels, in the order of work, whose sums of all units are in `unit_sum`.
    pub pixels: u32,
    /// Reads of the volume by tracking since the last look.
    pub lookups: u32,
}

impl Bundle {
    /// One sample, which nobody keeps.
    pub const TRIAL: Bundle = Bundle {
        samples: 1,
        units: 1,
        first_sample: 0,
        begins: true,
    };

    /// The items whose sums have room in a picture of so many pixels, once all before `pixels` are in the mean.
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
