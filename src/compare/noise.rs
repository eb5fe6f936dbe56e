//! Whether two renders of one scene differ by more than their noise.
//!
//! The channels of a pixel share their paths, so their errors are taken as fully correlated;
//! pixels as independent.

use super::image::LinearImage;

/// Differences of means in units of their standard error.
pub(super) struct ZScores {
    /// Standard error of the difference of the means.
    pub stderr: Option<f64>,
    pub bias: Option<f64>,
    /// The largest magnitude over all whole tiles.
    pub tile_max: Option<f64>,
}

const TILE: usize = 16;
/// Below this variance, in squares of the picture's mean, a tile has no noise to measure by: nothing but rounding.
const NO_VARIANCE: f64 = 1e-12;

pub(super) fn z_scores(reference: &LinearImage, test: &LinearImage) -> ZScores {
    let (Some(reference_stderr), Some(test_stderr)) = (&reference.stderr, &test.stderr) else {
        return ZScores {
            stderr: None,
            bias: None,
            tile_max: None,
        };
    };
    // The difference at one pixel, and the variance of that difference.
    let pixel = |x: usize, y: usize| {
        let at = y * reference.width + x;
        Sum {
            difference: grey(test.rgb[at]) - grey(reference.rgb[at]),
            variance: grey(reference_stderr[at]).powi(2) + grey(test_stderr[at]).powi(2),
        }
    };
    let over = |x: usize, y: usize, width: usize, height: usize| {
        let pixels = (y..y + height).flat_map(|y| (x..x + width).map(move |x| (x, y)));
        pixels.fold(Sum::default(), |sum, (x, y)| sum.add(pixel(x, y)))
    };
    let mean = reference.rgb.iter().map(|rgb| grey(*rgb)).sum::<f64>() / reference.rgb.len() as f64;
    let least = NO_VARIANCE * mean.powi(2);
    let tiles = (0..reference.height / TILE)
        .flat_map(|y| (0..reference.width / TILE).map(move |x| (x * TILE, y * TILE)));
    let whole = over(0, 0, reference.width, reference.height);
    ZScores {
        stderr: Some(whole.variance.sqrt() / reference.rgb.len() as f64),
        bias: whole.z(least),
        tile_max: tiles
            .filter_map(|(x, y)| over(x, y, TILE, TILE).z(least))
            .map(f64::abs)
            .reduce(f64::max),
    }
}

#[derive(Default)]
struct Sum {
    difference: f64,
    variance: f64,
}

impl Sum {
    fn add(self, other: Sum) -> Sum {
        Sum {
            difference: self.difference + other.difference,
            variance: self.variance + other.variance,
        }
    }

    /// The difference in standard errors, unless its variance is at most `least`.
    fn z(&self, least: f64) -> Option<f64> {
        (self.variance > least).then(|| self.difference / self.variance.sqrt())
    }
}

fn grey(rgb: [f32; 3]) -> f64 {
    rgb.iter().map(|&v| f64::from(v)).sum::<f64>() / 3.0
}
