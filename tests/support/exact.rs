//! A picture against numbers known in closed form: samples are added until the standard error is
//! small enough for a comparison to mean something, and only then compared.

use std::sync::Arc;

use isolume::gpu::{Device, Memory};
use isolume::render::{GpuScene, Renderer, Until};
use isolume::scene::Scene;
use isolume::scene::volume::Volume;

use super::common::{BUDGET, assert_silent, device};

/// The spread of fewer unit means says too little about the error of their mean.
const FEWEST_UNITS: usize = 64;
/// A comparison that needs more is inconclusive, which is a failure.
const MOST_UNITS: usize = 4096;

/// A mean and its standard error.
#[derive(Debug, Clone, Copy)]
pub struct Estimate {
    pub mean: f64,
    pub stderr: f64,
}

impl Estimate {
    fn of(units: impl ExactSizeIterator<Item = f64> + Clone) -> Estimate {
        let n = units.len() as f64;
        let mean = units.clone().sum::<f64>() / n;
        let squares: f64 = units.map(|x| (x - mean).powi(2)).sum();
        Estimate {
            mean,
            stderr: (squares / (n - 1.0) / n).sqrt(),
        }
    }

    pub fn is_conclusive(&self, exact: f64) -> bool {
        self.stderr <= (1e-3 * exact.abs()).max(2e-4)
    }

    pub fn agrees(&self, exact: f64) -> bool {
        (self.mean - exact).abs() <= 4.0 * self.stderr + 2e-4 * exact.abs()
    }
}

/// A picture in the making, cut into vertical strips of equal width.
pub struct Strips {
    device: Arc<Device>,
    renderer: Renderer,
    /// Of each pixel in a unit.
    samples: u32,
    width: usize,
    strips: usize,
    /// Per unit and strip, the mean of the unit's samples.
    units: Vec<Vec<[f64; 3]>>,
    /// Per strip, the sum of `units`.
    sums: Vec<[f64; 3]>,
}

impl Strips {
    pub fn new(scene: &Scene, volume: &Volume, strips: usize, samples: u32) -> Strips {
        let device = device();
        let memory = Memory::new(&device, BUDGET).expect("memory");
        let width = scene.render.size[0] as usize;
        let scene = GpuScene::new(scene, volume, seed_of(scene));
        let renderer = Renderer::new(&memory, volume, scene).expect("a renderer");
        assert_eq!(width % strips, 0, "strips of equal width");
        Strips {
            device,
            renderer,
            samples,
            width,
            strips,
            units: Vec::new(),
            sums: vec![[0.0; 3]; strips],
        }
    }

    /// Adds units until `enough` says so.
    pub fn render_until(&mut self, enough: impl Fn(&Strips) -> bool) {
        while self.units.len() < FEWEST_UNITS || !enough(self) && self.units.len() < MOST_UNITS {
            self.add_unit();
        }
        assert_silent(&self.device);
    }

    /// Of a quantity that is a function of a strip's colour.
    pub fn estimate(&self, strip: usize, quantity: impl Fn([f64; 3]) -> f64 + Copy) -> Estimate {
        Estimate::of(self.units.iter().map(|strips| quantity(strips[strip])))
    }

    fn add_unit(&mut self) {
        assert!(
            self.renderer
                .unit(self.samples, Until::NEVER)
                .expect("a unit")
        );
        let film = self.renderer.film().expect("a film");
        let n = (self.units.len() + 1) as f64;
        let mut means = vec![[0.0; 3]; self.strips];
        for (i, pixel) in film.mean.iter().enumerate() {
            let strip = i % self.width * self.strips / self.width;
            for c in 0..3 {
                means[strip][c] += f64::from(pixel[c]);
            }
        }
        let pixels = (film.mean.len() / self.strips) as f64;
        let unit = means.iter().zip(&mut self.sums).map(|(total, sum)| {
            let unit = std::array::from_fn(|c| n * total[c] / pixels - sum[c]);
            *sum = std::array::from_fn(|c| sum[c] + unit[c]);
            unit
        });
        self.units.push(unit.collect());
    }
}

/// Another one for every scene: a seed shared by all tests would share its luck with them (FNV-1a).
fn seed_of(scene: &Scene) -> u32 {
    let text = format!("{scene:?}");
    let mix = |hash: u32, byte: u8| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193);
    text.bytes().fold(0x811c_9dc5, mix)
}

/// Compares the mean over the picture.
pub fn expect(what: &str, scene: &Scene, volume: &Volume, exact: [f64; 3]) {
    expect_strips(what, scene, volume, &[exact]);
}

/// Compares the means over vertical strips, as many as there are `exact` colours.
pub fn expect_strips(what: &str, scene: &Scene, volume: &Volume, exact: &[[f64; 3]]) {
    const SAMPLES: u32 = 8;
    let mut strips = Strips::new(scene, volume, exact.len(), SAMPLES);
    let estimates = |strips: &Strips| -> Vec<(Estimate, f64)> {
        let each = |i: usize| {
            (
                strips.estimate(i / 3, |rgb| rgb[i % 3]),
                exact[i / 3][i % 3],
            )
        };
        (0..3 * exact.len()).map(each).collect()
    };
    strips.render_until(|strips| {
        let estimates = estimates(strips);
        estimates
            .iter()
            .all(|(estimate, exact)| estimate.is_conclusive(*exact))
    });
    for (i, (estimate, exact)) in estimates(&strips).into_iter().enumerate() {
        let channel = ["red", "green", "blue"][i % 3];
        verdict(
            &format!("{what}, strip {}, {channel}", i / 3),
            estimate,
            exact,
        );
    }
}

pub fn verdict(what: &str, estimate: Estimate, exact: f64) {
    let Estimate { mean, stderr } = estimate;
    let numbers = format!("{what}: {mean:.7} ± {stderr:.1e}, exactly {exact:.7}");
    println!("{numbers}");
    assert!(estimate.is_conclusive(exact), "inconclusive: {numbers}");
    assert!(estimate.agrees(exact), "{numbers}");
}
