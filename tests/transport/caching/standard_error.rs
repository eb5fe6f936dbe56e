//! The standard error of marched samples, which are spread evenly, is the one that they have.

use isolume::render::{Film, Sums, Totals, Until};
use isolume::scene::volume::Volume;
use isolume::scene::*;

use crate::support::common::*;
use crate::support::fields::indexed_field;

const SAMPLES: u32 = 64;

/// Bumps of a few voxels, whose edges are most of a picture's noise.
fn bumps() -> Volume {
    indexed_field([24; 3], [1.0; 3], |voxel| {
        let [x, y, z] = voxel.map(|n| n as f32);
        (1.1 * x).sin() + (0.9 * y + 1.0).sin() + (0.8 * z).cos()
    })
}

/// Of the picture of samples that begin at `first`, all of which read the same cache, its own sums.
fn sums(cache: &mut Cached, first: u32) -> (Sums, Totals) {
    cache.renderer.begin_at_sample(first);
    assert!(cache.renderer.unit(SAMPLES, Until::NEVER).expect("a unit"));
    let sums = cache.renderer.sums().expect("sums");
    (sums, cache.renderer.totals())
}

#[test]
fn two_pictures_differ_by_the_errors_that_they_report() {
    let camera = Camera {
        eye: [0.0, 0.0, 60.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height: 26.0 },
    };
    let mut scene = empty_scene([64, 64], camera);
    scene.medium = Some(uniform_medium(0.01, 0.9, 0.0));
    scene.surfaces.iso = vec![Isosurface {
        value: 1.0,
        opacity: 1.0,
        color: [0.8; 3],
        shading: Shading::Lambert,
    }];
    scene.lights.suns = vec![DirectionalLight {
        direction: [0.5, -0.5, -1.0],
        irradiance: [2.0; 3],
    }];
    scene.lights.environment.radiance = [0.3; 3];
    let mut cache = cached(&scene, &bumps(), 0.5, CacheFormat::F16, 32, 1);
    let pictures = [0, SAMPLES].map(|first| sums(&mut cache, first));
    assert_silent(&cache.device);

    let squared = |x: &[f32]| x.iter().map(|&x| f64::from(x).powi(2)).sum::<f64>();
    let [(a, _), (b, _)] = &pictures;
    let apart = a.mean.iter().zip(&b.mean);
    let apart: f64 = apart
        .map(|(a, b)| squared(&[a[0] - b[0], a[1] - b[1], a[2] - b[2]]))
        .sum();
    let expected = |halves: bool| -> f64 {
        let variance = pictures.iter().map(|(sums, totals)| {
            let mut sums = sums.clone();
            sums.halves.take_if(|_| !halves);
            let errors = sums.standard_error(totals.samples, totals.units, 0.0);
            squared(errors.as_flattened())
        });
        variance.sum()
    };
    let (reported, by_spread) = (apart / expected(true), apart / expected(false));
    println!(
        "squared differences are {reported:.2} of what is reported, {by_spread:.2} of the spread"
    );
    assert!((0.5..1.15).contains(&reported), "{reported}");
    assert!(
        by_spread < 0.5,
        "samples are not spread evenly: {by_spread}"
    );
}

/// Most nodes that a ray passes are at the rim of this medium, and no picture at rest reads them.
#[test]
fn nodes_that_no_picture_reads_have_no_part_in_its_error() {
    const PICTURES: u32 = 4;
    let camera = Camera {
        eye: [12.0, 9.0, 40.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height: 26.0 },
    };
    let mut scene = empty_scene([32, 32], camera);
    scene.medium = Some(uniform_medium(1.0, 0.9, 0.0));
    scene.lights.suns = vec![DirectionalLight {
        direction: [0.3, -0.4, 1.0],
        irradiance: [2.0; 3],
    }];
    let volume = constant_field(1.0, [16; 3], [1.0; 3]);
    let mut cache = cached(&scene, &volume, 0.5, CacheFormat::F16, 1, 0);
    let films: Vec<_> = (0..PICTURES)
        .map(|seed| {
            cache.reseed(seed);
            cache.fill(32);
            cache.at_rest(1, 128)
        })
        .collect();
    let mean = |of: &dyn Fn(&Film) -> f64| films.iter().map(of).sum::<f64>() / f64::from(PICTURES);
    let pixels = films[0].mean.len();
    let spread: f64 = (0..pixels)
        .map(|pixel| {
            let green = |film: &Film| f64::from(film.mean[pixel][1]);
            let middle = mean(&green);
            mean(&|film| (green(film) - middle).powi(2))
        })
        .sum();
    let spread = spread * f64::from(PICTURES) / f64::from(PICTURES - 1);
    let reported = mean(&|film| {
        let green = film.stderr.iter().map(|error| f64::from(error[1]).powi(2));
        green.sum()
    });
    let ratio = (spread / reported).sqrt();
    println!("the error is {ratio:.2} of what is reported");
    assert!((0.75..1.25).contains(&ratio), "{ratio}");
}
