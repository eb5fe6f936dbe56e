//! Hard cases with known answers.

use super::*;
use crate::support::common;

/// Rays of this test's own in a volume.
fn rays_in(volume: &Volume) -> Rays<'_> {
    Rays {
        volume,
        ball: None,
        random: Random::new(5, 0),
    }
}

/// Where the ray is at a crossing, in double precision.
fn place(ray: &TestRay, found: &Found) -> DVec3 {
    let [origin, step] = [ray.origin, ray.step].map(|v| DVec3::from_array(v.map(f64::from)));
    origin + f64::from(found.t) * step
}

/// V = x in grid space.
fn ramp() -> Volume {
    volume([12, 3, 3], [1.0; 3], floats(sampled([12, 3, 3], |g| g.x)))
}

#[test]
fn a_field_that_is_the_isovalue_everywhere_has_no_surface() {
    let fields = [
        (Voxels::U8(vec![128; 20 * 20 * 20]), 128.0),
        (Voxels::U16(vec![777; 20 * 20 * 20]), 777.0),
        (Voxels::F32(vec![0.1; 20 * 20 * 20]), 0.1),
    ];
    for (voxels, value) in fields {
        let volume = volume([20; 3], [1.0; 3], voxels);
        let rays = rays_in(&volume).mixed(7_000);
        for (ray, found) in rays.iter().zip(follow(&volume, &[value], &rays, 1)) {
            assert_eq!((found.surface, found.inside), (-1, 1), "{ray:?}");
        }
    }
}

/// As 16-bit integers with a sign are held: near 32768, where 32 bits have steps of 1/256.
#[test]
fn isovalues_near_0_of_signed_integers_keep_their_digits() {
    let mut volume = volume(
        [12, 3, 3],
        [1.0; 3],
        words(sampled([12, 3, 3], |g| 32768.0 + g.x)),
    );
    volume.offset = -32768.0;
    volume.range = volume.range.map(|value| value + volume.offset);
    for value in [2.7637, 8.002, 8.3379, 8.4629, 8.998] {
        let rays = rays_in(&volume).mixed(700);
        let found = follow(&volume, &[value], &rays, 1);
        let hits: Vec<f64> = rays
            .iter()
            .zip(&found)
            .filter(|(_, found)| found.surface == 0)
            .map(|(ray, found)| place(ray, found).x)
            .collect();
        assert!(hits.len() > 100, "{value}: {} hits", hits.len());
        for x in hits {
            assert!((x - value).abs() < 1e-3, "{value} at {x}");
        }
    }
}

#[test]
fn a_surface_without_opacity_is_in_no_layer() {
    let seen = |values: &[f64], opacities: &[f64]| {
        let mut scene = surfaces(values);
        scene.camera.eye = [100.0, 0.0, 0.0];
        scene.camera.projection = Projection::Orthographic { height: 3.0 };
        for (iso, &opacity) in scene.surfaces.iso.iter_mut().zip(opacities) {
            iso.opacity = opacity;
        }
        let hits = common::first_hits(&scene, &ramp());
        (hits.normal_depth, hits.albedo)
    };
    let alone = seen(&[4.0], &[1.0]);
    assert!(alone.0.iter().any(|hit| hit[3].is_finite()));
    assert_eq!(seen(&[4.0, 8.0], &[1.0, 0.0]), alone);
    assert_ne!(seen(&[4.0, 8.0], &[1.0, 0.1]), alone);
}

