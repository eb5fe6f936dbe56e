//! What is chosen where the volume does not fit whole: how much of the memory a cache leaves to its bricks.

use isolume::error::{Error, MemoryError};
use isolume::render::{Choice, Planner};
use isolume::scene::volume::Volume;
use isolume::scene::*;

use crate::memory_plan::devices::nvidia_8;
use crate::memory_plan::ladder::stated_bytes;
use crate::memory_plan::{F16, F32, Kind, dense, plan, scene};

/// Rays to suns would need bricks as well.
fn under_a_sky() -> Scene {
    let mut scene = scene();
    scene.lights.suns.clear();
    scene.lights.environment.radiance = [1.0; 3];
    scene
}

/// The caches among which a trial decides.
fn scales_and_bricks(budget: u64) -> Vec<(f64, u32)> {
    let device = crate::support::common::device();
    let (volume, limits, scene) = (dense(192, Kind::U8), nvidia_8(), under_a_sky());
    let planner = Planner::new(&device, &limits, budget, &volume, &scene);
    let choice = planner.choose().expect("a plan");
    let caches = planner.caches(&choice).expect("plans");
    let look = |Choice { plan, .. }: Choice| {
        let scale = plan.variant.cache().expect("a cache").scale;
        (scale, plan.bricks.map_or(0, |bricks| bricks.capacity()))
    };
    caches.into_iter().map(look).collect()
}

#[test]
fn a_coarser_cache_is_tried_where_it_leaves_room_for_more_bricks() {
    let device = crate::support::common::device();
    let bytes = |rung| {
        let scene = under_a_sky();
        let plan = plan(&device, &nvidia_8(), &dense(192, Kind::U8), &scene, rung);
        plan.expect("a plan").bytes()
    };
    // With the volume whole, it is the finest that fits.
    assert_eq!(scales_and_bricks(bytes(Some((0.5, F32)))), [(0.5, 0)]);
    let tried = scales_and_bricks(bytes(None) - 1);
    assert!(tried.len() > 1, "{tried:?}");
    for pair in tried.windows(2) {
        let [(fine, few), (coarse, more)] = [pair[0], pair[1]];
        assert!(coarse <= fine && more > few, "{tried:?}");
    }
}

/// The least that is said to be needed for something better buys it, and no less does.
fn climb_by_promises(volume: &Volume, scene: &Scene) -> Vec<String> {
    let (device, limits) = (crate::support::common::device(), nvidia_8());
    let choose = |budget| Planner::new(&device, &limits, budget, volume, scene).choose();
    let found = |budget| {
        let plan = choose(budget).expect("a choice").plan;
        (plan.variant.description(), plan.bricks.is_some())
    };
    let refusal = match (choose(0).expect_err("no memory"), scene.render.variant) {
        (Error::Memory(MemoryError::Plan { smallest_cache, .. }), Variant::Caching) => {
            smallest_cache.expect("a cache")
        }
        (refusal, _) => refusal.to_string(),
    };
    let mut budget = stated_bytes(&refusal).expect("a need");
    assert!(choose(budget - 1).is_err(), "{refusal}");
    let mut chosen = vec![found(budget)];
    while let Some((_, true)) = chosen.last() {
        let promise = choose(budget).expect("a choice").next_better;
        let next = stated_bytes(&promise).expect("a need");
        assert_eq!(found(next - 1), *chosen.last().unwrap(), "{promise}");
        assert!(promise.contains(&found(next).0), "{promise}");
        chosen.push(found(next));
        budget = next;
    }
    chosen.into_iter().map(|(name, _)| name).collect()
}

#[test]
fn what_is_next_better_is_true() {
    let chosen = climb_by_promises(&dense(192, Kind::U16), &under_a_sky());
    assert!(chosen.len() > 3, "{chosen:?}");
}

/// At the faces of the box, the medium is so dense that wide cubes are at its rim, and narrow ones are not.
#[test]
fn it_is_true_where_a_coarse_cache_needs_more_than_a_fine_one() {
    let mut scene = under_a_sky();
    scene.render.size = [700, 600];
    scene.medium.as_mut().expect("a medium").density = 0.015;
    let volume = dense(192, Kind::U16);
    let device = crate::support::common::device();
    let bytes = |scale| {
        let rung = Some((scale, F16));
        let plan = plan(&device, &nvidia_8(), &volume, &scene, rung);
        plan.expect("a plan").bytes()
    };
    assert!(bytes(0.125) > bytes(0.25));
    let chosen = climb_by_promises(&volume, &scene);
    assert!(chosen.len() > 1, "{chosen:?}");
    scene.render.variant = Variant::Caching;
    climb_by_promises(&volume, &scene);
}

/// A march reads along rays to suns from every surface that lets light through, and begins anew when a brick is missing: the
/// bricks of all of these rays are there at once, or there is no march.
#[test]
fn a_march_in_bricks_has_room_for_all_that_a_pixel_reads() {
    let device = crate::support::common::device();
    let mut scene = scene();
    scene.surfaces.iso = vec![Isosurface {
        value: 100.0,
        opacity: 0.5,
        color: [0.8; 3],
        shading: Shading::Lambert,
    }];
    scene.lights.suns = vec![DirectionalLight {
        direction: [0.3, -1.0, -0.4],
        irradiance: [3.0; 3],
    }];
    let volume = dense(128, Kind::F32);
    let mut plans_in_bricks = 0;
    for budget in (6_000_000..14_000_000).step_by(500_000) {
        let planner = Planner::new(&device, &device.summary, budget, &volume, &scene);
        let Ok(choice) = planner.choose() else {
            continue;
        };
        let Some(bricks) = choice.plan.bricks else {
            continue;
        };
        plans_in_bricks += 1;
        let has_all = bricks.capacity() >= bricks.total();
        let is_marched = choice.plan.variant.cache().is_some();
        assert!(has_all || !is_marched, "{budget}: {}", choice.reason);
    }
    assert!(plans_in_bricks > 3);
}
