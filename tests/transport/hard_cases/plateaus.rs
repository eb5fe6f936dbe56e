//! Where neighbouring voxels have one value, so has the field between them, to the last bit: a transfer function may have a
//! step just there, as that of a map of labels or of saturated data has.

use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

use crate::hard_cases::quadrature::absorbing_scene;
use crate::hard_cases::transfer::absorbing;
use crate::support::common::*;

const VOXEL: f64 = 0.01;

/// Each value in two slices of voxels, one pair behind the other along z.
fn slabs(values: &[f64], format: fn(Vec<f64>) -> Voxels) -> Volume {
    let dims = [4, 4, 2 * values.len() as u32];
    let doubled = values.iter().flat_map(|&value| [value; 2 * 4 * 4]);
    Volume::from_values(dims, [VOXEL; 3], format(doubled.collect())).expect("a volume")
}

/// Opacity is 1 from every second value up to the next one, and 0 between these.
fn stripes(values: &[f64]) -> Medium {
    let steps = values.iter().enumerate().skip(1).flat_map(|(i, &value)| {
        let opacity = |i: usize| (i % 2) as f64;
        [(value, opacity(i - 1)), (value, opacity(i))]
    });
    let points: Vec<_> = std::iter::once((values[0], 0.0)).chain(steps).collect();
    absorbing(1e6, &points)
}

/// Sees all values across, with a row of the picture for each cell from one slice to the next: every second row, from the
/// first on, is between slices of one value.
fn across(values: &[f64]) -> Scene {
    let rows = 2 * values.len() as u32 - 1;
    let camera = Camera {
        eye: [1.0, 0.0, 0.0],
        target: [0.0; 3],
        up: [0.0, 0.0, -1.0],
        projection: Projection::Orthographic {
            height: f64::from(rows) * VOXEL,
        },
    };
    let mut scene = absorbing_scene(stripes(values), camera);
    scene.render.size = [1, rows];
    scene
}

fn expect_stripes(what: &str, values: &[f64], picture: &[[f32; 4]]) {
    for (i, (value, pixel)) in values.iter().zip(picture.iter().step_by(2)).enumerate() {
        let expected = if i % 2 == 0 { 1.0 } else { 0.0 };
        assert!(
            (pixel[0] - expected).abs() < 1e-3,
            "{what}, {value}: {} where {expected} is expected",
            pixel[0]
        );
    }
}

fn expect_steps(values: &[f64], format: fn(Vec<f64>) -> Voxels) {
    let (scene, volume) = (across(values), slabs(values, format));
    let film = render(&scene, &volume, 2, 4, 1);
    expect_stripes("paths", values, &film.mean);
    let mut cached = cached(&scene, &volume, 0.5, CacheFormat::F16, 1, 1);
    expect_stripes("in motion", values, &cached.march());
    expect_stripes("at rest", values, &cached.at_rest(2, 2).mean);
}

#[test]
fn labels_of_8_bits() {
    let values: Vec<f64> = (0..=255).map(f64::from).collect();
    expect_steps(&values, |values| {
        Voxels::U8(values.into_iter().map(|v| v as u8).collect())
    });
}

/// A third of those that are not 65535 times their texel, as 32 bits round that, and others.
#[test]
fn labels_of_16_bits() {
    let texel = |k: u16| f32::from(k) * (1.0 / 65535.0);
    let is_rounded = |k: &u16| texel(*k) * 65535.0 != f32::from(*k);
    let rounded = (0..=u16::MAX).filter(is_rounded).step_by(3);
    let mut values: Vec<u16> = rounded.chain((0..=u16::MAX).step_by(300)).collect();
    values.sort_unstable();
    values.dedup();
    assert!(values.len() > 300, "{}", values.len());
    let values: Vec<f64> = values.into_iter().map(f64::from).collect();
    expect_steps(&values, |values| {
        Voxels::U16(values.into_iter().map(|v| v as u16).collect())
    });
}

#[test]
fn floats() {
    let values: Vec<f64> = (-150..150).map(|i| f64::from(i as f32 * 0.1)).collect();
    expect_steps(&values, |values| {
        Voxels::F32(values.into_iter().map(|v| v as f32).collect())
    });
}

/// Seen from behind each other: a ray comes to each plateau at the side of a cell, where the field has not quite reached its
/// value. Opacity is 1 from every second value half way up to the next one.
#[test]
fn plateaus_one_after_another() {
    const DENSITY: f64 = 1.0;
    let values: Vec<f64> = (0..=255).map(f64::from).collect();
    let volume = slabs(&values, |values| {
        Voxels::U8(values.into_iter().map(|v| v as u8).collect())
    });
    let spikes = values.iter().skip(1).step_by(2).flat_map(|&value| {
        let half_way = value + 0.5;
        [(value, 0.0), (value, 1.0), (half_way, 1.0), (half_way, 0.0)]
    });
    // From each spike's plateau a voxel, and of the ramp behind it half of one; of the last one half, up to the face.
    let depth = DENSITY * VOXEL * (1.5 * 128.0);
    let medium = absorbing(DENSITY, &spikes.collect::<Vec<_>>());
    // Rays that come to all sides of cells as exactly as a float allows, and rays that do not.
    for eye in [[0.0, 0.0, 7.3], [0.01, 0.02, 9.7], [0.1, 0.0, -77.7]] {
        let camera = Camera {
            eye,
            target: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            projection: Projection::Orthographic { height: VOXEL },
        };
        let mut scene = absorbing_scene(medium.clone(), camera);
        scene.render.size = [4, 4];
        let mut cached = cached(&scene, &volume, 0.5, CacheFormat::F16, 1, 1);
        let [in_motion, at_rest] = [cached.march(), cached.at_rest(4, 4).mean]
            .map(|picture| -mean_red(&picture).ln() / depth - 1.0);
        println!("{eye:?}, optical depth in motion {in_motion:+.4}, at rest {at_rest:+.4}");
        assert!(at_rest.abs() < 1e-3, "at rest");
        assert!(in_motion.abs() < 0.03, "in motion");
    }
}
