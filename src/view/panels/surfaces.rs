//! The isosurfaces: a list, and the material of the selected one.

use egui::{ComboBox, Ui};

use super::presets::glossy;
use super::transfer::histogram;
use super::{color, display, slider};
use crate::scene::surface::MOST_SURFACES;
use crate::scene::{Isosurface, LightModel, Normals, Shading};
use crate::view::session::Session;

const HISTOGRAM_HEIGHT: f32 = 34.0;

pub fn show(ui: &mut Ui, session: &mut Session) {
    let [low, high] = session.document.range();
    list(ui, session, [low, high]);
    let index = session.chosen.surface;
    let document = session.document.clone();
    if let Some(surface) = session.scene.surfaces.iso.get_mut(index) {
        let value = surface.value;
        let mark = [(value, display(surface.color))];
        histogram(
            ui,
            &document.histogram,
            [low, high],
            HISTOGRAM_HEIGHT,
            &mark,
        );
        slider(ui, "value", &mut surface.value, [low, high], false);
        slider(ui, "opacity", &mut surface.opacity, [0.0, 1.0], false);
        shading(ui, surface);
    }
    let surfaces = &mut session.scene.surfaces;
    if surfaces.iso.is_empty() {
        return;
    }
    ui.horizontal(|ui| {
        ui.label("light");
        ui.selectable_value(&mut surfaces.light, LightModel::Local, "local")
            .on_hover_text(
                "surfaces are visible to the camera only; the cache is kept when they change",
            );
        ui.selectable_value(&mut surfaces.light, LightModel::Full, "full")
            .on_hover_text("surfaces block and reflect light everywhere");
    });
    ui.horizontal(|ui| {
        ui.label("normals");
        ui.selectable_value(&mut surfaces.normals, Normals::Smooth, "smooth");
        ui.selectable_value(&mut surfaces.normals, Normals::Analytic, "analytic");
    });
}

fn list(ui: &mut Ui, session: &mut Session, [low, high]: [f64; 2]) {
    let iso = &mut session.scene.surfaces.iso;
    let chosen = &mut session.chosen.surface;
    let mut removed = None;
    for (i, surface) in iso.iter_mut().enumerate() {
        ui.horizontal(|ui| {
            color(ui, &mut surface.color);
            ui.radio_value(chosen, i, label(surface.value, high - low));
            if ui.small_button("remove").clicked() {
                removed = Some(i);
            }
        });
    }
    if let Some(i) = removed {
        iso.remove(i);
        *chosen = 0;
    }
    if iso.len() < MOST_SURFACES && ui.button("Add a surface").clicked() {
        let values = iso.iter().map(|surface| surface.value);
        iso.push(Isosurface {
            value: middle_of_gap(values, [low, high]),
            opacity: 1.0,
            color: [0.8; 3],
            shading: Shading::Lambert,
        });
        *chosen = iso.len() - 1;
    }
}

/// The middle of the largest gap that values leave between the ends of a range.
fn middle_of_gap(values: impl Iterator<Item = f64>, [low, high]: [f64; 2]) -> f64 {
    let mut all: Vec<f64> = values
        .filter(|value| (low..=high).contains(value))
        .collect();
    all.extend([low, high]);
    all.sort_by(f64::total_cmp);
    let gaps = all
        .windows(2)
        .max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])));
    gaps.map_or(low, |gap| 0.5 * (gap[0] + gap[1]))
}

/// A value with enough digits to tell surfaces apart in data of this extent.
fn label(value: f64, extent: f64) -> String {
    if value.abs() >= 1e7 {
        return format!("{value:.6e}");
    }
    let digits = (3.0 - extent.log10().floor()).clamp(2.0, 12.0) as i32;
    let unit = 10f64.powi(digits);
    ((value * unit).round() / unit).to_string()
}

const PHONG: Shading = Shading::Phong {
    specular: 0.5,
    shininess: 32.0,
};

fn shading(ui: &mut Ui, surface: &mut Isosurface) {
    let models = [
        ("lambert", Shading::Lambert),
        ("phong", PHONG),
        ("disney", glossy()),
    ];
    let same = |a: &Shading| std::mem::discriminant(a) == std::mem::discriminant(&surface.shading);
    let now = models
        .iter()
        .position(|(_, model)| same(model))
        .unwrap_or(0);
    ComboBox::from_label("shading")
        .selected_text(models[now].0)
        .show_ui(ui, |ui| {
            for (i, (name, model)) in models.into_iter().enumerate() {
                if ui.selectable_label(i == now, name).clicked() && i != now {
                    surface.shading = model;
                }
            }
        });
    for (name, value, range) in parameters(&mut surface.shading) {
        slider(ui, name, value, range, name == "shininess");
    }
}

fn parameters(shading: &mut Shading) -> Vec<(&'static str, &mut f64, [f64; 2])> {
    const UNIT: [f64; 2] = [0.0, 1.0];
    match shading {
        Shading::Lambert => Vec::new(),
        Shading::Phong {
            specular,
            shininess,
        } => vec![
            ("specular", specular, UNIT),
            ("shininess", shininess, [0.0, 1000.0]),
        ],
        Shading::Disney(d) => vec![
            ("roughness", &mut d.roughness, UNIT),
            ("metallic", &mut d.metallic, UNIT),
            ("specular", &mut d.specular, UNIT),
            ("specular tint", &mut d.specular_tint, UNIT),
            ("sheen", &mut d.sheen, UNIT),
            ("sheen tint", &mut d.sheen_tint, UNIT),
            ("subsurface", &mut d.subsurface, UNIT),
            ("clearcoat", &mut d.clearcoat, UNIT),
            ("clearcoat gloss", &mut d.clearcoat_gloss, UNIT),
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::label;

    #[test]
    fn surfaces_are_told_apart_in_data_of_any_extent() {
        assert_eq!(label(0.001234567, 0.004), "0.001235");
        assert_eq!(label(150.0, 255.0), "150");
        assert_eq!(label(300.128, 4095.0), "300.13");
        assert_eq!(label(0.1, 0.0), "0.1");
    }
}
