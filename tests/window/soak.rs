//! A session of random edits, for as long as `tools/soak` says: whatever somebody does in the window, it gives back what it
//! took.

use std::thread::sleep;
use std::time::Duration;

use crate::curve::{Curve, validates};
use crate::display::Display;
use crate::folder::Folder;
use crate::program::{Program, WINDOW};
use crate::{CONTROL, SHIFT};

/// Keys of single letters: views, clip plane, variants, what is shown over the picture, back to the first view.
const KEYS: &str = "123456crvpmh";
/// Panels take that much of the width.
const PANELS: usize = 256;

#[test]
#[ignore = "takes as long as it is told: tools/soak"]
fn soak_of_edits() {
    let folder = Folder::new();
    let display = Display::new();
    let mut command = folder.window(&display, "scene.toml --stats stats.json", WINDOW);
    if !validates() {
        command.env_remove("ISOLUME_VALIDATION");
    }
    let mut program = Program::start(&mut command);
    let window = display.window();
    program.wait_for("picture finished");
    let mut random = fastrand::Rng::with_seed(21);
    let mut curve = Curve::begin("window", program.id());
    let mut done = 0;
    while curve.goes_on(done) {
        let [x, y] = [WINDOW[0] - PANELS, WINDOW[1]].map(|size| size as i16);
        let mut point = || [random.i16(10..x - 10), random.i16(10..y - 10)];
        let [from, to] = [point(), point()];
        match random.u32(0..10) {
            0 | 1 => display.drag(1, from, to),
            2 => display.drag(3, from, to),
            3 => display.drag(2, from, to),
            4 => {
                display.point(from);
                (0..4).for_each(|_| display.click(random.u8(4..=5)));
            }
            5 => {
                display.point(from);
                display.holding(SHIFT, || {
                    (0..4).for_each(|_| display.click(random.u8(4..=5)))
                });
            }
            6 => {
                let key = random.usize(0..KEYS.len());
                display.strike(&[u32::from(KEYS.as_bytes()[key])]);
            }
            7 => display.strike(&[CONTROL, u32::from(b'z')]),
            8 => {
                display.resize(window, random.u32(1..900), random.u32(1..700));
                sleep(Duration::from_millis(random.u64(0..400)));
                display.resize(window, WINDOW[0] as u32, WINDOW[1] as u32);
            }
            _ => folder.write_scene(|scene| {
                let density = format!("density = {:.2}", random.f64());
                let value = format!("value = {}", random.u32(60..240));
                scene
                    .replace("density = 0.1", &density)
                    .replace("value = 150", &value)
            }),
        }
        sleep(Duration::from_millis(random.u64(0..300)));
        done += 1;
    }
    display.close(window);
    assert_eq!(program.ended().code(), Some(0), "{:?}", program.said());
    for bad in ["Vulkan validation", "error: "] {
        assert!(!program.has_said(bad), "{:?}", program.said());
    }
    let memory = &folder.json("stats.json")["memory"];
    assert_eq!(memory["planned_bytes"], memory["peak_bytes"], "{memory}");
    curve.assert_level();
}
