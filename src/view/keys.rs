//! The keyboard: one table, from which the help that H shows is made, too.

use egui::{Event, Key, Modifiers, Ui};

/// A request of the user that is not a change of the scene's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
    PassTimes,
    Memory,
    FullScreen,
    Help,
    Panels,
    /// Opens another of the volumes in the open folder.
    Series(u32),
    /// A request to the open scene.
    Scene(SceneAction),
}

/// A request that needs an open scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SceneAction {
    Home,
    /// One of the six sides.
    View(usize),
    Clip,
    NextVariant,
    SaveImage,
    SaveScene,
    Undo,
    Redo,
}

use Action::*;
use SceneAction::*;

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
    plain(Key::R, Scene(Home), ["R", "the initial view"]),
    plain(
        Key::Num1,
        Scene(View(0)),
        ["1 – 6", "views from the six sides"],
    ),
    plain(Key::Num2, Scene(View(1)), BY_VIEW),
    plain(Key::Num3, Scene(View(2)), BY_VIEW),
    plain(Key::Num4, Scene(View(3)), BY_VIEW),
    plain(Key::Num5, Scene(View(4)), BY_VIEW),
    plain(Key::Num6, Scene(View(5)), BY_VIEW),
    plain(Key::C, Scene(Clip), ["C", "clip plane, on and off"]),
    plain(Key::V, Scene(NextVariant), ["V", "next variant"]),
    plain(Key::P, PassTimes, ["P", "times of the passes"]),
    plain(Key::M, Memory, ["M", "memory"]),
    plain(Key::F, FullScreen, ["F", "full screen"]),
    plain(Key::U, Panels, ["U", "panels, on and off"]),
    plain(Key::I, Scene(SaveImage), ["I", "save the picture"]),
    plain(Key::S, Scene(SaveScene), ["S", "save the scene"]),
    plain(Key::H, Help, ["H", "this help"]),
    with(
        Modifiers::COMMAND.plus(Modifiers::SHIFT),
        Key::Z,
        Scene(Redo),
        ["Ctrl Shift Z", "redo"],
    ),
    with(Modifiers::COMMAND, Key::Z, Scene(Undo), ["Ctrl Z", "undo"]),
];

const MOUSE: [[&str; 2]; 8] = [
    ["left drag", "rotate"],
    ["middle drag, Shift left", "pan"],
    ["wheel", "closer, farther"],
    ["right drag", "window and level"],
    ["Shift wheel", "isovalue"],
    ["double click on the plot", "add a point"],
    ["right click on a point, Delete", "remove it"],
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
