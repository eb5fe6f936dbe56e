//! How far the picture that the cache shows still is from what more paths would make of it.
//!
//! With a history of n paths and a batch of N, the picture changes by N/(n + N) of the difference between two independent
//! estimates, and n/N of the square of that change is the variance of the new picture. So the error is measured where it
//! matters: in the picture of the current camera, which averages over many nodes along each ray. (The nodes with the
//! smallest share get their second path in the batch after 16 updates; before, their small part of the error is missing.)
//! Nodes gather at first, mostly on the coarse lattice (`gathering.glsl`, `coarse.glsl`), and gathered paths share the
//! errors of the light that they read: each counts as a quarter of a traced path (`GATHERED_FOR_ONE`), and the estimate is
//! reliable only after the first batch of traced paths.

use super::memory::CacheMemory;
use super::ray_march::{self, RayMarch};
use crate::error::Result;
use crate::gpu::Frame;
use crate::render::copy;
use crate::render::picture::mean_square;
use crate::render::resources::Resources;
use crate::render::until::Until;

/// Pixels along the picture's longer side on which the error is measured, approximately.
const MEASURED_PIXELS: u32 = 64;

/// Distance along both axes between the pixels on which the error is measured.
pub fn measured_stride(r: &Resources) -> u32 {
    r.size[0].max(r.size[1]).div_ceil(MEASURED_PIXELS)
}

/// Pictures by which the error is measured, without the suns' light, which samples correct.
#[derive(Debug)]
pub struct Measured {
    /// What the cache shows.
    shown: Vec<[f32; 4]>,
    /// What a picture at rest takes from it; `None` where that is the same.
    at_rest: Option<Vec<[f32; 4]>>,
}

impl Measured {
    /// Both pictures as a file holds them, where one that is missing is empty.
    pub fn pictures(measured: Option<&Measured>) -> [&[[f32; 4]]; 2] {
        let at_rest = measured.and_then(|measured| measured.at_rest.as_ref());
        [measured.map(|measured| &measured.shown), at_rest]
            .map(|picture| picture.map_or(&[][..], Vec::as_slice))
    }

    /// The measurement of which a file holds these pictures, if it holds one.
    pub fn from_pictures(pictures: [Vec<[f32; 4]>; 2]) -> Option<Measured> {
        let [shown, at_rest] = pictures.map(|picture| (!picture.is_empty()).then_some(picture));
        Some(Measured {
            shown: shown?,
            at_rest,
        })
    }
}

/// Measures with the cache as it is now; `unit_sum` is overwritten. `None` if `until` comes before the end.
pub fn measure(
    frame: &mut Frame,
    r: &Resources,
    memory: &CacheMemory,
    ray_march: &RayMarch,
    until: Until<'_>,
) -> Result<Option<Measured>> {
    let stride = measured_stride(r);
    let measured = r.size.map(|n| n.div_ceil(stride));
    let mut march = |request| {
        if !ray_march.march_for(frame, r, memory, request, until)? {
            return Ok(None);
        }
        copy::download_picture(frame, &r.staging, &r.unit_sum, measured).map(Some)
    };
    let Some(shown) = march(ray_march::for_error(stride))? else {
        return Ok(None);
    };
    if !memory.features.leaves_cubes_to_paths() {
        let at_rest = None;
        return Ok(Some(Measured { shown, at_rest }));
    }
    let at_rest = march(ray_march::for_error_at_rest(stride))?;
    Ok(at_rest.map(|at_rest| Measured {
        shown,
        at_rest: Some(at_rest),
    }))
}

/// rms(standard error)/mean of the pictures `now`, after nodes with `history` paths have got `batch` more: of what the cache
/// shows, and of what a picture at rest takes from it.
pub fn relative_errors(before: &Measured, now: &Measured, history: f64, batch: u32) -> [f64; 2] {
    let scale = (history / f64::from(batch)).sqrt();
    let shown = scale * relative_difference(&before.shown, &now.shown);
    match (&before.at_rest, &now.at_rest) {
        (Some(before), Some(now)) => [shown, scale * relative_difference(before, now)],
        _ => [shown; 2],
    }
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
