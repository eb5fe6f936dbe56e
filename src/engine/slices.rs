//! What a program uses that makes its pictures piece by piece, as a window does between two frames: it fills the cache, takes
//! samples and shows the picture for no longer than a slice at a time.

use std::time::Duration;

use super::Engine;
use crate::error::Result;
use crate::gpu::{Image, Timings};
use crate::render::{BrickFigures, Cache, Caching, Display, Film};

impl Engine {
    /// The cache, in a variant that has one.
    pub(super) fn cache(&self) -> Option<&Cache> {
        self.renderer.cache()
    }

    /// The cache's part of the relative error of a picture at rest; `None` without a cache.
    pub fn cache_error_at_rest(&self) -> Option<f64> {
        self.cache().map(|cache| cache.filling.error_at_rest)
    }

    /// Whether all that is in sight is known to have had the cache's paths; always so without a cache.
    pub fn is_caught_up(&self) -> bool {
        self.cache().is_none_or(|cache| cache.is_caught_up())
    }

    /// The time that the cache's next batch is expected to take, in seconds; 0 without a cache.
    pub fn seconds_of_next_batch(&self) -> f64 {
        let cache = self.cache();
        cache.map_or(0.0, |cache| cache.seconds_of_next_batch())
    }

    /// Whether what is wrong with the picture comes from the cache alone, since samples through it have next to no noise.
    pub fn samples_are_smooth(&self) -> bool {
        self.cache().is_some_and(|cache| cache.samples_are_smooth())
    }

    /// The cache and what fills and shows it.
    pub fn caching(&mut self) -> Option<Caching<'_>> {
        self.renderer.caching()
    }

    /// Pixels of the picture that is rendered now.
    pub fn rendered_size(&self) -> [u32; 2] {
        self.renderer.size()
    }

    /// `None` where the volume is whole.
    pub fn brick_figures(&self) -> Option<BrickFigures> {
        self.renderer.brick_figures()
    }

    /// The time for which the device has waited for bricks of the volume; 0 where it is whole.
    pub fn waited_for_bricks(&self) -> Duration {
        let figures = self.brick_figures();
        figures.map_or(Duration::ZERO, |figures| figures.waited)
    }

    /// Sets the time that a slice of work should take from now on, in milliseconds.
    pub fn set_slice_ms(&mut self, ms: f64) {
        self.renderer.set_slice_ms(ms);
    }

    /// Goes on with a unit of so many samples, or of a single one where samples are marched, for a slice of time, or begins
    /// one. Returns whether it has ended.
    pub fn advance_unit(&mut self, samples: u32) -> Result<bool> {
        self.renderer.advance_unit(samples)
    }

    /// Makes a picture of one sample for a camera that moves. Where the volume streams, the picture does without missing
    /// bricks, some of which are brought for the next one, and its sample does not count.
    pub fn preview(&mut self) -> Result<()> {
        self.renderer.preview()
    }

    /// The picture after the last complete unit.
    pub fn film(&mut self) -> Result<Film> {
        self.renderer.film()
    }

    /// How radiance is mapped to a display.
    pub(super) fn display(&self) -> Display {
        self.full.parts.display
    }

    /// Encodes the mean of the samples so far for display.
    pub fn tone_map(&mut self, to: &Image) -> Result<()> {
        self.renderer.tone_map(to, self.display())
    }

    /// The times of the GPU's passes.
    pub fn timings_mut(&mut self) -> &mut Timings {
        self.renderer.timings_mut()
    }
}
