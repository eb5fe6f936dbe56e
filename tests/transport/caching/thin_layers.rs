//! Layers that are thinner than a voxel, since a tent of the transfer function lies between the values of two neighbours.

use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

use crate::caching::rim::assert_agrees;
use crate::support::common::*;
use crate::support::small_scenes::sun;

/// Seeds, and paths of each node.
const RUNS: [u32; 2] = [4, 128];

/// A ramp along x, in which a tent between 64 and 192 is a layer.
fn ramp() -> Volume {
    const RAMP: [u8; 8] = [0, 0, 0, 64, 192, 255, 255, 255];
    let values = (0..8 * 24 * 24).map(|i| RAMP[i % 8]).collect();
    Volume::from_values([8, 24, 24], [1.0; 3], Voxels::U8(values)).expect("a volume")
}

/// A layer of the given density at the tip of a tent, whose feet have another colour.
fn scene(density: f64, half_width: f64, color_of_feet: f64) -> Scene {
    let camera = Camera {
        eye: [30.0, 9.0, 6.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height: 8.0 },
    };
    let mut scene = empty_scene([16, 16], camera);
    let point = |value, opacity, color| TransferPoint {
        value,
        opacity,
        color: [color; 3],
    };
    let tent = vec![
        point(120.0 - half_width, 0.0, color_of_feet),
        point(120.0, 1.0, 1.0),
        point(120.0 + half_width, 0.0, color_of_feet),
    ];
    scene.medium = Some(Medium::isotropic(density, tent));
    scene.render.background = Background::Color([0.0; 3]);
    scene
}

/// No node lies in the layer, and both voxels beside it are clear.
#[test]
fn a_layer_between_two_voxels_is_left_to_paths() {
    let mut scene = scene(1.9, 30.0, 1.0);
    scene.lights.suns = vec![sun([-1.0, -0.2, 0.1], [3.0; 3])];
    let in_motion = [-0.15..0.02, -0.2..0.02];
    assert_agrees(
        "between voxels",
        &scene,
        &ramp(),
        RUNS,
        [0.02; 2],
        in_motion,
    );
}

/// Paths of the nodes around begin in the layer.
#[test]
fn a_layer_that_is_hardly_opaque_is_cached() {
    let mut scene = scene(0.35, 30.0, 1.0);
    scene.lights.suns = vec![sun([-1.0, -0.2, 0.1], [3.0; 3])];
    let in_motion = [-0.05..0.02, -0.07..0.02];
    assert_agrees(
        "hardly opaque",
        &scene,
        &ramp(),
        RUNS,
        [0.025; 2],
        in_motion,
    );
}

/// What is left to paths has the colour of the step that left it, and not that at one of its points.
#[test]
fn a_layer_has_the_color_of_its_middle() {
    let mut scene = scene(0.35, 6.0, 0.0);
    scene.lights.environment.radiance = [1.0; 3];
    scene.surfaces.light = LightModel::Full;
    scene.surfaces.normals = Normals::Analytic;
    scene.surfaces.iso = vec![Isosurface {
        value: 150.0,
        opacity: 0.05,
        color: [0.5; 3],
        shading: Shading::Lambert,
    }];
    let in_motion = [-0.1..0.1, -0.1..0.1];
    assert_agrees("black feet", &scene, &ramp(), RUNS, [0.05; 2], in_motion);
}
