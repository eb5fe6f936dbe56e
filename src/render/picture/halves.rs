//! How much smaller the variance of the mean of marched samples is than their spread says.
//!
//! A pixel's samples are low-discrepancy points (glsl/include/random.glsl), so their mean has less variance than that of
//! independent ones: a quarter, say, after 64 samples of a picture whose noise is at edges. The spread between single
//! samples, which is all that a march records for a pixel, does not show that. The two halves of 2ⁿ samples show most of
//! it, since each half is such a point set itself. If their means A and B were independent with variance V, the mean (A +
//! B)/2 would have the variance V/2. That is also the expectation of ((A − B)/2)², the square of the change that the second
//! half makes to the mean. In fact the halves complement each other, so the true variance is somewhat smaller ("The error
//! that is reported" in tools/measurements/cache.md).
//!
//! One pixel's halves say little. So the variance that remains, as a share of that of independent samples, is estimated
//! over all pixels in a square around a pixel; within the square it is divided as the spread between samples is.

use rayon::prelude::*;

/// Pixels from the middle of that square to its sides.
const RADIUS: usize = 8;
/// Weight, in pixels, of the assumption that samples are independent: a few pixels may agree by chance.
const INDEPENDENT: f64 = 4.0;

/// What is known of how evenly a picture's samples are spread.
#[derive(Debug, Clone, PartialEq)]
pub struct Halves {
    /// Number of samples when this was last looked at.
    pub samples: u32,
    /// RGB and coverage of the picture then: the first half of one with twice as many samples.
    pub mean: Vec<[f32; 4]>,
    /// For each pixel, the variance of the mean as a share of that of independent samples; 1 while it is unknown.
    pub variance_ratio: Vec<f32>,
}

impl Halves {
    /// The least number of samples that is looked at: those from which on an error is trusted.
    pub const LEAST: u32 = 16;

    /// The first half of samples of which nothing is known yet.
    pub fn first(samples: u32, mean: Vec<[f32; 4]>) -> Halves {
        Halves {
            samples,
            variance_ratio: vec![1.0; mean.len()],
            mean,
        }
    }

    /// What twice as many samples show. `variance` is what the mean of as many independent ones would have.
    pub fn doubled(&self, mean: Vec<[f32; 4]>, variance: &[[f32; 3]], width: usize) -> Halves {
        let rgb_sum = |of: &dyn Fn(usize) -> f32| (0..3).map(|c| f64::from(of(c))).sum::<f64>();
        let changes = self.mean.iter().zip(&mean);
        let changes = changes.map(|(before, now)| rgb_sum(&|c| (now[c] - before[c]).powi(2)));
        let expected = variance.iter().map(|v| rgb_sum(&|c| v[c]));
        let [changes, expected] = [changes.collect(), expected.collect()]
            .map(|values: Vec<f64>| around_each(&values, width));
        let sides = [width, self.mean.len() / width.max(1)];
        let pixels: usize = sides.map(|n| n.clamp(1, 2 * RADIUS + 1)).iter().product();
        let unknown = INDEPENDENT / pixels as f64;
        let shares = changes.iter().zip(&expected);
        let variance_ratio = shares.map(|(change, expected)| {
            if *expected > 0.0 {
                ((change / expected + unknown) / (1.0 + unknown)) as f32
            } else {
                1.0
            }
        });
        Halves {
            samples: 2 * self.samples,
            variance_ratio: variance_ratio.collect(),
            mean,
        }
    }

    /// Of all samples of two pictures that have `samples` and `more` of them, whose mean is `mean`: as if the pictures were
    /// independent.
    pub fn joined(&self, samples: f64, other: &Halves, more: f64, mean: Vec<[f32; 4]>) -> Halves {
        let all = samples + more;
        let variance_ratio = self.variance_ratio.iter().zip(&other.variance_ratio);
        let variance_ratio = variance_ratio
            .map(|(&a, &b)| ((f64::from(a) * samples + f64::from(b) * more) / all) as f32);
        Halves {
            samples: all as u32,
            variance_ratio: variance_ratio.collect(),
            mean,
        }
    }
}

