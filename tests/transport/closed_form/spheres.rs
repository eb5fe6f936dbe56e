//! Spheres of radius 1. The field is −r² in voxels, and the transfer function a step: its surface
//! V = −R² − ½ lies on the sphere, to within 1/8R of a voxel and exactly in the mean, since
//! trilinear interpolation of r² adds t(1 − t) along each axis, whose mean is 1/6.

use std::f64::consts::PI;

use isolume::scene::volume::Volume;
use isolume::scene::*;

use crate::support::common::*;
use crate::support::exact::{Strips, expect, verdict};
use crate::support::fields;

/// Voxels along a side, and the sphere's radius in voxels.
const SIZE: u32 = 64;
const RADIUS: f64 = 30.0;
/// What interpolation adds to r².
const EXCESS: f64 = 0.5;

fn field() -> Volume {
    fields::field([SIZE; 3], [1.0 / RADIUS; 3], |p| -p.length_squared() as f32)
}

/// Value at a distance from the centre, in radii.
fn value_at(r: f64) -> f64 {
    -(r * RADIUS).powi(2) - EXCESS
}

/// Extinction `rim` at the surface, linear in r², `center` at the centre; nothing outside.
fn sphere(rim: f64, center: f64, albedo: [f64; 3], g: f64) -> Medium {
    let density = rim.max(center);
    let point = |r, opacity| TransferPoint {
        value: value_at(r),
        opacity,
        color: albedo,
    };
    Medium {
        g,
        ..Medium::isotropic(
            density,
            vec![
                point(1.0, 0.0),
                point(1.0, rim / density),
                point(0.0, center / density),
            ],
        )
    }
}

/// The sphere just fills the picture, in a white furnace: each pixel shows what is not absorbed.
fn scene(medium: Medium) -> Scene {
    let camera = Camera {
        eye: [0.3, 2.0, 1.7],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height: 2.0 },
    };
    let mut scene = empty_scene([32, 32], camera);
    scene.lights.environment.radiance = [1.0; 3];
    scene.medium = Some(medium);
    scene
}

/// Its projection is π/4 of the picture.
fn expect_absorptance(depth: f64, albedo: [f64; 3], absorptance: [f64; 3]) {
    let scene = scene(sphere(depth, depth, albedo, 0.0));
    expect(
        "sphere",
        &scene,
        &field(),
        absorptance.map(|a| 1.0 - 0.25 * PI * a),
    );
}

/// By symmetry parallel rays see what diffuse light would lose.
#[test]
fn absorptance_of_scattering_spheres() {
    expect_absorptance(1.0, [0.5, 0.9, 0.99], [0.457743, 0.121994, 0.013210]);
    expect_absorptance(5.0, [0.5, 0.9, 0.99], [0.794805, 0.376515, 0.061463]);
}

#[test]
fn transmittance_of_absorbing_spheres() {
    for (depth, transmittance) in [(0.1, 0.876155), (1.0, 0.296997), (5.0, 0.019990)] {
        expect_absorptance(depth, [0.0; 3], [1.0 - transmittance; 3]);
    }
}

/// However it scatters, diffuse light stays in a body for a mean path of 4V/S, and as long anywhere:
/// the mean number of collisions is 4/S·∫σ dV. What colours of albedo 1 − ε and 1 − 2ε lose
/// is that number times ε and 2ε; together they cancel the term in ε².
#[test]
fn mean_path_length() {
    const LOSS: f64 = 0.005;
    let (rim, center, g) = (0.4, 3.0, 0.6);
    let collisions = 4.0 * (center / 3.0 + (rim - center) / 5.0);
    let albedo = [1.0 - LOSS, 1.0 - 2.0 * LOSS, 1.0];
    let mut patches = Strips::new(&scene(sphere(rim, center, albedo, g)), &field(), 1, 32);
    let count = |[once, twice, _]: [f64; 3]| {
        (4.0 * (1.0 - once) - (1.0 - twice)) / (2.0 * LOSS) / (0.25 * PI)
    };
    patches.render_until(|patches| patches.estimate(0, count).is_conclusive(collisions));
    verdict("collisions", patches.estimate(0, count), collisions);
    verdict("white", patches.estimate(0, |[_, _, white]| white), 1.0);
}
