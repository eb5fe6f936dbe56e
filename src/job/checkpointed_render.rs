//! What a checkpoint belongs to.

use std::path::PathBuf;

use super::views::View;
use crate::cli::RenderArgs;
use crate::engine::{Engine, Stop};
use crate::error::Result;
use crate::output::Format;
use crate::scene::{Opened, Scene, describe};
use crate::shard::{Found, Identity, Manner, Named};

/// The render whose state is written.
pub struct CheckpointedRender<'a> {
    pub args: &'a RenderArgs,
    pub opened: &'a Opened,
    pub views: &'a [View],
    pub stop: Stop,
    /// Whether it is not known yet which variant is the fastest: a checkpoint would decide it for good.
    pub is_variant_open: bool,
}

impl CheckpointedRender<'_> {
    pub fn manner(&self) -> Manner {
        let is_png = |file: &PathBuf| matches!(Format::of(file), Ok(Format::Png));
        let has_pngs = self.views.iter().flat_map(|view| &view.files).any(is_png);
        Manner::of(&self.stop, &self.opened.scene.render, has_pngs)
    }

    /// Fails if the checkpoint belongs to another render. Returns the identity of this one's scene as it was opened.
    pub fn check(
        &self,
        found: &Found,
        manner: &Manner,
        engine: &Engine,
        volume: &str,
    ) -> Result<Identity> {
        let CheckpointedRender { opened, views, .. } = *self;
        let (identity, text) = identified(engine, opened, &opened.scene, volume)?;
        let number = found.state().map_or(1, |state| state.picture);
        let view = views.get(number.saturating_sub(1) as usize);
        let scene = view.map_or(&opened.scene, |view| &view.scene);
        let (picture, picture_text) = identified(engine, opened, scene, volume)?;
        let wanted = |identity, scene| Named {
            name: "this render",
            identity,
            scene,
        };
        found.check(
            &wanted(&picture, &picture_text),
            &wanted(&identity, &text),
            &self.stop,
            manner,
            views.len(),
        )?;
        Ok(identity)
    }
}

/// The identity of pictures of a scene, and the scene's text.
fn identified(
    engine: &Engine,
    opened: &Opened,
    scene: &Scene,
    volume: &str,
) -> Result<(Identity, String)> {
    let text = describe(&opened.file, &opened.volume, scene);
    Ok((Identity::of(engine, scene, &text, volume)?, text))
}
