//! Transfer functions that a coarse majorant or a coarse step would miss.

use crate::support::exact;
use isolume::render::GpuScene;
use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

use crate::hard_cases::quadrature::*;
use crate::support::common::*;

/// Noise from 0 to 255, with a side of about 1.
fn noise(format: fn(Vec<u8>) -> Voxels) -> Volume {
    let mut noise = fastrand::Rng::with_seed(3);
    let values = (0..6 * 9 * 11).map(|_| noise.u8(..)).collect();
    let spacing = [1.0 / 6.0, 1.0 / 9.0, 1.0 / 11.0];
    Volume::from_values([6, 9, 11], spacing, format(values)).expect("a volume")
}

fn as_u8(values: Vec<u8>) -> Voxels {
    Voxels::U8(values)
}

fn as_u16(values: Vec<u8>) -> Voxels {
    Voxels::U16(values.into_iter().map(u16::from).collect())
}

fn as_f32(values: Vec<u8>) -> Voxels {
    Voxels::F32(values.into_iter().map(f32::from).collect())
}

pub fn absorbing(density: f64, points: &[(f64, f64)]) -> Medium {
    let point = |&(value, opacity): &(f64, f64)| TransferPoint {
        value,
        opacity,
        color: [0.0; 3],
    };
    Medium::isotropic(density, points.iter().map(point).collect())
}

fn expect_points(density: f64, points: &[(f64, f64)], volume: &Volume) {
    let camera = orthographic([1.0, 1.4, 1.9], 0.7);
    let mut scene = absorbing_scene(absorbing(density, points), camera);
    scene.render.size = [64, 64];
    expect_transmittance("transfer function", &scene, volume);
}

#[test]
fn empty() {
    let volume = noise(as_u8);
    let medium = absorbing(1e3, &[(0.0, 0.0), (255.0, 0.0)]);
    let scene = absorbing_scene(medium, orthographic([1.0, 1.4, 1.9], 0.7));
    let film = render(&scene, &volume, 2, 2, 1);
    assert!(film.mean.iter().all(|pixel| pixel[0] == 1.0));
}

/// A transfer function that is one line over the data (`is_linear`): shaders read one voxel, drawn with the trilinear
/// weights, instead of interpolating eight.
#[test]
fn straight() {
    for format in [as_u8, as_u16, as_f32] {
        expect_points(3.0, &[(0.0, 0.9), (255.0, 0.1)], &noise(format));
        expect_points(3.0, &[(-100.0, 0.0), (300.0, 1.0)], &noise(format));
    }
}

/// All of the volume is where a line ends, in a step: there the step's upper point counts.
#[test]
fn straight_up_to_a_step() {
    let volume = noise(|values| Voxels::U8(vec![255; values.len()]));
    let medium = absorbing(1e3, &[(0.0, 0.0), (255.0, 1.0), (255.0, 0.0)]);
    let scene = absorbing_scene(medium, orthographic([1.0, 1.4, 1.9], 0.7));
    let film = render(&scene, &volume, 2, 2, 1);
    assert!(film.mean.iter().all(|pixel| pixel[0] == 1.0));
}

/// The largest value is where the medium is thinnest.
#[test]
fn falling() {
    expect_points(3.0, &[(50.0, 1.0), (200.0, 0.0)], &noise(as_u8));
}

/// Neither end of a cell's range is where the medium is thickest.
#[test]
fn not_monotone() {
    let points = [
        (20.0, 0.0),
        (60.0, 1.0),
        (100.0, 0.1),
        (130.0, 0.0),
        (180.0, 0.7),
        (250.0, 0.0),
    ];
    expect_points(3.0, &points, &noise(as_u16));
}