/// A block of voxels of one value, which is the isovalue: a hit lies on the side of a cell in which the field is constant.
#[test]
fn a_mask_has_the_normals_of_its_faces() {
    let is_inside = |g: DVec3| (g - 12.5).abs().max_element() < 6.0;
    let voxels = sampled([24; 3], |g| f64::from(u8::from(is_inside(g))));
    let volume = volume([24; 3], [1.0; 3], bytes(voxels));
    for axis in 0..3 {
        for side in [1.0, -1.0] {
            let mut normal = [0.0; 3];
            normal[axis] = side;
            let mut eye = [0.3, 0.5, 0.7];
            eye[axis] = side;
            let mut scene = surfaces(&[1.0]);
            scene.surfaces.normals = Normals::Analytic;
            scene.camera.eye = eye.map(|x| 100.0 * x);
            scene.camera.target = normal.map(|x| 5.5 * x);
            scene.camera.projection = Projection::Orthographic { height: 4.0 };
            for [x, y, z, depth] in common::first_hits(&scene, &volume).normal_depth {
                assert!(depth.is_finite(), "{normal:?}");
                let found = DVec3::new(x.into(), y.into(), z.into());
                let off = found.distance(DVec3::from_array(normal));
                assert!(off < 1e-5, "{found} on the face of {normal:?}");
            }
        }
    }
}

#[test]
fn a_shell_five_hundred_times_thinner_than_a_voxel_is_not_missed() {
    let spike = |top: f64| sampled([24; 3], |g| if g.z == 13.0 { top } else { 0.0 });
    let shells = [
        (floats(spike(1.0)), 0.999, 1e-3),
        (words(spike(50_000.0)), 49_950.0, 1e-3),
        (bytes(spike(250.0)), 249.0, 4e-3),
        // The field reaches the isovalue at its voxels alone, as that of a mask.
        (floats(spike(1.0)), 1.0, 0.0),
        (words(spike(50_000.0)), 50_000.0, 0.0),
        (bytes(spike(250.0)), 250.0, 0.0),
    ];
    for (voxels, value, half) in shells {
        let volume = volume([24; 3], [1.0; 3], voxels);
        let mut rays = rays_in(&volume);
        let mut crossing = Vec::new();
        while crossing.len() < 20_000 {
            let from = DVec3::from_array([(); 3].map(|()| 1.0 + 23.0 * rays.random.uniform()));
            let to = DVec3::from_array([(); 3].map(|()| 1.0 + 23.0 * rays.random.uniform()));
            if (from.z < 12.9) != (to.z < 12.9) && (from.z > 13.1) != (to.z > 13.1) {
                crossing.push(rays.ray(from, to - from));
            }
        }
        let found = follow(&volume, &[value], &crossing, 3);
        for (ray, found) in crossing.iter().zip(found.chunks(3)) {
            let up = f64::from(ray.step[2]).signum();
            assert_eq!([0, 1, 2].map(|i| found[i].surface), [0, 0, -1], "{ray:?}");
            for (found, side) in found.iter().zip([-1.0, 1.0]) {
                let off = place(ray, found).z - (13.0 + up * side * half);
                assert!(off.abs() < 1e-5, "{ray:?}: {off:e} off in {found:?}");
                let towards: f32 = (0..3).map(|a| ray.step[a] * found.geometric[a]).sum();
                assert!(towards < 0.0, "{ray:?}: {found:?} faces away");
            }
        }
    }
}

/// V = s·(1 − s) along the ray, which has its maximum ¼ at s = ½, within a cell.
#[test]
fn a_ray_touches_a_double_root() {
    let voxels = sampled([4; 3], |g| (g.x - 2.0) * (g.y - 2.0));
    let volume = volume([4; 3], [1.0; 3], floats(voxels));
    let ray = rays_in(&volume).ray_of_step(DVec3::new(1.5, 3.5, 2.25), DVec3::new(0.5, -0.5, 0.0));
    let answer = |below: f64| {
        let found = follow(&volume, &[0.25 - below], &[ray], 3);
        let crossings: Vec<f64> = found
            .iter()
            .filter(|f| f.surface == 0)
            .map(|f| place(&ray, f).x - 2.0)
            .collect();
        crossings
    };
    for below in [1e-1, 1e-2, 1e-3, 1e-4, 1e-5] {
        let half = f64::sqrt(below);
        let found = answer(below);
        assert_eq!(found.len(), 2, "{below}: {found:?}");
        for (found, expected) in found.iter().zip([0.5 - half, 0.5 + half]) {
            assert!(
                (found - expected).abs() < 1e-3,
                "{below}: {found} is not {expected}"
            );
        }
    }
    for above in [1e-6, 1e-4, 1e-2] {
        assert!(answer(-above).is_empty(), "¼ + {above} is never reached");
    }
    // Exactly there, both answers are right: but a crossing comes with its return, at the same place.
    let touching = answer(0.0);
    assert!(touching.is_empty() || touching.len() == 2, "{touching:?}");
    assert!(
        touching.iter().all(|s| (s - 0.5).abs() < 1e-3),
        "{touching:?}"
    );
}

