//! The GPU against the oracle, a path tracer so simple that it can be read in one sitting, wherever
//! Mitsuba has no say: `local` light, smooth normals, opacities, Phong, all of Disney, images of the
//! sky, clip planes, bounces that are counted, and every way to store a voxel.
//!
//! `cargo test --test transport oracle_gpu -- --nocapture` prints the figures.

use std::time::Instant;

use crate::support::oracle;
use crate::support::small_scenes::*;
use isolume::doctor::LIT_SURFACE;
use isolume::gpu::Shaders;
use isolume::render::shared;
use isolume::scene::*;

const WHITE: [f64; 3] = [1.0; 3];
const CLAY: [f64; 3] = [0.8, 0.5, 0.3];
const JADE: [f64; 3] = [0.3, 0.8, 0.5];
const FOG: [f64; 3] = [0.9, 0.8, 0.6];

fn assert_agreement(trial: Trial) {
    let shaders = Shaders::new(shared::glsl());
    let began = Instant::now();
    let oracle = trial.oracle();
    let oracle_seconds = began.elapsed().as_secs_f64();
    let comparison = trial.compare(&oracle, &shaders);
    let gpu_seconds = began.elapsed().as_secs_f64() - oracle_seconds;
    println!(
        "{:<23} oracle {oracle_seconds:4.1} s, GPU {gpu_seconds:4.1} s   image {}   worst tile {}",
        trial.name,
        comparison.worst_image(),
        comparison.worst_tile(),
    );
    let findings = comparison.findings();
    assert!(findings.is_empty(), "{}: {findings:#?}", trial.name);
}

#[test]
fn local_light_with_medium_and_surfaces() {
    let mut scene = scene();
    scene.medium = Some(medium(
        0.3,
        0.85,
        &[(10.0, 0.0, FOG), (35.0, 0.6, WHITE), (60.0, 0.2, JADE)],
    ));
    scene.surfaces.iso = vec![
        surface(40.0, 1.0, CLAY, Shading::Lambert),
        surface(25.0, 0.3, JADE, PHONG),
    ];
    scene.lights.suns = vec![
        sun([-0.5, -1.0, -0.3], [1.0, 0.9, 0.8]),
        sun([0.8, -0.2, -0.6], [0.2, 0.3, 0.4]),
    ];
    assert_agreement(Trial {
        name: "local light",
        scene,
        volume: hills(Storage::U8, [1.0; 3]),
        oracle_samples: 2000,
        gpu_samples: 3072,
        limits: within(0.005),
    });
}

#[test]
fn full_light_through_opacities() {
    let mut scene = scene();
    scene.medium = Some(medium(0.2, -0.6, &[(0.0, 0.0, WHITE), (50.0, 0.8, FOG)]));
    scene.surfaces.light = LightModel::Full;
    scene.surfaces.normals = Normals::Analytic;
    scene.surfaces.iso = vec![
        surface(22.0, 0.3, JADE, PHONG),
        surface(33.0, 0.6, CLAY, Shading::Lambert),
        surface(44.0, 1.0, FOG, DISNEY),
    ];
    scene.lights.suns = vec![sun([-0.5, -1.0, -0.3], [1.0, 0.9, 0.8])];
    scene.render.max_bounces = 5;
    assert_agreement(Trial {
        name: "full light, 5 bounces",
        scene,
        volume: hills(Storage::F32, [1.0, 0.7, 1.6]),
        oracle_samples: 6000,
        gpu_samples: 6144,
        limits: within(0.005),
    });
}

#[test]
fn disney_under_an_image() {
    let mut scene = scene();
    scene.surfaces.light = LightModel::Full;
    scene.surfaces.iso = vec![surface(30.0, 1.0, CLAY, DISNEY)];
    scene.lights.environment.image = Some(sky_with_a_sun(5.0));
    assert_agreement(Trial {
        name: "Disney",
        scene,
        volume: hills(Storage::U16, [1.2, 1.0, 0.8]),
        oracle_samples: 8000,
        gpu_samples: 12288,
        limits: within(0.005),
    });
}

