//! The window from outside: the real program on a display of its own, steered by mouse and keys and
//! judged by what it shows. Vulkan's validation layers watch.

#[path = "../support/curve.rs"]
mod curve;
#[path = "../support/dicom_files.rs"]
mod dicom_files;
#[path = "../support/dicom_scan.rs"]
mod dicom_scan;
#[path = "../support/folder.rs"]
mod folder;

mod display;
mod figures;
mod files;
mod program;
mod series;
mod soak;

use std::time::Duration;

use display::{Area, Display, Shot};
use folder::Folder;
use program::WINDOW;

const SHIFT: u32 = 0xFFE1;
const CONTROL: u32 = 0xFFE3;

/// Where the picture is in a window of `WINDOW`'s size, without the words over it.
const PICTURE: Area = [20..236, 110..300];
const MIDDLE: [i16; 2] = [128, 200];

#[test]
fn a_session() {
    let folder = Folder::new();
    let display = Display::new();
    let mut program = folder.view(&display, "scene.toml --spp 6 --stats stats.json");
    let window = display.window();
    // What has been said is shown in a frame that follows; on a busy machine input may follow as well.
    let shoot = |name: &str| -> Shot {
        let mut shot = display.shoot(window);
        for _ in 0..20 {
            std::thread::sleep(Duration::from_millis(500));
            let before = std::mem::replace(&mut shot, display.shoot(window));
            if before.difference(&shot, &PICTURE) == 0.0 {
                break;
            }
        }
        shot.save(&format!("window_{name}.png"));
        shot
    };
    program.wait_for("picture finished");
    let first = shoot("first");

    program.is_idle();

    display.drag(1, MIDDLE, [MIDDLE[0] + 120, MIDDLE[1]]);
    program.wait_for("picture finished");
    let turned = shoot("turned");
    let changed = first.difference(&turned, &PICTURE);
    assert!(
        changed > 0.03,
        "turned, {changed} of the picture has changed"
    );

    display.point(MIDDLE);
    display.holding(SHIFT, || (0..12).for_each(|_| display.click(5)));
    program.wait_for("picture finished");
    let shifted = shoot("isovalue");
    let changed = turned.difference(&shifted, &PICTURE);
    assert!(
        changed > 0.01,
        "with another isovalue, {changed} has changed"
    );
    assert!(!program.has_said("cache cleared"), "{:?}", program.said());

    display.drag(3, [MIDDLE[0], 270], [MIDDLE[0], 150]);
    program.wait_for("cache cleared");
    program.wait_for("picture finished");
    let rewindowed = shoot("transfer");
    let changed = shifted.difference(&rewindowed, &PICTURE);
    assert!(
        changed > 0.02,
        "with another transfer function, {changed} has changed"
    );

    display.strike(&[CONTROL, 'z' as u32]);
    program.wait_for("picture finished");
    let undone = shoot("undone");
    let changed = shifted.difference(&undone, &PICTURE);
    assert!(
        changed < 0.01,
        "after undo, {changed} of the picture differs"
    );
    display.strike(&[CONTROL, SHIFT, 'z' as u32]);
    program.wait_for("picture finished");
    let changed = rewindowed.difference(&shoot("redone"), &PICTURE);
    assert!(
        changed < 0.01,
        "after redo, {changed} of the picture differs"
    );
    display.strike(&[CONTROL, 'z' as u32]);
    program.wait_for("picture finished");
    shoot("undone again");

    display.strike(&['s' as u32]);
    program.wait_for("saved scene.1.toml");
    // Above the axes, whose letters are brighter than an empty picture.
    folder.renders_like("scene.1.toml", &undone, [0..WINDOW[0] - 256, 110..280]);

    display.resize(window, 760, 520);
    program.wait_for("picture: 504x520");
    program.wait_for("picture finished");
    let grown = shoot("grown");
    assert_eq!([grown.width, grown.height], [760, 520]);

    let picture = [80..420, 120..400];
    folder.write_scene(|scene| scene.replace("value = 150", "value = \"high\""));
    program.wait_for("error: ");
    assert!(
        program
            .said()
            .iter()
            .any(|line| line.contains("scene.toml:"))
    );
    let broken = shoot("broken");
    assert!(
        grown.difference(&broken, &picture) < 0.01,
        "the good picture stays"
    );
    let below = [100..400, 440..516];
    assert!(
        grown.difference(&broken, &below) > 0.02,
        "the error is shown"
    );

    folder.write_scene(|scene| scene.replace("color = [0.2, 0.5, 0.9]", "color = [0.9, 0.2, 0.1]"));
    program.wait_for("scene file read again");
    program.wait_for("picture finished");
    let mended = shoot("mended");
    assert!(grown.difference(&mended, &picture) > 0.02, "the edit shows");
    display.strike(&['s' as u32]);
    program.wait_for("saved scene.2.toml");
    let eye = |name: &str| {
        let text = String::from_utf8(folder.read(name)).expect("UTF-8");
        let line = text.lines().find(|line| line.starts_with("eye = "));
        line.map(String::from).expect("an eye")
    };
    assert_eq!(eye("scene.2.toml"), eye("scene.1.toml"), "the camera stays");

    display.close(window);
    assert_eq!(program.ended().code(), Some(0), "{:?}", program.said());
    let stats = folder.json("stats.json");
    let memory = &stats["memory"];
    assert_eq!(memory["planned_bytes"], memory["peak_bytes"], "{memory}");
    assert_eq!(stats["builds"], 1, "{stats}");
    let response = &stats["response"];
    assert!(response["inputs"].as_u64() >= Some(10), "{response}");
    assert!(response["frames_max"].as_f64() <= Some(2.0), "{response}");
}