/// Majorants are of four macrocells each, of which the last is the densest; the volume ends within one.
#[test]
fn not_monotone_in_a_large_volume() {
    let mut noise = fastrand::Rng::with_seed(5);
    let dims = [1030, 13, 11];
    let values = (0..dims.iter().product()).map(|voxel: u32| match voxel % 1030 / 8 % 4 {
        3 => noise.u8(20..50),
        _ => noise.u8(60..),
    });
    let voxels = Voxels::U8(values.collect());
    let volume = Volume::from_values(dims, [0.02; 3], voxels).expect("a volume");
    let points = [
        (20.0, 0.0),
        (30.0, 1.0),
        (50.0, 0.0),
        (150.0, 0.0),
        (151.0, 0.3),
        (152.0, 0.0),
    ];
    for eye in [[30.0, 0.05, 0.1], [-30.0, 0.2, -0.3], [1.0, 2.0, 3.0]] {
        let scene = absorbing_scene(absorbing(1.0, &points), orthographic(eye, 0.15));
        let constants = GpuScene::new(&scene, &volume, 0).constants();
        assert_eq!(constants.block_size, 32.0);
        expect_transmittance("a large volume", &scene, &volume);
    }
}

#[test]
fn discontinuous() {
    let points = [
        (80.0, 0.0),
        (80.0, 0.8),
        (120.0, 0.2),
        (120.0, 0.0),
        (170.0, 0.0),
        (170.0, 1.0),
    ];
    expect_points(3.0, &points, &noise(as_f32));
}

/// Neighbouring voxels differ by up to 255, the tents are 2 wide, and no voxel lies on one.
#[test]
fn narrower_than_a_step_between_voxels() {
    let tent = |at: f64| [(at - 1.0, 0.0), (at, 1.0), (at + 1.0, 0.0)];
    let points = [tent(60.5), tent(127.5), tent(200.5)].concat();
    expect_points(60.0, &points, &noise(as_f32));
}

/// ∫α ds = ½·2/100 of the half between the voxels' centres. Filters differ between formats.
fn expect_tent_between_two(voxels: Voxels) {
    let volume = Volume::from_values([1, 1, 2], [1.0, 1.0, 0.5], voxels).expect("a volume");
    let medium = absorbing(200.0, &[(49.0, 0.0), (50.0, 1.0), (51.0, 0.0)]);
    let scene = absorbing_scene(medium, orthographic([0.0, 0.0, 2.0], 0.5));
    exact::expect("tent", &scene, &volume, [(-1.0f64).exp(); 3]);
}

#[test]
fn narrow_in_8_bits() {
    expect_tent_between_two(as_u8(vec![0, 100]));
}

#[test]
fn narrow_in_16_bits() {
    expect_tent_between_two(as_u16(vec![0, 100]));
}

#[test]
fn narrow_in_floats() {
    expect_tent_between_two(as_f32(vec![0, 100]));
}

/// Fifteen mean free paths in a voxel. V = x + 2y + 3z, seen along V = 0, is solid in half of the
/// picture; the ends, where clamping bends the field, are cut off.
#[test]
fn opaque() {
    let coordinate = |i: u32| i as f32 - 9.5;
    let value =
        |i: u32| coordinate(i % 20) + 2.0 * coordinate(i / 20 % 20) + 3.0 * coordinate(i / 400);
    let voxels = Voxels::F32((0..20 * 20 * 20).map(value).collect());
    let volume = Volume::from_values([20; 3], [0.05; 3], voxels).expect("a volume");
    let medium = absorbing(300.0, &[(0.0, 0.0), (0.0, 1.0)]);
    let mut scene = absorbing_scene(medium, orthographic([2.0, 2.0, -2.0], 0.5));
    let along = 1.0 / 3.0f64.sqrt();
    scene.clips = [along, -along]
        .map(|c| ClipPlane {
            normal: [c, c, -c],
            offset: 0.25,
        })
        .to_vec();
    exact::expect("solid", &scene, &volume, [0.5; 3]);
}

/// A value beyond the points takes the nearest one's opacity.
#[test]
fn beyond_the_ends() {
    expect_points(2.0, &[(300.0, 0.4), (400.0, 1.0)], &noise(as_u8));
    expect_points(2.0, &[(-20.0, 1.0), (-10.0, 0.4)], &noise(as_u8));
}
