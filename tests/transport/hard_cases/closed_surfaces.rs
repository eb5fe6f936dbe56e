//! A path in a surface that absorbs nothing is reflected until it finds the way out, if there is one.

use std::time::{Duration, Instant};

use isolume::gpu::Memory;
use isolume::render::{GpuScene, Renderer, Until};
use isolume::scene::*;

use crate::support::common::*;
use crate::support::fields::field;

const RADIUS: f64 = 24.0;

/// The inside of a white sphere, seen from its middle, without what lies beyond `offset` on the x axis.
fn mean_radiance(offset: f64) -> f64 {
    let device = device();
    let volume = field([64; 3], [1.0; 3], |p| p.length() as f32);
    let camera = Camera {
        eye: [0.0; 3],
        target: [-1.0, 0.0, 0.0],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Perspective { fov_y: 60.0 },
    };
    let mut scene = empty_scene([48, 48], camera);
    scene.lights.environment.radiance = [1.0; 3];
    scene.surfaces.light = LightModel::Full;
    scene.surfaces.normals = Normals::Analytic;
    scene.surfaces.iso = vec![Isosurface {
        value: RADIUS,
        opacity: 1.0,
        shading: Shading::Lambert,
        color: [1.0; 3],
    }];
    scene.clips = vec![ClipPlane {
        normal: [1.0, 0.0, 0.0],
        offset,
    }];
    let memory = Memory::new(&device, BUDGET).expect("memory");
    let gpu_scene = GpuScene::new(&scene, &volume, 1);
    let mut renderer =
        Renderer::with_shaders(&memory, &shaders(), &volume, gpu_scene).expect("a renderer");
    let until = Until {
        deadline: Some(Instant::now() + Duration::from_secs(300)),
        ..Until::NEVER
    };
    assert!(renderer.unit(2, until).expect("a unit"), "paths go on");
    let mean = mean_red(&renderer.film().expect("a film").mean);
    assert_silent(&device);
    mean
}

#[test]
fn paths_end_in_a_closed_white_surface() {
    assert_eq!(mean_radiance(2.0 * RADIUS), 0.0);
}

/// The opening is a 600th of the surface: paths leave it after as many reflections on average, with the sky's radiance.
#[test]
fn a_small_opening_lights_a_white_surface_as_the_sky() {
    let mean = mean_radiance(RADIUS * (1.0 - 2.0 / 600.0));
    println!("{mean}");
    assert!((mean - 1.0).abs() < 0.03, "{mean}");
}
