//! Volumes of 16 bits from 256³ to 2048³, at 1024², on devices with the limits that they report: each plan keeps to all of
//! them. A volume is whole where it can be and else in bricks, or it is refused in one sentence.

use isolume::cli::message;
use isolume::gpu::DeviceSummary;
use isolume::render::shared::BRICK;
use isolume::render::{Choice, Planner};
use isolume::scene::volume::Volume;
use isolume::scene::{CacheScale, Variant};

use crate::memory_plan::devices::*;
use crate::memory_plan::scene;
use crate::support::common;

const MIB: u64 = 1 << 20;

/// More than the smallest plan takes beside the volume.
const BESIDE: u64 = 256 * MIB;

/// Sides of volumes, and the scales of caches for them: whether a finer one fits is the ladder's business.
const VOLUMES: [(u32, CacheScale); 3] = [
    (256, CacheScale::Auto),
    (1024, CacheScale::Fixed(0.25)),
    (2048, CacheScale::Fixed(0.125)),
];

/// Resources that are buffers.
const BUFFERS: [&str; 7] = [
    "paths",
    "counters",
    "cache: nodes of slots",
    "tails",
    "streaming",
    "done marks",
    "brick staging",
];

fn longest(extent: [u32; 3]) -> u32 {
    extent.into_iter().max().unwrap_or_default()
}

fn assert_within_limits(limits: &DeviceSummary, budget: u64, volume: &Volume, choice: &Choice) {
    let Choice { plan, reason, .. } = choice;
    let what = format!("{} with {:?}: {reason}", limits.name, volume.dims);
    assert!(plan.bytes() <= budget, "{what}: {} bytes", plan.bytes());
    assert!(budget <= limits.device_local_bytes);
    for resource in &plan.resources {
        let most = limits.max_allocation_bytes;
        assert!(resource.bytes <= most, "{what}: {resource:?}");
        if BUFFERS.contains(&resource.name) {
            let most = limits.max_storage_buffer_bytes;
            assert!(resource.bytes <= most, "{what}: {resource:?}");
        }
    }
    let extent = plan.bricks.map_or(volume.dims, |bricks| bricks.extent());
    assert!(longest(extent) <= limits.max_image_3d, "{what}: {extent:?}");
    if let Some(bricks) = plan.bricks {
        // A ray that crosses the volume has a place for each brick on its way.
        assert!(bricks.capacity() >= bricks.bricks[0], "{what}: {bricks:?}");
    }
    if let Some(cache) = plan.variant.cache() {
        let texels = cache.places.map(|n| BRICK * n);
        assert!(longest(texels) <= limits.max_image_3d, "{what}: {texels:?}");
    }
}

fn assert_refused_well(what: &str, error: &isolume::Error) {
    let said = message(error);
    assert_eq!(error.exit_status(), 4, "{what}: {said}");
    let remedies = ["--vram-budget", "--size", "volume.crop"];
    assert!(remedies.iter().any(|r| said.contains(r)), "{what}: {said}");
    assert_eq!(said.lines().count(), 1, "{what}: {said}");
}

/// Whether the volume can be whole; `None` where that depends on what else there is.
fn can_be_whole(limits: &DeviceSummary, budget: u64, side: u32) -> Option<bool> {
    let bytes = 2 * u64::from(side).pow(3);
    let most = budget.min(limits.max_allocation_bytes);
    if side > limits.max_image_3d || bytes > most {
        Some(false)
    } else {
        (bytes + BESIDE <= most).then_some(true)
    }
}

#[test]
fn plans_keep_to_the_limits_of_real_devices() {
    let devices = [
        mali(),
        intel(),
        amd_4(),
        amd_16(),
        amd_24(),
        nvidia_4(),
        nvidia_8(),
        nvidia_24(),
        nvidia_h100(),
        apple(),
    ];
    let device = common::device();
    let mut scene = scene();
    scene.render.size = [1024, 1024];
    for (side, cache_scale) in VOLUMES {
        let volume = Volume::outline([side; 3], [0.0, 100.0]);
        scene.render.cache_scale = cache_scale;
        for limits in &devices {
            let what = format!("{} with {side}³", limits.name);
            let budget = limits.device_local_bytes / 5 * 4;
            let can_be_whole = can_be_whole(limits, budget, side);
            match Planner::new(&device, limits, budget, &volume, &scene).choose() {
                Ok(choice) => {
                    println!("{what}: {}", choice.reason);
                    assert_within_limits(limits, budget, &volume, &choice);
                    let is_whole = choice.plan.bricks.is_none();
                    assert!(can_be_whole.is_none_or(|can| can == is_whole), "{what}");
                }
                Err(error) => {
                    println!("{what}: {error}");
                    assert_refused_well(&what, &error);
                    assert_ne!(can_be_whole, Some(true), "{what}");
                }
            }
        }
    }
    common::assert_silent(&device);
}

/// AMD's and NVIDIA's drivers allocate at most 2 and 4 GiB at once. A volume that the memory has room for does not stream for that.
#[test]
fn a_volume_larger_than_an_allocation_is_there_as_a_whole() {
    let device = common::device();
    let mut scene = scene();
    scene.render.size = [1024, 1024];
    scene.render.variant = Variant::NonCaching;
    let volume = Volume::outline([2048, 2048, 1024], [0.0, 100.0]);
    for limits in [amd_16(), amd_24(), nvidia_24(), nvidia_h100()] {
        let choose = |limits: &DeviceSummary| {
            let budget = limits.device_local_bytes / 5 * 4;
            let choice = Planner::new(&device, limits, budget, &volume, &scene).choose();
            let choice = choice.expect("a plan");
            assert_within_limits(limits, budget, &volume, &choice);
            let bricks = choice.plan.bricks.expect("bricks");
            (bricks.capacity() >= bricks.total(), choice.reason)
        };
        let (is_all_there, reason) = choose(&limits);
        assert!(is_all_there, "{}: {reason}", limits.name);
        assert!(
            reason.contains("all 131072 needed ones at once"),
            "{reason}"
        );
        let few_images = DeviceSummary {
            extra_images: 0,
            ..limits
        };
        let (is_all_there, reason) = choose(&few_images);
        assert!(
            !is_all_there && reason.contains("as the device's images hold no more"),
            "{reason}"
        );
    }
    common::assert_silent(&device);
}

/// What a device has less of is what the sentence names.
#[test]
fn a_device_that_is_too_small_says_so() {
    let device = common::device();
    let mut scene = scene();
    scene.render.size = [1024, 1024];
    scene.render.cache_scale = CacheScale::Fixed(0.125);
    let volume = Volume::outline([2048; 3], [0.0, 100.0]);
    let limits = tiny();
    let budget = limits.device_local_bytes / 5 * 4;
    let planner = Planner::new(&device, &limits, budget, &volume, &scene);
    let error = planner.choose().expect_err("no plan");
    assert_refused_well(&limits.name, &error);
    common::assert_silent(&device);
}
