//! A render takes what its plan says: to the byte, and not a byte less.

use std::sync::Arc;

use isolume::engine::{Changed, Engine, Host, HostOptions, Limit};
use isolume::gpu::{Device, Memory};
use isolume::render::{Batch, GpuScene, Renderer, Until};
use isolume::scene::*;

use crate::memory_plan::{F16, F32, Kind, Rung, clay, dense, name, plan, scene, sparse};

fn assert_exact(device: &Arc<Device>, surfaces: Option<LightModel>, g: f64, rung: Rung) {
    let volume = sparse(25, Kind::U16);
    let mut scene = scene();
    if let Some(light) = surfaces {
        scene.surfaces.iso.push(clay(50.0));
        scene.surfaces.light = light;
    }
    if let Some(medium) = &mut scene.medium {
        medium.g = g;
    }
    let what = format!("{surfaces:?}, g = {g}, {}", name(rung));
    let plan = plan(device, &device.summary, &volume, &scene, rung).expect("a plan");
    let scene = GpuScene::new(&scene, &volume, 1);
    let scene = scene.with_variant(plan.variant.clone());

    let memory = Memory::new(device, plan.bytes()).expect("memory");
    let mut renderer = Renderer::new(&memory, &volume, scene.clone()).expect(&what);
    if let Some(mut caching) = renderer.caching() {
        assert!(
            caching.batch(Batch::Paths(1), Until::NEVER).expect(&what),
            "{what}"
        );
    }
    assert!(renderer.unit(1, Until::NEVER).expect(&what), "{what}");
    renderer.film().expect(&what);
    renderer.first_hits().expect(&what);
    drop(renderer);
    assert_eq!(memory.peak(), plan.bytes(), "{what}");
    assert_eq!(memory.resources_at_peak(), plan.resources, "{what}");
    let left = memory.history().last().map(|&(_, bytes)| bytes);
    assert_eq!(left, Some(0), "{what}: something is never given back");

    let too_little = Memory::new(device, plan.bytes() - 1).expect("memory");
    let refused = Renderer::new(&too_little, &volume, scene).err();
    let refused = refused.unwrap_or_else(|| panic!("{what}: a byte less is enough"));
    assert_eq!(refused.exit_status(), 4, "{what}: {refused}");
}

/// In an anisotropic medium whose light is grey, the flux takes as much memory as the light, otherwise three times as
/// much.
#[test]
fn only_colored_light_has_a_flux_for_each_channel() {
    type Change = fn(&mut Scene);
    let changes: [(f64, Change); 4] = [
        (1.0, |_| ()),
        (1.0, |scene| {
            scene.lights.suns[0].irradiance = [3.0, 2.0, 1.0];
        }),
        (3.0, |scene| {
            scene.lights.suns[0].irradiance = [3.0, 2.0, 1.0];
            scene.lights.environment.radiance = [1.0; 3];
        }),
        (3.0, |scene| {
            let medium = scene.medium.as_mut().expect("a medium");
            medium.transfer[1].color = [0.9, 0.8, 0.7];
        }),
    ];
    let device = crate::support::common::device();
    for (expected, change) in changes {
        let mut scene = scene();
        scene.medium.as_mut().expect("a medium").g = 0.5;
        change(&mut scene);
        let volume = sparse(128, Kind::U8);
        let plan = plan(&device, &device.summary, &volume, &scene, Some((1.0, F16)));
        let resources = plan.expect("a plan").resources;
        let [light, flux] = ["cache: light", "cache: flux"].map(|name| {
            let resource = resources.iter().find(|resource| resource.name == name);
            resource.expect("it is planned").bytes as f64
        });
        let share = flux / light;
        assert!(
            (share / expected - 1.0).abs() < 0.01,
            "{share}, not {expected}"
        );
    }
}

#[test]
fn a_render_takes_what_was_planned() {
    use LightModel::{Full, Local};
    let device = crate::support::common::device();
    for (surfaces, g, rung) in [
        (None, 0.0, None),
        (Some(Local), 0.5, None),
        (None, 0.0, Some((1.0, F32))),
        (Some(Local), 0.5, Some((1.0, F16))),
        (Some(Full), 0.0, Some((0.5, F16))),
        (Some(Full), 0.5, Some((0.5, F32))),
    ] {
        assert_exact(&device, surfaces, g, rung);
    }
    crate::support::common::assert_silent(&device);
}

/// One edit makes the picture larger and the cache smaller, and another takes it back: what shrinks makes room for what grows.
#[test]
fn an_edit_stays_within_the_budget_all_the_way() {
    let volume = dense(48, Kind::U8);
    let scene = |size: [u32; 2], offset: f64| {
        let mut scene = scene();
        scene.render.size = size;
        scene.render.variant = Variant::Caching;
        scene.render.cache_scale = CacheScale::Fixed(1.0);
        scene.render.cache_format = F32;
        scene.clips.push(ClipPlane {
            normal: [1.0, 0.0, 0.0],
            offset,
        });
        scene
    };
    let of_the_volume = scene([16, 16], 100.0);
    let of_the_picture = scene([256, 192], -20.0);
    let host = |bytes: u64| {
        let options = HostOptions {
            vram_budget: Some(Limit::Bytes(bytes)),
            validation: true,
            ..HostOptions::default()
        };
        Host::open(&options).expect("a Vulkan device and the validation layers")
    };
    let planned = |scene: &Scene| {
        let engine = Engine::new(&host(1 << 30), &volume, scene, 1).expect("an engine");
        engine.memory_stats().planned_bytes
    };
    let budget = planned(&of_the_volume).max(planned(&of_the_picture));
    let host = host(budget);
    let mut engine = Engine::new(&host, &volume, &of_the_volume, 1).expect("an engine");
    for edited in [&of_the_picture, &of_the_volume, &of_the_picture] {
        let changed = engine.change_in_place(edited).expect("room for the edit");
        assert_eq!(changed, Changed::Light);
    }
    assert!(engine.memory_stats().peak_bytes <= budget);
    drop(engine);
    host.check_validation().expect("silence");
}
