//! How many paths each brick of the cache gets: most where their noise would be seen.
//!
//! A brick's light weighs w in a ray's colour; the noise of n paths adds w²/n to the variance of that
//! pixel. For a given number of paths in all, the picture's error is least with n in proportion to √Σw²
//! over its rays. `ray_march.comp` adds up Σw². No brick in sight gets less than a sixteenth of what most get, so
//! that another view is soon as good. Shares are powers of ½, since paths leave a node evenly in powers
//! of two.
//!
//! Often most bricks are out of sight: behind surfaces, or deep in the medium. They get no path, unless the camera is about
//! to move. A path that comes to such a brick finds no light that it may read there, and goes on (`cache.glsl`).

use glam::Vec3;

use crate::render::gpu_scene::GpuScene;
use crate::render::layout::CacheLayout;
use crate::render::shared::{BRICK, COARSE_NODES, GATHERED, NODES};

/// log2 of the largest share to the smallest of bricks in sight.
const MOST_HALVINGS: u8 = 4;
/// An upper bound of a node's paths; twice the number still fits into 32 bits.
const MOST_UPDATES: u32 = 1 << 30;

/// The largest distance between rays, in pixels along both axes, at which no brick fits unseen between four of them; `None`
/// where a brick may be narrower than a pixel.
pub fn longest_stride(scene: &GpuScene) -> Option<u32> {
    let c = scene.constants();
    let length = |v: [f32; 3]| Vec3::from(v).length();
    let brick = (0..3)
        .map(|a| BRICK as f32 * c.cache_step[a] * c.spacing[a])
        .fold(f32::INFINITY, f32::min);
    let farthest = if scene.parts.view.is_orthographic {
        1.0
    } else {
        length(c.start) + c.start_distance + length(c.half_extent)
    };
    let pixel = 2.0 * length(c.up) * farthest / c.size[1] as f32;
    Some((brick / pixel) as u32).filter(|&stride| stride > 0)
}

/// The share of paths that a brick gets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Share {
    /// The full share, halved so often.
    Halved(u8),
    /// None, or one path (`Focus::all_from`).
    OutOfSight,
}

impl Share {
    const FULL: Share = Share::Halved(0);

    /// As a file holds it.
    pub fn byte(self) -> u8 {
        match self {
            Share::Halved(times) => times,
            Share::OutOfSight => u8::MAX,
        }
    }

    /// The share that a file holds as this byte; `None` if there is none such.
    fn of_byte(byte: u8) -> Option<Share> {
        match byte {
            0..=MOST_HALVINGS => Some(Share::Halved(byte)),
            u8::MAX => Some(Share::OutOfSight),
            _ => None,
        }
    }
}

/// What each of a brick's nodes lacks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lack {
    /// Paths that it gets next.
    pub paths: u32,
    /// Paths that it has had.
    pub had: u32,
}

/// The share of paths that each brick gets, in the order of the bricks' places.
pub struct Focus {
    pub(super) shares: Vec<Share>,
    /// Paths that each of a brick's nodes has had.
    pub(super) had: Vec<u32>,
    /// Once the goal of nodes with the full share is this many paths, nodes out of sight get one path each; `None`: never.
    pub(super) all_from: Option<u32>,
    /// Nodes of a brick that get the first paths.
    first_nodes: u32,
}

impl Focus {
    /// The same share for all bricks of a cache, none of which has had a path.
    pub fn everywhere(layout: &CacheLayout) -> Focus {
        let first_nodes = if layout.begins_coarse() {
            COARSE_NODES
        } else {
            NODES
        };
        Focus::of(layout.active.len(), first_nodes)
    }

    fn of(bricks: usize, first_nodes: u32) -> Focus {
        Focus {
            shares: vec![Share::FULL; bricks],
            had: vec![0; bricks],
            all_from: None,
            first_nodes,
        }
    }

    /// This focus with the shares and the numbers of paths that a file holds; `None` if filling a cache with `updates` paths
    /// cannot lead to them.
    pub fn restored(self, shares: &[u8], had: Vec<u32>, updates: u32) -> Option<Focus> {
        let is_possible = updates <= MOST_UPDATES && had.iter().all(|&had| had <= updates);
        let shares = shares.iter().map(|&byte| Share::of_byte(byte));
        let shares = shares.collect::<Option<_>>()?;
        is_possible.then_some(Focus {
            shares,
            had,
            ..self
        })
    }

