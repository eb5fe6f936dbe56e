//! The published baseline (`src/render/published`): where its choices do not matter it agrees with
//! what is known, and it takes the memory that the paper says.

use std::f64::consts::PI;

use isolume::gpu::Memory;
use isolume::render::{GpuScene, Plan, Renderer, Until};
use isolume::scene::volume::Volume;
use isolume::scene::*;

use crate::support::common::*;
use crate::support::fields::field;
use crate::support::small_scenes::{medium, sun, surface};

const SIDE: u32 = 16;

fn block() -> Volume {
    constant_field(1.0, [SIDE; 3], [1.0 / f64::from(SIDE); 3])
}

/// A cube of medium that fills about half of the picture, under a sky of 1.
fn scene(medium: Medium) -> Scene {
    let camera = Camera {
        eye: [0.6, 0.8, 3.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Perspective { fov_y: 30.0 },
    };
    let mut scene = empty_scene([32, 32], camera);
    scene.lights.environment.radiance = [1.0; 3];
    scene.medium = Some(medium);
    scene
}

/// The picture after `updates` paths a cell, on average.
fn publish(scene: Scene, volume: &Volume, updates: u32) -> Vec<[f32; 4]> {
    publish_after(|_| (), scene, volume, updates)
}

fn publish_after(
    prepare: impl FnOnce(&mut Renderer),
    mut scene: Scene,
    volume: &Volume,
    updates: u32,
) -> Vec<[f32; 4]> {
    scene.render.variant = Variant::Published;
    let device = device();
    let memory = Memory::new(&device, BUDGET).expect("memory");
    let scene = GpuScene::new(&scene, volume, 3);
    let mut renderer = Renderer::new(&memory, volume, scene).expect("a renderer");
    prepare(&mut renderer);
    while renderer.totals().samples < updates {
        assert!(renderer.unit(1, Until::NEVER).expect("a round"));
    }
    let film = renderer.film().expect("a film");
    assert_silent(&device);
    let unknown = film.stderr.iter().flatten().all(|s| *s == f32::INFINITY);
    assert!(unknown, "it does not know its error");
    film.mean
}

fn brightness(picture: &[[f32; 4]]) -> f64 {
    let sum: f64 = picture.iter().map(|pixel| f64::from(pixel[1])).sum();
    sum / picture.len() as f64
}

#[test]
fn a_white_furnace_is_white() {
    let mut scene = scene(uniform_medium(2.0, 1.0, 0.4));
    scene.clips.push(ClipPlane {
        normal: [1.0, 0.0, 0.0],
        offset: 0.3,
    });
    for pixel in publish(scene, &block(), 16) {
        assert!((pixel[1] - 1.0).abs() < 0.02, "{pixel:?}");
    }
}

#[test]
fn medium_under_a_sky_looks_as_in_our_model() {
    let scene = scene(uniform_medium(3.0, 0.8, 0.0));
    let ours = brightness(&render(&scene, &block(), 4, 32, 1).mean);
    let theirs = brightness(&publish(scene, &block(), 64));
    println!("published {theirs:.4}, non-caching {ours:.4}");
    assert!(ours < 0.95, "the medium can be seen: {ours}");
    assert!(
        (theirs / ours - 1.0).abs() < 0.05,
        "published {theirs}, non-caching {ours}"
    );
}

/// A cone of the sun's fluence stands for the sun.
#[test]
fn a_sun_brings_as_much_light_to_medium() {
    let mut scene = scene(uniform_medium(1.0, 0.8, 0.0));
    scene.lights.environment.radiance = [0.0; 3];
    scene.lights.suns.push(DirectionalLight {
        direction: [0.0, -1.0, 0.0],
        irradiance: [10.0; 3],
    });
    let ours = brightness(&render(&scene, &block(), 4, 32, 1).mean);
    let theirs = brightness(&publish(scene, &block(), 256));
    println!("published {theirs:.4}, non-caching {ours:.4}");
    assert!(
        (theirs / ours - 1.0).abs() < 0.05,
        "published {theirs}, non-caching {ours}"
    );
}

/// Where no medium hides it, a sphere's silhouette is that of our exact hits, to a few pixels at its
/// edge.
#[test]
fn its_silhouette_is_a_spheres() {
    let spacing = [1.0 / f64::from(SIDE); 3];
    let ball = field([SIDE; 3], spacing, |p| (8.0 - p.length()) as f32);
    let mut scene = scene(uniform_medium(1.0, 0.8, 0.0));
    scene.medium = None;
    scene.surfaces.iso.push(Isosurface {
        value: 2.5,
        opacity: 1.0,
        color: [0.5; 3],
        shading: Shading::Lambert,
    });
    scene.render.background = Background::Transparent;
    let hits = first_hits(&scene, &ball);
    let picture = publish(scene, &ball, 1);
    let pairs = picture.iter().zip(&hits.normal_depth);
    let differ = pairs.filter(|(pixel, hit)| (pixel[3] == 1.0) != hit[3].is_finite());
    let differ = differ.count();
    assert!(differ < 10, "{differ} pixels differ");
    // By the headlight, a Lambert surface that faces the camera shows its colour.
    assert!((picture[16 * 32 + 16][1] - 0.5).abs() < 0.05);
}

/// The sun's light reaches a surface through any medium; only what the surface reflects is attenuated.
#[test]
fn a_surface_is_lit_as_in_vacuum_and_seen_through_the_medium_in_front_alone() {
    const DENSITY: f64 = 6.0;
    const MIDDLE: usize = 16 * 33 + 16;
    const ISOVALUE: f64 = 2.5;
    let (color, irradiance) = ([0.5, 0.7, 0.9], [3.0, 2.0, 1.0]);
    let spacing = [1.0 / f64::from(SIDE); 3];
    let ball = field([SIDE; 3], spacing, |p| (8.0 - p.length()) as f32);
    let scene = |opacity_within: f64| {
        let camera = Camera {
            eye: [0.0, 0.0, 2.0],
            target: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            projection: Projection::Orthographic { height: 1.0 },
        };
        let mut scene = empty_scene([33, 33], camera);
        // A voxel behind the surface, since its depth errs towards the back.
        let black = [0.0; 3];
        let points = [
            (0.0, 1.0, black),
            (ISOVALUE + 1.0, 1.0, black),
            (ISOVALUE + 1.0, opacity_within, black),
        ];
        scene.medium = Some(medium(DENSITY, 0.0, &points));
        scene.surfaces.iso = vec![surface(ISOVALUE, 1.0, color, Shading::Lambert)];
        scene.lights.suns = vec![sun([-0.5, -0.3, -0.8], irradiance)];
        scene
    };
    let dense = scene(1.0);
    let [x, y, z, depth] = first_hits(&dense, &ball).normal_depth[MIDDLE].map(f64::from);
    let [sun_x, sun_y, sun_z] = dense.lights.suns[0].direction;
    let cosine = -(x * sun_x + y * sun_y + z * sun_z);
    // From the eye to the box it is 1.5.
    let transmittance = (-DENSITY * (depth - 1.5)).exp();
    let seen = publish(dense, &ball, 32)[MIDDLE];
    println!(
        "{seen:?} at a depth of {depth}, {cosine:.3} of the sun's light, {transmittance:.3} of it seen"
    );
    for c in 0..3 {
        let exact = color[c] * cosine * irradiance[c] / PI * transmittance;
        let error = f64::from(seen[c]) / exact - 1.0;
        assert!(error.abs() < 0.02, "channel {c}: {error:+.3}");
    }
    assert_eq!(publish(scene(0.0), &ball, 32)[MIDDLE], seen);
}

#[test]
fn it_takes_56_bytes_a_voxel() {
    let device = device();
    let plan = |scene: &Scene| {
        let scene = GpuScene::new(scene, &block(), 0);
        Plan::new(&device, &device.summary, &scene).expect("a plan")
    };
    let mut scene = scene(uniform_medium(1.0, 0.8, 0.0));
    let without = plan(&scene);
    scene.render.variant = Variant::Published;
    let with = plan(&scene);
    assert_eq!(
        (with.variant.word(), without.variant.word()),
        ("published", "non-caching")
    );
    let cells = with
        .resources
        .iter()
        .filter(|r| r.name.starts_with("published: "));
    let bytes: u64 = cells.map(|r| r.bytes).sum();
    assert_eq!(bytes, 56 * u64::from(SIDE).pow(3));
    assert_eq!(with.bytes(), without.bytes() + bytes);
}

#[test]
fn a_warm_up_leaves_nothing_behind() {
    let scene = scene(uniform_medium(3.0, 0.8, 0.0));
    let warm_up = |renderer: &mut Renderer| renderer.warm_up().expect("a warm-up");
    let warm = publish_after(warm_up, scene.clone(), &block(), 4);
    assert_eq!(warm, publish(scene, &block(), 4));
}
