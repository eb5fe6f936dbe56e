//! How many paths the nodes get in a batch, and how long that takes: batches in which nodes gather from each other
//! (`gathering.glsl`) are faster than those in which they trace whole paths.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::shared::GATHERED;

/// The totals of all batches of one kind.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Pace {
    updates: u32,
    took: Duration,
}

impl Pace {
    pub fn add(&mut self, updates: u32, took: Duration) {
        self.updates += updates;
        self.took += took;
    }

    /// Whether there was such a batch.
    pub fn is_known(&self) -> bool {
        self.updates > 0
    }

    /// Seconds for one path of each node; NaN unless that is known.
    pub fn seconds_per_update(&self) -> f64 {
        self.took.as_secs_f64() / f64::from(self.updates)
    }
}

/// The number of paths that doubles what nodes in sight have had, or as many as they may still gather.
pub fn doubling(updates: u32) -> u32 {
    match updates {
        0 => 1,
        1..GATHERED => updates.min(GATHERED - updates),
        _ => updates,
    }
}

/// Whether nodes in sight that have had `updates` paths gather in a batch of `samples`: the rule of `gathers` in
/// `glsl/include/gathering.glsl`, for predicting how long the batch takes.
pub fn gathers(updates: u32, samples: u32) -> bool {
    updates > 0 && updates + samples <= GATHERED
}

#[cfg(test)]
mod tests {
    use super::*;

    /// So that no batch is gathered in part.
    #[test]
    fn batches_meet_where_gathering_ends() {
        for first in [1, 3, 20, GATHERED] {
            let mut updates = first;
            while updates < GATHERED {
                updates += doubling(updates);
            }
            assert_eq!(updates, GATHERED);
            assert_eq!(doubling(updates), GATHERED);
        }
    }
}
