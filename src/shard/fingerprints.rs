//! The header and sums that a render adds to its EXRs if they are shards.

use crate::engine::Engine;
use crate::error::{Error, Place, Result};
use crate::render::{Sums, Variant};
use crate::scene::Scene;
use crate::scene::volume::Volume;
use crate::shard::{Fingerprint, Header, Identity, volume_fingerprint};

/// Fingerprints that all pictures of a run have in common.
pub struct Fingerprints {
    /// Fingerprint of the volume.
    pub volume: String,
    /// Fingerprint of the filling of the cache, if there is one.
    pub fill: Option<String>,
}

impl Fingerprints {
    pub fn of_volume(volume: &Volume) -> Result<Fingerprints> {
        Ok(Fingerprints {
            volume: volume_fingerprint(volume)?,
            fill: None,
        })
    }

    /// To be called when the cache has been filled.
    pub fn add_fill(&mut self, engine: &mut Engine) -> Result<()> {
        self.fill = fill(engine)?;
        Ok(())
    }

    /// The header of the picture so far, which is one of `scene`; `text` describes it.
    pub fn header(
        &self,
        engine: &Engine,
        scene: &Scene,
        text: &str,
        sums: &Sums,
    ) -> Result<Header> {
        let identity = Identity::of(engine, scene, text, &self.volume)?;
        Ok(Header::of(engine, identity, sums, self.fill.as_deref()))
    }
}

fn fill(engine: &mut Engine) -> Result<Option<String>> {
    let Some(mut caching) = engine.caching() else {
        return Ok(None);
    };
    let mut fingerprint = Fingerprint::default();
    caching.save_light(&mut |bytes| {
        fingerprint.add(bytes);
        Ok(())
    })?;
    Ok(Some(fingerprint.text()))
}

/// Fails for `published`, whose samples have no numbers.
pub fn check_variant(variant: &Variant, flag: &str) -> Result<()> {
    match variant {
        Variant::Published => Err(Error::input(
            Place::flag(flag),
            "the variant \"published\" has no samples by number; use another one",
        )),
        _ => Ok(()),
    }
}
