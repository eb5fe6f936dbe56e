//! `find_crossing` against a root finder in double precision, and a sphere through the whole of
//! `iso_depth`. What counts as right where single precision cannot tell is said in [`judge`].

mod departures;
mod judge;
mod special;
mod sphere;
mod test_rays;

use crate::support::common;
use glam::DVec3;
use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

use crate::support::oracle::random::Random;
use crate::support::probe::{Probe, Shader};
use judge::{Judge, Verdict};
use test_rays::{Ball, Rays};

mod twins {
    #![allow(non_camel_case_types)]
    use isolume::gpu::types::*;

    isolume::shared! {
        /// In grid space.
        pub struct TestRay {
            pub origin: vec3,
            /// Grid units per world length.
            pub step: vec3,
            pub t_end: float,
            /// The surface on which the ray starts, or −1.
            pub known: int,
            /// The side of it.
            pub inside: uint,
        }

        pub struct Found {
            pub t: float,
            /// −1: none.
            pub surface: int,
            /// Sides just before the crossing.
            pub inside: uint,
            /// Grid space.
            pub position: vec3,
            pub geometric: vec3,
        }

        pub struct CrossingsPush {
            pub rays: uint,
            /// To look for on each ray.
            pub crossings: uint,
        }
    }
}
pub use twins::*;

const CROSSINGS: Shader = Shader {
    name: "crossings",
    text: include_str!("../../support/glsl/crossings.comp"),
    uses: &["scene_block", "volume", "clips", "ranges", "surfaces"],
};

