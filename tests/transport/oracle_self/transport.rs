//! The medium, lights and camera through whole pictures.

use super::*;
use crate::support::oracle::field::{Ray, interval};
use crate::support::oracle::random::Random;
use crate::support::oracle::{camera_ray, environment, render, tracking};
use glam::DVec3;
use isolume::scene::{ClipPlane, DirectionalLight};

/// Non-monotone, with a step, opaque in places and empty in others; colour for values in [0, 4].
fn wild(density: f64, g: f64, color: [f64; 3]) -> Medium {
    let point = |value, opacity| TransferPoint {
        value,
        opacity,
        color,
    };
    let transfer = vec![
        point(0.5, 0.0),
        point(1.0, 0.8),
        point(1.5, 0.1),
        point(2.5, 0.1),
        point(2.5, 1.0),
        point(3.5, 0.0),
    ];
    Medium {
        g,
        ..Medium::isotropic(density, transfer)
    }
}

fn perspective(eye: [f64; 3]) -> Camera {
    let projection = Projection::Perspective { fov_y: 40.0 };
    Camera {
        eye,
        target: [0.1, 0.2, 0.0],
        up: [0.0, 1.0, 0.0],
        projection,
    }
}

#[test]
fn white_furnace() {
    let v = noise([6, 5, 4], [0.5, 1.0, 2.0], 4.0, false, 1);
    for g in [-0.9, 0.0, 0.9] {
        for eye in [[0.0, 0.0, 20.0], [1.0, 0.5, -0.3]] {
            let mut scene = scene();
            scene.medium = Some(wild(8.0, g, [1.0; 3]));
            scene.lights.environment = uniform_sky(1.0);
            scene.camera = perspective(eye);
            assert_every_pixel(&render(&scene, &v, 200, 1), 1.0);
        }
    }
}

#[test]
fn exact_transmittance_is_beer_lamberts() {
    for depth in [1e-6, 1e-3, 1.0, 30.0, 1e3] {
        let medium = constant(depth, 0.0, 0.0).expect("a medium");
        let (a, b) = (DVec3::Y * 3.0, DVec3::Y * -3.0);
        let absorbed = -tracking::transmittance(&slab(), &medium, a, b).ln();
        if depth < 100.0 {
            assert!((absorbed / depth - 1.0).abs() < 1e-9, "{depth}: {absorbed}");
        } else {
            assert_eq!(tracking::transmittance(&slab(), &medium, a, b), 0.0);
        }
    }
    // A tent narrower than the step between two voxels: ½·base·height.
    let ramp = volume([2, 1, 1], [1.0; 3], vec![0.0, 1.0]);
    let point = |value, opacity| TransferPoint {
        value,
        opacity,
        color: [0.0; 3],
    };
    let transfer = vec![point(0.4, 0.0), point(0.43, 1.0), point(0.45, 0.0)];
    let tent = Medium::isotropic(10.0, transfer);
    let exact = (-10.0 * 0.5 * 0.05_f64).exp();
    let found = tracking::transmittance(&ramp, &tent, DVec3::X * -2.0, DVec3::X * 2.0);
    assert!((found - exact).abs() < 1e-7, "{found}, exact {exact}");
}

#[test]
fn delta_and_ratio_tracking_agree_with_exact_transmittance() {
    let v = noise([6, 5, 4], [0.5, 1.0, 2.0], 4.0, false, 2);
    let medium = wild(0.15, 0.0, [0.0; 3]);
    let mut random = Random::new(3, 0);
    for _ in 0..3 {
        let direction = random.direction();
        let ray = Ray {
            origin: -20.0 * direction,
            direction,
        };
        let (t0, t1) = interval(&v, &[], &ray).expect("through the centre");
        // A fine sum, which knows nothing of cells or roots.
        let steps = 200_000;
        let width = (t1 - t0) / steps as f64;
        let opacity = |n: usize| {
            let point = ray.at(t0 + (n as f64 + 0.5) * width);
            medium
                .classify(crate::support::oracle::field::value_at(&v, point))
                .0
        };
        let depth = medium.density * width * (0..steps).map(opacity).sum::<f64>();
        let exact = tracking::transmittance(&v, &medium, ray.origin, ray.at(40.0));
        assert!(
            (exact - (-depth).exp()).abs() < 1e-5,
            "{exact}, sum {}",
            (-depth).exp()
        );

        let (mean, stderr) = estimate(1_000_000, || {
            tracking::estimate_transmittance(&v, &medium, &ray, t0, t1, &mut random)
        });
        assert_estimate(mean, stderr, exact);
        let (mean, stderr) = estimate(1_000_000, || {
            let collided = tracking::collision(&v, &medium, &ray, t0, t1, &mut random);
            f64::from(collided.is_none())
        });
        assert_estimate(mean, stderr, exact);
    }
}

