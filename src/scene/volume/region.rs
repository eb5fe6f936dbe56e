//! Boxes of voxels, the pieces into which they are cut, and the runs of a file in which they lie.

use super::parsed::{Fault, Keyed};

/// Voxels from one brick to the next along each axis, of those into which a volume is cut where it streams: on the GPU, and in
/// its store.
pub const BRICK_SIDE: u32 = 32;

/// The voxels from `low` up to, but not including, `low + dims` along x, y and z.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Region {
    pub low: [u32; 3],
    /// Voxels along each axis.
    pub dims: [u32; 3],
}

impl Region {
    /// All voxels of a volume.
    pub fn whole(dims: [u32; 3]) -> Region {
        Region { low: [0; 3], dims }
    }

    /// The voxels that a crop `[low, high)` leaves of a whole volume.
    pub(super) fn cropped(whole: [u32; 3], crop: Option<[[u32; 3]; 2]>) -> Keyed<Region> {
        let [low, high] = crop.unwrap_or([[0; 3], whole]);
        if (0..3).any(|a| low[a] >= high[a] || high[a] > whole[a]) {
            let [x, y, z] = whole;
            let problem = format!(
                "crop {low:?} to {high:?} is empty or leaves the volume: expected low < high ≤ \
                 {x}×{y}×{z}"
            );
            return Err(Fault::of("crop", problem));
        }
        Ok(Region {
            low,
            dims: std::array::from_fn(|a| high[a] - low[a]),
        })
    }

    pub fn voxels(&self) -> usize {
        self.dims.iter().map(|size| *size as usize).product()
    }

    pub(super) fn lies_within(&self, dims: [u32; 3]) -> bool {
        (0..3).all(|a| {
            let high = self.low[a].checked_add(self.dims[a]);
            self.dims[a] > 0 && high.is_some_and(|high| high <= dims[a])
        })
    }

    pub(super) fn lies_inside(&self, outer: &Region) -> bool {
        (0..3).all(|a| {
            let [end, outer_end] = [self, outer].map(|region| region.low[a] + region.dims[a]);
            self.low[a] >= outer.low[a] && end <= outer_end
        })
    }

    /// Boxes of at most `most` voxels (at least one) that cover this one: whole slices, or else whole
    /// rows of one slice, or else parts of one row. They come in x, y, z order, so that their voxels,
    /// one box after the other, are in the order of the whole.
    pub fn pieces(self, most: usize) -> impl Iterator<Item = Region> {
        let [width, height, depth] = self.dims.map(|size| size as usize);
        let step = [
            most.clamp(1, width),
            (most / width).clamp(1, height),
            (most / width / height).clamp(1, depth),
        ];
        let along = move |a: usize| (0..self.dims[a]).step_by(step[a]);
        let corners = along(2)
            .flat_map(move |z| along(1).flat_map(move |y| along(0).map(move |x| [x, y, z])));
        corners.map(move |corner| Region {
            low: std::array::from_fn(|a| self.low[a] + corner[a]),
            dims: std::array::from_fn(|a| (step[a] as u32).min(self.dims[a] - corner[a])),
        })
    }

    /// The box in a volume of `depth` slices whose order is reversed.
    pub(super) fn mirrored(mut self, depth: u32) -> Region {
        self.low[2] = depth - self.low[2] - self.dims[2];
        self
    }

    /// The box inside `outer` in the coordinates of the whole volume.
    pub(super) fn within(mut self, outer: &Region) -> Region {
        for (low, offset) in self.low.iter_mut().zip(outer.low) {
            *low += offset;
        }
        self
    }

    /// The box in the coordinates of `outer`, in which it lies.
    pub(super) fn outside(mut self, outer: &Region) -> Region {
        for (low, offset) in self.low.iter_mut().zip(outer.low) {
            *low -= offset;
        }
        self
    }

    /// The first voxel of each row in a volume of so many voxels along x and y, x fastest.
    pub(super) fn rows(self, [width, height, _]: [u32; 3]) -> impl Iterator<Item = usize> {
        let [i, j, k] = self.low.map(|low| low as usize);
        let [width, height] = [width as usize, height as usize];
        let first = move |row: usize, slice: usize| ((k + slice) * height + j + row) * width + i;
        let [_, y, z] = self.dims.map(|size| size as usize);
        (0..z).flat_map(move |slice| (0..y).map(move |row| first(row, slice)))
    }

    /// The runs of these voxels in a volume of `whole` voxels, x fastest: the first voxel and the length of each.
    pub(super) fn runs(self, whole: [u32; 3]) -> impl Iterator<Item = (u64, usize)> {
        let [x, y, z] = self.dims.map(|size| size as usize);
        let has_whole_rows = self.dims[0] == whole[0];
        let has_whole_slices = has_whole_rows && self.dims[1] == whole[1];
        let (length, rows, slices) = match (has_whole_rows, has_whole_slices) {
            (_, true) => (x * y * z, 1, 1),
            (true, _) => (x * y, 1, z),
            (false, _) => (x, y, z),
        };
        let [width, height, _] = whole.map(u64::from);
        let [i, j, k] = self.low.map(u64::from);
        let first = move |row: usize, slice: usize| {
            ((k + slice as u64) * height + j + row as u64) * width + i
        };
        let runs = (0..slices).flat_map(move |slice| (0..rows).map(move |row| first(row, slice)));
        runs.map(move |first| (first, length))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REGION: Region = Region {
        low: [3, 1, 2],
        dims: [5, 4, 3],
    };

    fn voxels(region: Region) -> Vec<[u32; 3]> {
        let [x, y, z] = region.dims;
        let all = (0..z).flat_map(|k| (0..y).flat_map(move |j| (0..x).map(move |i| [i, j, k])));
        all.map(|at| std::array::from_fn(|a| region.low[a] + at[a]))
            .collect()
    }

    #[test]
    fn pieces_are_the_whole_in_its_order() {
        for most in 0..=80 {
            let pieces: Vec<Region> = REGION.pieces(most).collect();
            assert!(pieces.iter().all(|piece| piece.voxels() <= most.max(1)));
            let joined: Vec<[u32; 3]> = pieces.into_iter().flat_map(voxels).collect();
            assert_eq!(joined, voxels(REGION), "{most}");
        }
    }

    #[test]
    fn runs_are_where_the_voxels_are() {
        for whole in [[9, 8, 7], [8, 5, 5], [5, 8, 5], [5, 4, 3]] {
            let low = std::array::from_fn(|a| REGION.low[a].min(whole[a] - REGION.dims[a]));
            let region = Region { low, ..REGION };
            let runs = region.runs(whole);
            let found = runs.flat_map(|(first, length)| first..first + length as u64);
            let place = |[x, y, z]: [u32; 3]| u64::from((z * whole[1] + y) * whole[0] + x);
            let expected: Vec<u64> = voxels(region).into_iter().map(place).collect();
            assert_eq!(found.collect::<Vec<_>>(), expected, "{whole:?}");
        }
    }
}
