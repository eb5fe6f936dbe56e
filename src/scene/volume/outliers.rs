//! The range of values in which a volume's data lie, for presets: without voxels that stand alone far from all other values,
//! as hot pixels do, and without a value that stands for no data, such as −9999 or 1e20. Either would leave hardly any bins
//! of a histogram to the rest.

use std::ops::Range;

use super::Volume;
use super::histogram::Histogram;
use super::statistics::Tally;
use crate::error::Result;

/// At most this share of all voxels stands alone.
const ALONE: f64 = 1e-3;
/// They are at most so many for each macrocell that holds one. A structure fills macrocells.
const ALONE_IN_MACROCELL: u64 = 2;
/// Without them, the range is at most this share of what it was.
const FAR: f64 = 0.5;
/// Outliers may hide others that are less far away.
const ROUNDS: usize = 8;

impl Volume {
    /// A histogram, with at most `most_bins` bins, of the range in which the data lie.
    ///
    /// # Errors
    ///
    /// The same as for [`Reader::read`](super::Reader::read).
    pub fn histogram_of_data(&self, most_bins: usize) -> Result<Histogram> {
        let mut histogram = self.histogram(most_bins)?;
        for _ in 0..ROUNDS {
            let Some(data) = self.data_in(&histogram)? else {
                break;
            };
            let empty = Within::new(self.bins_between(data, most_bins));
            histogram = self.count(empty)?.histogram;
        }
        Ok(histogram)
    }

    /// The range of the data, if there are outliers in the histogram, and anything else.
    fn data_in(&self, histogram: &Histogram) -> Result<Option<[f64; 2]>> {
        let mut ends = [(); 2].map(|()| Within::new(histogram.cleared()));
        for range in self.macrocell_ranges() {
            for (ends, stored) in ends.iter_mut().zip(range) {
                ends.add(self.value(f64::from(*stored)), 1);
            }
        }
        let [lows, highs] = ends.map(|ends| ends.histogram.counts);
        let kept = not_alone(&histogram.counts, &lows, &highs);
        if kept.is_none() && !is_split(&histogram.counts) {
            return Ok(None);
        }
        let exact = self.count(Within::new(histogram.cleared()))?;
        let data = match kept {
            Some(bins) => exact.range_of(bins),
            None => exact.range_beside_one_value(),
        };
        Ok(data.filter(|[low, high]| low < high))
    }

    fn count(&self, empty: Within) -> Result<Within> {
        self.statistics
            .count(empty, &self.grid, |stored| self.value(stored))
    }
}

/// The bins without those at one end whose voxels stand alone; `None` if there are no such voxels. `lows` and `highs` are
/// the numbers of macrocells with their smallest and largest value in each bin.
fn not_alone(counts: &[u64], lows: &[u64], highs: &[u64]) -> Option<Range<usize>> {
    let all: u64 = counts.iter().sum();
    let bins = counts.len();
    // How many bins at an end hold voxels that stand alone, and what is empty before the next ones.
    let at_end = |bin: &dyn Fn(usize) -> usize, macrocells: &[u64]| {
        let (mut voxels, mut cells, mut alone) = (0, 0, None);
        for n in 0..bins {
            voxels += counts[bin(n)];
            cells += macrocells[bin(n)];
            if voxels as f64 > ALONE * all as f64 {
                break;
            }
            if voxels > 0 && voxels <= ALONE_IN_MACROCELL * cells {
                alone = Some(n + 1);
            }
        }
        let empty = |from: &usize| (*from..bins).take_while(|&n| counts[bin(n)] == 0).count();
        let without = alone.map(|from| from + empty(&from))?;
        ((bins - without) as f64 <= FAR * bins as f64).then_some(without)
    };
    let above = at_end(&|n| bins - 1 - n, highs).map(|without| 0..bins - without);
    above.or_else(|| at_end(&|n| n, lows).map(|without| without..bins))
}

/// Whether only the first and the last bin are occupied.
fn is_split(counts: &[u64]) -> bool {
    matches!(counts, [_, between @ .., _] if between.iter().all(|&count| count == 0))
}

/// A histogram in which values outside its range do not count, and the smallest and largest value in each bin.
#[derive(Debug, Clone)]
struct Within {
    histogram: Histogram,
    ends: Vec<[f64; 2]>,
}

impl Within {
    /// `histogram` has no counts.
    fn new(histogram: Histogram) -> Within {
        let ends = vec![[f64::INFINITY, f64::NEG_INFINITY]; histogram.counts.len()];
        Within { histogram, ends }
    }

