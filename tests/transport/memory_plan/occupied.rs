//! The cache has memory wherever it is read: at each place where the medium scatters or a surface
//! shows, all eight nodes around are in bricks that have a place. And nowhere else to speak of.

use std::collections::HashSet;

use fastrand::Rng;
use glam::{DVec3, UVec3};
use isolume::render::shared::{BRICK, MACROCELL};
use isolume::render::{CacheLayout, GpuScene};
use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

use crate::memory_plan::{F32, Kind, empty, scene, volume};
use crate::support::fields::{indexed_field, voxels};

/// More than any volume here is long.
const MOST_TEXELS: u32 = 2048;

/// A rough ball in emptiness, with dimensions that nothing divides.
fn random_volume(random: &mut Rng) -> Volume {
    let dims: [u32; 3] = std::array::from_fn(|_| random.u32(1..65));
    let centre = DVec3::from(dims.map(|n| random.f64() * f64::from(n)));
    let radius = 1.0 + 12.0 * random.f64();
    let shares = voxels(dims).map(|voxel| {
        let depth = 1.0 - UVec3::from(voxel).as_dvec3().distance(centre) / radius;
        (depth * (0.7 + 0.3 * random.f64())).max(0.0)
    });
    let voxels = match dims[0] % 3 {
        0 => Voxels::U8(shares.map(|s| (255.0 * s) as u8).collect()),
        1 => Voxels::U16(shares.map(|s| (65535.0 * s) as u16).collect()),
        _ => Voxels::F32(shares.map(|s| (40.0 * s - 7.0) as f32).collect()),
    };
    let spacing = std::array::from_fn(|_| 0.3 + random.f64());
    let mut volume = Volume::from_values(dims, spacing, voxels).expect("a volume");
    // As from a file with slope and intercept.
    let [low, high] = volume.range.map(|v| 0.37 * v - 20.0);
    (volume.scale, volume.offset, volume.range) = (0.37, -20.0, [low, high]);
    volume
}

/// Ramps and steps between the volume's values; emptiness is mostly transparent.
fn random_transfer(random: &mut Rng, [low, high]: [f64; 2]) -> Vec<TransferPoint> {
    let mut values: Vec<f64> = (0..random.usize(1..6))
        .map(|_| low + random.f64() * (high - low + 1.0))
        .collect();
    values.push(values[0]);
    values.sort_by(f64::total_cmp);
    let opacity = |n| match random.u8(0..if n == 0 { 8 } else { 2 }) {
        0 => random.f64(),
        _ => 0.0,
    };
    let opacities: Vec<f64> = (0..values.len()).map(opacity).collect();
    let point = |(value, opacity)| TransferPoint {
        value,
        opacity,
        color: [0.9; 3],
    };
    values.into_iter().zip(opacities).map(point).collect()
}

/// V at a point of grid space, in the data's units.
fn value(volume: &Volume, g: DVec3) -> f64 {
    let last = UVec3::from(volume.dims).as_ivec3() - 1;
    let cell = g.floor();
    let p = g - cell;
    let voxels = volume.voxels().expect("voxels");
    (0..8)
        .map(|corner| {
            let offset = glam::IVec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
            let [x, y, z] = (cell.as_ivec3() - 1 + offset)
                .clamp(glam::IVec3::ZERO, last)
                .to_array()
                .map(|i| i as usize);
            let [width, height, _] = volume.dims.map(|n| n as usize);
            let n = (z * height + y) * width + x;
            let stored = match &*voxels {
                Voxels::U8(v) => f64::from(v[n]),
                Voxels::U16(v) => f64::from(v[n]),
                Voxels::F32(v) => f64::from(v[n]),
            };
            let weight = |a: usize| if offset[a] == 1 { p[a] } else { 1.0 - p[a] };
            weight(0) * weight(1) * weight(2) * (volume.offset + volume.scale * stored)
        })
        .sum()
}

struct Covered {
    active: HashSet<UVec3>,
    nodes: UVec3,
    step: DVec3,
}

