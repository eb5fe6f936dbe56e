//! What a picture has had so far.

/// Counts since the picture began.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Totals {
    /// Samples in every pixel.
    pub samples: u32,
    /// Units that the spread between samples is known from; `published` has a single one, which grows.
    pub units: u32,
    pub paths: u64,
    /// Reads of the volume by tracking.
    pub lookups: u64,
}
