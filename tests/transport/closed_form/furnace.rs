//! The white furnace: where nothing absorbs and the sky is 1 everywhere, every pixel is 1, whatever
//! the extinction, the phase function and the transfer function.

use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

use crate::support::common::*;
use crate::support::exact::expect;
use crate::support::fields::voxels;

/// Blobs in noise, in 16 bits as a scanner would give it.
fn scan() -> Volume {
    const SIZE: u32 = 24;
    let mut noise = fastrand::Rng::with_seed(5);
    let values = voxels([SIZE; 3]).map(|voxel| {
        let [x, y, z] = voxel.map(|i| 0.5 * f64::from(i));
        let blobs = x.sin() * y.cos() + (0.7 * z + x).sin() * y.sin();
        (2000.0 + 900.0 * blobs + 50.0 * noise.f64()) as u16
    });
    let voxels = Voxels::U16(values.collect());
    let spacing = [1.0 / 24.0, 1.0 / 24.0, 1.5 / 24.0];
    Volume::from_values([SIZE; 3], spacing, voxels).expect("a volume")
}

fn furnace(size: u32) -> Scene {
    let camera = Camera {
        eye: [0.6, 0.8, 3.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Perspective { fov_y: 25.0 },
    };
    let mut scene = empty_scene([size; 2], camera);
    scene.lights.environment.radiance = [1.0; 3];
    scene
}

/// White, with a tent, a step and a ramp in its opacity.
fn varying_medium(density: f64, g: f64) -> Medium {
    let point = |(value, opacity)| TransferPoint {
        value,
        opacity,
        color: [1.0; 3],
    };
    let points = [
        (1000.0, 0.0),
        (1200.0, 0.8),
        (1250.0, 0.0),
        (1900.0, 0.1),
        (1900.0, 0.5),
        (3000.0, 1.0),
    ];
    Medium {
        g,
        ..Medium::isotropic(density, points.map(point).to_vec())
    }
}

fn white_surface(value: f64, opacity: f64) -> Isosurface {
    Isosurface {
        value,
        opacity,
        color: [1.0; 3],
        shading: Shading::Lambert,
    }
}

/// Without surfaces each single path carries exactly 1.
fn expect_furnace(medium: Medium) {
    let mut scene = furnace(48);
    scene.medium = Some(medium);
    for pixel in render(&scene, &scan(), 2, 2, 1).mean {
        assert!((pixel[0] - 1.0).abs() < 1e-5, "{pixel:?}");
    }
}

#[test]
fn isotropic() {
    expect_furnace(varying_medium(20.0, 0.0));
}

#[test]
fn almost_isotropic() {
    expect_furnace(varying_medium(20.0, 1e-6));
}

#[test]
fn forward() {
    expect_furnace(varying_medium(20.0, 0.9));
}

#[test]
fn forward_peaked() {
    expect_furnace(varying_medium(50.0, 0.99));
}

#[test]
fn backward() {
    expect_furnace(varying_medium(20.0, -0.9));
}

#[test]
fn backward_peaked() {
    expect_furnace(varying_medium(20.0, -0.99));
}

/// A white sky given as an image goes through next-event estimation: no single path carries 1 then,
/// but their mean does.
#[test]
fn under_an_image() {
    for g in [0.0, -0.7] {
        let mut scene = furnace(32);
        scene.medium = Some(varying_medium(4.0, g));
        scene.lights.environment = Environment {
            radiance: [0.25; 3],
            image: Some(EnvironmentImage {
                width: 8,
                height: 4,
                texels: vec![[0.75; 3]; 32].into(),
            }),
            ..Environment::default()
        };
        expect("an image", &scene, &scan(), [1.0; 3]);
    }
}

/// A white Lambert surface of geometric normals reflects as much as it receives.
fn expect_furnace_with_surface(light: LightModel, opacity: f64) {
    let mut scene = furnace(48);
    scene.medium = Some(varying_medium(5.0, 0.4));
    scene.surfaces = Surfaces {
        light,
        normals: Normals::Analytic,
        iso: vec![
            white_surface(2400.0, opacity),
            white_surface(1500.0, 0.5 * opacity),
        ],
    };
    for pixel in render(&scene, &scan(), 2, 2, 1).mean {
        assert!((pixel[0] - 1.0).abs() < 1e-5, "{pixel:?}");
    }
}

#[test]
fn opaque_surfaces_in_local_light() {
    expect_furnace_with_surface(LightModel::Local, 1.0);
}

#[test]
fn translucent_surfaces_in_local_light() {
    expect_furnace_with_surface(LightModel::Local, 0.3);
}

#[test]
fn opaque_surfaces_in_full_light() {
    expect_furnace_with_surface(LightModel::Full, 1.0);
}

#[test]
fn translucent_surfaces_in_full_light() {
    expect_furnace_with_surface(LightModel::Full, 0.3);
}