#[test]
fn a_medium_under_an_image_and_three_suns() {
    let mut scene = scene();
    scene.medium = Some(medium(
        0.5,
        0.6,
        &[
            (5.0, 0.0, FOG),
            (25.0, 0.7, FOG),
            (45.0, 0.1, JADE),
            (60.0, 1.0, WHITE),
        ],
    ));
    scene.lights.environment.image = Some(sky_with_a_sun(8.0));
    scene.lights.suns = vec![
        sun([-0.5, -1.0, -0.3], [0.6, 0.5, 0.4]),
        sun([0.8, -0.2, -0.6], [0.2, 0.3, 0.4]),
        sun([0.1, 0.7, -0.7], [0.1, 0.4, 0.2]),
    ];
    assert_agreement(Trial {
        name: "image and suns",
        scene,
        volume: hills(Storage::U16, [1.0; 3]),
        oracle_samples: 4000,
        gpu_samples: 2304,
        limits: within(0.005),
    });
}

#[test]
fn cut_open_in_parallel_projection() {
    let mut scene = scene();
    scene.camera.projection = Projection::Orthographic { height: 18.0 };
    scene.clips = vec![clip([1.0, 0.6, 0.9], 3.0), clip([-0.3, -1.0, 0.2], 5.0)];
    scene.medium = Some(medium(
        0.4,
        0.0,
        &[
            (20.0, 0.0, FOG),
            (20.0, 0.3, FOG),
            (38.0, 0.3, FOG),
            (38.0, 1.0, JADE),
        ],
    ));
    scene.surfaces.iso = vec![surface(30.0, 0.5, CLAY, Shading::Lambert)];
    scene.lights.suns = vec![sun([-0.5, -1.0, -0.3], [1.0, 0.9, 0.8])];
    scene.render.max_bounces = 1;
    assert_agreement(Trial {
        name: "cut open, 1 bounce",
        scene,
        volume: hills(Storage::F32, [1.0, 1.3, 0.8]),
        oracle_samples: 4000,
        gpu_samples: 3072,
        limits: within(0.003),
    });
}

#[test]
fn from_within() {
    let mut scene = scene();
    scene.camera.eye = [1.0, 0.5, 2.0];
    scene.camera.target = [-3.0, -2.0, 0.0];
    scene.camera.projection = Projection::Perspective { fov_y: 70.0 };
    scene.medium = Some(medium(0.2, 0.85, &[(0.0, 0.1, FOG), (40.0, 1.0, WHITE)]));
    scene.surfaces.light = LightModel::Full;
    scene.surfaces.iso = vec![surface(38.0, 0.5, CLAY, PHONG)];
    scene.lights.environment.image = Some(sky_with_a_sun(3.0));
    scene.render.max_bounces = 2;
    assert_agreement(Trial {
        name: "from within, 2 bounces",
        scene,
        volume: hills(Storage::U8, [1.0; 3]),
        oracle_samples: 10000,
        gpu_samples: 6144,
        limits: within(0.005),
    });
}

#[test]
fn much_scattering() {
    let mut scene = scene();
    scene.medium = Some(medium(
        3.0,
        0.0,
        &[
            (15.0, 0.0, WHITE),
            (18.0, 1.0, FOG),
            (21.0, 0.0, WHITE),
            (40.0, 1.0, FOG),
        ],
    ));
    scene.lights.suns = vec![sun([-0.5, -1.0, -0.3], [1.0, 0.9, 0.8])];
    assert_agreement(Trial {
        name: "much scattering",
        scene,
        volume: hills(Storage::F32, [0.8; 3]),
        oracle_samples: 4000,
        gpu_samples: 4608,
        limits: within(0.003),
    });
}

/// `doctor` holds devices to it.
#[test]
fn the_doctor_knows_how_bright_a_lit_surface_is() {
    let (volume, mut scene) = isolume::doctor::lit_surface_scene().expect("a scene");
    scene.render.size = [16, 16];
    let ([red, ..], [stderr, ..]) = oracle::render(&scene, &volume, 4000, 7).average();
    println!("{red:.6} ± {stderr:.6}, to the doctor {LIT_SURFACE}");
    assert!(stderr < 1e-3 * red);
    assert!((red - LIT_SURFACE).abs() < 4.0 * stderr);
}

/// One line over the data: shaders read one voxel, drawn with the trilinear weights, instead of interpolating eight.
#[test]
fn a_straight_transfer_function() {
    let mut scene = scene();
    scene.medium = Some(medium(0.8, 0.4, &[(-20.0, 0.0, FOG), (80.0, 1.0, FOG)]));
    scene.lights.suns = vec![sun([-0.5, -1.0, -0.3], [1.5, 1.2, 1.0])];
    assert_agreement(Trial {
        name: "straight",
        scene,
        volume: hills(Storage::U16, [1.0, 1.3, 0.8]),
        oracle_samples: 4000,
        gpu_samples: 8192,
        limits: within(0.005),
    });
}
