//! What a straight ray shows: attenuation, the mean over a pixel, and single scattering.

use std::f64::consts::PI;

use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

use crate::support::common::*;
use crate::support::exact::{expect, expect_strips};

/// A row of voxels along x; the box is as wide as `width`, its depth along z is 1.
fn row(values: &[f32], width: f64, height: f64) -> Volume {
    let dims = [values.len() as u32, 1, 1];
    let spacing = [width / values.len() as f64, height, 1.0];
    Volume::from_values(dims, spacing, Voxels::F32(values.to_vec())).expect("a volume")
}

/// Looks along −z, with the picture `height` high.
fn facing(height: f64) -> Camera {
    Camera {
        eye: [0.0, 0.0, 2.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height },
    }
}

/// Opacity is the value.
fn proportional_medium(density: f64) -> Medium {
    let point = |value: f64| TransferPoint {
        value,
        opacity: value,
        color: [0.0; 3],
    };
    Medium::isotropic(density, vec![point(0.0), point(1.0)])
}

/// Mean of `of` over the i-th of `n` strips of a row, each point of which has the value that the
/// contract gives it.
fn mean_over_strip(values: &[f32], i: usize, n: usize, of: impl Fn(f64) -> f64) -> f64 {
    const POINTS: usize = 100_000;
    let last = values.len() - 1;
    let at = |k: usize| {
        let x = (i as f64 + (k as f64 + 0.5) / POINTS as f64) / n as f64;
        let v = (x * values.len() as f64 - 0.5).clamp(0.0, last as f64);
        let low = v.floor() as usize;
        let [a, b] = [values[low], values[(low + 1).min(last)]].map(f64::from);
        of(a + v.fract() * (b - a))
    };
    (0..POINTS).map(at).sum::<f64>() / POINTS as f64
}

#[test]
fn attenuation() {
    const DENSITY: f64 = 6.0;
    let depths = [1e-6, 1e-3, 0.1, 0.5, 1.0, 2.0, 3.0, DENSITY];
    let values: Vec<f32> = depths
        .iter()
        .flat_map(|d| [(d / DENSITY) as f32; 3])
        .collect();
    let mut scene = empty_scene([8 * 32, 32], facing(1.0));
    scene.lights.environment.radiance = [1.0; 3];
    scene.medium = Some(proportional_medium(DENSITY));
    let exact = |i| [mean_over_strip(&values, i, 8, |v| (-DENSITY * v).exp()); 3];
    let exact: Vec<[f64; 3]> = (0..8).map(exact).collect();
    expect_strips("depths", &scene, &row(&values, 8.0, 1.0), &exact);
}

/// A thousand mean free paths: not one of two million rays may come through.
#[test]
fn opaque() {
    let mut scene = empty_scene([64, 64], facing(1.0));
    scene.lights.environment.radiance = [1.0; 3];
    scene.medium = Some(proportional_medium(1e3));
    let film = render(&scene, &row(&[1.0], 1.0, 1.0), 2, 256, 1);
    assert!(film.mean.iter().all(|pixel| pixel[0] == 0.0));
}

/// Every pixel is half covered by a depth of 10. The mean is that of transmittances, not the
/// transmittance of the mean depth, e⁻⁵.
#[test]
fn half_covered_pixels() {
    let mut scene = empty_scene([1, 64], facing(64.0));
    scene.lights.environment.radiance = [1.0; 3];
    let point = |value, opacity| TransferPoint {
        value,
        opacity,
        color: [0.0; 3],
    };
    scene.medium = Some(Medium::isotropic(
        10.0,
        vec![point(0.5, 0.0), point(0.5, 1.0)],
    ));
    expect("half", &scene, &row(&[0.0, 1.0], 1.0, 64.0), [0.5000227; 3]);
}

/// A slab of thickness 1 with normal +y under a sun that shines straight down; each path scatters once.
fn lit_slab(towards_eye: [f64; 3], depth: f64, g: f64, irradiance: f64) -> Scene {
    let camera = Camera {
        eye: towards_eye.map(|c| 20.0 * c),
        target: [0.0; 3],
        up: [0.0, 0.0, 1.0],
        projection: Projection::Orthographic { height: 1.0 },
    };
    let mut scene = empty_scene([32, 32], camera);
    scene.medium = Some(uniform_medium(depth, 1.0, g));
    scene.lights.suns = vec![DirectionalLight {
        direction: [0.0, -1.0, 0.0],
        irradiance: [irradiance, 0.5 * irradiance, 0.0],
    }];
    scene.render.max_bounces = 1;
    scene
}

fn wide_slab() -> Volume {
    constant_field(1.0, [1, 1, 1], [100.0, 1.0, 100.0])
}

fn expect_single_scattering(scene: Scene, radiance: f64) {
    let exact = [radiance, 0.5 * radiance, 0.0];
    expect("single scattering", &scene, &wide_slab(), exact);
}

#[test]
fn single_scattering_on_the_lit_side() {
    let towards_eye = [0.75f64.sqrt(), 0.5, 0.0];
    let scene = lit_slab(towards_eye, 1.0, 0.0, 10.0);
    expect_single_scattering(scene, 0.504104);
}

#[test]
fn single_scattering_on_the_unlit_side() {
    let scene = lit_slab([0.0, -1.0, 0.0], 1.0, 0.0, 10.0);
    expect_single_scattering(scene, 0.292749);
}

/// Straight on, and straight back: the ends of the phase function.
#[test]
fn single_scattering_is_forward_for_positive_g() {
    let g: f64 = 0.5;
    let forward = (1.0 - g * g) / (4.0 * PI * (1.0 - g).powi(3));
    let backward = (1.0 - g * g) / (4.0 * PI * (1.0 + g).powi(3));
    let below = lit_slab([0.0, -1.0, 0.0], 1.0, g, 1.0);
    expect_single_scattering(below, forward * (-1.0f64).exp());
    let above = lit_slab([0.0, 1.0, 0.0], 1.0, g, 10.0);
    expect_single_scattering(above, 10.0 * backward * 0.5 * (1.0 - (-2.0f64).exp()));
}

/// Of thin media transmittance says nothing; what they scatter does.
#[test]
fn single_scattering_of_thin_media() {
    for (depth, radiance) in [(1e-2, 0.1), (1e-3, 0.02), (1e-4, 0.005)] {
        let scattered = 0.5 * -f64::exp_m1(-2.0 * depth) / (4.0 * PI);
        let mut scene = lit_slab([0.0, 1.0, 0.0], depth, 0.0, radiance / scattered);
        scene.render.size = [64, 64];
        expect_single_scattering(scene, radiance);
    }
}
