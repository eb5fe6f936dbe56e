//! Rays that begin on a surface with a known side: nothing is found where they start, and everything
//! after it.

use super::*;

/// Below this cosine to the normal, the f32 position's own distance from the surface decides.
const LEAST_COSINE: f64 = 0.02;

/// Of a surface that a ray may leave, in voxels: beyond it, V says on which side the ray is.
const CLEAR: f64 = 1e-3;

/// A ball that is higher within.
fn ball(radius: f64) -> Volume {
    let center = DVec3::new(32.3, 31.6, 33.1);
    let voxels = sampled([64; 3], |g| radius - g.distance(center));
    volume([64; 3], [0.7; 3], floats(voxels))
}

/// Rays that leave the ball's surface from points that other rays found, to the side that they came
/// from or to the other, with the cosine to the normal.
fn leaving(volume: &Volume, count: usize, inside: bool) -> Vec<(f64, TestRay)> {
    let mut rays = Rays {
        volume,
        ball: None,
        random: Random::new(3, u64::from(inside)),
    };
    let arriving = rays.mixed(count);
    let found = follow(volume, &[0.0], &arriving, 1);
    let mut leaving = Vec::new();
    for hit in found.iter().filter(|f| f.surface >= 0) {
        let normal = DVec3::from_array(hit.geometric.map(f64::from));
        let here = if (hit.inside == 1) == inside {
            1.0
        } else {
            -1.0
        };
        let cosine = rays.random.uniform().sqrt().max(LEAST_COSINE);
        let direction = rays.random.around(here * normal, cosine);
        leaving.push((
            cosine,
            rays.leaving(hit.position, direction, 0, u32::from(inside)),
        ));
    }
    leaving
}

fn assert_next_crossings(volume: &Volume, leaving: &[(f64, TestRay)], inside: bool) -> Vec<Found> {
    let rays: Vec<TestRay> = leaving.iter().map(|l| l.1).collect();
    let found = follow(volume, &[0.0], &rays, 1);
    let judge = Judge::new(volume, &[0.0]);
    for (ray, found) in rays.iter().zip(&found) {
        let voxels = judge.ray(ray).direction.length();
        let expected = judge.next_crossings(ray, CLEAR / voxels, inside);
        let is_found = |&t: &Option<f64>| match (t, found.surface) {
            (None, -1) => true,
            (Some(t), 0) => (t - f64::from(found.t)).abs() * voxels <= 1e-3,
            _ => false,
        };
        let right = expected.iter().any(is_found);
        assert!(right, "{ray:?} found {found:?}, expected {expected:?}");
    }
    found
}

#[test]
fn a_ray_reflected_off_a_ball_does_not_meet_it_again() {
    let volume = ball(21.7);
    let leaving = leaving(&volume, 300_000, false);
    assert!(leaving.len() > 100_000, "{} rays", leaving.len());
    let found = assert_next_crossings(&volume, &leaving, false);
    // The interpolant's normals are up to 0.71/radius = 0.033 off the ball's: steeper rays never return.
    let steep = |&(i, _): &(usize, &Found)| leaving[i].0 > 0.04;
    for (i, found) in found.iter().enumerate().filter(steep) {
        assert_eq!(found.surface, -1, "{:?} found {found:?}", leaving[i]);
    }
}

#[test]
fn a_ray_within_a_ball_meets_its_far_side() {
    let radius = 21.7;
    let volume = ball(radius);
    let leaving = leaving(&volume, 300_000, true);
    assert!(leaving.len() > 100_000, "{} rays", leaving.len());
    let found = assert_next_crossings(&volume, &leaving, true);
    // Where two cells meet, their normals are up to 0.066 apart: a flatter ray may leave at once.
    let steep = |l: &(&Found, &(f64, TestRay))| l.1.0 > 0.07;
    for (found, (cosine, ray)) in found.iter().zip(&leaving).filter(steep) {
        assert_eq!(found.surface, 0, "{ray:?} found nothing");
        // The normal is off by 0.033, and the surface at both ends by 1/(4·radius) = 0.0115.
        let chord = f64::from(found.t) / 0.7;
        let off = (chord - 2.0 * radius * cosine).abs();
        assert!(
            off < 2.0 * radius * 0.033 + 0.023 / (cosine - 0.033),
            "{ray:?}: {chord} for {cosine}"
        );
    }
}

