//! What keeps the cache's light and what ends it.

use isolume::engine::{Changed, Engine};
use isolume::render::{Batch, CacheLayout, GpuScene, Until};
use isolume::scene::*;

use crate::support::common::*;
use crate::support::fields::indexed_field;

fn scene(light: LightModel) -> Scene {
    let camera = Camera {
        eye: [0.0, 0.0, 30.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Perspective { fov_y: 30.0 },
    };
    let mut scene = empty_scene([8, 8], camera);
    scene.medium = Some(uniform_medium(0.1, 0.8, 0.3));
    scene.lights.environment.radiance = [1.0; 3];
    scene.lights.suns = vec![DirectionalLight {
        direction: [0.0, -1.0, 0.0],
        irradiance: [2.0; 3],
    }];
    scene.clips = vec![ClipPlane {
        normal: [1.0, 0.0, 0.0],
        offset: 3.0,
    }];
    scene.surfaces.light = light;
    scene.surfaces.iso = vec![Isosurface {
        value: 0.5,
        opacity: 1.0,
        color: [0.8; 3],
        shading: Shading::Lambert,
    }];
    scene
}

fn lasts(light: LightModel, change: impl Fn(&mut Scene)) -> bool {
    let volume = indexed_field([8; 3], [1.0; 3], |[x, ..]| x as f32 / 8.0);
    let before = scene(light);
    let mut after = before.clone();
    change(&mut after);
    let cached = |scene: &Scene| {
        let scene = GpuScene::new(scene, &volume, 0);
        let occupancy = scene.occupancy(&volume);
        let layout = CacheLayout::new([8; 3], &occupancy, 0.5, CacheFormat::F16, 4096);
        scene.with_cache(layout.expect("a layout"))
    };
    cached(&before).shares_light_with(&cached(&after))
}

fn lasts_in_both(change: impl Fn(&mut Scene)) -> bool {
    let local = lasts(LightModel::Local, &change);
    assert_eq!(local, lasts(LightModel::Full, &change));
    local
}

#[test]
fn the_camera_and_the_picture_keep_it() {
    assert!(lasts_in_both(|s| s.camera.eye = [5.0, 20.0, 10.0]));
    assert!(lasts_in_both(|s| s.render.exposure = 2.0));
    assert!(lasts_in_both(|s| s.render.tone = Tone::Filmic));
}

#[test]
fn surfaces_keep_it_in_local_light_alone() {
    let isovalue = |s: &mut Scene| s.surfaces.iso[0].value = 0.3;
    let material = |s: &mut Scene| s.surfaces.iso[0].color = [0.1; 3];
    assert!(lasts(LightModel::Local, isovalue) && lasts(LightModel::Local, material));
    assert!(!lasts(LightModel::Full, isovalue) && !lasts(LightModel::Full, material));
}

/// Another shading needs other passes, and so another engine.
#[test]
fn light_goes_from_one_engine_to_another() {
    let volume = constant_field(1.0, [16; 3], [1.0; 3]);
    let mut before = scene(LightModel::Local);
    before.render.variant = Variant::Caching;
    let mut after = before.clone();
    after.surfaces.iso[0].shading = Shading::Disney(Disney::default());
    let host = watched_host();
    let begin = |scene: &Scene| Engine::new(&host, &volume, scene, 1).expect("an engine");
    let mut old = begin(&before);
    assert!(
        old.light_for(&after).expect("light").is_none(),
        "there is none yet"
    );
    let mut caching = old.caching().expect("a cache");
    assert!(
        caching
            .batch(Batch::Paths(4), Until::NEVER)
            .expect("a batch")
    );
    assert_eq!(
        old.change_in_place(&after).expect("no change"),
        Changed::Impossible
    );
    let mut darker = after.clone();
    darker.lights.suns[0].irradiance = [1.0; 3];
    assert!(
        old.light_for(&darker).expect("light").is_none(),
        "it is of other lights"
    );
    let light = old.light_for(&after).expect("light").expect("some");
    let [mut new, mut empty] = [begin(&after), begin(&after)];
    assert!(new.adopt_light(&light).expect("the same layout"));
    assert_eq!(new.updates(), 4);
    assert!(!new.is_caught_up(), "what is in sight is not known yet");
    // What the cache shows is the same as what another engine fills it with.
    let mut caching = empty.caching().expect("a cache");
    assert!(
        caching
            .batch(Batch::Paths(4), Until::NEVER)
            .expect("a batch")
    );
    let [adopted, filled] = [&mut new, &mut empty].map(|e| e.march().expect("a march"));
    assert!(adopted.expect("a picture").rgb == filled.expect("a picture").rgb);
    drop((old, new, empty));
    host.check_validation().expect("silence");
}

/// The cache knows each light's share in all of them.
#[test]
fn lights_that_change_alike_keep_it() {
    let by = |s: &mut Scene, factors: [f64; 3]| {
        for (c, factor) in factors.into_iter().enumerate() {
            s.lights.suns[0].irradiance[c] *= factor;
            s.lights.environment.radiance[c] *= factor;
        }
    };
    assert!(lasts_in_both(|s| by(s, [0.1; 3])));
    assert!(lasts_in_both(|s| by(s, [3.0, 1.0, 0.7])));
    assert!(!lasts_in_both(|s| s.lights.suns[0].irradiance = [2.1; 3]));
}

#[test]
fn a_cache_under_other_lights_is_that_of_a_new_renderer() {
    let volume = constant_field(1.0, [8; 3], [1.0; 3]);
    let mut before = scene(LightModel::Local);
    before.lights.environment.radiance = [0.0; 3];
    before.medium.as_mut().unwrap().g = 0.4;
    let mut after = before.clone();
    after.lights.suns[0].irradiance = [0.3, 5.0, 1.0];
    let mut kept = cached(&before, &volume, 0.5, CacheFormat::F32, 4, 1);
    let mut fresh = cached(&after, &volume, 0.5, CacheFormat::F32, 4, 1);
    let lasts = kept.renderer.change(fresh.renderer.scene());
    assert!(lasts.expect("a change") && kept.updates() == 4);
    for (kept, fresh) in kept.march().iter().zip(fresh.march()) {
        for c in 0..4 {
            assert!(
                (kept[c] - fresh[c]).abs() <= 1e-5 * fresh[c],
                "{kept:?} {fresh:?}"
            );
        }
    }
}

#[test]
fn lights_and_the_medium_end_it() {
    assert!(!lasts_in_both(
        |s| s.lights.suns[0].direction = [0.6, -0.8, 0.0]
    ));
    assert!(!lasts_in_both(
        |s| s.lights.suns[0].irradiance = [2.0, 2.0, 1.0]
    ));
    assert!(!lasts_in_both(|s| s.lights.environment.radiance = [0.5; 3]));
    assert!(!lasts_in_both(|s| s.medium.as_mut().unwrap().density = 0.2));
    assert!(!lasts_in_both(|s| s.medium.as_mut().unwrap().g = 0.2));
    let color = |s: &mut Scene| s.medium.as_mut().unwrap().transfer[0].color = [0.5; 3];
    assert!(!lasts_in_both(color));
    assert!(!lasts_in_both(|s| s.clips[0].offset = 2.0));
}

#[test]
fn another_camera_finds_the_cache_filled() {
    let volume = constant_field(1.0, [8; 3], [1.0; 3]);
    let before = scene(LightModel::Local);
    let mut cache = cached(&before, &volume, 0.5, CacheFormat::F32, 4, 1);
    let mut after = before.clone();
    after.camera.eye = [10.0, 5.0, 28.0];
    let mut fresh = cached(&after, &volume, 0.5, CacheFormat::F32, 4, 1);
    let lasts = cache.renderer.change(fresh.renderer.scene());
    assert!(lasts.expect("a change") && cache.updates() == 4);
    assert_eq!(cache.march(), fresh.march());
}

#[test]
fn after_a_change_the_picture_is_that_of_a_new_renderer() {
    let volume = constant_field(1.0, [8; 3], [1.0; 3]);
    let before = scene(LightModel::Local);
    let mut after = before.clone();
    after.camera.eye = [10.0, 5.0, 28.0];
    after.medium = Some(uniform_medium(0.3, 0.6, 0.3));
    let mut changed = cached(&before, &volume, 0.5, CacheFormat::F32, 4, 1);
    let mut fresh = cached(&after, &volume, 0.5, CacheFormat::F32, 8, 1);
    let lasts = changed.renderer.change(fresh.renderer.scene());
    assert!(!lasts.expect("a change") && changed.updates() == 0);
    changed.fill(8);
    assert_eq!(changed.march(), fresh.march());
    assert_eq!(changed.at_rest(2, 2).mean, fresh.at_rest(2, 2).mean);
}

#[test]
fn a_warm_up_leaves_nothing_behind() {
    let volume = constant_field(1.0, [8; 3], [1.0; 3]);
    let scene = scene(LightModel::Local);
    let [mut cold, mut warm] = [0, 1].map(|_| cached(&scene, &volume, 0.5, CacheFormat::F16, 0, 1));
    warm.renderer.warm_up().expect("a warm-up");
    assert!(warm.updates() == 0 && warm.renderer.paths() == 0);
    for renderer in [&mut cold, &mut warm] {
        renderer.fill(4);
    }
    assert_eq!(cold.march(), warm.march());
    assert_eq!(cold.at_rest(2, 2).mean, warm.at_rest(2, 2).mean);
}
