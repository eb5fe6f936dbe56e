//! What is rendered, and where: what an engine is made for.

use super::{Engine, Host};
use crate::error::Result;
use crate::render::Choice;
use crate::scene::Scene;
use crate::scene::volume::Volume;

/// A scene of a volume on a device, with the seed of its random numbers.
#[derive(Clone, Copy)]
pub struct Setup<'a> {
    pub host: &'a Host,
    pub volume: &'a Volume,
    pub scene: &'a Scene,
    pub seed: u32,
}

impl Setup<'_> {
    /// An engine that renders it in the variant of `choice`; see [`Engine::with_plan`].
    pub fn engine(&self, choice: Choice) -> Result<Engine> {
        Engine::with_plan(self.host, self.volume, self.scene, choice, self.seed)
    }
}
