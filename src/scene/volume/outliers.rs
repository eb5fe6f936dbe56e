//! The range of values in which a volume's data lie, for presets: without voxels that stand alone far from all other values,
//! as hot pixels do, and without a value that stands for no data, such as −9999 or 1e20, if it is so far away that a single
//! bin of a histogram holds all data.

use std::ops::Range;

use super::Volume;
use super::histogram::Histogram;
use super::tally::Tally;
use crate::error::Result;
use crate::locked::locked;

const BINS: usize = 256;
/// Voxels stand alone if they are at most this share of all, and at most one in each macrocell that has any of them, on
/// average. A structure has more.
const ALONE: f64 = 1e-3;
/// Without them, the range is at most this share of what it was.
const FAR: f64 = 0.5;
/// Programs that mark what holds no data take −999 or a larger number for it. A smaller one is a background, or an object.
const LEAST_NONE: f64 = 998.0;
/// Outliers may hide others that are less far away.
const ROUNDS: usize = 8;

impl Volume {
    /// A histogram, with at most 256 bins, of the range in which the data lie; the first one is kept.
    ///
    /// # Errors
    ///
    /// The same as for [`Reader::read`](super::Reader::read).
    pub fn histogram_of_data(&self) -> Result<Histogram> {
        let mut known = locked(&self.statistics.of_data);
        match &*known {
            Some(known) => Ok(known.clone()),
            None => Ok(known.insert(self.find_data()?).clone()),
        }
    }

    fn find_data(&self) -> Result<Histogram> {
        let whole = self.histogram(BINS)?;
        if !self.may_have_outliers(&whole) {
            return Ok(whole);
        }
        let mut found = self.count(Within::new(whole.cleared()))?;
        for _ in 0..ROUNDS {
            let Some(data) = self.data_in(&found) else {
                break;
            };
            found = self.count(Within::new(self.bins_between(data, BINS)))?;
        }
        Ok(found.histogram)
    }

    /// Whether it is worth a scan of the voxels to know the smallest and largest value in each bin.
    fn may_have_outliers(&self, histogram: &Histogram) -> bool {
        self.not_alone(histogram).is_some() || is_split(&histogram.counts)
    }

    /// The range of the data, if there are outliers, and anything else.
    fn data_in(&self, found: &Within) -> Option<[f64; 2]> {
        let data = match self.not_alone(&found.histogram) {
            Some(bins) => found.range_of(bins),
            None if is_split(&found.histogram.counts) => found.range_beside_one_value(),
            None => None,
        };
        data.filter(|[low, high]| low < high)
    }

    /// The bins without those at one end whose voxels stand alone; `None` if there are no such voxels.
    fn not_alone(&self, histogram: &Histogram) -> Option<Range<usize>> {
        // There may be millions of macrocells, and few volumes have an end for which a walk through them is worth it.
        if !has_thin_end(&histogram.counts) {
            return None;
        }
        let mut ends = [(); 2].map(|()| Within::new(histogram.cleared()));
        for range in self.macrocell_ranges() {
            for (ends, stored) in ends.iter_mut().zip(range) {
                ends.add(self.value(f64::from(*stored)), 1);
            }
        }
        let [lows, highs] = ends.map(|ends| ends.histogram.counts);
        not_alone(&histogram.counts, &lows, &highs)
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
            if voxels > 0 && voxels <= cells {
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

/// Whether so few voxels that they may stand alone take so much of the range at one of its ends that they are far.
fn has_thin_end(counts: &[u64]) -> bool {
    let most = ALONE * counts.iter().sum::<u64>() as f64;
    let bins = (FAR * counts.len() as f64) as usize;
    let is_thin = |end: &[u64]| end.iter().sum::<u64>() as f64 <= most;
    is_thin(&counts[bins..]) || is_thin(&counts[..counts.len() - bins])
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

    /// The range of the values in the first bin or in the last, if those in the other one are all the same, and so large that
    /// they stand for no data.
    fn range_beside_one_value(&self) -> Option<[f64; 2]> {
        let [first, .., last] = self.ends[..] else {
            return None;
        };
        let magnitude = |[low, high]: [f64; 2]| low.abs().max(high.abs());
        let is_none = |one: [f64; 2], data: [f64; 2]| {
            one[0] == one[1] && one[0].abs() > magnitude(data).max(LEAST_NONE)
        };
        if is_none(first, last) {
            Some(last)
        } else {
            is_none(last, first).then_some(first)
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
        volume.histogram_of_data().expect("counted").otsu()
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

    /// A small bright structure is what the volume is about, however few voxels it has, and wherever it lies in macrocells.
    #[test]
    fn a_small_structure_counts() {
        for at in 16..24 {
            let is_vessel = |i: usize| i % SIDE == at && i / SIDE % SIDE == at;
            let found = thresholds(|i, v| {
                if is_vessel(i) {
                    *v = 50.0
                }
            });
            assert!(
                found.last().is_some_and(|&last| last > 2.0),
                "{at}: {found:?}"
            );
        }
    }

    /// A background of 0 is no outlier, nor is an object of one value before a background with hardly any noise.
    #[test]
    fn what_is_the_same_everywhere_is_no_outlier() {
        let noise = |i: usize| 1e-3 * (i % 7) as f32;
        let object = thresholds(|i, v| *v = if *v > 0.5 { 1.0 + noise(i) } else { 0.0 });
        let background = thresholds(|i, v| *v = if *v > 0.5 { 1.0 } else { 1e-3 * noise(i) });
        for found in [object, background] {
            assert!(
                found
                    .iter()
                    .any(|&threshold| (0.4..0.6).contains(&threshold)),
                "{found:?}"
            );
        }
    }

    #[test]
    fn two_values_are_no_outliers() {
        let found = thresholds(|_, v| *v = if *v > 0.5 { 1000.0 } else { 0.0 });
        assert!(found.len() == 1 && found[0] > 100.0, "{found:?}");
    }
}
