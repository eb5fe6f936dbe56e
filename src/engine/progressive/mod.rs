//! A picture that is shown while it is made, as a window does it: what each frame's slice of time is used for.
//!
//! While anything moves, a picture is made in every frame, with as many pixels as there is time for: a march
//! through the cache, or a sample a pixel where there is none. At rest a march with all pixels follows, slice by
//! slice; then the cache gets paths until it has converged, and is marched again now and then, with a few rays of each pixel
//! once its light hardly changes any more; then the picture is refined by samples (`refinement.rs`). After that
//! nothing is left to do.

mod light;
mod showing;

use std::time::{Duration, Instant};

use super::schedule::sixteenth;
use super::{Engine, Refinement};
use crate::error::Result;
use crate::gpu::Image;
use crate::render::{RAYS_PER_PIXEL, ReadingSlices, Until};

pub use light::SHOWN_CACHE_ERROR;

/// Time that a picture in motion should take.
const MOVING_MS: f64 = 28.0;
/// The least share of the pixels along an axis: with fewer, the picture is not recognisable.
const LEAST_SCALE: f64 = 0.15;
/// Milliseconds of a frame in motion for filling the cache.
const FILLING_MS: f64 = 12.0;
/// Milliseconds of a piece of work at rest; a frame has one piece, so that it responds soon.
const RESTING_MS: f64 = 30.0;
/// Motion is over when nothing has changed for this time.
const REST_AFTER: Duration = Duration::from_millis(180);

/// The cache is marched again when filling has taken this many times as long as the last march.
const MARCH_SHARE: f64 = 3.0;
/// Samples that refine the picture are shown again when they have taken this many times as long as showing them, for which the
/// picture is downloaded.
const SHOWING_SHARE: f64 = 3.0;
/// The picture counts as finished at this relative error, or when it has had all its samples.
const PICTURE_ERROR: f64 = 0.01;

/// The picture in the window: what is shown of it, and what is done for it next.
pub struct ProgressivePicture {
    doing: Doing,
    /// Pixels along an axis while moving, as a share of those at rest.
    pub scale: f64,
    last_motion: Instant,
    /// Number of the cache's batches when the last march with all pixels ended.
    marched_batches: Option<u32>,
    /// The time that all rays of the last march took.
    marched_in: Duration,
    /// Rays of each pixel in the march that is shown.
    rays_shown: u32,
    /// When the last march ended.
    filled_since: Instant,
    /// The march with all pixels and rays, while samples refine it.
    refinement: Option<Refinement>,
    /// Samples that come before this time are not shown yet.
    next_showing: Instant,
    /// Samples a pixel, at rest.
    most_samples: u32,
    /// Relative error of the picture at rest; not finite while it is unknown.
    pub relative_error: f64,
    /// Whether some picture of this scene can be seen.
    is_shown: bool,
    /// Whether exposure or tone differ from what is shown.
    pub is_toned_otherwise: bool,
}

enum Doing {
    Moving,
    Marching {
        slices: ReadingSlices,
        began: Instant,
    },
    Filling,
    Refining,
    Nothing,
}

impl ProgressivePicture {
    /// The first frame has few pixels: it is not known yet how long they take, and a fast device soon has all of them.
    pub fn new(engine: &Engine, most_samples: u32) -> ProgressivePicture {
        let scale = match engine.cache() {
            Some(_) => 0.35,
            None => 0.25,
        };
        ProgressivePicture {
            doing: Doing::Moving,
            scale,
            last_motion: Instant::now(),
            marched_batches: None,
            marched_in: Duration::ZERO,
            rays_shown: 0,
            filled_since: Instant::now(),
            refinement: None,
            next_showing: Instant::now(),
            most_samples,
            relative_error: f64::INFINITY,
            is_shown: false,
            is_toned_otherwise: false,
        }
    }

    /// Notes that something moves: all work for the picture at rest is void.
    pub fn restart(&mut self) {
        self.last_motion = Instant::now();
        self.doing = Doing::Moving;
        self.rays_shown = 0;
        self.refinement = None;
        self.relative_error = f64::INFINITY;
    }

    pub fn is_moving(&self) -> bool {
        matches!(self.doing, Doing::Moving)
    }

