//! Memory as it is planned, and as it is taken: which variant each device and budget get, that a plan
//! is right to the byte, and that the cache has memory wherever it is read.
//!
//! What a resource takes is the driver's business. So budgets are, where they can be, what a plan for some rung of the ladder
//! needs, or a byte less.

mod choices;
mod devices;
mod in_bricks;
mod ladder;
mod occupied;
mod planned;
mod real_devices;

use crate::support::common;
use crate::support::fields::voxels;
use std::sync::Arc;

use isolume::error::Result;
use isolume::gpu::{Device, DeviceSummary};
use isolume::render::{CacheLayout, GpuScene, Plan};
use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

/// A cache's scale and format; `None`: no cache.
type Rung = Option<(f64, CacheFormat)>;

use CacheFormat::{F16, F32};

/// From best to worst.
const LADDER: [Rung; 9] = [
    Some((1.0, F32)),
    Some((1.0, F16)),
    Some((0.5, F32)),
    Some((0.5, F16)),
    Some((0.25, F32)),
    Some((0.25, F16)),
    Some((0.125, F32)),
    Some((0.125, F16)),
    None,
];

fn name(rung: Rung) -> String {
    match rung {
        Some((scale, F16)) => format!("caching at scale {scale} in f16"),
        Some((scale, _)) => format!("caching at scale {scale} in f32"),
        None => "non-caching".to_string(),
    }
}

/// The plan for a rung, whatever the budget.
fn plan(
    device: &Arc<Device>,
    limits: &DeviceSummary,
    volume: &Volume,
    scene: &Scene,
    rung: Rung,
) -> Result<Plan> {
    let scene = GpuScene::new(scene, volume, 0);
    let scene = match rung {
        None => scene,
        Some((scale, format)) => {
            let (dims, most) = (volume.dims, limits.max_image_3d);
            let layout = CacheLayout::new(dims, &scene.occupancy(volume), scale, format, most)?;
            scene.with_cache(layout)
        }
    };
    Plan::new(device, limits, &scene)
}

#[derive(Clone, Copy)]
enum Kind {
    U8,
    U16,
    F32,
}

/// Voxels of 0 or 100.
fn volume(dims: [u32; 3], kind: Kind, is_full: impl Fn([u32; 3]) -> bool) -> Volume {
    let values = voxels(dims).map(|voxel| if is_full(voxel) { 100 } else { 0 });
    let voxels = match kind {
        Kind::U8 => Voxels::U8(values.collect()),
        Kind::U16 => Voxels::U16(values.map(u16::from).collect()),
        Kind::F32 => Voxels::F32(values.map(f32::from).collect()),
    };
    Volume::from_values(dims, [1.0; 3], voxels).expect("a volume")
}

fn dense(n: u32, kind: Kind) -> Volume {
    volume([n; 3], kind, |_| true)
}

fn empty(n: u32, kind: Kind) -> Volume {
    volume([n; 3], kind, |_| false)
}

/// One voxel in 24 along each axis is not empty.
fn sparse(n: u32, kind: Kind) -> Volume {
    volume([n; 3], kind, |at| at.iter().all(|i| i % 24 == 3))
}

/// A medium that scatters where voxels are not 0, under a sun, seen from +z.
fn scene() -> Scene {
    let camera = Camera {
        eye: [0.0, 0.0, 400.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Perspective { fov_y: 40.0 },
    };
    let mut scene = common::empty_scene([48, 32], camera);
    let mut medium = common::uniform_medium(0.1, 0.9, 0.0);
    medium.transfer[0].opacity = 0.0;
    medium.transfer.push(TransferPoint {
        value: 100.0,
        opacity: 1.0,
        ..medium.transfer[0]
    });
    scene.medium = Some(medium);
    scene.lights.suns.push(DirectionalLight {
        direction: [0.0, -1.0, 0.0],
        irradiance: [3.0; 3],
    });
    scene.render.variant = Variant::Auto;
    scene
}

fn clay(value: f64) -> Isosurface {
    Isosurface {
        value,
        opacity: 1.0,
        color: [0.8, 0.5, 0.3],
        shading: Shading::Lambert,
    }
}

/// With a surface that blocks light, in a medium that scatters forward: all that takes memory.
fn with_everything(scene: &mut Scene) {
    scene.surfaces.iso.push(clay(50.0));
    scene.surfaces.light = LightModel::Full;
    if let Some(medium) = &mut scene.medium {
        medium.g = 0.5;
    }
}
