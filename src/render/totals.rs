//! Counts of the work that a picture has had so far.

/// Counts since the picture began.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Totals {
    /// Index of the picture's first sample, which is not 0 in a shard of a picture.
    pub first_sample: u32,
    /// Samples in every pixel.
    pub samples: u32,
    /// Units whose spread gives the standard error; `published` has a single one, which grows.
    pub units: u32,
    pub paths: u64,
    /// Reads of the volume by tracking.
    pub lookups: u64,
}
