//! Scenes that are opened and edited while the window is open, and the files that it leaves.

use std::process::Command;

use crate::display::Display;
use crate::folder::Folder;
use crate::program::SCENE;

#[test]
fn edits_of_the_command_line_belong_to_its_scene_alone() {
    let folder = Folder::new();
    let display = Display::new();
    let edited = "--set render.exposure=1.5";
    let mut program = folder.view(&display, &format!("scene.toml --spp 2 {edited}"));
    let window = display.window();
    let mut exposure_in = |what_was_said: &str, saved: &str| {
        program.wait_for(what_was_said);
        display.strike(&['s' as u32]);
        program.wait_for(&format!("saved {saved}"));
        let text = String::from_utf8(folder.read(saved)).expect("UTF-8");
        let line = text.lines().find(|line| line.starts_with("exposure"));
        let word = line.and_then(|line| line.split_whitespace().nth(2));
        word.and_then(|w| w.parse::<f64>().ok()).expect("a number")
    };
    assert_eq!(exposure_in("showing", "scene.1.toml"), 1.5);

    // Another volume, and the same scene still.
    folder.write_scene(|scene| scene.replace("[medium]", "spacing = [2, 2, 2]\n[medium]"));
    assert_eq!(exposure_in("showing", "scene.2.toml"), 1.5);

    folder.write("other.toml", SCENE.as_bytes());
    display.drop_file(window, &folder.path("other.toml"));
    assert_eq!(exposure_in("showing", "other.1.toml"), 0.0);

    let changed = SCENE.replace("value = 150", "value = 140");
    folder.write("other.toml", changed.as_bytes());
    assert_eq!(exposure_in("scene file read again", "other.2.toml"), 0.0);

    display.drop_file(window, &folder.path("scene.toml"));
    assert_eq!(exposure_in("showing", "scene.3.toml"), 1.5);
}

/// What an edit has half changed when memory fails is built anew.
#[test]
fn an_edit_survives_a_failing_allocation() {
    let folder = Folder::new();
    let display = Display::new();
    // The first allocation that a start can do without is the edit's.
    let started = (20..100).find_map(|n| {
        let scene = "scene.toml --spp 2 --stats stats.json";
        let mut program = folder.view_failing_allocation(&display, scene, n);
        program.comes_to("picture finished").then_some(program)
    });
    let mut program = started.expect("a start");
    let window = display.window();
    let point = "[[medium.transfer]]\nvalue = 60\nopacity = 0.3\n";
    let last = "[[medium.transfer]]\nvalue = 110";
    folder.write_scene(|scene| scene.replace(last, &format!("{point}{last}")));
    program.wait_for("scene file read again");
    program.wait_for("picture finished");
    display.close(window);
    assert_eq!(program.ended().code(), Some(0), "{:?}", program.said());
    let stats = folder.json("stats.json");
    assert_eq!(stats["builds"], 2, "{stats}");
    let memory = &stats["memory"];
    assert_eq!(memory["planned_bytes"], memory["peak_bytes"], "{memory}");
}

#[test]
fn saving_takes_no_old_files_place() {
    let folder = Folder::new();
    let display = Display::new();
    folder.write("scene.1.exr", b"somebody's");
    folder.write("scene.2.png", b"somebody's");
    let mut program = folder.view(&display, "scene.toml --spp 2");
    display.window();
    program.wait_for("first picture");
    display.strike(&['i' as u32]);
    program.wait_for("saved scene.3.png");
    assert_eq!(folder.read("scene.1.exr"), b"somebody's");
    assert_eq!(folder.read("scene.2.png"), b"somebody's");
    assert!(folder.has("scene.3.exr"));
}

#[test]
fn before_a_scene_is_open_one_sentence_says_that_nothing_can_be_saved() {
    let folder = Folder::new();
    let display = Display::new();
    // A scene that takes as long to open as somebody takes to write it.
    let made = Command::new("mkfifo")
        .arg(folder.path("slow.toml"))
        .status();
    assert!(made.expect("mkfifo").success());
    let mut program = folder.view(&display, "slow.toml --spp 2");
    display.window();
    for key in ['s', 'i'] {
        display.strike(&[key as u32]);
        program.wait_for("there is nothing to save before the scene is open");
    }
    folder.write("slow.toml", SCENE.as_bytes());
    program.wait_for("showing");
}
