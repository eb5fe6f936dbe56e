//! The panels beside the picture. Each changes the session's scene directly; the frame then brings the GPU up to date
//! with it.

mod lights;
mod medium;
mod presets;
pub mod render;
mod series;
mod surfaces;
mod transfer;

use std::cell::RefCell;
use std::ops::RangeInclusive;

use egui::{CollapsingHeader, Color32, Id, Key, Panel, ScrollArea, SliderClamping, Ui};

use super::keys::{Action, SceneAction};
use super::session::Session;

/// Width of the panels in points.
const WIDTH: f32 = 256.0;
/// Width of a slider's rail, so that its figure and its name have room beside it.
const RAIL: f32 = 76.0;

/// Shows the panels at the right side of `ui`; returns the actions of their buttons.
pub fn show(ui: &mut Ui, session: &mut Session) -> Vec<Action> {
    let mut actions = Vec::new();
    note_escape(ui);
    let panel = Panel::right("panels").exact_size(WIDTH).resizable(false);
    panel.show(ui, |ui| {
        buttons(ui, session, &mut actions);
        ui.separator();
        ScrollArea::vertical().show(ui, |ui| {
            ui.spacing_mut().slider_width = RAIL;
            ui.spacing_mut().item_spacing.x = 6.0;
            if session.series.len() > 1 {
                section(ui, "Series", true, |ui| {
                    actions.extend(series::show(ui, session));
                });
            }
            section(ui, "Presets", false, |ui| presets::show(ui, session));
            section(ui, "Transfer function", true, |ui| {
                transfer::show(ui, session)
            });
            section(ui, "Medium", false, |ui| medium::show(ui, session));
            section(ui, "Surfaces", true, |ui| surfaces::show(ui, session));
            section(ui, "Lights", false, |ui| lights::show(ui, session));
            section(ui, "Render", false, |ui| render::show(ui, session));
        });
    });
    actions
}

fn buttons(ui: &mut Ui, session: &Session, actions: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        let mut button = |text: &str, is_enabled: bool, action: Action, tip: &str| {
            let button = ui.add_enabled(is_enabled, egui::Button::new(text));
            if button.on_hover_text(tip).clicked() {
                actions.push(action);
            }
        };
        let history = &session.history;
        let [undo, redo] = [SceneAction::Undo, SceneAction::Redo].map(Action::Scene);
        button("Undo", history.can_undo(), undo, "Ctrl Z");
        button("Redo", history.can_redo(), redo, "Ctrl Shift Z");
        button(
            "Save",
            true,
            Action::Scene(SceneAction::SaveScene),
            "S: the scene, for `isolume render`",
        );
        button("Help", true, Action::Help, "H");
    });
}

fn section(ui: &mut Ui, title: &str, is_open: bool, contents: impl FnOnce(&mut Ui)) {
    CollapsingHeader::new(title)
        .default_open(is_open)
        .show_unindented(ui, |ui| {
            contents(ui);
            ui.add_space(4.0);
        });
}

/// Moves the selected isovalue away from any equal one, since two surfaces of one value are an error in a scene.
pub fn separate_isovalues(session: &mut Session) {
    let [low, high] = session.document.opened.volume.range;
    let chosen = session.chosen.surface;
    let iso = &mut session.scene.surfaces.iso;
    let mut others: Vec<f64> = iso.iter().map(|s| s.value).collect();
    if chosen < others.len() {
        others.remove(chosen);
        iso[chosen].value = apart(iso[chosen].value, &others, [low, high]);
    }
}

/// The least difference to `value` that is not lost in a float's precision.
fn least_step(value: f64) -> f64 {
    (2e-7 * value.abs()).max(f32::MIN_POSITIVE.into())
}

/// The next value from `value` upwards that is none of `others`, or downwards where the data's range ends, in steps that are
/// small in it, and not below [`least_step`].
fn apart(value: f64, others: &[f64], [low, high]: [f64; 2]) -> f64 {
    let step = least_step(value).max(1e-4 * (high - low));
    let is_free = |value: &f64| !others.contains(value);
    let places = |sign: f64| (0..=others.len()).map(move |n| value + sign * n as f64 * step);
    let up = places(1.0).find(is_free).filter(|value| *value <= high);
    up.or(places(-1.0).find(is_free)).unwrap_or(value)
}

/// A named slider from `low` to `high`; a logarithmic one is fine near zero. A value from elsewhere, as from a scene
/// file, may lie outside, and stays until it is edited.
fn slider(ui: &mut Ui, name: &str, value: &mut f64, [low, high]: [f64; 2], logarithmic: bool) {
    let field = Field::of(ui, *value);
    let slider = egui::Slider::new(value, low..=high)
        .logarithmic(logarithmic)
        .smallest_positive(1e-4)
        .clamping(SliderClamping::Edits)
        // What is typed counts once it is whole: "0.25" begins with 0.
        .update_while_editing(false)
        .custom_formatter(|value, decimals| field.shown(value, decimals))
        .custom_parser(|text| field.read(text))
        .text(name);
    ui.add(slider);
}

