//! The bias of a marched picture of surfaces and of the medium apart: in the mean of all pixels, one may hide the other.

use super::report::BiasApart;
use crate::compare::LinearImage;

/// What is seen through the middle of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Seen {
    /// A surface, whatever medium is before it.
    Surface,
    /// Medium alone.
    Medium,
    Background,
}

/// The coverage from which on a pixel shows medium.
const LEAST: f32 = 0.01;

/// What each pixel shows in its middle: `depth` is the distance of its first surface (+inf without one), and the alpha of
/// `texels` its coverage.
pub fn seen(depth: &[f32], texels: &[[f32; 4]]) -> Vec<Seen> {
    let pixels = depth.iter().zip(texels);
    let seen = pixels.map(|(depth, &[_, _, _, coverage])| {
        if depth.is_finite() {
            Seen::Surface
        } else if coverage < LEAST {
            Seen::Background
        } else {
            Seen::Medium
        }
    });
    seen.collect()
}

/// The bias of `test`, relative to the light of the reference in the same pixels.
pub fn bias_apart(reference: &LinearImage, seen: &[Seen], test: &LinearImage) -> BiasApart {
    let bias = |what: Seen| {
        let sum = |image: &LinearImage| {
            let pixels = image.rgb.iter().zip(seen);
            let light = pixels.filter(|(_, seen)| **seen == what);
            let light = light.flat_map(|(rgb, _)| rgb.map(f64::from));
            light.sum::<f64>()
        };
        let expected = sum(reference);
        (expected > 0.0).then(|| sum(test) / expected - 1.0)
    };
    BiasApart {
        surfaces: bias(Seen::Surface),
        medium: bias(Seen::Medium),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_bias_is_that_of_its_own_pixels() {
        let image = |values: [f32; 4]| LinearImage {
            name: String::new(),
            width: 4,
            height: 1,
            rgb: values.map(|v| [v; 3]).to_vec(),
            stderr: None,
        };
        let depth = [1.0, f32::INFINITY, f32::INFINITY, f32::INFINITY];
        let seen = seen(
            &depth,
            &[0.0, 1.0, 0.01, 0.009].map(|alpha| [1.0, 1.0, 1.0, alpha]),
        );
        let bias = bias_apart(
            &image([1.0, 2.0, 2.0, 1.0]),
            &seen,
            &image([1.5, 2.0, 1.0, 9.0]),
        );
        assert_eq!((bias.surfaces, bias.medium), (Some(0.5), Some(-0.25)));
        let none = bias_apart(&image([1.0; 4]), &[Seen::Medium; 4], &image([1.0; 4]));
        assert_eq!((none.surfaces, none.medium), (None, Some(0.0)));
    }
}
