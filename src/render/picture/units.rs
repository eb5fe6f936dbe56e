//! Unit after unit of samples, each folded into the picture once it has ended.
//!
//! Pictures are only taken at the end of a unit: stopping a pixel in the middle of its work would favour its short
//! paths.

use super::bundle::{BundleUnderWay, most_together};
use super::under_way::UnderWay;
use crate::error::Result;
use crate::render::renderer::Renderer;
use crate::render::until::Until;

impl Renderer {
    /// Gives every pixel `samples` more samples. Returns false, and leaves the picture as it was, if
    /// `until` comes before the last path ends. In `published`, a unit is a round instead, whatever
    /// `samples` says. Where samples are marched, each is a unit of its own: then it returns true if at least one has
    /// ended, and `totals().samples` says how many have.
    pub fn unit<'a>(&mut self, samples: u32, until: impl Into<Until<'a>>) -> Result<bool> {
        self.units(samples, 1, until)
    }

    /// Gives every pixel `units` units of `samples` more samples, together where the volume streams. Returns false if
    /// `until` comes before the first of them have ended, and leaves out those that are under way then.
    pub fn units<'a>(
        &mut self,
        samples: u32,
        units: u32,
        until: impl Into<Until<'a>>,
    ) -> Result<bool> {
        let until = until.into();
        self.abandon()?;
        // In a march the units are single samples, since it knows the spread between these; how evenly they are spread is known
        // from all of them (`halves.rs`).
        let units = if self.is_marched() {
            samples * units
        } else {
            units
        };
        let most = match &self.resources.bricks {
            Some(_) => most_together(self.pixels()),
            None => 1,
        };
        let mut left = units;
        while left > 0 {
            let together = left.min(most);
            loop {
                if until.is_over() {
                    self.abandon()?;
                    return Ok(left < units);
                }
                if self.advance_units(samples, together)? {
                    break;
                }
            }
            left -= together;
        }
        Ok(true)
    }

    /// Goes on with a unit of so many samples, or of a single one where samples are marched, for a slice of time, or begins
    /// one. Returns whether it has ended.
    pub fn advance_unit(&mut self, samples: u32) -> Result<bool> {
        self.advance_units(samples, 1)
    }

    /// Makes a picture of one sample for a camera that moves. Where the volume streams, the picture does without missing
    /// bricks, some of which are brought for the next one, and its sample does not count.
    pub fn preview(&mut self) -> Result<()> {
        self.begin_picture();
        if let Some(bricks) = &self.resources.bricks {
            bricks.begin_preview();
        }
        let sampled = self.add_sample();
        let r = &self.resources;
        if let Some(bricks) = &r.bricks {
            // A preview ends also where a sample fails: other pictures wait for their bricks.
            let ended = bricks.end_preview(&mut self.frame, &r.volumes);
            self.begin_picture();
            return sampled.and(ended);
        }
        sampled
    }

    /// Gives every pixel another sample.
    fn add_sample(&mut self) -> Result<()> {
        while !self.advance_unit(1)? {}
        Ok(())
    }

    /// Drops the units under way.
    pub(in crate::render) fn abandon(&mut self) -> Result<()> {
        match std::mem::take(&mut self.under_way) {
            UnderWay::Units(BundleUnderWay {
                before: Some(sums), ..
            }) => self.upload(&sums),
            _ => Ok(()),
        }
    }

    pub(in crate::render) fn pixels(&self) -> u32 {
        self.resources.pixels()
    }
}