#[test]
fn single_scattering_in_a_slab() {
    let mut scene = scene();
    scene.medium = constant(1.0, 1.0, 0.0);
    scene.render.max_bounces = 1;
    scene.lights.suns = vec![DirectionalLight {
        direction: [0.0, -1.0, 0.0],
        irradiance: [1.0; 3],
    }];
    scene.camera = along([0.75_f64.sqrt(), -0.5, 0.0]);
    assert_average(&render(&scene, &slab(), 20_000, 4), 0.0504104);
    scene.camera = along([0.0, 1.0, 0.0]);
    assert_average(&render(&scene, &slab(), 20_000, 5), 0.0292749);
    // Straight through, scattering by no angle: the phase function's value is all that changes.
    scene.medium = constant(1.0, 1.0, 0.5);
    assert_average(
        &render(&scene, &slab(), 100_000, 6),
        0.0292749 * 0.75 / 0.125,
    );
}

/// (albedo, g, τ) → normal R / T, by reciprocity under half a sky.
#[test]
fn slabs_reflect_and_transmit() {
    let cases = [
        (1.0, 0.0, 1.0, 0.341329, 0.658671),
        (0.9, 0.75, 2.0, 0.097395, 0.660958),
    ];
    for (albedo, g, depth, reflected, transmitted) in cases {
        let mut scene = scene();
        scene.medium = constant(depth, albedo, g);
        scene.lights.environment = upper_sky();
        assert_average(&render(&scene, &slab(), enough(reflected), 7), reflected);
        scene.camera = along([0.0, 1.0, 0.0]);
        assert_average(
            &render(&scene, &slab(), enough(transmitted), 8),
            transmitted,
        );
    }
}

#[test]
fn colours_scatter_each_by_its_own_albedo() {
    let mut scene = scene();
    let transfer = vec![TransferPoint {
        value: 0.0,
        opacity: 1.0,
        color: [1.0, 0.9, 0.5],
    }];
    scene.medium = Some(Medium::isotropic(1.0, transfer));
    scene.lights.environment = upper_sky();
    let (mean, stderr) = render(&scene, &slab(), 200_000, 9).average();
    for (c, exact) in [0.341329, 0.267410, 0.099119].into_iter().enumerate() {
        assert_estimate(mean[c], stderr[c], exact);
    }
}

#[test]
fn clip_planes_leave_vacuum() {
    let mut scene = scene();
    scene.medium = constant(2.0, 0.0, 0.0);
    scene.lights.environment = uniform_sky(1.0);
    scene.clips = vec![ClipPlane {
        normal: [0.0, 1.0, 0.0],
        offset: -0.25,
    }];
    assert_average(&render(&scene, &slab(), 100_000, 10), (-0.5_f64).exp());
}

#[test]
fn the_sky_is_where_it_should_be() {
    // −z is the centre and +x to its right; row 0 is +y.
    let (width, height) = (8, 4);
    let texels = (0..width * height).map(|n| [(n % width) as f32, (n / width) as f32, 1.0]);
    let image = EnvironmentImage {
        width,
        height,
        texels: texels.collect(),
    };
    let sky = Environment {
        image: Some(image),
        ..Environment::default()
    };
    let at = |d: DVec3| environment(&sky, d);
    let close = |a: DVec3, b: [f64; 3]| assert!(a.distance(b.into()) < 1e-9, "{a}, not {b:?}");
    close(at(DVec3::NEG_Z), [3.5, 1.5, 1.0]);
    close(at(DVec3::X), [5.5, 1.5, 1.0]);
    close(at(DVec3::NEG_X), [1.5, 1.5, 1.0]);
    close(at(DVec3::Z), [3.5, 1.5, 1.0]);
    assert_eq!(at(DVec3::Y).y, 0.0);
    assert_eq!(at(DVec3::NEG_Y).y, 3.0);
    // 45° up: v = ¼, halfway between rows 0 and 1.
    assert!((at(DVec3::new(0.0, 1.0, -1.0).normalize()).y - 0.5).abs() < 1e-9);
}

#[test]
fn cameras_look_the_right_way() {
    let mut camera = Camera {
        eye: [1.0, 2.0, 3.0],
        target: [1.0, 2.0, -5.0],
        up: [0.0, 2.0, 1.0],
        projection: Projection::Perspective { fov_y: 90.0 },
    };
    let close = |a: DVec3, b: DVec3| assert!(a.distance(b) < 1e-12, "{a}, not {b}");
    let corner = camera_ray(&camera, [200, 100], 200.0, 0.0);
    close(corner.origin, DVec3::new(1.0, 2.0, 3.0));
    close(corner.direction, DVec3::new(2.0, 1.0, -1.0).normalize());
    camera.projection = Projection::Orthographic { height: 10.0 };
    let corner = camera_ray(&camera, [200, 100], 200.0, 0.0);
    close(corner.origin, DVec3::new(11.0, 7.0, 3.0));
    close(corner.direction, DVec3::NEG_Z);
}

#[test]
fn a_seed_is_a_picture() {
    let mut scene = scene();
    scene.medium = constant(1.0, 0.5, 0.0);
    scene.lights.environment = uniform_sky(1.0);
    let picture = |seed| render(&scene, &slab(), 16, seed).mean;
    assert_eq!(picture(1), picture(1));
    assert_ne!(picture(1), picture(2));
    let first = picture(1);
    assert!(
        first[1..].iter().all(|pixel| *pixel != first[0]),
        "two pixels share a stream"
    );
}
