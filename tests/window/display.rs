//! A display without a screen, and someone who moves its mouse, types and looks.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

use x11rb::connection::Connection;
use x11rb::protocol::xproto::{
    Atom, AtomEnum, ClientMessageEvent, ConfigureWindowAux, ConnectionExt as _, EventMask,
    ImageFormat, InputFocus, PropMode, SELECTION_NOTIFY_EVENT, SelectionNotifyEvent, Window,
};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;
use x11rb::wrapper::ConnectionExt as _;

const KEY_PRESS: u8 = 2;
const KEY_RELEASE: u8 = 3;
const BUTTON_PRESS: u8 = 4;
const BUTTON_RELEASE: u8 = 5;
const MOTION: u8 = 6;

/// Between two events, as a hand would have it.
const PAUSE: Duration = Duration::from_millis(15);

pub struct Display {
    server: Child,
    pub name: String,
    connection: RustConnection,
    root: Window,
}

/// What is on a window, BGRX, row 0 on top.
pub struct Shot {
    pub width: usize,
    pub height: usize,
    bytes: Vec<u8>,
}

impl Display {
    pub fn new() -> Display {
        let mut server = Command::new("Xvfb")
            .args([
                // Keys do not repeat, however late they are let go.
                "-r",
                "-displayfd",
                "1",
                "-screen",
                "0",
                "1280x1024x24",
                "-nolisten",
                "tcp",
            ])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb starts: tools/test installs it");
        let mut number = String::new();
        let told = BufReader::new(server.stdout.take().expect("a pipe")).read_line(&mut number);
        told.expect("the display's number");
        let name = format!(":{}", number.trim());
        let (connection, screen) = RustConnection::connect(Some(&name)).expect("a display");
        let root = connection.setup().roots[screen].root;
        Display {
            server,
            name,
            connection,
            root,
        }
    }

    /// The only window that is shown, with the keyboard's focus.
    pub fn window(&self) -> Window {
        for _ in 0..12_000 {
            let tree = self
                .connection
                .query_tree(self.root)
                .unwrap()
                .reply()
                .unwrap();
            let is_ours = |w: &&Window| {
                let shown = self.connection.get_window_attributes(**w).unwrap().reply();
                let name = AtomEnum::WM_NAME;
                let named = self
                    .connection
                    .get_property(false, **w, name, AtomEnum::ANY, 0, 64)
                    .unwrap()
                    .reply();
                shown.is_ok_and(|a| u8::from(a.map_state) == 2)
                    && named.is_ok_and(|n| String::from_utf8_lossy(&n.value).contains("Isolume"))
            };
            if let Some(&window) = tree.children.iter().find(is_ours) {
                let focus = InputFocus::PARENT;
                self.connection
                    .set_input_focus(focus, window, x11rb::CURRENT_TIME)
                    .unwrap();
                self.connection.flush().unwrap();
                return window;
            }
            sleep(Duration::from_millis(50));
        }
        panic!("no window has opened");
    }

    fn fake(&self, kind: u8, detail: u8, [x, y]: [i16; 2]) {
        self.connection
            .xtest_fake_input(kind, detail, 0, self.root, x, y, 0)
            .unwrap();
        self.connection.flush().unwrap();
        sleep(PAUSE);
    }

    pub fn point(&self, at: [i16; 2]) {
        self.fake(MOTION, 0, at);
    }

    pub fn drag(&self, button: u8, from: [i16; 2], to: [i16; 2]) {
        const STEPS: i16 = 12;
        self.holding_button(button, from, || {
            for i in 1..=STEPS {
                let between = |a: i16, b: i16| a + (b - a) * i / STEPS;
                self.point([between(from[0], to[0]), between(from[1], to[1])]);
            }
        });
    }

    /// Presses a button there, and lets go once something else has happened.
    pub fn holding_button(&self, button: u8, from: [i16; 2], what: impl FnOnce()) {
        self.point(from);
        self.fake(BUTTON_PRESS, button, [0, 0]);
        what();
        self.fake(BUTTON_RELEASE, button, [0, 0]);
    }

    pub fn click(&self, button: u8) {
        self.fake(BUTTON_PRESS, button, [0, 0]);
        self.fake(BUTTON_RELEASE, button, [0, 0]);
    }

    /// Types keys that are held together: the last is struck while the others are down.
    pub fn strike(&self, symbols: &[u32]) {
        let keys: Vec<u8> = symbols.iter().map(|s| self.key(*s)).collect();
        for &key in &keys {
            self.fake(KEY_PRESS, key, [0, 0]);
        }
        for &key in keys.iter().rev() {
            self.fake(KEY_RELEASE, key, [0, 0]);
        }
    }

