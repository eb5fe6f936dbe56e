//! A histogram of values, from which presets take their thresholds, and which `info` prints.

use super::tally::Tally;

/// Bins of equal width from the smallest to the largest value.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// The first bin's low edge.
    pub low: f64,
    /// The width of a bin, > 0.
    pub width: f64,
    pub counts: Vec<u64>,
}

impl Histogram {
    /// A histogram without counts.
    pub(super) fn empty(low: f64, width: f64, bins: usize) -> Histogram {
        let counts = vec![0; bins];
        Histogram { low, width, counts }
    }

    /// The same bins without counts.
    pub(super) fn cleared(&self) -> Histogram {
        Histogram::empty(self.low, self.width, self.counts.len())
    }

    pub(super) fn has_the_bins_of(&self, other: &Histogram) -> bool {
        let bins = |h: &Histogram| (h.low, h.width, h.counts.len());
        bins(self) == bins(other)
    }

    /// The bin of a value; `None` outside the range.
    pub(super) fn bin(&self, value: f64) -> Option<usize> {
        let place = (value - self.low) / self.width;
        let bins = self.counts.len();
        // The largest value may be rounded up to the last bin's end.
        (0.0..bins as f64 * (1.0 + 1e-9))
            .contains(&place)
            .then(|| (place as usize).min(bins - 1))
    }

    /// From the first bin's low edge to the last one's high edge.
    pub fn range(&self) -> [f64; 2] {
        [self.low, self.low + self.counts.len() as f64 * self.width]
    }

    /// The value in the middle of a bin.
    pub fn value(&self, bin: usize) -> f64 {
        self.low + (bin as f64 + 0.5) * self.width
    }

    /// The values that split the bins into four classes with the least variance inside each (Otsu 1979). A bin counts
    /// with the square root of its voxels: most volumes are mostly empty, and the empty voxels would draw every
    /// threshold to themselves. If fewer than four bins are occupied, there are as many classes as occupied bins.
    pub fn otsu(&self) -> Vec<f64> {
        const CLASSES: usize = 4;
        let occupied: Vec<usize> = (0..self.counts.len())
            .filter(|&bin| self.counts[bin] > 0)
            .collect();
        let sums = Sums::over(self, &occupied);
        let n = occupied.len();
        // The score of the first j bins in the best split so far, and where its last class begins.
        let mut best: Vec<f64> = (0..=n).map(|j| sums.score(0, j)).collect();
        let mut begins: Vec<Vec<usize>> = Vec::new();
        for split in 1..CLASSES.min(n) {
            let last_class = |j| {
                let scored = (split..j).map(|i| (best[i] + sums.score(i, j), i));
                let highest = scored.max_by(|a, b| a.0.total_cmp(&b.0));
                highest.unwrap_or((f64::NEG_INFINITY, 0))
            };
            let (scores, begin) = (0..=n).map(last_class).unzip();
            best = scores;
            begins.push(begin);
        }
        let mut end = n;
        let mut thresholds = Vec::new();
        for begin in begins.iter().rev() {
            end = begin[end];
            thresholds.push(0.5 * (self.value(occupied[end - 1]) + self.value(occupied[end])));
        }
        thresholds.reverse();
        thresholds
    }
}

impl Tally for Histogram {
    /// Counts a value outside the range in the bin next to it.
    fn add(&mut self, value: f64, count: u64) {
        let bin = ((value - self.low) / self.width) as usize;
        let last = self.counts.len() - 1;
        self.counts[bin.min(last)] += count;
    }

    fn add_all(&mut self, other: &Histogram) {
        for (sum, count) in self.counts.iter_mut().zip(&other.counts) {
            *sum += count;
        }
    }
}

/// Running sums of weights and of weighted values over the occupied bins.
struct Sums {
    weight: Vec<f64>,
    moment: Vec<f64>,
}

impl Sums {
    fn over(histogram: &Histogram, occupied: &[usize]) -> Sums {
        let (mut weight, mut moment) = (vec![0.0], vec![0.0]);
        for (i, &bin) in occupied.iter().enumerate() {
            let vote = (histogram.counts[bin] as f64).sqrt();
            weight.push(weight[i] + vote);
            moment.push(moment[i] + vote * (bin as f64 + 0.5));
        }
        Sums { weight, moment }
    }

    /// The contribution of the class of bins `low..high` to the variance between classes, up to a constant: the sum
    /// is largest where the variance inside is least.
    fn score(&self, low: usize, high: usize) -> f64 {
        let weight = self.weight[high] - self.weight[low];
        let moment = self.moment[high] - self.moment[low];
        if high > low {
            moment * moment / weight
        } else {
            0.0
        }
    }
}
