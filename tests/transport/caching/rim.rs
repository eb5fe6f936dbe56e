//! Where a face of the box, a clip plane or the transfer function ends a dense medium, light falls steeply behind that,
//! within less than a cell of the cache and less than a step of a march.

use std::ops::Range;

use isolume::scene::volume::Volume;
use isolume::scene::*;

use crate::support::common::*;
use crate::support::fields::indexed_field;
use crate::support::small_scenes;

/// A cube of side 16 of voxels of size 1, seen from a corner: three faces show.
pub fn scene(optical_depth_of_a_voxel: f64) -> Scene {
    let camera = Camera {
        eye: [30.0, 40.0, 60.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height: 26.0 },
    };
    let mut scene = empty_scene([32, 32], camera);
    scene.medium = Some(uniform_medium(optical_depth_of_a_voxel, 0.8, 0.0));
    scene.render.background = Background::Color([0.0; 3]);
    scene
}

pub fn full() -> Volume {
    constant_field(1.0, [16; 3], [1.0; 3])
}

/// The same cube with so many empty voxels around it.
fn padded(margin: u32) -> Volume {
    let is_inside = |i: u32| (margin..margin + 16).contains(&i);
    indexed_field([16 + 2 * margin; 3], [1.0; 3], |voxel| {
        if voxel.into_iter().all(is_inside) {
            1.0
        } else {
            0.0
        }
    })
}

pub fn sun(direction: [f64; 3]) -> DirectionalLight {
    small_scenes::sun(direction, [2.0; 3])
}

pub fn sum(picture: &[[f32; 4]]) -> f64 {
    picture.iter().map(|pixel| f64::from(pixel[1])).sum()
}

/// What the means of a cached picture at rest and of one in motion are off by, relative to that of an uncached one, of which
/// there are several; and the first one's standard error. Each node has so many paths.
pub fn measure(
    scene: &Scene,
    volume: &Volume,
    scale: f64,
    references: &[f64],
    paths: u32,
) -> [f64; 3] {
    let mut cache = cached(scene, volume, scale, CacheFormat::F32, 1, 0);
    let difference = |(reference, seed)| {
        cache.reseed(seed);
        cache.fill(paths);
        let in_motion = sum(&cache.march()) / reference - 1.0;
        [sum(&cache.at_rest(1, 64).mean) / reference - 1.0, in_motion]
    };
    let differences: Vec<[f64; 2]> = references.iter().zip(1..).map(difference).collect();
    let n = references.len() as f64;
    let [at_rest, in_motion] = [0, 1].map(|i| differences.iter().map(|d| d[i]).sum::<f64>() / n);
    let squares: f64 = differences.iter().map(|d| (d[0] - at_rest).powi(2)).sum();
    [at_rest, in_motion, (squares / (n - 1.0) / n).sqrt()]
}

/// Limits are those of scales 1 and ½; in motion they are ranges, which `tools/measurements/cache.md` states, rounded to a
/// percent.
pub fn assert_agrees(
    what: &str,
    scene: &Scene,
    volume: &Volume,
    [seeds, paths]: [u32; 2],
    limits: [f64; 2],
    limits_in_motion: [Range<f64>; 2],
) {
    let films = render_seeds(scene, volume, 256, (1..=seeds).map(|seed| 100 + seed));
    let references: Vec<f64> = films.iter().map(|film| sum(&film.mean)).collect();
    let limits = limits.into_iter().zip(limits_in_motion);
    for (scale, (limit, limit_in_motion)) in [1.0, 0.5].into_iter().zip(limits) {
        let [bias, in_motion, error] = measure(scene, volume, scale, &references, paths);
        let [percent, error_percent, percent_in_motion] =
            [bias, error, in_motion].map(|x| 100.0 * x);
        println!(
            "{what}, scale {scale}: {percent:+.2} % ± {error_percent:.2}, in motion {percent_in_motion:+.1} %"
        );
        assert!(error < 0.5 * limit, "{what}: {error}");
        assert!(bias.abs() < limit, "{what}, scale {scale}: {bias}");
        assert!(
            limit_in_motion.contains(&in_motion),
            "{what}, scale {scale}, in motion: {in_motion}"
        );
    }
}

/// Interpolated between nodes, much of this light would be missing.
#[test]
fn light_behind_the_faces_of_the_box() {
    for (depth, in_motion) in [
        (0.1, [-0.005..0.005, -0.005..0.005]),
        (0.3, [-0.01..0.005, -0.025..0.005]),
        (1.5, [-0.17..0.005, -0.42..0.005]),
    ] {
        let mut scene = scene(depth);
        scene.lights.environment.radiance = [1.0; 3];
        scene.lights.suns = vec![sun([0.3, -0.8, -0.5])];
        let what = format!("optical depth {depth} a voxel");
        assert_agrees(&what, &scene, &full(), [4, 256], [0.006; 2], in_motion);
    }
}

