//! The keyboard: one table, from which the help that H shows is made, too.

use egui::{Event, Key, Modifiers, Ui};

/// A request of the user that is not a change of the scene's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
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
    action: Action,
    /// Key and effect, for the help; empty where another line covers them.
    help: [&'static str; 2],
}

const fn plain(key: Key, action: Action, help: [&'static str; 2]) -> Binding {
    let modifiers = Modifiers::NONE;
    Binding {
        key,
        modifiers,
        action,
        help,
    }
}

const fn with(modifiers: Modifiers, key: Key, action: Action, help: [&'static str; 2]) -> Binding {
    Binding {
        key,
        modifiers,
        action,
        help,
    }
}

const BY_VIEW: [&str; 2] = ["", ""];

const BINDINGS: [Binding; 18] = [
    plain(Key::R, Action::Home, ["R", "back to the first view"]),
    plain(
        Key::Num1,
        Action::View(0),
        ["1 – 6", "views from the six sides"],
    ),
    plain(Key::Num2, Action::View(1), BY_VIEW),
    plain(Key::Num3, Action::View(2), BY_VIEW),
    plain(Key::Num4, Action::View(3), BY_VIEW),
    plain(Key::Num5, Action::View(4), BY_VIEW),
    plain(Key::Num6, Action::View(5), BY_VIEW),
    plain(Key::C, Action::Clip, ["C", "clip plane, on and off"]),
    plain(Key::V, Action::NextVariant, ["V", "next variant"]),
    plain(Key::P, Action::PassTimes, ["P", "times of the passes"]),
    plain(Key::M, Action::Memory, ["M", "memory"]),
    plain(Key::F, Action::FullScreen, ["F", "full screen"]),
    plain(Key::U, Action::Panels, ["U", "panels, on and off"]),
    plain(Key::I, Action::SaveImage, ["I", "save the picture"]),
    plain(Key::S, Action::SaveScene, ["S", "save the scene"]),
    plain(Key::H, Action::Help, ["H", "this help"]),
    with(
        Modifiers::COMMAND.plus(Modifiers::SHIFT),
        Key::Z,
        Action::Redo,
        ["Ctrl Shift Z", "redo"],
    ),
    with(Modifiers::COMMAND, Key::Z, Action::Undo, ["Ctrl Z", "undo"]),
];

const MOUSE: [[&str; 2]; 6] = [
    ["left drag", "turn"],
    ["middle drag, Shift left", "shift"],
    ["wheel", "nearer, farther"],
    ["right drag", "window and level"],
    ["Shift wheel", "isovalue"],
    ["drop a file", "open it"],
];

/// The actions of the keys pressed in this frame; none while the user types into a field.
pub fn actions(ui: &Ui) -> Vec<Action> {
    if ui.ctx().egui_wants_keyboard_input() {
        return Vec::new();
    }
    ui.input_mut(|i| {
        // A key that is held down is struck once, but for going back step by step.
        let is_held =
            |event: &Event| matches!(event, Event::Key { key, repeat: true, .. } if *key != Key::Z);
        i.events.retain(|event| !is_held(event));
        let actions = BINDINGS.iter().flat_map(|b| {
            let times = i.count_and_consume_key(b.modifiers, b.key);
            std::iter::repeat_n(b.action, times)
        });
        actions.collect()
    })
}

/// The lines of the help: input and effect.
pub fn help() -> impl Iterator<Item = [&'static str; 2]> {
    let keys = BINDINGS.iter().map(|b| b.help);
    MOUSE.into_iter().chain(keys.filter(|h| *h != BY_VIEW))
}