    /// Gives all bricks the same share from now on.
    pub fn share_evenly(&mut self) {
        self.shares.fill(Share::FULL);
    }

    /// Sets the shares for a view. `weights`: Σw² of each brick, in any unit. `in_sight`: bricks that may be read; they
    /// include bricks of weight 0 that a ray between the measured ones might read.
    pub fn share_by_weight(&mut self, weights: impl Iterator<Item = u32>, in_sight: &[bool]) {
        let weights: Vec<f64> = weights.map(|w2| f64::from(w2).sqrt()).collect();
        let sum: f64 = weights.iter().sum();
        let squares: f64 = weights.iter().map(|w| w * w).sum();
        if sum == 0.0 {
            return self.share_evenly();
        }
        // A thousandth less: where all bricks weigh the same, rounding must not halve their share.
        let typical = 0.999 * squares / sum;
        for ((share, weight), in_sight) in self.shares.iter_mut().zip(weights).zip(in_sight) {
            let wanted = (typical / weight).log2().ceil();
            *share = if *in_sight {
                Share::Halved(wanted.clamp(0.0, f64::from(MOST_HALVINGS)) as u8)
            } else {
                Share::OutOfSight
            };
        }
    }

    /// What each brick's nodes lack where the full share is `goal`. But no batch goes past `GATHERED`, so that none is gathered
    /// in part.
    pub fn lacks(&self, goal: u32) -> impl Iterator<Item = Lack> {
        let lack = move |(&share, &had): (&Share, &u32)| {
            let paths = match self.paths_in(share, goal) {
                paths if had < GATHERED => paths.min(GATHERED),
                paths => paths,
            };
            Lack {
                paths: paths.saturating_sub(had),
                had,
            }
        };
        self.shares.iter().zip(&self.had).map(lack)
    }

    /// Paths of a node whose brick has this share, where the full share is `goal`: in sight at least one, unless the goal is
    /// none.
    fn paths_in(&self, share: Share, goal: u32) -> u32 {
        match share {
            Share::Halved(times) => (goal >> times).max(goal.min(1)),
            Share::OutOfSight => u32::from(self.all_from.is_some_and(|first| goal >= first)),
        }
    }

    /// Paths that all nodes get together in the next batch, where the full share is `goal`.
    pub fn paths_to(&self, goal: u32) -> u64 {
        self.lacks(goal)
            .map(|Lack { paths, had }| self.paths_of(had + paths) - self.paths_of(had))
            .sum()
    }

    /// Paths that all nodes get together in all batches until the full share is `goal`.
    pub fn paths_in_batches_to(&self, goal: u32) -> u64 {
        let left = |(&share, &had): (&Share, &u32)| {
            self.paths_of(self.paths_in(share, goal).max(had)) - self.paths_of(had)
        };
        self.shares.iter().zip(&self.had).map(left).sum()
    }

    /// Paths that all nodes have had.
    pub fn paths(&self) -> u64 {
        self.had.iter().map(|&had| self.paths_of(had)).sum()
    }

    /// Whether some brick lacks paths.
    pub fn lags(&self, goal: u32) -> bool {
        self.lacks(goal).any(|lack| lack.paths > 0)
    }

    /// Notes that all bricks have had their batch.
    pub fn reach(&mut self, goal: u32) {
        self.had = self.lacks(goal).map(|lack| lack.had + lack.paths).collect();
    }

    /// Paths of all nodes of a brick together, once each node that gets paths has had `had`: the first `GATHERED` start from
    /// `first_nodes` nodes only, the later ones from all.
    fn paths_of(&self, had: u32) -> u64 {
        let [young, old] = [had.min(GATHERED), had.saturating_sub(GATHERED)].map(u64::from);
        young * u64::from(self.first_nodes) + old * u64::from(NODES)
    }

