//! What the picture does with its slice of each frame.
//!
//! While anything moves, a picture of fewer pixels is made whole in every frame, so many as there is
//! time for: a march through the cache, or a sample a pixel where there is none. At rest a march with all
//! pixels follows, slice by slice; then the cache gets paths until it has converged, looked at again now
//! and then; then the picture is refined by samples, which replace the march once there are enough of
//! them. After that there is nothing left to do, and nothing is done.

use std::time::{Duration, Instant};

use super::live::Live;
use crate::error::Result;
use crate::gpu::{DeviceSummary, Image, Slices};
use crate::job::schedule::{UNITS_TO_TRUST, sixteenth};
use crate::output::relative_error;
use crate::render::shared::ToneMapPush;
use crate::render::{Renderer, doubling};
use crate::scene::Tone;

/// A picture in motion should take about this long.
const MOVING_MS: f64 = 28.0;
/// With fewer pixels along an axis, of those at rest, nothing can be recognised.
const LEAST_SCALE: f64 = 0.15;
/// What the cache gets of a frame in motion.
const FILLING_MS: f64 = 12.0;
/// A piece of work at rest; a frame has one, so that it answers soon.
const RESTING_MS: f64 = 30.0;
/// Motion is over when nothing has changed for so long.
const REST_AFTER: Duration = Duration::from_millis(180);

/// The cache counts as converged at this relative error of the picture that it shows, or after so long at
/// this picture's expense.
pub const CACHE_ERROR: f64 = 0.006;
const LONGEST_FILLING: Duration = Duration::from_secs(30);
/// Filling is watched by a new march when it has taken so many times as long as the last.
const MARCH_SHARE: f64 = 3.0;
/// Samples look better than a march from this relative error on.
const ERROR_TO_SHOW: f64 = 0.05;
/// The picture counts as finished at this relative error, or when it has had all its samples.
const PICTURE_ERROR: f64 = 0.01;

pub struct Picture {
    doing: Doing,
    /// Pixels along an axis while moving, as a share of those at rest.
    pub scale: f64,
    last_motion: Instant,
    /// That the cache had had when the last march with all pixels ended.
    marched_batches: Option<u32>,
    marched_in: Duration,
    /// When the last march ended.
    filled_since: Instant,
    /// Samples a pixel, at rest.
    most_samples: u32,
    /// Of the picture at rest; not finite while it is unknown.
    pub relative_error: f64,
    /// Some picture of this scene can be seen.
    is_shown: bool,
    /// Exposure or tone are others than what is shown.
    pub is_toned_otherwise: bool,
}

enum Doing {
    Moving,
    Marching { slices: Slices, began: Instant },
    Filling,
    Refining,
    Nothing,
}

impl Picture {
    /// A CPU begins with few pixels, a GPU with all.
    pub fn new(renderer: &Renderer, device: &DeviceSummary, most_samples: u32) -> Picture {
        let scale = match (device.kind, &renderer.cache) {
            ("CPU", Some(_)) => 0.35,
            ("CPU", None) => 0.25,
            _ => 1.0,
        };
        Picture {
            doing: Doing::Moving,
            scale,
            last_motion: Instant::now(),
            marched_batches: None,
            marched_in: Duration::ZERO,
            filled_since: Instant::now(),
            most_samples,
            relative_error: f64::INFINITY,
            is_shown: false,
            is_toned_otherwise: false,
        }
    }

    /// Something moves: whatever was done for the picture at rest is void.
    pub fn restart(&mut self) {
        self.last_motion = Instant::now();
        self.doing = Doing::Moving;
        self.relative_error = f64::INFINITY;
    }

    pub fn is_moving(&self) -> bool {
        matches!(self.doing, Doing::Moving)
    }

    pub fn is_finished(&self) -> bool {
        matches!(self.doing, Doing::Nothing)
    }

    /// For the status line.
    pub fn doing(&self) -> &'static str {
        match self.doing {
            Doing::Moving => "moving",
            Doing::Marching { .. } => "looking closely",
            Doing::Filling => "light spreads",
            Doing::Refining => "refining",
            Doing::Nothing => "done",
        }
    }

    /// Pixels take time in proportion to their number, the square of the scale.
    fn adapt(&mut self, took_ms: f64) {
        let wanted = self.scale * (MOVING_MS / took_ms).sqrt();
        let calmed = 0.75 * self.scale + 0.25 * wanted;
        self.scale = calmed.clamp(LEAST_SCALE, 1.0);
    }
}

impl Live {
    /// Spends a slice of time on the picture. Returns whether `shown` has changed.
    pub fn advance(&mut self, shown: &Image) -> Result<bool> {
        if std::mem::take(&mut self.picture.is_toned_otherwise) && self.tone_again(shown)? {
            return Ok(true);
        }
        match self.picture.doing {
            Doing::Moving => self.move_on(shown),
            Doing::Marching { .. } => self.march_on(shown),
            Doing::Filling => self.fill_on(),
            Doing::Refining => self.refine_on(shown),
            Doing::Nothing => Ok(false),
        }
    }

    /// What was refined is still there and is shown at once; a march is not, and is made anew.
    fn tone_again(&mut self, shown: &Image) -> Result<bool> {
        let is_refined = matches!(self.picture.doing, Doing::Refining | Doing::Nothing);
        let is_there = is_refined && self.shows_samples();
        match is_there {
            true => self.show(shown)?,
            false => self.picture.restart(),
        }
        Ok(is_there)
    }

    fn shows_samples(&self) -> bool {
        let samples = self.renderer.totals.samples;
        match self.renderer.cache {
            Some(_) => {
                self.picture.relative_error <= ERROR_TO_SHOW || samples >= self.picture.most_samples
            }
            None => samples > 0,
        }
    }