/// Sums over the squares around all pixels.
fn around_each(values: &[f64], width: usize) -> Vec<f64> {
    let height = values.len() / width.max(1);
    across_and_turned(&across_and_turned(values, width), height)
}

/// Sums over neighbours in the same row, column by column.
fn across_and_turned(values: &[f64], width: usize) -> Vec<f64> {
    let columns = (0..width).into_par_iter();
    let sums = columns.flat_map_iter(|x| {
        let (from, to) = (x.saturating_sub(RADIUS), (x + RADIUS + 1).min(width));
        let rows = values.chunks(width);
        rows.map(move |row| row[from..to].iter().sum())
    });
    sums.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [96, 64];
    const PIXELS: usize = SIZE[0] * SIZE[1];

    #[test]
    fn sums_are_those_of_the_squares_around_pixels() {
        let [width, height] = [20, 30];
        let values: Vec<f64> = (0..width * height).map(|i| (i * i % 17) as f64).collect();
        let sums = around_each(&values, width);
        for (x, y) in [(0, 0), (3, 29), (10, 15), (19, 8)] {
            let near = |i: usize, at: usize| i.abs_diff(at) <= RADIUS;
            let inside = (0..width * height).filter(|i| near(i % width, x) && near(i / width, y));
            let expected: f64 = inside.map(|i| values[i]).sum();
            assert_eq!(sums[y * width + x], expected, "{x}, {y}");
        }
    }

    /// On the left samples are independent; on the right their means have half of the noise that their spread shows.
    #[test]
    fn the_variance_ratio_is_estimated_locally() {
        let mut random = fastrand::Rng::with_seed(1);
        let mut means = |samples: usize| -> Vec<[f32; 4]> {
            let is_even = |pixel: usize| pixel % SIZE[0] >= SIZE[0] / 2;
            let mean = |pixel: usize| {
                let mut noise = || random.f32() + random.f32() + random.f32() - 1.5;
                let sum: f32 = (0..samples)
                    .map(|_| {
                        if is_even(pixel) {
                            0.5 * noise()
                        } else {
                            noise()
                        }
                    })
                    .sum();
                [sum / samples as f32; 4]
            };
            (0..PIXELS).map(mean).collect()
        };
        let (first, second) = (means(16), means(16));
        let whole = first.iter().zip(&second);
        let whole = whole
            .map(|(a, b)| std::array::from_fn(|c| 0.5 * (a[c] + b[c])))
            .collect();
        // The spread between single samples is the same everywhere: each has a variance of 1/4.
        let variance = vec![[0.25 / 32.0; 3]; PIXELS];
        let halves = Halves::first(16, first).doubled(whole, &variance, SIZE[0]);
        assert_eq!(halves.samples, 32);
        for (x, expected) in [(16, 1.0), (80, 0.25)] {
            let rows = (RADIUS..SIZE[1]).step_by(2 * RADIUS);
            let found = rows
                .clone()
                .map(|y| halves.variance_ratio[y * SIZE[0] + x])
                .sum::<f32>();
            let found = found / rows.count() as f32;
            assert!(
                (found / expected - 1.0).abs() < 0.2,
                "{found} for {expected}"
            );
        }
    }

    #[test]
    fn a_single_pixel_says_next_to_nothing() {
        let same = || vec![[0.5; 4]];
        let halves = Halves::first(16, same()).doubled(same(), &[[0.1; 3]], 1);
        assert!(
            (0.75..1.0).contains(&halves.variance_ratio[0]),
            "{:?}",
            halves.variance_ratio
        );
    }

    #[test]
    fn without_noise_nothing_is_known() {
        let black = || vec![[0.0; 4]; PIXELS];
        let halves = Halves::first(16, black()).doubled(black(), &[[0.0; 3]; PIXELS], SIZE[0]);
        assert!(halves.variance_ratio.iter().all(|&ratio| ratio == 1.0));
    }
}
