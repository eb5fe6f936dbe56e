//! Volumes of unusual values and shapes.

use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

use crate::hard_cases::quadrature::*;
use crate::hard_cases::transfer::absorbing;
use crate::support::common::*;
use crate::support::fields::indexed_field;

/// Noise in [0, 1) in a box of the given shape.
fn noise(dims: [u32; 3], spacing: [f64; 3]) -> Volume {
    let mut noise = fastrand::Rng::with_seed(7);
    indexed_field(dims, spacing, |_| noise.f32())
}

/// Opacity is the value; over `length`, about half an optical depth.
fn expect_noise(dims: [u32; 3], spacing: [f64; 3], eye: [f64; 3], height: f64, length: f64) {
    let medium = absorbing(1.0 / length, &[(0.0, 0.0), (1.0, 1.0)]);
    let scene = absorbing_scene(medium, orthographic(eye, height));
    expect_transmittance("noise", &scene, &noise(dims, spacing));
}

#[test]
fn a_single_voxel() {
    expect_noise([1, 1, 1], [1.0; 3], [1.0, 1.5, 2.0], 2.0, 1.0);
}

#[test]
fn one_voxel_along_an_axis() {
    expect_noise([1, 9, 5], [1.0, 0.1, 0.2], [1.0, 1.5, 2.0], 0.7, 1.0);
    expect_noise([9, 1, 5], [0.1, 1.0, 0.2], [1.0, 1.5, 2.0], 0.7, 1.0);
    expect_noise([9, 5, 1], [0.1, 0.2, 1.0], [1.0, 1.5, 2.0], 0.7, 1.0);
}

#[test]
fn slices_five_times_as_far_apart() {
    expect_noise([20, 20, 4], [1.0, 1.0, 5.0], [30.0, 50.0, 40.0], 12.0, 20.0);
}

/// Seen along the long axis, across it, and askew.
#[test]
fn slices_a_thousand_times_as_far_apart() {
    let (dims, spacing) = ([20, 20, 4], [1.0, 1.0, 1000.0]);
    expect_noise(dims, spacing, [0.0, 0.0, 3000.0], 12.0, 4000.0);
    expect_noise(dims, spacing, [50.0, 40.0, 0.0], 12.0, 20.0);
    expect_noise(dims, spacing, [50.0, 40.0, 900.0], 12.0, 300.0);
}

#[test]
fn more_voxels_than_a_power_of_two() {
    let (dims, spacing) = ([2049, 1, 2], [1.0, 100.0, 50.0]);
    expect_noise(dims, spacing, [1500.0, 0.0, 0.0], 20.0, 2049.0);
    expect_noise(dims, spacing, [1000.0, 0.0, 900.0], 20.0, 130.0);
}

/// They become the smallest finite value.
#[test]
fn values_that_are_none() {
    let whole = noise([8, 8, 8], [0.125; 3]);
    let Voxels::F32(values) = whole.voxels().expect("voxels").into_owned() else {
        panic!("made of floats");
    };
    let with = |holes: [f32; 3]| {
        let mut values = values.clone();
        for (i, value) in values.iter_mut().enumerate().filter(|(i, _)| i % 5 == 0) {
            *value = holes[i % 3];
        }
        values[1] = 0.0;
        Volume::from_values(whole.dims, whole.spacing, Voxels::F32(values)).expect("a volume")
    };
    let medium = absorbing(2.0, &[(0.0, 0.2), (1.0, 1.0)]);
    let scene = absorbing_scene(medium, orthographic([1.0, 1.5, 2.0], 0.7));
    let broken = with([f32::NAN, f32::INFINITY, f32::NEG_INFINITY]);
    let mended = with([0.0; 3]);
    let [broken, mended] = [broken, mended].map(|volume| render(&scene, &volume, 2, 4, 1));
    assert_eq!(broken.mean, mended.mean);
}

/// The lowest value of 16 bits, where scanners put what they did not see.
#[test]
fn a_padding_value_far_below_the_data() {
    let mut noise = fastrand::Rng::with_seed(9);
    let padded = |noise: &mut fastrand::Rng| if noise.u8(..) < 60 { 0 } else { 32768 };
    let values = (0..10 * 10 * 10).map(|_| padded(&mut noise) + noise.u16(..1000));
    let voxels = Voxels::U16(values.collect());
    let mut volume = Volume::from_values([10; 3], [0.1; 3], voxels).expect("a volume");
    volume.offset = -32768.0;
    volume.range = volume.range.map(|value| value + volume.offset);
    let medium = absorbing(4.0, &[(-200.0, 0.0), (0.0, 0.3), (900.0, 1.0)]);
    let scene = absorbing_scene(medium, orthographic([1.0, 1.5, 2.0], 0.6));
    expect_transmittance("padding", &scene, &volume);
}

/// V ≡ value has no surface, from without and from within.
#[test]
fn constant_and_equal_to_the_isovalue() {
    let volume = constant_field(7.0, [9, 9, 9], [1.0; 3]);
    for (light, z) in [(LightModel::Local, 20.0), (LightModel::Full, 1.0)] {
        let mut scene = empty_scene([32, 32], orthographic([0.0, 0.0, z], 5.0));
        scene.lights.environment.radiance = [1.0; 3];
        scene.medium = Some(uniform_medium(0.3, 1.0, 0.0));
        scene.surfaces.light = light;
        scene.surfaces.iso = vec![Isosurface {
            value: 7.0,
            opacity: 1.0,
            color: [0.0; 3],
            shading: Shading::Lambert,
        }];
        let film = render(&scene, &volume, 2, 2, 1);
        let white = |pixel: &[f32; 4]| (pixel[0] - 1.0).abs() < 1e-5;
        assert!(film.mean.iter().all(white));
        let hits = first_hits(&scene, &volume).normal_depth;
        assert!(hits.iter().all(|p| p[3] == f32::INFINITY));
    }
}

/// Whatever the units of values and lengths, a surface is the same to the last bit: mass densities in g/cm³ are about 1e-25
/// between stars, numbers of particles 1e25 in a m³ of air.
#[test]
fn values_whose_squares_are_beyond_a_float() {
    let whole = noise([8, 8, 8], [0.125; 3]);
    let Voxels::F32(values) = whole.voxels().expect("voxels").into_owned() else {
        panic!("made of floats");
    };
    let in_units = |unit: f32, length: f64, normals: Normals| {
        let scaled = values.iter().map(|value| value * unit).collect();
        let spacing = whole.spacing.map(|size| size * length);
        let volume = Volume::from_values(whole.dims, spacing, Voxels::F32(scaled));
        let eye = [1.0, 1.5, 2.0].map(|at| at * length);
        let mut scene = empty_scene([48, 48], orthographic(eye, 0.7 * length));
        scene.lights.environment.radiance = [1.0; 3];
        scene.surfaces.normals = normals;
        scene.surfaces.iso = vec![Isosurface {
            value: 0.5 * f64::from(unit),
            opacity: 1.0,
            color: [0.6; 3],
            shading: Shading::Lambert,
        }];
        render(&scene, &volume.expect("a volume"), 2, 4, 1).mean
    };
    for normals in [Normals::Smooth, Normals::Analytic] {
        let plain = in_units(1.0, 1.0, normals);
        assert!(mean_red(&plain) > 0.1, "nothing is seen");
        for (value, length) in [(-83, 0), (83, 0), (-83, 46), (83, -46)] {
            let found = in_units(2f32.powi(value), 2f64.powi(length), normals);
            assert!(found == plain, "values in 2^{value}, lengths in 2^{length}");
        }
    }
}
