//! The bias of a marched picture of surfaces and of the medium apart: in the mean of all pixels, one may hide the other.

use super::report::BiasApart;
use crate::compare::LinearImage;
use crate::engine::Picture;

/// What is seen through the middle of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Seen {
    /// A surface, whatever medium is before it.
    Surface,
    /// Medium alone.
    Medium,
    Background,
}

/// What pixels show of a reference all of whose rays go through their middles.
pub fn seen(centres: &Picture) -> Vec<Seen> {
    let pixels = centres.depth.iter().zip(&centres.stderr);
    let seen = pixels.map(|(depth, stderr)| match depth.is_finite() {
        true => Seen::Surface,
        // All samples of the background alone are the same.
        false if *stderr == [0.0; 3] => Seen::Background,
        false => Seen::Medium,
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
        let seen = [Seen::Surface, Seen::Medium, Seen::Medium, Seen::Background];
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
