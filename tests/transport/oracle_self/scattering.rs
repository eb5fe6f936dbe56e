//! Phase function and BRDFs: normalised, reciprocal, and sampled as they say.

use super::{assert_estimate, estimate};
use crate::support::oracle::brdf::{self, gtr1, gtr2};
use crate::support::oracle::random::Random;
use crate::support::oracle::tracking::{phase, scatter};
use glam::DVec3;
use isolume::scene::{Disney, Isosurface, Shading};
use std::f64::consts::{PI, TAU};

const COLOR: [f64; 3] = [0.9, 0.5, 0.2];

fn materials() -> Vec<Isosurface> {
    let disney = |metallic, roughness, clearcoat, rest| {
        Shading::Disney(Disney {
            metallic,
            roughness,
            specular: 0.5,
            specular_tint: rest,
            sheen: rest,
            sheen_tint: 0.5,
            subsurface: rest,
            clearcoat,
            clearcoat_gloss: 0.2,
        })
    };
    [
        Shading::Lambert,
        Shading::Phong {
            specular: 0.4,
            shininess: 12.0,
        },
        disney(0.0, 0.5, 0.0, 0.0),
        disney(0.3, 0.4, 1.0, 0.7),
        disney(1.0, 0.3, 0.0, 0.0),
    ]
    .map(|shading| Isosurface {
        value: 0.0,
        opacity: 1.0,
        color: COLOR,
        shading,
    })
    .to_vec()
}

/// Uniform on the upper hemisphere.
fn upward(random: &mut Random) -> DVec3 {
    let d = random.direction();
    d.with_y(d.y.abs())
}

fn spherical(cosine: f64, azimuth: f64) -> DVec3 {
    let sine = (1.0 - cosine * cosine).sqrt();
    DVec3::new(sine * azimuth.cos(), cosine, sine * azimuth.sin())
}

/// ∫ over a patch of cosines and azimuths, by midpoints.
fn integral(cosines: (f64, f64), azimuths: (f64, f64), n: usize, f: impl Fn(DVec3) -> f64) -> f64 {
    let (dc, da) = (
        (cosines.1 - cosines.0) / n as f64,
        (azimuths.1 - azimuths.0) / n as f64,
    );
    let node = |i: usize, j: usize| {
        f(spherical(
            cosines.0 + (i as f64 + 0.5) * dc,
            azimuths.0 + (j as f64 + 0.5) * da,
        ))
    };
    (0..n * n).map(|m| node(m / n, m % n)).sum::<f64>() * dc * da
}

/// χ² of counts against expectations, in standard deviations; sparse bins are pooled.
fn chi_squared_excess(bins: &[(f64, f64)]) -> f64 {
    let (dense, sparse): (Vec<_>, Vec<_>) = bins.iter().copied().partition(|b| b.1 >= 10.0);
    let pooled = sparse
        .iter()
        .fold((0.0, 0.0), |sum, b| (sum.0 + b.0, sum.1 + b.1));
    let bins: Vec<_> = dense
        .into_iter()
        .chain((pooled.1 >= 10.0).then_some(pooled))
        .collect();
    let chi: f64 = bins
        .iter()
        .map(|(count, expected)| (count - expected).powi(2) / expected)
        .sum();
    let freedom = bins.len() as f64 - 1.0;
    (chi - freedom) / (2.0 * freedom).sqrt()
}

