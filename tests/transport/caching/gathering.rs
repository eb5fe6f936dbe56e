//! Young nodes gather what the cache shows so far: less work for no more noise, and forgotten in time.

use isolume::gpu::Shaders;
use isolume::render::{CacheLayout, Variant as RenderVariant};
use isolume::scene::volume::Volume;
use isolume::scene::*;

use crate::support::common::*;
use crate::support::fields::field;
use crate::support::small_scenes::sun;

fn scene() -> Scene {
    let camera = Camera {
        eye: [0.3, 0.2, 3.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height: 1.2 },
    };
    let mut scene = empty_scene([32, 32], camera);
    let mut medium = uniform_medium(20.0, 0.9, 0.0);
    medium.transfer[0].opacity = 0.0;
    medium.transfer.push(TransferPoint {
        value: 1.0,
        opacity: 1.0,
        color: [0.9; 3],
    });
    scene.medium = Some(medium);
    scene.lights.environment.radiance = [1.0; 3];
    scene.lights.suns = vec![DirectionalLight {
        direction: [0.3, -1.0, -0.4],
        irradiance: [3.0; 3],
    }];
    scene
}

/// A ball that is dense inside, of optical depth 10.
fn ball() -> Volume {
    field([32; 3], [1.0 / 32.0; 3], |p| {
        (1.0 - (p.as_vec3() / 15.5).length_squared()).max(0.0)
    })
}

fn empty(shaders: &Shaders, seed: u32) -> Cached {
    let volume = ball();
    let scene = scene_with_cache(&scene(), &volume, 0.5, CacheFormat::F16, seed);
    empty_cache(device(), shaders, &volume, scene)
}

fn filled(shaders: &Shaders, updates: u32, seed: u32) -> Cached {
    let mut cached = empty(shaders, seed);
    cached.fill(updates);
    cached
}

/// A cache whose nodes trace all of their paths to the end.
pub fn empty_without_gathering(
    scene: &Scene,
    volume: &Volume,
    format: CacheFormat,
    seed: u32,
) -> Cached {
    let scene = scene_with_cache(scene, volume, 0.5, format, seed);
    let RenderVariant::Caching(layout) = &scene.variant else {
        panic!("a scene without a cache");
    };
    let layout = CacheLayout {
        gathers: false,
        ..layout.clone()
    };
    empty_cache(device(), &shaders(), volume, scene.with_cache(layout))
}

fn filled_without_gathering(updates: u32, seed: u32) -> Cached {
    let mut cached = empty_without_gathering(&scene(), &ball(), CacheFormat::F16, seed);
    cached.fill(updates);
    cached
}

/// A gathered path counts for a traced one.
fn shaders_that_remember() -> Shaders {
    let text = include_str!("../../../glsl/merge_parts.comp");
    let [right, wrong] = ["turn.history", "float(turn.paths_before)"];
    shaders_with("merge_parts.comp", text, right, wrong)
}

/// Of four young caches, by their seeds, with so many paths a node: error of what they show, against `exact`, and reads of
/// the volume.
fn error_and_lookups(mut cached: Cached, updates: u32, exact: &[[f32; 4]]) -> [f64; 2] {
    let mut squares = 0.0;
    for seed in 1..=4 {
        cached.reseed(seed);
        cached.fill(updates);
        squares += rms_difference(&cached.march(), exact).powi(2);
    }
    [
        (squares / 4.0).sqrt(),
        cached.renderer.lookups() as f64 / 4.0,
    ]
}

#[test]
fn gathering_on_the_coarse_lattice_takes_less_work_for_less_noise() {
    let exact = filled_without_gathering(1024, 9).march();
    let [noise, work] = error_and_lookups(filled_without_gathering(0, 0), 4, &exact);
    let gathered = |shaders: &Shaders| error_and_lookups(empty(shaders, 0), 32, &exact);
    let [gathered_noise, gathered_work] = gathered(&shaders());
    let [remembered_noise, _] = gathered(&shaders_that_remember());
    println!(
        "traced: error {noise:.4}, {work} lookups; gathered: {gathered_noise:.4}, {gathered_work}; \
         without forgetting: {remembered_noise:.4}"
    );
    assert!(gathered_work < 0.75 * work);
    assert!(gathered_noise < 0.75 * noise && gathered_noise < remembered_noise);
}

#[test]
fn what_was_gathered_is_forgotten() {
    let mean = |picture: &[[f32; 4]]| picture.iter().map(|p| f64::from(p[0])).sum::<f64>();
    let exact = mean(&filled_without_gathering(4096, 1).march());
    let mut gathered = filled(&shaders(), 32, 2);
    let young = mean(&gathered.march()) / exact - 1.0;
    gathered.fill(4096);
    let bias = mean(&gathered.march()) / exact - 1.0;
    println!(
        "bias after 32 paths {:+.2} %, after 4096 {:+.3} %",
        100.0 * young,
        100.0 * bias
    );
    const SMALL: f64 = 5e-4;
    assert!(young.abs() > 2.0 * SMALL, "there is nothing to forget");
    assert!(bias.abs() < SMALL);
}

/// Whatever the order in which slots get to work.
#[test]
fn a_seed_decides_every_node() {
    let [a, b] = [0.5, 70.0].map(|slice_ms| {
        let mut cached = empty(&shaders(), 1);
        cached.renderer.set_slice_ms(slice_ms);
        cached.fill(16);
        cached.march()
    });
    assert!(a == b);
}

/// The cache holds one share of all suns' light, which does not tell a red sun from a blue one.
#[test]
fn suns_of_unlike_colors_are_told_apart() {
    let mut scene = scene();
    scene.medium.as_mut().expect("a medium").density = 2.0;
    scene.lights.environment.radiance = [0.0; 3];
    let red_and_blue = [
        ([-1.0, 0.0, 0.0], [3.0, 0.0, 0.0]),
        ([1.0, 0.0, 0.0], [0.0, 0.0, 3.0]),
    ];
    scene.lights.suns = red_and_blue
        .map(|(direction, color)| sun(direction, color))
        .into();
    let volume = ball();
    // The side that the red sun does not see.
    let red = |picture: &[[f32; 4]]| -> f64 {
        let pixels = picture.iter().enumerate();
        let dark = pixels.filter(|(i, _)| i % 32 < 12);
        dark.map(|(_, pixel)| f64::from(pixel[0])).sum()
    };
    let exact = red(&render(&scene, &volume, 64, 128, 1).mean);
    let mut cached = cached(&scene, &volume, 0.5, CacheFormat::F16, 0, 0);
    let shown = |seed| {
        cached.reseed(seed);
        cached.fill(16);
        red(&cached.at_rest(16, 1).mean) / exact - 1.0
    };
    let errors: Vec<f64> = (1..=2).map(shown).collect();
    let mean = errors.iter().sum::<f64>() / 2.0;
    println!("{mean:+.4}, of {errors:?}");
    assert!(mean.abs() < 0.03, "{mean}");
}
