//! How often each value occurs: what presets take their thresholds from, and what `info` prints.

use std::sync::PoisonError;

use bytemuck::cast_slice_mut;
use rayon::prelude::*;

use super::settle::shares;
use super::{StoredType, Volume};
use crate::error::Result;

/// Bytes of a piece of the walk through floats.
const PIECE: u64 = 8 << 20;

/// Bins of equal width from the smallest to the largest value.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// The first bin's low edge.
    pub low: f64,
    /// > 0.
    pub width: f64,
    pub counts: Vec<u64>,
}

impl Histogram {
    /// Integer data whose values fit get one bin a value, so that no value is split between two.
    /// Integers were counted when the volume was opened; floats are counted now, which takes a walk
    /// through the voxels.
    ///
    /// # Errors
    ///
    /// The voxels cannot be read any more.
    pub fn of(volume: &Volume, max_bins: usize) -> Result<Histogram> {
        let [low, high] = volume.range;
        let steps = (high - low) / volume.scale;
        let is_counted = volume.stored != StoredType::F32;
        let mut histogram = if high <= low {
            Histogram::empty(low - 0.5, 1.0, 1)
        } else if is_counted && steps < max_bins as f64 {
            let half = 0.5 * volume.scale;
            Histogram::empty(low - half, volume.scale, steps.round() as usize + 1)
        } else {
            Histogram::empty(low, (high - low) / max_bins as f64, max_bins)
        };
        if !is_counted {
            return histogram.of_floats(volume);
        }
        let counts = volume.statistics.counts.iter().enumerate();
        for (stored, &count) in counts.filter(|(_, count)| **count > 0) {
            let bin = histogram.bin(volume.offset + volume.scale * stored as f64);
            histogram.counts[bin] += count;
        }
        Ok(histogram)
    }

    fn empty(low: f64, width: f64, bins: usize) -> Histogram {
        let counts = vec![0; bins];
        Histogram { low, width, counts }
    }

    /// Fills an empty one, or takes the one that was filled the same way before.
    fn of_floats(self, volume: &Volume) -> Result<Histogram> {
        let last = &volume.statistics.histogram;
        let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
        let bins = |h: &Histogram| (h.low, h.width, h.counts.len());
        if let Some(known) = last.as_ref().filter(|known| bins(known) == bins(&self)) {
            return Ok(known.clone());
        }
        let filled = self.walked(volume)?;
        *last = Some(filled.clone());
        Ok(filled)
    }

    fn walked(mut self, volume: &Volume) -> Result<Histogram> {
        let mut reader = volume.reader();
        let mut stored: Vec<f32> = Vec::new();
        for piece in volume.pieces(PIECE) {
            stored.resize(piece.voxels(), 0.0);
            reader.read(piece, cast_slice_mut(&mut stored))?;
            let counted = shares(piece, &stored).into_par_iter().map(|(_, share)| {
                let mut counts = vec![0; self.counts.len()];
                for &s in share {
                    counts[self.bin(volume.offset + volume.scale * f64::from(s))] += 1;
                }
                counts
            });
            for counts in counted.collect::<Vec<Vec<u64>>>() {
                for (sum, count) in self.counts.iter_mut().zip(counts) {
                    *sum += count;
                }
            }
        }
        Ok(self)
    }

    fn bin(&self, value: f64) -> usize {
        let bin = ((value - self.low) / self.width) as usize;
        bin.min(self.counts.len() - 1)
    }

    /// The value in the middle of a bin.
    pub fn value(&self, bin: usize) -> f64 {
        self.low + (bin as f64 + 0.5) * self.width
    }

    /// The values that split the bins into `classes` with the least variance inside each (Otsu
    /// 1979). A bin counts with the square root of its voxels: most volumes are mostly empty, and
    /// emptiness would draw every threshold to itself. Fewer than `classes` occupied bins: as many
    /// classes as there are.
    pub fn otsu(&self, classes: usize) -> Vec<f64> {
        let occupied: Vec<usize> = (0..self.counts.len())
            .filter(|&bin| self.counts[bin] > 0)
            .collect();
        let sums = Sums::over(self, &occupied);
        let n = occupied.len();
        // The score of the first j bins in the best split so far, and where its last class begins.
        let mut best: Vec<f64> = (0..=n).map(|j| sums.score(0, j)).collect();
        let mut begins: Vec<Vec<usize>> = Vec::new();
        for split in 1..classes.min(n) {
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

    /// What the class of bins `low..high` adds to the variance between classes, up to a constant:
    /// the sum is largest where the variance inside is least.
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