/// The same crossings, within 1e-3 of a voxel.
fn agree(a: &[(f64, usize)], b: &[(f64, usize)], voxels: f64) -> bool {
    let same =
        |(a, b): (&(f64, usize), &(f64, usize))| a.1 == b.1 && (a.0 - b.0).abs() * voxels <= 1e-3;
    a.len() == b.len() && a.iter().zip(b).all(same)
}

/// Of isovalues that are next to each other in 32 bits, most crossings are at one t. A ray crosses all of the surfaces, and
/// none of them again.
#[test]
fn surfaces_at_one_place_are_crossed_once_each() {
    const MOST: usize = 160;
    const RAYS: usize = 10_000;
    let volume = volume([24; 3], [0.3, 1.0, 2.7], floats(noise([24; 3], 13)));
    let values = [0.5_f32.next_up(), 0.5, 0.5_f32.next_down()].map(f64::from);
    let mut rays = Rays {
        volume: &volume,
        ball: None,
        random: Random::new(5, 0),
    };
    let rays = rays.mixed(RAYS);
    let found = follow(&volume, &values, &rays, MOST);
    let judge = Judge::new(&volume, &[0.5]);
    let mut undecided = 0;
    for (ray, found) in rays.iter().zip(found.chunks(MOST)) {
        let last = found.last().expect("an answer");
        assert_eq!(last.surface, -1, "more than {MOST} crossings");
        let voxels = judge.ray(ray).direction.length();
        let expected = judge.all_crossings(ray, 0.0);
        for surface in 0..3 {
            let found = found.iter().filter(|f| f.surface == surface);
            let found: Vec<(f64, usize)> = found.map(|f| (f64::from(f.t), 0)).collect();
            if !agree(&found, &expected, voxels) {
                let [low, high] = [-1.0, 1.0].map(|shift| judge.all_crossings(ray, shift));
                let decided = agree(&low, &expected, voxels) && agree(&high, &expected, voxels);
                assert!(!decided, "{ray:?} found {found:?}, expected {expected:?}");
                undecided += 1;
            }
        }
    }
    assert!(undecided * 50 <= RAYS, "{undecided} are undecided");
}

#[test]
fn a_ray_walks_through_every_crossing_in_order() {
    const MOST: usize = 160;
    const RAYS: usize = 10_000;
    let fields = [
        (floats(noise([24; 3], 11)), vec![0.5]),
        (floats(noise([24; 3], 12)), vec![0.6, 0.4, 0.61]),
    ];
    for (seed, (voxels, values)) in fields.into_iter().enumerate() {
        let volume = volume([24; 3], [0.3, 1.0, 2.7], voxels);
        let mut rays = Rays {
            volume: &volume,
            ball: None,
            random: Random::new(4, seed as u64),
        };
        let rays = rays.mixed(RAYS);
        let found = follow(&volume, &values, &rays, MOST);
        let judge = Judge::new(&volume, &values);
        let (mut crossings, mut undecided) = (0, 0);
        for (ray, found) in rays.iter().zip(found.chunks(MOST)) {
            let last = found.last().expect("an answer");
            assert_eq!(last.surface, -1, "more than {MOST} crossings");
            for (s, side) in judge.sides_at_end(ray).iter().enumerate() {
                let found = last.inside >> s & 1 == 1;
                assert!(
                    side.is_none_or(|s| s == found),
                    "{ray:?} ends on the wrong side of {s}"
                );
            }
            let found: Vec<(f64, usize)> = found
                .iter()
                .filter(|f| f.surface >= 0)
                .map(|f| (f64::from(f.t), f.surface as usize))
                .collect();
            crossings += found.len();
            let voxels = judge.ray(ray).direction.length();
            let expected = judge.all_crossings(ray, 0.0);
            if !agree(&found, &expected, voxels) {
                let [low, high] = [-1.0, 1.0].map(|shift| judge.all_crossings(ray, shift));
                let decided = agree(&low, &expected, voxels) && agree(&high, &expected, voxels);
                assert!(!decided, "{ray:?} found {found:?}, expected {expected:?}");
                undecided += 1;
            }
        }
        println!("{RAYS} rays, {crossings} crossings, {undecided} rays undecided");
        assert!(crossings > 5 * RAYS, "only {crossings} crossings");
        assert!(undecided * 100 <= RAYS, "{undecided} rays are undecided");
    }
}