    pub fn is_finished(&self) -> bool {
        matches!(self.doing, Doing::Nothing)
    }

    /// Whether samples make the picture, or have made it: at rest, and where there is a cache, by refining a march.
    fn is_refined(&self) -> bool {
        matches!(self.doing, Doing::Refining | Doing::Nothing)
    }

    /// The text of the status line.
    pub fn doing(&self) -> &'static str {
        match self.doing {
            Doing::Moving => "moving",
            Doing::Marching { .. } => "marching every pixel",
            Doing::Filling => "filling the cache",
            Doing::Refining => "refining",
            Doing::Nothing => "done",
        }
    }

    /// Adapts the scale: pixels take time in proportion to their number, the square of the scale.
    fn adapt(&mut self, took_ms: f64) {
        let wanted = self.scale * (MOVING_MS / took_ms).sqrt();
        let calmed = 0.75 * self.scale + 0.25 * wanted;
        self.scale = calmed.clamp(LEAST_SCALE, 1.0);
    }

    /// Spends a slice of time on the picture. Returns whether `shown` has changed.
    pub fn advance(&mut self, engine: &mut Engine, shown: &Image) -> Result<bool> {
        if std::mem::take(&mut self.is_toned_otherwise) && self.tone_again(engine, shown)? {
            return Ok(true);
        }
        match self.doing {
            Doing::Moving => self.move_on(engine, shown),
            Doing::Marching { .. } => self.march_on(engine, shown),
            Doing::Filling => self.fill_on(engine),
            Doing::Refining => self.refine_on(engine, shown),
            Doing::Nothing => Ok(false),
        }
    }

    /// Encodes the picture again. A refined picture is still there and is shown at once; others are made anew.
    fn tone_again(&mut self, engine: &mut Engine, shown: &Image) -> Result<bool> {
        let is_there = self.is_refined() && engine.totals().samples > 0;
        if is_there {
            self.show(engine, shown)?
        } else {
            self.restart()
        }
        Ok(is_there)
    }

    fn is_good_enough(&self, samples: u32) -> bool {
        self.relative_error <= PICTURE_ERROR || samples >= self.most_samples
    }

    /// Makes a picture with as many pixels as there is time for, and fills the cache for a moment.
    fn move_on(&mut self, engine: &mut Engine, shown: &Image) -> Result<bool> {
        if self.is_shown && self.last_motion.elapsed() >= REST_AFTER {
            self.rest(engine)?;
            return Ok(false);
        }
        let (began, waited) = (Instant::now(), engine.waited_for_bricks());
        engine.reduce_to(self.moving_size(engine))?;
        self.make_moving_picture(engine, shown)?;
        self.is_shown = true;
        // Time spent waiting for bricks is left out, since it does not depend on the number of pixels.
        let took = began.elapsed() - (engine.waited_for_bricks() - waited);
        self.adapt(took.as_secs_f64() * 1e3);
        if !engine.cache_is_good() {
            let batch = engine.next_shown_batch();
            engine.set_slice_ms(FILLING_MS);
            if let Some(mut caching) = engine.caching() {
                caching.advance_in_motion(batch)?;
            }
        }
        Ok(true)
    }

    /// Makes a picture: a march, or a sample for each pixel.
    fn make_moving_picture(&mut self, engine: &mut Engine, shown: &Image) -> Result<()> {
        let display = engine.display();
        if let Some(mut caching) = engine.caching() {
            return caching.march_at_once(shown, display);
        }
        engine.set_slice_ms(MOVING_MS);
        engine.preview()?;
        self.show(engine, shown)
    }

    fn rest(&mut self, engine: &mut Engine) -> Result<()> {
        engine.reduce_to(engine.scene().render.size)?;
        if let Some(mut caching) = engine.caching() {
            caching.rest();
        }
        self.marched_batches = None;
        self.doing = match engine.cache() {
            Some(_) => Doing::marching(),
            None => Doing::Refining,
        };
        Ok(())
    }

    fn march_on(&mut self, engine: &mut Engine, shown: &Image) -> Result<bool> {
        let (Doing::Marching { slices, began }, Some(mut caching)) =
            (&mut self.doing, engine.caching())
        else {
            return Ok(false);
        };
        if !caching.advance_march(slices)? {
            return Ok(false);
        }
        let rays = caching.rays();
        self.marched_in = match rays {
            1 => began.elapsed(),
            _ => self.marched_in + began.elapsed(),
        };
        self.filled_since = Instant::now();
        self.marched_batches = engine.cache_batches();
        // With fewer rays, edges that were smooth would become rough again for a moment.
        let is_better = rays >= self.rays_shown;
        if is_better {
            self.show(engine, shown)?;
            self.rays_shown = rays;
        }
        if rays < RAYS_PER_PIXEL && engine.shows_edges() {
            self.march_again();
            return Ok(is_better);
        }
        self.doing = if engine.cache_is_converged() {
            self.refining(engine)?
        } else {
            Doing::Filling
        };
        Ok(is_better)
    }

    /// Begins to march another ray of each pixel, in slices as long as those of the last one have become.
    fn march_again(&mut self) {
        if let Doing::Marching { slices, began } = &mut self.doing {
            slices.restart(RESTING_MS);
            *began = Instant::now();
        }
    }

    fn fill_on(&mut self, engine: &mut Engine) -> Result<bool> {
        let batch = engine.next_shown_batch();
        engine.set_slice_ms(RESTING_MS);
        let ended = match engine.caching() {
            Some(mut caching) => caching.advance(batch, Until::NEVER)?,
            None => true,
        };
        let due = self.marched_in.mul_f64(MARCH_SHARE);
        let is_new = engine.cache_batches() != self.marched_batches;
        let filled_for = self.filled_since.elapsed();
        let is_done = ended && engine.cache_is_converged();
        if is_done || is_new && filled_for >= due {
            self.doing = Doing::marching();
        }
        Ok(false)
    }

    /// Refines what has been marched.
    fn refining(&mut self, engine: &mut Engine) -> Result<Doing> {
        if let Some(mut caching) = engine.caching() {
            self.refinement = Some(Refinement::of(caching.marched()?));
        }
        Ok(Doing::Refining)
    }

    fn refine_on(&mut self, engine: &mut Engine, shown: &Image) -> Result<bool> {
        if !self.take_samples(engine)? || !self.is_showing_due(engine.totals().samples) {
            return Ok(false);
        }
        let began = Instant::now();
        self.show_samples(engine, shown)?;
        self.next_showing = Instant::now() + began.elapsed().mul_f64(SHOWING_SHARE);
        if self.is_good_enough(engine.totals().samples) {
            self.doing = Doing::Nothing;
        }
        Ok(true)
    }

    /// Takes samples for about the time of a frame's work: a fast device takes many in it. Returns whether the last one has
    /// ended.
    fn take_samples(&mut self, engine: &mut Engine) -> Result<bool> {
        engine.set_slice_ms(RESTING_MS);
        let began = Instant::now();
        loop {
            let samples = engine.totals().samples;
            let left = self.most_samples.saturating_sub(samples);
            let unit = sixteenth(samples).min(left).max(1);
            if !engine.advance_unit(unit)? {
                return Ok(false);
            }
            let has_time = began.elapsed().as_secs_f64() * 1e3 < RESTING_MS / 2.0;
            if !has_time || self.is_showing_due(engine.totals().samples) {
                return Ok(true);
            }
        }
    }

    /// Whether so many samples are to be shown now: they can be compared with the march, or are the last ones, or those that
    /// are shown are old.
    fn is_showing_due(&self, samples: u32) -> bool {
        let can_be_compared = self.refinement.as_ref().is_some_and(|r| r.is_due(samples));
        can_be_compared || samples >= self.most_samples || Instant::now() >= self.next_showing
    }

    fn moving_size(&self, engine: &Engine) -> [u32; 2] {
        let scale = self.scale;
        engine
            .scene()
            .render
            .size
            .map(|n| ((n as f64 * scale).round() as u32).clamp(1, n))
    }
}

impl Doing {
    fn marching() -> Doing {
        Doing::Marching {
            slices: ReadingSlices::new(RESTING_MS),
            began: Instant::now(),
        }
    }
}
