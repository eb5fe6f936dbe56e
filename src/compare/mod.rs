//! How far a picture is from a reference: error of the radiance, of what a display shows of it,
//! and, where both know their own noise, whether the difference is more than noise.
//!
//! Definitions are those of common tools, so that numbers can be laid beside other people's: SSIM
//! as scikit-image, FLIP as NVIDIA's flip-evaluator.

mod display;
mod filter;
mod flip;
mod image;
mod noise;
mod ssim;
mod without_noise;

use std::path::Path;

use serde::Serialize;

use crate::error::Result;

pub use self::image::LinearImage;
pub use self::without_noise::{WithoutNoise, without_noise};

/// Every metric of one pair of pictures. What is infinite or undefined is null in JSON.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Mean of d²; like the next four, a metric of linear radiance.
    pub mse: f64,
    /// Mean of d² / (reference² + 0.01).
    pub relmse: f64,
    /// Mean of test − reference.
    pub bias: f64,
    /// Standard error of the bias; `None` unless both pictures have theirs.
    pub bias_stderr: Option<f64>,
    /// The bias, relative to the reference's mean.
    pub rel_bias: f64,
    /// PSNR in dB, infinite for equal pictures; like the next two, a metric of display values.
    pub psnr: f64,
    /// `None` where a side is shorter than its window.
    pub ssim: Option<f64>,
    /// FLIP, from 0 for equal pictures to 1.
    pub flip: f64,
    /// Difference of the image means in standard errors; `None` unless both pictures have them.
    pub z_bias: Option<f64>,
    /// The largest such difference, in magnitude, of the means of a tile of 16×16 pixels.
    pub z_tile_max: Option<f64>,
}

/// All metrics of two files, or of four.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Compared {
    #[serde(flatten)]
    pub comparison: Comparison,
    #[serde(flatten)]
    pub without_noise: Option<WithoutNoise>,
}

/// Compares two files, a reference and a test; display values are exposed by `exposure` stops, clipped and
/// sRGB-encoded. `again`: the same two pictures with other random numbers.
pub fn compare_files(
    files: [&Path; 2],
    again: Option<[&Path; 2]>,
    exposure: f64,
) -> Result<Compared> {
    let read =
        |[a, b]: [&Path; 2]| -> Result<_> { Ok([LinearImage::read(a)?, LinearImage::read(b)?]) };
    let [reference, test] = read(files)?;
    let comparison = compare_images(&reference, &test, exposure)?;
    let without_noise = match again.map(read).transpose()? {
        Some([r, t]) => Some(without_noise([&reference, &r], [&test, &t], exposure)?),
        None => None,
    };
    Ok(Compared {
        comparison,
        without_noise,
    })
}

/// Compares two pictures in memory.
pub fn compare_images(
    reference: &LinearImage,
    test: &LinearImage,
    exposure: f64,
) -> Result<Comparison> {
    reference.check_comparable(test)?;
    let [shown_reference, shown_test] =
        [reference, test].map(|image| display::planes(image, exposure));
    let linear = linear_error(reference, test);
    let z = noise::z_scores(reference, test);
    Ok(Comparison {
        mse: linear.mse,
        relmse: linear.relmse,
        bias: linear.bias,
        bias_stderr: z.stderr,
        rel_bias: if linear.bias == 0.0 {
            0.0
        } else {
            linear.bias / linear.reference_mean
        },
        psnr: display::psnr(&shown_reference, &shown_test),
        ssim: ssim::ssim(&shown_reference, &shown_test),
        flip: flip::flip(&shown_reference, &shown_test),
        z_bias: z.bias,
        z_tile_max: z.tile_max,
    })
}

struct LinearError {
    mse: f64,
    relmse: f64,
    bias: f64,
    reference_mean: f64,
}

fn linear_error(reference: &LinearImage, test: &LinearImage) -> LinearError {
    let mut sum = LinearError {
        mse: 0.0,
        relmse: 0.0,
        bias: 0.0,
        reference_mean: 0.0,
    };
    let values = reference
        .rgb
        .as_flattened()
        .iter()
        .zip(test.rgb.as_flattened());
    let count = values.len() as f64;
    for (&reference, &test) in values {
        let (reference, test) = (f64::from(reference), f64::from(test));
        let difference = test - reference;
        sum.mse += difference * difference / count;
        sum.relmse += difference * difference / (reference * reference + 0.01) / count;
        sum.bias += difference / count;
        sum.reference_mean += reference / count;
    }
    sum
}

impl Compared {
    /// One figure a line, with what it means.
    pub fn table(&self) -> String {
        let more = self.without_noise.as_ref().map(WithoutNoise::table);
        self.comparison.table() + &more.unwrap_or_default()
    }
}

impl Comparison {
    /// One metric a line, with what it means.
    pub fn table(&self) -> String {
        let rows = [
            ("mse", Some(self.mse), "radiance: mean squared error"),
            (
                "relmse",
                Some(self.relmse),
                "radiance: mean of d² / (reference² + 0.01)",
            ),
            (
                "bias",
                Some(self.bias),
                "radiance: mean of test − reference",
            ),
            (
                "bias_stderr",
                self.bias_stderr,
                "radiance: standard error of the bias",
            ),
            ("rel_bias", Some(self.rel_bias), "bias / mean of reference"),
            ("psnr", Some(self.psnr), "dB, display values"),
            ("ssim", self.ssim, "display values: 1 is equal"),
            ("flip", Some(self.flip), "display values: 0 is equal"),
            ("z_bias", self.z_bias, "bias in standard errors"),
            (
                "z_tile_max",
                self.z_tile_max,
                "the same in the worst 16×16 tile",
            ),
        ];
        rows.map(line).concat()
    }
}

fn line((name, value, meaning): (&str, Option<f64>, &str)) -> String {
    let value = value.map_or("-".to_owned(), number);
    format!("{name:<18} {value:>11}  {meaning}\n")
}

fn number(value: f64) -> String {
    let usual = value == 0.0 || !value.is_finite() || (1e-3..1e5).contains(&value.abs());
    if usual {
        format!("{value:.5}")
    } else {
        format!("{value:.3e}")
    }
}
