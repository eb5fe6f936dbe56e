//! Deep in a dense medium there is next to no light, and quotients of its moments may overflow.

use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

use super::rim::{scene, sun};
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
            cache.fill(32);
            let film = cache.at_rest(1, 16);
            let mut channels = film.mean.iter().flatten();
            assert!(channels.all(|x| x.is_finite()), "g = {g}, seed {seed}");
        }
    }
}
