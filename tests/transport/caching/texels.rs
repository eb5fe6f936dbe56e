//! A CPU's driver loads texels from storage images, a GPU fetches them through its texture units: the same
//! shaders make the same picture of both, to the last bit. The volume has 8 bits, of which lavapipe's
//! filter is too coarse to be used. No two pictures are alike where loops pass lavapipe's limit
//! (`src/render/path_queue.rs`): those around a surface once did.

use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

use crate::support::common::*;

fn noise() -> Volume {
    let mut noise = fastrand::Rng::with_seed(9);
    let values = (0..12 * 10 * 9).map(|_| noise.u8(..)).collect();
    Volume::from_values([12, 10, 9], [0.1; 3], Voxels::U8(values)).expect("a volume")
}

fn scene(g: f64, with_surface: bool) -> Scene {
    let camera = Camera {
        eye: [1.0, 1.5, 2.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Perspective { fov_y: 40.0 },
    };
    let mut scene = empty_scene([24, 24], camera);
    let point = |value: f64, opacity: f64, color: [f64; 3]| TransferPoint {
        value,
        opacity,
        color,
    };
    scene.medium = Some(Medium {
        g,
        ..Medium::isotropic(
            8.0,
            vec![
                point(40.0, 0.0, [0.9, 0.8, 0.6]),
                point(120.0, 1.0, [0.9, 0.8, 0.6]),
                point(200.0, 0.3, [0.3, 0.6, 0.9]),
            ],
        )
    });
    scene.lights.environment.radiance = [0.5, 0.6, 0.7];
    scene.lights.environment.image = Some(EnvironmentImage {
        width: 4,
        height: 2,
        texels: (0..8).map(|i| [0.1 * i as f32; 3]).collect(),
    });
    scene.lights.suns = vec![DirectionalLight {
        direction: [-0.5, -1.0, -0.3],
        irradiance: [2.0; 3],
    }];
    if with_surface {
        scene.surfaces.light = LightModel::Full;
        scene.surfaces.iso = vec![Isosurface {
            value: 180.0,
            opacity: 0.6,
            color: [0.8, 0.5, 0.3],
            shading: Shading::Lambert,
        }];
    }
    scene
}

/// In motion and at rest.
fn pictures(fetches: bool, scene: &Scene, format: CacheFormat) -> [Vec<[f32; 4]>; 2] {
    let device = device_that_fetches(fetches);
    let volume = noise();
    let scene = scene_with_cache(scene, &volume, 0.5, format, 1);
    let mut cached = empty_cache(device, &shaders(), &volume, scene);
    cached.fill(4);
    [cached.march(), cached.at_rest(2, 4).mean]
}

#[test]
fn loaded_and_fetched_texels_are_the_same() {
    let device = device_that_fetches(false);
    assert_eq!(device.loads_texels, device.summary.kind.is_software());
    assert!(!device_that_fetches(true).loads_texels);
    for (g, with_surface, format) in [
        (0.0, false, CacheFormat::F16),
        (0.0, true, CacheFormat::F32),
        (0.5, true, CacheFormat::F16),
    ] {
        let scene = scene(g, with_surface);
        let [loaded, fetched] = [false, true].map(|fetches| pictures(fetches, &scene, format));
        assert!(loaded.iter().flatten().any(|pixel| pixel[0] > 0.1));
        assert!(loaded == fetched, "g = {g}, with a surface: {with_surface}");
    }
}
