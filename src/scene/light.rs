//! The lights of a scene: directional ones, and the environment that surrounds the box.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::ColorType;

use crate::decoding::read_image;
use crate::srgb;

/// Radiances and irradiances that are not 0. Their squares, of which errors are made, must not leave the range of a float.
pub const RADIANCES: RangeInclusive<f64> = 1e-15..=1e15;

/// All lights of a scene. By default there are none, and it is dark.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Lights {
    pub suns: Vec<DirectionalLight>,
    pub environment: Environment,
}

/// Parallel light; not seen directly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionalLight {
    /// The direction in which the light travels; unit length.
    pub direction: [f64; 3],
    /// Irradiance of a plane that faces the light, per channel, ≥ 0.
    pub irradiance: [f64; 3],
}

/// The sum of all environments of the scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Environment {
    /// The constant part, per channel, ≥ 0.
    pub radiance: [f64; 3],
    /// The sum of the images, already multiplied by their radiance; `None` if there are none.
    pub image: Option<EnvironmentImage>,
    /// The files of the images.
    pub files: Vec<EnvironmentFile>,
}

/// Where an image of the sky comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct EnvironmentFile {
    pub path: PathBuf,
    /// The factor of its texels, per channel, ≥ 0.
    pub radiance: [f64; 3],
}

/// A latitude–longitude image. Direction d points towards the sky: u = ½ + atan2(d.x, −d.z)/2π,
/// v = acos(d.y)/π; row 0 is +y. Texel centres at ((i+½)/W, (j+½)/H), bilinear, wrapping in u,
/// clamped in v. Clones share the texels.
#[derive(Debug, Clone)]
pub struct EnvironmentImage {
    pub width: u32,
    pub height: u32,
    /// Linear RGB, row-major, finite and ≥ 0.
    pub texels: Arc<[[f32; 3]]>,
}

/// Clones are recognised without comparing their texels.
impl PartialEq for EnvironmentImage {
    fn eq(&self, other: &EnvironmentImage) -> bool {
        self.size() == other.size()
            && (Arc::ptr_eq(&self.texels, &other.texels) || self.texels == other.texels)
    }
}

impl EnvironmentImage {
    /// Reads an image: EXR and HDR hold radiance; a PNG is taken to be sRGB. The error says what is wrong with the
    /// file.
    pub fn load(path: &Path) -> Result<EnvironmentImage, String> {
        let name = path.display();
        let decoded = read_image(path, None).map_err(|why| format!("{name}: {why}"))?;
        let encoded = !matches!(decoded.color(), ColorType::Rgb32F | ColorType::Rgba32F);
        let rgb = decoded.into_rgb32f();
        let (width, height) = rgb.dimensions();
        if width == 0 || height == 0 {
            return Err(format!(
                "{name}: it is {width}x{height} pixels, expected at least 1x1"
            ));
        }
        let linear = |x: f32| {
            if encoded {
                srgb::decode(x.into()) as f32
            } else {
                x
            }
        };
        let texels: Arc<[[f32; 3]]> = rgb.pixels().map(|texel| texel.0.map(linear)).collect();
        let bad = |texel: &[f32; 3]| texel.iter().any(|x| !x.is_finite() || *x < 0.0);
        if let Some(i) = texels.iter().position(bad) {
            let (column, row) = (i % width as usize, i / width as usize);
            return Err(format!(
                "{name}: found {:?} at column {column}, row {row}; expected every texel to be \
                 finite and ≥ 0",
                texels[i]
            ));
        }
        Ok(EnvironmentImage {
            width,
            height,
            texels,
        })
    }

    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// The image multiplied by `radiance`, which must not make any texel brighter than a light may be.
    pub fn times(self, radiance: [f64; 3]) -> Result<EnvironmentImage, String> {
        let times = |texel: &[f32; 3]| -> [f32; 3] {
            std::array::from_fn(|c| (f64::from(texel[c]) * radiance[c]) as f32)
        };
        let texels = self.texels.iter().map(times).collect();
        let image = EnvironmentImage { texels, ..self };
        image.check(&format!("radiance {radiance:?} times the image"))?;
        Ok(image)
    }

    /// Fails if a texel is brighter than a light may be; `what` names the image.
    fn check(&self, what: &str) -> Result<(), String> {
        let brightest = self.texels.as_flattened().iter().copied();
        let brightest = f64::from(brightest.fold(0.0, f32::max));
        if brightest <= *RADIANCES.end() {
            Ok(())
        } else {
            let most = RADIANCES.end();
            Err(format!(
                "{what} reaches {brightest:e}, expected at most {most:e}"
            ))
        }
    }

