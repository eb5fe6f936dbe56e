//! A window of the program's on a display of its own, and the folder that it works in.

use std::time::{Duration, Instant};

use serde_json::Value;
use x11rb::protocol::xproto;

use crate::PICTURE;
use crate::display::{Display, Shot};
use crate::folder::Folder;
use crate::program::{PATIENCE, Program, WINDOW};

/// The order of the fields is that in which they are dropped: the program ends before its display and its folder go.
pub struct Window {
    pub program: Program,
    pub display: Display,
    pub folder: Folder,
    pub id: xproto::Window,
}

impl Window {
    /// A window of the size of `WINDOW`, with statistics, in a new folder.
    pub fn open(arguments: &str) -> Window {
        Window::open_in(Folder::new(), arguments)
    }

    /// The same in a folder in which a test has changed something.
    pub fn open_in(folder: Folder, arguments: &str) -> Window {
        Window::open_sized(folder, arguments, WINDOW)
    }

    /// The same of another size.
    pub fn open_sized(folder: Folder, arguments: &str, size: [usize; 2]) -> Window {
        let display = Display::new();
        let arguments = format!("{arguments} --stats stats.json");
        let program = Program::start(&mut folder.window(&display, &arguments, size));
        Window::of(program, display, folder)
    }

    /// The window of a program that has been started.
    pub fn of(program: Program, display: Display, folder: Folder) -> Window {
        Window {
            id: display.window(),
            program,
            display,
            folder,
        }
    }

    pub fn resize(&self, width: u32, height: u32) {
        self.display.resize(self.id, width, height);
    }

    pub fn drop_file(&self, name: &str) {
        self.display.drop_file(self.id, &self.folder.path(name));
    }

    /// The window once the picture is finished.
    pub fn finished(&mut self, name: &str) -> Shot {
        self.program.wait_for("picture finished");
        self.shoot(name)
    }

    /// The window once it stands still: what has been said is shown in a frame that follows, and on a busy machine input
    /// may follow as well.
    pub fn shoot(&self, name: &str) -> Shot {
        let mut shot = self.display.shoot(self.id);
        for _ in 0..20 {
            std::thread::sleep(Duration::from_millis(500));
            let before = std::mem::replace(&mut shot, self.display.shoot(self.id));
            if before.difference(&shot, &PICTURE) == 0.0 {
                break;
            }
        }
        shot.save(&format!("window_{name}.png"));
        shot
    }

    /// The window once it shows something: what is said is drawn in a frame that follows.
    #[track_caller]
    pub fn shoot_once(&self, name: &str, shows: impl Fn(&Shot) -> bool) -> Shot {
        let until = Instant::now() + PATIENCE;
        loop {
            let shot = self.display.shoot(self.id);
            if shows(&shot) {
                shot.save(&format!("window_{name}.png"));
                return shot;
            }
            assert!(Instant::now() < until, "it does not show {name}");
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    /// Saves the scene, and returns the text of the file that the program has found a name for.
    #[track_caller]
    pub fn saved(&mut self, name: &str) -> String {
        self.display.strike(&['s' as u32]);
        self.program.wait_for(&format!("saved {name}"));
        String::from_utf8(self.folder.read(name)).expect("UTF-8")
    }

    /// Closes the window. The program ends well and has taken the memory that it has planned; returns its statistics.
    #[track_caller]
    pub fn close(&mut self) -> Value {
        self.display.close(self.id);
        let status = self.program.ended();
        assert_eq!(status.code(), Some(0), "{:?}", self.program.said());
        let stats = self.folder.json("stats.json");
        let memory = &stats["memory"];
        assert_eq!(memory["planned_bytes"], memory["peak_bytes"], "{memory}");
        stats
    }
}

/// The value of a key in a saved scene.
pub fn value_of<'a>(key: &str, scene: &'a str) -> &'a str {
    let line = scene.lines().find_map(|line| line.strip_prefix(key));
    let value = line.and_then(|line| line.split('#').next());
    value.expect("the key").trim_matches([' ', '='])
}
