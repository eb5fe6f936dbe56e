//! In an anisotropic medium the cache holds the direction of light as well, for each colour.

use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

use super::rim::{full, scene, sum, sun};
use crate::support::common::*;

/// Independent voxels, blurred over their neighbours.
fn lumps() -> Volume {
    let mut noise = fastrand::Rng::with_seed(1);
    let mut values: Vec<f32> = (0..32 * 32 * 32).map(|_| noise.f32()).collect();
    for stride in [1, 32, 1024] {
        for _ in 0..2 {
            let old = values.clone();
            let count = old.len();
            for (i, value) in values.iter_mut().enumerate() {
                let [before, after] = [count - stride, stride].map(|step| old[(i + step) % count]);
                *value = 0.25 * before + 0.5 * old[i] + 0.25 * after;
            }
        }
    }
    Volume::from_values([32; 3], [1.0; 3], Voxels::F32(values)).expect("a volume")
}

/// Deep in the lumps there is next to no light.
#[test]
fn an_anisotropic_medium_has_finite_light() {
    let volume = lumps();
    for g in [-0.5, 0.5] {
        let mut scene = scene(1.0);
        let point = |value: f64, opacity: f64| TransferPoint {
            value,
            opacity,
            color: [0.75, 0.36, 0.97],
        };
        scene.medium = Some(Medium {
            g,
            ..Medium::isotropic(10.0, vec![point(0.45, 0.0), point(0.55, 1.0)])
        });
        scene.lights.suns = vec![sun([0.3, -0.8, -0.52])];
        let mut cache = cached(&scene, &volume, 1.0, CacheFormat::F32, 1, 0);
        for seed in 1..=4 {
            cache.reseed(seed);
            cache.fill(8);
            let in_motion = cache.march();
            let film = cache.at_rest(1, 16);
            let mut channels = in_motion.iter().chain(&film.mean).flatten();
            assert!(channels.all(|x| x.is_finite()), "g = {g}, seed {seed}");
        }
    }
}

/// Red light comes from below, green from everywhere, and the medium absorbs most of the blue. If all channels had the
/// direction of their mean, they would be off by several percent in motion.
#[test]
fn each_color_has_its_own_direction() {
    for g in [0.1, -0.4] {
        let mut scene = scene(0.2);
        let medium = scene.medium.as_mut().expect("a medium");
        medium.g = g;
        medium.transfer[0].color = [0.99, 0.8, 0.3];
        scene.lights.suns = vec![DirectionalLight {
            irradiance: [3.0, 0.5, 1.0],
            ..sun([-0.4, 0.9, 0.2])
        }];
        scene.lights.environment.radiance = [0.2, 0.6, 0.2];
        let volume = full();
        let mut cache = cached(&scene, &volume, 1.0, CacheFormat::F16, 1, 0);
        let sums = |picture: &[[f32; 4]]| {
            [0, 1, 2].map(|c| picture.iter().map(|pixel| f64::from(pixel[c])).sum::<f64>())
        };
        let (mut reference, mut at_rest, mut in_motion) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        let films = render_seeds(&scene, &volume, 256, 101..=104);
        for (seed, film) in (1..).zip(films) {
            cache.reseed(seed);
            cache.fill(256);
            let pictures = [
                (&mut reference, film.mean),
                (&mut at_rest, cache.at_rest(1, 64).mean),
                (&mut in_motion, cache.march()),
            ];
            for (sum, picture) in pictures {
                let more = sums(&picture);
                *sum = [0, 1, 2].map(|c| sum[c] + more[c]);
            }
        }
        let percent = |sum: [f64; 3]| [0, 1, 2].map(|c| 100.0 * (sum[c] / reference[c] - 1.0));
        let [at_rest, in_motion] = [at_rest, in_motion].map(percent);
        println!("g = {g}: {at_rest:+.2?} %, in motion {in_motion:+.2?} %");
        assert!(at_rest.iter().all(|error| error.abs() < 0.5));
        assert!(in_motion.iter().all(|error| error.abs() < 1.5));
    }
}

/// Two moments of the light do not tell what a phase function makes of a sky that is bright in one place.
#[test]
fn a_bright_spot_of_the_sky_is_scattered_as_a_sun_is() {
    let mut scene = scene(0.02);
    scene.medium.as_mut().expect("a medium").g = -0.15;
    scene.lights.environment.image = Some(spot());
    let volume = full();
    let mut cache = cached(&scene, &volume, 1.0, CacheFormat::F32, 64, 1);
    let uncached = render_seeds(&scene, &volume, 256, [101]).remove(0);
    let percent = |picture: &[[f32; 4]]| 100.0 * (sum(picture) / sum(&uncached.mean) - 1.0);
    let in_motion = percent(&cache.march());
    let at_rest = percent(&cache.at_rest(16, 16).mean);
    println!("a bright spot of the sky: {at_rest:+.2} %, in motion {in_motion:+.2} %");
    assert!(at_rest.abs() < 0.8, "{at_rest:+.2} %");
    assert!(in_motion.abs() < 12.0, "{in_motion:+.2} %");
}

/// A sky that is black but for one texel, behind what is seen.
fn spot() -> EnvironmentImage {
    let (width, height) = (64, 32);
    let mut texels = vec![[0.0; 3]; width * height];
    texels[20 * width + 30] = [2000.0; 3];
    EnvironmentImage {
        width: width as u32,
        height: height as u32,
        texels: texels.into(),
    }
}
