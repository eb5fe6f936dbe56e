//! Suns, and the constant sky.

use egui::{Color32, Pos2, Sense, Stroke, Ui, Vec2};
use glam::{DQuat, DVec3};

use super::{color, display, slider};
use crate::scene::DirectionalLight;
use crate::view::session::Session;

const BRIGHTEST_SUN: f64 = 20.0;
const BRIGHTEST_SKY: f64 = 5.0;
const BALL: f32 = 60.0;
const WHITE: [f64; 3] = [1.0; 3];
/// In radians: any number of turns by it come to different places.
const GOLDEN_ANGLE: f64 = 2.399_963;

pub fn show(ui: &mut Ui, session: &mut Session) {
    let count = session.scene.lights.suns.len();
    for i in 0..count {
        ui.horizontal(|ui| {
            let chosen = &mut session.chosen.sun;
            ui.radio_value(chosen, i, format!("sun {}", i + 1));
            if ui.small_button("remove").clicked() {
                session.scene.lights.suns.remove(i);
                session.chosen.sun = 0;
            }
        });
        if session.scene.lights.suns.len() < count {
            return;
        }
    }
    let index = session.chosen.sun;
    let [forward, right, up] = session.scene.camera.basis();
    if let Some(sun) = session.scene.lights.suns.get_mut(index) {
        ball(ui, sun, [forward, right, up]);
        let dark = session.chosen.sun_hue.filter(|(of, _)| *of == index);
        let mut hue = dark.map_or(WHITE, |(_, hue)| hue);
        brightness(
            ui,
            "irradiance",
            &mut sun.irradiance,
            &mut hue,
            BRIGHTEST_SUN,
        );
        session.chosen.sun_hue = Some((index, hue));
        ui.checkbox(&mut session.chosen.aims_sun, "drag it on the picture");
    }
    if ui.button("Add a sun").clicked() {
        // From another side than those before.
        let turn = DQuat::from_axis_angle(forward, GOLDEN_ANGLE * count as f64);
        let direction = forward + turn * (0.5 * right - up);
        session.scene.lights.suns.push(DirectionalLight {
            direction: direction.normalize().to_array(),
            irradiance: [2.0; 3],
        });
        session.chosen.sun = count;
    }
    ui.separator();
    let sky = &mut session.scene.lights.environment.radiance;
    let mut hue = session.chosen.sky_hue.unwrap_or(WHITE);
    brightness(ui, "sky", sky, &mut hue, BRIGHTEST_SKY);
    session.chosen.sky_hue = Some(hue);
    if session.scene.lights.environment.image.is_some() {
        ui.weak("plus the sky's image");
    }
}

/// Controls for a light's colour and, separately, its brightness. `hue` is the colour that a light of brightness 0 has had
/// before; its largest channel is 1.
fn brightness(ui: &mut Ui, name: &str, rgb: &mut [f64; 3], hue: &mut [f64; 3], most: f64) {
    let bright = rgb.iter().copied().fold(0.0, f64::max);
    if bright > 0.0 {
        *hue = rgb.map(|c| c / bright);
    }
    let mut wanted = bright;
    ui.horizontal(|ui| {
        // The colour's button takes some of the room.
        ui.spacing_mut().slider_width -= 26.0;
        let mut picked = *hue;
        let recolored = color(ui, &mut picked);
        let brightest = picked.iter().copied().fold(0.0, f64::max);
        // The picker's darkness is not the light's: only the proportions count, and black has none.
        if recolored && brightest > 0.0 {
            *hue = picked.map(|c| c / brightest);
        }
        slider(ui, name, &mut wanted, [0.0, most], true);
        if recolored || wanted != bright {
            *rgb = hue.map(|c| c * wanted);
        }
    });
}

/// The side of a ball that faces the viewer, with the place where the sun stands over it; a drag moves it.
fn ball(ui: &mut Ui, sun: &mut DirectionalLight, [forward, right, up]: [DVec3; 3]) {
    let (response, painter) = ui.allocate_painter(Vec2::splat(BALL), Sense::click_and_drag());
    let (center, radius) = (response.rect.center(), 0.46 * BALL);
    let source = -DVec3::from(sun.direction);
    let is_behind = source.dot(forward) > 0.0;
    if let Some(at) = response.interact_pointer_pos() {
        let p = (at - center) / radius;
        let (x, y) = (p.x as f64, -p.y as f64);
        let inside = (1.0 - x * x - y * y).max(0.0).sqrt();
        let depth = if is_behind { inside } else { -inside };
        let wanted = right * x + up * y + forward * depth;
        sun.direction = (-wanted.normalize_or(-forward)).to_array();
    }
    let seen = Vec2::new(source.dot(right) as f32, -source.dot(up) as f32);
    let place: Pos2 = center + seen * radius;
    painter.circle(
        center,
        radius,
        Color32::from_gray(48),
        Stroke::new(1.0, Color32::GRAY),
    );
    painter.line_segment([center, place], Stroke::new(1.0, Color32::GRAY));
    let bright = sun.irradiance.iter().copied().fold(1e-9, f64::max);
    let filled = display(sun.irradiance.map(|c| c / bright));
    if is_behind {
        painter.circle_stroke(place, 5.0, Stroke::new(2.0, filled))
    } else {
        painter.circle_filled(place, 6.0, filled)
    };
    response.on_hover_text("where the light comes from; a ring: from behind");
}
