//! The axes in a corner of the picture: anatomical letters where the orientation is known, x, y, z
//! otherwise.

use egui::{Align2, Color32, FontId, Pos2, Rect, Stroke, Ui, Vec2};
use glam::DVec3;

use crate::scene::Camera;
use crate::scene::volume::{Anatomical, Axes};

const SIZE: f32 = 34.0;
const COLORS: [Color32; 3] = [
    Color32::from_rgb(235, 95, 85),
    Color32::from_rgb(120, 200, 90),
    Color32::from_rgb(90, 150, 245),
];

pub fn draw(ui: &Ui, rect: Rect, camera: &Camera, axes: Option<Axes>) {
    let center = Pos2::new(rect.left() + SIZE + 20.0, rect.bottom() - SIZE - 20.0);
    let [forward, right, up] = camera.basis();
    let mut ends: Vec<(f64, Vec2, String, Color32)> = Vec::new();
    for (i, color) in COLORS.into_iter().enumerate() {
        for sign in [1.0, -1.0] {
            let axis = DVec3::AXES[i] * sign;
            let seen = Vec2::new(axis.dot(right) as f32, -axis.dot(up) as f32) * SIZE;
            let faint = if sign > 0.0 { 1.0 } else { 0.45 };
            let name = name(i, sign > 0.0, axes);
            ends.push((axis.dot(forward), seen, name, color.gamma_multiply(faint)));
        }
    }
    // The farthest first.
    ends.sort_by(|a, b| b.0.total_cmp(&a.0));
    let painter = ui.painter();
    for (_, seen, name, color) in ends {
        painter.line_segment([center, center + seen], Stroke::new(2.0, color));
        let place = center + seen * 1.28;
        let shadow = place + Vec2::splat(1.0);
        let font = FontId::proportional(12.0);
        painter.text(
            shadow,
            Align2::CENTER_CENTER,
            &name,
            font.clone(),
            Color32::BLACK,
        );
        painter.text(place, Align2::CENTER_CENTER, name, font, color);
    }
}

fn name(axis: usize, grows: bool, axes: Option<Axes>) -> String {
    match axes {
        Some(Axes(sides)) => {
            let side: Anatomical = if grows {
                sides[axis]
            } else {
                sides[axis].opposite()
            };
            side.name()[..1].to_uppercase()
        }
        None if grows => ["x", "y", "z"][axis].into(),
        None => String::new(),
    }
}
