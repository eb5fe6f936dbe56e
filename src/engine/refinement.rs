//! The picture of a view that a cache shows at once, while samples refine it: a weighted mean of a march and of the
//! samples.
//!
//! A march has no noise, but errors of its own: steps, and light that is read from the cache as it is. Samples correct
//! these, and are noisy. The mean of both has the least error if each is weighed by the inverse of its squared error
//! (inverse-variance weighting), so a picture that is refined never becomes worse. The march then counts as a fixed
//! number of samples: those that have its error. What the cache itself has wrong is in both alike, and does not matter
//! here.

use crate::render::mean_square;

/// The march is left out once it counts for less than this.
const LEAST_SHARE: f64 = 1.0 / 32.0;

/// A march, and the samples of the same view as far as they have been compared with it. Pictures are RGB and coverage, row 0
/// on top.
pub struct Refinement {
    march: Vec<[f32; 4]>,
    /// Number of samples when they were last compared with the march, and their mean then.
    samples: u32,
    mean: Vec<[f32; 4]>,
    /// Mean square by which it had changed since the comparison before.
    change: Option<f64>,
    /// Number of samples for which the march counts.
    worth: f64,
}

impl Refinement {
    pub fn of(march: Vec<[f32; 4]>) -> Refinement {
        Refinement {
            march,
            samples: 0,
            mean: Vec::new(),
            change: None,
            worth: f64::INFINITY,
        }
    }

    /// Whether there are so many more samples that it is worth comparing them again.
    pub fn is_due(&self, samples: u32) -> bool {
        samples >= 2 * self.samples
    }

    /// Compares the march with `mean`, that of so many samples, if there are twice as many as the last time.
    pub fn compare(&mut self, samples: u32, mean: &[[f32; 4]]) {
        if !self.is_due(samples) {
            return;
        }
        if self.samples > 0 {
            let change = mean_square(&self.mean, mean);
            let noise = self.noise_after(change);
            // What the samples differ by from the march is their noise and the march's error.
            let error = mean_square(&self.march, mean) - noise;
            self.worth = if error > 0.0 {
                f64::from(samples) * noise / error
            } else {
                f64::INFINITY
            };
            self.change = Some(change);
        }
        self.samples = samples;
        self.mean = mean.to_vec();
    }

    /// The square of the noise of 2n samples, of which the second half has changed the mean by `change`, squared.
    ///
    /// If noise, squared, falls with the power p of the number of samples, so does the change with each doubling, and
    /// the noise that is left is change/(2ᵖ − 1): p is 1 for independent samples and up to 1.5 for evenly spread rays at
    /// edges (Mitchell, Consequences of Stratified Sampling in Graphics, 1996).
    fn noise_after(&self, change: f64) -> f64 {
        let falls_by = match self.change {
            Some(before) if change > 0.0 => before / change,
            _ => 2.0,
        };
        change / (falls_by.clamp(2.0, 1.5f64.exp2()) - 1.0)
    }

    /// The share that the march has in the picture after so many samples.
    fn share(&self, samples: u32) -> f64 {
        if self.worth.is_finite() {
            self.worth / (self.worth + f64::from(samples))
        } else {
            1.0
        }
    }

    /// Whether the march has so little a share after so many samples that it can be left out.
    pub fn is_over(&self, samples: u32) -> bool {
        self.share(samples) < LEAST_SHARE
    }

    /// What is left, in the picture after so many samples, of their standard error; all of it while the march alone is shown,
    /// whose error is not known yet.
    pub fn error_left(&self, samples: u32) -> f32 {
        match self.share(samples) {
            share if share < 1.0 && !self.is_over(samples) => (1.0 - share).sqrt() as f32,
            _ => 1.0,
        }
    }

    /// The picture after so many samples with this mean.
    pub fn picture(&self, samples: u32, mean: &[[f32; 4]]) -> Vec<[f32; 4]> {
        let share = if self.is_over(samples) {
            0.0
        } else {
            self.share(samples) as f32
        };
        let pixels = mean.iter().zip(&self.march);
        pixels
            .map(|(s, m)| std::array::from_fn(|c| s[c] + share * (m[c] - s[c])))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PIXELS: usize = 20_000;
    const TRUTH: f32 = 0.5;
    const NOISE: f32 = 0.2;

    /// Numbers of mean 0 and variance 1: a sum of uniform ones.
    struct Noise(u64);

    impl Noise {
        fn next(&mut self) -> f32 {
            let uniform = |state: &mut u64| {
                *state = state
                    .wrapping_mul(6364136223846793005)
                    .wrapping_add(1442695040888963407);
                (*state >> 40) as f32 / (1 << 24) as f32
            };
            (0..12).map(|_| uniform(&mut self.0)).sum::<f32>() - 6.0
        }
    }

    /// Means of 1, 2, 4 … samples.
    fn means(doublings: u32) -> Vec<Vec<[f32; 4]>> {
        let mut noise = Noise(1);
        let mut sum = vec![0.0; PIXELS];
        let mut taken = 0;
        (0..doublings)
            .map(|n| {
                while taken < 1 << n {
                    sum.iter_mut()
                        .for_each(|s| *s += TRUTH + NOISE * noise.next());
                    taken += 1;
                }
                sum.iter().map(|s| [s / taken as f32; 4]).collect()
            })
            .collect()
    }

    fn error(picture: &[[f32; 4]]) -> f64 {
        mean_square(picture, &vec![[TRUTH; 4]; PIXELS])
    }

    #[test]
    fn the_mean_of_march_and_samples_is_better_than_either_and_better_with_each_sample() {
        let mut noise = Noise(2);
        let march: Vec<_> = (0..PIXELS)
            .map(|_| [TRUTH + 0.05 * noise.next(); 4])
            .collect();
        let mut last = error(&march);
        let mut refinement = Refinement::of(march);
        for (n, mean) in means(8).iter().enumerate() {
            let samples = 1 << n;
            refinement.compare(samples, mean);
            let now = error(&refinement.picture(samples, mean));
            assert!(
                now <= last && now <= 1.01 * error(mean),
                "{samples}: {now} {last}"
            );
            last = now;
        }
        assert!(
            (refinement.worth / 16.0 - 1.0).abs() < 0.1,
            "{}",
            refinement.worth
        );
    }

    #[test]
    fn samples_without_noise_are_all_that_counts() {
        let mut refinement = Refinement::of(vec![[TRUTH + 0.01; 4]; PIXELS]);
        let exact = vec![[TRUTH; 4]; PIXELS];
        for samples in [1, 2, 4, 8] {
            refinement.compare(samples, &exact);
        }
        assert_eq!(refinement.picture(8, &exact), exact);
    }

    #[test]
    fn a_march_that_is_far_off_is_left_out_and_an_exact_one_is_kept() {
        let mut wrong = Refinement::of(vec![[0.0; 4]; PIXELS]);
        let mut exact = Refinement::of(vec![[TRUTH; 4]; PIXELS]);
        let means = means(7);
        for (n, mean) in means.iter().enumerate() {
            wrong.compare(1 << n, mean);
            exact.compare(1 << n, mean);
        }
        assert_eq!(wrong.picture(64, &means[6]), means[6]);
        assert!(error(&exact.picture(64, &means[6])) < 0.2 * error(&means[6]));
    }
}
