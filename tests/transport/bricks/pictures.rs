//! A volume of which the device holds a few bricks at a time makes the same picture as a whole one, to the last bit: in
//! every variant, in both light models, whatever has to wait for what.

use isolume::gpu::Memory;
use isolume::render::{
    Batch, BrickFigures, CacheLayout, GpuScene, Renderer, Until, next_batch_size,
};
use isolume::scene::volume::Voxels;
use isolume::scene::*;

use super::{layout, layout_within, scene, volume_of, wave_values, waves};
use crate::support::common::*;

/// Voxels along a side of a brick.
const SIDE: u32 = 16;

struct Pictures {
    at_rest: Vec<[f32; 4]>,
    stderr: Vec<[f32; 3]>,
    /// What a cache shows at once.
    marched: Vec<[f32; 4]>,
    /// Normals of the first surface and distances to it.
    hits: Vec<[f32; 4]>,
    figures: Option<BrickFigures>,
    /// Reads of the volume by paths.
    lookups: u64,
}

/// With a cache of that scale, or without one; whole, or in bricks with so many places in so many images.
fn pictures(scene: &Scene, cache_scale: Option<f64>, places: Option<(u64, u64)>) -> Pictures {
    let (device, volume) = (device(), waves());
    let memory = Memory::new(&device, BUDGET).expect("memory");
    // The host has room for three bricks that may be asked for again.
    let brick_bytes = u64::from(SIDE + 1).pow(3) * volume.stored.bytes() as u64;
    let layout = places.map(|(places, images)| {
        let mut limits = device.summary.clone();
        limits.max_allocation_bytes = (places.div_ceil(images) + 1) * brick_bytes * 16 / 15;
        let layout = layout_within(SIDE, &volume, places, &limits);
        assert_eq!(u64::from(layout.images), images);
        layout.with_host_bytes(3 * brick_bytes)
    });
    let gpu_scene = GpuScene::new(scene, &volume, 1);
    let mut gpu_scene = gpu_scene.with_bricks(layout);
    if let Some(scale) = cache_scale {
        let occupancy = gpu_scene.occupancy(&volume);
        let cache = CacheLayout::new(volume.dims, &occupancy, scale, CacheFormat::F32, 4096);
        gpu_scene = gpu_scene.with_cache(cache.expect("a layout"));
    }
    let mut renderer =
        Renderer::with_shaders(&memory, &shaders(), &volume, gpu_scene).expect("a renderer");
    let mut marched = Vec::new();
    for updates in [0, 1, 2] {
        if let Some(mut caching) = renderer.caching() {
            assert!(
                caching
                    .batch(Batch::Paths(next_batch_size(updates)), Until::NEVER)
                    .expect("a batch")
            );
            marched = caching.march().expect("a picture");
        }
    }
    for _ in 0..2 {
        assert!(renderer.unit(1, Until::NEVER).expect("a unit"));
    }
    let film = renderer.film().expect("a film");
    let hits = renderer.first_hits().expect("hits");
    assert_silent(&device);
    Pictures {
        at_rest: film.mean,
        stderr: film.stderr,
        marched,
        hits: hits.normal_depth,
        figures: renderer.brick_figures(),
        lookups: renderer.lookups(),
    }
}

fn assert_same(scene: &Scene, cache_scale: Option<f64>, places: &[u64]) {
    let in_one_image: Vec<_> = places.iter().map(|&places| (places, 1)).collect();
    assert_same_in(scene, cache_scale, &in_one_image);
}

/// With so many places in so many images.
fn assert_same_in(scene: &Scene, cache_scale: Option<f64>, places: &[(u64, u64)]) {
    let whole = pictures(scene, cache_scale, None);
    assert!(whole.figures.is_none());
    for &places in places {
        let streamed = pictures(scene, cache_scale, Some(places));
        let figures = streamed.figures.expect("figures");
        println!("{places:?}: {figures:?}");
        let has_all = figures.resident == figures.total;
        assert!(
            has_all || figures.loads > u64::from(figures.resident),
            "{figures:?}"
        );
        assert!(whole.at_rest == streamed.at_rest, "{places:?}");
        assert!(whole.stderr == streamed.stderr, "{places:?}");
        assert!(whole.marched == streamed.marched, "{places:?}");
        assert!(whole.hits == streamed.hits, "{places:?}");
        if cache_scale.is_none() {
            assert_eq!(whole.lookups, streamed.lookups, "{places:?}");
        }
    }
}

#[test]
fn paths_wait_for_bricks() {
    assert_same(&scene(0.0, None), None, &[18, 4]);
}

#[test]
fn paths_with_surfaces_wait_for_bricks() {
    assert_same(&scene(0.85, Some(LightModel::Full)), None, &[15]);
}

#[test]
fn a_cache_waits_for_bricks() {
    assert_same(&scene(0.0, Some(LightModel::Local)), Some(0.25), &[15, 12]);
}

#[test]
fn a_cache_in_full_light_waits_for_bricks() {
    assert_same(&scene(0.0, Some(LightModel::Full)), Some(0.25), &[15, 12]);
}

