//! A unit of samples: what every pixel gets between two updates of its mean.

/// A number of samples for every pixel.
#[derive(Debug, Clone, Copy)]
pub struct Unit {
    pub samples: u32,
    /// Index of the first of them.
    pub first_sample: u32,
    /// Whether it begins now, or is continued.
    pub begins: bool,
}

impl Unit {
    /// One sample that is thrown away.
    pub const TRIAL: Unit = Unit {
        samples: 1,
        first_sample: 0,
        begins: true,
    };
}

/// How far a unit has come.
#[derive(Debug, Clone, Copy)]
pub struct Sampled {
    /// If it has ended, how many samples of each pixel `unit_sum` is the sum of.
    pub ended: Option<u32>,
    /// Reads of the volume by tracking since the last look.
    pub lookups: u32,
}
