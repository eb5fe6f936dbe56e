//! Scenes that are opened and edited while the window is open, and the files that it leaves.

use std::fs::{self, File};
use std::io::Write;
use std::process::Command;
use std::time::Duration;

use crate::MIDDLE;
use crate::display::Display;
use crate::folder::Folder;
use crate::hand::back_to_first_size;
use crate::number::number;
use crate::program::SCENE;
use crate::window::{Window, value_of};

#[test]
fn edits_of_the_command_line_belong_to_its_scene_alone() {
    let mut window = Window::open("scene.toml --spp 2 --set render.exposure=1.5");
    let first = window.saved_after("showing", "scene.1.toml");
    assert_eq!(exposure(&first), 1.5);

    // Another volume, and the same scene still, from the same side.
    let to = [MIDDLE[0] + 60, MIDDLE[1]];
    window.display.drag(1, MIDDLE, to);
    let spaced = |scene: &str| scene.replace("[medium]", "spacing = [2, 2, 2]\n[medium]");
    window.folder.write_scene(spaced);
    let second = window.saved_after("showing", "scene.2.toml");
    assert_eq!(exposure(&second), 1.5);
    assert_ne!(value_of("eye", &first), value_of("eye", &second));

    window.folder.write("other.toml", SCENE.as_bytes());
    window.drop_file("other.toml");
    let other = window.saved_after("showing", "other.1.toml");
    assert_eq!(exposure(&other), 0.0);

    let changed = SCENE.replace("value = 150", "value = 140");
    window.folder.write("other.toml", changed.as_bytes());
    let edited = window.saved_after("scene file read again", "other.2.toml");
    assert_eq!(exposure(&edited), 0.0);

    window.drop_file("scene.toml");
    let third = window.saved_after("showing", "scene.3.toml");
    assert_eq!(exposure(&third), 1.5);
}

impl Window {
    /// The scene as it is saved once something has been said.
    fn saved_after(&mut self, what_was_said: &str, name: &str) -> String {
        self.program.wait_for(what_was_said);
        self.saved(name)
    }
}

fn exposure(scene: &str) -> f64 {
    value_of("exposure", scene).parse().expect("a number")
}

/// A window after its first picture, and the number of its next allocation: a program that is started to fail that one fails
/// right after the picture.
fn opened_on_the_brink() -> (Window, usize) {
    let (folder, display) = (Folder::new(), Display::new());
    let started = (20..100).find_map(|n| {
        let mut program = folder.view_failing_allocation(&display, SPARSE, n);
        if program.comes_to("picture finished") {
            return Some((program, n));
        }
        let status = program.ended();
        let said = program.said();
        assert_eq!(status.code(), Some(4), "{n}: {said:?}");
        let last = said.last().expect("a sentence");
        assert!(last.starts_with("isolume: "), "{n}: {said:?}");
        None
    });
    let (program, n) = started.expect("a start");
    (Window::of(program, display, folder), n)
}

const SPARSE: &str = "scene.toml --spp 2 --stats stats.json";

/// What an edit or a new size of the window has half changed when memory fails is built anew.
#[test]
fn changes_survive_failing_allocations() {
    let (mut window, next) = opened_on_the_brink();
    // More points than the table has room for.
    let point = |n| {
        let value = 60.0 + 0.05 * f64::from(n);
        format!("[[medium.transfer]]\nvalue = {value}\nopacity = 0.3\n")
    };
    let points: String = (0..600).map(point).collect();
    let last = "[[medium.transfer]]\nvalue = 110";
    let with_points = |scene: &str| scene.replace(last, &format!("{points}{last}"));
    window.folder.write_scene(with_points);
    window.program.wait_for("scene file read again");
    window.program.wait_for("picture finished");
    let stats = window.close();
    assert_eq!(stats["builds"], 2, "{stats}");

    // A larger window's first allocation is for the picture that it shows, the second one the renderer's.
    for (later, size, builds) in [(0, "picture: 174x240", 1), (1, "picture: 348x480", 2)] {
        let Window {
            folder, display, ..
        } = window;
        let program = folder.view_failing_allocation(&display, SPARSE, next + later);
        window = Window::of(program, display, folder);
        window.program.wait_for("picture finished");
        window.resize(604, 480);
        window.program.wait_for(size);
        window.program.wait_for("picture finished");
        let stats = window.close();
        assert_eq!(stats["builds"], builds, "{stats}");
    }
}

/// As resizing does it.
#[test]
fn a_budget_too_small_for_all_pixels_opens_with_fewer() {
    const UNCACHED: &str = "scene.toml --spp 2 --variant non-caching";
    let mut window = Window::open(UNCACHED);
    window.program.wait_for("picture finished");
    let needed = number(&window.close()["memory"]["planned_bytes"]);
    let mut window = Window::open(&format!("{UNCACHED} --vram-budget {}", needed - 1.0));
    window.program.wait_for("picture: ");
    window.program.wait_for("picture: ");
    window.program.wait_for("picture finished");
    let memory = &window.close()["memory"];
    assert!(number(&memory["planned_bytes"]) < needed, "{memory}");
}

/// What is open outlives a window that leaves no memory for a picture.
#[test]
fn a_window_that_becomes_too_large_can_be_made_smaller_again() {
    let mut window = Window::open("scene.toml --spp 2 --vram-budget 29200000");
    window.program.wait_for("picture finished");
    window.resize(1300, 1000);
    window.program.wait_for("error: beside");
    back_to_first_size(&window);
    window.program.wait_for("showing");
    window.program.wait_for("picture finished");
    let memory = &window.close()["memory"];
    assert!(number(&memory["peak_bytes"]) <= 29_200_000.0, "{memory}");
}