impl Covered {
    fn new(layout: &CacheLayout) -> Covered {
        let unpacked = |&word: &u32| UVec3::new(word, word >> 10, word >> 20) & 1023;
        Covered {
            active: layout.active.iter().map(unpacked).collect(),
            nodes: layout.nodes.into(),
            step: DVec3::from(layout.step.map(f64::from)),
        }
    }

    /// As `read_cache` reads: the nodes around the point, or the outermost ones.
    fn contains(&self, g: DVec3) -> bool {
        let c = ((g - 0.5) / self.step - 0.5).max(DVec3::ZERO);
        let last = self.nodes - 1;
        let low = c.as_uvec3().min(last.saturating_sub(UVec3::ONE));
        (0..8).all(|corner| {
            let offset = UVec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
            self.active.contains(&((low + offset).min(last) / BRICK))
        })
    }
}

fn is_clipped(scene: &Scene, volume: &Volume, g: DVec3) -> bool {
    let half = DVec3::from(volume.extent()) / 2.0;
    let p = (g - 0.5) * DVec3::from(volume.spacing) - half;
    let beyond = |c: &ClipPlane| DVec3::from(c.normal).dot(p) > c.offset;
    scene.clips.iter().any(beyond)
}

/// Where V crosses the isovalue between two points, if so.
fn crossing(volume: &Volume, iso: f64, mut a: DVec3, mut b: DVec3) -> Option<DVec3> {
    let above = |g| value(volume, g) >= iso;
    let side = above(a);
    if above(b) == side {
        return None;
    }
    for _ in 0..40 {
        let middle = 0.5 * (a + b);
        *(if above(middle) == side {
            &mut a
        } else {
            &mut b
        }) = middle;
    }
    Some(b)
}

fn random_scene(random: &mut Rng, volume: &Volume) -> Scene {
    let mut scene = scene();
    let [low, high] = volume.range;
    if let Some(medium) = &mut scene.medium {
        medium.transfer = random_transfer(random, volume.range);
    }
    if random.bool() {
        scene.surfaces.light = LightModel::Full; // in `local` light the cache outlives surfaces
        scene
            .surfaces
            .iso
            .push(crate::memory_plan::clay(low + random.f64() * (high - low)));
    }
    if random.u8(0..4) == 0 {
        let normal = DVec3::from(std::array::from_fn(|_| random.f64() - 0.5)).normalize();
        scene.clips.push(ClipPlane {
            normal: normal.to_array(),
            offset: random.f64() - 0.5,
        });
    }
    scene
}

#[test]
fn the_cache_has_memory_where_it_is_read() {
    let mut random = Rng::with_seed(1);
    let (mut looked, mut bricks, mut active) = (0, 0, 0);
    for trial in 0..150 {
        let volume = random_volume(&mut random);
        let scene = random_scene(&mut random, &volume);
        let scale = [1.0, 0.5, 0.25, 0.125][trial % 4];
        let occupancy = GpuScene::new(&scene, &volume, 0).occupancy(&volume);
        let layout = CacheLayout::new(volume.dims, &occupancy, scale, F32, MOST_TEXELS);
        let layout = layout.expect("a layout");
        bricks += layout.bricks.iter().product::<u32>();
        active += layout.active.len();
        let covered = Covered::new(&layout);
        let extent = UVec3::from(volume.dims).as_dvec3();
        let mut check = |g: DVec3, what: &str| {
            looked += 1;
            let found = covered.contains(g);
            assert!(found, "trial {trial}: {what} at {g} of {:?}", volume.dims);
        };
        for _ in 0..2000 {
            let mut point = || 0.5 + DVec3::from(std::array::from_fn(|_| random.f64())) * extent;
            let (g, other) = (point(), point());
            let opacity = scene
                .medium
                .as_ref()
                .map(|m| m.classify(value(&volume, g)).0);
            if opacity > Some(0.0) && !is_clipped(&scene, &volume, g) {
                check(g, "the medium");
            }
            for surface in &scene.surfaces.iso {
                match crossing(&volume, surface.value, g, other) {
                    Some(hit) if !is_clipped(&scene, &volume, hit) => check(hit, "the surface"),
                    _ => {}
                }
            }
        }
    }
    println!("{looked} places, {active} of {bricks} bricks active");
    assert!(looked > 20_000, "only {looked} places were looked at");
    assert!(
        active < bricks as usize * 2 / 3,
        "{active} of {bricks} bricks are active"
    );
}