/// Two or three nodes along an axis, all in cubes at faces, tell nothing of the light between them.
#[test]
fn boxes_with_hardly_any_nodes() {
    for (what, dims, scale, depth) in [
        ("a small box", [4; 3], 0.25, 3.0),
        ("a thin stack", [32, 32, 4], 0.5, 0.5),
        ("a single voxel", [1; 3], 1.0, 2.0),
    ] {
        let mut scene = scene(depth);
        scene.camera.projection = Projection::Orthographic {
            height: 1.2 * f64::from(dims[0]),
        };
        scene.lights.environment.radiance = [1.0; 3];
        scene.lights.suns = vec![sun([0.3, -0.8, -0.5])];
        let volume = constant_field(1.0, dims, [1.0; 3]);
        let films = render_seeds(&scene, &volume, 256, 1..=4);
        let references: Vec<f64> = films.iter().map(|film| sum(&film.mean)).collect();
        let [bias, _, error] = measure(&scene, &volume, scale, &references, 256);
        let [percent, error_percent] = [bias, error].map(|x| 100.0 * x);
        println!("{what}: {percent:+.2} % ± {error_percent:.2}");
        assert!(error < 0.003, "{what}: {error}");
        assert!(bias.abs() < 0.006, "{what}: {bias}");
    }
}

/// Twenty times as wide as thick, and seen from the side: taken for an infinite slab, it loses a sixth of its light or more.
#[test]
fn a_flat_box_from_the_side() {
    let mut scene = scene(0.7);
    scene.camera.eye = [200.0, 0.0, 0.0];
    scene.camera.up = [0.0, 0.0, 1.0];
    scene.camera.projection = Projection::Orthographic { height: 8.0 };
    scene.lights.environment.radiance = [1.0; 3];
    let volume = constant_field(1.0, [3, 3, 24], [40.0, 40.0, 0.25]);
    let films = render_seeds(&scene, &volume, 256, 1..=2);
    let references: Vec<f64> = films.iter().map(|film| sum(&film.mean)).collect();
    let [bias, _, error] = measure(&scene, &volume, 0.5, &references, 64);
    println!("{:+.2} % ± {:.2}", 100.0 * bias, 100.0 * error);
    assert!(error < 0.007 && bias.abs() < 0.02, "{bias} ± {error}");
}

/// A cache that has had few paths still has light of the coarse lattice, of which the nodes between would get too much, or, in a
/// thin medium, too little.
#[test]
fn light_behind_the_faces_in_a_young_cache() {
    for (depth, albedo, g, limit, in_motion) in [
        (0.9, 0.7, 0.0, 0.006, [-0.45..0.005, -0.67..0.005]),
        (0.9, 0.7, 0.3, 0.006, [-0.45..0.005, -0.67..0.005]),
        (0.14, 0.05, 0.0, 0.015, [-0.08..0.005, -0.16..0.005]),
    ] {
        let mut scene = scene(depth);
        scene.medium = Some(uniform_medium(depth, albedo, g));
        scene.lights.environment.radiance = [1.0; 3];
        let what = format!("16 paths a node, optical depth {depth} a voxel, g = {g}");
        assert_agrees(&what, &scene, &full(), [8, 16], [limit; 2], in_motion);
    }
}

/// The sun's light is gone within a third of a step of a march, and little of it is scattered more than once. A
/// march that looks for it at the middles of its steps misses it.
#[test]
fn a_sun_that_grazes_a_clip_plane() {
    let mut scene = scene(0.14);
    scene.medium = Some(uniform_medium(0.14, 0.2, 0.0));
    scene.camera.eye = [0.0, 0.0, 60.0];
    scene.clips = vec![ClipPlane {
        normal: [0.0, 0.0, 1.0],
        offset: 0.49,
    }];
    scene.lights.suns = vec![sun([0.6, 0.8, -0.04])];
    assert_agrees(
        "a grazing sun",
        &scene,
        &full(),
        [16, 256],
        [0.012; 2],
        [-0.005..0.045, -0.005..0.06],
    );
}

/// From a step of 0.28 in a voxel on, an edge is left to paths. With a margin of three voxels, at scale ½, it lies in the cubes
/// at the faces of the box.
#[test]
fn light_behind_a_sharp_edge_within_the_volume() {
    for (depth, margin, limits, in_motion) in [
        (0.3, 4, [0.005, 0.015], [-0.005..0.005, -0.005..0.005]),
        (0.6, 4, [0.006; 2], [-0.01..0.005, -0.03..0.005]),
        (4.0, 4, [0.01; 2], [-0.21..0.005, -0.21..0.005]),
        (0.3, 3, [0.006; 2], [-0.01..0.01, -0.01..0.05]),
        (0.6, 3, [0.006; 2], [-0.01..0.005, -0.005..0.1]),
        (4.0, 3, [0.01; 2], [-0.21..0.005, -0.005..0.45]),
    ] {
        let mut scene = scene(depth);
        let step = [0.0, 1.0].map(|opacity| TransferPoint {
            value: 0.5,
            opacity,
            color: [0.8; 3],
        });
        scene.medium = Some(Medium::isotropic(depth, step.to_vec()));
        scene.lights.environment.radiance = [1.0; 3];
        scene.lights.suns = vec![sun([0.3, -0.8, -0.5])];
        let what = format!("a sharp edge {margin} voxels within, optical depth {depth} a voxel");
        assert_agrees(&what, &scene, &padded(margin), [4, 256], limits, in_motion);
    }
}
