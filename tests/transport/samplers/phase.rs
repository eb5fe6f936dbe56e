//! Henyey–Greenstein: cosines, density, and random walks.

use std::f64::consts::PI;

use super::statistics::{assert_fits, assert_mean};
use super::*;

const HARD: [f32; 10] = [-0.99, -0.9, -0.5, 0.0, 1e-6, 1e-4, 0.5, 0.9, 0.99, 0.9999];
const SAMPLES: usize = 1 << 20;

const PHASE: Shader = Shader {
    name: "phase",
    text: include_str!("../../support/glsl/phase.comp"),
    uses: &["scene_block"],
};

/// Exact, in double precision.
#[derive(Clone, Copy)]
struct Exact(f64);

impl Exact {
    /// 1 + g² − 2gμ without cancellation.
    fn squared(self, cosine: f64) -> f64 {
        let g = self.0.abs();
        (1.0 - g).powi(2) + 2.0 * g * (1.0 - cosine * self.0.signum())
    }

    fn density(self, cosine: f64) -> f64 {
        (1.0 - self.0.powi(2)) / (4.0 * PI * self.squared(cosine).powf(1.5))
    }

    /// Probability of a smaller cosine.
    fn below(self, cosine: f64) -> f64 {
        let g = self.0;
        if g.abs() < 1e-3 {
            // (1 + μ)/2 − (1 − μ²)·(3g + 5g²μ)/4 + …
            return 0.5 * (1.0 + cosine)
                - 0.25 * (1.0 - cosine * cosine) * (3.0 * g + 5.0 * g * g * cosine);
        }
        (1.0 - g * g) / (2.0 * g) * (self.squared(cosine).sqrt().recip() - (1.0 + g).recip())
    }

    fn quantile(self, u: f64) -> f64 {
        let g = self.0;
        let q = (1.0 - g) / (1.0 - g + 2.0 * g * u);
        1.0 - 2.0 * (1.0 - u) * (1.0 + g * u) * q * q
    }
}

fn with_g(probe: &mut Probe, g: f32) {
    probe.constants.g = g;
    probe.features.is_anisotropic = g != 0.0;
}

fn run(probe: &mut Probe, inputs: &[PhaseInput]) -> Vec<PhaseOutput> {
    let push = CountPush {
        count: inputs.len() as u32,
    };
    probe.run(&PHASE, &push, inputs, inputs.len(), inputs.len())
}

/// Bins of equal probability whose edges lie midway between neighbouring f32 numbers, so that
/// rounding moves no sample to another bin: for g = .9999, half of all cosines round to 1.
fn edges(exact: Exact) -> Vec<f64> {
    const BINS: usize = 256;
    let snapped = |i: usize| {
        let cosine = exact.quantile(i as f64 / BINS as f64) as f32;
        0.5 * (f64::from(cosine) + f64::from(cosine.next_down()))
    };
    let mut edges: Vec<f64> = (1..BINS).map(snapped).collect();
    edges.dedup();
    edges
}

#[test]
fn cosines_follow_the_exact_distribution() {
    let mut probe = probe(&scene());
    let mut random = fastrand::Rng::with_seed(1);
    for g in HARD {
        with_g(&mut probe, g);
        let inputs: Vec<PhaseInput> = (0..SAMPLES)
            .map(|_| PhaseInput {
                word: random.u32(..),
                cosine: 0.0,
            })
            .collect();
        let cosines: Vec<f64> = run(&mut probe, &inputs)
            .iter()
            .map(|o| f64::from(o.cosine))
            .collect();
        assert_mean(&format!("g = {g}"), cosines.iter().copied(), g.into());
        let exact = Exact(g.into());
        let edges = edges(exact);
        assert!(edges.len() > 4, "g = {g} has {} bins", edges.len());
        let mut bins = vec![(0.0, 0.0); edges.len() + 1];
        for cosine in cosines {
            bins[edges.partition_point(|&e| e < cosine)].0 += 1.0;
        }
        for (i, bin) in bins.iter_mut().enumerate() {
            let low = if i == 0 {
                0.0
            } else {
                exact.below(edges[i - 1])
            };
            let high = edges.get(i).map_or(1.0, |&e| exact.below(e));
            bin.1 = SAMPLES as f64 * (high - low);
        }
        assert_fits(&format!("g = {g}"), &bins);
    }
}

#[test]
fn the_density_is_the_distributions_derivative() {
    let mut probe = probe(&scene());
    for g in HARD {
        with_g(&mut probe, g);
        let exact = Exact(g.into());
        // Uniform, and as the distribution has them.
        let nodes = (0..=4000).map(|i| i as f64 / 4000.0);
        let inputs: Vec<PhaseInput> = nodes
            .flat_map(|u| [2.0 * u - 1.0, exact.quantile(u)])
            .map(|cosine| PhaseInput {
                word: 0,
                cosine: cosine as f32,
            })
            .collect();
        for (input, output) in inputs.iter().zip(run(&mut probe, &inputs)) {
            let expected = exact.density(input.cosine.into());
            let error = f64::from(output.density) / expected - 1.0;
            assert!(error.abs() < 2e-6, "g = {g}, {input:?}: {error:e} off");
        }
    }
    // And the formula that it was compared with is the derivative of the one for the distribution.
    for g in HARD {
        let exact = Exact(g.into());
        for i in 1..100 {
            let (cosine, h) = (-1.0 + f64::from(i) / 50.0, 1e-5);
            let slope = (exact.below(cosine + h) - exact.below(cosine - h)) / (2.0 * h);
            let error = slope / (2.0 * PI * exact.density(cosine)) - 1.0;
            assert!(error.abs() < 1e-4, "g = {g}, {cosine}: {error:e}");
        }
    }
}

/// The cosine between two rounded unit vectors may be a little more than 1.
#[test]
fn the_density_is_finite_where_cosines_are_rounded() {
    let mut probe = probe(&scene());
    for g in HARD {
        with_g(&mut probe, g);
        let cosines = [
            1.0,
            1.0 + 4.0 * f32::EPSILON,
            -1.0,
            -1.0 - 4.0 * f32::EPSILON,
        ];
        let inputs = cosines.map(|cosine| PhaseInput { word: 0, cosine });
        let outputs = run(&mut probe, &inputs);
        for pair in outputs.chunks(2) {
            let [exact, rounded] = [pair[0].density, pair[1].density];
            assert!(
                (rounded / exact - 1.0).abs() < 0.01,
                "g = {g}: {rounded}, not {exact}"
            );
        }
    }
}

/// Over the sphere. For g = .9999, single precision has no cosines to integrate over.
#[test]
fn the_density_integrates_to_one() {
    const NODES: usize = 1 << 16;
    let mut probe = probe(&scene());
    for g in HARD.into_iter().filter(|g| g.abs() < 0.999) {
        with_g(&mut probe, g);
        let inputs: Vec<PhaseInput> = (0..=NODES)
            .map(|i| i as f64 / NODES as f64)
            .map(|u| PhaseInput {
                word: 0,
                cosine: Exact(g.into()).quantile(u) as f32,
            })
            .collect();
        let outputs = run(&mut probe, &inputs);
        let trapezium = |i: usize| {
            let width = f64::from(inputs[i + 1].cosine) - f64::from(inputs[i].cosine);
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
