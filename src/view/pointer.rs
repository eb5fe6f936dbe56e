//! The mouse on the picture.

use egui::{Event, PointerButton, Rect, Response, Sense, Ui, Vec2};
use glam::{DQuat, DVec3};

use super::camera::{orbit, pan, zoom};
use super::session::Session;
use crate::scene::TransferPoint;

/// Share of the data's range by which a step of the wheel moves an isovalue.
const ISOVALUE_STEP: f64 = 0.005;
/// Factor on the width of a window that is dragged over the picture's height.
const WIDTH_PER_HEIGHT: f64 = 4.0;

/// Senses the picture's rectangle and turns, shifts, zooms or re-windows what it shows.
pub fn steer(ui: &mut Ui, rect: Rect, session: &mut Session) {
    let response = ui.interact(rect, ui.scope_id().with("picture"), Sense::click_and_drag());
    let drag = last_drag(&response, ui) / rect.height().max(1.0);
    let drag = [drag.x as f64, drag.y as f64];
    let shift = ui.input(|i| i.modifiers.shift);
    if drag != [0.0; 2] {
        let scene = &mut session.scene;
        let is_by = |button| response.dragged_by(button) || response.drag_stopped_by(button);
        if is_by(PointerButton::Secondary) {
            window_and_level(session, drag);
        } else if is_by(PointerButton::Middle) || shift {
            scene.camera = pan(&scene.camera, drag);
        } else if session.chosen.aims_sun && session.chosen.sun < scene.lights.suns.len() {
            turn_sun(session, drag);
        } else {
            scene.camera = orbit(&scene.camera, drag);
        }
    }
    if response.contains_pointer() {
        let steps = wheel_steps(ui);
        if steps != 0.0 && shift {
            shift_isovalue(session, steps);
        } else if steps != 0.0 {
            session.scene.camera = zoom(&session.scene.camera, steps);
        }
    }
}

/// The pointer's way in points since the last frame, while something is dragged or has just been let go: in a slow frame,
/// that way is long.
pub fn last_drag(response: &Response, ui: &Ui) -> Vec2 {
    if response.dragged() || response.drag_stopped() {
        ui.input(|i| i.pointer.delta())
    } else {
        Vec2::ZERO
    }
}

/// Steps of the wheel in this frame, forward positive; touch pads count in points.
fn wheel_steps(ui: &Ui) -> f64 {
    const POINTS_PER_STEP: f32 = 50.0;
    ui.input(|i| {
        let steps = i.events.iter().map(|event| match event {
            Event::MouseWheel { unit, delta, .. } => {
                let along = match delta.y {
                    0.0 => delta.x,
                    y => y,
                };
                match unit {
                    egui::MouseWheelUnit::Point => along / POINTS_PER_STEP,
                    _ => along,
                }
            }
            _ => 0.0,
        });
        steps.sum::<f32>() as f64
    })
}

fn shift_isovalue(session: &mut Session, steps: f64) {
    let [low, high] = session.document.range();
    let [least, most] = session.document.opened.volume.range;
    let index = session.chosen.surface;
    if let Some(surface) = session.scene.surfaces.iso.get_mut(index) {
        let value = surface.value + steps * ISOVALUE_STEP * (high - low);
        surface.value = value.clamp(least, most);
    }
}

fn window_and_level(session: &mut Session, drag: [f64; 2]) {
    let range = session.document.range();
    if let Some(medium) = &mut session.scene.medium {
        move_window(&mut medium.transfer, drag, range);
    }
}

/// Window and level as in radiology: sideways widens the transfer function, up and down shifts it.
fn move_window(points: &mut [TransferPoint], drag: [f64; 2], [low, high]: [f64; 2]) {
    let (Some(first), Some(last)) = (points.first(), points.last()) else {
        return;
    };
    let middle = 0.5 * (first.value + last.value);
    let factor = WIDTH_PER_HEIGHT.powf(drag[0]);
    let shift = -drag[1] * 0.5 * (high - low);
    for point in points {
        point.value = middle + factor * (point.value - middle) + shift;
    }
}

/// Turns the sun: its source follows the pointer as if it lay on a ball.
fn turn_sun(session: &mut Session, drag: [f64; 2]) {
    let [_, right, up] = session.scene.camera.basis();
    if let Some(sun) = session.scene.lights.suns.get_mut(session.chosen.sun) {
        let about_up = DQuat::from_axis_angle(up, drag[0] * std::f64::consts::PI);
        let about_right = DQuat::from_axis_angle(right, drag[1] * std::f64::consts::PI);
        let turned = about_up * about_right * DVec3::from(sun.direction);
        sun.direction = turned.normalize().to_array();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dragged(drag: [f64; 2]) -> [f64; 2] {
        let mut points = [100.0, 300.0].map(|value| TransferPoint {
            value,
            opacity: 1.0,
            color: [1.0; 3],
        });
        move_window(&mut points, drag, [-1000.0, 1000.0]);
        points.map(|point| point.value)
    }

    #[test]
    fn a_drag_up_over_the_picture_raises_the_level_by_half_the_range() {
        assert_eq!(dragged([0.0, -1.0]), [1100.0, 1300.0]);
        assert_eq!(dragged([0.0, 0.1]), [0.0, 200.0]);
    }

    #[test]
    fn a_drag_to_the_right_widens_the_window_about_its_middle() {
        assert_eq!(dragged([0.5, 0.0]), [0.0, 400.0]);
        assert_eq!(dragged([-0.5, 0.0]), [150.0, 250.0]);
    }
}