/// A scene of nothing but isosurfaces.
fn surfaces(values: &[f64]) -> Scene {
    let camera = Camera {
        eye: [0.0, 0.0, 1000.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Perspective { fov_y: 30.0 },
    };
    let mut scene = common::empty_scene([8, 8], camera);
    scene.surfaces.iso = values.iter().map(|&value| lambert(value)).collect();
    scene
}

fn lambert(value: f64) -> Isosurface {
    Isosurface {
        value,
        opacity: 1.0,
        color: [0.8; 3],
        shading: Shading::Lambert,
    }
}

/// The first `crossings` crossings of each ray; after the last one there are empty ones.
fn follow(volume: &Volume, values: &[f64], rays: &[TestRay], crossings: usize) -> Vec<Found> {
    let mut probe = Probe::new(&surfaces(values), volume);
    let push = CrossingsPush {
        rays: rays.len() as u32,
        crossings: crossings as u32,
    };
    let outputs = rays.len() * crossings;
    probe.run(&CROSSINGS, &push, rays, rays.len(), outputs)
}

/// Voxels of `f`, which is given positions in grid space.
fn sampled(dims: [u32; 3], f: impl Fn(DVec3) -> f64) -> Vec<f64> {
    let [nx, ny, nz] = dims;
    let mut voxels = Vec::new();
    for z in 1..=nz {
        for y in 1..=ny {
            voxels.extend((1..=nx).map(|x| f(DVec3::new(x.into(), y.into(), z.into()))));
        }
    }
    voxels
}

fn floats(voxels: Vec<f64>) -> Voxels {
    Voxels::F32(voxels.iter().map(|&v| v as f32).collect())
}

fn bytes(voxels: Vec<f64>) -> Voxels {
    Voxels::U8(voxels.iter().map(|v| v.round() as u8).collect())
}

fn words(voxels: Vec<f64>) -> Voxels {
    Voxels::U16(voxels.iter().map(|v| v.round() as u16).collect())
}

fn volume(dims: [u32; 3], spacing: [f64; 3], voxels: Voxels) -> Volume {
    Volume::from_values(dims, spacing, voxels).expect("a volume")
}

/// Uniform in [0, 1).
fn noise(dims: [u32; 3], seed: u64) -> Vec<f64> {
    let mut random = Random::new(seed, 0);
    (0..dims.iter().product())
        .map(|_| random.uniform())
        .collect()
}

/// Judges the first crossing of every ray, and says how it went. At most a share of `undecided` may be
/// within rounding: a definition that excused faults would excuse many.
fn assert_found(name: &str, volume: &Volume, values: &[f64], rays: &[TestRay], undecided: f64) {
    let found = follow(volume, values, rays, 1);
    let judge = Judge::new(volume, values);
    let (mut hits, mut within_rounding, mut worst) = (0, 0, 0.0_f64);
    for (ray, found) in rays.iter().zip(&found) {
        hits += usize::from(found.surface >= 0);
        match judge.verdict(ray, found) {
            Verdict::Exact(error) => worst = worst.max(error),
            Verdict::WithinRounding => within_rounding += 1,
            Verdict::Wrong => panic!(
                "{name}: {ray:?} found {found:?}, expected {:?}",
                judge.crossings(ray, 0)
            ),
        }
    }
    println!(
        "{name}: {} rays, {hits} hits, depth error ≤ {worst:.1e} voxel, {within_rounding} undecided",
        rays.len()
    );
    assert!(hits > rays.len() / 20, "{name}: most rays met nothing");
    assert!(hits < rays.len(), "{name}: every ray met something");
    assert!(
        f64::from(within_rounding) <= undecided * rays.len() as f64,
        "{name}: {within_rounding} rays are undecided"
    );
}

const RAYS: usize = 77_000;

#[test]
fn rays_meet_a_voxelised_sphere() {
    let dims = [64; 3];
    let (center, radius) = (DVec3::new(32.3, 31.6, 33.1), 21.7);
    let distance = |scale: f64, middle: f64, top: f64| {
        sampled(dims, |g| {
            (middle + scale * (radius - g.distance(center))).clamp(0.0, top)
        })
    };
    let spheres = [
        ("u8 sphere", bytes(distance(16.0, 127.5, 255.0)), 127.5),
        (
            "u16 sphere",
            words(distance(3000.0, 32768.0, 65535.0)),
            32768.0,
        ),
        ("f32 sphere", floats(distance(1.0, 2.0, 4.0)), 2.0),
    ];
    for (seed, (name, voxels, value)) in spheres.into_iter().enumerate() {
        let volume = volume(dims, [0.7; 3], voxels);
        let mut rays = Rays {
            volume: &volume,
            ball: Some(Ball {
                center,
                radius,
                judge: Judge::new(&volume, &[value]),
            }),
            random: Random::new(1, seed as u64),
        };
        assert_found(name, &volume, &[value], &rays.mixed(RAYS), 0.01);
    }
}

#[test]
fn rays_meet_noise() {
    let smooth = [1.0; 3];
    let oblong = [0.3, 1.0, 2.7];
    let flat = [1.0, 1.0, 1000.0];
    let bytes = |dims, top: f64, seed| {
        bytes(
            noise(dims, seed)
                .iter()
                .map(|v| (v * top).floor())
                .collect(),
        )
    };
    let floats = |dims, seed| floats(noise(dims, seed));
    const TOUCHING: usize = 6;
    let fields = [
        (smooth, [24; 3], floats([24; 3], 1), vec![0.5]),
        (oblong, [24; 3], floats([24; 3], 2), vec![0.8]),
        (flat, [48, 24, 24], floats([48, 24, 24], 3), vec![0.9]),
        (oblong, [64; 3], floats([64; 3], 4), vec![0.97]),
        (
            smooth,
            [33, 40, 27],
            floats([33, 40, 27], 5),
            vec![0.4, 0.6],
        ),
        (smooth, [24; 3], bytes([24; 3], 256.0, 6), vec![127.5]),
        // The isovalue is the value of every fourth voxel: along edges and through corners, V touches
        // it exactly wherever such a voxel is a maximum or a minimum.
        (smooth, [32; 3], bytes([32; 3], 4.0, 7), vec![2.0]),
        (
            oblong,
            [64, 24, 48],
            bytes([64, 24, 48], 16.0, 8),
            vec![12.5],
        ),
        (
            smooth,
            [25, 64, 30],
            bytes([25, 64, 30], 256.0, 9),
            vec![250.0],
        ),
        (
            flat,
            [24; 3],
            bytes([24; 3], 256.0, 10),
            vec![200.0, 220.0, 180.0],
        ),
    ];
    for (seed, (spacing, dims, voxels, values)) in fields.into_iter().enumerate() {
        let volume = volume(dims, spacing, voxels);
        let mut rays = Rays {
            volume: &volume,
            ball: None,
            random: Random::new(2, seed as u64),
        };
        let name = format!("noise {seed}");
        let undecided = if seed == TOUCHING { 0.02 } else { 1e-3 };
        assert_found(&name, &volume, &values, &rays.mixed(RAYS), undecided);
    }
}
