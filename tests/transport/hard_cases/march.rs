//! A march through the cache loses no light, and adds no noise, where the medium is a film that is thinner than a voxel,
//! and where neighbouring voxels have nothing to do with each other.

use isolume::render::Film;
use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

use crate::hard_cases::quadrature::*;
use crate::hard_cases::transfer::absorbing;
use crate::support::common::*;
use crate::support::fields::{field, indexed_field, voxels};

const DIMS: [u32; 3] = [24, 22, 20];
const VOXEL: f64 = 0.05;

/// A ball of radius 0.4 whose value falls from 100 to 0 within about two voxels, as a scanner shows the side of a thing.
fn ball() -> Volume {
    field(DIMS, [VOXEL; 3], |p| {
        let r = (p * VOXEL).length();
        (100.0 / (1.0 + ((r - 0.4) / 0.03).exp())) as f32
    })
}

/// A tenth of a voxel of medium on the ball's side, with up to half a mean free path in a voxel.
fn film() -> Scene {
    let medium = absorbing(10.0, &[(48.0, 0.0), (50.0, 1.0), (52.0, 0.0)]);
    absorbing_scene(medium, orthographic([0.6, 0.5, 3.0], 1.0))
}

/// Relative error of what a picture absorbs.
fn error(picture: &[[f32; 4]], exact: f64) -> f64 {
    (1.0 - mean_red(picture)) / exact - 1.0
}

/// A picture at rest of rays through the pixels' centres alone.
fn through_centres(cached: &mut Cached, samples: u32) -> Film {
    let mut centred = cached.renderer.scene().clone();
    centred.parts.view.through_centres = true;
    cached.renderer.change(&centred).expect("the same scene");
    cached.at_rest(samples, 1)
}

#[test]
fn a_film_thinner_than_a_voxel() {
    let (scene, volume) = (film(), ball());
    let [width, height] = scene.render.size;
    assert_eq!(width, height);
    // Of the same rays as the march's: what a picture of few rays misses of the ball's limb is no error here.
    let exact = 1.0 - transmittance(&scene, &volume, width);
    let mut cached = cached(&scene, &volume, 0.5, CacheFormat::F16, 8, 1);
    let moving = error(&cached.march(), exact);
    let film = through_centres(&mut cached, 16);
    let resting = error(&film.mean, exact);
    let noise = film
        .stderr
        .iter()
        .flatten()
        .fold(0.0, |a: f32, &b| a.max(b));
    println!("of {exact:.4}: moving {moving:+.5}, at rest {resting:+.5}, noise {noise}");
    assert!(moving.abs() < 0.005, "in motion");
    assert!(resting.abs() < 0.005, "at rest");
    assert!(noise < 1e-6, "a march along the same ray is the same");
}

/// Extinction is linear in the field. The sheets begin at the side of a block of cells, where all rays begin their steps.
#[test]
fn sheets_of_few_voxels_seen_from_aslant() {
    const DIMS: [u32; 3] = [24, 40, 40];
    for (filled, density) in [(8..9, 0.38), (8..11, 0.1)] {
        let value = |[x, ..]: [u32; 3]| u8::from(filled.contains(&x));
        let values = voxels(DIMS).map(value).collect();
        let volume = Volume::from_values(DIMS, [1.0; 3], Voxels::U8(values)).expect("a volume");
        for eye in [[30.0, 9.0, 6.0], [30.0, 3.0, 0.0], [29.0, 0.0, 30.0]] {
            let medium = absorbing(density, &[(0.0, 0.0), (1.0, 1.0)]);
            let scene = absorbing_scene(medium, orthographic(eye, 4.0));
            let depth = density * f64::from(filled.end - filled.start);
            let cosine = eye[0] / eye.iter().map(|x| x * x).sum::<f64>().sqrt();
            let exact = 1.0 - (-depth / cosine).exp();
            let mut cached = cached(&scene, &volume, 0.5, CacheFormat::F16, 1, 1);
            for picture in [cached.march(), cached.at_rest(2, 1).mean] {
                let error = error(&picture, exact);
                println!("{filled:?} from {eye:?}: of {exact:.4}, {error:+.5}");
                assert!(error.abs() < 1e-4, "{error:+.5}");
            }
        }
    }
}

