//! The work of a batch: for each brick that gets paths, its nodes' paths in parts that slots trace side by side.
//!
//! Nodes differ: where much is seen they get sixteen times as many paths, and deep in the medium these are long. A slot
//! that traced all paths of such a node would still be at it when the others have long been done, and a GPU with it. So
//! a node's paths come in parts of about the same size. The sums of parts need memory until they are merged
//! (`merge_parts.rs`): the work is done in portions, as many parts at once as there is room for.

use super::focus::Lack;
use super::memory::CacheMemory;
use super::pace::history;
use super::work_memory::MOST_PARTS;
use crate::render::shared::{
    BOTH_HALVES, COARSE_NODES, FILLED_ALL, FILLED_COARSE, FILLED_FIRST, GATHERED, NODES, Turn,
};

/// Paths in a part, unless there would be more than the most parts.
const PATHS_A_PART: u32 = 8;

/// The work on a brick.
#[derive(Clone, Copy)]
struct Job {
    place: u32,
    /// Paths that each node gets, and those that it has had.
    paths: u32,
    had: u32,
    /// Whether the paths gather, and start from nodes of the coarse lattice alone.
    gathers: bool,
    is_coarse: bool,
}

#[derive(Default)]
pub struct WorkList {
    /// Those of bricks that are filled on the coarse lattice come first.
    jobs: Vec<Job>,
    /// Jobs whose turns have been handed out.
    done: usize,
}

/// The nodes that are under way (`gathering.glsl`).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Half {
    #[default]
    Even,
    Odd,
    /// All nodes at once: no node gathers, so none reads another's light.
    Both,
}

impl Half {
    /// As shaders take it.
    pub fn word(self) -> u32 {
        match self {
            Half::Even => 0,
            Half::Odd => 1,
            Half::Both => BOTH_HALVES,
        }
    }

    /// Those of a brick on the fine lattice.
    fn nodes_of_brick(self) -> u32 {
        match self {
            Half::Both => NODES,
            Half::Even | Half::Odd => NODES / 2,
        }
    }
}

/// Turns that are worked off together.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Portion {
    pub turns: u32,
    /// Those of the coarse lattice, which come first.
    pub coarse_turns: u32,
    pub half: Half,
}

impl WorkList {
    /// The work of a batch that gives the nodes of each brick what they lack. `order`: the places, those of bricks that lie
    /// close to one another one after another, since their paths read the same voxels.
    pub fn new(
        cache: &mut CacheMemory,
        order: &[u32],
        lacks: impl Iterator<Item = Lack>,
    ) -> WorkList {
        let (gathers, begins_coarse) = (cache.layout.gathers, cache.layout.begins_coarse());
        let lacks: Vec<Lack> = lacks.collect();
        let mut jobs = Vec::new();
        let bricks = cache.bricks_mut();
        for &place in order {
            let Lack { paths, had } = lacks[place as usize];
            let brick = &mut bricks[place as usize];
            let gathers = gathers && paths > 0 && had + paths <= GATHERED;
            let is_coarse = gathers && begins_coarse;
            brick.filled = match had {
                _ if is_coarse => FILLED_COARSE,
                0 => FILLED_FIRST,
                _ => FILLED_ALL,
            };
            if paths > 0 {
                jobs.push(Job {
                    place,
                    paths,
                    had,
                    gathers,
                    is_coarse,
                });
            }
        }
        jobs.sort_by_key(|job| !job.is_coarse);
        WorkList { jobs, done: 0 }
    }

    /// Whether paths gather, so that one half of the nodes has to wait for the other.
    pub fn gathers(&self) -> bool {
        self.jobs.iter().any(|job| job.gathers)
    }

    /// Begins with the work on the other half of the nodes, to which the coarse lattice does not belong.
    pub fn begin_other_half(&mut self) {
        self.done = self.jobs.partition_point(|job| job.is_coarse);
    }

    /// Writes the turns of the next portion for this half of the nodes. There are none once all has been done.
    pub fn next_portion(&mut self, cache: &mut CacheMemory, half: Half) -> Portion {
        let mut room = cache.work.most_items;
        let mut portion = Portion {
            half,
            ..Portion::default()
        };
        let mut turns = Vec::new();
        for job in &self.jobs[self.done..] {
            let parts = parts_of(job.paths);
            let nodes = if job.is_coarse {
                COARSE_NODES
            } else {
                half.nodes_of_brick()
            };
            if parts * nodes > room {
                break;
            }
            room -= parts * nodes;
            self.done += 1;
            portion.turns += parts;
            portion.coarse_turns += u32::from(job.is_coarse) * parts;
            turns.extend((0..parts).map(|part| Turn {
                place: job.place,
                part,
                parts,
                paths: job.paths,
                paths_before: job.had,
                history: history(job.had, cache.layout.gathers) as f32,
                gathers: job.gathers.into(),
            }));
        }
        cache.work.turns.write(&turns);
        portion
    }
}

/// In how many parts the paths of each of a brick's nodes come: none is empty.
fn parts_of(paths: u32) -> u32 {
    let parts = paths.div_ceil(PATHS_A_PART).min(MOST_PARTS);
    paths.div_ceil(paths.div_ceil(parts))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_neither_empty_nor_large() {
        for paths in (1..3000).chain([1 << 16, (1 << 20) + 1]) {
            let parts = parts_of(paths);
            // The rule of `begin_item` in `node_tracking.comp`.
            let most = paths.div_ceil(parts);
            assert!(
                (parts - 1) * most < paths && paths <= parts * most,
                "{paths}"
            );
            assert!(most <= PATHS_A_PART || parts > MOST_PARTS / 2, "{paths}");
            assert!(parts <= MOST_PARTS, "{paths}");
        }
    }
}