    /// The sum of two images on a grid as fine as the finer of the two, along each axis.
    pub fn plus(&self, other: &EnvironmentImage) -> Result<EnvironmentImage, String> {
        let (width, height) = (self.width.max(other.width), self.height.max(other.height));
        let (a, b) = (
            self.resampled(width, height),
            other.resampled(width, height),
        );
        let add = |(a, b): (&[f32; 3], &[f32; 3])| std::array::from_fn(|c| a[c] + b[c]);
        let sum = EnvironmentImage {
            width,
            height,
            texels: a.texels.iter().zip(b.texels.iter()).map(add).collect(),
        };
        sum.check("the sum of the images")?;
        Ok(sum)
    }

    /// On another grid, each texel is the image's mean over the texel's area, so that no light is lost or gained: a bright texel
    /// may lie anywhere between the centres of the others.
    fn resampled(&self, width: u32, height: u32) -> EnvironmentImage {
        if self.size() == [width, height] {
            return self.clone();
        }
        let columns: Vec<_> = (0..width).map(|i| shares(self.width, i, width)).collect();
        let rows = (0..height).map(|j| shares(self.height, j, height));
        let column_of = |i: i64| i.rem_euclid(self.width.into()) as usize;
        let row_of = |j: i64| j.clamp(0, i64::from(self.height) - 1) as usize;
        let mean = |row: &[(i64, f64)], column: &[(i64, f64)]| {
            let mut sum = [0.0; 3];
            for &(j, of_row) in row {
                for &(i, of_column) in column {
                    let texel = self.texels[row_of(j) * self.width as usize + column_of(i)];
                    let share = of_row * of_column;
                    sum = std::array::from_fn(|c| sum[c] + share * f64::from(texel[c]));
                }
            }
            sum.map(|c| c as f32)
        };
        let of_row = |row: Vec<(i64, f64)>| columns.iter().map(move |column| mean(&row, column));
        EnvironmentImage {
            width,
            height,
            texels: rows.flat_map(of_row).collect(),
        }
    }
}

/// The texels of a row of `from` that an interpolated row holds within texel number `i` of `to` others, and their shares of
/// the mean there. The first and the last may lie beyond the row's ends.
fn shares(from: u32, i: u32, to: u32) -> Vec<(i64, f64)> {
    let edge = |i: u32| f64::from(i) / f64::from(to) * f64::from(from) - 0.5;
    let (begin, end) = (edge(i), edge(i + 1));
    // The integral of a texel's weight up to x; the weight falls from 1 at its centre to 0 at those beside it.
    let up_to = |x: f64| match x.clamp(-1.0, 1.0) {
        x if x < 0.0 => 0.5 * (x + 1.0).powi(2),
        x => 1.0 - 0.5 * (1.0 - x).powi(2),
    };
    let share = |n: i64| (up_to(end - n as f64) - up_to(begin - n as f64)) / (end - begin);
    let texels = begin.floor() as i64..=end.ceil() as i64;
    texels.map(|n| (n, share(n))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image([width, height]: [u32; 2], texel: impl Fn(u32, u32) -> f32) -> EnvironmentImage {
        let row = |j| (0..width).map(move |i| (i, j));
        let texels = (0..height).flat_map(row);
        let texels = texels.map(|(i, j)| [texel(i, j), 1.0, 0.0]).collect();
        EnvironmentImage {
            width,
            height,
            texels,
        }
    }

    /// The mean of the first channel over the image's plane.
    fn mean(image: &EnvironmentImage) -> f64 {
        let sum: f64 = image.texels.iter().map(|texel| f64::from(texel[0])).sum();
        sum / image.texels.len() as f64
    }

    #[test]
    fn images_of_other_sizes_neither_lose_nor_gain_light() {
        for (size, other) in [
            ([48, 24], [64, 32]),
            ([64, 32], [100, 50]),
            ([5, 3], [16, 128]),
        ] {
            for spot in [
                [0, 0],
                [size[0] - 1, size[1] - 1],
                [size[0] / 3, size[1] / 4],
            ] {
                let bright = |i, j| if [i, j] == spot { 1000.0 } else { 0.5 };
                let bright = image(size, bright);
                let sum = bright.plus(&image(other, |_, _| 0.0)).expect("a sum");
                assert_eq!(sum.size(), other);
                let off = mean(&sum) / mean(&bright) - 1.0;
                assert!(off.abs() < 1e-5, "{size:?} {spot:?}: {off}");
                assert!(
                    sum.texels
                        .iter()
                        .all(|texel| (texel[1] - 2.0).abs() < 1e-5 && texel[2] == 0.0)
                );
            }
        }
    }
}
