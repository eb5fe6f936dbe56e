//! The results of a renderer: the picture with its standard error, and the surfaces that the pixels' centres see; and
//! the sums behind a picture, with which another renderer can continue it.

use std::sync::Arc;

use super::halves::Halves;
use super::iso_depth::FirstSurface;
use super::sums::{Sums, variance};
use super::totals::Totals;
use crate::error::{Error, Result};
use crate::render::copy;
use crate::render::renderer::Renderer;

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

/// The first surfaces behind the pixels' centres, row 0 on top.
pub struct FirstHits {
    /// Unit normal and, in w, distance along the ray in world units; 0 and +∞ without a surface.
    pub normal_depth: Vec<[f32; 4]>,
    /// RGB, and 1 in alpha; all 0 without a surface.
    pub albedo: Vec<[f32; 4]>,
}

impl Renderer {
    /// The picture after the last complete unit.
    pub fn film(&mut self) -> Result<Film> {
        let sums = self.sums()?;
        Ok(Film {
            stderr: self.standard_error(&sums),
            mean: sums.mean,
        })
    }

    /// Standard error of the picture with these sums.
    pub fn standard_error(&self, sums: &Sums) -> Vec<[f32; 3]> {
        let cache_error = self
            .cache()
            .map_or(0.0, |cache| cache.filling.error_at_rest);
        let Totals { samples, units, .. } = self.totals;
        sums.standard_error(samples, units, cache_error)
    }

    /// The sums after the last complete unit, with which another renderer can continue the picture.
    pub fn sums(&mut self) -> Result<Sums> {
        self.complete_mean()?;
        let (frame, r) = (&mut self.frame, &self.resources);
        Ok(Sums {
            mean: copy::download_picture(frame, &r.staging, &r.mean, r.size)?,
            squares: copy::download_picture(frame, &r.staging, &r.squares, r.size)?,
            halves: self.halves.clone(),
        })
    }

    /// Continues a picture of the current size from sums that another renderer of the same scene had after `totals`, which are
    /// added to what this one has done; fails if they are of another size.
    pub fn resume(&mut self, sums: &Sums, totals: Totals) -> Result<()> {
        let pixels = self.pixels() as usize;
        if [&sums.mean, &sums.squares]
            .iter()
            .any(|texels| texels.len() != pixels)
        {
            return Err(Error::value(format!(
                "the sums are of {} pixels, and the picture has {pixels}",
                sums.mean.len()
            )));
        }
        self.begin_picture();
        self.is_stale = false;
        let before = self.totals;
        self.totals = Totals {
            paths: before.paths.saturating_add(totals.paths),
            lookups: before.lookups + totals.lookups,
            paths_before: before.paths.saturating_add(totals.paths_before),
            lookups_before: before.lookups + totals.lookups_before,
            ..totals
        };
        self.halves.clone_from(&sums.halves);
        self.upload(sums)
    }

    /// Measures how much smaller the variance of the mean of marched samples is than that of independent ones, whenever
    /// their number is a power of two.
    pub(in crate::render) fn update_halves(&mut self) -> Result<()> {
        let Totals { samples, units, .. } = self.totals;
        if !self.is_marched() || samples < Halves::LEAST || !samples.is_power_of_two() {
            return Ok(());
        }
        let halves = self.halves.take();
        let Sums { mean, squares, .. } = self.sums()?;
        let halves = match halves {
            Some(halves) if halves.samples == samples / 2 => {
                let variance = variance(&squares, samples, units);
                halves.doubled(mean, &variance, self.resources.size[0] as usize)
            }
            _ => Halves::first(samples, mean),
        };
        self.halves = Some(Arc::new(halves));
        Ok(())
    }

    pub(in crate::render) fn upload(&mut self, sums: &Sums) -> Result<()> {
        let r = &mut self.resources;
        for (image, texels) in [(&r.mean, &sums.mean), (&r.squares, &sums.squares)] {
            copy::upload_picture(&mut self.frame, &mut r.staging, image, r.size, texels)?;
        }
        Ok(())
    }

    /// Normal, depth and albedo of the first surface behind each pixel's centre.
    pub fn first_hits(&mut self) -> Result<FirstHits> {
        self.see_first_surfaces()?;
        let Some(pass) = &self.passes.iso_depth else {
            let pixels = self.pixels() as usize;
            return Ok(FirstHits {
                normal_depth: vec![[0.0, 0.0, 0.0, f32::INFINITY]; pixels],
                albedo: vec![[0.0; 4]; pixels],
            });
        };
        let (frame, r) = (&mut self.frame, &self.resources);
        let FirstSurface {
            normal_depth,
            albedo,
        } = &pass.memory;
        Ok(FirstHits {
            normal_depth: copy::download_picture(frame, &r.staging, normal_depth, r.size)?,
            albedo: copy::download_picture(frame, &r.staging, albedo, r.size)?,
        })
    }
}
