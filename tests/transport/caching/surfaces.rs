//! Surfaces that stop light: no node may carry it through a wall, and shadows keep their edges.

use isolume::render::Film;
use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

use crate::support::common::*;
use crate::support::fields::{field, indexed_field};

fn black(value: f64) -> Isosurface {
    Isosurface {
        value,
        opacity: 1.0,
        color: [0.0; 3],
        shading: Shading::Lambert,
    }
}

/// A black wall across the box, haze on both sides, and a sun that shines on it from the left; seen from `x`.
fn walled(x: f64) -> Scene {
    let camera = Camera {
        eye: [x, 0.0, 0.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height: 8.0 },
    };
    let mut scene = empty_scene([16, 16], camera);
    scene.medium = Some(uniform_medium(0.1, 0.9, 0.0));
    scene.surfaces.light = LightModel::Full;
    scene.surfaces.iso = vec![black(1.5)];
    scene.lights.suns = vec![DirectionalLight {
        direction: [1.0, 0.0, 0.0],
        irradiance: [1.0; 3],
    }];
    scene
}

/// A wall one voxel thick: nothing of the light may reach the right.
#[test]
fn nothing_leaks_through_a_wall_thinner_than_a_cell() {
    let volume = field([32, 16, 16], [1.0; 3], |p| {
        if (p[0] - 0.5).abs() < 0.5 { 2.0 } else { 1.0 }
    });
    for scale in [0.5, 0.25] {
        let mut cache = cached(&walled(-40.0), &volume, scale, CacheFormat::F16, 0, 1);
        let [left, right] = [-40.0, 40.0].map(|x| {
            cache.change(&walled(x), &volume);
            cache.fill(64);
            mean_red(&cache.at_rest(2, 16).mean)
        });
        println!("scale {scale}: {:.1e} of the light leaks", right / left);
        assert!(
            left > 0.01 && right < 1e-3 * left,
            "scale {scale}: {right} of {left}"
        );
    }
}

/// Nodes within the room and around it are on sides of surfaces that count as the same: none apart, or four. A young cache
/// must not interpolate between them.
#[test]
fn no_light_spreads_into_a_sealed_room() {
    let of_shells = |voxel: [u32; 3]| voxel.map(|i| i.abs_diff(8)).into_iter().max();
    let wall = |voxel| f32::from(of_shells(voxel) == Some(5));
    let block = |voxel| f32::from(of_shells(voxel) <= Some(5));
    let rooms = [
        (indexed_field([17; 3], [1.0; 3], wall), &[0.5][..]),
        (
            indexed_field([17; 3], [1.0; 3], block),
            &[0.2, 0.4, 0.6, 0.8],
        ),
    ];
    for (volume, isovalues) in rooms {
        let camera = Camera {
            eye: [0.3, 0.2, 0.1],
            target: [1.0, 0.4, 0.3],
            up: [0.0, 1.0, 0.0],
            projection: Projection::Perspective { fov_y: 90.0 },
        };
        let mut scene = empty_scene([16, 16], camera);
        let medium = [(-1.0, 0.9), (0.5, 1.0), (2.0, 0.9)].map(|(value, opacity)| TransferPoint {
            value,
            opacity,
            color: [0.95; 3],
        });
        scene.medium = Some(Medium::isotropic(0.15, medium.to_vec()));
        scene.surfaces.light = LightModel::Full;
        scene.surfaces.iso = isovalues.iter().map(|&value| black(value)).collect();
        scene.lights.environment.radiance = [1.0; 3];
        for scale in [1.0, 0.5] {
            let mut cache = cached(&scene, &volume, scale, CacheFormat::F16, 16, 1);
            let seen = mean_red(&cache.at_rest(1, 16).mean);
            assert!(
                seen < 1e-5,
                "{} surfaces, scale {scale}: {seen}",
                isovalues.len()
            );
        }
    }
}