    fn range_of(&self, bins: Range<usize>) -> Option<[f64; 2]> {
        self.ends[bins].iter().copied().reduce(hull)
    }

    /// The range of the values at one end, if those at the other are all the same.
    fn range_beside_one_value(&self) -> Option<[f64; 2]> {
        let [first, .., last] = self.ends[..] else {
            return None;
        };
        match [first, last].map(|[low, high]| low == high) {
            [true, false] => Some(last),
            [false, true] => Some(first),
            _ => None,
        }
    }
}

impl Tally for Within {
    fn add(&mut self, value: f64, count: u64) {
        if let Some(bin) = self.histogram.bin(value) {
            self.histogram.counts[bin] += count;
            self.ends[bin] = hull(self.ends[bin], [value; 2]);
        }
    }

    fn add_all(&mut self, other: &Within) {
        self.histogram.add_all(&other.histogram);
        for (ends, others) in self.ends.iter_mut().zip(&other.ends) {
            *ends = hull(*ends, *others);
        }
    }
}

fn hull(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::volume::Voxels;

    const SIDE: usize = 40;

    /// A ball whose values fall from 1 in its middle to 0, with noise, and what `edit` makes of its voxels.
    fn thresholds(edit: impl Fn(usize, &mut f32)) -> Vec<f64> {
        let value = |i: usize| {
            let at = [i % SIDE, i / SIDE % SIDE, i / (SIDE * SIDE)].map(|n| n as f32 - 19.5);
            let distance = at.iter().map(|x| x * x).sum::<f32>().sqrt();
            let noise = (i.wrapping_mul(0x9E37_79B1) >> 8 & 0xFF) as f32 / 255.0;
            (1.3 - distance / 12.0).clamp(0.0, 1.0) + 0.02 * noise
        };
        let mut values: Vec<f32> = (0..SIDE.pow(3)).map(value).collect();
        values.iter_mut().enumerate().for_each(|(i, v)| edit(i, v));
        let dims = [SIDE as u32; 3];
        let volume = Volume::from_values(dims, [1.0; 3], Voxels::F32(values)).expect("a volume");
        volume.histogram_of_data(256).expect("counted").otsu(4)
    }

    fn assert_close(found: &[f64], expected: &[f64]) {
        let close = |(a, b): (&f64, &f64)| (a - b).abs() < 0.05;
        let alike = found.len() == expected.len() && found.iter().zip(expected).all(close);
        assert!(alike, "{found:?}, expected {expected:?}");
    }

    #[test]
    fn hot_pixels_do_not_move_thresholds() {
        let clean = thresholds(|_, _| {});
        for outlier in [1000.0, -9999.0, 1e20, -1e20] {
            let found = thresholds(|i, v| {
                if i == 1641 {
                    *v = outlier
                }
            });
            assert_close(&found, &clean);
        }
        let many = |i: usize, v: &mut f32| {
            if i % 2003 == 5 {
                *v = (i % 977) as f32
            }
        };
        assert_close(&thresholds(many), &clean);
    }

    #[test]
    fn a_value_for_no_data_does_not_count() {
        let is_outside = |i: usize| {
            let at = [i % SIDE, i / SIDE % SIDE, i / (SIDE * SIDE)].map(|n| n as f32 - 19.5);
            at.iter().map(|x| x * x).sum::<f32>() > 18.0 * 18.0
        };
        let inside = thresholds(|i, v| {
            if is_outside(i) {
                *v = 0.0
            }
        });
        for value in [-9999.0, 1e20] {
            let found = thresholds(|i, v| {
                if is_outside(i) {
                    *v = value
                }
            });
            assert_close(&found, &inside);
        }
    }

    /// A small bright structure is what the volume is about, however few voxels it has.
    #[test]
    fn a_small_structure_counts() {
        let is_vessel = |i: usize| i % SIDE == 20 && (i / SIDE % SIDE).abs_diff(20) < 2;
        let found = thresholds(|i, v| {
            if is_vessel(i) {
                *v = 50.0
            }
        });
        assert!(found.last().is_some_and(|&last| last > 2.0), "{found:?}");
    }

    #[test]
    fn two_values_are_no_outliers() {
        let found = thresholds(|_, v| *v = if *v > 0.5 { 1000.0 } else { 0.0 });
        assert!(found.len() == 1 && found[0] > 100.0, "{found:?}");
    }
}
