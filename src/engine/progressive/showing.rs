//! What is shown of a picture that is made progressively: the march, the samples, or a mean of both (`refinement.rs`).

use super::{Doing, ProgressivePicture};
use crate::engine::stop::UNITS_TO_TRUST;
use crate::engine::{Engine, Picture};
use crate::error::Result;
use crate::gpu::Image;
use crate::render::Film;

impl ProgressivePicture {
    /// Shows the samples so far, and finds out how good they are.
    pub(super) fn show_samples(&mut self, engine: &mut Engine, shown: &Image) -> Result<()> {
        let totals = engine.totals();
        let is_trusted = totals.units >= UNITS_TO_TRUST;
        let film = if is_trusted || self.refinement.is_some() {
            Some(engine.film()?)
        } else {
            None
        };
        if let Some(film) = film.as_ref().filter(|_| is_trusted) {
            self.relative_error = engine.sure_error_of(film);
        }
        self.show_film(engine, shown, film)?;
        self.refinement.take_if(|r| r.is_over(totals.samples));
        Ok(())
    }

    /// Encodes the latest picture for display.
    pub(super) fn show(&mut self, engine: &mut Engine, shown: &Image) -> Result<()> {
        let film = if self.refinement.is_some() {
            Some(engine.film()?)
        } else {
            None
        };
        self.show_film(engine, shown, film)
    }

    /// `film`: that of the samples so far; needed only where they refine a march.
    fn show_film(&mut self, engine: &mut Engine, shown: &Image, film: Option<Film>) -> Result<()> {
        let display = engine.display();
        let samples = engine.totals().samples;
        if let Some(picture) = film.and_then(|film| self.refined(samples, &film.mean))
            && let Some(mut caching) = engine.caching()
        {
            return caching.tone_map_texels(&picture, shown, display);
        }
        match engine.caching() {
            Some(mut caching) if !self.is_refined() => caching.tone_map(shown, display),
            _ => engine.tone_map(shown),
        }
    }

    /// The picture as it is now, for a file.
    pub fn taken(&mut self, engine: &mut Engine) -> Result<Picture> {
        let mut picture = engine.picture()?;
        // Without samples that was a march, which has taken the place of one under way.
        if let Doing::Marching { .. } = self.doing {
            self.doing = Doing::marching();
        }
        let samples = engine.totals().samples;
        if self.refinement.is_some() {
            let mean = engine.film()?.mean;
            if let Some(refined) = self.refined(samples, &mean) {
                picture.show(&refined);
            }
        }
        if let Some(refinement) = &self.refinement {
            let left = refinement.error_left(samples);
            let errors = picture.stderr.as_flattened_mut().iter_mut();
            errors.for_each(|error| *error *= left);
        }
        Ok(picture)
    }

    /// The picture that is shown while so many samples with this mean refine a march; `None` otherwise.
    pub(super) fn refined(&mut self, samples: u32, mean: &[[f32; 4]]) -> Option<Vec<[f32; 4]>> {
        let refinement = self.refinement.as_mut()?;
        refinement.compare(samples, mean);
        Some(refinement.picture(samples, mean))
    }
}
