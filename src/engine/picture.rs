//! A finished picture with its layers.

use crate::render::{Film, FirstHits, mean_square};
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
    /// Bytes of the host's memory that a picture of so many pixels takes while it is read and written, about; without or with
    /// the sums behind it, which shards and checkpoints hold: by measurements of large pictures (tools/measurements/memory.md).
    pub fn host_bytes([width, height]: [u32; 2], with_sums: bool) -> u64 {
        let of_a_pixel = if with_sums { 115 } else { 80 };
        of_a_pixel * u64::from(width) * u64::from(height)
    }

    /// Takes the texels, whose memory it uses where it can: large pictures are most of what a host has to hold.
    pub(super) fn new(film: Film, hits: FirstHits, settings: &RenderSettings) -> Picture {
        let [width, height] = settings.size;
        let is_transparent = settings.background == Background::Transparent;
        let alpha = is_transparent.then(|| last(&film.mean));
        let rgb = radiance(film.mean);
        let depth = last(&hits.normal_depth);
        Picture {
            width,
            height,
            rgb,
            alpha,
            stderr: film.stderr,
            albedo: first_three(hits.albedo),
            normal: first_three(hits.normal_depth),
            depth,
        }
    }

    /// Shows other texels, of RGB and coverage.
    pub fn show(&mut self, texels: &[[f32; 4]]) {
        self.rgb = radiance(texels.iter().copied());
        if let Some(alpha) = &mut self.alpha {
            *alpha = last(texels);
        }
    }

    pub fn relative_error(&self) -> f64 {
        relative_error(&self.rgb, &self.stderr)
    }
}

/// rms(stderr) / mean(RGB): the error that a stop refers to, and that the statistics report.
pub fn relative_error(rgb: &[[f32; 3]], stderr: &[[f32; 3]]) -> f64 {
    let squares = stderr.as_flattened().iter().map(|&v| f64::from(v).powi(2));
    relative(squares.sum::<f64>() / (3 * stderr.len()) as f64, rgb)
}

/// The root of a mean square, relative to a picture's mean. A black picture without noise is exact, not undefined.
fn relative(mean_square: f64, rgb: &[[f32; 3]]) -> f64 {
    if mean_square == 0.0 {
        return 0.0;
    }
    mean_square.sqrt() / mean(rgb)
}

/// The mean of all channels of all pixels.
pub(super) fn mean(rgb: &[[f32; 3]]) -> f64 {
    let sum: f64 = rgb.as_flattened().iter().map(|&v| f64::from(v)).sum();
    sum / (3 * rgb.len()) as f64
}

/// RGB of each texel. Where samples correct light that was read from a cache, their mean may be below 0 by its noise or by
/// rounding.
pub(super) fn radiance(texels: impl IntoIterator<Item = [f32; 4]>) -> Vec<[f32; 3]> {
    let positive = |v: f32| if v < 0.0 { 0.0 } else { v };
    vectors(texels, |rgb| rgb.map(positive))
}

/// The first three channels of each texel.
fn first_three(texels: impl IntoIterator<Item = [f32; 4]>) -> Vec<[f32; 3]> {
    vectors(texels, |vector| vector)
}

/// `of` the first three channels of each texel, in the memory of the texels if they are given away, of which the rest is
/// freed.
fn vectors(
    texels: impl IntoIterator<Item = [f32; 4]>,
    of: impl Fn([f32; 3]) -> [f32; 3],
) -> Vec<[f32; 3]> {
    let vector = |[x, y, z, _]: [f32; 4]| of([x, y, z]);
    let mut vectors: Vec<_> = texels.into_iter().map(vector).collect();
    vectors.shrink_to_fit();
    vectors
}

/// The fourth channel of each texel.
fn last(texels: &[[f32; 4]]) -> Vec<f32> {
    texels.iter().map(|texel| texel[3]).collect()
}

/// rms(after − before) / mean(after) of two pictures of RGB and coverage.
pub(super) fn relative_change(before: &[[f32; 4]], after: &[[f32; 4]]) -> f64 {
    relative(
        mean_square(before, after),
        &first_three(after.iter().copied()),
    )
}