#[test]
fn an_anisotropic_cache_waits_for_bricks() {
    assert_same(&scene(0.5, None), Some(0.25), &[8]);
}

/// As where the memory has room for more than one allocation: bricks move between images, or all of them are there.
#[test]
fn bricks_lie_in_several_images() {
    if device().summary.extra_images == 0 {
        println!("the device lets a pass read no more than one image of the volume");
        return;
    }
    let scene = scene(0.0, Some(LightModel::Full));
    assert_same_in(&scene, None, &[(9, 3), (27, 4)]);
    assert_same_in(&scene, Some(0.25), &[(16, 2)]);
}

/// As on a GPU: bricks are written into the image by a pass.
#[test]
fn a_pass_places_bricks_of_voxels_of_every_size() {
    let device = device_that_fetches(true);
    let of_8_bits = wave_values().map(|value| (value / 257) as u8).collect();
    let of_32_bits = wave_values().map(f32::from).collect();
    for (voxels, scale) in [
        (Voxels::U8(of_8_bits), 1.0 / 257.0),
        (Voxels::U16(wave_values().collect()), 1.0),
        (Voxels::F32(of_32_bits), 1.0),
    ] {
        let volume = volume_of(voxels);
        let mut scene = scene(0.0, None);
        let points = scene.medium.iter_mut().flat_map(|m| &mut m.transfer);
        points.for_each(|point| point.value *= scale);
        let picture = |places: Option<u64>| {
            let memory = Memory::new(&device, BUDGET).expect("memory");
            let layout = places.map(|n| layout(SIDE, &volume, n));
            let scene = GpuScene::new(&scene, &volume, 1).with_bricks(layout);
            let mut renderer =
                Renderer::with_shaders(&memory, &shaders(), &volume, scene).expect("a renderer");
            assert!(renderer.unit(2, Until::NEVER).expect("a unit"));
            let copied = renderer.timings().total("copy_bricks").is_some();
            assert_eq!(copied, places.is_some());
            renderer.film().expect("a film").mean
        };
        assert!(picture(None) == picture(Some(12)), "{:?}", volume.stored);
    }
    assert_silent(&device);
}

/// The picture of 16 units of one sample, and how many bricks were brought for it.
fn sixteen_units(
    scene: &Scene,
    together: u32,
    places: Option<u64>,
) -> (Vec<[f32; 4]>, Vec<[f32; 3]>, u64) {
    let (device, volume) = (device(), waves());
    let memory = Memory::new(&device, BUDGET).expect("memory");
    let layout = places.map(|n| layout(8, &volume, n));
    let scene = GpuScene::new(scene, &volume, 1);
    let scene = scene.with_bricks(layout);
    let mut renderer =
        Renderer::with_shaders(&memory, &shaders(), &volume, scene).expect("a renderer");
    for _ in 0..16 / together {
        assert!(renderer.units(1, together, Until::NEVER).expect("units"));
    }
    let film = renderer.film().expect("a film");
    let loads = renderer.brick_figures().map_or(0, |figures| figures.loads);
    assert_silent(&device);
    (film.mean, film.stderr, loads)
}

/// One by one, each unit brings the bricks anew that the one before it has driven out.
#[test]
fn units_together_need_few_loads() {
    let scene = scene(0.0, None);
    let (mean, stderr, _) = sixteen_units(&scene, 1, None);
    let places = Some(40);
    let (mean_together, stderr_together, loads_together) = sixteen_units(&scene, 16, places);
    let (_, _, loads) = sixteen_units(&scene, 1, places);
    println!("{loads_together} loads together, {loads} one by one");
    assert!(mean == mean_together && stderr == stderr_together);
    assert!(
        2 * loads_together < loads,
        "{loads_together} of {loads} loads"
    );
}

/// A ray that looks for surfaces may pass 13 bricks, more than there is room for.
#[test]
fn searches_for_surfaces_go_on_brick_by_brick() {
    let scene = scene(0.0, Some(LightModel::Full));
    let (mean, stderr, _) = sixteen_units(&scene, 16, None);
    let (mean_streamed, stderr_streamed, loads) = sixteen_units(&scene, 16, Some(9));
    println!("{loads} loads");
    assert!(loads > 0 && mean == mean_streamed && stderr == stderr_streamed);
}

#[test]
fn too_few_bricks_for_a_ray_are_an_error() {
    let (device, volume) = (device(), waves());
    let memory = Memory::new(&device, BUDGET).expect("memory");
    let layout = layout(SIDE, &volume, 1);
    let scene = scene(0.0, Some(LightModel::Full));
    let scene = GpuScene::new(&scene, &volume, 1);
    let scene = scene.with_bricks(Some(layout));
    let mut renderer = Renderer::with_shaders(&memory, &shaders(), &volume, scene).expect("begun");
    let error = renderer
        .unit(1, Until::NEVER)
        .expect_err("no room")
        .to_string();
    assert!(
        error.contains("than the 1 that there is room for"),
        "{error}"
    );
}
