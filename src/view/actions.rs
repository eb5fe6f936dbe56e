//! Carries out the actions of keys and buttons.

use glam::DVec3;
use winit::window::Fullscreen;

use super::app::App;
use super::keys::{Action, SceneAction};
use super::panels::render::VARIANTS;
use super::session::Session;
use super::{camera, clip, save};
use crate::error::Result;
use crate::scene::{Camera, Projection, RenderSettings, Variant};

impl App<'_> {
    pub(super) fn carry_out(&mut self, actions: Vec<Action>) {
        for action in actions {
            let done = self.carry_out_one(action);
            match done {
                Ok(Some(text)) => self.tell(text),
                Ok(None) => {}
                Err(error) => self.complain(error),
            }
            self.want_interface();
        }
    }

    /// Carries out one action, and returns a message about it.
    fn carry_out_one(&mut self, action: Action) -> Result<Option<String>> {
        match action {
            Action::PassTimes => self.hud.shows_times ^= true,
            Action::Memory => self.hud.shows_memory ^= true,
            Action::Help => self.hud.shows_help ^= true,
            Action::Panels => self.shows_panels ^= true,
            Action::Series(number) => self.open_series(number),
            Action::FullScreen => self.toggle_full_screen(),
            Action::Scene(action) => return self.carry_out_on_scene(action),
        }
        Ok(None)
    }

    fn carry_out_on_scene(&mut self, action: SceneAction) -> Result<Option<String>> {
        let Some(session) = &mut self.session else {
            let is_about_file = matches!(action, SceneAction::SaveImage | SceneAction::SaveScene);
            return Ok(
                is_about_file.then(|| "there is nothing to save before the scene is open".into())
            );
        };
        match action {
            SceneAction::Home => session.scene.camera = session.home,
            SceneAction::View(n) => session.scene.camera = from_side(session, n),
            SceneAction::Clip => clip::toggle(session),
            SceneAction::Undo => session.history.undo(&mut session.scene),
            SceneAction::Redo => session.history.redo(&mut session.scene),
            SceneAction::NextVariant => {
                let render = &mut session.scene.render;
                let failed = session.chosen.failed_variant.take();
                let failed = failed.filter(|[_, shown]| *shown == render.variant);
                return Ok(next_variant(render, failed.map(|[failed, _]| failed)));
            }
            SceneAction::SaveImage => {
                let path = save::image(session, self.args.seed)?;
                return Ok(Some(format!("saved {}", path.display())));
            }
            SceneAction::SaveScene => {
                let path = save::scene(session)?;
                return Ok(Some(format!("saved {}", path.display())));
            }
        }
        Ok(None)
    }

    fn toggle_full_screen(&self) {
        if let Some(stage) = &self.stage {
            let window = &stage.window;
            window.set_fullscreen(match window.fullscreen() {
                Some(_) => None,
                None => Some(Fullscreen::Borderless(None)),
            });
        }
    }
}

/// Selects the next variant that the other settings allow, and tells its name: the one after the present one, or after the
/// one that was selected and has failed.
fn next_variant(render: &mut RenderSettings, failed: Option<Variant>) -> Option<String> {
    let before = failed.unwrap_or(render.variant);
    let now = VARIANTS.iter().position(|(_, v)| *v == before);
    let others = VARIANTS.iter().cycle().skip(now.unwrap_or(0) + 1);
    for (name, next) in others.take(VARIANTS.len()) {
        render.variant = *next;
        if render.conflict().is_none() {
            return Some(format!("variant: {name}"));
        }
    }
    None
}

/// The camera on one of the six sides, with the whole box in the picture.
fn from_side(session: &Session, n: usize) -> Camera {
    let volume = &session.document.opened.volume;
    let view = camera::named_views(volume.axes)[n];
    let now = &session.scene.camera;
    let Some(back) = view.towards_eye(volume.axes) else {
        return *now;
    };
    let [width, height] = session.scene.render.size;
    let aspect = f64::from(width) / f64::from(height);
    let up = crate::scene::camera::default_up(back, volume.axes);
    let projection = match now.projection {
        // The picture's height holds the whole box, with a little margin.
        Projection::Orthographic { .. } => {
            let [up, back] = [up, back].map(DVec3::from);
            let reach = |axis: DVec3| (DVec3::from(volume.extent()) * axis.abs()).element_sum();
            let height = 1.05 * reach(up).max(reach(up.cross(back)) / aspect);
            Projection::Orthographic { height }
        }
        perspective => perspective,
    };
    Camera::framing(volume.extent(), [0.0; 3], back, up, projection, aspect)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Background, CacheFormat, CacheScale, Tone};

    fn render(variant: Variant) -> RenderSettings {
        RenderSettings {
            size: [4, 4],
            max_bounces: 0,
            variant,
            cache_scale: CacheScale::Auto,
            cache_format: CacheFormat::Auto,
            background: Background::Environment,
            exposure: 0.0,
            tone: Tone::Linear,
        }
    }

    #[test]
    fn after_a_variant_that_failed_comes_the_one_behind_it() {
        let after = |failed| {
            let mut settings = render(Variant::Auto);
            next_variant(&mut settings, failed);
            settings.variant
        };
        assert_eq!(after(None), Variant::Caching);
        assert_eq!(after(Some(Variant::Caching)), Variant::NonCaching);
    }
}
