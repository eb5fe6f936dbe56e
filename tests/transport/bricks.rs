//! A volume of which the device holds a few bricks at a time makes the same picture as a whole one, to the last bit: in
//! every variant, in both light models, whatever has to wait for what.

use std::num::NonZeroU32;
use std::time::{Duration, Instant};

use isolume::engine::{Engine, Host, HostOptions, Limit, Stop};
use isolume::gpu::Memory;
use isolume::render::{
    Batch, BrickFigures, BrickLayout, CacheLayout, GpuScene, Renderer, Until, next_batch_size,
};
use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

use crate::support::common::*;
use crate::support::fields::voxels;

/// Voxels along a side of a brick.
const SIDE: u32 = 16;

const DIMS: [u32; 3] = [40, 36, 33];

/// Waves with steep sides: values of 16 bits.
fn wave_values() -> impl Iterator<Item = u16> {
    voxels(DIMS).map(|voxel| {
        let at = voxel.map(f64::from);
        let sum = (0.35 * at[0]).sin() + (0.4 * at[1] + 1.0).sin() + (0.3 * at[2]).cos();
        (32768.0 + 10_000.0 * sum) as u16
    })
}

fn volume_of(voxels: Voxels) -> Volume {
    Volume::from_values(DIMS, [0.1; 3], voxels).expect("a volume")
}

fn waves() -> Volume {
    volume_of(Voxels::U16(wave_values().collect()))
}

