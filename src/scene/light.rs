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

    fn resampled(&self, width: u32, height: u32) -> EnvironmentImage {
        if self.size() == [width, height] {
            return self.clone();
        }
        let center = |i: u32, n: u32| (f64::from(i) + 0.5) / f64::from(n);
        let row = |j| (0..width).map(move |i| self.at(center(i, width), center(j, height)));
        let texels = (0..height).flat_map(row).collect();
        EnvironmentImage {
            width,
            height,
            texels,
        }
    }

    /// The radiance at (u, v): bilinear, wrapping in u, clamped in v.
    pub fn at(&self, u: f64, v: f64) -> [f32; 3] {
        let (x, y) = (
            u * f64::from(self.width) - 0.5,
            v * f64::from(self.height) - 0.5,
        );
        let texel = |dx: f64, dy: f64| {
            let i = (x.floor() + dx).rem_euclid(f64::from(self.width)) as usize;
            let j = (y.floor() + dy).clamp(0.0, f64::from(self.height - 1)) as usize;
            self.texels[j * self.width as usize + i]
        };
        let (s, t) = (x - x.floor(), y - y.floor());
        let corners = [
            (texel(0.0, 0.0), (1.0 - s) * (1.0 - t)),
            (texel(1.0, 0.0), s * (1.0 - t)),
            (texel(0.0, 1.0), (1.0 - s) * t),
            (texel(1.0, 1.0), s * t),
        ];
        std::array::from_fn(|c| {
            let sum: f64 = corners.iter().map(|(rgb, w)| f64::from(rgb[c]) * w).sum();
            sum as f32
        })
    }
}
