//! The clip plane that C makes, and its handle on the picture: a knob that slides along the normal.

use egui::{Color32, Pos2, Rect, Sense, Stroke, Ui, Vec2, vec2};
use glam::DVec3;

use super::camera::{height_at_target, project};
use super::pointer::last_drag;
use super::session::Session;
use crate::scene::ClipPlane;

const COLOR: Color32 = Color32::from_rgb(255, 190, 60);
const RADIUS: f32 = 7.0;
/// The arrow's length, as a share of the picture's height.
const ARROW: f64 = 0.12;

/// Cuts away the half that faces the viewer, or removes the plane that did so. Planes of the scene file stay. Undoing
/// brings a removed plane back, with its handle.
pub fn toggle(session: &mut Session) {
    let clips = &mut session.scene.clips;
    if let Some(i) = session.chosen.clip.filter(|i| *i < clips.len()) {
        clips.remove(i);
        return;
    }
    let [forward, _, _] = session.scene.camera.basis();
    clips.push(ClipPlane {
        normal: (-forward).to_array(),
        offset: 0.0,
    });
    session.chosen.clip = Some(clips.len() - 1);
}

/// The handle of the plane that [`toggle`] has made.
pub fn handle(ui: &mut Ui, rect: Rect, session: &mut Session) {
    let camera = session.scene.camera;
    let chosen = session.chosen.clip;
    let Some(clip) = chosen.and_then(|i| session.scene.clips.get_mut(i)) else {
        return;
    };
    let normal = DVec3::from(clip.normal);
    let foot = normal * clip.offset;
    let tip = foot + normal * ARROW * height_at_target(&camera);
    let (Some(from), Some(to)) = (project(&camera, foot), project(&camera, tip)) else {
        return;
    };
    let screen = |[x, y]: [f64; 2]| rect.center() + vec2(x as f32, y as f32) * rect.height();
    let (from, to) = (screen(from), screen(to));
    let area = Rect::from_center_size(from, Vec2::splat(3.0 * RADIUS));
    let response = ui.interact(area, ui.scope_id().with("clip"), Sense::drag());
    let drag = last_drag(&response, ui);
    if drag != Vec2::ZERO {
        clip.offset += slide(drag, to - from, &camera, rect);
    }
    draw(ui, from, to, response.hovered() || response.dragged());
}

/// World units along the normal for a drag on the screen, where the normal is seen as `arrow`. A plane whose normal
/// points at the viewer follows the drag upwards.
fn slide(drag: Vec2, arrow: Vec2, camera: &crate::scene::Camera, rect: Rect) -> f64 {
    let world_per_point = height_at_target(camera) / rect.height() as f64;
    let shortest = 0.25 * ARROW as f32 * rect.height();
    if arrow.length() < shortest {
        -drag.y as f64 * world_per_point
    } else {
        let along = drag.dot(arrow) / arrow.length_sq();
        along as f64 * ARROW * height_at_target(camera)
    }
}

fn draw(ui: &Ui, from: Pos2, to: Pos2, is_lit: bool) {
    let painter = ui.painter();
    painter.arrow(from, to - from, Stroke::new(2.0, COLOR));
    let radius = if is_lit { RADIUS * 1.3 } else { RADIUS };
    painter.circle(from, radius, COLOR, Stroke::new(1.5, Color32::BLACK));
}
