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
    /// How it had changed since the comparison before.
    change: Option<Change>,
    /// Number of samples for which the march counts.
    worth: f64,
}

/// How the mean of samples has changed while their number grew.
#[derive(Clone, Copy)]
struct Change {
    /// How many times as many samples there are as before.
    growth: f64,
    /// Mean square of the difference.
    square: f64,
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
            let change = Change {
                growth: f64::from(samples) / f64::from(self.samples),
                square: mean_square(&self.mean, mean),
            };
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

    /// The square of the noise that the samples have after such a change of their mean.
    ///
    /// If noise, squared, falls with the power p of the number of samples, so does the change whenever that number grows by the
    /// same factor, and the noise that is left is change/(growthᵖ − 1): p is 1 for independent samples and up to 1.5 for evenly
    /// spread rays at edges (Mitchell, Consequences of Stratified Sampling in Graphics, 1996).
    fn noise_after(&self, change: Change) -> f64 {
        let falls_by = match self.change {
            Some(before) if before.growth == change.growth && change.square > 0.0 => {
                before.square / change.square
            }
            _ => change.growth,
        };
        let least = change.growth;
        change.square / (falls_by.clamp(least, least.powf(1.5)) - 1.0)
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

    /// A number of mean 0 and variance 1: a sum of uniform ones.
    fn normal(rng: &mut fastrand::Rng) -> f32 {
        (0..12).map(|_| rng.f32()).sum::<f32>() - 6.0
    }

    /// Means of so many samples, more from one to the next.
    fn means_of(numbers: &[u32]) -> Vec<Vec<[f32; 4]>> {
        let mut rng = fastrand::Rng::with_seed(1);
        let mut sum = vec![0.0; PIXELS];
        let mut taken = 0;
        let mean_of = |&number: &u32| {
            while taken < number {
                sum.iter_mut()
                    .for_each(|s| *s += TRUTH + NOISE * normal(&mut rng));
                taken += 1;
            }
            sum.iter().map(|s| [s / taken as f32; 4]).collect()
        };
        numbers.iter().map(mean_of).collect()
    }

    /// Means of 1, 2, 4 … samples.
    fn means(doublings: u32) -> Vec<Vec<[f32; 4]>> {
        means_of(&(0..doublings).map(|n| 1 << n).collect::<Vec<_>>())
    }

    fn march_with_error(error: f32) -> Vec<[f32; 4]> {
        let mut rng = fastrand::Rng::with_seed(1 << 40);
        (0..PIXELS)
            .map(|_| [TRUTH + error * normal(&mut rng); 4])
            .collect()
    }

    fn error(picture: &[[f32; 4]]) -> f64 {
        mean_square(picture, &vec![[TRUTH; 4]; PIXELS])
    }

    #[test]
    fn the_mean_of_march_and_samples_is_better_than_either_and_better_with_each_sample() {
        let march = march_with_error(0.05);
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

    /// Where the volume streams, the number of samples grows in larger steps at first.
    #[test]
    fn a_march_counts_for_as_many_samples_however_their_number_grows() {
        let numbers = [1, 4, 16, 32, 128];
        let mut refinement = Refinement::of(march_with_error(0.05));
        for (samples, mean) in numbers.iter().zip(means_of(&numbers)) {
            refinement.compare(*samples, &mean);
            // Where samples are much noisier than the march, their noise hides its error.
            let worth = refinement.worth;
            assert!(
                *samples < 16 || (worth / 16.0 - 1.0).abs() < 0.1,
                "{samples}: {worth}"
            );
        }
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
