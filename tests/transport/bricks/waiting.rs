//! Work that waits for bricks can be left, previews do without bricks, and how long the device waits is counted.

use std::num::NonZeroU32;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use isolume::engine::{Engine, Host, HostOptions, Limit, Stop};
use isolume::gpu::{Device, Memory};
use isolume::render::{
    Batch, CacheLayout, GpuScene, ReadingSlices, Renderer, Until, next_batch_size,
};
use isolume::scene::CacheFormat;
use isolume::scene::volume::Volume;

use super::{layout, scene, waves};
use crate::support::common::*;

/// Units that are interrupted are dropped, even if some pixels have had theirs.
#[test]
fn interrupted_units_leave_the_picture_as_it_was() {
    let (device, volume) = (device(), waves());
    let memory = Memory::new(&device, BUDGET).expect("memory");
    let layout = layout(8, &volume, 40);
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

    let layout = layout(8, &volume, 4000);
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

/// A renderer with a cache, to which few bricks at a time are brought.
fn slow_renderer(device: &Arc<Device>, volume: &Volume) -> Renderer {
    let layout = layout(8, volume, 4000);
    let mut scene = scene(0.0, None);
    // So thin that no brick is read to look for edges.
    scene.medium.as_mut().expect("a medium").density *= 0.8;
    let gpu_scene = GpuScene::new(&scene, volume, 1).with_bricks(Some(layout));
    let occupancy = gpu_scene.occupancy(volume);
    let cache = CacheLayout::new(volume.dims, &occupancy, 0.5, CacheFormat::F32, 4096);
    let gpu_scene = gpu_scene.with_cache(cache.expect("a layout"));
    let memory = Memory::new(device, BUDGET).expect("memory");
    let made = Renderer::with_shaders(&memory, &shaders(), volume, gpu_scene);
    let mut renderer = made.expect("a renderer");
    renderer.set_slice_ms(0.0);
    renderer
}

fn loads(renderer: &Renderer) -> u64 {
    renderer.brick_figures().expect("figures").loads
}

/// A window goes on, and an interruption is noticed, before all bricks of a slice have come.
#[test]
fn slices_that_wait_for_bricks_are_left() {
    let (device, volume) = (device(), waves());
    let mut renderer = slow_renderer(&device, &volume);
    let mut caching = renderer.caching().expect("a cache");
    let batch = Batch::Paths(next_batch_size(0));
    let has_ended = caching.advance(batch, &AtomicBool::new(true));
    assert!(!has_ended.expect("a dispatch"));
    let interrupted = loads(&renderer);
    assert!((1..=32).contains(&interrupted), "{interrupted} bricks");
    let exact = {
        let mut caching = renderer.caching().expect("a cache");
        caching.guess_light().expect("a guess");
        caching.march().expect("a march")
    };

    let mut renderer = slow_renderer(&device, &volume);
    let mut slices = ReadingSlices::new(1e9);
    let (mut calls, mut brought) = (0, 0);
    let marched = loop {
        let mut caching = renderer.caching().expect("a cache");
        if calls == 0 {
            caching.guess_light().expect("a guess");
        }
        calls += 1;
        if caching.advance_march(&mut slices).expect("a slice") {
            break caching.marched().expect("a picture");
        }
        let now = loads(&renderer);
        assert!(now - brought <= 32, "{} bricks at once", now - brought);
        brought = now;
    };
    println!("{brought} bricks in {calls} calls");
    assert!(calls > 4);
    assert_eq!(marched, exact);
    assert_silent(&device);
}

/// What is in sight, and how wrong the cache is, is found with the bricks that are there, and found anew once the camera rests.
#[test]
fn in_motion_a_cache_waits_for_no_brick() {
    let (device, volume) = (device(), waves());
    let renderer = || slow_renderer(&device, &volume);
    let batch = Batch::Paths(next_batch_size(0));
    let begin = |renderer: &mut Renderer, moves: bool| {
        let mut caching = renderer.caching().expect("a cache");
        caching.abandon();
        if moves {
            caching.advance_in_motion(batch)
        } else {
            caching.advance(batch, Until::NEVER)
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