/// The renderer is taken as it was built, which takes what was planned for that size, and then made smaller.
#[test]
fn a_window_made_smaller_while_a_scene_is_prepared_has_planned_for_both_sizes() {
    let mut window = Window::open("scene.toml --spp 2");
    window.program.wait_for("picture: ");
    window.resize(400, 300);
    window.program.wait_for("showing");
    window.program.wait_for("picture finished");
    window.close();
}

/// A renderer's plan leaves no room for another one, which may still be on its way to the GPU. It takes more than the one that
/// is shown in the end.
#[test]
fn a_scene_dropped_while_another_is_prepared_waits_for_its_memory() {
    let folder = Folder::new();
    let smaller = SCENE.replace(
        "variant = \"caching\"\ncache_scale = 0.25",
        "variant = \"non-caching\"",
    );
    assert_ne!(smaller, SCENE);
    folder.write("other.toml", smaller.as_bytes());
    let mut window = Window::open_in(folder, "scene.toml --spp 2 --vram-budget 32MiB");
    window.program.wait_for("picture: ");
    window.drop_file("other.toml");
    window.program.wait_for("showing");
    window.finished("dropped");
    window.saved("other.1.toml");
    let stats = window.close();
    assert_eq!(stats["builds"], 1, "{stats}");
}

/// The presets' section, and two of them once it is open.
const PRESETS: [i16; 2] = [300, 44];
const CT_BONE: [i16; 2] = [292, 66];
const MR: [i16; 2] = [389, 89];

#[test]
fn the_panels_change_nothing_by_themselves() {
    let folder = Folder::new();
    // More than the slider's end.
    let beyond = |scene: &str| {
        let phong = "value = 150\nshading = \"phong\"\nshininess = 5000";
        scene.replace("value = 150", phong)
    };
    folder.write_scene(beyond);
    let mut window = Window::open_in(folder, "scene.toml --spp 2");
    let text = window.saved_after("picture finished", "scene.1.toml");
    assert!(text.contains("shininess = 5000"), "{text}");

    // A preset leaves the plane that the key has made to the key. One for Hounsfield units, of which these data have none,
    // cannot be pressed.
    window.display.strike(&['c' as u32]);
    for place in [PRESETS, CT_BONE] {
        window.display.point(place);
        window.display.click(1);
        // The section's contents are there from the next frame on.
        std::thread::sleep(Duration::from_millis(500));
    }
    let text = window.saved_after("picture finished", "scene.2.toml");
    assert!(text.contains("shininess = 5000"), "{text}");
    window.display.point(MR);
    window.display.click(1);
    std::thread::sleep(Duration::from_millis(500));
    window.display.strike(&['c' as u32]);
    let text = window.saved_after("picture finished", "scene.3.toml");
    assert!(!text.contains("shininess = 5000"), "{text}");
    assert_eq!(planes(&text), 0, "{text}");

    // The plane goes with the scene that had it, and is not taken for the file's.
    window.display.strike(&['c' as u32]);
    assert_eq!(planes(&window.saved("scene.4.toml")), 1);
    let clip = "[[clip]]\nnormal = [0.0, 1.0, 0.0]\noffset = 5.0\n";
    window
        .folder
        .write_scene(|scene| format!("{}\n{clip}", beyond(scene)));
    let text = window.saved_after("scene file read again", "scene.5.toml");
    assert_eq!(planes(&text), 1, "{text}");
    window.display.strike(&['c' as u32]);
    let text = window.saved_after("picture finished", "scene.6.toml");
    assert_eq!(planes(&text), 2, "{text}");
}

/// Clip planes of a scene; where it has none, an example stands in a comment.
fn planes(scene: &str) -> usize {
    let is_plane = |line: &&str| line.starts_with("[[clip]]");
    scene.lines().filter(is_plane).count()
}

#[test]
fn saving_takes_no_old_files_place() {
    let folder = Folder::new();
    folder.write("scene.1.exr", b"somebody's");
    folder.write("scene.2.png", b"somebody's");
    let mut window = Window::open_in(folder, "scene.toml --spp 2");
    window.program.wait_for("first picture");
    window.display.strike(&['i' as u32]);
    window.program.wait_for("saved scene.3.png");
    assert_eq!(window.folder.read("scene.1.exr"), b"somebody's");
    assert_eq!(window.folder.read("scene.2.png"), b"somebody's");
    assert!(window.folder.has("scene.3.exr"));
}

/// A scene in it takes as long to open as somebody takes to write it.
fn make_pipe(folder: &Folder, name: &str) {
    let made = Command::new("mkfifo").arg(folder.path(name)).status();
    assert!(made.expect("mkfifo").success());
}

#[test]
fn an_edit_of_a_scene_that_is_being_opened_is_shown() {
    let folder = Folder::new();
    let display = Display::new();
    make_pipe(&folder, "slow.toml");
    let mut program = folder.view(&display, "slow.toml --spp 2");
    let path = folder.path("slow.toml");
    let mut pipe = File::options().write(true).open(&path).expect("a reader");
    // The program has opened the pipe, and the file is in its place before the text is read.
    fs::rename(folder.path("scene.toml"), path).expect("an edit");
    pipe.write_all(SCENE.as_bytes()).expect("a reader");
    drop(pipe);
    program.wait_for("scene file read again");
}

#[test]
fn before_a_scene_is_open_one_sentence_says_that_nothing_can_be_saved() {
    let folder = Folder::new();
    let display = Display::new();
    make_pipe(&folder, "slow.toml");
    let mut program = folder.view(&display, "slow.toml --spp 2");
    display.window();
    for key in ['s', 'i'] {
        display.strike(&[key as u32]);
        program.wait_for("there is nothing to save before the scene is open");
    }
    folder.write("slow.toml", SCENE.as_bytes());
    program.wait_for("showing");
}
