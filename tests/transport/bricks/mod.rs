//! Volumes of which the device holds a few bricks at a time.

mod pictures;
mod waiting;

use isolume::gpu::DeviceSummary;
use isolume::render::BrickLayout;
use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

use crate::support::common::*;
use crate::support::fields::voxels;

const DIMS: [u32; 3] = [40, 36, 33];

/// Waves with steep sides: values of 16 bits.
fn wave_values() -> impl Iterator<Item = u16> {
    voxels(DIMS).map(|voxel| {
        let at = voxel.map(f64::from);
        let sum = (0.35 * at[0]).sin() + (0.4 * at[1] + 1.0).sin() + (0.3 * at[2]).cos();
        (32768.0 + 10_000.0 * sum) as u16
    })
}

fn volume_of(voxels: Voxels) -> Volume {
    Volume::from_values(DIMS, [0.1; 3], voxels).expect("a volume")
}

/// Bricks with `side` voxels along a side, and so many places for them in one image.
fn layout(side: u32, volume: &Volume, places: u64) -> BrickLayout {
    layout_within(side, volume, places, &device().summary)
}

fn layout_within(side: u32, volume: &Volume, places: u64, limits: &DeviceSummary) -> BrickLayout {
    BrickLayout::with_side(side, volume.dims, volume.stored.bytes(), places, limits)
}

fn waves() -> Volume {
    volume_of(Voxels::U16(wave_values().collect()))
}

fn scene(g: f64, light: Option<LightModel>) -> Scene {
    let camera = Camera {
        eye: [3.0, 3.5, 6.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Perspective { fov_y: 40.0 },
    };
    let mut scene = empty_scene([16, 16], camera);
    let point = |value: f64, opacity: f64, color: [f64; 3]| TransferPoint {
        value,
        opacity,
        color,
    };
    scene.medium = Some(Medium {
        g,
        ..Medium::isotropic(
            3.0,
            vec![
                point(30_000.0, 0.0, [0.9, 0.8, 0.6]),
                point(45_000.0, 1.0, [0.9, 0.8, 0.6]),
                point(50_000.0, 0.3, [0.3, 0.6, 0.9]),
            ],
        )
    });
    scene.lights.environment.radiance = [0.5, 0.6, 0.7];
    scene.lights.suns = vec![DirectionalLight {
        direction: [-0.6, -0.8, 0.0],
        irradiance: [2.0; 3],
    }];
    if let Some(light) = light {
        let surface = |value: f64, opacity: f64| Isosurface {
            value,
            opacity,
            color: [0.8, 0.5, 0.3],
            shading: Shading::Lambert,
        };
        scene.surfaces.light = light;
        scene.surfaces.iso = vec![surface(41_000.0, 0.5), surface(52_000.0, 1.0)];
    }
    scene
}
