//! What a run's pictures have in common: fingerprints of the volume and of the filling of the cache, by which shards that do
//! not belong together are told apart.

use super::identity::volume_fingerprint;
use super::{Fingerprint, Header, Identity};
use crate::engine::Engine;
use crate::error::Result;
use crate::render::{Caching, Sink, Sums};
use crate::scene::Scene;
use crate::scene::volume::Volume;

/// What the headers of a run's pictures say that its engine does not know.
pub struct Fingerprints {
    /// Fingerprint of the volume.
    pub volume: String,
    /// Fingerprint of the filling of the cache, if there is one.
    pub fill: Option<String>,
    /// The devices and drivers by which earlier runs have rendered the picture.
    pub devices_before: Vec<String>,
}

impl Fingerprints {
    pub fn of_volume(volume: &Volume) -> Result<Fingerprints> {
        Ok(Fingerprints {
            volume: volume_fingerprint(volume)?,
            fill: None,
            devices_before: Vec::new(),
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
        let mut header = Header::of(engine, identity, sums, self.fill.as_deref());
        let mut devices = self.devices_before.clone();
        header.devices.retain(|device| !devices.contains(device));
        devices.append(&mut header.devices);
        header.devices = devices;
        Ok(header)
    }
}

fn fill(engine: &mut Engine) -> Result<Option<String>> {
    let light = |mut caching| save_light(&mut caching, &mut |_| Ok(()));
    engine.caching().map(light).transpose()
}

/// Hands the bytes of a cache's light to `sink`, and returns their fingerprint.
pub(super) fn save_light(caching: &mut Caching<'_>, sink: &mut Sink<'_>) -> Result<String> {
    let mut fingerprint = Fingerprint::default();
    caching.save_light(&mut |bytes| {
        fingerprint.add(bytes);
        sink(bytes)
    })?;
    Ok(fingerprint.text())
}
