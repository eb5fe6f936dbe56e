//! Which samples of a picture: a shard has some of them.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Samples of every pixel by their indices in the whole picture: from `first` up to, but not including, `end`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct SampleRange {
    pub first: u32,
    pub end: u32,
}

impl SampleRange {
    /// A picture's mean weighs its samples in single precision, which counts up to here.
    pub const MOST: u32 = 1 << 24;

    pub fn count(&self) -> u32 {
        self.end.saturating_sub(self.first)
    }
}

impl fmt::Display for SampleRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}..{}", self.first, self.end)
    }
}
