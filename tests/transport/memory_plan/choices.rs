//! Which variant a device, a budget and a scene get, row by row.

use isolume::cli::message;
use isolume::gpu::DeviceSummary;
use isolume::render::Planner;
use isolume::scene::volume::Volume;
use isolume::scene::*;

use crate::memory_plan::devices::*;
use crate::memory_plan::{F16, F32, Kind, LADDER, Rung, dense, empty, name, plan, scene, sparse};

enum Budget {
    /// 80 % of the heap.
    Heap,
    /// Just what this rung needs.
    For(Rung),
    /// A byte less.
    Below(Rung),
}

use Budget::*;

type Change = fn(&mut Scene);

/// What is rendered, and what is changed in the scene.
type Case = (Volume, Change);

/// Device, budget, the choice or `Err` where nothing fits, and a piece of what is said about it.
type Row = (
    fn() -> DeviceSummary,
    Budget,
    Result<Rung, ()>,
    &'static str,
);

const ONE_F32: Rung = LADDER[0];
const ONE_F16: Rung = LADDER[1];
const HALF_F32: Rung = LADDER[2];
const HALF_F16: Rung = LADDER[3];
const QUARTER_F32: Rung = LADDER[4];
const QUARTER_F16: Rung = LADDER[5];
const EIGHTH_F32: Rung = LADDER[6];
const EIGHTH_F16: Rung = LADDER[7];
const NO_CACHE: Rung = None;

fn assert_choices((volume, change): Case, rows: &[Row]) {
    let device = crate::support::common::device();
    let mut scene = scene();
    change(&mut scene);
    for (n, (limits, budget, expected, piece)) in rows.iter().enumerate() {
        let limits = limits();
        let bytes = |&rung: &Rung| {
            let plan = plan(&device, &limits, &volume, &scene, rung);
            plan.expect("a plan to take the budget from").bytes()
        };
        let budget = match budget {
            Heap => limits.device_local_bytes / 5 * 4,
            For(rung) => bytes(rung),
            Below(rung) => bytes(rung) - 1,
        };
        let choice = Planner::new(&device, &limits, budget, &volume, &scene).choose();
        let (found, said) = match choice {
            Ok(choice) => (choice.plan.variant.description(), choice.reason),
            Err(error) if error.exit_status() == 4 => ("nothing".into(), message(&error)),
            Err(other) => panic!("row {n}: {other}"),
        };
        let expected = expected.map_or("nothing".into(), name);
        let row = format!("row {n}: {} with {budget} bytes", limits.name);
        assert_eq!(found, expected, "{row}: {said}");
        assert!(said.contains(piece), "{row}: {said}\nlacks\n{piece}");
        // An edit in place replaces the plan and keeps the reason, which must not have the plan's figures.
        assert!(!said.contains(&format!("{found} takes")), "{row}: {said}");
    }
    crate::support::common::assert_silent(&device);
}

fn as_it_is(_: &mut Scene) {}

#[test]
#[rustfmt::skip] // a row a line
fn each_rung_is_taken_by_the_budget_that_just_holds_it() {
    assert_choices(
        (dense(192, Kind::U8), as_it_is),
        &[
            (nvidia_8, For(ONE_F32), Ok(ONE_F32), "no variant is better"),
            (nvidia_24, Below(ONE_F32), Ok(ONE_F16), "; caching at scale 1 in f32 needs"),
            (amd_4, For(ONE_F16), Ok(ONE_F16), "the best that fits"),
            (amd_16, Below(ONE_F16), Ok(HALF_F32), "; caching at scale 1 in f16 needs"),
            (intel, For(HALF_F32), Ok(HALF_F32), "the best that fits"),
            (apple, Below(HALF_F32), Ok(HALF_F16), "; caching at scale 0.5 in f32 needs"),
            (amd_16, For(HALF_F16), Ok(HALF_F16), "the best that fits"),
            (tiny, Below(HALF_F16), Ok(QUARTER_F32), "; caching at scale 0.5 in f16 needs"),
            (minimum, For(QUARTER_F32), Ok(QUARTER_F32), "the best that fits"),
            (nvidia_80, Below(QUARTER_F32), Ok(QUARTER_F16), "; caching at scale 0.25 in f32 needs"),
            (nvidia_141, For(QUARTER_F16), Ok(QUARTER_F16), "the best that fits"),
            (amd_4, Below(QUARTER_F16), Ok(EIGHTH_F32), "; caching at scale 0.25 in f16 needs"),
            (lavapipe, For(EIGHTH_F32), Ok(EIGHTH_F32), "the best that fits"),
            (intel, Below(EIGHTH_F32), Ok(EIGHTH_F16), "; caching at scale 0.125 in f32 needs"),
            (apple, For(EIGHTH_F16), Ok(EIGHTH_F16), "the best that fits"),
            (tiny, Below(EIGHTH_F16), Ok(NO_CACHE), "no cache fits beside the whole volume: caching at scale 0.125 in f16 needs"),
            (minimum, For(NO_CACHE), Ok(NO_CACHE), "no cache fits"),
            // A cache would leave 64, and a pixel may read 90 at once.
            (nvidia_8, Below(NO_CACHE), Ok(NO_CACHE), "with the volume in bricks, 80 of the 216 needed ones"),
            (lavapipe, Below(NO_CACHE), Ok(EIGHTH_F32), "with the volume in bricks, 100 of the 216 needed ones"),
        ],
    );
}

