//! How much two ways of rendering a picture differ, without the noise of either.
//!
//! Each has rendered it twice, with other random numbers: R and R′, T and T′. Errors of different runs are
//! independent, so the mean over pixels of (T − R)(T′ − R′) is, on average, the mean square of what the expected
//! pictures differ by; and so is that of (T − R′)(T′ − R). Both are taken, of display values.

use serde::Serialize;

use super::display;
use super::image::LinearImage;
use super::line;
use crate::error::Result;

/// Similarity without noise, in dB like PSNR; infinite (null in JSON) where no difference could be measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WithoutNoise {
    /// PSNR of the expected pictures, in dB.
    pub psnr_without_noise: f64,
    /// The PSNR if the mean square were larger by two of its standard errors.
    pub psnr_at_least: f64,
}

/// A standard error is that of the mean over so many tiles along each side: pixels share the noise of a cache
/// with their neighbours.
const TILES: usize = 12;

/// `references` and `tests` are pictures of the same two scenes, each twice.
pub fn without_noise(
    references: [&LinearImage; 2],
    tests: [&LinearImage; 2],
    exposure: f64,
) -> Result<WithoutNoise> {
    let [reference, again] = references;
    for other in [again, tests[0], tests[1]] {
        reference.check_comparable(other)?;
    }
    let [r, s] = references.map(|image| display::planes(image, exposure));
    let [t, u] = tests.map(|image| display::planes(image, exposure));
    let (width, height) = (reference.width, reference.height);
    let mut tiles = vec![0.0; TILES * TILES];
    for channel in 0..3 {
        let [r, s, t, u] = [&r, &s, &t, &u].map(|planes| &planes[channel].values);
        for at in 0..width * height {
            let both = (t[at] - r[at]) * (u[at] - s[at]) + (t[at] - s[at]) * (u[at] - r[at]);
            let (x, y) = (at % width * TILES / width, at / width * TILES / height);
            tiles[y * TILES + x] += 0.5 * both;
        }
    }
    let values = (3 * width * height) as f64;
    let square = tiles.iter().sum::<f64>() / values;
    Ok(WithoutNoise {
        psnr_without_noise: decibels(square),
        psnr_at_least: decibels(square.max(0.0) + 2.0 * standard_error(&tiles) / values),
    })
}

/// The standard error of the sum.
fn standard_error(tiles: &[f64]) -> f64 {
    let count = tiles.len() as f64;
    let mean = tiles.iter().sum::<f64>() / count;
    let squares = tiles.iter().map(|sum| (sum - mean).powi(2));
    (squares.sum::<f64>() * count / (count - 1.0)).sqrt()
}

fn decibels(square: f64) -> f64 {
    if square > 0.0 {
        -10.0 * square.log10()
    } else {
        f64::INFINITY
    }
}

impl WithoutNoise {
    /// One figure a line, with what it means.
    pub(super) fn table(&self) -> String {
        let rows = [
            (
                "psnr_without_noise",
                Some(self.psnr_without_noise),
                "dB, of the expected pictures",
            ),
            (
                "psnr_at_least",
                Some(self.psnr_at_least),
                "the same, two standard errors lower",
            ),
        ];
        rows.map(line).concat()
    }
}