    /// A whole picture, of as many pixels as there is time for, and a little light.
    fn move_on(&mut self, shown: &Image) -> Result<bool> {
        if self.picture.is_shown && self.picture.last_motion.elapsed() >= REST_AFTER {
            self.rest()?;
            return Ok(false);
        }
        let began = Instant::now();
        self.reduce_to(self.moving_size())?;
        self.make_whole(shown)?;
        self.picture.is_shown = true;
        self.picture.adapt(began.elapsed().as_secs_f64() * 1e3);
        if !self.cache_is_good() {
            self.renderer.take_slices_of(FILLING_MS);
            self.renderer.advance_cache(self.next_batch())?;
        }
        Ok(true)
    }

    /// A march, or a sample for each pixel.
    fn make_whole(&mut self, shown: &Image) -> Result<()> {
        if self.renderer.cache.is_some() {
            let push = self.tone_map_push(shown);
            return self.renderer.march_at_once(shown, &push);
        }
        self.renderer.take_slices_of(MOVING_MS);
        self.renderer.begin_picture();
        while !self.renderer.advance_unit(1)? {}
        self.show(shown)
    }

    fn rest(&mut self) -> Result<()> {
        self.reduce_to(self.scene.render.size)?;
        self.picture.marched_batches = None;
        self.picture.doing = match self.renderer.cache {
            Some(_) => Doing::marching(),
            None => Doing::Refining,
        };
        Ok(())
    }

    fn march_on(&mut self, shown: &Image) -> Result<bool> {
        let Doing::Marching { slices, began } = &mut self.picture.doing else {
            return Ok(false);
        };
        if !self.renderer.advance_march(slices)? {
            return Ok(false);
        }
        self.picture.marched_in = began.elapsed();
        self.picture.filled_since = Instant::now();
        self.picture.marched_batches = self.batches();
        self.show(shown)?;
        self.picture.doing = match self.cache_is_converged() {
            true => Doing::Refining,
            false => Doing::Filling,
        };
        Ok(true)
    }

    fn fill_on(&mut self) -> Result<bool> {
        self.renderer.take_slices_of(RESTING_MS);
        let ended = self.renderer.advance_cache(self.next_batch())?;
        let due = self.picture.marched_in.mul_f64(MARCH_SHARE);
        let is_new = self.batches() != self.picture.marched_batches;
        let filled_for = self.picture.filled_since.elapsed();
        let is_done = ended && self.cache_is_converged();
        if is_new && (is_done || filled_for >= due) {
            self.picture.doing = Doing::marching();
        } else if is_done {
            self.picture.doing = Doing::Refining;
        }
        Ok(false)
    }

    fn refine_on(&mut self, shown: &Image) -> Result<bool> {
        self.renderer.take_slices_of(RESTING_MS);
        let samples = self.renderer.totals.samples;
        let left = self.picture.most_samples.saturating_sub(samples);
        let unit = sixteenth(samples).min(left).max(1);
        if !self.renderer.advance_unit(unit)? {
            return Ok(false);
        }
        let totals = self.renderer.totals;
        if totals.units >= UNITS_TO_TRUST {
            let film = self.renderer.film()?;
            let rgb: Vec<_> = film.mean.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
            self.picture.relative_error = relative_error(&rgb, &film.stderr);
        }
        let shows = self.shows_samples();
        if shows {
            self.show(shown)?;
        }
        if self.picture.relative_error <= PICTURE_ERROR
            || totals.samples >= self.picture.most_samples
        {
            self.picture.doing = Doing::Nothing;
        }
        Ok(shows)
    }

    /// Encodes for display what was made last.
    fn show(&mut self, shown: &Image) -> Result<()> {
        let is_refined = matches!(self.picture.doing, Doing::Refining | Doing::Nothing);
        let marched = self.renderer.cache.is_some() && !is_refined;
        let push = self.tone_map_push(shown);
        self.renderer.tone_map(marched, shown, &push)
    }

    fn tone_map_push(&self, shown: &Image) -> ToneMapPush {
        let [width, height, _] = shown.desc.extent;
        let render = &self.scene.render;
        ToneMapPush {
            source: self.renderer.resources.size,
            size: [width, height],
            exposure: render.exposure.exp2() as f32,
            filmic: (render.tone == Tone::Filmic) as u32,
        }
    }

    fn batches(&self) -> Option<u32> {
        self.renderer.cache.as_ref().map(|cache| cache.batches)
    }

    /// Paths that a node in sight gets in a batch: as many as it has had, or what it lacks of that.
    fn next_batch(&self) -> u32 {
        let cache = self.renderer.cache.as_ref();
        match cache.map_or(0, |cache| cache.updates) {
            0 => 1,
            _ if self.cache_is_good() => 0,
            updates => doubling(updates),
        }
    }

    /// In some view.
    fn cache_is_good(&self) -> bool {
        self.renderer
            .cache
            .as_ref()
            .is_none_or(|cache| cache.is_known_to(CACHE_ERROR) || cache.took >= LONGEST_FILLING)
    }

    /// In this one.
    pub fn cache_is_converged(&self) -> bool {
        let cache = self.renderer.cache.as_ref();
        self.cache_is_good() && cache.is_none_or(|cache| cache.is_caught_up())
    }

    fn moving_size(&self) -> [u32; 2] {
        let scale = self.picture.scale;
        self.scene
            .render
            .size
            .map(|n| ((n as f64 * scale).round() as u32).clamp(1, n))
    }
}

impl Doing {
    fn marching() -> Doing {
        Doing::Marching {
            slices: Slices::new(RESTING_MS),
            began: Instant::now(),
        }
    }
}
