//! Where a face of the box or a clip plane ends a dense medium, light falls steeply behind it, within less than a cell of
//! the cache and less than a step of a march.

use isolume::render::Film;
use isolume::scene::*;

use crate::support::common::*;

/// A cube of 16³ voxels of size 1, seen from a corner: three faces show.
fn scene(optical_depth_of_a_voxel: f64) -> Scene {
    let camera = Camera {
        eye: [30.0, 40.0, 60.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height: 26.0 },
    };
    let mut scene = empty_scene([32, 32], camera);
    scene.medium = Some(uniform_medium(optical_depth_of_a_voxel, 0.8, 0.0));
    scene.render.background = Background::Color([0.0; 3]);
    scene
}

fn sun(direction: [f64; 3]) -> DirectionalLight {
    let length = direction.iter().map(|d| d * d).sum::<f64>().sqrt();
    DirectionalLight {
        direction: direction.map(|d| d / length),
        irradiance: [2.0; 3],
    }
}

fn mean(film: &Film) -> f64 {
    film.mean.iter().map(|pixel| f64::from(pixel[1])).sum()
}

/// What a cached picture's mean is off by, relative to that of an uncached one, with its standard error.
fn measure(scene: &Scene, scale: f64, seeds: u32) -> (f64, f64) {
    let volume = constant_field(1.0, [16; 3], [1.0; 3]);
    let mut cache = cached(scene, &volume, scale, CacheFormat::F32, 1, 0);
    let difference = |seed| {
        let reference = mean(&render(scene, &volume, 1, 256, 100 + seed));
        cache.reseed(seed);
        cache.fill(64);
        mean(&cache.at_rest(1, 64)) / reference - 1.0
    };
    let differences: Vec<f64> = (1..=seeds).map(difference).collect();
    let n = f64::from(seeds);
    let bias = differences.iter().sum::<f64>() / n;
    let squares: f64 = differences.iter().map(|d| (d - bias).powi(2)).sum();
    (bias, (squares / (n - 1.0) / n).sqrt())
}

fn assert_agrees(what: &str, scene: &Scene, seeds: u32, limit: f64) {
    for scale in [1.0, 0.5] {
        let (bias, error) = measure(scene, scale, seeds);
        println!(
            "{what}, scale {scale}: {:+.2} % ± {:.2}",
            100.0 * bias,
            100.0 * error
        );
        assert!(error < 0.5 * limit, "{what}: {error}");
        assert!(bias.abs() < limit, "{what}, scale {scale}: {bias}");
    }
}

/// Interpolated between nodes, up to a third of this light was missing.
#[test]
fn light_behind_the_faces_of_the_box() {
    for depth in [0.1, 0.3, 1.5] {
        let mut scene = scene(depth);
        scene.lights.environment.radiance = [1.0; 3];
        scene.lights.suns = vec![sun([0.3, -0.8, -0.5])];
        assert_agrees(&format!("optical depth {depth} a voxel"), &scene, 4, 0.006);
    }
}

/// The sun's light is gone within a third of a step of a march, and little of it is scattered more than once. At the
/// steps' middles, a fiftieth of all light was missing.
#[test]
fn a_sun_that_grazes_a_clip_plane() {
    let mut scene = scene(0.14);
    scene.medium = Some(uniform_medium(0.14, 0.2, 0.0));
    scene.camera.eye = [0.0, 0.0, 60.0];
    scene.clips = vec![ClipPlane {
        normal: [0.0, 0.0, 1.0],
        offset: 0.49,
    }];
    scene.lights.suns = vec![sun([0.6, 0.8, -0.04])];
    assert_agrees("a grazing sun", &scene, 16, 0.012);
}
