//! The light that surfaces reflect in a picture for a moving camera, where the cache knows only two moments of it.

use std::f64::consts::PI;

use isolume::render::RAYS_PER_PIXEL;
use isolume::scene::volume::Volume;
use isolume::scene::*;

use crate::support::common::*;
use crate::support::fields::{field, indexed_field};

const SIZE: u32 = 48;

/// The distance from the surface of a ball in voxels, 10 in its middle.
fn ball() -> Volume {
    field([20; 3], [1.0; 3], |p| (10.0 - p.length()) as f32)
}

/// Its radiance is linear in direction: brightest above, almost black below.
fn linear_sky() -> EnvironmentImage {
    let (width, height) = (64, 128);
    let row = |y: u32| {
        let polar = PI * (f64::from(y) + 0.5) / f64::from(height);
        [1.0 + 0.9 * polar.cos() as f32; 3]
    };
    let texels = (0..height).flat_map(|y| (0..width).map(move |_| row(y)));
    EnvironmentImage {
        width,
        height,
        texels: texels.collect(),
    }
}

/// A ball of radius 7 in a haze that hardly changes the sky's light.
fn scene(shading: Shading) -> Scene {
    let camera = Camera {
        eye: [0.0, 0.0, 60.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height: 16.0 },
    };
    let mut scene = empty_scene([SIZE; 2], camera);
    scene.medium = Some(uniform_medium(1e-3, 0.9, 0.0));
    scene.surfaces.normals = Normals::Analytic;
    scene.surfaces.iso = vec![Isosurface {
        value: 3.0,
        opacity: 1.0,
        color: [0.8, 0.5, 0.3],
        shading,
    }];
    scene.lights.environment.image = Some(linear_sky());
    scene
}

/// A picture in motion, and one at rest of the same rays.
fn moving_and_resting(scene: &Scene, volume: &Volume) -> (Vec<[f32; 4]>, Vec<[f32; 4]>) {
    let mut cached = cached(scene, volume, 0.5, CacheFormat::F16, 512, 1);
    let moving = cached.march();
    let mut centred = cached.renderer.scene().clone();
    centred.parts.view.through_centres = true;
    cached.renderer.change(&centred).expect("the same scene");
    (moving, cached.at_rest(4, 32).mean)
}

/// The mean over rows of pixels of the sum of these channels.
fn mean_of(picture: &[[f32; 4]], rows: std::ops::Range<u32>, channels: &[usize]) -> f64 {
    let pixels = &picture[(rows.start * SIZE) as usize..(rows.end * SIZE) as usize];
    let sum: f64 = pixels
        .iter()
        .flat_map(|p| channels.iter().map(|&c| f64::from(p[c])))
        .sum();
    sum / pixels.len() as f64
}

fn mean(picture: &[[f32; 4]], rows: std::ops::Range<u32>) -> f64 {
    mean_of(picture, rows, &[0, 1, 2])
}

/// Two moments are all that there is of such a sky, so whatever the material is, nothing may be missing: not from above,
/// not from the side, and not from below.
#[test]
fn light_that_is_linear_in_direction_is_reflected_exactly() {
    let shadings = [
        Shading::Lambert,
        Shading::Phong {
            specular: 0.4,
            shininess: 20.0,
        },
        Shading::Disney(Disney {
            metallic: 0.0,
            roughness: 0.45,
            specular: 0.5,
            specular_tint: 0.0,
            sheen: 0.0,
            sheen_tint: 0.5,
            subsurface: 0.0,
            clearcoat: 1.0,
            clearcoat_gloss: 0.5,
        }),
        Shading::Disney(Disney {
            metallic: 0.8,
            roughness: 0.3,
            specular: 0.5,
            specular_tint: 0.3,
            sheen: 0.7,
            sheen_tint: 0.5,
            subsurface: 0.4,
            clearcoat: 0.0,
            clearcoat_gloss: 1.0,
        }),
    ];
    let volume = ball();
    for shading in shadings {
        let (moving, resting) = moving_and_resting(&scene(shading), &volume);
        for rows in [4..16, 16..32, 32..44] {
            let [a, b] = [&moving, &resting].map(|picture| mean(picture, rows.clone()));
            println!(
                "{shading:?}, rows {rows:?}: {:+.2} %",
                100.0 * (a / b - 1.0)
            );
            assert!((a / b - 1.0).abs() < 0.01, "{shading:?}: {a}, not {b}");
        }
    }
}

