//! The sampling table of an environment image: a lattice of cells in azimuth and polar angle, picked
//! by Walker's alias method (Vose 1991).
//!
//! A cell's weight is the integral of the *filtered* image over it, not the texel's own value, so
//! that the pdf is positive wherever bilinear interpolation carries light. Large images share
//! cells between texels: the table then stays in a GPU's cache.

use crate::render::shared::EnvironmentEntry;
use crate::scene::EnvironmentImage;

const MOST_CELLS: [u32; 2] = [1024, 512];

#[derive(Debug)]
pub struct EnvironmentTable {
    /// Cells along azimuth and polar angle.
    pub cells: [u32; 2],
    pub entries: Vec<EnvironmentEntry>,
}

pub fn build(image: &EnvironmentImage) -> EnvironmentTable {
    let cells = [
        image.width.min(MOST_CELLS[0]),
        image.height.min(MOST_CELLS[1]),
    ];
    let weights = weights(image, cells);
    let total: f64 = weights.iter().sum();
    // A black image still needs a valid distribution.
    let probabilities: Vec<f64> = if total > 0.0 {
        weights.iter().map(|w| w / total).collect()
    } else {
        vec![1.0 / weights.len() as f64; weights.len()]
    };
    let (thresholds, alias) = alias_method(&probabilities);
    let entries = (0..probabilities.len())
        .map(|c| EnvironmentEntry {
            threshold: thresholds[c] as f32,
            alias: alias[c] as u32,
            pdf: (probabilities[c] / solid_angle(cells, c as u32 / cells[0])) as f32,
        })
        .collect();
    EnvironmentTable { cells, entries }
}

/// The solid angle of one cell in row `row`, in steradians.
pub(super) fn solid_angle(cells: [u32; 2], row: u32) -> f64 {
    use std::f64::consts::PI;
    let polar = |r: u32| PI * r as f64 / cells[1] as f64;
    2.0 * PI / cells[0] as f64 * (polar(row).cos() - polar(row + 1).cos())
}

fn weights(image: &EnvironmentImage, cells: [u32; 2]) -> Vec<f64> {
    let (width, height) = (image.width as usize, image.height as usize);
    let brightness =
        |x: usize, y: usize| -> f64 { image.texels[y * width + x].iter().map(|&c| c as f64).sum() };
    // The mean over a texel of linear interpolation between neighbours is (1, 6, 1)/8.
    let along_x = |x: usize, y: usize| {
        (brightness((x + width - 1) % width, y)
            + 6.0 * brightness(x, y)
            + brightness((x + 1) % width, y))
            / 8.0
    };
    let solid_angles: Vec<f64> = (0..cells[1]).map(|row| solid_angle(cells, row)).collect();
    let mut weights = vec![0.0; (cells[0] * cells[1]) as usize];
    for y in 0..height {
        let rows = overlapped(y, height, cells[1]);
        for x in 0..width {
            let filtered = (along_x(x, y.saturating_sub(1))
                + 6.0 * along_x(x, y)
                + along_x(x, (y + 1).min(height - 1)))
                / 8.0;
            for row in rows.clone() {
                for column in overlapped(x, width, cells[0]) {
                    weights[row * cells[0] as usize + column] += filtered * solid_angles[row];
                }
            }
        }
    }
    weights
}

/// The cells that texel `i` of `texels` touches.
fn overlapped(i: usize, texels: usize, cells: u32) -> std::ops::Range<usize> {
    let cells = cells as usize;
    i * cells / texels..((i + 1) * cells).div_ceil(texels)
}

/// For each outcome: the probability of keeping it, and the outcome to take otherwise.
fn alias_method(probabilities: &[f64]) -> (Vec<f64>, Vec<usize>) {
    let n = probabilities.len();
    let mut scaled: Vec<f64> = probabilities.iter().map(|p| p * n as f64).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| scaled[i] < 1.0);
    let mut thresholds = vec![1.0; n];
    let mut alias: Vec<usize> = (0..n).collect();
    while let (Some(&low), Some(&high)) = (small.last(), large.last()) {
        small.pop();
        thresholds[low] = scaled[low];
        alias[low] = high;
        scaled[high] -= 1.0 - scaled[low];
        if scaled[high] < 1.0 {
            large.pop();
            small.push(high);
        }
    }
    (thresholds, alias)
}