/// 2²⁴ nodes at scale 1: 256 MiB of light in f32, 128 MiB in f16, 32 MiB at half the scale.
#[test]
#[rustfmt::skip] // a row a line
fn heaps_decide_about_a_large_volume() {
    assert_choices(
        (dense(256, Kind::U8), as_it_is),
        &[
            (nvidia_8, Heap, Ok(ONE_F32), "no variant is better"),
            (nvidia_24, Heap, Ok(ONE_F32), "no variant is better"),
            (nvidia_80, Heap, Ok(ONE_F32), "no variant is better"),
            (nvidia_141, Heap, Ok(ONE_F32), "no variant is better"),
            (amd_4, Heap, Ok(ONE_F32), "no variant is better"),
            (amd_16, Heap, Ok(ONE_F32), "no variant is better"),
            (intel, Heap, Ok(ONE_F32), "no variant is better"),
            (apple, Heap, Ok(ONE_F32), "no variant is better"),
            (minimum, Heap, Ok(ONE_F32), "no variant is better"),
            (tiny, Heap, Ok(HALF_F32), "; caching at scale 1 in f16 needs"),
            (lavapipe, Heap, Ok(QUARTER_F32), "too many for a CPU to fill"),
        ],
    );
    assert_choices(
        (dense(257, Kind::U8), as_it_is),
        &[(minimum, Heap, Ok(HALF_F32), "with the volume in bricks, 343 of the 729 needed ones")],
    );
}

/// 64 megapixels, 1 GiB an image.
#[test]
#[rustfmt::skip] // a row a line
fn a_large_picture_takes_what_a_cache_would_have() {
    fn large(scene: &mut Scene) {
        scene.render.size = [8192, 8192];
    }
    let large_and_thin = |scene: &mut Scene| {
        large(scene);
        scene.medium.as_mut().expect("a medium").density = 0.03;
    };
    let large_and_denser = |scene: &mut Scene| {
        large(scene);
        scene.medium.as_mut().expect("a medium").density = 0.05;
    };
    assert_choices(
        (dense(256, Kind::U8), large_and_thin),
        &[
            (nvidia_8, Heap, Ok(ONE_F32), "no variant is better"),
            (amd_4, Below(ONE_F16), Ok(HALF_F32), "; caching at scale 1 in f16 needs"),
            (lavapipe, Heap, Err(()), "1.0 GiB of it for the "),
            (minimum, Heap, Err(()), "unit sum is 8192 texels long"),
            (tiny, Heap, Err(()), "allocates at most 128.0 MiB at once: lower --size"),
        ],
    );
    // Where the medium is dense at the box's faces, a cache leaves 16 bytes a pixel of light to paths, and at scale 1 it is not
    // dense in a cube.
    assert_choices(
        (dense(256, Kind::U8), large_and_denser),
        &[(amd_4, Below(ONE_F16), Ok(NO_CACHE), "no cache fits beside the whole volume: caching at scale 1 in f16 needs")],
    );
    let absurd = |scene: &mut Scene| scene.render.size = [1 << 20, 1 << 20];
    assert_choices(
        (dense(8, Kind::U8), absurd),
        &[(nvidia_141, Heap, Err(()), "unit sum is 1048576 texels long")],
    );
    let with_surface = |scene: &mut Scene| {
        large(scene);
        crate::memory_plan::with_everything(scene);
    };
    assert_choices(
        (sparse(64, Kind::U16), with_surface),
        &[
            (amd_4, Heap, Err(()), "but non-caching needs"),
            (nvidia_8, Heap, Ok(ONE_F32), "no variant is better"),
        ],
    );
}