/// A red sun from behind makes the haze glow on all sides of the ball, and the sky, blue, is brightest above: the glow must
/// not be taken to come from there as well.
#[test]
fn light_of_two_colours_has_two_directions() {
    let volume = ball();
    let mut scene = scene(Shading::Lambert);
    scene.medium = Some(uniform_medium(0.02, 0.9, 0.0));
    scene.lights.suns = vec![DirectionalLight {
        direction: [0.0, 0.0, 1.0],
        irradiance: [20.0, 4.0, 4.0],
    }];
    let blue = linear_sky().times([0.2, 0.6, 1.0]);
    scene.lights.environment.image = Some(blue.expect("a sky"));
    let (moving, resting) = moving_and_resting(&scene, &volume);
    for rows in [6..16, 16..32, 32..42] {
        for channel in 0..3 {
            let [a, b] =
                [&moving, &resting].map(|picture| mean_of(picture, rows.clone(), &[channel]));
            println!(
                "channel {channel}, rows {rows:?}: {:+.2} %",
                100.0 * (a / b - 1.0)
            );
            assert!(
                (a / b - 1.0).abs() < 0.02,
                "channel {channel}: {a}, not {b}"
            );
        }
    }
}

/// The edge of the ball becomes smooth, and nothing else changes.
#[test]
fn more_rays_of_each_pixel_smooth_edges() {
    let (scene, volume) = (scene(Shading::Lambert), ball());
    let mut cached = cached(&scene, &volume, 0.5, CacheFormat::F16, 512, 1);
    let smooth = cached.at_rest(4, 64).mean;
    let first = cached.march();
    while cached.caching().rays() < RAYS_PER_PIXEL {
        cached.caching().march_another_ray().expect("a march");
    }
    let more = cached.caching().marched().expect("a picture");
    let [one, many] = [&first, &more].map(|picture| {
        let pairs = picture.iter().zip(&smooth);
        pairs
            .map(|(a, b)| f64::from(a[3] - b[3]).powi(2))
            .sum::<f64>()
    });
    assert!(one > 1.0 && many < one / 12.0, "{one} {many}");
    let [a, b] = [&more, &smooth].map(|picture| mean(picture, 0..SIZE));
    assert!((a / b - 1.0).abs() < 0.005, "{a}, not {b}");
    assert_eq!(cached.march(), first, "a march begins anew");
}

/// A wall beside a black medium, at distances from it at which nodes have memory, some of them, and none. It faces away
/// from the medium, and sees half of a white sky; what two moments of the light make of the other half, of which the
/// medium leaves some free, is too bright by up to a seventh.
#[test]
fn light_on_a_surface_beside_the_medium_is_that_of_nodes_with_memory() {
    let volume = indexed_field([32, 48, 48], [1.0; 3], |[x, ..]| x as f32);
    let camera = Camera {
        eye: [60.0, 0.0, 0.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height: 16.0 },
    };
    let mut scene = empty_scene([16; 2], camera);
    let mut medium = uniform_medium(1.0, 0.0, 0.0);
    medium.transfer = [(6.0, 1.0), (7.0, 0.0)]
        .map(|(value, opacity)| TransferPoint {
            value,
            opacity,
            ..medium.transfer[0]
        })
        .into();
    scene.medium = Some(medium);
    scene.lights.environment.radiance = [1.0; 3];
    for value in [9.7, 15.7, 19.7, 24.7] {
        scene.surfaces.iso = vec![Isosurface {
            value,
            opacity: 1.0,
            color: [0.8; 3],
            shading: Shading::Lambert,
        }];
        let mut cached = cached(&scene, &volume, 1.0, CacheFormat::F32, 64, 1);
        let shown = cached.march();
        let mean = shown.iter().map(|p| f64::from(p[0])).sum::<f64>() / shown.len() as f64;
        println!("at {value}: {:+.1} %", 100.0 * (mean / 0.8 - 1.0));
        assert!(
            (-0.02..0.15).contains(&(mean / 0.8 - 1.0)),
            "at {value}: {mean}"
        );
    }
}
