//! The results of a renderer: the picture with its standard error, and the surfaces that the pixels' centres see; and
//! the sums behind a picture, with which another renderer can continue it.

use super::copy;
use super::estimator::Estimator;
use super::iso_depth::FirstSurface;
use super::renderer::Renderer;
use super::totals::Totals;
use crate::error::Result;

/// The picture so far, row 0 on top.
pub struct Film {
    /// RGB and coverage.
    pub mean: Vec<[f32; 4]>,
    /// Standard error of the mean; infinite while there is a single unit.
    pub stderr: Vec<[f32; 3]>,
}

impl Film {
    /// The film of a march, whose error is unknown.
    pub fn marched(mean: Vec<[f32; 4]>) -> Film {
        Film {
            stderr: vec![[f32::INFINITY; 3]; mean.len()],
            mean,
        }
    }
}

/// The sums of a picture after its last whole unit, in the GPU's own precision; row 0 on top.
#[derive(Debug, Clone, PartialEq)]
pub struct Sums {
    /// RGB and coverage.
    pub mean: Vec<[f32; 4]>,
    /// Weighted sum over units of squared differences from the mean.
    pub squares: Vec<[f32; 4]>,
}

impl Sums {
    /// Standard error of each pixel's mean after `samples` samples in `units` units; infinite while there is a single
    /// unit. `cache_error` is the relative error of the picture that the cache shows, which all samples share; 0
    /// without a cache.
    pub fn standard_error(&self, samples: u32, units: u32, cache_error: f64) -> Vec<[f32; 3]> {
        let divisor = units.saturating_sub(1) as f32 * samples as f32;
        let shared = self.shared_error(cache_error);
        let stderr = self.squares.iter().zip(&self.mean).map(|(s, m)| {
            std::array::from_fn(|c| match units {
                0 | 1 => f32::INFINITY,
                _ if m[3] == 0.0 => (s[c] / divisor).max(0.0).sqrt(),
                _ => (s[c] / divisor).max(0.0).sqrt().hypot(shared * m[c] * m[3]),
            })
        });
        stderr.collect()
    }

    /// The cache's own error as a share of each pixel's coverage: scaled so that its rms over the picture equals the
    /// measured error.
    fn shared_error(&self, cache_error: f64) -> f32 {
        if cache_error == 0.0 {
            return 0.0;
        }
        let mean = &self.mean;
        let covered = mean.iter().flat_map(|m| [0, 1, 2].map(|c| m[c] * m[3]));
        let squares: f64 = covered.map(|x| f64::from(x).powi(2)).sum();
        let rgb = mean.iter().flat_map(|m| [m[0], m[1], m[2]]);
        let brightness: f64 = rgb.map(f64::from).sum();
        let count = 3.0 * mean.len() as f64;
        let rms = (squares / count).sqrt();
        match rms > 0.0 {
            true => (cache_error * brightness / count / rms) as f32,
            false => 0.0,
        }
    }
}

/// The first surfaces behind the pixels' centres, row 0 on top.
pub struct FirstHits {
    /// Normal and, in w, distance along the ray; +∞ without a surface.
    pub normal_depth: Vec<[f32; 4]>,
    pub albedo: Vec<[f32; 4]>,
}

impl Renderer {
    /// The picture after the last whole unit.
    pub fn film(&mut self) -> Result<Film> {
        let sums = self.sums()?;
        let cache_error = self.cache().map_or(0.0, |cache| cache.relative_error);
        let Totals { samples, units, .. } = self.totals;
        Ok(Film {
            stderr: sums.standard_error(samples, units, cache_error),
            mean: sums.mean,
        })
    }

    /// The sums after the last whole unit, with which another renderer can continue the picture.
    pub fn sums(&mut self) -> Result<Sums> {
        self.clear_if_stale()?;
        let r = &self.resources;
        let frame = &mut self.frame;
        if let Estimator::Published(published) = &self.estimator {
            published.march(frame, r)?;
        }
        let [width, height] = r.size;
        Ok(Sums {
            mean: copy::download_corner(frame, &r.staging, &r.mean, [width, height, 1])?,
            squares: copy::download_corner(frame, &r.staging, &r.squares, [width, height, 1])?,
        })
    }

    /// Continues a picture of the current size from sums that a renderer of the same scene had after `totals`.
    pub fn resume(&mut self, sums: &Sums, totals: Totals) -> Result<()> {
        self.begin_picture();
        self.is_stale = false;
        self.totals = totals;
        self.upload(sums)
    }

    pub(super) fn upload(&mut self, sums: &Sums) -> Result<()> {
        let r = &mut self.resources;
        for (image, texels) in [(&r.mean, &sums.mean), (&r.squares, &sums.squares)] {
            let texels = bytemuck::cast_slice(texels);
            copy::upload(&mut self.frame, &mut r.staging, image, texels)?;
        }
        Ok(())
    }

    pub fn first_hits(&mut self) -> Result<FirstHits> {
        let r = &self.resources;
        let [width, height, _] = r.mean.desc.extent;
        let pixels = width as usize * height as usize;
        let Some(pass) = &self.iso_depth else {
            return Ok(FirstHits {
                normal_depth: vec![[0.0, 0.0, 0.0, f32::INFINITY]; pixels],
                albedo: vec![[0.0; 4]; pixels],
            });
        };
        pass.run(&mut self.frame, r)?;
        let FirstSurface {
            normal_depth,
            albedo,
        } = &pass.memory;
        Ok(FirstHits {
            normal_depth: copy::download(&mut self.frame, &r.staging, normal_depth)?,
            albedo: copy::download(&mut self.frame, &r.staging, albedo)?,
        })
    }
}