#[test]
fn the_phase_function_is_sampled_as_it_says() {
    let (samples, bins) = (200_000, 40);
    for g in [-0.99, -0.9, 0.0, 1e-6, 0.5, 0.9, 0.99] {
        let mut random = Random::new(1, 0);
        let mut counts = vec![0.0; bins];
        let axis = DVec3::new(0.6, 0.0, 0.8);
        let (mean, stderr) = estimate(samples, || {
            let cosine = scatter(g, axis, &mut random).dot(axis);
            counts[(cosine.acos() / PI * bins as f64) as usize] += 1.0;
            cosine
        });
        assert!(
            (mean - g).abs() < 4.0 * stderr,
            "g {g}: mean cosine {mean} ± {stderr}"
        );
        // Bins of equal angle, since that is where a sharp lobe is wide.
        let share = |bin: usize| {
            let steps = 500;
            let width = PI / (bins * steps) as f64;
            let angle = |m: usize| ((bin * steps + m) as f64 + 0.5) * width;
            let density = |m: usize| TAU * angle(m).sin() * phase(g, angle(m).cos());
            width * (0..steps).map(density).sum::<f64>()
        };
        let bins: Vec<(f64, f64)> = (0..bins)
            .map(|n| (counts[n], samples as f64 * share(n)))
            .collect();
        let total: f64 = bins.iter().map(|b| b.1).sum::<f64>() / samples as f64;
        assert!((total - 1.0).abs() < 1e-4, "g {g}: ∫ phase = {total}");
        assert!(
            chi_squared_excess(&bins) < 4.5,
            "g {g}: {}",
            chi_squared_excess(&bins)
        );
    }
}

#[test]
fn brdfs_are_reciprocal() {
    let mut random = Random::new(2, 0);
    for iso in materials() {
        for _ in 0..1000 {
            let (a, b) = (upward(&mut random), upward(&mut random));
            let (f, r) = (
                brdf::evaluate(&iso, DVec3::Y, a, b),
                brdf::evaluate(&iso, DVec3::Y, b, a),
            );
            assert!(
                f.distance(r) <= 1e-12 * f.length(),
                "{:?}: {f} {r}",
                iso.shading
            );
        }
    }
}

#[test]
fn brdf_samples_follow_their_density() {
    let (rows, columns, samples) = (12, 24, 200_000);
    for (m, iso) in materials().iter().enumerate() {
        let outgoing = spherical(0.6, 1.0);
        let mut random = Random::new(3, m as u64);
        let mut counts = vec![0.0; rows * columns];
        let mut below = 0.0;
        for _ in 0..samples {
            let d = brdf::sample(iso, DVec3::Y, outgoing, &mut random);
            if d.y <= 0.0 {
                below += 1.0;
                continue;
            }
            let azimuth = d.z.atan2(d.x).rem_euclid(TAU);
            let row = ((d.y * rows as f64) as usize).min(rows - 1);
            let column = ((azimuth / TAU * columns as f64) as usize).min(columns - 1);
            counts[row * columns + column] += 1.0;
        }
        let mut bins: Vec<(f64, f64)> = (0..rows * columns)
            .map(|n| {
                let (row, column) = ((n / columns) as f64, (n % columns) as f64);
                let cosines = (row / rows as f64, (row + 1.0) / rows as f64);
                let azimuths = (
                    TAU * column / columns as f64,
                    TAU * (column + 1.0) / columns as f64,
                );
                let density = |d| brdf::density(iso, DVec3::Y, outgoing, d);
                (
                    counts[n],
                    samples as f64 * integral(cosines, azimuths, 48, density),
                )
            })
            .collect();
        let above: f64 = bins.iter().map(|b| b.1).sum();
        bins.push((below, samples as f64 - above));
        let excess = chi_squared_excess(&bins);
        assert!(excess < 4.5, "{:?}: {excess}", iso.shading);
    }
}

/// Lobe-sampled against quadrature, for light from many directions and grazing ones.
#[test]
fn sampled_albedos_agree_with_quadrature() {
    for iso in materials() {
        for cosine in [1.0, 0.6, 0.2] {
            let outgoing = spherical(cosine, 1.0);
            let response = |d: DVec3| brdf::evaluate(&iso, DVec3::Y, outgoing, d) * d.y;
            let exact = integral((0.0, 1.0), (0.0, TAU), 800, |d| response(d).y);
            let mut random = Random::new(4, 0);
            let (mean, stderr) = estimate(1_500_000, || {
                let d = brdf::sample(&iso, DVec3::Y, outgoing, &mut random);
                if d.y <= 0.0 {
                    return 0.0;
                }
                response(d).y / brdf::density(&iso, DVec3::Y, outgoing, d)
            });
            assert_estimate(mean, stderr, exact);
        }
    }
}

