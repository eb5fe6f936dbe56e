//! How far the picture that the cache shows still is from what more paths would make of it.
//!
//! With a history of n paths and a batch of N, the picture changes by N/(n + N) of the difference between two
//! independent estimates, and n/N of the square of that change is the variance of the new picture. So the error is
//! measured where it matters: in the picture of the current camera, where averaging over many cells along a ray is
//! part of the answer. (Nodes with the least share change from the sixteenth update on; before, the little that they
//! add is left out.) The light that nodes gather at first (`gathering.glsl`), an eighth of them for all
//! (`coarse.glsl`), shares errors with what they gathered before: it counts for less, and the estimate holds once a
//! batch of whole paths has been compared with it.

use super::memory::CacheMemory;
use super::ray_march::{self, RayMarch};
use crate::error::Result;
use crate::gpu::Frame;
use crate::render::copy;
use crate::render::difference::mean_square;
use crate::render::resources::Resources;

/// Pixels along the picture's longer side on which the error is measured, approximately.
const MEASURED_PIXELS: u32 = 64;

/// Distance along both axes between the pixels on which the error is measured.
pub fn measured_stride(r: &Resources) -> u32 {
    r.size[0].max(r.size[1]).div_ceil(MEASURED_PIXELS)
}

/// The picture that the cache shows on these pixels; `unit_sum` is overwritten.
pub fn shown(
    frame: &mut Frame,
    r: &Resources,
    memory: &CacheMemory,
    ray_march: &mut RayMarch,
) -> Result<Vec<[f32; 4]>> {
    let stride = measured_stride(r);
    let [width, height] = r.size.map(|n| n.div_ceil(stride));
    let corner = [width, height, 1];
    ray_march.ask(frame, r, memory, ray_march::for_error(stride))?;
    copy::download_corner(frame, &r.staging, &r.unit_sum, corner)
}

/// rms(standard error)/mean of the picture `now`, after nodes with `history` paths have got `batch` more.
pub fn relative_error(before: &[[f32; 4]], now: &[[f32; 4]], history: f64, batch: u32) -> f64 {
    (history / f64::from(batch)).sqrt() * relative_difference(before, now)
}

/// rms(after − before) over RGB, relative to the mean of alpha, the whole picture's brightness.
fn relative_difference(before: &[[f32; 4]], after: &[[f32; 4]]) -> f64 {
    let sum: f64 = after.iter().map(|texel| f64::from(texel[3])).sum();
    let mean = sum / after.len() as f64;
    if sum > 0.0 {
        mean_square(before, after).sqrt() / mean
    } else {
        0.0
    }
}
