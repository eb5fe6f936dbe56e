//! BRDFs: the oracle's values, and directions drawn with the density that they are said to have.

use std::f64::consts::{LN_2, PI};

use glam::DVec3;

use super::half_vectors::{Lattice, View, views};
use super::statistics::assert_fits;
use super::*;
use crate::support::oracle::brdf::{clearcoat_alpha, evaluate, sample, specular_alpha};
use crate::support::oracle::random::Random;

const BRDF: Shader = Shader {
    name: "brdf",
    text: include_str!("../../support/glsl/brdf.comp"),
    uses: &["scene_block", "volume", "clips", "ranges", "surfaces"],
};

const SAMPLES: usize = 1 << 17;

/// What rounding to single precision changes a number by, relatively.
const ROUNDING: f64 = 0.5 * f32::EPSILON as f64;

const COLOR: [f64; 3] = [0.9, 0.5, 0.2];

fn materials() -> Vec<Isosurface> {
    let phong = |specular, shininess| Shading::Phong {
        specular,
        shininess,
    };
    let disney = |metallic, roughness, clearcoat, clearcoat_gloss, rest| {
        Shading::Disney(Disney {
            metallic,
            roughness,
            specular: 0.5,
            specular_tint: rest,
            sheen: rest,
            sheen_tint: 0.5,
            subsurface: rest,
            clearcoat,
            clearcoat_gloss,
        })
    };
    let shadings = [
        Shading::Lambert,
        phong(0.3, 1.0),
        phong(0.5, 32.0),
        phong(1.0, 5.5),
        phong(0.9, 1000.0),
        phong(0.9, 1e6),
        disney(0.0, 0.5, 0.0, 0.0, 0.0),
        disney(0.0, 0.05, 0.0, 0.0, 0.7),
        disney(0.0, 1.0, 0.0, 0.0, 1.0),
        disney(1.0, 0.0, 0.0, 0.0, 0.0),
        disney(1.0, 1.0, 0.0, 0.0, 0.0),
        disney(0.3, 0.4, 1.0, 0.0, 0.7),
        disney(0.0, 0.8, 1.0, 1.0, 0.0),
        disney(0.6, 0.05, 0.5, 0.9, 0.2),
    ];
    let material = |(i, shading)| Isosurface {
        value: i as f64,
        opacity: 1.0,
        color: COLOR,
        shading,
    };
    shadings.into_iter().enumerate().map(material).collect()
}

fn probe_of_materials() -> Probe {
    let mut scene = scene();
    scene.surfaces.iso = materials();
    probe(&scene)
}

/// For each of the views.
fn run(probe: &mut Probe, material: usize, inputs: [Vec<BrdfInput>; 3]) -> [Vec<BrdfOutput>; 3] {
    let all = inputs.concat();
    let push = BrdfPush {
        count: all.len() as u32,
        surface: material as u32,
    };
    let mut outputs = probe
        .run(&BRDF, &push, &all, all.len(), all.len())
        .into_iter();
    inputs.map(|i| outputs.by_ref().take(i.len()).collect())
}

/// With the probabilities of its bins.
type Binned<'a> = (Lattice<'a>, Vec<f64>);

fn binned<'a>(probe: &mut Probe, material: usize, iso: &'a Isosurface) -> [Binned<'a>; 3] {
    let lattices = views().map(|view| Lattice::new(view, iso));
    let inputs = lattices.each_ref().map(|lattice| {
        let nodes = lattice.nodes().into_iter();
        nodes
            .map(|node| lattice.view.input(node.0, [0.0; 3]))
            .collect()
    });
    let mut outputs = run(probe, material, inputs).into_iter();
    lattices.map(|lattice| {
        let bins = lattice.integrate(&outputs.next().expect("a view's outputs"));
        (lattice, bins)
    })
}

