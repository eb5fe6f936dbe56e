//! A ray through noise crosses a thin surface hundreds of times, and at each crossing light is looked for.

use std::f64::consts::PI;

use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

use crate::hard_cases::quadrature::orthographic;
use crate::support::common::*;
use crate::support::small_scenes::sun;

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
    let mut scene = empty_scene([16, 16], orthographic([0.0, 0.0, 2000.0], 1.0));
    scene.medium = Some(uniform_medium(SIGMA_T, 0.0, 0.0));
    scene.surfaces.light = light;
    scene.surfaces.normals = Normals::Analytic;
    scene.surfaces.iso = vec![Isosurface {
        value: 0.5,
        opacity: OPACITY,
        shading: Shading::Lambert,
        color: [COLOR; 3],
    }];
    let direction = [(1.0 - COSINE * COSINE).sqrt(), 0.0, -COSINE];
    scene.lights.suns = vec![sun(direction, [IRRADIANCE; 3])];
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

#[test]
fn a_thousand_thin_layers_under_a_sun() {
    for light in [LightModel::Local, LightModel::Full] {
        let (scene, volume) = (scene(light), layers());
        let exact = radiance(light);
        let paths = mean_red(&render(&scene, &volume, 1, 64, 1).mean);
        let mut cached = cached(&scene, &volume, 0.5, CacheFormat::F16, 1, 1);
        let moving = mean_red(&cached.march());
        let resting = mean_red(&cached.at_rest(1, 64).mean);
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

/// Of two surfaces whose isovalues are next to each other in 32 bits, or that are one value in them, each reflects and stops
/// its share of the light, as of two that are further apart.
#[test]
fn surfaces_at_one_place_share_the_light() {
    let ball = |[x, y, z]: [u32; 3]| {
        let from_middle = [x, y, z].map(|i| (f64::from(i) - 7.6).powi(2));
        (1.0 / (0.2 + 0.1 * from_middle.iter().sum::<f64>())) as f32
    };
    let voxels = (0..16 * 16 * 16).map(|i| ball([i % 16, i / 16 % 16, i / 256]));
    let volume = Volume::from_values([16; 3], [1.0; 3], Voxels::F32(voxels.collect()));
    let volume = volume.expect("a volume");
    let mean = |second: f64| {
        let mut scene = empty_scene([16, 16], orthographic([0.0, 0.0, 40.0], 3.0));
        scene.surfaces.light = LightModel::Full;
        scene.surfaces.iso = [0.5, second]
            .map(|value| Isosurface {
                value,
                opacity: 0.5,
                shading: Shading::Lambert,
                color: [COLOR; 3],
            })
            .to_vec();
        scene.lights.environment.radiance = [1.0; 3];
        mean_red(&render(&scene, &volume, 1, 64, 1).mean)
    };
    let apart = mean(0.50001);
    for second in [f64::from(0.5_f32.next_up()), 0.5 + 1e-12] {
        let together = mean(second);
        let error = together / apart - 1.0;
        assert!(error.abs() < 1e-3, "{second}: {error:+.5}");
    }
}