#[test]
fn two_surfaces_in_one_voxel_are_met_in_order() {
    let volume = ramp();
    let rays = rays_in(&volume);
    let along = |x: f64, direction: f64| {
        rays.ray_of_step(DVec3::new(x, 2.3, 1.9), DVec3::new(direction, 0.0, 0.0))
    };
    let rays = [along(2.5, 1.0), along(9.5, -1.0)];
    for values in [[5.25, 5.5], [5.5, 5.25], [5.25, 5.2501]] {
        let found = follow(&volume, &values, &rays, 3);
        let mut order = [0, 1];
        order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
        for (ray, found) in rays.iter().zip(found.chunks(3)) {
            for (found, surface) in found.iter().zip(order) {
                assert_eq!(found.surface, surface as i32, "{values:?}: {found:?}");
                let off = place(ray, found).x - values[surface];
                assert!(off.abs() < 1e-5, "{values:?}: {off:e} off");
            }
            assert_eq!(found[2].surface, -1);
            order.reverse();
        }
    }
}

/// V ≥ value is true where V is the value: that decides for a ray that begins there.
#[test]
fn voxels_that_are_the_isovalue_are_inside() {
    let volume = ramp();
    let rays = rays_in(&volume);
    let along = |x: f64, direction: f64| {
        rays.ray_of_step(DVec3::new(x, 2.0, 2.0), DVec3::new(direction, 0.0, 0.0))
    };
    let cases = [
        (along(2.5, 1.0), 0, Some(4.5)),
        (along(9.5, -1.0), 1, Some(2.5)),
        (along(7.0, 1.0), 1, None),
        (along(7.0, -1.0), 1, Some(0.0)),
    ];
    for (ray, inside, expected) in cases {
        let found = follow(&volume, &[7.0], &[ray], 1)[0];
        assert_eq!(found.inside, inside, "{ray:?}: {found:?}");
        match expected {
            None => assert_eq!(found.surface, -1, "{ray:?}: {found:?}"),
            Some(t) => {
                assert_eq!(found.surface, 0, "{ray:?}: {found:?}");
                assert!((f64::from(found.t) - t).abs() < 1e-6, "{ray:?}: {found:?}");
            }
        }
    }
}

/// V = s³ along the diagonal: a triple root, where the gradient is exactly zero.
#[test]
fn where_the_gradient_is_zero_the_normal_is_the_reversed_ray() {
    let voxels = sampled([5; 3], |g| (g - 3.0).element_product());
    let volume = volume([5; 3], [1.0; 3], floats(voxels));
    let rays = rays_in(&volume);
    for (from, direction, inside) in [(1.0, 0.5, 0), (5.0, -0.5, 1)] {
        let ray = rays.ray_of_step(DVec3::splat(from), DVec3::splat(direction));
        let found = follow(&volume, &[0.0], &[ray], 1)[0];
        assert_eq!((found.surface, found.inside), (0, inside), "{found:?}");
        let off = place(&ray, &found).distance(DVec3::splat(3.0));
        assert!(off < 1e-2, "{off:e} off in {found:?}");
        let normal = DVec3::from_array(found.geometric.map(f64::from));
        let reversed = -DVec3::splat(direction).normalize();
        assert!(normal.distance(reversed) < 1e-3, "{found:?}");
    }
}
