//! Operations that a renderer offers where it has a cache: filling it, and marching through it.

use super::sight::ViewState;
use super::{Batch, Cache};
use crate::error::Result;
use crate::gpu::{Frame, Image, SLICE_MS};
use crate::render::bricks::Admission;
use crate::render::copy;
use crate::render::parts::Display;
use crate::render::picture::tone_map::ToneMap;
use crate::render::picture::under_way::UnderWay;
use crate::render::resources::Resources;
use crate::render::until::Until;
use crate::render::volume_reading::ReadingSlices;

/// A renderer of the caching variant, borrowed for its cache.
pub struct Caching<'a> {
    pub(in crate::render) cache: &'a mut Cache,
    pub(in crate::render) frame: &'a mut Frame,
    pub(in crate::render) r: &'a mut Resources,
    pub(in crate::render) tone_map: &'a ToneMap,
    pub(in crate::render) under_way: &'a mut UnderWay,
}

impl Caching<'_> {
    /// Gives nodes the paths of a batch, and measures the error. False if `until` comes before the last path: some nodes have
    /// had the batch then, some not, and it does not count.
    pub fn batch<'a>(&mut self, batch: Batch, until: impl Into<Until<'a>>) -> Result<bool> {
        let until = until.into();
        self.cache.abandon();
        loop {
            if until.is_over() {
                return Ok(false);
            }
            if self.advance(batch, until)? {
                return Ok(true);
            }
        }
    }

    /// Goes on with a batch for a slice of time, or begins one. Returns whether it has ended, and been measured. The
    /// picture under way is lost. Where the volume streams, to begin and to measure takes as long as bricks take to come, unless
    /// `until` comes before.
    pub fn advance<'a>(&mut self, batch: Batch, until: impl Into<Until<'a>>) -> Result<bool> {
        *self.under_way = UnderWay::Nothing;
        self.cache.advance(self.frame, self.r, batch, until.into())
    }

    /// The same while the camera moves: waits for no brick of the volume. [`rest`](Caching::rest) has to follow.
    pub fn advance_in_motion(&mut self, batch: Batch) -> Result<bool> {
        self.cache.sight.in_motion = true;
        let advanced = self.advance(batch, Until::NEVER);
        self.cache.sight.in_motion = false;
        advanced
    }

    /// The camera rests.
    pub fn rest(&mut self) {
        self.cache.sight.rest();
    }

    /// Fills a cache without light with a guess, so that there is something to see until paths have replaced it.
    pub fn guess_light(&mut self) -> Result<()> {
        self.cache.guess(self.frame)
    }

    /// Gives all nodes the same number of paths from now on, as pictures from all sides need it.
    pub fn serve_all_views(&mut self) {
        self.cache.sight.serve_all_views();
    }

    /// Also traces one path from each node out of sight, since the camera is expected to move. Must be called before the
    /// first batch; later it has no effect until the light is forgotten.
    pub fn expect_motion(&mut self) {
        self.cache.sight.expects_motion = true;
    }

    /// Removes and returns what was measured for the current view, so that another view can be rendered temporarily;
    /// [`put_back`](Caching::put_back) restores it.
    pub fn take_view_state(&mut self) -> ViewState {
        std::mem::take(&mut self.cache.sight.view)
    }

    /// Puts back what was known of a view that is the current one again.
    pub fn put_back(&mut self, view: ViewState) {
        self.cache.sight.view = view;
    }

    /// Forgets the batch under way.
    pub fn abandon(&mut self) {
        self.cache.abandon();
    }

    /// Forgets all light.
    pub fn clear(&mut self) {
        self.cache.clear();
    }

    /// The picture that the cache shows at once, row 0 on top.
    pub fn march(&mut self) -> Result<Vec<[f32; 4]>> {
        self.march_in_place()?;
        self.marched()
    }

    /// The picture that has just been marched.
    pub fn marched(&mut self) -> Result<Vec<[f32; 4]>> {
        let r = &*self.r;
        copy::download_picture(self.frame, &r.staging, &r.unit_sum, r.size)
    }

    /// Marches that picture and leaves it on the GPU.
    pub fn march_in_place(&mut self) -> Result<()> {
        *self.under_way = UnderWay::Nothing;
        self.march_another_ray()
    }

    /// Marches another ray of each pixel, and adds it to the mean of those before.
    pub fn march_another_ray(&mut self) -> Result<()> {
        let mut slices = ReadingSlices::new(SLICE_MS);
        while !self.advance_march(&mut slices)? {}
        Ok(())
    }

    /// Number of rays of each pixel whose mean has been marched in this view.
    pub fn rays(&self) -> u32 {
        match *self.under_way {
            UnderWay::Rays(rays) => rays,
            UnderWay::Units(_) | UnderWay::Nothing => 0,
        }
    }

    /// Marches a slice of another ray of each pixel, and adds it to the mean of those before. Returns whether the slice
    /// was the last. A unit of samples under way is lost.
    pub fn advance_march(&mut self, slices: &mut ReadingSlices) -> Result<bool> {
        let rays = self.rays();
        *self.under_way = UnderWay::Rays(rays);
        let has_ended = self.cache.march(self.frame, self.r, rays, slices)?;
        *self.under_way = UnderWay::Rays(rays + u32::from(has_ended));
        Ok(has_ended)
    }

    /// Marches the whole picture in one submission, without slices, and encodes it for display. Meant for pictures of few
    /// pixels, since the device is busy until it ends.
    pub fn march_at_once(&mut self, to: &Image, display: Display) -> Result<()> {
        *self.under_way = UnderWay::Nothing;
        let (r, cache, tone_map) = (&*self.r, &*self.cache, self.tone_map);
        r.without_waiting(self.frame, |frame| {
            let admission = match &r.bricks {
                Some(bricks) => bricks.begin_pixels(frame)?,
                None => Admission::of_slots(),
            };
            frame.run(|recording| {
                r.record_reading(recording, &admission, |recording| {
                    cache.record_march(recording, r)
                })?;
                tone_map.record(recording, &r.unit_sum, r.size, to, display)
            })
        })
    }

    /// Encodes another picture for display, row 0 on top, which takes the place of the last march. A unit of samples under
    /// way is lost.
    pub fn tone_map_texels(
        &mut self,
        picture: &[[f32; 4]],
        to: &Image,
        display: Display,
    ) -> Result<()> {
        *self.under_way = UnderWay::Nothing;
        let r = &mut *self.r;
        copy::upload_picture(self.frame, &mut r.staging, &r.unit_sum, r.size, picture)?;
        self.tone_map(to, display)
    }

    /// Encodes the picture of the last march for display.
    pub fn tone_map(&mut self, to: &Image, display: Display) -> Result<()> {
        let (r, tone_map) = (&*self.r, self.tone_map);
        self.frame
            .run(|recording| tone_map.record(recording, &r.unit_sum, r.size, to, display))
    }
}
