//! How many paths the nodes get in a batch, and how long that takes: batches in which nodes gather from each other
//! (`gathering.glsl`) are faster than those of traced paths.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::render::shared::{GATHERED, GATHERED_FOR_ONE};

/// The totals of all batches of one kind.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pace {
    paths: u64,
    took: Duration,
}

impl Pace {
    pub const NONE: Pace = Pace {
        paths: 0,
        took: Duration::ZERO,
    };

    pub fn add(&mut self, paths: u64, took: Duration) {
        self.paths += paths;
        self.took += took;
    }

    /// Whether there was such a batch.
    pub fn is_known(&self) -> bool {
        self.paths > 0
    }

    /// NaN unless that is known.
    pub fn seconds_per_path(&self) -> f64 {
        self.took.as_secs_f64() / self.paths as f64
    }
}

/// The number of paths that nodes in sight get in the next batch. While nodes gather: as many as they have had, but no more
/// than are left to gather. Then: as many as their paths are equivalent to.
pub fn next_batch_size(updates: u32) -> u32 {
    match updates {
        0 => 4,
        1..GATHERED => updates.min(GATHERED - updates),
        _ => equivalent_paths(updates) as u32,
    }
}

/// The equivalent paths of nodes that have had `updates`, where nodes gather if `gathers`.
pub fn history(updates: u32, gathers: bool) -> f64 {
    if gathers {
        equivalent_paths(updates)
    } else {
        f64::from(updates)
    }
}

/// The paths of nodes that have had `updates`, as the number of paths traced to their ends that tell as much.
pub fn equivalent_paths(updates: u32) -> f64 {
    let gathered = updates.min(GATHERED);
    f64::from(updates - gathered) + f64::from(gathered) / f64::from(GATHERED_FOR_ONE)
}

/// Whether nodes in sight that have had `updates` paths gather in a batch of `paths`, for predicting how long it takes:
/// the very first find hardly any light to gather.
pub fn batch_gathers(updates: u32, paths: u32) -> bool {
    updates > 0 && updates + paths <= GATHERED
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
                updates += next_batch_size(updates);
            }
            assert_eq!(updates, GATHERED);
            assert_eq!(next_batch_size(updates), GATHERED / GATHERED_FOR_ONE);
            assert_eq!(
                equivalent_paths(updates + next_batch_size(updates)),
                2.0 * equivalent_paths(updates)
            );
        }
    }
}