    /// Paths that a node that gets any has had, on average over the bricks.
    pub fn mean_paths(&self) -> f64 {
        let sum: u64 = self.had.iter().map(|&had| u64::from(had)).sum();
        sum as f64 / self.had.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fill(focus: &mut Focus, goal: u32) {
        while focus.lags(goal) {
            focus.reach(goal);
        }
    }

    #[test]
    fn without_a_view_all_bricks_get_the_same() {
        let mut focus = Focus::of(3, COARSE_NODES);
        for goal in [1, 2, 4, 6] {
            fill(&mut focus, goal);
            assert_eq!(focus.had, [goal; 3]);
        }
        assert_eq!(focus.mean_paths(), 6.0);
    }

    #[test]
    fn what_is_seen_gets_more_and_nothing_in_sight_gets_none() {
        let mut focus = Focus::of(4, COARSE_NODES);
        focus.share_by_weight([10_000, 10_000, 625, 0].into_iter(), &[true; 4]);
        fill(&mut focus, 1);
        assert_eq!(focus.had, [1; 4]);
        fill(&mut focus, 64);
        assert_eq!(focus.had, [64, 64, 16, 4]);
    }

    #[test]
    fn the_coarse_lattice_gets_an_eighth_of_the_paths() {
        for (first_nodes, first) in [(COARSE_NODES, 8), (NODES, 64)] {
            let mut focus = Focus::of(2, first_nodes);
            assert_eq!(focus.paths_to(4), 2 * 4 * first);
            assert_eq!(
                focus.paths_in_batches_to(GATHERED + 1),
                2 * (32 * first + 64)
            );
            fill(&mut focus, 4);
            assert_eq!(focus.paths(), 2 * 4 * first);
        }
    }

    #[test]
    fn another_view_makes_up_for_what_it_lacks() {
        let mut focus = Focus::of(2, COARSE_NODES);
        focus.share_by_weight([100, 0].into_iter(), &[true; 2]);
        fill(&mut focus, 64);
        focus.share_by_weight([0, 100].into_iter(), &[true; 2]);
        let lack = |paths, had| Lack { paths, had };
        assert!(focus.lacks(64).eq([lack(0, 64), lack(28, 4)]));
        focus.reach(64);
        assert!(focus.lacks(64).eq([lack(0, 64), lack(32, 32)]));
        fill(&mut focus, 64);
        focus.share_evenly();
        assert!(!focus.lags(64));
    }

    #[test]
    fn what_is_out_of_sight_gets_paths_only_where_the_camera_is_about_to_move() {
        for (all_from, had) in [(None, [0, 0]), (Some(1), [1, 1]), (Some(2), [0, 1])] {
            let mut focus = Focus::of(2, COARSE_NODES);
            focus.all_from = all_from;
            focus.share_by_weight([100, 0].into_iter(), &[true, false]);
            fill(&mut focus, 1);
            assert_eq!(focus.had, [1, had[0]]);
            fill(&mut focus, 64);
            assert_eq!(focus.had, [64, had[1]]);
            assert_eq!(focus.paths_to(128), 64 * 64);
        }
    }

    #[test]
    fn a_view_of_nothing_prefers_nothing() {
        let mut focus = Focus::of(2, COARSE_NODES);
        focus.share_by_weight([0, 0].into_iter(), &[true; 2]);
        fill(&mut focus, 8);
        assert_eq!(focus.had, [8, 8]);
    }

    #[test]
    fn a_file_holds_what_was_there_or_is_refused() {
        let mut focus = Focus::of(3, COARSE_NODES);
        focus.share_by_weight([100, 1, 0].into_iter(), &[true, true, false]);
        fill(&mut focus, 8);
        let bytes: Vec<u8> = focus.shares.iter().map(|share| share.byte()).collect();
        assert_eq!(bytes, [0, 4, 255]);
        let restored = |bytes: &[u8], updates| {
            Focus::of(3, COARSE_NODES).restored(bytes, focus.had.clone(), updates)
        };
        let same = restored(&bytes, 8).expect("a focus");
        assert_eq!(
            (same.shares, same.had),
            (focus.shares.clone(), focus.had.clone())
        );
        assert!(restored(&[0, 5, 255], 8).is_none());
        assert!(restored(&bytes, 7).is_none());
        assert!(restored(&bytes, MOST_UPDATES + 1).is_none());
    }
}