#[test]
fn an_empty_volume_has_no_nodes_and_a_speck_has_few() {
    let layout = |volume: &Volume, scale| {
        let occupancy = GpuScene::new(&scene(), volume, 0).occupancy(volume);
        CacheLayout::new(volume.dims, &occupancy, scale, F32, MOST_TEXELS).expect("a layout")
    };
    let speck = volume([64; 3], Kind::U8, |at| at == [35; 3]);
    for scale in [1.0, 0.5, 0.25, 0.125] {
        let none = layout(&empty(64, Kind::U8), scale);
        assert_eq!((none.active_nodes(), none.places), (0, [1; 3]));
        let few = layout(&speck, scale);
        let share = few.active_nodes() as f64 / few.all_nodes() as f64;
        let most = (24.0 * scale + 2.0 * f64::from(BRICK)).min(64.0 * scale) / (64.0 * scale);
        assert!(
            share > 0.0 && share <= most.powi(3),
            "{share} at scale {scale}"
        );
    }
}

/// Ten bits name a brick along an axis.
#[test]
fn a_lattice_that_is_too_long_to_number_is_refused() {
    let long = volume([5000, 2, 2], Kind::U8, |_| true);
    let occupancy = GpuScene::new(&scene(), &long, 0).occupancy(&long);
    let layout = |scale| CacheLayout::new(long.dims, &occupancy, scale, F32, 16384);
    let refused = layout(1.0).expect_err("5000 nodes");
    assert!(
        refused.to_string().contains("more than 4096 along an axis"),
        "{refused}"
    );
    let layout = layout(0.5).expect("2500 nodes");
    let different: HashSet<u32> = layout.active.iter().copied().collect();
    assert_eq!(different.len(), 625);
}

/// Voxel i is a corner of the cells of interpolation i and i + 1.
#[test]
fn macrocell_ranges_are_those_of_all_corners() {
    let mut random = Rng::with_seed(2);
    for _ in 0..30 {
        let volume = random_volume(&mut random);
        let [columns, rows, slices] = volume.dims.map(|n| n / MACROCELL + 1);
        let nothing = [f32::INFINITY, f32::NEG_INFINITY];
        let mut expected = vec![nothing; (columns * rows * slices) as usize];
        for (n, voxel) in voxels(volume.dims).enumerate() {
            let value = match &*volume.voxels().expect("voxels") {
                Voxels::U8(v) => f32::from(v[n]),
                Voxels::U16(v) => f32::from(v[n]),
                Voxels::F32(v) => v[n],
            };
            for corner in 0..8 {
                let [x, y, z] = [0, 1, 2].map(|a| (voxel[a] + (corner >> a & 1)) / MACROCELL);
                let [low, high] = &mut expected[((z * rows + y) * columns + x) as usize];
                (*low, *high) = (low.min(value), high.max(value));
            }
        }
        assert_eq!(volume.macrocell_ranges(), expected, "{:?}", volume.dims);
    }
}

/// Air in a CT has the lowest value exactly, and a ramp of opacity often begins there.
#[test]
fn a_background_at_which_a_ramp_begins_needs_no_memory() {
    let volume = indexed_field([64; 3], [1.0; 3], |voxel| {
        let is_inside = voxel.iter().all(|&i| i < 16);
        if is_inside { 300.0 } else { -1024.0 }
    });
    let mut scene = scene();
    let ramp = [(-1024.0, 0.0), (3000.0, 1.0)].map(|(value, opacity)| TransferPoint {
        value,
        opacity,
        color: [0.9; 3],
    });
    scene.medium = Some(Medium::isotropic(0.7, ramp.to_vec()));
    let scene = GpuScene::new(&scene, &volume, 1);
    let occupied = scene.occupancy(&volume).occupied;
    let count = occupied.iter().filter(|&&is_occupied| is_occupied).count();
    assert_eq!((occupied.len(), count), (9 * 9 * 9, 3 * 3 * 3));
}
