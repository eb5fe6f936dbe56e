//! The window from outside: the real program on a display of its own, steered by mouse and keys and
//! judged by what it shows. Vulkan's validation layers watch. Its display is one of X11: it is for Unix.

#![cfg(unix)]

#[path = "../support/curve.rs"]
mod curve;
#[path = "../support/dicom_files.rs"]
mod dicom_files;
#[path = "../support/dicom_scan.rs"]
mod dicom_scan;
#[path = "../support/folder.rs"]
mod folder;
#[path = "../support/number.rs"]
mod number;

mod display;
mod figures;
mod files;
mod hand;
mod program;
mod series;
mod session;
mod soak;
mod window;

use std::time::Duration;

use display::{Area, Display};
use folder::Folder;
use hand::Hand;
use program::WINDOW;
use window::{Window, value_of};

const SHIFT: u32 = 0xFFE1;
const CONTROL: u32 = 0xFFE3;

/// Where the picture is in a window of `WINDOW`'s size, without the words over it.
const PICTURE: Area = [20..236, 110..300];
const MIDDLE: [i16; 2] = [128, 200];

#[test]
fn every_key_may_be_struck_and_every_size_taken() {
    let mut window = Window::open("scene.toml --spp 6");
    window.program.wait_for("first picture");
    window.display.point(MIDDLE);
    for key in "hhpm12345 6rcuucffsvvv".chars().filter(|c| *c != ' ') {
        window.display.strike(&[key as u32]);
    }
    window.program.wait_for("variant: caching");
    for (width, height) in [(300, 200), (1, 1), (700, 90), (512, 384)] {
        window.resize(width, height);
        std::thread::sleep(Duration::from_millis(150));
    }
    window.program.wait_for("picture finished");
    window.display.strike(&['i' as u32]);
    window.program.wait_for("saved scene.1.png");
    window.shoot("keys");
    window.close();
    assert!(window.folder.has("scene.1.exr"));
}

/// The value of the last key of that name.
fn isovalue(scene: &str) -> &str {
    let (_, value) = scene.rsplit_once("\nvalue =").expect("an isovalue");
    value.lines().next().expect("a value")
}

/// As with a hand that is faster than the machine.
#[test]
fn what_one_slow_frame_finds_happens_in_turn() {
    let mut window = Window::open("scene.toml --spp 6");
    window.program.wait_for("picture finished");
    let before = window.saved("scene.1.toml");
    let Window {
        program, display, ..
    } = &window;
    program.while_stopped(|| display.drag(1, MIDDLE, [MIDDLE[0] + 120, MIDDLE[1]]));
    window.program.wait_for("picture finished");
    let turned = window.saved("scene.2.toml");
    assert_ne!(value_of("eye", &before), value_of("eye", &turned));
    let Window {
        program, display, ..
    } = &window;
    program.while_stopped(|| display.holding(SHIFT, || (0..12).for_each(|_| display.click(5))));
    window.program.wait_for("picture finished");
    let shifted = window.saved("scene.3.toml");
    assert_eq!(value_of("eye", &turned), value_of("eye", &shifted));
    assert_ne!(isovalue(&turned), isovalue(&shifted));
    window.close();
}

#[test]
fn without_a_display_one_sentence_says_what_to_do() {
    let folder = Folder::new();
    let output = folder.view_without_display("scene.toml");
    assert_eq!(output.status.code(), Some(5), "{output:?}");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(
        said.contains("isolume render scene.toml -o picture.png"),
        "{said}"
    );
}

#[test]
fn without_descriptions_of_keyboards_a_sentence_names_them() {
    let (folder, display) = (Folder::new(), Display::new());
    let mut command = folder.window(&display, "scene.toml", WINDOW);
    command.env("XKB_CONFIG_ROOT", folder.path("nowhere"));
    let output = command.output().expect("the program starts");
    assert_eq!(output.status.code(), Some(5), "{output:?}");
    let said = String::from_utf8_lossy(&output.stderr);
    // Before the program's own sentence, xkbcommon says what it has looked for.
    let last = said.lines().last().unwrap_or_default();
    assert!(
        last.starts_with("isolume: ") && last.contains("xkb-data"),
        "{said}"
    );
    assert!(!said.contains("panicked"), "{said}");
}

#[test]
fn a_lost_device_ends_with_a_message() {
    let folder = Folder::new();
    let display = Display::new();
    for submission in [0, 3, 12, 40, 100] {
        let mut program = folder.view_losing_device(&display, "scene.toml", submission);
        let status = program.ended();
        assert_eq!(status.code(), Some(5), "{submission}: {:?}", program.said());
        let last = program.said().last().cloned().unwrap_or_default();
        assert!(last.starts_with("isolume: "), "{submission}: {last}");
        assert!(last.contains("failed"), "{submission}: {last}");
    }
}

/// `ISOLUME_SOAK_ACTIONS` says for how long at least, 2700 being some ten minutes. Tests begin in the order of their names: this one,
/// which takes longest, is the first.
#[test]
fn a_hand_at_random_leaves_memory_flat() {
    let actions =
        std::env::var("ISOLUME_SOAK_ACTIONS").map_or(600, |n| n.parse().expect("a count"));
    let mut window = Window::open("scene.toml --spp 6 --quiet");
    let mut hand = Hand::seeded(7);
    let mut resident = Vec::new();
    let mut acted = 0;
    // On a slow machine, fewer of the actions are seen one by one, and it takes more of them to reach what the window needs.
    while acted < actions || !is_flat(&resident) && acted < 4 * actions {
        (0..20).for_each(|_| hand.act(&window));
        acted += 20;
        resident.push(window.program.resident_kib());
    }
    let resizes = &window.close()["resizes"];
    println!("{acted} actions, {resizes} resizes, resident KiB: {resident:?}");
    assert!(is_flat(&resident), "{resident:?}");
}

/// Whether the last quarter is hardly more than the one before.
fn is_flat(resident: &[u64]) -> bool {
    let (_, half) = resident.split_at(resident.len() / 2);
    let (third, last) = half.split_at(half.len() / 2);
    let highest = |all: &[u64]| all.iter().copied().max().unwrap_or(0) as f64;
    highest(last) < 1.04 * highest(third)
}
