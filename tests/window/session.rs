//! A session as a user has it: turning, editing, undoing, saving, resizing, and editing the scene's file.

use crate::display::{Area, Shot};
use crate::hand::PANELS;
use crate::number::number;
use crate::program::WINDOW;
use crate::window::{Window, value_of};
use crate::{CONTROL, MIDDLE, PICTURE, SHIFT};

#[test]
fn a_session() {
    let mut session = Window::open("scene.toml --spp 6");
    let first = session.finished("first");
    session.program.is_idle();

    let turned = session.turn(&first);
    let shifted = session.shift_isovalue(&turned);
    let rewindowed = session.shift_transfer_function(&shifted);
    let undone = session.undo_and_redo(&shifted, &rewindowed);
    let saved = session.save_what_renders_like(&undone);

    let grown = session.grow();
    session.break_the_scene_file(&grown);
    session.mend_the_scene_file(&grown, &saved);
    session.end();
}

impl Window {
    fn turn(&mut self, first: &Shot) -> Shot {
        self.display.drag(1, MIDDLE, [MIDDLE[0] + 120, MIDDLE[1]]);
        let turned = self.finished("turned");
        assert_changed(first, &turned, &PICTURE, 0.03);
        turned
    }

    fn shift_isovalue(&mut self, before: &Shot) -> Shot {
        let display = &self.display;
        display.point(MIDDLE);
        display.holding(SHIFT, || (0..12).for_each(|_| display.click(5)));
        let shifted = self.finished("isovalue");
        assert_changed(before, &shifted, &PICTURE, 0.01);
        let program = &self.program;
        assert!(!program.has_said("cache cleared"), "{:?}", program.said());
        shifted
    }

    fn shift_transfer_function(&mut self, before: &Shot) -> Shot {
        self.display.drag(3, [MIDDLE[0], 270], [MIDDLE[0], 150]);
        self.program.wait_for("cache cleared");
        let rewindowed = self.finished("transfer");
        assert_changed(before, &rewindowed, &PICTURE, 0.02);
        rewindowed
    }

    /// Ends with the last edit undone.
    fn undo_and_redo(&mut self, before: &Shot, after: &Shot) -> Shot {
        const UNDO: [u32; 2] = [CONTROL, 'z' as u32];
        const REDO: [u32; 3] = [CONTROL, SHIFT, 'z' as u32];
        self.display.strike(&UNDO);
        let undone = self.finished("undone");
        assert_same(before, &undone, &PICTURE);
        self.display.strike(&REDO);
        assert_same(after, &self.finished("redone"), &PICTURE);
        self.display.strike(&UNDO);
        self.finished("undone again");
        undone
    }

    /// Returns the scene.
    fn save_what_renders_like(&mut self, shown: &Shot) -> String {
        let scene = self.saved("scene.1.toml");
        // Above the axes, whose letters are brighter than an empty picture.
        let area = [0..WINDOW[0] - PANELS, 110..280];
        self.folder.renders_like("scene.1.toml", shown, area);
        scene
    }

    fn grow(&mut self) -> Shot {
        self.resize(760, 520);
        self.program.wait_for("picture: 504x520");
        let grown = self.finished("grown");
        assert_eq!([grown.width, grown.height], [760, 520]);
        grown
    }

    /// The good picture stays, and the error is shown below it.
    fn break_the_scene_file(&mut self, good: &Shot) {
        self.folder
            .write_scene(|scene| scene.replace("value = 150", "value = \"high\""));
        self.program.wait_for("error: ");
        let said = self.program.said();
        assert!(said.iter().any(|line| line.contains("scene.toml:")));
        let shows = |shot: &Shot| good.difference(shot, &[100..400, 440..516]) > 0.02;
        let broken = self.shoot_once("broken", shows);
        assert_same(good, &broken, &GROWN_PICTURE);
    }

    /// The edit shows, and the camera stays.
    fn mend_the_scene_file(&mut self, before: &Shot, saved: &str) {
        let (color, other) = ("color = [0.2, 0.5, 0.9]", "color = [0.9, 0.2, 0.1]");
        self.folder.write_scene(|scene| scene.replace(color, other));
        self.program.wait_for("scene file read again");
        let mended = self.finished("mended");
        assert_changed(before, &mended, &GROWN_PICTURE, 0.02);
        let edited = self.saved("scene.2.toml");
        assert_eq!(value_of("eye", &edited), value_of("eye", saved));
    }

    fn end(mut self) {
        let stats = self.close();
        assert_eq!(stats["builds"], 1, "{stats}");
        let response = &stats["response"];
        // Six edits have been waited for one by one; of the rest, a slow machine sees several in one frame.
        assert!(number(&response["inputs"]) >= 6.0, "{response}");
        assert!(number(&response["frames_max"]) <= 2.0, "{response}");
    }
}

/// The picture in a window that has grown, above the error's words.
const GROWN_PICTURE: Area = [80..420, 120..400];

#[track_caller]
fn assert_changed(before: &Shot, after: &Shot, area: &Area, least: f64) {
    let changed = before.difference(after, area);
    assert!(changed > least, "{changed} has changed, not {least}");
}

#[track_caller]
fn assert_same(expected: &Shot, found: &Shot, area: &Area) {
    let differs = expected.difference(found, area);
    assert!(differs < 0.01, "{differs} differs");
}
