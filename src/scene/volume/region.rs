//! The voxels that are kept, as runs that are contiguous in the file.

use std::ops::Range;

use super::header::Parsed;

#[derive(Debug, Clone, Copy)]
pub(super) struct Region {
    whole: [u64; 3],
    low: [u64; 3],
    pub dims: [u32; 3],
}

impl Region {
    pub fn new(whole: [u32; 3], crop: Option<[[u32; 3]; 2]>) -> Parsed<Region> {
        let [low, high] = crop.unwrap_or([[0; 3], whole]);
        if (0..3).any(|a| low[a] >= high[a] || high[a] > whole[a]) {
            let [x, y, z] = whole;
            return Err(format!(
                "crop {low:?} to {high:?} is empty or leaves the volume: expected low < high ≤ \
                 {x}×{y}×{z}"
            ));
        }
        Ok(Region {
            whole: whole.map(u64::from),
            low: low.map(u64::from),
            dims: std::array::from_fn(|a| high[a] - low[a]),
        })
    }

    pub fn voxels(&self) -> usize {
        self.dims.iter().map(|size| *size as usize).product()
    }

    /// Those of its slices.
    pub fn slab(mut self, slices: Range<usize>) -> Region {
        let end = slices.end.min(self.dims[2] as usize);
        self.low[2] += slices.start as u64;
        self.dims[2] = (end - slices.start) as u32;
        self
    }

    /// Runs cut into pieces of at most `most` voxels: the first voxel, as the file counts them, and the
    /// length of each.
    pub fn pieces(self, most: usize) -> impl Iterator<Item = (u64, usize)> {
        let (length, starts) = self.runs();
        let cut = move |start| {
            let begins = (0..length).step_by(most);
            begins.map(move |begin| (start + begin, (length - begin).min(most as u64) as usize))
        };
        starts.flat_map(cut)
    }

    /// The length of each run and the first voxel of each.
    fn runs(self) -> (u64, impl Iterator<Item = u64>) {
        let [x, y, z] = self.dims.map(u64::from);
        let whole_rows = x == self.whole[0];
        let whole_slices = whole_rows && y == self.whole[1];
        let (length, rows, slices) = match (whole_rows, whole_slices) {
            (_, true) => (x * y * z, 1, 1),
            (true, _) => (x * y, 1, z),
            (false, _) => (x, y, z),
        };
        let first = move |j: u64, k: u64| {
            let row = (self.low[2] + k) * self.whole[1] + self.low[1] + j;
            row * self.whole[0] + self.low[0]
        };
        let starts = (0..slices).flat_map(move |k| (0..rows).map(move |j| first(j, k)));
        (length, starts)
    }
}
