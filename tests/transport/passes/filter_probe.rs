//! `filter_probe` decides whether shaders read a volume through the device's own filter. What it makes of good and bad
//! filters is tested beside it; here are this device's filter, and the pictures that it makes.

use std::sync::Arc;

use fastrand::Rng;
use isolume::gpu::Device;
use isolume::render::GpuScene;
use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

use crate::support::common::*;
use crate::support::probe::NOTHING;

/// Noise, the same in 8 bits, in 16 and in floats: between any two voxels, interpolation counts.
fn volumes() -> [Volume; 3] {
    let mut random = Rng::with_seed(8);
    let dims = [14, 11, 9];
    let bytes: Vec<u8> = (0..dims.iter().product()).map(|_| random.u8(..)).collect();
    let wide = bytes.iter().map(|&v| 257 * u16::from(v)).collect();
    let floats = bytes.iter().map(|&v| f32::from(v)).collect();
    [Voxels::U8(bytes), Voxels::U16(wide), Voxels::F32(floats)].map(|voxels| {
        let mut volume = Volume::from_values(dims, [0.1; 3], voxels).expect("a volume");
        volume.scale = 255.0 / volume.range[1];
        volume.range = [0.0, 255.0];
        volume
    })
}

/// A medium that is dense only near one value.
fn scene() -> Scene {
    let camera = Camera {
        eye: [1.1, 1.6, 2.3],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Perspective { fov_y: 40.0 },
    };
    let mut scene = empty_scene([32, 32], camera);
    let point = |value: f64, opacity: f64| TransferPoint {
        value,
        opacity,
        color: [0.8; 3],
    };
    scene.medium = Some(Medium::isotropic(
        12.0,
        vec![point(100.0, 0.0), point(130.0, 1.0), point(160.0, 0.0)],
    ));
    scene.lights.environment.radiance = [1.0; 3];
    scene
}

fn filters_in_shader(device: &Arc<Device>, volume: &Volume) -> bool {
    let scene = GpuScene::new(device, &scene(), volume, 1).expect("a scene");
    assert_silent(device);
    scene.features().filter_in_shader
}

/// A march through a cache that holds a guess.
fn march(device: Arc<Device>, volume: &Volume) -> Vec<[f32; 4]> {
    let shaders = shaders()
        .with_file("cell_tracking.comp", NOTHING)
        .with_file("camera_march.comp", NOTHING);
    let (scene, format) = (scene(), CacheFormat::F32);
    let mut cached = empty_cache(device, &shaders, &scene, volume, 1.0, format, 1);
    cached.caching().guess_light().expect("a guess");
    cached.march()
}

/// Mesa's driver for CPUs interpolates texels of 8 bits in 8 bits, and others in floats.
#[test]
fn a_device_filters_what_it_is_precise_enough_for() {
    let (loading, fetching) = (device(), device_that_fetches(true));
    let decided = volumes().map(|volume| filters_in_shader(&fetching, &volume));
    println!(
        "{}: filtered in shaders: {decided:?}",
        fetching.summary.name
    );
    if fetching.summary.name.contains("llvmpipe") {
        assert_eq!(decided, [true, false, false]);
    }
    if loading.loads_texels {
        let decided = volumes().map(|volume| filters_in_shader(&loading, &volume));
        assert_eq!(decided, [true; 3], "storage images have no filter");
    }
}

#[test]
fn a_picture_through_the_devices_filter_is_that_of_shaders_that_interpolate() {
    for volume in volumes() {
        let fetching = device_that_fetches(true);
        let filtered = !filters_in_shader(&fetching, &volume);
        let [fetched, loaded] = [fetching, device()].map(|device| march(device, &volume));
        let difference = rms_difference(&fetched, &loaded);
        println!("through the filter: {filtered}; RMS difference {difference:.1e} of the mean");
        assert!(loaded.iter().any(|pixel| pixel[0] < 0.8 && pixel[0] > 0.0));
        assert!(difference < 1e-3, "{difference}");
    }
}
