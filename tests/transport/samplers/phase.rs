//! Henyey–Greenstein: cosines, density, and random walks.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::statistics::{assert_fits, assert_mean};
use super::*;

const HARD: [f32; 10] = [-0.99, -0.9, -0.5, 0.0, 1e-6, 1e-4, 0.5, 0.9, 0.99, 0.9999];
const SAMPLES: usize = 1 << 20;

const PHASE: Shader = Shader {
    name: "phase",
    text: include_str!("../../support/glsl/phase.comp"),
    uses: &["scene_block"],
};

/// Exact, in double precision, for |g|: x = 1 − the cosine from the lobe's axis, which is the direction before or, where
/// g < 0, the one opposite to it.
#[derive(Clone, Copy)]
struct Exact(f64);

impl Exact {
    fn new(g: f32) -> Exact {
        Exact(f64::from(g).abs())
    }

    /// 1 + g² − 2g·cosine.
    fn squared(self, x: f64) -> f64 {
        (1.0 - self.0).powi(2) + 2.0 * self.0 * x
    }

    fn density(self, x: f64) -> f64 {
        (1.0 - self.0.powi(2)) / (4.0 * PI * self.squared(x).powf(1.5))
    }

    /// Probability of a smaller x.
    fn below(self, x: f64) -> f64 {
        let (g, cosine) = (self.0, 1.0 - x);
        if g < 1e-3 {
            // (1 − μ)/2 + (1 − μ²)·(3g + 5g²μ)/4 + …
            return 0.5 * x + 0.25 * x * (2.0 - x) * (3.0 * g + 5.0 * g * g * cosine);
        }
        1.0 - (1.0 - g * g) / (2.0 * g) * (self.squared(x).sqrt().recip() - (1.0 + g).recip())
    }

    /// The x that a sample has at least with the probability `u`.
    fn quantile(self, u: f64) -> f64 {
        let g = self.0;
        let q = (1.0 - g) / (1.0 - g + 2.0 * g * u);
        2.0 * (1.0 - u) * (1.0 + g * u) * q * q
    }
}

fn with_g(probe: &mut Probe, g: f32) {
    probe.constants.g = g;
    probe.features.is_anisotropic = g != 0.0;
}

const ASKED: PhaseInput = PhaseInput {
    word: 0,
    x: 0.0,
    before: [0.0, 0.0, 1.0],
    after: [0.0, 0.0, 1.0],
};

fn run(probe: &mut Probe, inputs: &[PhaseInput]) -> Vec<PhaseOutput> {
    let push = CountPush {
        count: inputs.len() as u32,
    };
    probe.run(&PHASE, &push, inputs, inputs.len(), inputs.len())
}

#[test]
fn samples_follow_the_exact_distribution() {
    const BINS: usize = 256;
    let mut probe = probe(&scene());
    let mut random = fastrand::Rng::with_seed(1);
    for g in HARD {
        with_g(&mut probe, g);
        let inputs: Vec<PhaseInput> = (0..SAMPLES)
            .map(|_| PhaseInput {
                word: random.u32(..),
                ..ASKED
            })
            .collect();
        let outputs = run(&mut probe, &inputs);
        let xs = || outputs.iter().map(|output| f64::from(output.x));
        assert_mean(&format!("g = {g}"), xs(), 1.0 - f64::from(g.abs()));
        let exact = Exact::new(g);
        // Bins of equal probability, in ascending order of x.
        let edge = |i: usize| exact.quantile(1.0 - i as f64 / BINS as f64);
        let edges: Vec<f64> = (1..BINS).map(edge).collect();
        let mut bins = vec![(0.0, SAMPLES as f64 / BINS as f64); BINS];
        for x in xs() {
            bins[edges.partition_point(|&edge| edge < x)].0 += 1.0;
        }
        assert_fits(&format!("g = {g}"), &bins);
    }
}