/// A wall that has haze within: in motion, too, its two sides differ, though nodes of both are close to it. A picture at
/// rest leaves the space between them to paths.
#[test]
fn in_motion_light_ends_at_a_wall() {
    let volume = field(
        [32, 16, 16],
        [1.0; 3],
        |p| if p[0] < 0.0 { 1.0 } else { 2.0 },
    );
    for scale in [1.0, 0.25] {
        let mut cache = cached(&walled(-40.0), &volume, scale, CacheFormat::F16, 0, 1);
        let [left, right] = [-40.0, 40.0].map(|x| {
            cache.change(&walled(x), &volume);
            cache.fill(32);
            let moving = mean_red(&cache.march());
            [moving, mean_red(&cache.at_rest(2, 16).mean)]
        });
        println!("scale {scale}: {left:?} on the left, {right:?} on the right");
        assert!(right[0] < 1e-3 * left[0], "{right:?} of {left:?}");
        assert!((left[0] - left[1]).abs() < 0.03 * left[1], "{left:?}");
    }
}

/// A ball in a medium that weakens the sky's light, seen from within: surfaces that stop no light have the same light on
/// both sides, in motion as well.
#[test]
fn in_motion_a_surface_seen_from_within_has_the_light_around_it() {
    let volume = field([32, 32, 32], [1.0; 3], |p| 16.0 - p.length() as f32);
    let camera = Camera {
        eye: [0.0; 3],
        target: [0.0, 0.0, 1.0],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Perspective { fov_y: 60.0 },
    };
    let mut scene = empty_scene([16, 16], camera);
    scene.medium = Some(uniform_medium(0.03, 0.5, 0.0));
    scene.surfaces.iso = vec![Isosurface {
        color: [0.8; 3],
        ..black(10.0)
    }];
    scene.lights.environment.radiance = [1.0; 3];
    let mut cache = cached(&scene, &volume, 0.5, CacheFormat::F16, 512, 1);
    let moving = mean_red(&cache.march());
    let at_rest = mean_red(&cache.at_rest(4, 16).mean);
    assert!(
        (moving - at_rest).abs() < 0.02 * at_rest,
        "{moving}, not {at_rest}"
    );
}

/// A small surface in a large picture: paths begin in few of its pixels.
#[test]
fn a_surface_in_few_pixels_is_as_bright_as_in_all() {
    const MIDDLE: u32 = 32;
    let volume = field([8, 8, 8], [1.0; 3], |p| 4.0 - p.length() as f32);
    // The middle of the picture, of as many pixels.
    let middle = |size: u32| {
        let camera = Camera {
            eye: [0.0, 0.0, 40.0],
            target: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            projection: Projection::Orthographic {
                height: 5.0 * f64::from(size) / f64::from(MIDDLE),
            },
        };
        let mut scene = empty_scene([size, size], camera);
        scene.medium = Some(uniform_medium(0.01, 0.9, 0.0));
        scene.surfaces.iso = vec![Isosurface {
            color: [1.0; 3],
            ..black(2.0)
        }];
        scene.lights.environment.radiance = [1.0; 3];
        let mut cache = cached(&scene, &volume, 0.5, CacheFormat::F16, 64, 1);
        let film = cache.at_rest(1, 1);
        let [size, low] = [size as usize, (size - MIDDLE) as usize / 2];
        let rows = film.mean.chunks(size).skip(low).take(MIDDLE as usize);
        let pixels = rows.flat_map(|row| &row[low..low + MIDDLE as usize]);
        mean_red(&pixels.copied().collect::<Vec<_>>())
    };
    let [in_all, in_few] = [MIDDLE, 2048].map(middle);
    assert!(
        (in_few - in_all).abs() < 0.01 * in_all,
        "{in_few} and {in_all}"
    );
}

