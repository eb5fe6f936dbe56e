//! The keyboard: one table, from which the help that H shows is made, too.

use egui::{Event, Key, Modifiers, Ui};

/// A request of the user that is not a change of the scene's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wish {
    Home,
    View(usize),
    Clip,
    NextVariant,
    PassTimes,
    Memory,
    FullScreen,
    SaveImage,
    SaveScene,
    Help,
    Panels,
    Undo,
    Redo,
    /// Opens another of the volumes in the open folder.
    Series(u32),
}

struct Binding {
    key: Key,
    modifiers: Modifiers,
    wish: Wish,
    /// Key and effect, for the help; empty where another line covers them.
    help: [&'static str; 2],
}

const fn plain(key: Key, wish: Wish, help: [&'static str; 2]) -> Binding {
    let modifiers = Modifiers::NONE;
    Binding {
        key,
        modifiers,
        wish,
        help,
    }
}

const fn with(modifiers: Modifiers, key: Key, wish: Wish, help: [&'static str; 2]) -> Binding {
    Binding {
        key,
        modifiers,
        wish,
        help,
    }
}

const BY_VIEW: [&str; 2] = ["", ""];

const BINDINGS: [Binding; 18] = [
    plain(Key::R, Wish::Home, ["R", "back to the first view"]),
    plain(
        Key::Num1,
        Wish::View(0),
        ["1 – 6", "views from the six sides"],
    ),
    plain(Key::Num2, Wish::View(1), BY_VIEW),
    plain(Key::Num3, Wish::View(2), BY_VIEW),
    plain(Key::Num4, Wish::View(3), BY_VIEW),
    plain(Key::Num5, Wish::View(4), BY_VIEW),
    plain(Key::Num6, Wish::View(5), BY_VIEW),
    plain(Key::C, Wish::Clip, ["C", "clip plane, on and off"]),
    plain(Key::V, Wish::NextVariant, ["V", "next variant"]),
    plain(Key::P, Wish::PassTimes, ["P", "times of the passes"]),
    plain(Key::M, Wish::Memory, ["M", "memory"]),
    plain(Key::F, Wish::FullScreen, ["F", "full screen"]),
    plain(Key::U, Wish::Panels, ["U", "panels, on and off"]),
    plain(Key::I, Wish::SaveImage, ["I", "save the picture"]),
    plain(Key::S, Wish::SaveScene, ["S", "save the scene"]),
    plain(Key::H, Wish::Help, ["H", "this help"]),
    with(
        Modifiers::COMMAND.plus(Modifiers::SHIFT),
        Key::Z,
        Wish::Redo,
        ["Ctrl Shift Z", "redo"],
    ),
    with(Modifiers::COMMAND, Key::Z, Wish::Undo, ["Ctrl Z", "undo"]),
];

const MOUSE: [[&str; 2]; 6] = [
    ["left drag", "turn"],
    ["middle drag, Shift left", "shift"],
    ["wheel", "nearer, farther"],
    ["right drag", "window and level"],
    ["Shift wheel", "isovalue"],
    ["drop a file", "open it"],
];

/// The wishes of the keys pressed in this frame; none while the user types into a field.
pub fn wishes(ui: &Ui) -> Vec<Wish> {
    if ui.ctx().egui_wants_keyboard_input() {
        return Vec::new();
    }
    ui.input_mut(|i| {
        // A key that is held down is struck once, but for going back step by step.
        let is_held =
            |event: &Event| matches!(event, Event::Key { key, repeat: true, .. } if *key != Key::Z);
        i.events.retain(|event| !is_held(event));
        let wishes = BINDINGS.iter().flat_map(|b| {
            let times = i.count_and_consume_key(b.modifiers, b.key);
            std::iter::repeat_n(b.wish, times)
        });
        wishes.collect()
    })
}

/// The lines of the help: input and effect.
pub fn help() -> impl Iterator<Item = [&'static str; 2]> {
    let keys = BINDINGS.iter().map(|b| b.help);
    MOUSE.into_iter().chain(keys.filter(|h| *h != BY_VIEW))
}