    /// Holds a key down while something else happens.
    pub fn holding(&self, symbol: u32, what: impl FnOnce()) {
        let key = self.key(symbol);
        self.fake(KEY_PRESS, key, [0, 0]);
        what();
        self.fake(KEY_RELEASE, key, [0, 0]);
    }

    fn key(&self, symbol: u32) -> u8 {
        let setup = self.connection.setup();
        let (low, high) = (setup.min_keycode, setup.max_keycode);
        let map = self
            .connection
            .get_keyboard_mapping(low, high - low + 1)
            .unwrap()
            .reply()
            .unwrap();
        let each = map.keysyms_per_keycode as usize;
        let index = map.keysyms.iter().position(|s| *s == symbol);
        low + (index.expect("the keyboard has the key") / each) as u8
    }

    pub fn resize(&self, window: Window, width: u32, height: u32) {
        let size = ConfigureWindowAux::new().width(width).height(height);
        self.connection.configure_window(window, &size).unwrap();
        self.connection.flush().unwrap();
    }

    /// What a window manager sends when somebody closes a window.
    pub fn close(&self, window: Window) {
        let data = [self.atom("WM_DELETE_WINDOW"), 0, 0, 0, 0];
        self.send(window, "WM_PROTOCOLS", data);
    }

    /// What a file manager sends when somebody drops a file on a window, with the answer to the window's
    /// question for the file's name.
    pub fn drop_file(&self, window: Window, path: &Path) {
        let [selection, uris] = ["XdndSelection", "text/uri-list"].map(|name| self.atom(name));
        let source = self.connection.generate_id().unwrap();
        self.send(window, "XdndEnter", [source, 5 << 24, uris, 0, 0]);
        self.send(window, "XdndPosition", [source, 0, 0, 0, 0]);
        let uri = format!("file://{}\r\n", path.display());
        self.connection
            .change_property8(PropMode::REPLACE, window, selection, uris, uri.as_bytes())
            .unwrap();
        let answer = SelectionNotifyEvent {
            response_type: SELECTION_NOTIFY_EVENT,
            sequence: 0,
            time: x11rb::CURRENT_TIME,
            requestor: window,
            selection,
            target: uris,
            property: selection,
        };
        self.connection
            .send_event(false, window, EventMask::NO_EVENT, answer)
            .unwrap();
        self.send(window, "XdndDrop", [source, 0, 0, 0, 0]);
    }

    fn send(&self, window: Window, kind: &str, data: [u32; 5]) {
        let event = ClientMessageEvent::new(32, window, self.atom(kind), data);
        self.connection
            .send_event(false, window, EventMask::NO_EVENT, event)
            .unwrap();
        self.connection.flush().unwrap();
    }

    fn atom(&self, name: &str) -> Atom {
        let asked = self.connection.intern_atom(false, name.as_bytes()).unwrap();
        asked.reply().unwrap().atom
    }

    pub fn shoot(&self, window: Window) -> Shot {
        let area = self
            .connection
            .get_geometry(window)
            .unwrap()
            .reply()
            .unwrap();
        let image = self
            .connection
            .get_image(
                ImageFormat::Z_PIXMAP,
                window,
                0,
                0,
                area.width,
                area.height,
                u32::MAX,
            )
            .unwrap()
            .reply()
            .unwrap();
        Shot {
            width: area.width.into(),
            height: area.height.into(),
            bytes: image.data,
        }
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// Columns and rows of a shot.
pub type Area = [std::ops::Range<usize>; 2];

impl Shot {
    pub fn at(&self, x: usize, y: usize) -> [u8; 3] {
        let i = 4 * (y * self.width + x);
        [self.bytes[i + 2], self.bytes[i + 1], self.bytes[i]]
    }

    fn pixels<'a>(&'a self, area: &'a Area) -> impl Iterator<Item = [u8; 3]> + 'a {
        let [columns, rows] = area;
        let row = move |y| columns.clone().map(move |x| self.at(x, y));
        rows.clone().flat_map(row)
    }

    /// The share of pixels that differ by more than a little.
    pub fn difference(&self, other: &Shot, area: &Area) -> f64 {
        let far = |(a, b): &([u8; 3], [u8; 3])| (0..3).any(|c| a[c].abs_diff(b[c]) > 24);
        let pairs = self.pixels(area).zip(other.pixels(area));
        let all = area[0].len() * area[1].len();
        pairs.filter(far).count() as f64 / all as f64
    }

    /// For a person to look at when the test has failed.
    pub fn save(&self, name: &str) {
        let whole = [0..self.width, 0..self.height];
        let rgb: Vec<u8> = self.pixels(&whole).flatten().collect();
        let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        let (width, height) = (self.width as u32, self.height as u32);
        image::save_buffer(path, &rgb, width, height, image::ColorType::Rgb8).expect("a PNG");
    }
}