/// One voxel in five is filled, at random.
fn scattered_voxels() -> Volume {
    let filled = |i: u32| match i.wrapping_mul(2654435761) >> 16 & 0xFF {
        0..=51 => 1.0,
        _ => 0.0,
    };
    let values = (0..DIMS.iter().product()).map(filled).collect();
    Volume::from_values(DIMS, [VOXEL; 3], Voxels::F32(values)).expect("a volume")
}

/// The error of the transmittances of a picture's rays.
fn root_mean_square(picture: &[[f32; 4]], exact: &[f64]) -> f64 {
    let errors = picture.iter().zip(exact);
    let errors = errors.map(|(pixel, exact)| (f64::from(pixel[0]) - exact).powi(2));
    let rms = (errors.sum::<f64>() / exact.len() as f64).sqrt();
    println!("root mean square error of transmittance {rms:.5}");
    rms
}

#[test]
fn voxels_that_are_independent_of_each_other() {
    let volume = scattered_voxels();
    let medium = absorbing(4.0, &[(0.0, 0.0), (1.0, 1.0)]);
    let scene = absorbing_scene(medium, orthographic([0.6, 0.5, 3.0], 1.0));
    let exact = transmittances(&scene, &volume, scene.render.size[0]);
    let marched = cached(&scene, &volume, 0.5, CacheFormat::F16, 8, 1).march();
    assert!(root_mean_square(&marched, &exact) < 1e-4);
}

/// Extinction is linear in the field wherever that comes to, but the transfer function has a point more than it needs. At rest
/// the field's bend between the sides of a cell counts.
#[test]
fn voxels_that_are_independent_through_two_segments() {
    let volume = scattered_voxels();
    let medium = absorbing(4.0, &[(0.0, 0.0), (0.9, 0.9), (1.0, 1.0)]);
    let scene = absorbing_scene(medium, orthographic([3.0, 2.2, 2.8], 1.0));
    let exact = transmittances(&scene, &volume, scene.render.size[0]);
    let mut cached = cached(&scene, &volume, 0.5, CacheFormat::F16, 8, 1);
    let film = through_centres(&mut cached, 1);
    assert!(root_mean_square(&film.mean, &exact) < 5e-4);
}

/// Along a diagonal through independent voxels the field bends in each cell, and passes a narrow tent of the transfer function
/// more or less often than a straight line between the cell's sides would.
#[test]
fn a_narrow_tent_seen_aslant_through_noise() {
    let noise = |i: u32| (i.wrapping_mul(2654435761) >> 24) as f32;
    let values = (0..DIMS.iter().product()).map(noise).collect();
    let volume = Volume::from_values(DIMS, [VOXEL; 3], Voxels::F32(values)).expect("a volume");
    let medium = absorbing(6.0, &[(120.0, 0.0), (128.0, 1.0), (140.0, 0.0)]);
    let scene = absorbing_scene(medium, orthographic([3.0, 2.2, 2.8], 0.5));
    let exact = transmittances(&scene, &volume, scene.render.size[0]);
    let mut cached = cached(&scene, &volume, 0.5, CacheFormat::F16, 8, 1);
    let count = exact.len() as f64;
    let mean = exact.iter().sum::<f64>() / count;
    let errors = |picture: &[[f32; 4]]| {
        let pairs = picture.iter().zip(&exact);
        let errors = pairs.map(|(pixel, exact)| f64::from(pixel[0]) - exact);
        let squares = errors.clone().map(|error| error * error).sum::<f64>();
        (
            errors.sum::<f64>() / count / mean,
            (squares / count).sqrt() / mean,
        )
    };
    let (moving, _) = errors(&cached.march());
    let (bias, rms) = errors(&through_centres(&mut cached, 1).mean);
    println!("of {mean:.4}: moving {moving:+.4}, at rest {bias:+.4}, root mean square {rms:.4}");
    assert!(bias.abs() < 0.02, "{bias:+.4}");
    assert!(rms < 0.06, "{rms:.4}");
}