/// A ball above a layer of thin medium under a hard sun: the shadow's profile across the layer.
#[test]
fn a_hard_shadow_keeps_its_edge_and_its_depth() {
    let volume = field([48, 24, 48], [1.0; 3], |p| {
        let ball = 4.0 - (p[0].powi(2) + (p[1] - 6.0).powi(2) + p[2].powi(2)).sqrt();
        let layer = if p[1] < -6.0 { 1.0 } else { 0.0 };
        if ball > -1.0 {
            (10.0 + ball) as f32
        } else {
            layer
        }
    });
    let camera = Camera {
        eye: [0.0, -40.0, 0.0],
        target: [0.0; 3],
        up: [0.0, 0.0, 1.0],
        projection: Projection::Orthographic { height: 24.0 },
    };
    let mut scene = empty_scene([48, 48], camera);
    let point = |value, opacity| TransferPoint {
        value,
        opacity,
        color: [0.9; 3],
    };
    scene.medium = Some(Medium::isotropic(
        0.05,
        vec![
            point(0.0, 0.0),
            point(1.0, 1.0),
            point(2.0, 0.0),
            point(3.0, 0.0),
        ],
    ));
    scene.surfaces.light = LightModel::Full;
    scene.surfaces.iso = vec![black(10.0)];
    scene.lights.suns = vec![DirectionalLight {
        direction: [0.0, -1.0, 0.0],
        irradiance: [3.0; 3],
    }];
    let reference = profile(&render(&scene, &volume, 16, 64, 1));
    let lit = reference[9].mean;
    assert!(
        reference[0].mean < 0.2 * lit,
        "there is a shadow: {reference:?}"
    );
    // The layer is three cells thick at scale ½: what scatters in it more than once is rounded off.
    for (scale, bias) in [(1.0, 0.002), (0.5, 0.01)] {
        let mut cache = cached(&scene, &volume, scale, CacheFormat::F16, 256, 2);
        let shadow = profile(&cache.at_rest(16, 64));
        for (ring, (a, b)) in shadow.iter().zip(&reference).enumerate() {
            let (difference, noise) = ((a.mean - b.mean) / lit, a.stderr.hypot(b.stderr) / lit);
            println!("scale {scale}, ring {ring}: {difference:+.4} ± {noise:.4} of the light");
            assert!(difference.abs() <= 4.0 * noise + bias, "{a:?}, not {b:?}");
        }
    }
}

#[derive(Debug)]
struct Ring {
    mean: f64,
    stderr: f64,
}

/// Over rings of equal area.
fn profile(film: &Film) -> Vec<Ring> {
    let side = (film.mean.len() as f64).sqrt() as usize;
    let ring_of = |i: usize| {
        let [x, y] = [i % side, i / side].map(|a| a as f64 + 0.5 - 0.5 * side as f64);
        ((x * x + y * y) / 50.0) as usize
    };
    let ring = |n: usize| {
        let pixels: Vec<usize> = (0..film.mean.len()).filter(|&i| ring_of(i) == n).collect();
        let count = pixels.len() as f64;
        let mean: f64 = pixels.iter().map(|&i| f64::from(film.mean[i][0])).sum();
        let variance: f64 = pixels
            .iter()
            .map(|&i| f64::from(film.stderr[i][0]).powi(2))
            .sum();
        Ring {
            mean: mean / count,
            stderr: variance.sqrt() / count,
        }
    };
    (0..10).map(ring).collect()
}

/// Through a slit that is narrower than the space between the rays that tell what is in sight, a picture sees nodes that have
/// had no path, and must not take their guess for light.
#[test]
fn light_behind_a_slit_that_no_ray_has_found() {
    const DIMS: [u32; 3] = [128, 128, 64];
    let voxel = |n: u32| match (n % DIMS[0], n / (DIMS[0] * DIMS[1])) {
        (61, 56..58) => 0.2,
        (_, 56..58) => 1.0,
        _ => 0.0,
    };
    let values = (0..DIMS.iter().product()).map(voxel).collect();
    let volume = Volume::from_values(DIMS, [1.0 / 128.0; 3], Voxels::F32(values));
    let volume = volume.expect("a volume");
    let camera = Camera {
        eye: [0.0, 0.0, 2.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height: 1.0 },
    };
    let mut scene = empty_scene([256, 256], camera);
    scene.medium = Some(uniform_medium(3.0, 1.0, 0.0));
    scene.lights.environment.radiance = [1.0; 3];
    scene.surfaces.light = LightModel::Local;
    scene.surfaces.iso = vec![Isosurface {
        color: [1.0; 3],
        ..black(0.5)
    }];
    let mut cached = cached(&scene, &volume, 0.5, CacheFormat::F32, 0, 1);
    cached.fill(8);
    let through_slit = |film: Film| {
        let pixels = film.mean.chunks_exact(256).flat_map(|row| &row[122..124]);
        mean_red(&pixels.copied().collect::<Vec<_>>())
    };
    let uncached = through_slit(render(&scene, &volume, 4, 8, 3));
    let found = through_slit(cached.at_rest(4, 8));
    println!("through the slit: {found:.4}, without a cache {uncached:.4}");
    assert!((found / uncached - 1.0).abs() < 0.01, "{found}, {uncached}");
}
