//! PNG: the picture for viewing, 8 bits a channel.

use std::io::{self, Write};

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder, ImageError};

use super::display::display_value;
use crate::engine::Picture;
use crate::scene::Tone;

pub(super) fn encode(
    file: &mut impl Write,
    picture: &Picture,
    exposure: f64,
    tone: Tone,
) -> io::Result<()> {
    let eight_bits = |linear: f64| quantize(display_value(linear, exposure, tone));
    let (bytes, color) = match &picture.alpha {
        None => {
            let linear = picture.rgb.as_flattened();
            (
                linear.iter().map(|&v| eight_bits(v.into())).collect(),
                ExtendedColorType::Rgb8,
            )
        }
        Some(alpha) => {
            let pixels = picture.rgb.iter().zip(alpha);
            let straight = pixels.flat_map(|(rgb, &alpha)| {
                let [r, g, b] = unpremultiply(rgb, alpha).map(eight_bits);
                [r, g, b, quantize(alpha.into())]
            });
            (straight.collect::<Vec<u8>>(), ExtendedColorType::Rgba8)
        }
    };
    let encoder = PngEncoder::new(file);
    encoder
        .write_image(&bytes, picture.width, picture.height, color)
        .map_err(|error| match error {
            ImageError::IoError(error) => error,
            other => io::Error::other(other),
        })
}

/// PNG stores colours as if fully covered. A pixel without coverage has no colour.
fn unpremultiply(rgb: &[f32; 3], alpha: f32) -> [f64; 3] {
    rgb.map(|v| {
        if alpha > 0.0 {
            f64::from(v) / f64::from(alpha)
        } else {
            0.0
        }
    })
}

fn quantize(value: f64) -> u8 {
    (value * 255.0).round() as u8
}