#[test]
#[rustfmt::skip] // a row a line
fn everything_that_a_scene_can_have_is_counted() {
    assert_choices(
        (sparse(64, Kind::F32), crate::memory_plan::with_everything),
        &[
            (nvidia_8, For(ONE_F32), Ok(ONE_F32), "no variant is better"),
            (lavapipe, Below(ONE_F32), Ok(ONE_F16), "caching at scale 1 in f32 needs"),
            (amd_4, Below(ONE_F16), Ok(HALF_F32), "caching at scale 1 in f16 needs"),
            (lavapipe, Below(EIGHTH_F16), Ok(NO_CACHE), "no cache fits"),
            (minimum, Below(NO_CACHE), Err(()), "but non-caching needs"),
        ],
    );
}

/// An empty volume's cache is one place for a brick, whatever the scale.
#[test]
#[rustfmt::skip] // a row a line
fn emptiness_costs_next_to_nothing() {
    let by_name = |scene: &mut Scene| scene.render.variant = Variant::Caching;
    assert_choices(
        (empty(128, Kind::U16), by_name),
        &[
            (lavapipe, For(ONE_F32), Ok(ONE_F32), "no variant is better"),
            (tiny, Heap, Ok(ONE_F32), "no variant is better"),
            (intel, Below(NO_CACHE), Ok(ONE_F32), "with the volume in bricks"),
        ],
    );
    assert_choices(
        (sparse(80, Kind::U8), as_it_is),
        &[(lavapipe, Heap, Ok(ONE_F32), "no variant is better")],
    );
    assert_choices(
        (dense(128, Kind::U8), as_it_is),
        &[(lavapipe, Heap, Ok(HALF_F32), "caching at scale 1 in f16 has 2097152 nodes")],
    );
}

#[test]
#[rustfmt::skip] // a row a line
fn limits_are_named() {
    let image = || with_short_images(66);
    let allocation = || with_small_allocations(3 << 20);
    let buffer = || with_small_buffers(1 << 10);
    assert_choices(
        (dense(65, Kind::U8), as_it_is),
        &[
            (image, Heap, Ok(HALF_F32), "a 3D image of 66 texels a side"),
            (allocation, Heap, Ok(ONE_F16), "allocates at most 3.0 MiB at once"),
            (buffer, Heap, Err(()), "takes buffers of at most 1.0 KiB"),
        ],
    );
}

/// What is in the way of a cache is not the budget.
#[test]
fn a_cache_that_the_pictures_size_forbids_is_refused_for_that() {
    let large = |scene: &mut Scene| {
        scene.surfaces.iso.push(crate::memory_plan::clay(50.0));
        scene.render.size = [3840, 2160];
        scene.render.variant = Variant::Caching;
    };
    let piece = "tails needs 158.2 MiB, but llvmpipe takes buffers of at most 128.0 MiB";
    assert_choices(
        (dense(64, Kind::U8), large),
        &[(lavapipe, Heap, Err(()), piece)],
    );
}

/// Each point has a column of an image, and the last one two.
#[test]
fn a_transfer_function_has_no_more_points_than_an_image_columns() {
    let mut scene = scene();
    let transfer = &mut scene.medium.as_mut().expect("a medium").transfer;
    // The first lies below all values of the volume, and does not count.
    transfer.resize(4097, transfer[1]);
    let (device, volume, limits) = (
        crate::support::common::device(),
        dense(8, Kind::U8),
        minimum(),
    );
    let choice = Planner::new(&device, &limits, 1 << 30, &volume, &scene).choose();
    let said = choice.expect_err("a refusal").to_string();
    assert!(
        said.starts_with(
            "medium.transfer: found 4096 points at values of the volume, expected at most 4095, "
        ),
        "{said}"
    );
}