#[test]
fn phong_reflects_its_two_albedos_along_the_normal() {
    let iso = &materials()[1];
    let exact = 0.6 * DVec3::from(COLOR) + 0.4;
    let albedo = integral((0.0, 1.0), (0.0, TAU), 800, |d| {
        brdf::evaluate(iso, DVec3::Y, DVec3::Y, d).x * d.y
    });
    assert!((albedo - exact.x).abs() < 1e-5);
}

/// ∫ D cos = 1, in closed form for both and here by quadrature in the cosine.
#[test]
fn microfacet_distributions_are_normalised() {
    let total = |d: &dyn Fn(f64) -> f64| {
        let n = 400_000;
        // u³ crowds the nodes where a sharp lobe has its peak.
        let node = |m: usize| (m as f64 + 0.5) / n as f64;
        let piece = |u: f64| {
            let cosine = 1.0 - u * u * u;
            TAU * d(cosine) * cosine * 3.0 * u * u / n as f64
        };
        (0..n).map(|m| piece(node(m))).sum::<f64>()
    };
    for alpha in [1e-3, 0.04, 0.25, 0.9] {
        assert!(
            (total(&|c| gtr1(c, alpha)) - 1.0).abs() < 1e-4,
            "GTR1 {alpha}"
        );
        assert!(
            (total(&|c| gtr2(c, alpha)) - 1.0).abs() < 1e-4,
            "GTR2 {alpha}"
        );
    }
}

/// By hand, where all but one of Disney's terms vanish.
#[test]
fn disneys_terms_have_their_values() {
    let disney = |metallic, specular, sheen, subsurface, clearcoat| Isosurface {
        value: 0.0,
        opacity: 1.0,
        color: [0.5; 3],
        shading: Shading::Disney(Disney {
            metallic,
            roughness: 0.5,
            specular,
            specular_tint: 0.0,
            sheen,
            sheen_tint: 0.0,
            subsurface,
            clearcoat,
            clearcoat_gloss: 0.0,
        }),
    };
    let along_normal = |iso: Isosurface| brdf::evaluate(&iso, DVec3::Y, DVec3::Y, DVec3::Y).x;
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12 * b, "{a}, by hand {b}");
    let lambert = 0.5 / PI;
    close(along_normal(disney(0.0, 0.0, 0.0, 0.0, 0.0)), lambert);
    // Flat: 1.25·(1·(½ − ½) + ½).
    close(
        along_normal(disney(0.0, 0.0, 0.0, 1.0, 0.0)),
        0.625 * lambert,
    );
    // D = 1/(πα²) with α = ¼, G/(4·n·l·n·v) = ¼.
    close(
        along_normal(disney(1.0, 0.0, 0.0, 0.0, 0.0)),
        0.5 * 16.0 / PI / 4.0,
    );
    close(
        along_normal(disney(0.0, 1.0, 0.0, 0.0, 0.0)),
        lambert + 0.08 * 16.0 / PI / 4.0,
    );
    // D = (1 − 1/α²)/(π ln α²) with α = 0.1.
    let coat = 0.25 * 0.04 * -99.0 / (PI * 0.01_f64.ln()) / 4.0;
    close(
        along_normal(disney(0.0, 0.0, 0.0, 0.0, 1.0)),
        lambert + coat,
    );
    // 60° either side of the normal: l·h = ½, so each Fresnel factor is 2⁻⁵ and F90 = ½ + 2·¼·½.
    let (l, v) = (spherical(0.5, 0.0), spherical(0.5, PI));
    let slope = 1.0 - 0.25 / 32.0;
    let matte = disney(0.0, 0.0, 1.0, 0.0, 0.0);
    let smith = 1.0 / (0.5 + (0.0625 + 0.25 - 0.0625 * 0.25_f64).sqrt());
    let specular = 16.0 / PI * smith * smith / 32.0;
    close(
        brdf::evaluate(&matte, DVec3::Y, v, l).x,
        lambert * slope * slope + 1.0 / 32.0 + specular,
    );
}
