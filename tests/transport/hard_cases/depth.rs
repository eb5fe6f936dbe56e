//! Optical depths from next to nothing to next to everything.

use isolume::scene::*;

use crate::hard_cases::quadrature::orthographic;
use crate::support::common::*;
use crate::support::exact::expect;

/// A slab of thickness 1, seen along its normal in a white furnace.
fn slab(depth: f64, albedo: [f64; 3], size: u32) -> Scene {
    let mut scene = empty_scene([size; 2], orthographic([0.0, 0.0, 2.0], 1.0));
    scene.lights.environment.radiance = [1.0; 3];
    let mut medium = uniform_medium(depth, 1.0, 0.0);
    medium.transfer[0].color = albedo;
    scene.medium = Some(medium);
    scene
}

fn expect_slab(depth: f64, albedo: [f64; 3], exact: [f64; 3]) {
    let volume = constant_field(1.0, [1, 1, 1], [100.0, 100.0, 1.0]);
    expect("slab", &slab(depth, albedo, 32), &volume, exact);
}

#[test]
fn thin_media() {
    for depth in [1e-6, 1e-3] {
        // What albedo .999 loses is beyond measurement.
        expect_slab(depth, [0.0, 0.999, 1.0], [(-depth).exp(), 1.0, 1.0]);
    }
}

/// What comes back of a beam is a half-space's reflectance, 1 − √(1 − a)·H(1), as thick as it may be.
#[test]
fn thick_media() {
    expect_slab(30.0, [0.0, 0.5, 0.9], [0.0, 0.115226, 0.414947]);
    expect_slab(1e3, [0.0, 0.8, 0.99], [0.0, 0.285255, 0.752721]);
    expect_slab(1e5, [0.999; 3], [0.912845; 3]);
}

/// A path here collides a hundred thousand times on average, and none is given up.
#[test]
fn a_thick_white_medium_loses_nothing() {
    let volume = constant_field(1.0, [1, 1, 1], [1.0; 3]);
    for pixel in render(&slab(1e5, [1.0; 3], 8), &volume, 1, 1, 1).mean {
        assert!((pixel[0] - 1.0).abs() < 1e-5, "{pixel:?}");
    }
}
