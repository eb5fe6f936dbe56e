//! The sums behind a picture, with which another renderer can continue it.

use std::sync::Arc;

use rayon::prelude::*;

use super::halves::Halves;

/// The sums of a picture after its last complete unit, in the GPU's own precision; row 0 on top.
#[derive(Debug, Clone, PartialEq)]
pub struct Sums {
    /// RGB and coverage.
    pub mean: Vec<[f32; 4]>,
    /// Weighted sum over units of squared differences from the mean.
    pub squares: Vec<[f32; 4]>,
    /// What is known of how evenly marched samples are spread; `None` where samples are paths, or too few.
    pub halves: Option<Arc<Halves>>,
}

impl Sums {
    /// Standard error of each pixel's mean after `samples` samples in `units` units; infinite while there is a single
    /// unit. `cache_error` is the relative error of the picture that the cache shows, which all samples share; 0
    /// without a cache. Where it is infinite, so are the errors of all pixels that show anything but background.
    pub fn standard_error(&self, samples: u32, units: u32, cache_error: f64) -> Vec<[f32; 3]> {
        let shared = self.shared_error(cache_error);
        let ratio = |pixel: usize| {
            self.halves
                .as_ref()
                .map_or(1.0, |halves| halves.variance_ratio[pixel])
        };
        let variance = variance(&self.squares, samples, units);
        let pixels = variance.into_par_iter().zip(&self.mean).enumerate();
        let stderr = pixels.map(|(pixel, (variance, m))| {
            std::array::from_fn(|c| match ratio(pixel) * variance[c] {
                own if m[3] == 0.0 => own.sqrt(),
                _ if shared.is_infinite() => f32::INFINITY,
                own => (own + (shared * m[c] * m[3]).powi(2)).sqrt(),
            })
        });
        stderr.collect()
    }

    /// The cache's own error as a share of each pixel's coverage: scaled so that its rms over the picture equals the
    /// measured error.
    fn shared_error(&self, cache_error: f64) -> f32 {
        if cache_error == 0.0 {
            return 0.0;
        }
        let mean = &self.mean;
        let covered = mean.iter().flat_map(|m| [0, 1, 2].map(|c| m[c] * m[3]));
        let squares: f64 = covered.map(|x| f64::from(x).powi(2)).sum();
        let rgb = mean.iter().flat_map(|m| [m[0], m[1], m[2]]);
        let brightness: f64 = rgb.map(f64::from).sum();
        let count = 3.0 * mean.len() as f64;
        let rms = (squares / count).sqrt();
        if rms > 0.0 {
            (cache_error * brightness / count / rms) as f32
        } else {
            0.0
        }
    }
}

/// Variance of each pixel's mean after `samples` samples in `units` independent units that spread by `squares`; infinite
/// while there is a single unit.
pub fn variance(squares: &[[f32; 4]], samples: u32, units: u32) -> Vec<[f32; 3]> {
    let divisor = units.saturating_sub(1) as f32 * samples as f32;
    let of = |square: f32| match units {
        0 | 1 => f32::INFINITY,
        _ => (square / divisor).max(0.0),
    };
    let pixels = squares.par_iter();
    pixels.map(|&[r, g, b, _]| [r, g, b].map(of)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_error_of_the_cache_is_infinite_in_each_channel() {
        let sums = Sums {
            mean: vec![[1.0, 0.0, 0.0, 1.0], [0.5, 0.5, 0.5, 0.0]],
            squares: vec![[0.0; 4]; 2],
            halves: None,
        };
        let errors = sums.standard_error(2, 2, f64::INFINITY);
        assert_eq!(errors, [[f32::INFINITY; 3], [0.0; 3]]);
    }

    /// Four units of two samples whose means in red are 1, 2, 3 and 6: they differ from their mean 3 by squares of 14, each
    /// of which counts for two samples. The mean's variance is that of a unit's mean, 14 / 3, divided by four units.
    #[test]
    fn the_variance_of_a_mean_is_that_of_its_units_by_their_number() {
        let squares = [[2.0 * 14.0, 6.0, 0.0, 9.0]];
        let [[red, green, blue]] = variance(&squares, 8, 4).try_into().expect("a pixel");
        assert!((red - 14.0 / 3.0 / 4.0).abs() < 1e-6, "{red}");
        assert_eq!([green, blue], [0.25, 0.0]);
        assert_eq!(variance(&squares, 2, 1), [[f32::INFINITY; 3]]);
    }
}