fn scene(g: f64, light: Option<LightModel>) -> Scene {
    let camera = Camera {
        eye: [3.0, 3.5, 6.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Perspective { fov_y: 40.0 },
    };
    let mut scene = empty_scene([16, 16], camera);
    let point = |value: f64, opacity: f64, color: [f64; 3]| TransferPoint {
        value,
        opacity,
        color,
    };
    scene.medium = Some(Medium {
        g,
        ..Medium::isotropic(
            3.0,
            vec![
                point(30_000.0, 0.0, [0.9, 0.8, 0.6]),
                point(45_000.0, 1.0, [0.9, 0.8, 0.6]),
                point(50_000.0, 0.3, [0.3, 0.6, 0.9]),
            ],
        )
    });
    scene.lights.environment.radiance = [0.5, 0.6, 0.7];
    scene.lights.suns = vec![DirectionalLight {
        direction: [-0.6, -0.8, 0.0],
        irradiance: [2.0; 3],
    }];
    if let Some(light) = light {
        let surface = |value: f64, opacity: f64| Isosurface {
            value,
            opacity,
            color: [0.8, 0.5, 0.3],
            shading: Shading::Lambert,
        };
        scene.surfaces.light = light;
        scene.surfaces.iso = vec![surface(41_000.0, 0.5), surface(52_000.0, 1.0)];
    }
    scene
}

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

/// With a cache of that scale, or without one; whole, or in bricks with so many places.
fn pictures(scene: &Scene, cache_scale: Option<f64>, places: Option<u64>) -> Pictures {
    let (device, volume) = (device(), waves());
    let memory = Memory::new(&device, BUDGET).expect("memory");
    // The host has room for three bricks that may be asked for again.
    let brick_bytes = u64::from(SIDE + 1).pow(3) * volume.stored.bytes() as u64;
    let layout = places.map(|n| {
        BrickLayout::with_side(SIDE, volume.dims, n, &device.summary)
            .with_host_bytes(3 * brick_bytes)
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
    let whole = pictures(scene, cache_scale, None);
    assert!(whole.figures.is_none());
    for &places in places {
        let streamed = pictures(scene, cache_scale, Some(places));
        let figures = streamed.figures.expect("figures");
        println!("{places} places: {figures:?}");
        assert!(figures.loads > u64::from(figures.resident), "{figures:?}");
        assert!(whole.at_rest == streamed.at_rest, "{places} places");
        assert!(whole.stderr == streamed.stderr, "{places} places");
        assert!(whole.marched == streamed.marched, "{places} places");
        assert!(whole.hits == streamed.hits, "{places} places");
        if cache_scale.is_none() {
            assert_eq!(whole.lookups, streamed.lookups, "{places} places");
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
            let layout =
                places.map(|n| BrickLayout::with_side(SIDE, volume.dims, n, &device.summary));
            let scene = GpuScene::new(&scene, &volume, 1).with_bricks(layout);
            let mut renderer =
                Renderer::with_shaders(&memory, &shaders(), &volume, scene).expect("a renderer");
            assert!(renderer.unit(2, Until::NEVER).expect("a unit"));
            let placed = renderer.timings().total("place_bricks").is_some();
            assert_eq!(placed, places.is_some());
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
    let layout = places.map(|n| BrickLayout::with_side(8, volume.dims, n, &device.summary));
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

/// Units that are interrupted are dropped, even if some pixels have had theirs.
#[test]
fn interrupted_units_leave_the_picture_as_it_was() {
    let (device, volume) = (device(), waves());
    let memory = Memory::new(&device, BUDGET).expect("memory");
    let layout = BrickLayout::with_side(8, volume.dims, 40, &device.summary);
    let scene = GpuScene::new(&scene(0.0, None), &volume, 1);
    let scene = scene.with_bricks(Some(layout));
    let mut renderer =
        Renderer::with_shaders(&memory, &shaders(), &volume, scene).expect("a renderer");
    assert!(renderer.units(1, 2, Until::NEVER).expect("units"));
    let before = renderer.sums().expect("sums");
    let until = |ms| Until {
        deadline: Some(Instant::now() + Duration::from_millis(ms)),
        ..Until::NEVER
    };
    let folded = |renderer: &Renderer| {
        renderer
            .timings()
            .total("accumulate")
            .map(|total| total.runs)
    };
    let mut dropped_some_pixels = 0;
    for ms in (0..16).map(|n| 1 << n) {
        let folded_before = folded(&renderer);
        if renderer.units(1, 64, until(ms)).expect("units") {
            break;
        }
        dropped_some_pixels += u32::from(folded(&renderer) > folded_before);
        assert!(renderer.sums().expect("sums") == before, "after {ms} ms");
    }
    assert!(dropped_some_pixels > 0, "no pixel had its units in time");
    assert_silent(&device);
}

/// Of twice the time, it is half as large a share.
#[test]
fn the_time_that_the_device_waits_for_bricks_is_a_share() {
    let options = HostOptions {
        vram_budget: Some(Limit::Bytes(8 << 20)),
        validation: true,
        ..HostOptions::default()
    };
    let host = Host::open(&options).expect("a Vulkan device and the validation layers");
    let volume = constant_field(40_000.0, [128; 3], [0.03; 3]);
    let scene = scene(0.0, None);
    let mut engine = Engine::new(&host, &volume, &scene, 1).expect("an engine");
    let samples = NonZeroU32::new(1).expect("one");
    engine.render(Stop::at_samples(samples)).expect("a picture");
    let share = |wall| engine.brick_stats(wall).expect("bricks").waited_share;
    assert!(share(1.0) > 0.0);
    assert_eq!(share(2.0), share(1.0) / 2.0);
    host.check_validation().expect("silence");
}

/// As it is shown, whether or not it counts.
fn mean_on_device(renderer: &mut Renderer) -> Vec<[f32; 4]> {
    let (frame, r) = renderer.probed();
    let [width, height] = r.size;
    let run =
        frame.run(|recording| recording.download(&r.mean, &r.staging, [0; 3], [width, height, 1]));
    run.expect("a download");
    r.staging.read_vec((width * height) as usize)
}

/// Some bricks are brought after each preview. Once all are there, a preview is as good as a sample, but counts for nothing.
#[test]
fn previews_wait_for_nothing_and_end_as_the_exact_picture() {
    let (device, volume) = (device(), waves());
    let renderer = |layout| {
        let memory = Memory::new(&device, BUDGET).expect("memory");
        let scene = GpuScene::new(&scene(0.0, None), &volume, 1);
        let scene = scene.with_bricks(layout);
        Renderer::with_shaders(&memory, &shaders(), &volume, scene).expect("a renderer")
    };
    let mut whole = renderer(None);
    assert!(whole.unit(1, Until::NEVER).expect("a unit"));
    let exact = whole.sums().expect("sums").mean;

    let layout = BrickLayout::with_side(8, volume.dims, 4000, &device.summary);
    let mut streamed = renderer(Some(layout));
    streamed.set_slice_ms(0.0);
    let mut loads = Vec::new();
    let mut means = Vec::new();
    while loads.len() < 2 || loads[loads.len() - 2] < loads[loads.len() - 1] {
        streamed.preview().expect("a preview");
        loads.push(streamed.brick_figures().expect("figures").loads);
        means.push(mean_on_device(&mut streamed));
        assert_eq!(streamed.totals().samples, 0);
    }
    println!("bricks after each preview: {loads:?}");
    assert!(loads.len() > 3, "they were all brought at once");
    assert!(means[0] != exact);
    assert!(means[means.len() - 1] == exact);
    assert!(streamed.unit(1, Until::NEVER).expect("a unit"));
    assert!(streamed.sums().expect("sums").mean == exact);
    assert_silent(&device);
}

/// What is in sight, and how wrong the cache is, is found with the bricks that are there, and found anew once the camera rests.
#[test]
fn in_motion_a_cache_waits_for_no_brick() {
    let (device, volume) = (device(), waves());
    let layout = BrickLayout::with_side(8, volume.dims, 4000, &device.summary);
    let gpu_scene = GpuScene::new(&scene(0.0, None), &volume, 1).with_bricks(Some(layout));
    let occupancy = gpu_scene.occupancy(&volume);
    let cache = CacheLayout::new(volume.dims, &occupancy, 0.5, CacheFormat::F32, 4096);
    let gpu_scene = gpu_scene.with_cache(cache.expect("a layout"));
    let renderer = || {
        let memory = Memory::new(&device, BUDGET).expect("memory");
        let scene = gpu_scene.clone();
        let made = Renderer::with_shaders(&memory, &shaders(), &volume, scene);
        let mut renderer = made.expect("a renderer");
        renderer.set_slice_ms(0.0);
        renderer
    };
    let loads = |renderer: &Renderer| renderer.brick_figures().expect("figures").loads;
    let batch = Batch::Paths(next_batch_size(0));
    let begin = |renderer: &mut Renderer, moves: bool| {
        let mut caching = renderer.caching().expect("a cache");
        caching.abandon();
        if moves {
            caching.advance_in_motion(batch)
        } else {
            caching.advance(batch)
        }
        .expect("a slice");
        loads(renderer)
    };
    let (mut moved, mut rested) = (renderer(), renderer());
    let at_rest = begin(&mut rested, false);
    let in_motion = begin(&mut moved, true);
    println!("{in_motion} bricks in motion, {at_rest} at rest");
    assert!(3 * in_motion < 2 * at_rest);
    moved.caching().expect("a cache").rest();
    assert_eq!(begin(&mut moved, false), at_rest);

    // Two pictures tell the error of a cache, but not with voxels in the place of others.
    let mut moved = renderer();
    moved.set_slice_ms(20.0);
    let error = |renderer: &Renderer| renderer.cache().expect("a cache").filling.relative_error;
    for updates in [0, 1] {
        let batch = Batch::Paths(next_batch_size(updates));
        while !moved
            .caching()
            .expect("a cache")
            .advance_in_motion(batch)
            .expect("a slice")
        {}
    }
    assert!(error(&moved).is_infinite());
    moved.caching().expect("a cache").rest();
    for updates in [2, 4] {
        let batch = Batch::Paths(next_batch_size(updates));
        assert!(
            moved
                .caching()
                .expect("a cache")
                .batch(batch, Until::NEVER)
                .expect("a batch")
        );
    }
    assert!(error(&moved).is_finite());
    assert_silent(&device);
}

#[test]
fn too_few_bricks_for_a_ray_are_an_error() {
    let (device, volume) = (device(), waves());
    let memory = Memory::new(&device, BUDGET).expect("memory");
    let layout = BrickLayout::with_side(SIDE, volume.dims, 1, &device.summary);
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
