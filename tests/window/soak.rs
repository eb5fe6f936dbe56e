//! A session of random edits, for as long as `tools/soak` says: whatever somebody does in the window, it gives back what it
//! took.

use crate::curve::{Curve, validates};
use crate::display::Display;
use crate::folder::Folder;
use crate::hand::Hand;
use crate::program::{Program, WINDOW};
use crate::window::Window;

#[test]
#[ignore = "takes as long as it is told: tools/soak"]
fn soak_of_edits() {
    let (folder, display) = (Folder::new(), Display::new());
    let mut command = folder.window(&display, "scene.toml --stats stats.json", WINDOW);
    if !validates() {
        command.env_remove("ISOLUME_VALIDATION");
    }
    let mut window = Window::of(Program::start(&mut command), display, folder);
    window.program.wait_for("first picture");
    let mut hand = Hand::over_the_picture(21);
    let mut curve = Curve::begin("window", window.program.id());
    let mut done = 0;
    while curve.goes_on(done) {
        if hand.random.u32(0..10) == 0 {
            edit_the_scene_file(&mut hand, &window.folder);
        } else {
            hand.act(&window);
        }
        hand.pause(300);
        done += 1;
    }
    window.close();
    for bad in ["Vulkan validation", "error: "] {
        let program = &window.program;
        assert!(!program.has_said(bad), "{:?}", program.said());
    }
    curve.assert_level();
}

fn edit_the_scene_file(hand: &mut Hand, folder: &Folder) {
    folder.write_scene(|scene| {
        let density = format!("density = {:.2}", hand.random.f64());
        let value = format!("value = {}", hand.random.u32(60..240));
        scene
            .replace("density = 0.1", &density)
            .replace("value = 150", &value)
    });
}