/// Over all directions, those below the surface included, up to the 1e-4 or so that the midpoint rule
/// and rounding are off.
#[test]
fn densities_integrate_to_one() {
    let mut probe = probe_of_materials();
    for (m, iso) in materials().iter().enumerate() {
        for (lattice, bins) in binned(&mut probe, m, iso) {
            let total: f64 = bins.iter().sum();
            let what = lattice.view.describe(iso);
            assert!((total - 1.0).abs() < 3e-4, "{what}: {total}");
        }
    }
}

#[test]
fn directions_are_drawn_with_their_density() {
    let mut probe = probe_of_materials();
    let mut random = fastrand::Rng::with_seed(10);
    for (m, iso) in materials().iter().enumerate() {
        let binned = binned(&mut probe, m, iso);
        let mut unit = || (random.u32(..) >> 8) as f32 * 2f32.powi(-24);
        let inputs = binned.each_ref().map(|(lattice, _)| {
            let u = (0..SAMPLES).map(|_| [unit(), unit(), unit()]);
            u.map(|u| lattice.view.input(lattice.view.n, u)).collect()
        });
        for ((lattice, probabilities), outputs) in binned.iter().zip(run(&mut probe, m, inputs)) {
            let expected = probabilities.iter().map(|p| SAMPLES as f64 * p);
            let mut bins: Vec<(f64, f64)> = expected.map(|e| (0.0, e)).collect();
            for output in outputs {
                let l = DVec3::from_array(output.sampled.map(f64::from));
                assert!((l.length() - 1.0).abs() < 1e-6, "{l} is not a unit vector");
                bins[lattice.bin(l.normalize())].0 += 1.0;
            }
            assert_fits(&lattice.view.describe(iso), &bins);
        }
    }
}

/// By how much rounding may change a colour channel of the BRDF. What is rounded: inputs, ε in
/// length; dot products, 3ε; a division, 5ε (Vulkan's 2.5 units in the last place).
fn allowed(iso: &Isosurface, view: &View, l: DVec3, value: f64, color: f64) -> f64 {
    if l.dot(view.n) < 0.0 {
        return 0.0;
    }
    match iso.shading {
        Shading::Lambert => 8.0 * ROUNDING * value,
        Shading::Phong {
            specular,
            shininess,
        } => {
            let diffuse = (1.0 - specular) * color / PI;
            let power = power_error(view, l, shininess);
            let share = ROUNDING * color / PI;
            let underflow = (shininess + 2.0) * f64::from(f32::MIN_POSITIVE);
            8.0 * ROUNDING * diffuse + share + power * (value - diffuse) + underflow
        }
        Shading::Disney(d) => value * disney_error(d, view, l),
    }
}

/// Relative error of cos^k. n is off by 4ε, v and l by 2ε each, and the mirrored direction by 9ε. Near it, the power is
/// exp(−k·(x + x²/2 + x³/3)), with half the square of a difference as x = 1 − cos. Elsewhere it is exp2(k·log2 cos); log2
/// near 1 is off by 2⁻²¹ and exp2(y) by 3 + 2|y| units in the last place, as Vulkan has it; products by roundings.
fn power_error(view: &View, l: DVec3, k: f64) -> f64 {
    let cosine = view.mirror().dot(l);
    if cosine <= 0.0 {
        return 0.0;
    }
    let x = 1.0 - cosine;
    let off = 18.0 * ROUNDING;
    let base = if x < 0.009 {
        k * (off * (2.0 * x).sqrt() + off * off + 8.0 * ROUNDING * x + 0.3 * x.powi(4))
    } else {
        k * (off / cosine + LN_2 * 2f64.powi(-21))
    };
    let exponent = (12.0 + 5.0 * k * cosine.log2().abs()) * ROUNDING;
    // Where it is large, there is nothing left to be wrong.
    (base + exponent).min(80.0).exp_m1()
}