#[test]
fn the_density_is_the_distributions_derivative() {
    let mut probe = probe(&scene());
    for g in HARD {
        with_g(&mut probe, g);
        let exact = Exact::new(g);
        // Uniform, and as the distribution has them.
        let nodes = (0..=4000).map(|i| i as f64 / 4000.0);
        let inputs: Vec<PhaseInput> = nodes
            .flat_map(|u| [2.0 * u, exact.quantile(u)])
            .map(|x| PhaseInput {
                x: x as f32,
                ..ASKED
            })
            .collect();
        for (input, output) in inputs.iter().zip(run(&mut probe, &inputs)) {
            let expected = exact.density(input.x.into());
            let error = f64::from(output.density) / expected - 1.0;
            assert!(error.abs() < 2e-6, "g = {g}, {}: {error:e} off", input.x);
        }
    }
    // And the formula that it was compared with is the derivative of the one for the distribution.
    for g in HARD {
        let exact = Exact::new(g);
        for i in 1..100 {
            let (x, h) = (f64::from(i) / 50.0, 1e-5);
            let slope = (exact.below(x + h) - exact.below(x - h)) / (2.0 * h);
            let error = slope / (2.0 * PI * exact.density(x)) - 1.0;
            assert!(error.abs() < 1e-4, "g = {g}, {x}: {error:e}");
        }
    }
}

/// Of directions that are rounded, as light and paths have them. Their cosine has too few digits for a narrow lobe.
#[test]
fn the_density_between_directions_is_exact_in_the_narrowest_lobe() {
    const PAIRS: usize = 1 << 14;
    let mut probe = probe(&scene());
    let mut random = fastrand::Rng::with_seed(2);
    for g in HARD {
        with_g(&mut probe, g);
        let exact = Exact::new(g);
        let mut normal = || {
            let (radius, turn) = (
                (-2.0 * (1.0 - random.f64()).ln()).sqrt(),
                2.0 * PI * random.f64(),
            );
            radius * turn.cos()
        };
        let mut direction = || DVec3::new(normal(), normal(), normal()).normalize();
        let inputs: Vec<PhaseInput> = (0..PAIRS)
            .map(|i| {
                let before = direction();
                let x = exact.quantile((i as f64 + 0.5) / PAIRS as f64);
                let across = before.cross(direction()).normalize();
                let axis = if g < 0.0 { -before } else { before };
                let after = (1.0 - x) * axis + (x * (2.0 - x)).sqrt() * across;
                let [before, after] = [before, after].map(|d| d.as_vec3().to_array());
                PhaseInput {
                    before,
                    after,
                    ..ASKED
                }
            })
            .collect();
        for (input, output) in inputs.iter().zip(run(&mut probe, &inputs)) {
            let [before, after] =
                [input.before, input.after].map(|d| Vec3::from(d).as_dvec3().normalize());
            let axis = if g < 0.0 { -before } else { before };
            let expected = exact.density(0.5 * (axis - after).length_squared());
            let error = f64::from(output.between) / expected - 1.0;
            assert!(error.abs() < 1e-5, "g = {g}, {input:?}: {error:e} off");
        }
    }
}

/// Over the sphere.
#[test]
fn the_density_integrates_to_one() {
    const NODES: usize = 1 << 16;
    let mut probe = probe(&scene());
    for g in HARD {
        with_g(&mut probe, g);
        let inputs: Vec<PhaseInput> = (0..=NODES)
            .map(|i| i as f64 / NODES as f64)
            .map(|u| PhaseInput {
                x: Exact::new(g).quantile(1.0 - u) as f32,
                ..ASKED
            })
            .collect();
        let outputs = run(&mut probe, &inputs);
        let trapezium = |i: usize| {
            let width = f64::from(inputs[i + 1].x) - f64::from(inputs[i].x);
            let height = f64::from(outputs[i].density) + f64::from(outputs[i + 1].density);
            0.5 * width * height
        };
        let integral = 2.0 * PI * (0..NODES).map(trapezium).sum::<f64>();
        assert!((integral - 1.0).abs() < 1e-5, "g = {g}: {integral}");
    }
}

#[test]
fn random_walks_come_as_far_as_they_should() {
    let walk = Shader {
        name: "walk",
        text: include_str!("../../support/glsl/walk.comp"),
        uses: &["scene_block"],
    };
    let mut probe = probe(&scene());
    for (g, flights, expected, walks) in
        [(0.5, 10, 36.0039, 1 << 20), (0.9, 100, 1820.005, 1 << 18)]
    {
        with_g(&mut probe, g);
        let inputs: Vec<Stream> = (0..walks)
            .map(|pixel| Stream {
                pixel,
                sample_index: 0,
                dimension: 0,
            })
            .collect();
        let push = WalkPush {
            count: walks,
            flights,
        };
        let ends: Vec<Displacement> =
            probe.run(&walk, &push, &inputs, walks as usize, walks as usize);
        let squares = ends.iter().map(|end| f64::from(end.squared));
        assert_mean(&format!("g = {g}, {flights} flights"), squares, expected);
    }
}
