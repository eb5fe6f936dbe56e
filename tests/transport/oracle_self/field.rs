//! The field, its gradients, and its crossings.

use super::{noise, volume};
use crate::support::oracle::field::{
    self, Crossing, Ray, crossings, gradient_analytic, gradient_smooth, interval, value_at,
};
use crate::support::oracle::random::Random;
use glam::{DVec3, IVec3};
use isolume::scene::ClipPlane;
use isolume::scene::volume::Volume;

const SPACING: [f64; 3] = [0.5, 1.0, 2.0];

/// A point of the box, sometimes on the planes through voxels or between them.
fn any_point(volume: &Volume, random: &mut Random) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|a| {
        let mut grid = volume.dims[a] as f64 * random.uniform();
        if random.uniform() < 0.3 {
            grid = (2.0 * grid).round() / 2.0;
        }
        (grid - volume.dims[a] as f64 / 2.0) * volume.spacing[a]
    }))
}

/// Sometimes along an axis or a plane.
fn any_direction(random: &mut Random) -> DVec3 {
    let direction = random.direction();
    let kept = DVec3::from_array(std::array::from_fn(|a| {
        if random.uniform() < 0.3 {
            0.0
        } else {
            direction[a]
        }
    }));
    kept.try_normalize().unwrap_or(DVec3::X)
}

fn any_ray(volume: &Volume, random: &mut Random) -> Ray {
    let direction = any_direction(random);
    Ray {
        origin: any_point(volume, random) - 30.0 * direction,
        direction,
    }
}

#[test]
fn voxels_sit_at_cell_centres_and_the_outer_half_is_clamped() {
    let v = volume([3, 1, 2], SPACING, vec![1.0, 2.0, 4.0, 10.0, 20.0, 40.0]);
    let at = |i: f64, j: f64, k: f64| {
        let index = DVec3::new(i, j, k) - DVec3::new(3.0, 1.0, 2.0) / 2.0;
        value_at(&v, index * DVec3::from(SPACING))
    };
    assert_eq!(at(0.5, 0.5, 0.5), 1.0);
    assert_eq!(at(2.5, 0.5, 1.5), 40.0);
    assert_eq!(at(1.0, 0.5, 0.5), 1.5);
    assert_eq!(at(2.0, 0.1, 1.0), 16.5);
    assert_eq!(at(0.0, 0.0, 0.0), 1.0);
    assert_eq!(at(2.9, 0.9, 1.9), 40.0);
}

#[test]
fn the_analytic_gradient_is_the_fields_derivative() {
    let v = noise([5, 4, 3], SPACING, 1.0, false, 1);
    let mut random = Random::new(2, 0);
    for _ in 0..1000 {
        // Off the voxel planes, where the derivative jumps.
        let grid = (DVec3::from_array(std::array::from_fn(|_| random.uniform())) - 0.5) * 3.9;
        let (point, h) = (grid * DVec3::from(SPACING) * 0.5, 1e-6);
        let difference = DVec3::from_array(DVec3::AXES.map(|axis| {
            (value_at(&v, point + h * axis) - value_at(&v, point - h * axis)) / (2.0 * h)
        }));
        assert!(difference.distance(gradient_analytic(&v, point)) < 1e-6);
    }
}

#[test]
fn the_smooth_gradient_is_exact_inside_a_linear_field_and_halved_at_its_border() {
    let gradient = DVec3::new(3.0, -2.0, 0.5);
    let voxels = (0..125).map(|n| DVec3::new((n % 5) as f64, (n / 5 % 5) as f64, (n / 25) as f64));
    let v = volume(
        [5; 3],
        SPACING,
        voxels
            .map(|p| (p * DVec3::from(SPACING)).dot(gradient) as f32)
            .collect(),
    );
    let inside = gradient_smooth(&v, DVec3::new(0.3, 0.7, -1.1));
    assert!(inside.distance(gradient) < 1e-6, "{inside}");
    let border = gradient_smooth(&v, DVec3::new(1.1, 0.0, 0.0));
    assert!(
        border.distance(gradient * DVec3::new(0.5, 1.0, 1.0)) < 1e-6,
        "{border}"
    );
}

/// V at t0 says on which side the ray begins.
fn first_crossing(v: &Volume, value: f64, ray: Ray, t0: f64, t1: f64) -> Option<Crossing> {
    crossings(v, value, ray, t0, t1, None).next()
}

fn all_crossings(v: &Volume, value: f64, ray: Ray, t0: f64, t1: f64) -> Vec<Crossing> {
    crossings(v, value, ray, t0, t1, None).collect()
}

