//! The display values of a picture, and their error.

use super::filter::Plane;
use super::image::LinearImage;
use crate::output::display::display_value;
use crate::scene::Tone;

/// Red, green and blue display values in [0, 1].
pub(super) fn planes(image: &LinearImage, exposure: f64) -> [Plane; 3] {
    std::array::from_fn(|channel| Plane {
        width: image.width,
        height: image.height,
        values: image
            .rgb
            .iter()
            .map(|pixel| display_value(pixel[channel].into(), exposure, Tone::Linear))
            .collect(),
    })
}

/// Peak signal-to-noise ratio in dB.
pub(super) fn psnr(reference: &[Plane; 3], test: &[Plane; 3]) -> f64 {
    let squares = reference.iter().zip(test).flat_map(|(reference, test)| {
        reference
            .values
            .iter()
            .zip(&test.values)
            .map(|(r, t)| (t - r).powi(2))
    });
    let count = 3 * reference[0].values.len();
    -10.0 * (squares.sum::<f64>() / count as f64).log10()
}