/// A field with a number of which not all digits are shown: a text that nobody has edited, or whose edit Escape has ended,
/// stands for the number as it was.
struct Field {
    value: f64,
    is_cancelled: bool,
    text: RefCell<String>,
}

impl Field {
    fn of(ui: &Ui, value: f64) -> Field {
        let was_cancelled = ui.data(|data| data.get_temp(cancelled()));
        Field {
            value,
            is_cancelled: was_cancelled.unwrap_or(false),
            text: RefCell::default(),
        }
    }

    fn shown(&self, value: f64, decimals: RangeInclusive<usize>) -> String {
        let text = figure(value, decimals);
        self.text.replace(text.clone());
        text
    }

    fn read(&self, text: &str) -> Option<f64> {
        if self.is_cancelled || *self.text.borrow() == text {
            return Some(self.value);
        }
        let plain: String = text.chars().filter(|c| !c.is_whitespace()).collect();
        plain.replace('−', "-").parse().ok()
    }
}

/// Whether Escape was pressed in this pass or the one before: egui reads a field that it has left in the pass after that.
fn cancelled() -> Id {
    Id::unique("an edit was cancelled")
}

/// Notes whether fields are left by Escape, once a pass and before they are shown.
fn note_escape(ui: &Ui) {
    let is_pressed = ui.input(|i| i.key_pressed(Key::Escape));
    let was_pressed: Option<bool> = ui.data(|data| data.get_temp(escape()));
    ui.data_mut(|data| {
        data.insert_temp(cancelled(), is_pressed || was_pressed.unwrap_or(false));
        data.insert_temp(escape(), is_pressed);
    });
}

fn escape() -> Id {
    Id::unique("escape")
}

/// A number for a field of the panels, which has room for ten characters or so.
fn figure(value: f64, decimals: RangeInclusive<usize>) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let is_long = !(1e-4..1e7).contains(&value.abs());
    if is_long {
        format!("{value:.2e}")
    } else {
        egui::emath::format_with_decimals_in_range(value, decimals)
    }
}

/// A linear colour as a button that opens a picker. Returns whether it has changed.
fn color(ui: &mut Ui, rgb: &mut [f64; 3]) -> bool {
    let mut edited = rgb.map(|c| c as f32);
    let changed = ui.color_edit_button_rgb(&mut edited).changed();
    if changed {
        *rgb = edited.map(|c| f64::from(c).clamp(0.0, 1.0));
    }
    changed
}

/// A linear colour in egui's format.
fn display(rgb: [f64; 3]) -> Color32 {
    let [r, g, b] = rgb.map(|c| c as f32);
    egui::Rgba::from_rgb(r, g, b).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_isovalues_part_in_any_data() {
        for (value, range) in [
            (5.0, [5.0; 2]),
            (0.0, [0.0; 2]),
            (-1e30, [-1e30; 2]),
            (150.0, [0.0, 255.0]),
            (255.0, [0.0, 255.0]),
        ] {
            let second = apart(value, &[value], range);
            let third = apart(value, &[value, second], range);
            let values = [value, second, third].map(|value| value as f32);
            assert!(values[0] != values[1] && values[1] != values[2] && values[2] != values[0]);
            let [low, high]: [f64; 2] = range;
            assert!((third - value).abs() < 1e-3 * (high - low).max(value.abs()).max(1.0));
            assert!(high == low || third <= high, "{third} is beyond the data");
        }
        assert_eq!(apart(5.0, &[4.0], [5.0; 2]), 5.0);
    }

    #[test]
    fn a_text_that_nobody_has_edited_is_the_number_itself() {
        let field = |is_cancelled| Field {
            value: 37.567_89,
            is_cancelled,
            text: RefCell::default(),
        };
        let edited = field(false);
        assert_eq!(edited.shown(37.567_89, 0..=3), "37.568");
        assert_eq!(edited.read("37.568"), Some(37.567_89));
        assert_eq!(edited.read(" −1 033.5"), Some(-1033.5));
        assert_eq!(edited.read("abc"), None);
        assert_eq!(field(true).read("33"), Some(37.567_89));
    }

    #[test]
    fn a_slider_that_is_shown_changes_nothing() {
        let mut value = 40.0;
        let mut shown = false;
        let mut output = egui::Context::default().run_ui(egui::RawInput::default(), |ui| {
            slider(ui, "exposure", &mut value, [-6.0, 6.0], false);
            slider(ui, "density", &mut value, [0.0, 6.0], true);
            shown = true;
        });
        // Nothing draws this interface.
        output.textures_delta.clear();
        assert!(shown && value == 40.0, "{value}");
    }
}
