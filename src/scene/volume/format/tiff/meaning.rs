//! The meaning of a file's pages: which of them are slices of which channel at which time.

use super::voxel_size::VoxelSize;

/// An axis along which pages lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    Channel,
    Slice,
    Time,
}

/// The meaning of a file's pages.
pub struct Meaning {
    pub size: VoxelSize,
    /// A voxel's value is intercept + slope · the number in the file.
    pub slope: f64,
    pub intercept: f64,
    /// Slices of each channel at each time.
    pub depth: usize,
    /// The samples of one pixel are channels, too.
    pub channels: u32,
    /// The names of the first channels, or "".
    pub names: Vec<String>,
    pub times: u32,
    /// Distance, in planes, to the next channel, slice and time.
    pub order: [usize; 3],
    /// The page of each plane.
    pub places: Vec<usize>,
    /// Values of a pixel.
    pub samples: u32,
    /// Remarks for the user: one sentence each.
    pub notes: Vec<String>,
}

impl Meaning {
    /// The meaning of pages that are all slices.
    pub fn stack(pages: usize, samples: u32) -> Meaning {
        Meaning {
            size: VoxelSize::UNKNOWN,
            slope: 1.0,
            intercept: 0.0,
            depth: pages,
            channels: samples,
            names: Vec::new(),
            times: 1,
            order: [0, 1, 0],
            places: (0..pages).collect(),
            samples,
            notes: Vec::new(),
        }
    }

    /// The same, but pages lie along these axes, each at most once, of so many pages, the outermost axis first.
    pub fn along(self, axes: &[(Axis, usize)]) -> Meaning {
        let length = |wanted: Axis| {
            let found = axes.iter().find(|(axis, _)| *axis == wanted);
            found.map_or(1, |(_, length)| *length)
        };
        let distance = |wanted: Axis| {
            let within = axes.iter().rev().take_while(|(axis, _)| *axis != wanted);
            within.map(|(_, length)| length).product()
        };
        Meaning {
            depth: length(Axis::Slice),
            channels: (length(Axis::Channel) as u32).saturating_mul(self.samples),
            times: length(Axis::Time) as u32,
            order: [Axis::Channel, Axis::Slice, Axis::Time].map(distance),
            ..self
        }
    }
}
