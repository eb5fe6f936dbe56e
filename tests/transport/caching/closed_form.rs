//! Numbers that are known exactly, through the cache.

use isolume::scene::volume::Volume;
use isolume::scene::*;

use crate::support::common::*;

fn camera(y: f64) -> Camera {
    Camera {
        eye: [0.0, y, 0.0],
        target: [0.0; 3],
        up: [0.0, 0.0, 1.0],
        projection: Projection::Orthographic { height: 1.0 },
    }
}

/// 1 above, 0 below.
fn sky_above() -> EnvironmentImage {
    const ROWS: usize = 256;
    let row = |j| [if j < ROWS / 2 { 1.0 } else { 0.0 }; 3];
    EnvironmentImage {
        width: 1,
        height: ROWS as u32,
        texels: (0..ROWS).map(row).collect(),
    }
}

/// Of thickness 1 and 100 × 100 wide.
struct Slab {
    depth: f64,
    albedo: f64,
    g: f64,
    layers: u32,
}

impl Slab {
    fn scene(&self, y: f64) -> Scene {
        let mut scene = empty_scene([16, 16], camera(y));
        scene.medium = Some(uniform_medium(self.depth, self.albedo, self.g));
        scene.lights.environment.image = Some(sky_above());
        scene
    }

    fn volume(&self) -> Volume {
        let spacing = [50.0, 1.0 / f64::from(self.layers), 50.0];
        constant_field(1.0, [2, self.layers, 2], spacing)
    }

    /// Flux reflected (seen from above) or transmitted (from below) of a collimated beam along the
    /// normal, and its standard error.
    fn measure(&self, cache: &mut Cached, y: f64, updates: u32, samples: u32) -> (f64, f64) {
        cache.change(&self.scene(y), &self.volume());
        let run = |seed| {
            cache.reseed(seed);
            cache.fill(updates);
            let pixels = cache.at_rest(2, samples / 2).mean;
            pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() / pixels.len() as f64
        };
        let runs: Vec<f64> = (0..SEEDS).map(run).collect();
        let n = f64::from(SEEDS);
        let mean = runs.iter().sum::<f64>() / n;
        let squares: f64 = runs.iter().map(|r| (r - mean).powi(2)).sum();
        (mean, (squares / (n - 1.0) / n).sqrt())
    }

    #[track_caller]
    fn expect(&self, updates: u32, samples: u32, exact: [f64; 2]) {
        let (scene, volume) = (self.scene(2.0), self.volume());
        let mut cache = cached(&scene, &volume, 1.0, CacheFormat::F32, 0, 0);
        for (y, exact) in [2.0, -2.0].into_iter().zip(exact) {
            let (mean, stderr) = self.measure(&mut cache, y, updates, samples);
            let error = mean / exact - 1.0;
            println!(
                "slab τ {} albedo {} g {}: {mean:.6} ± {stderr:.1e}, exactly {exact:.6} ({:+.2} %)",
                self.depth,
                self.albedo,
                self.g,
                100.0 * error
            );
            if self.g == 0.0 {
                let conclusive = stderr <= (1e-3 * exact).max(2e-4);
                assert!(conclusive, "{mean} ± {stderr} says nothing about {exact}");
                let tolerance = 4.0 * stderr + 2e-4 * exact;
                assert!(
                    (mean - exact).abs() <= tolerance,
                    "{mean} ± {stderr}, not {exact}"
                );
            } else {
                assert!(error.abs() <= 0.01, "{mean}, not {exact}");
            }
        }
    }
}

/// Independent caches, whose spread is the error: a cache's own noise is the same in all pixels.
const SEEDS: u32 = 16;

fn slab(depth: f64, albedo: f64, g: f64) -> Slab {
    Slab {
        depth,
        albedo,
        g,
        layers: if depth > 2.0 { 64 } else { 16 },
    }
}

#[test]
fn thin_slabs() {
    slab(0.5, 1.0, 0.0).expect(2048, 16, [0.202506, 0.797494]);
    slab(1.0, 0.5, 0.0).expect(256, 16, [0.099119, 0.446058]);
}

#[test]
fn a_thick_slab() {
    slab(4.0, 1.0, 0.0).expect(4096, 16, [0.690926, 0.309074]);
}

#[test]
fn slabs_that_scatter_forwards() {
    slab(1.0, 1.0, 0.5).expect(256, 64, [0.176115, 0.823885]);
    slab(4.0, 0.9, 0.85).expect(256, 256, [0.081289, 0.493072]);
}

#[test]
fn a_white_furnace() {
    let camera = Camera {
        eye: [0.6, 0.8, 3.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Perspective { fov_y: 25.0 },
    };
    let mut scene = empty_scene([16, 16], camera);
    scene.lights.environment.radiance = [1.0; 3];
    scene.medium = Some(uniform_medium(8.0, 1.0, 0.0));
    let volume = constant_field(1.0, [12; 3], [1.0 / 12.0; 3]);
    for format in [CacheFormat::F16, CacheFormat::F32] {
        let mut cache = cached(&scene, &volume, 0.5, format, 4, 1);
        let pixels = cache.march().into_iter().chain(cache.at_rest(2, 4).mean);
        for pixel in pixels {
            assert!((pixel[0] - 1.0).abs() < 1e-5, "{format:?}: {pixel:?}");
        }
    }
}

/// A radiograph: so dense that next to nothing comes through, and yet the whole picture.
#[test]
fn light_behind_much_that_absorbs() {
    let mut scene = slab(9.6, 0.0, 0.0).scene(2.0);
    scene.lights.environment = Environment {
        radiance: [1.0; 3],
        ..Environment::default()
    };
    let volume = slab(9.6, 0.0, 0.0).volume();
    let exact = (-9.6f64).exp();
    let pixels = cached(&scene, &volume, 1.0, CacheFormat::F32, 1, 0)
        .at_rest(16, 16)
        .mean;
    let mean = mean_red(&pixels);
    println!("behind τ 9.6: {mean:e}, exactly {exact:e}");
    assert!((mean / exact - 1.0).abs() < 0.02, "{mean:e}, not {exact:e}");
}
