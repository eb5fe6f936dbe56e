//! A sky image, and what follows from it for all scenes that use it.

use std::f64::consts::{PI, TAU};

use super::environment_table::{self, EnvironmentTable, solid_angle};
use super::{is_grey, over};
use crate::scene::EnvironmentImage;

#[derive(Debug)]
pub struct SkyImage {
    pub image: EnvironmentImage,
    /// The table by which it is sampled.
    pub table: EnvironmentTable,
    /// Mean over all directions.
    pub mean: [f32; 3],
    /// Whether all texels have the colour of the mean.
    pub has_one_color: bool,
    /// The largest mean of P₂(ω·v) over its light from directions ω, for any v: 1 for light from one direction, 0 for light
    /// that is the same from all. It is what two moments of the light leave out at second order.
    pub unevenness: f32,
}

impl PartialEq for SkyImage {
    fn eq(&self, other: &SkyImage) -> bool {
        self.image == other.image
    }
}

impl SkyImage {
    pub fn new(image: &EnvironmentImage) -> SkyImage {
        let mean = mean_over_directions(image);
        let mut texels = image.texels.iter();
        SkyImage {
            table: environment_table::build(image),
            mean,
            has_one_color: texels.all(|&texel| is_grey(over(texel, mean))),
            unevenness: unevenness(image),
            image: image.clone(),
        }
    }
}

/// Rows near the poles of a latitude-longitude image cover little of the sphere.
fn mean_over_directions(image: &EnvironmentImage) -> [f32; 3] {
    let mut mean = [0.0; 3];
    for (row, y) in image.texels.chunks_exact(image.width as usize).zip(0..) {
        let share = solid_angle([image.width, image.height], y) / (4.0 * PI);
        for texel in row {
            for (mean, c) in mean.iter_mut().zip(texel) {
                *mean += share * f64::from(*c);
            }
        }
    }
    mean.map(|c| c as f32)
}

/// [`SkyImage::unevenness`], by the light's second moment M = ∫ L ωωᵀ dω / ∫ L dω. The mean of P₂ is ½(3 vᵀMv − 1), whose largest
/// value is at most √(3⁄2) times the Frobenius norm of M − ⅓, and just that where the light is symmetric about an axis.
fn unevenness(image: &EnvironmentImage) -> f32 {
    // Texels of small images are wide.
    const FINE: [u32; 2] = [64, 32];
    let size = image.size();
    let [across, down] = [0, 1].map(|axis| FINE[axis].div_ceil(size[axis]));
    let fine = [size[0] * across, size[1] * down];
    let azimuth = |x: u32| TAU * (f64::from(x) + 0.5) / f64::from(fine[0]);
    let columns: Vec<(f64, f64)> = (0..fine[0]).map(|x| azimuth(x).sin_cos()).collect();
    let mut moment = [[0.0; 3]; 3];
    let mut total = 0.0;
    for y in 0..fine[1] {
        let (sin_polar, cos_polar) = (PI * (f64::from(y) + 0.5) / f64::from(fine[1])).sin_cos();
        let weight = solid_angle(fine, y);
        for (&(sin, cos), x) in columns.iter().zip(0..) {
            let texel = image.texels[(y / down * size[0] + x / across) as usize];
            let light = weight * texel.map(f64::from).iter().sum::<f64>();
            let towards = [sin_polar * cos, cos_polar, sin_polar * sin];
            total += light;
            for (row, a) in moment.iter_mut().zip(towards) {
                for (sum, b) in row.iter_mut().zip(towards) {
                    *sum += light * a * b;
                }
            }
        }
    }
    if total == 0.0 {
        return 0.0;
    }
    for (i, row) in moment.iter_mut().enumerate() {
        for (j, m) in row.iter_mut().enumerate() {
            *m = *m / total - if i == j { 1.0 / 3.0 } else { 0.0 };
        }
    }
    let squares: f64 = moment.as_flattened().iter().map(|m| m * m).sum();
    (1.5 * squares).sqrt() as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, height: u32, texels: Vec<[f32; 3]>) -> EnvironmentImage {
        EnvironmentImage {
            width,
            height,
            texels: texels.into(),
        }
    }

    /// A cap of 45° around the pole is a seventh of the sphere, not a quarter.
    #[test]
    fn a_bright_pole_is_a_small_part_of_the_sky() {
        let pole = image(1, 4, vec![[1.0; 3], [0.0; 3], [0.0; 3], [0.0; 3]]);
        let mean = mean_over_directions(&pole);
        let exact = 0.5 * (1.0 - 0.5f32.sqrt());
        assert!((mean[0] - exact).abs() < 1e-6, "{mean:?}, not {exact}");
    }

    #[test]
    fn skies_are_uneven_by_what_is_bright_in_them() {
        let mut spot = vec![[0.0; 3]; 64 * 32];
        spot[20 * 64 + 30] = [9.0; 3];
        let half = [vec![[2.0; 3]; 16], vec![[0.0; 3]; 16]].concat();
        let row = |y: u32| [(1.0 + (PI * (f64::from(y) + 0.5) / 64.0).cos()) as f32; 3];
        for (what, sky, expected) in [
            ("one direction", image(64, 32, spot), 1.0),
            ("all directions", image(1, 1, vec![[3.0; 3]]), 0.0),
            ("one half", image(1, 32, half), 0.0),
            ("1 + cos", image(1, 64, (0..64).map(row).collect()), 0.0),
            ("black", image(2, 1, vec![[0.0; 3]; 2]), 0.0),
        ] {
            let found = unevenness(&sky);
            assert!((found - expected).abs() < 0.01, "{what}: {found}");
        }
    }
}
