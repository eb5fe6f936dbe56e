//! The cache's state between two batches, or after the last, on its way to a file and back: another renderer of the same
//! scene continues from it as if nothing had happened.
//!
//! Large parts stream through the staging buffer, piece by piece: first the light, then what each brick has had, then
//! the last measurement. Their size follows from the cache's layout and from [`CacheState`].

use std::time::Duration;

use bytemuck::Zeroable;
use serde::{Deserialize, Serialize};

use super::Cache;
use super::caching::Caching;
use super::error::Measured;
use super::filling::{Filling, FillingWork};
use super::focus::Focus;
use super::sight::{Sight, ViewState};
use crate::error::{Error, Result};
use crate::render::copy::{self, Sink, Source};

/// Bytes that a file holds of each brick: its share, and the paths that its nodes have had.
const BRICK_BYTES: u64 = (size_of::<u8>() + size_of::<u32>()) as u64;

/// What a file keeps of a cache besides its light.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CacheState {
    #[serde(flatten)]
    filling: Filling,
    #[serde(flatten)]
    work: FillingWork,
    /// Named as in older files.
    #[serde(rename = "is_wide")]
    serves_all_views: bool,
    all_from: Option<u32>,
    /// Named as in older files.
    #[serde(rename = "has_looked")]
    is_weighed: bool,
    bricks: usize,
    /// Pixels of the last measurement, and those of what a picture at rest takes.
    shown: usize,
    shown_at_rest: usize,
}

impl Cache {
    fn state(&self) -> CacheState {
        let Sight { focus, view, .. } = &self.sight;
        let measured = Measured::pictures(view.measured.as_ref());
        let [shown, shown_at_rest] = measured.map(<[_]>::len);
        CacheState {
            filling: self.filling,
            work: self.work,
            serves_all_views: self.sight.serves_all_views,
            all_from: focus.all_from,
            is_weighed: view.is_weighed,
            bricks: focus.had.len(),
            shown,
            shown_at_rest,
        }
    }

    /// Bytes of light that a file holds.
    fn light_bytes(&self) -> u64 {
        self.memory.images().map(|image| image.desc().bytes()).sum()
    }
}

impl CacheState {
    /// The time that the filling has taken.
    pub fn took(&self) -> Duration {
        self.filling.took
    }

    /// Bytes that stream, in a cache with `light` bytes of light.
    fn bytes(&self, light: u64) -> Option<u64> {
        let bricks = (self.bricks as u64).checked_mul(BRICK_BYTES)?;
        let measured = (self.shown as u64).checked_add(self.shown_at_rest as u64)?;
        let measured = measured.checked_mul(size_of::<[f32; 4]>() as u64)?;
        light.checked_add(bricks)?.checked_add(measured)
    }
}

impl Caching<'_> {
    /// Paths that the nodes in sight have had.
    pub fn updates(&self) -> u32 {
        self.cache.filling.updates
    }

    /// Streams the cache's light.
    pub fn save_light(&mut self, sink: &mut Sink<'_>) -> Result<()> {
        for image in self.cache.memory.images() {
            copy::download_pieces(
                self.frame,
                &mut self.r.staging,
                image,
                image.desc().extent,
                sink,
            )?;
        }
        Ok(())
    }

    /// Streams what follows the light in the cache's state. In the middle of a batch, the cache must get no more paths.
    pub fn save_rest(&mut self, sink: &mut Sink<'_>) -> Result<CacheState> {
        let Sight { focus, view, .. } = &self.cache.sight;
        let shares: Vec<u8> = focus.shares.iter().map(|share| share.byte()).collect();
        sink(&shares)?;
        sink(bytemuck::cast_slice(&focus.had))?;
        for picture in Measured::pictures(view.measured.as_ref()) {
            sink(bytemuck::cast_slice(picture))?;
        }
        Ok(self.cache.state())
    }

    /// Bytes that [`restore`](Caching::restore) reads; `None` if the state does not belong to a cache of this layout.
    pub fn bytes_of(&self, state: &CacheState) -> Option<u64> {
        let bricks = self.cache.memory.active_bricks() as usize;
        let pixels = self.r.size[0] as usize * self.r.size[1] as usize;
        let fits = state.bricks == bricks && state.shown.max(state.shown_at_rest) <= pixels;
        fits.then(|| state.bytes(self.cache.light_bytes()))?
    }

    /// Continues from a state that [`save_light`](Caching::save_light) and [`save_rest`](Caching::save_rest) have
    /// streamed.
    ///
    /// # Errors
    ///
    /// If the state is that of another layout, or if the source fails. The cache is empty then.
    pub fn restore(&mut self, state: &CacheState, source: &mut Source<'_>) -> Result<()> {
        self.cache.clear();
        if self.bytes_of(state).is_none() {
            return Err(Error::value("the cache's state is that of another layout"));
        }
        for image in self.cache.memory.images() {
            let extent = image.desc().extent;
            copy::upload_pieces(self.frame, &mut self.r.staging, image, extent, source)?;
        }
        let (mut shares, mut had) = (vec![0; state.bricks], vec![0u32; state.bricks]);
        source(&mut shares)?;
        source(bytemuck::cast_slice_mut(&mut had))?;
        let mut picture = |pixels| {
            let mut texels = vec![<[f32; 4]>::zeroed(); pixels];
            source(bytemuck::cast_slice_mut(&mut texels)).map(|()| texels)
        };
        let pictures = [picture(state.shown)?, picture(state.shown_at_rest)?];
        let mut focus = Focus::everywhere(&self.cache.memory.layout);
        focus.all_from = state.all_from;
        let Some(focus) = focus.restored(&shares, had, state.filling.updates) else {
            return Err(Error::value(
                "the cache's state is damaged: its numbers of paths are impossible",
            ));
        };
        let cache = &mut *self.cache;
        cache.is_blank = false;
        cache.filling = state.filling;
        cache.work = state.work;
        cache.sight.serves_all_views = state.serves_all_views;
        cache.sight.focus = focus;
        cache.sight.view = ViewState {
            is_preview: false,
            is_weighed: state.is_weighed,
            measured: Measured::from_pictures(pictures),
        };
        Ok(())
    }
}
