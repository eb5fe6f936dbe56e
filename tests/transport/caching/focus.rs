//! Nodes in sight get most paths: that pays, and whoever looks from elsewhere is not left behind.

use isolume::render::{Batch, Until};
use isolume::scene::volume::Volume;
use isolume::scene::*;

use crate::caching::gathering::empty_without_gathering;
use crate::support::common::*;

fn from(eye: [f64; 3]) -> Scene {
    let camera = Camera {
        eye,
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height: 1.0 },
    };
    let mut scene = empty_scene([16, 16], camera);
    scene.medium = Some(uniform_medium(30.0, 0.9, 0.0));
    scene.lights.environment.radiance = [1.0; 3];
    scene
}

/// Of optical depth 30: a camera sees one side of it.
fn block() -> Volume {
    constant_field(1.0, [32; 3], [1.0 / 32.0; 3])
}

fn filled(scene: &Scene, everywhere: bool, updates: u32, seed: u32) -> Cached {
    let mut cached = cached(scene, &block(), 0.5, CacheFormat::F32, 0, seed);
    if everywhere {
        serve_all_views(&mut cached);
    }
    cached.fill(updates);
    cached
}

fn serve_all_views(cached: &mut Cached) {
    cached.caching().serve_all_views();
}

/// All that is in sight gets the paths that it lacks.
fn catch_up(cached: &mut Cached) {
    assert!(
        cached
            .caching()
            .batch(Batch::CatchUp, Until::NEVER)
            .expect("a batch")
    );
}

/// Seen from the other side from now on.
fn turn(cached: &mut Cached) {
    look(cached, &from([0.0, 0.0, -3.0]));
}

fn look(cached: &mut Cached, scene: &Scene) {
    let changed = cached.renderer.scene().changed_to(scene, &block());
    let lasts = cached.renderer.change(&changed);
    assert!(lasts.expect("a change"));
}

/// What a cache shows from the other side.
fn behind(cached: &mut Cached) -> Vec<[f32; 4]> {
    turn(cached);
    cached.march()
}

/// The error of the picture that a cache shows, relative to its mean: from two independent caches, and as
/// the first of them measures it; and the paths of the first.
fn errors_and_paths(scene: &Scene, everywhere: bool, updates: u32) -> ([f64; 2], u64) {
    let mut cache = filled(scene, everywhere, updates, 1);
    let first = cache.march();
    let paths = cache.renderer.paths();
    let measured = cache.cache().filling.relative_error;
    cache.reseed(2);
    cache.fill(updates);
    let found = rms_difference(&first, &cache.march()) / 2.0f64.sqrt();
    println!("everywhere {everywhere}: {paths} paths, error {found:.4}, measured {measured:.4}");
    ([found, measured], paths)
}

#[test]
fn what_is_in_sight_is_known_better_after_as_many_paths() {
    let scene = from([0.0, 0.0, 3.0]);
    let ([wide, _], wide_paths) = errors_and_paths(&scene, true, 128);
    let ([focused, measured], focused_paths) = errors_and_paths(&scene, false, 256);
    assert!(focused_paths < wide_paths);
    assert!(focused < 0.85 * wide);
    assert!((measured / focused - 1.0).abs() < 0.25);
}

#[test]
fn all_cells_get_the_same_for_whoever_looks_from_everywhere() {
    let cached = filled(&from([0.0, 0.0, 3.0]), true, 40, 1);
    let cache = cached.cache();
    assert_eq!(cache.mean_updates(), 40.0);
    // The first 32 are those of one node in eight.
    assert_eq!(cache.work.paths, 32 * 8 * 8 * 8 + 8 * 16 * 16 * 16);
}

/// Paths are numbered from node to node: it does not matter when a node has had them, if it does not gather.
#[test]
fn what_has_caught_up_is_what_had_been_filled_everywhere() {
    let scene = from([0.0, 0.0, 3.0]);
    let empty = || empty_without_gathering(&scene, &block(), CacheFormat::F32, 1);
    let (mut late, mut at_once) = (empty(), empty());
    late.fill(16);
    serve_all_views(&mut late);
    catch_up(&mut late);
    serve_all_views(&mut at_once);
    at_once.fill(16);
    assert_eq!(late.renderer.paths(), at_once.renderer.paths());
    for (a, b) in behind(&mut late).iter().zip(behind(&mut at_once)) {
        assert!((a[0] - b[0]).abs() <= 1e-5 * b[0], "{a:?} {b:?}");
    }
}

#[test]
fn what_has_caught_up_is_as_good_as_what_had_been_filled_everywhere() {
    let scene = from([0.0, 0.0, 3.0]);
    let [mut late, mut other] = [1, 2].map(|seed| {
        let mut late = filled(&scene, false, 128, seed);
        serve_all_views(&mut late);
        catch_up(&mut late);
        late
    });
    let mut at_once = filled(&scene, true, 128, 1);
    assert_eq!(late.renderer.paths(), at_once.renderer.paths());
    let mut exact = filled(&scene, true, 2048, 3);
    let exact = behind(&mut exact);
    let [late, other, at_once] =
        [&mut late, &mut other, &mut at_once].map(|cached| rms_difference(&behind(cached), &exact));
    println!("errors from behind: {late:.4} and {other:.4}, at once {at_once:.4}");
    assert!(late < 1.15 * at_once && other < 1.15 * at_once);
}

#[test]
fn from_elsewhere_the_cache_catches_up() {
    let before = from([0.0, 0.0, 3.0]);
    let mut turned = filled(&before, false, 16, 1);
    let paths = turned.renderer.paths();
    assert!(turned.cache().is_caught_up());
    turn(&mut turned);
    assert!(!turned.cache().is_caught_up());
    catch_up(&mut turned);
    assert!(turned.cache().is_caught_up() && turned.updates() == 16);
    let made_up = turned.renderer.paths() - paths;
    println!("{paths} paths, {made_up} more from behind");
    assert!(made_up > 0 && made_up <= paths);
    catch_up(&mut turned);
    assert_eq!(turned.renderer.paths(), paths + made_up);
}

/// Where bricks are narrower than a pixel, it cannot be told which are in sight.
#[test]
fn from_far_away_all_cells_catch_up() {
    let mut cached = filled(&from([0.0, 0.0, 3.0]), false, 16, 1);
    assert!(cached.cache().mean_updates() < 16.0);
    let mut far = from([0.0, 0.0, 3.0]);
    far.camera.projection = Projection::Orthographic { height: 100.0 };
    look(&mut cached, &far);
    catch_up(&mut cached);
    assert_eq!(cached.cache().mean_updates(), 16.0);
}

/// A thin medium of many bricks, each of which weighs little, is in sight all the same: seen against black under a white
/// sky, it is as bright as what it scatters of one.
#[test]
fn haze_is_in_sight() {
    const DEPTH: f64 = 0.001;
    let mut scene = from([0.0, 0.0, 3.0]);
    scene.medium = Some(uniform_medium(DEPTH, 0.9, 0.0));
    scene.render.background = Background::Color([0.0; 3]);
    let volume = constant_field(1.0, [128; 3], [1.0 / 128.0; 3]);
    let mut haze = cached(&scene, &volume, 0.5, CacheFormat::F16, 0, 1);
    haze.fill(8);
    let pixels = haze.at_rest(1, 16).mean;
    let mean = pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() / pixels.len() as f64;
    let expected = 0.9 * DEPTH;
    assert!((mean / expected - 1.0).abs() < 0.02, "{mean} {expected}");
}
