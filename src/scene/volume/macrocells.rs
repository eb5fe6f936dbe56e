//! The smallest and largest stored value in each macrocell, from which majorants are made, and which tells where
//! there is anything to see.
//!
//! They are found while a volume is opened, piece by piece and in the order of the source, since they have to be
//! known before anything is on the GPU.

use std::ops::Range;

use super::region::Region;
use super::stored::Stored;

/// Trilinear cells along the side of a macrocell. Cell 0 is the outer half voxel at the low end of
/// an axis: cell n interpolates voxels n − 1 and n.
pub const MACROCELL: u32 = 8;

const SIZE: usize = MACROCELL as usize;
const EMPTY: [f32; 2] = [f32::INFINITY, f32::NEG_INFINITY];

/// Macrocells of a source, as far as its voxels have been seen.
///
/// Where the volume has the source's slices in reverse, macrocells are nevertheless those of the volume; here they
/// are numbered in the order of the source. A macrocell then begins at another voxel, according to `lead`.
pub(super) struct Macrocells {
    dims: [u32; 3],
    is_mirrored: bool,
    /// Macrocell m of an axis needs the voxels from 8·m − `lead` to 8·m − `lead` + 8.
    lead: [usize; 3],
    /// Layer by layer along z, x fastest. They grow with the voxels that arrive: a header alone may
    /// promise any number of them.
    layers: Vec<Vec<[f32; 2]>>,
}

/// The macrocells that a box of voxels contributes to.
pub(super) struct Part {
    low: [usize; 3],
    dims: [usize; 3],
    ranges: Vec<[f32; 2]>,
}

impl Macrocells {
    pub fn new(dims: [u32; 3], is_mirrored: bool) -> Macrocells {
        let lead = if is_mirrored {
            SIZE - dims[2] as usize % SIZE
        } else {
            1
        };
        Macrocells {
            dims,
            is_mirrored,
            lead: [1, 1, lead],
            layers: Vec::new(),
        }
    }

    /// The ranges of the `values` of a region. One that is not finite counts as −∞.
    pub fn part<T: Stored>(&self, region: Region, values: &[T]) -> Part {
        let touched: [Range<usize>; 3] = std::array::from_fn(|a| self.touched(region, a));
        let [width, height, _] = region.dims.map(|size| size as usize);
        let mut ranges = Vec::with_capacity(touched.iter().map(Range::len).product());
        let mut columns = Columns::default();
        for layer in touched[2].clone() {
            for row in touched[1].clone() {
                let inside = self.voxels(region, 2, layer).flat_map(|k| {
                    let rows = self.voxels(region, 1, row);
                    rows.map(move |j| k * height + j)
                });
                columns.fold(inside.map(|row| &values[row * width..][..width]));
                let of_columns = |column| columns.range(self.voxels(region, 0, column));
                ranges.extend(touched[0].clone().map(of_columns));
            }
        }
        Part {
            low: touched.each_ref().map(|range| range.start),
            dims: touched.map(|range| range.len()),
            ranges,
        }
    }

    pub fn add(&mut self, part: &Part) {
        let across = self.dims[0] as usize / SIZE + 1;
        for (n, found) in part.ranges.chunks_exact(part.dims[0]).enumerate() {
            let layer = part.low[2] + n / part.dims[1];
            let row = part.low[1] + n % part.dims[1];
            let begin = row * across + part.low[0];
            if self.layers.len() <= layer {
                self.layers.resize(layer + 1, Vec::new());
            }
            let layer = &mut self.layers[layer];
            if layer.len() < begin + found.len() {
                layer.resize(begin + found.len(), EMPTY);
            }
            for (range, found) in layer[begin..].iter_mut().zip(found) {
                *range = [range[0].min(found[0]), range[1].max(found[1])];
            }
        }
    }

    /// The ranges of all macrocells, x fastest.
    pub fn finish(mut self) -> Vec<[f32; 2]> {
        if self.is_mirrored {
            self.layers.reverse();
        }
        self.layers.concat()
    }

    /// The macrocells along axis `a` that need any voxel of the region.
    fn touched(&self, region: Region, a: usize) -> Range<usize> {
        let low = region.low[a] as usize + self.lead[a];
        let high = low + region.dims[a] as usize;
        (low - 1) / SIZE..(high - 1) / SIZE + 1
    }

    /// The voxels that macrocell m of axis `a` needs, in the region's coordinates and as far as they are in it.
    fn voxels(&self, region: Region, a: usize, m: usize) -> Range<usize> {
        let low = region.low[a] as usize + self.lead[a];
        let begin = (m * SIZE).saturating_sub(low);
        let end = (m * SIZE + SIZE + 1).saturating_sub(low);
        begin..end.min(region.dims[a] as usize)
    }
}

/// The ranges in columns of voxels. Rows are folded into one before macrocells are told apart: this is most of the
/// work, and a processor does it for many values at a time.
struct Columns<T> {
    low: Vec<T>,
    high: Vec<T>,
}

impl<T> Default for Columns<T> {
    fn default() -> Self {
        Columns {
            low: Vec::new(),
            high: Vec::new(),
        }
    }
}

impl<T: Stored> Columns<T> {
    /// Folds new rows; earlier ones are forgotten.
    fn fold<'a>(&mut self, mut rows: impl Iterator<Item = &'a [T]>)
    where
        T: 'a,
    {
        self.low.clear();
        let first = rows.next().unwrap_or_default().iter();
        self.low.extend(first.map(|value| value.or_lowest()));
        self.high.clone_from(&self.low);
        for row in rows {
            for ((low, high), value) in self.low.iter_mut().zip(&mut self.high).zip(row) {
                let value = value.or_lowest();
                *low = lesser(*low, value);
                *high = greater(*high, value);
            }
        }
    }

    fn range(&self, columns: Range<usize>) -> [f32; 2] {
        let (low, high) = (&self.low[columns.clone()], &self.high[columns]);
        let low = low.iter().copied().fold(low[0], lesser);
        let high = high.iter().copied().fold(high[0], greater);
        [low.into(), high.into()]
    }
}

fn lesser<T: PartialOrd>(a: T, b: T) -> T {
    if b < a { b } else { a }
}

fn greater<T: PartialOrd>(a: T, b: T) -> T {
    if b > a { b } else { a }
}