/// A number that stands for missing values in the half of the volume that rays come through: the field leaves the medium so steeply
/// that the part of a cell in which it is straight is shorter than a step that a ray can make.
#[test]
fn medium_behind_missing_values() {
    let error = |fill: f32| {
        let volume = indexed_field(DIMS, [VOXEL; 3], |voxel| {
            let [x, y, z] = voxel.map(|i| i as f32);
            if x + y + z > 36.0 {
                fill
            } else {
                20.0 + x + y + z
            }
        });
        let points = [(0.0, 0.0), (50.0, 1.0), (60.0, 1.0), (60.0, 0.0)];
        let scene = absorbing_scene(absorbing(2.0, &points), orthographic([3.0, 2.2, 2.8], 1.0));
        let exact = transmittances(&scene, &volume, scene.render.size[0]);
        let film = through_centres(&mut cached(&scene, &volume, 0.5, CacheFormat::F16, 1, 1), 1);
        root_mean_square(&film.mean, &exact)
    };
    for fill in [1e20, 1e7, -1e7] {
        let rms = error(fill);
        assert!(rms < 2e-3, "{fill:e}: {rms}");
    }
}

/// A CPU's driver ends all loops of a thread after 65535 iterations, those of searches in the transfer function included.
#[test]
fn many_steps_through_a_transfer_function_of_many_points() {
    const LENGTH: u32 = 1024;
    // Steps are as short as the densest voxels nearby ask for, an eighth of a voxel; no ray meets these.
    let volume = indexed_field([LENGTH, 8, 8], [1.0; 3], |[x, y, z]| match (x % 8, y, z) {
        (0, 0, 0) => 255.0,
        _ => 100.0,
    });
    let thin = 1.0 / (4.0 * f64::from(LENGTH));
    let points: Vec<(f64, f64)> = (0..250)
        .map(|n| (5.0 + f64::from(n), if n < 249 { thin } else { 1.0 }))
        .collect();
    let medium = absorbing(4.0, &points);
    let scene = absorbing_scene(medium, orthographic([2000.0, 0.0, 0.0], 2.0));
    let mut cached = cached(&scene, &volume, 0.125, CacheFormat::F16, 1, 1);
    let exact = 1.0 - (-1f64).exp();
    let moving = error(&cached.march(), exact);
    let resting = error(&cached.at_rest(1, 1).mean, exact);
    println!("of {exact:.4}: moving {moving:+.5}, at rest {resting:+.5}");
    assert!(moving.abs() < 0.001 && resting.abs() < 0.001);
}

/// Rays that pass a very dense wall within a block of cells, through haze.
#[test]
fn haze_beside_a_wall() {
    const LENGTH: u32 = 1024;
    const HAZE: f64 = 0.0005;
    const WALL: f64 = 200.0;
    let volume = indexed_field([16, 1, LENGTH], [1.0, 100.0, 1.0], |[x, ..]| {
        if x >= 12 { 100.0 } else { 0.0 }
    });
    let o = HAZE / WALL;
    let medium = absorbing(WALL, &[(40.0, o), (60.0, 1.0)]);
    let camera = Camera {
        target: [2.0, 0.0, 0.0],
        ..orthographic([2.0, 0.0, 2000.0], 1.0)
    };
    let scene = absorbing_scene(medium, camera);
    let exact = (-HAZE * f64::from(LENGTH)).exp();
    let mut cached = cached(&scene, &volume, 0.5, CacheFormat::F16, 1, 1);
    for picture in [cached.march(), cached.at_rest(1, 1).mean] {
        let error = error(&picture, 1.0 - exact);
        println!("of {:.4}: {error:+.5}", 1.0 - exact);
        assert!(error.abs() < 1e-4, "{error:+.5}");
    }
}