/// V ≥ value holds at a point if and only if it held at the start and an even number of crossings
/// lies between, or the opposite: none is missed, none invented.
#[test]
fn crossings_are_where_the_truth_changes() {
    let mut random = Random::new(3, 0);
    for (seed, whole) in [(4, false), (5, true)] {
        let v = noise([5, 4, 6], SPACING, 4.0, whole, seed);
        for n in 0..20_000 {
            let value = if n % 2 == 0 { 2.0 } else { 1.7 };
            let ray = any_ray(&v, &mut random);
            let Some((t0, t1)) = interval(&v, &[], &ray) else {
                continue;
            };
            let all = all_crossings(&v, value, ray, t0, t1);
            let first = first_crossing(&v, value, ray, t0, t1);
            assert_eq!(first, all.first().copied());
            assert!(
                all.windows(2)
                    .all(|c| c[0].t <= c[1].t && c[0].entering != c[1].entering)
            );
            for crossing in &all {
                assert!((value_at(&v, ray.at(crossing.t)) - value).abs() < 1e-9);
            }
            let start = value_at(&v, ray.at(t0)) - value;
            for _ in 0..20 {
                let t = t0 + (t1 - t0) * random.uniform();
                let excess = value_at(&v, ray.at(t)) - value;
                if start.abs() > 1e-9 && excess.abs() > 1e-9 {
                    let passed = all.iter().filter(|c| c.t < t).count();
                    assert_eq!(
                        excess > 0.0,
                        (start > 0.0) ^ (passed % 2 == 1),
                        "{ray:?} {t}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_ray_that_leaves_a_surface_backwards_meets_what_came_before_it() {
    let v = noise([5, 4, 6], SPACING, 4.0, false, 6);
    let mut random = Random::new(7, 0);
    let mut departures = 0;
    for _ in 0..20_000 {
        let ray = any_ray(&v, &mut random);
        let Some((t0, t1)) = interval(&v, &[], &ray) else {
            continue;
        };
        let all = all_crossings(&v, 2.0, ray, t0, t1);
        for (n, from) in all.iter().enumerate() {
            let back = Ray {
                origin: ray.at(from.t),
                direction: -ray.direction,
            };
            let side = Some(!from.entering);
            let met: Vec<f64> = crossings(&v, 2.0, back, 0.0, from.t - t0, side)
                .map(|c| from.t - c.t)
                .collect();
            assert_eq!(met.len(), n, "{ray:?}");
            assert!(
                met.iter()
                    .zip(all[..n].iter().rev())
                    .all(|(t, c)| (t - c.t).abs() < 1e-6)
            );
            departures += 1;
        }
    }
    assert!(departures > 10_000);
}

/// V = x·y about the origin: the diagonal through a cell of saddle shape has a known double crossing.
#[test]
fn a_shell_thinner_than_a_voxel_is_met_twice() {
    let v = volume([2, 2, 1], [1.0; 3], vec![0.0, 1.0, 1.0, 0.0]);
    // Along x = y, from voxel (0,0) to (1,1), V = 2s(1−s), whose top is ½.
    let ray = Ray {
        origin: DVec3::new(-0.5, -0.5, 0.0),
        direction: DVec3::new(1.0, 1.0, 0.0).normalize(),
    };
    let length = 2.0_f64.sqrt();
    for below in [0.1, 1e-4, 1e-8, 1e-12] {
        let all = all_crossings(&v, 0.5 - below, ray, 0.0, length);
        let half = (below / 2.0).sqrt();
        assert_eq!(all.len(), 2, "{below}");
        assert!((all[0].t / length - (0.5 - half)).abs() < 1e-8);
        assert!((all[1].t / length - (0.5 + half)).abs() < 1e-8);
        assert_eq!(all[0].cell, IVec3::new(0, 0, all[0].cell.z));
    }
    assert!(first_crossing(&v, 0.5 + 1e-12, ray, 0.0, length).is_none());
}

#[test]
fn a_constant_field_at_the_isovalue_has_no_surface() {
    let v = volume([3, 2, 4], SPACING, vec![0.1; 24]);
    let mut random = Random::new(8, 0);
    for _ in 0..10_000 {
        let ray = any_ray(&v, &mut random);
        let Some((t0, t1)) = interval(&v, &[], &ray) else {
            continue;
        };
        let value = 0.1_f32 as f64;
        assert!(first_crossing(&v, value, ray, t0, t1).is_none());
    }
}

#[test]
fn segments_tile_the_ray() {
    let v = noise([5, 1, 6], SPACING, 1.0, false, 9);
    let mut random = Random::new(10, 0);
    for _ in 0..10_000 {
        let ray = any_ray(&v, &mut random);
        let Some((t0, t1)) = interval(&v, &[], &ray) else {
            continue;
        };
        let segments: Vec<_> = field::segments(&v, ray, t0, t1).collect();
        assert_eq!(
            (segments[0].start, segments[segments.len() - 1].end),
            (t0, t1)
        );
        assert!(segments.windows(2).all(|s| s[0].end == s[1].start));
        assert!(segments.iter().all(|s| s.start < s.end));
    }
}

#[test]
fn clip_planes_cut_the_box() {
    let v = volume([1; 3], [2.0, 4.0, 6.0], vec![0.0]);
    let ray = |x: f64| Ray {
        origin: DVec3::new(x, 0.0, 0.0),
        direction: DVec3::X,
    };
    let clip = |x: f64, offset: f64| ClipPlane {
        normal: [x, 0.0, 0.0],
        offset,
    };
    assert_eq!(interval(&v, &[], &ray(-5.0)), Some((4.0, 6.0)));
    assert_eq!(interval(&v, &[], &ray(0.5)), Some((0.0, 0.5)));
    assert_eq!(
        interval(&v, &[clip(1.0, 0.25)], &ray(-5.0)),
        Some((4.0, 5.25))
    );
    assert_eq!(
        interval(&v, &[clip(-1.0, 0.25)], &ray(-5.0)),
        Some((4.75, 6.0))
    );
    assert_eq!(interval(&v, &[clip(-1.0, -2.0)], &ray(-5.0)), None);
    let above = ClipPlane {
        normal: [0.0, 1.0, 0.0],
        offset: -0.5,
    };
    assert_eq!(interval(&v, &[above], &ray(-5.0)), None);
}
