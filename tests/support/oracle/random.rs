//! Random numbers and the directions made from them.

use glam::DVec3;
use std::f64::consts::TAU;

/// One pixel's stream: it depends on the seed and the pixel, never on the thread that renders it.
pub struct Random(fastrand::Rng);

impl Random {
    pub fn new(seed: u64, pixel: u64) -> Random {
        // Hashed twice, so that neighbouring seeds and pixels land far apart.
        let seed = fastrand::Rng::with_seed(seed).u64(..);
        let pixel = fastrand::Rng::with_seed(seed.wrapping_add(pixel)).u64(..);
        Random(fastrand::Rng::with_seed(pixel))
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0.f64()
    }

    /// Exponentially distributed with mean 1.
    pub fn exponential(&mut self) -> f64 {
        -(-self.uniform()).ln_1p()
    }

    /// A unit vector at a given cosine from `axis`, at a uniform azimuth.
    pub fn around(&mut self, axis: DVec3, cosine: f64) -> DVec3 {
        let (x, y) = axis.any_orthonormal_pair();
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let azimuth = TAU * self.uniform();
        (sine * azimuth.cos() * x + sine * azimuth.sin() * y + cosine * axis).normalize()
    }

    /// Uniform on the unit sphere.
    pub fn direction(&mut self) -> DVec3 {
        let cosine = 2.0 * self.uniform() - 1.0;
        self.around(DVec3::Y, cosine)
    }
}
