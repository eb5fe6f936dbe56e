//! The picture that the cache shows at once.

use super::memory::CacheMemory;
use crate::error::Result;
use crate::gpu::types::*;
use crate::gpu::{Binding, Dispatch, Frame, Pass, Recording, SLICE_MS};
use crate::render::pass_compiler::PassCompiler;
use crate::render::resources::Resources;
use crate::render::shared::{MARCH_AT_REST, MARCH_CACHED, MARCH_PICTURE};
use crate::render::until::Until;
use crate::render::volume_reading::ReadingSlices;
use crate::shared;

shared! {
    pub struct MarchPush {
        /// Every `stride`-th pixel along both axes is marched.
        pub stride: uint,
        /// Factor on the length of steps.
        pub step_scale: float,
        /// `MARCH_PICTURE`, or else the result is what `MARCH_CACHED` or `MARCH_AT_REST` say, and in alpha the whole
        /// picture's mean over channels.
        pub wanted: uint,
        /// 1: bricks get their weights.
        pub weighs: uint,
        /// The point of each pixel, in [0, 1)², through which its ray goes.
        pub point: vec2,
        /// Number of rays of each pixel whose mean is in `unit_sum`, and to which this one is added.
        pub rays_before: uint,
    }
}

/// Factor on the length of steps for a picture in motion.
const STEP_SCALE: f32 = 2.0;

/// Rays of each pixel at rest. More would gain less than samples, which correct their light as well.
pub const RAYS_PER_PIXEL: u32 = 9;

/// The point of a pixel through which one of its rays goes: the first in the middle, all of them a rank-1 lattice, the
/// same in each pixel, whose mean square error at straight edges is a twentieth of the middle's alone.
fn point_in_pixel(ray: u32) -> vec2 {
    [7, 5]
        .map(|step| ((step * ray) % RAYS_PER_PIXEL) as f32 / RAYS_PER_PIXEL as f32 + 0.5)
        .map(f32::fract)
}

pub struct RayMarch {
    pass: Pass,
}

impl RayMarch {
    pub fn new(passes: &PassCompiler<'_>) -> Result<Self> {
        Ok(RayMarch {
            pass: passes.compile::<MarchPush>("ray_march")?,
        })
    }

