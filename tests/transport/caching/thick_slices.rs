//! Slices that are farther apart than their pixels, as in many a CT: between two nodes of the cache, a wall of medium shifts
//! across by many pixels.

use isolume::scene::volume::Volume;
use isolume::scene::*;

use crate::caching::rim::{measure, sum};
use crate::support::common::*;
use crate::support::fields::indexed_field;

const DIMS: [u32; 3] = [128, 128, 16];
const SPACING: [f64; 3] = [1.0, 1.0, 12.0];

/// An ellipsoid of tissue under a skin, with a core of bone, in air; in Hounsfield units.
fn head() -> Volume {
    indexed_field(DIMS, SPACING, |at| {
        let share = |a: usize| (f64::from(at[a]) + 0.5) / f64::from(DIMS[a]) * 2.0 - 1.0;
        let distance = (0..3).map(|a| share(a).powi(2)).sum::<f64>().sqrt() / 0.9;
        match distance {
            ..0.84 => 1100.0,
            ..0.95 => 50.0,
            ..1.0 => -80.0,
            _ => -1000.0,
        }
    })
}

/// A film where air becomes skin, which is dense and takes in a part of the light.
fn scene() -> Scene {
    let camera = Camera {
        eye: [0.0, 0.0, 400.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height: 128.0 },
    };
    let mut scene = empty_scene([32, 32], camera);
    let point = |value, opacity| TransferPoint {
        value,
        opacity,
        color: [0.9, 0.6, 0.5],
    };
    let film = [point(-450.0, 0.0), point(-300.0, 1.0), point(-150.0, 0.03)];
    scene.medium = Some(Medium::isotropic(2.0, film.to_vec()));
    scene.lights.environment.radiance = [1.0; 3];
    scene.render.background = Background::Color([0.0; 3]);
    scene
}

#[test]
fn light_in_a_film_on_a_curved_wall() {
    let (scene, volume) = (scene(), head());
    let films = render_seeds(&scene, &volume, 256, 1..=3);
    let references: Vec<f64> = films.iter().map(|film| sum(&film.mean)).collect();
    let [bias, _, error] = measure(&scene, &volume, 0.5, &references, 32);
    let [percent, error_percent] = [bias, error].map(|x| 100.0 * x);
    println!("thick slices: {percent:+.2} % ± {error_percent:.2}");
    assert!(error < 0.003, "{error}");
    assert!(bias.abs() < 0.008, "{bias}");
}
