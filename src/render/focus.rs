//! How many paths each brick of the cache gets: most where their noise would be seen.
//!
//! A brick's light weighs w in a ray's colour; the noise of n paths adds w²/n to the variance of that
//! pixel. For a given number of paths in all, the picture's error is least with n in proportion to √Σw²
//! over its rays. `ray_march.comp` adds up Σw². No brick gets less than a sixteenth of what most get, so
//! that another view is soon as good. Shares are powers of ½, since paths leave a node evenly in powers
//! of two.

use glam::Vec3;

use super::gpu_scene::GpuScene;
use super::shared::BRICK;

/// log2 of the largest share to the smallest.
const MOST_HALVINGS: u8 = 4;

/// A picture has a ray on every so many pixels along both axes, at most, that none of the bricks slips
/// through between them; `None`: pixels are too few for that.
pub fn longest_stride(scene: &GpuScene) -> Option<u32> {
    let c = scene.constants();
    let length = |v: [f32; 3]| Vec3::from(v).length();
    let brick = (0..3)
        .map(|a| BRICK as f32 * c.cache_step[a] * c.spacing[a])
        .fold(f32::INFINITY, f32::min);
    let farthest = match scene.parts.view.is_orthographic {
        true => 1.0,
        false => length(c.eye) + length(c.half_extent),
    };
    let pixel = 2.0 * length(c.up) * farthest / c.size[1] as f32;
    Some((brick / pixel) as u32).filter(|&stride| stride > 0)
}

/// The share of paths that each brick gets, in the order of the bricks' places.
pub struct Focus {
    /// How often the full share is halved.
    pub(super) halvings: Vec<u8>,
    /// Paths that each of a brick's nodes has had.
    pub(super) had: Vec<u32>,
}

impl Focus {
    /// The same share for all bricks, none of which has had a path.
    pub fn everywhere(bricks: u32) -> Focus {
        Focus {
            halvings: vec![0; bricks as usize],
            had: vec![0; bricks as usize],
        }
    }

    /// Gives all bricks the same share from now on.
    pub fn widen(&mut self) {
        self.halvings.fill(0);
    }

    /// Whether filling a cache can lead to this state; a file may say anything.
    pub fn is_possible(&self) -> bool {
        self.halvings.iter().all(|&h| h <= MOST_HALVINGS)
    }

    /// `weights`: Σw² of each brick in the view at hand, in any unit.
    pub fn narrow(&mut self, weights: impl Iterator<Item = u32>) {
        let weights: Vec<f64> = weights.map(|w2| f64::from(w2).sqrt()).collect();
        let sum: f64 = weights.iter().sum();
        let squares: f64 = weights.iter().map(|w| w * w).sum();
        if sum == 0.0 {
            return self.widen();
        }
        // A hair less: where all weigh the same, rounding must not halve their share.
        let typical = 0.999 * squares / sum;
        for (halvings, weight) in self.halvings.iter_mut().zip(weights) {
            let wanted = (typical / weight).log2().ceil();
            *halvings = wanted.clamp(0.0, f64::from(MOST_HALVINGS)) as u8;
        }
    }

    /// For each brick, how many paths its nodes still lack where the full share is `goal`, and how many
    /// they have had.
    pub fn left(&self, goal: u32) -> impl Iterator<Item = [u32; 2]> {
        let left =
            move |(&halvings, &had): (&u8, &u32)| [share(goal, halvings).saturating_sub(had), had];
        self.halvings.iter().zip(&self.had).map(left)
    }

    /// Whether some brick lacks paths.
    pub fn lags(&self, goal: u32) -> bool {
        self.left(goal).any(|[samples, _]| samples > 0)
    }

    /// Notes that all bricks have had what they lacked.
    pub fn reach(&mut self, goal: u32) {
        for (&halvings, had) in self.halvings.iter().zip(&mut self.had) {
            *had = share(goal, halvings).max(*had);
        }
    }

    /// Paths that a node has had, on average.
    pub fn mean_paths(&self) -> f64 {
        let sum: f64 = self.had.iter().map(|&had| f64::from(had)).sum();
        sum / self.had.len().max(1) as f64
    }

    /// The mean share, up to 1.
    pub fn mean_share(&self) -> f64 {
        let shares = self.halvings.iter().map(|&h| 0.5f64.powi(i32::from(h)));
        shares.sum::<f64>() / self.halvings.len().max(1) as f64
    }
}

/// Paths of a brick whose share of `goal` has been halved so often: at least one, unless the goal is none.
fn share(goal: u32, halvings: u8) -> u32 {
    (goal >> halvings).max(goal.min(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fill(focus: &mut Focus, goal: u32) {
        focus.reach(goal);
        assert!(!focus.lags(goal));
    }

    #[test]
    fn without_a_view_all_bricks_get_the_same() {
        let mut focus = Focus::everywhere(3);
        for goal in [1, 2, 4, 6] {
            fill(&mut focus, goal);
            assert_eq!(focus.had, [goal; 3]);
        }
        assert_eq!(focus.mean_paths(), 6.0);
        assert_eq!(focus.mean_share(), 1.0);
    }

    #[test]
    fn what_is_seen_gets_more_and_nothing_gets_none() {
        let mut focus = Focus::everywhere(4);
        focus.narrow([10_000, 10_000, 625, 0].into_iter());
        fill(&mut focus, 1);
        assert_eq!(focus.had, [1; 4]);
        fill(&mut focus, 64);
        assert_eq!(focus.had, [64, 64, 16, 4]);
        assert_eq!(focus.mean_share(), (1.0 + 1.0 + 0.25 + 0.0625) / 4.0);
    }

    #[test]
    fn another_view_makes_up_for_what_it_lacks() {
        let mut focus = Focus::everywhere(2);
        focus.narrow([100, 0].into_iter());
        fill(&mut focus, 64);
        focus.narrow([0, 100].into_iter());
        assert!(focus.left(64).eq([[0, 64], [60, 4]]));
        fill(&mut focus, 64);
        focus.widen();
        assert!(!focus.lags(64));
    }

    #[test]
    fn a_view_of_nothing_prefers_nothing() {
        let mut focus = Focus::everywhere(2);
        focus.narrow([0, 0].into_iter());
        fill(&mut focus, 8);
        assert_eq!(focus.had, [8, 8]);
    }
}
