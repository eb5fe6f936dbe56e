//! Controls for how the picture is made and shown.

use egui::{ComboBox, Ui};

use super::slider;
use crate::scene::{CacheFormat, CacheScale, Tone, Variant};
use crate::view::session::Session;

/// The variants in the order in which the key V selects them.
pub const VARIANTS: [(&str, Variant); 3] = [
    (Variant::Auto.name(), Variant::Auto),
    (Variant::Caching.name(), Variant::Caching),
    (Variant::NonCaching.name(), Variant::NonCaching),
];
const SCALES: [(&str, CacheScale); 5] = [
    ("auto", CacheScale::Auto),
    ("1", CacheScale::Fixed(1.0)),
    ("½", CacheScale::Fixed(0.5)),
    ("¼", CacheScale::Fixed(0.25)),
    ("⅛", CacheScale::Fixed(0.125)),
];
const FORMATS: [(&str, CacheFormat); 3] = [
    ("auto", CacheFormat::Auto),
    ("16-bit", CacheFormat::F16),
    ("32-bit", CacheFormat::F32),
];
const TONES: [(&str, Tone); 2] = [("linear", Tone::Linear), ("filmic", Tone::Filmic)];

pub fn show(ui: &mut Ui, session: &mut Session) {
    let render = &mut session.scene.render;
    choice(ui, "variant", &mut render.variant, &VARIANTS);
    choice(ui, "cache scale", &mut render.cache_scale, &SCALES);
    choice(ui, "cache format", &mut render.cache_format, &FORMATS);
    choice(ui, "tone", &mut render.tone, &TONES);
    slider(ui, "exposure", &mut render.exposure, [-6.0, 6.0], false);
}

fn choice<T: Copy + PartialEq>(ui: &mut Ui, name: &str, value: &mut T, all: &[(&str, T)]) {
    let now = all.iter().find(|(_, v)| v == value).map_or("", |(n, _)| n);
    ComboBox::from_label(name)
        .selected_text(now)
        .show_ui(ui, |ui| {
            for (name, each) in all {
                ui.selectable_value(value, *each, *name);
            }
        });
}
