//! The light of a cache on its way from one engine to another: a scene may need other passes, and still have the same light,
//! as where another shading of a surface in `local` light is chosen.

use super::Engine;
use crate::error::Result;
use crate::render::{CacheState, Variant};
use crate::scene::Scene;

/// The state of a cache, in the host's memory.
pub struct SavedLight {
    variant: Variant,
    state: CacheState,
    bytes: Vec<u8>,
}

impl Engine {
    /// The light that the cache holds, if there is any and if it is right for `scene`, which has the same volume. A batch of
    /// paths under way is lost.
    pub fn light_for(&mut self, scene: &Scene) -> Result<Option<SavedLight>> {
        let next = self.full.changed_to(scene, &self.volume);
        let is_right = self.full.shares_light_with(&next);
        let Some(mut caching) = self
            .renderer
            .caching()
            .filter(|c| is_right && c.updates() > 0)
        else {
            return Ok(None);
        };
        let mut bytes = Vec::new();
        let mut sink = |piece: &[u8]| {
            bytes.extend_from_slice(piece);
            Ok(())
        };
        caching.abandon();
        caching.save_light(&mut sink)?;
        let state = caching.save_rest(&mut sink)?;
        Ok(Some(SavedLight {
            variant: self.full.variant.clone(),
            state,
            bytes,
        }))
    }

    /// Takes over the light of another engine, if the cache has the same layout. Returns whether it has.
    pub fn adopt_light(&mut self, light: &SavedLight) -> Result<bool> {
        let has_same_layout = self.full.variant == light.variant;
        let Some(mut caching) = self.renderer.caching().filter(|_| has_same_layout) else {
            return Ok(false);
        };
        if caching.bytes_of(&light.state) != Some(light.bytes.len() as u64) {
            return Ok(false);
        }
        let mut rest = &light.bytes[..];
        caching.restore(&light.state, &mut |piece| {
            let (next, after) = rest.split_at(piece.len());
            piece.copy_from_slice(next);
            rest = after;
            Ok(())
        })?;
        // The other engine may have looked from elsewhere.
        drop(caching.take_view_state());
        Ok(true)
    }
}
