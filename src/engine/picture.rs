//! A finished picture with its layers.

use crate::render::{Film, FirstHits};
use crate::scene::{Background, RenderSettings};

/// A picture and its layers, row 0 on top; every vector holds width × height pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    /// Linear radiance, Rec. 709, premultiplied if there is an alpha.
    pub rgb: Vec<[f32; 3]>,
    /// Coverage; `None` unless the background is transparent.
    pub alpha: Option<Vec<f32>>,
    /// Standard error of each pixel's mean; +inf where it is unknown.
    pub stderr: Vec<[f32; 3]>,
    /// Colour of the first surface.
    pub albedo: Vec<[f32; 3]>,
    /// Unit normal of the first surface; 0 where there is none.
    pub normal: Vec<[f32; 3]>,
    /// Distance along the pixel centre's ray to the first surface, in world units; +inf where there is none.
    pub depth: Vec<f32>,
}

impl Picture {
    pub(super) fn new(film: Film, hits: FirstHits, settings: &RenderSettings) -> Picture {
        let last = |texels: &[[f32; 4]]| texels.iter().map(|t| t[3]).collect();
        let [width, height] = settings.size;
        let is_transparent = settings.background == Background::Transparent;
        Picture {
            width,
            height,
            rgb: rgb(&film.mean),
            alpha: is_transparent.then(|| last(&film.mean)),
            stderr: film.stderr,
            albedo: rgb(&hits.albedo),
            normal: rgb(&hits.normal_depth),
            depth: last(&hits.normal_depth),
        }
    }

    /// Shows other texels, of RGB and coverage.
    pub fn show(&mut self, texels: &[[f32; 4]]) {
        self.rgb = rgb(texels);
        if let Some(alpha) = &mut self.alpha {
            *alpha = texels.iter().map(|t| t[3]).collect();
        }
    }

    pub fn relative_error(&self) -> f64 {
        relative_error(&self.rgb, &self.stderr)
    }
}

/// rms(stderr) / mean(RGB): the error that a stop refers to, and that the statistics report.
pub fn relative_error(rgb: &[[f32; 3]], stderr: &[[f32; 3]]) -> f64 {
    let values = |layer: &[[f32; 3]], term: fn(f64) -> f64| {
        let sum: f64 = layer.as_flattened().iter().map(|&v| term(v.into())).sum();
        sum / (layer.len() * 3) as f64
    };
    let rms = values(stderr, |v| v * v).sqrt();
    // A black picture without noise is exact, not undefined.
    if rms == 0.0 {
        0.0
    } else {
        rms / values(rgb, |v| v)
    }
}

/// The first three channels of each texel.
pub(super) fn rgb(texels: &[[f32; 4]]) -> Vec<[f32; 3]> {
    texels.iter().map(|&[r, g, b, _]| [r, g, b]).collect()
}

/// rms(after − before) / mean(after) of two pictures of RGB and coverage.
pub(super) fn relative_change(before: &[[f32; 4]], after: &[[f32; 4]]) -> f64 {
    let pairs = before.iter().zip(after);
    let change: Vec<[f32; 3]> = pairs
        .map(|(b, a)| std::array::from_fn(|c| a[c] - b[c]))
        .collect();
    relative_error(&rgb(after), &change)
}
