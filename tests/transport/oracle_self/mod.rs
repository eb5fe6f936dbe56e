//! The oracle against closed forms: nothing is judged by it before it has passed these.

mod field;
mod scattering;
mod surfaces;
mod transport;

use crate::support::common;
use crate::support::oracle::{Picture, random::Random};
use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

fn volume(dims: [u32; 3], spacing: [f64; 3], voxels: Vec<f32>) -> Volume {
    Volume::from_values(dims, spacing, Voxels::F32(voxels)).expect("a volume")
}

/// Uniform voxels in [0, `top`), whole numbers if asked for.
fn noise(dims: [u32; 3], spacing: [f64; 3], top: f64, whole: bool, seed: u64) -> Volume {
    let mut random = Random::new(seed, 0);
    let voxels = (0..dims.iter().product())
        .map(|_| top * random.uniform())
        .map(|v| if whole { v.floor() } else { v } as f32);
    volume(dims, spacing, voxels.collect())
}

/// One voxel with value 1, thickness 1 along y and 100 across.
fn slab() -> Volume {
    volume([1; 3], [100.0, 1.0, 100.0], vec![1.0])
}

fn constant(density: f64, albedo: f64, g: f64) -> Option<Medium> {
    Some(common::uniform_medium(density, albedo, g))
}

/// Vacuum in the dark, seen from above along y.
fn scene() -> Scene {
    let mut scene = common::empty_scene([4, 4], along([0.0, -1.0, 0.0]));
    scene.surfaces.normals = Normals::Analytic;
    scene
}

/// An orthographic camera at the origin's far side that looks along `direction`, `up` +z.
fn along(direction: [f64; 3]) -> Camera {
    Camera {
        eye: direction.map(|d| -20.0 * d),
        target: [0.0; 3],
        up: [0.0, 0.0, 1.0],
        projection: Projection::Orthographic { height: 1.0 },
    }
}

fn uniform_sky(radiance: f64) -> Environment {
    Environment {
        radiance: [radiance; 3],
        ..Environment::default()
    }
}

/// Radiance 1 from above, 0 from below.
fn upper_sky() -> Environment {
    let (width, height) = (4, 1024);
    let texels = (0..width * height)
        .map(|n| [if n < width * height / 2 { 1.0 } else { 0.0 }; 3])
        .collect();
    let image = Some(EnvironmentImage {
        width,
        height,
        texels,
    });
    Environment {
        image,
        ..Environment::default()
    }
}

fn lambert(value: f64, opacity: f64, albedo: f64) -> Isosurface {
    Isosurface {
        value,
        opacity,
        color: [albedo; 3],
        shading: Shading::Lambert,
    }
}

/// Samples a pixel of a 4×4 picture after which estimates in [0, 1] with this mean, which vary no more
/// than a coin does, are certain to be conclusive.
fn enough(exact: f64) -> u32 {
    let stderr = (1e-3 * exact).max(2e-4);
    (1.05 * exact * (1.0 - exact) / (stderr * stderr) / 16.0).ceil() as u32
}

/// The picture's average lies within 4 SE + 2e-4·exact, and its error is small enough to tell.
#[track_caller]
fn assert_average(picture: &Picture, exact: f64) {
    let (mean, stderr) = picture.average();
    for c in 0..3 {
        assert_estimate(mean[c], stderr[c], exact);
    }
}

#[track_caller]
fn assert_estimate(mean: f64, stderr: f64, exact: f64) {
    assert!(
        stderr <= (1e-3 * exact.abs()).max(2e-4),
        "inconclusive: {mean} ± {stderr}, exact {exact}"
    );
    assert!(
        (mean - exact).abs() <= 4.0 * stderr + 2e-4 * exact.abs(),
        "{mean} ± {stderr}, exact {exact}"
    );
}

/// Every pixel is exactly this, up to rounding: no path's estimate may differ.
#[track_caller]
fn assert_every_pixel(picture: &Picture, exact: f64) {
    for (n, pixel) in picture.mean.iter().enumerate() {
        for value in pixel {
            assert!(
                (value - exact).abs() < 1e-9,
                "pixel {n}: {pixel:?}, exact {exact}"
            );
        }
    }
}

/// Mean and standard error of `n` samples.
fn estimate(n: u32, mut sample: impl FnMut() -> f64) -> (f64, f64) {
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..n {
        let x = sample();
        sum += x;
        squares += x * x;
    }
    let n = n as f64;
    let mean = sum / n;
    (mean, ((squares / n - mean * mean).max(0.0) / n).sqrt())
}
