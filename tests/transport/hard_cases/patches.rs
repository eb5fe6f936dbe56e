//! Rays from the camera begin and end where their patch of the picture says that there is something to meet
//! (`glsl/patches.comp`): what they see is what rays through all of the box see.

use isolume::gpu::Shaders;
use isolume::scene::volume::Volume;
use isolume::scene::*;

use crate::support::common::*;
use crate::support::fields::indexed_field;

/// Single voxels, far apart.
fn specks() -> Volume {
    let mut places = fastrand::Rng::with_seed(3);
    indexed_field([48, 40, 33], [0.02, 0.02, 0.03], |_| {
        if places.u32(..4000) == 0 { 1.0 } else { 0.0 }
    })
}

fn scene(camera: Camera) -> Scene {
    let mut scene = empty_scene([96, 64], camera);
    let point = |value: f64, opacity: f64| TransferPoint {
        value,
        opacity,
        color: [0.5; 3],
    };
    scene.medium = Some(Medium::isotropic(
        100.0,
        vec![point(0.1, 0.0), point(0.5, 1.0)],
    ));
    scene.surfaces.iso = vec![Isosurface {
        value: 0.7,
        opacity: 1.0,
        color: [0.8; 3],
        shading: Shading::Lambert,
    }];
    scene.lights.environment.radiance = [1.0; 3];
    scene
}

fn camera(eye: [f64; 3], target: [f64; 3], projection: Projection) -> Camera {
    Camera {
        eye,
        target,
        up: [0.1, 1.0, 0.2],
        projection,
    }
}

/// From outside and inside, along a face and an axis, past the box, from far, and very wide.
fn perspectives() -> Vec<Camera> {
    [
        ([1.0, 1.2, 2.0], [0.0; 3], 40.0),
        ([0.1, 0.05, 0.1], [0.4, 0.1, -0.3], 60.0),
        ([-0.2, 0.1, 0.45], [0.3, -0.2, -0.5], 150.0),
        ([0.0, 0.0, 2.0], [0.0; 3], 20.0),
        ([0.48, 0.0, 2.0], [0.48, 0.0, 0.0], 30.0),
        ([0.0, 0.0, 2.0], [0.6, 0.4, 1.9], 60.0),
        ([300.0, 200.0, 300.0], [0.0; 3], 0.1),
    ]
    .map(|(eye, target, fov_y)| camera(eye, target, Projection::Perspective { fov_y }))
    .to_vec()
}

/// From outside, from a plane in the middle, and of next to nothing.
fn orthographics() -> Vec<Camera> {
    [
        ([1.0, 1.2, 2.0], [0.0; 3], 1.5),
        ([0.05, 0.02, 0.1], [0.0, 0.0, -1.0], 0.8),
        ([0.0, 0.0, 2.0], [0.0; 3], 0.9),
        ([0.3, 0.2, 2.0], [0.0; 3], 0.01),
    ]
    .map(|(eye, target, height)| camera(eye, target, Projection::Orthographic { height }))
    .to_vec()
}

/// Of each camera: red and coverage, without cached light.
fn pictures(shaders: &Shaders, cameras: &[Camera]) -> Vec<Vec<[f32; 2]>> {
    let (scene, volume) = (scene(cameras[0]), specks());
    let with_cache = scene_with_cache(&scene, &volume, 0.5, CacheFormat::F16, 0);
    let mut cached = empty_cache(device(), shaders, &volume, with_cache);
    let pictures = cameras.iter().map(|camera| {
        let seen = Scene {
            camera: *camera,
            ..scene.clone()
        };
        let seen = cached.renderer.scene().changed_to(&seen, &volume);
        cached.renderer.change(&seen).expect("another view");
        let picture = cached.march();
        picture.iter().map(|pixel| [pixel[0], pixel[3]]).collect()
    });
    pictures.collect()
}

/// Rays run through all of the box.
fn shaders_without_patches() -> Shaders {
    shaders_with(
        "include/camera.glsl",
        include_str!("../../../glsl/include/camera.glsl"),
        "camera_ray_within(p, reach_at(p), entry, t_end)",
        "camera_ray_within(p, vec2(0.0, 3.4e38), entry, t_end)",
    )
}

/// Cells seem to end before they do.
fn shaders_with_short_cells() -> Shaders {
    shaders_with(
        "patches.comp",
        include_str!("../../../glsl/patches.comp"),
        "view.far = max(view.far, length(d));",
        "view.far = max(view.far, length(d) - 0.1);",
    )
}

/// Of all pixels, the largest difference.
fn difference(a: &[[f32; 2]], b: &[[f32; 2]]) -> f32 {
    let differences = a.iter().flatten().zip(b.iter().flatten());
    differences.fold(0.0, |most, (a, b)| most.max((a - b).abs()))
}

fn covered(picture: &[[f32; 2]]) -> usize {
    picture.iter().filter(|pixel| pixel[1] > 0.5).count()
}

#[test]
fn what_is_left_out_is_empty() {
    for cameras in [perspectives(), orthographics()] {
        let all = pictures(&shaders_without_patches(), &cameras);
        let found = pictures(&shaders(), &cameras);
        for ((all, found), camera) in all.iter().zip(&found).zip(&cameras) {
            let most = difference(all, found);
            println!("{camera:?}: {} pixels, {most:.1e}", covered(all));
            assert!(most < 1e-2, "{most} in the view of {camera:?}");
        }
        assert!(all.iter().filter(|picture| covered(picture) > 20).count() >= 3);
    }
}

#[test]
fn what_is_left_out_would_be_missed() {
    let cameras = &perspectives()[..1];
    let all = pictures(&shaders_without_patches(), cameras);
    let found = pictures(&shaders_with_short_cells(), cameras);
    assert!(difference(&all[0], &found[0]) > 0.1);
}