    /// Marches a picture of few pixels into `unit_sum`. Rays take longer steps.
    pub fn record<'r>(
        &'r self,
        recording: &mut Recording<'_, 'r>,
        r: &'r Resources,
        cache: &'r CacheMemory,
    ) -> Result<()> {
        let [width, height] = r.size;
        let push = MarchPush {
            step_scale: STEP_SCALE,
            ..push(1)
        };
        recording.dispatch(&self.pass, &bindings(r, cache), &push, [width, height, 1])?;
        // The count is dropped: only the window uses this march, and it does not report shares of the device's peak.
        cache.marched.begin(recording)
    }

    /// Marches the next slice of the picture, and adds it to the mean of `rays_before` rays. Returns whether it was the last.
    pub fn advance(
        &self,
        frame: &mut Frame,
        r: &Resources,
        cache: &CacheMemory,
        rays_before: u32,
        slices: &mut ReadingSlices,
    ) -> Result<bool> {
        let push = MarchPush {
            point: point_in_pixel(rays_before),
            rays_before,
            ..push(1)
        };
        self.slice(frame, r, cache, &push, slices)
    }

    /// Marches every `stride`-th pixel for `request` (`for_error`, `for_weights`); the answer is in the corner of
    /// `unit_sum`, or in the bricks. Returns whether there is one: `until` has not come before.
    pub fn march_for(
        &self,
        frame: &mut Frame,
        r: &Resources,
        cache: &CacheMemory,
        request: MarchPush,
        until: Until<'_>,
    ) -> Result<bool> {
        let mut slices = ReadingSlices::new(SLICE_MS);
        while !self.slice(frame, r, cache, &request, &mut slices)? {
            if until.is_over() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Marches the next slice, and states its work. Returns whether it was the last.
    fn slice(
        &self,
        frame: &mut Frame,
        r: &Resources,
        cache: &CacheMemory,
        push: &MarchPush,
        slices: &mut ReadingSlices,
    ) -> Result<bool> {
        let [width, height] = r.size.map(|n| n.div_ceil(push.stride));
        let dispatch = Dispatch {
            pass: &self.pass,
            bindings: bindings(r, cache),
            push: *push,
            threads: [width, height, 1],
        };
        let has_ended = r.run_slice(frame, &dispatch, slices, |recording| {
            cache.marched.record_collection(recording, &r.staging)
        })?;
        cache
            .marched
            .state_collected(frame, &r.staging, self.pass.name);
        Ok(has_ended)
    }
}

/// The request from which the cache's error is measured (`MARCH_CACHED`), in every `stride`-th pixel along
/// both axes.
pub fn for_error(stride: u32) -> MarchPush {
    MarchPush {
        wanted: MARCH_CACHED,
        ..push(stride)
    }
}

/// The same for what a picture at rest takes from the cache.
pub fn for_error_at_rest(stride: u32) -> MarchPush {
    MarchPush {
        wanted: MARCH_AT_REST,
        ..push(stride)
    }
}

/// The request for the weights of bricks in every `stride`-th pixel along both axes; `unit_sum` is overwritten.
pub fn for_weights(stride: u32) -> MarchPush {
    MarchPush {
        weighs: 1,
        ..push(stride)
    }
}

fn push(stride: u32) -> MarchPush {
    MarchPush {
        stride,
        step_scale: 1.0,
        wanted: MARCH_PICTURE,
        weighs: 0,
        point: point_in_pixel(0),
        rays_before: 0,
    }
}

fn bindings<'a>(r: &'a Resources, cache: &'a CacheMemory) -> Vec<(&'static str, Binding<'a>)> {
    [
        &r.medium_bindings()[..],
        &r.surface_bindings(),
        &cache.bindings(),
        &[
            cache.brick_binding(),
            cache.reflectance_binding(),
            cache.marched.binding(),
            r.camera_binding(),
            ("unit_sum", Binding::Image(&r.unit_sum)),
        ],
    ]
    .concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean square error, over edges of all directions through all parts of a pixel, of the part of it that lies behind.
    fn error_at_edges(points: &[vec2]) -> f64 {
        const FINE: u32 = 64;
        const DIRECTIONS: u32 = 90;
        const PLACES: u32 = 32;
        let centre = |i: u32, n: u32| (f64::from(i) + 0.5) / f64::from(n);
        let pixel: Vec<vec2> = (0..FINE * FINE)
            .map(|i| [i % FINE, i / FINE].map(|n| centre(n, FINE) as f32))
            .collect();
        let mut sum = 0.0;
        for direction in 0..DIRECTIONS {
            let (sin, cos) = (std::f64::consts::TAU * centre(direction, DIRECTIONS)).sin_cos();
            for place in 0..PLACES {
                let edge = centre(place, PLACES) - 0.5;
                let behind = |points: &[vec2]| {
                    let is_behind = |p: &&vec2| {
                        let [x, y] = p.map(|n| f64::from(n) - 0.5);
                        cos * x + sin * y > edge
                    };
                    points.iter().filter(is_behind).count() as f64 / points.len() as f64
                };
                sum += (behind(points) - behind(&pixel)).powi(2);
            }
        }
        sum
    }

    #[test]
    fn rays_are_spread_evenly() {
        let points: Vec<_> = (0..RAYS_PER_PIXEL).map(point_in_pixel).collect();
        assert_eq!(points[0], [0.5; 2]);
        let ratio = error_at_edges(&points[..1]) / error_at_edges(&points);
        assert!((15.0..25.0).contains(&ratio), "{ratio}");
    }
}
