//! The scene on the GPU: the engine, the scene that it has, and the picture that it makes.

use std::sync::Arc;

use super::document::Document;
use super::planned::Planned;
use crate::engine::{Changed, Engine, Host, ProgressivePicture, SavedLight};
use crate::error::{Error, Location, MemoryError, Result};
use crate::gpu::{Image, Memory};
use crate::scene::{Scene, Variant};

/// The description from which an engine is made.
pub struct BuildOrder {
    pub host: Host,
    /// The memory gate, which the window's own images use as well.
    pub memory: Arc<Memory>,
    pub planned: Planned,
    /// Its size is that of the picture.
    pub scene: Scene,
    pub seed: u32,
    /// The most samples of each pixel in a picture at rest.
    pub samples: u32,
    /// Bytes that the window needs.
    pub for_window: u64,
    /// The light of the renderer before, if it is right for the scene.
    pub light: Option<SavedLight>,
}

pub struct Live {
    pub engine: Engine,
    pub picture: ProgressivePicture,
    planned: Planned,
}

impl Live {
    /// Fails soon where the document is closed meanwhile.
    pub fn build(order: BuildOrder, document: &Document) -> Result<Live> {
        let BuildOrder {
            host,
            memory,
            planned,
            scene,
            seed,
            samples,
            for_window,
            light,
        } = order;
        if scene.render.variant == Variant::Published {
            return Err(Error::input(
                Location::default().with_key("render.variant"),
                "found \"published\", a baseline that `isolume render` measures \
                 against; the window shows \"auto\", \"caching\" and \"non-caching\"",
            ));
        }
        let volume = &document.opened.volume;
        document.check_wanted()?;
        let choice = host
            .plan_beside(volume, &scene, for_window)
            .map_err(|error| beside_window(error, for_window))?;
        document.check_wanted()?;
        planned.note(choice.plan.bytes() + for_window);
        let mut engine = Engine::in_memory(&host, &memory, volume, &scene, choice, seed)?;
        engine.reserve(for_window);
        if let Some(mut caching) = engine.caching() {
            caching.expect_motion();
            caching.guess_light()?;
        }
        if let Some(light) = light {
            engine.adopt_light(&light)?;
        }
        Ok(Live {
            picture: ProgressivePicture::new(&engine, samples),
            engine,
            planned,
        })
    }

    /// Brings the engine up to date with `scene`, and begins the picture anew where the edit makes that necessary.
    pub fn follow(&mut self, scene: &Scene) -> Result<Changed> {
        let changed = self.engine.change_in_place(scene);
        // What was planned counts also where the change stops half way.
        self.note_plan();
        match changed {
            Ok(Changed::Display) => self.picture.is_toned_otherwise = true,
            Ok(Changed::Picture | Changed::Light) => self.picture.restart(),
            Ok(Changed::Nothing | Changed::Impossible) | Err(_) => {}
        }
        changed
    }

    /// Makes pictures of another size from now on, if the budget allows it beside the bytes that the window needs
    /// then.
    pub fn resize(&mut self, size: [u32; 2], for_window: u64) -> Result<bool> {
        self.reserve(for_window);
        let mut scene = self.engine.scene().clone();
        scene.render.size = size;
        let changed = self.follow(&scene)?;
        self.picture.restart();
        Ok(changed != Changed::Impossible)
    }

    /// Spends a slice of time on the picture. Returns whether `shown` has changed.
    pub fn advance(&mut self, shown: &Image) -> Result<bool> {
        self.picture.advance(&mut self.engine, shown)
    }

    /// Sets aside the bytes that the window needs from now on.
    pub fn reserve(&mut self, for_window: u64) {
        self.engine.reserve(for_window);
        self.note_plan();
    }

    fn note_plan(&self) {
        self.planned.note(self.planned_bytes());
    }

    /// Bytes planned for everything, the window included.
    pub fn planned_bytes(&self) -> u64 {
        self.engine.choice().plan.bytes() + self.engine.reserved()
    }
}

fn beside_window(error: Error, window: u64) -> Error {
    match error {
        Error::Memory(why) => MemoryError::BesideWindow {
            window,
            why: Box::new(why),
        }
        .into(),
        other => other,
    }
}