#[test]
fn every_key_may_be_struck_and_every_size_taken() {
    let folder = Folder::new();
    let display = Display::new();
    let mut program = folder.view(&display, "scene.toml --spp 6 --stats stats.json");
    let window = display.window();
    program.wait_for("first picture");
    display.point(MIDDLE);
    for key in "hhpm12345 6rcuucffsvvv".chars().filter(|c| *c != ' ') {
        display.strike(&[key as u32]);
    }
    program.wait_for("variant: caching");
    for (width, height) in [(300, 200), (1, 1), (700, 90), (512, 384)] {
        display.resize(window, width, height);
        std::thread::sleep(Duration::from_millis(150));
    }
    program.wait_for("picture finished");
    display.strike(&['i' as u32]);
    program.wait_for("saved scene.1.png");
    display.shoot(window).save("window_keys.png");
    display.close(window);
    assert_eq!(program.ended().code(), Some(0), "{:?}", program.said());
    assert!(folder.has("scene.1.exr"));
    let memory = &folder.json("stats.json")["memory"];
    assert_eq!(memory["planned_bytes"], memory["peak_bytes"], "{memory}");
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

/// A random hand; `ISOLUME_SOAK_ACTIONS` says for how long, 2700 being some ten minutes.
#[test]
fn memory_stays_flat_under_random_input() {
    let actions =
        std::env::var("ISOLUME_SOAK_ACTIONS").map_or(600, |n| n.parse().expect("a count"));
    let folder = Folder::new();
    let display = Display::new();
    let mut program = folder.view(&display, "scene.toml --spp 6 --stats stats.json --quiet");
    let window = display.window();
    let mut random = fastrand::Rng::with_seed(7);
    let [width, height] = WINDOW.map(|n| n as i16);
    let mut resident = Vec::new();
    for action in 1..=actions {
        let mut place = || [random.i16(4..width - 4), random.i16(4..height - 4)];
        let (from, to) = (place(), place());
        match random.u32(0..12) {
            0..5 => display.drag(random.u8(1..=3), from, to),
            5..7 => (0..random.u32(1..6)).for_each(|_| display.click(4 + random.u8(0..2))),
            7 => display.holding(SHIFT, || display.click(4 + random.u8(0..2))),
            8 => {
                let key = *random.choice(b"rcupmh123456").expect("a key");
                display.strike(&[key.into()]);
            }
            9 => display.strike(&[CONTROL, 'z' as u32]),
            10 => {
                for _ in 0..20 {
                    display.resize(window, random.u32(1..900), random.u32(1..700));
                    std::thread::sleep(Duration::from_millis(20));
                }
                display.resize(window, WINDOW[0] as u32, WINDOW[1] as u32);
            }
            _ => std::thread::sleep(Duration::from_millis(random.u64(0..200))),
        }
        if action % 20 == 0 {
            resident.push(program.resident_kib());
        }
    }
    display.close(window);
    assert_eq!(program.ended().code(), Some(0), "{:?}", program.said());
    let stats = folder.json("stats.json");
    println!(
        "{actions} actions, {} resizes, resident KiB: {resident:?}",
        stats["resizes"]
    );
    let memory = &stats["memory"];
    assert_eq!(memory["planned_bytes"], memory["peak_bytes"], "{memory}");
    let (early, late) = resident.split_at(resident.len() / 2);
    let highest = |all: &[u64]| all.iter().copied().max().unwrap_or(0) as f64;
    assert!(highest(late) < 1.1 * highest(early), "{resident:?}");
}
