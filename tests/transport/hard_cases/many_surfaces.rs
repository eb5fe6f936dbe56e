//! A ray through noise crosses a thin surface hundreds of times, and at each crossing light is looked for.

use std::f64::consts::PI;

use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

use crate::support::common::*;

const LAYERS: u32 = 1000;
const OPACITY: f64 = 0.003;
const SIGMA_T: f64 = 0.0005;
const COLOR: f64 = 0.8;
const IRRADIANCE: f64 = 10.0;
/// Cosine between the sun and the layers' normals.
const COSINE: f64 = 0.8;

/// Voxels of thickness 1 along z, every other of which is inside the surface.
fn layers() -> Volume {
    let values = (0..LAYERS).map(|z| (z % 2) as f32).collect();
    Volume::from_values([1, 1, LAYERS], [1e4, 1e4, 1.0], Voxels::F32(values)).expect("a volume")
}

fn scene(light: LightModel) -> Scene {
    let camera = Camera {
        eye: [0.0, 0.0, 2000.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height: 1.0 },
    };
    let mut scene = empty_scene([16, 16], camera);
    scene.medium = Some(uniform_medium(SIGMA_T, 0.0, 0.0));
    scene.surfaces.light = light;
    scene.surfaces.normals = Normals::Analytic;
    scene.surfaces.iso = vec![Isosurface {
        value: 0.5,
        opacity: OPACITY,
        shading: Shading::Lambert,
        color: [COLOR; 3],
    }];
    scene.lights.suns = vec![DirectionalLight {
        direction: [(1.0 - COSINE * COSINE).sqrt(), 0.0, -COSINE],
        irradiance: [IRRADIANCE; 3],
    }];
    scene.render.max_bounces = 1;
    scene
}

/// The crossings are 1, 2, … below the top.
fn radiance(light: LightModel) -> f64 {
    let reflected = |layer: u32| {
        let depth = f64::from(layer);
        let rays_through = match light {
            LightModel::Local => 1.0,
            LightModel::Full => 2.0,
        };
        let passed = (1.0 - OPACITY).powf(rays_through * (depth - 1.0));
        passed * (-SIGMA_T * depth * (1.0 + 1.0 / COSINE)).exp()
    };
    let sum: f64 = (1..LAYERS).map(reflected).sum();
    OPACITY * COLOR / PI * IRRADIANCE * COSINE * sum
}

fn mean(pixels: &[[f32; 4]]) -> f64 {
    pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() / pixels.len() as f64
}

#[test]
fn a_thousand_thin_layers_under_a_sun() {
    for light in [LightModel::Local, LightModel::Full] {
        let (scene, volume) = (scene(light), layers());
        let exact = radiance(light);
        let paths = mean(&render(&scene, &volume, 1, 64, 1).mean);
        let mut cached = cached(&scene, &volume, 0.5, CacheFormat::F16, 1, 1);
        let moving = mean(&cached.march());
        let resting = mean(&cached.at_rest(1, 64).mean);
        println!("{light:?}: of {exact:.4}: {paths:.4}, moving {moving:.4}, at rest {resting:.4}");
        let mut pictures = vec![("paths", paths), ("at rest", resting)];
        if light == LightModel::Local {
            // In `full` light the cache adds what layers reflect to one another, without the limit of bounces.
            pictures.push(("moving", moving));
        }
        for (what, mean) in pictures {
            let error = mean / exact - 1.0;
            assert!(error.abs() < 0.02, "{light:?}, {what}: {error:+.4}");
        }
    }
}