/// The cut cubes of 520³ nodes take more than the 16 MiB of the largest buffer that is not the cache's.
#[test]
fn the_cache_may_lack_a_buffer_of_its_own() {
    let zeroes = isolume::scene::volume::Voxels::U8(vec![0; 520 * 520 * 520]);
    let volume = Volume::from_values([520; 3], [1.0; 3], zeroes).expect("a volume");
    let solid = |scene: &mut Scene| {
        crate::memory_plan::with_everything(scene);
        scene.medium = Some(crate::support::common::uniform_medium(0.1, 0.9, 0.5));
    };
    let buffer = || DeviceSummary {
        max_image_3d: 2048,
        device_local_bytes: 64 << 30,
        max_allocation_bytes: 64 << 30,
        ..with_small_buffers(16 << 20)
    };
    let piece =
        "cache: bricks needs 25.1 MiB, but the least of devices takes buffers of at most 16.0 MiB";
    assert_choices((volume, solid), &[(buffer, Heap, Ok(HALF_F32), piece)]);
}

#[test]
#[rustfmt::skip] // a row a line
fn what_the_scene_asks_for_is_all_that_is_tried() {
    let half = |scene: &mut Scene| scene.render.cache_scale = CacheScale::Fixed(0.5);
    assert_choices(
        (dense(128, Kind::U8), half),
        &[
            (nvidia_8, Heap, Ok(HALF_F32), "no variant is better"),
            (nvidia_8, Below(HALF_F32), Ok(HALF_F16), "; caching at scale 0.5 in f32"),
            (nvidia_8, Below(HALF_F16), Ok(NO_CACHE), "no cache fits"),
        ],
    );
    let whole_f16 = |scene: &mut Scene| {
        scene.render.cache_scale = CacheScale::Fixed(1.0);
        scene.render.cache_format = F16;
    };
    assert_choices(
        (dense(128, Kind::U8), whole_f16),
        &[
            (lavapipe, Heap, Ok(ONE_F16), "no variant is better"),
            (lavapipe, Below(ONE_F16), Ok(NO_CACHE), "no cache fits"),
        ],
    );
    let by_name = |scene: &mut Scene| {
        scene.render.variant = Variant::Caching;
        scene.render.cache_format = F32;
    };
    assert_choices(
        (dense(64, Kind::F32), by_name),
        &[
            (amd_16, For(QUARTER_F32), Ok(QUARTER_F32), "it was asked for, and it is the best"),
            (amd_16, Below(EIGHTH_F32), Err(()), "no cache that was asked for fits"),
            (tiny, Below(NO_CACHE), Err(()), "but non-caching needs"),
        ],
    );
    let finest = |scene: &mut Scene| {
        scene.render.variant = Variant::Caching;
        scene.render.cache_scale = CacheScale::Fixed(1.0);
    };
    let short_images = || with_short_images(66);
    assert_choices(
        (dense(65, Kind::U8), finest),
        &[(short_images, Heap, Err(()), "a cache at scale 1 is impossible: its ")],
    );
    let without = |scene: &mut Scene| scene.render.variant = Variant::NonCaching;
    assert_choices(
        (dense(64, Kind::U8), without),
        &[(nvidia_80, Heap, Ok(NO_CACHE), "it was asked for")],
    );
}

#[test]
fn a_cache_without_use_is_not_taken() {
    let limited = |scene: &mut Scene| scene.render.max_bounces = 3;
    let vacuum = |scene: &mut Scene| scene.medium = None;
    let clear = |scene: &mut Scene| {
        let points = scene.medium.iter_mut().flat_map(|m| &mut m.transfer);
        points.for_each(|p| p.opacity = 0.0);
    };
    let black = |scene: &mut Scene| {
        let points = scene.medium.iter_mut().flat_map(|m| &mut m.transfer);
        points.for_each(|p| p.color = [0.0; 3]);
    };
    let beyond_the_data = |scene: &mut Scene| {
        let points = scene.medium.iter_mut().flat_map(|m| &mut m.transfer);
        points.for_each(|p| p.value += 1e6);
        if let Some(medium) = &mut scene.medium {
            medium.transfer[0].opacity = 0.0;
        }
    };
    let dark = |scene: &mut Scene| {
        scene.lights.suns.clear();
        scene.lights.environment.radiance = [0.0; 3];
    };
    let cases: [(Change, &str); 6] = [
        (limited, "render.max_bounces is set"),
        (vacuum, "no medium scatters light"),
        (clear, "no medium scatters light"),
        (black, "no medium scatters light"),
        (beyond_the_data, "no medium scatters light"),
        (dark, "no light shines"),
    ];
    for (change, piece) in cases {
        assert_choices(
            (dense(64, Kind::U8), change),
            &[
                (nvidia_8, Heap, Ok(NO_CACHE), piece),
                (lavapipe, Below(NO_CACHE), Err(()), "but non-caching needs"),
            ],
        );
    }
}