/// Relative error of the worst of Disney's terms, none of which is negative.
fn disney_error(disney: Disney, view: &View, l: DVec3) -> f64 {
    let h = (l + view.v).normalize();
    let (n_l, n_v, l_h) = (view.n.dot(l), view.n.dot(view.v), l.dot(h));
    // h has the error of l and v over |l + v| = 2·l·h; then the sum, the norm, and a product with n
    // or l are rounded.
    let angle = (10.0 + 1.0 / l_h) * ROUNDING;
    let cosine = (13.0 + 1.0 / l_h) * ROUNDING;
    // D ∝ (α² + (1 − α²)·sin²)^−power, G ∝ 1/√(α² + (1 − α²)·cos²), and F = F0 + (1 − F0)·m⁵ with
    // 5m⁴/(F0 + m⁵) < 8 for F0 ≥ 0.01. α², π, divisions and products make up the rest.
    let sine = view.n.cross(h).length();
    let lobe = |alpha: f64, masking: f64, power: f64| {
        let root = |alpha: f64, c: f64| c.hypot(alpha * (1.0 - c * c).sqrt());
        let d = (2.0 * sine * angle + angle * angle) / root(alpha, sine).powi(2);
        let g = 5.0 * ROUNDING * (1.0 / root(masking, n_l) + 1.0 / root(masking, n_v));
        power * d + g + 8.0 * cosine + 100.0 * ROUNDING
    };
    let alpha = specular_alpha(disney.roughness);
    let specular = lobe(alpha, alpha, 2.0);
    // The coat's α is a difference from 0.1.
    let coat_alpha = clearcoat_alpha(disney.clearcoat_gloss);
    let coat = lobe(coat_alpha, 0.25, 1.0) + 0.75 * ROUNDING / coat_alpha;
    // Two factors of at least ½ with (1 − n·l)⁵, or with subsurface scattering, 1/(n·l + n·v).
    let sum = n_l + n_v;
    let diffuse =
        (300.0 + 180.0 / sum + 30.0 / (sum * sum)) * ROUNDING + (16.0 + 8.0 / sum) * cosine;
    specular
        .max(diffuse)
        .max(if disney.clearcoat > 0.0 { coat } else { 0.0 })
}

/// Everywhere, below the surface too, and in the lobes.
fn lights(iso: &Isosurface, view: &View, random: &mut Random) -> Vec<DVec3> {
    let mut lights: Vec<DVec3> = (0..10_000).map(|_| random.direction()).collect();
    lights.extend((0..10_000).map(|_| sample(iso, view.n, view.v, random)));
    // Rounding decides whether the others are below the surface, or behind the lobe.
    lights.retain(|l| l.dot(view.n).abs().min(l.dot(view.mirror()).abs()) > 2e-6);
    lights
}

#[test]
fn values_are_the_oracles() {
    let mut probe = probe_of_materials();
    let mut random = Random::new(11, 0);
    for (m, iso) in materials().iter().enumerate() {
        let views = views();
        let lights = views.each_ref().map(|v| lights(iso, v, &mut random));
        let inputs = [0, 1, 2].map(|i| {
            let all = lights[i].iter();
            all.map(|&l| views[i].input(l, [0.0; 3])).collect()
        });
        for (i, outputs) in run(&mut probe, m, inputs).iter().enumerate() {
            for (output, &l) in outputs.iter().zip(&lights[i]) {
                assert_value(iso, &views[i], l, output.value);
            }
        }
    }
}

fn assert_value(iso: &Isosurface, view: &View, l: DVec3, found: [f32; 3]) {
    let exact = evaluate(iso, view.n, view.v, l);
    for channel in 0..3 {
        let error = (f64::from(found[channel]) - exact[channel]).abs();
        let allowed = allowed(iso, view, l, exact[channel], iso.color[channel]);
        assert!(
            error <= allowed,
            "{}, {l}: {found:?} is {error:e} off {exact}, {allowed:e} allowed",
            view.describe(iso)
        );
    }
}
