//! Figures of a recurring event, in memory that does not grow.

use std::collections::VecDeque;

use crate::engine::figures::quantile;

/// How many of the last values count for quantiles.
const REMEMBERED: usize = 512;
/// How many of them count for the mean.
const AVERAGED: usize = 16;

#[derive(Default)]
pub struct Recent {
    last: VecDeque<f64>,
    pub count: usize,
    pub total: f64,
    /// The highest value; `None` before the first one.
    pub highest: Option<f64>,
}

impl Recent {
    pub fn add(&mut self, value: f64) {
        if self.last.len() == REMEMBERED {
            self.last.pop_front();
        }
        self.last.push_back(value);
        self.count += 1;
        self.total += value;
        self.highest = Some(self.highest.map_or(value, |highest| highest.max(value)));
    }

    /// The mean of the last [`AVERAGED`] values; 0 before the first one.
    pub fn mean(&self) -> f64 {
        let last = self.last.iter().rev().take(AVERAGED);
        last.clone().sum::<f64>() / last.len().max(1) as f64
    }

    /// A quantile of the last values; NaN where there are none.
    pub fn quantile(&self, fraction: f64) -> f64 {
        let mut sorted: Vec<f64> = self.last.iter().copied().collect();
        sorted.sort_by(f64::total_cmp);
        quantile(&sorted, fraction)
    }
}
