//! How fast the window is, and what it takes, in figures for tools/measurements/speed.md:
//!
//! ```text
//! ISOLUME_FIGURES_S=6 cargo test --release --test window figures -- --nocapture --test-threads=1
//! ```
//!
//! Without that many seconds for each measurement, one says whether they can be made. `ISOLUME_TURNED="cloud2048.toml --vram-budget 1GiB"` turns another volume or scene, with options.

use std::time::{Duration, Instant};

use crate::display::Display;
use crate::folder::Folder;
use crate::hand::{Hand, back_to_first_size};
use crate::number::number;
use crate::program::{Program, WINDOW};
use crate::window::Window;
use crate::{MIDDLE, PICTURE};

const SAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tools/sample/vismale.nrrd");
/// Voxels along a side of the volume whose first picture is timed.
const SIDE: usize = 256;
const RESIZES_A_SECOND: u32 = 160;

/// So long somebody turns the picture, and so long it is then at rest.
fn seconds() -> u32 {
    std::env::var("ISOLUME_FIGURES_S").map_or(1, |n| n.parse().expect("a whole number"))
}

#[test]
fn figures_of_turning() {
    let turned = std::env::var("ISOLUME_TURNED").unwrap_or(SAMPLE.into());
    // Panels take 256 pixels of the width.
    for size in [[512, 512], [768, 512]] {
        let mut window = Window::measured(&turned, size);
        window.program.wait_for("first picture");
        let (began, before) = (Instant::now(), window.program.cpu_seconds());
        let long = Duration::from_secs(seconds().into());
        while began.elapsed() < long {
            window.display.drag(1, [60, 150], [200, 180]);
            window.display.drag(1, [200, 180], [60, 150]);
        }
        let cores = (window.program.cpu_seconds() - before) / began.elapsed().as_secs_f64();
        std::thread::sleep(long);
        let stats = window.close();
        let figure = |key: &str| number(&stats[key]);
        println!(
            "turning in a window of {size:?}: {:.1} frames/s, 95 % within {:.0} ms, longest {:.0} ms, {:.1} % of the \
             pixels, {cores:.2} cores; from input to frame: {}; then at rest: {:.1} frames/s, 95 % within {:.0} ms, \
             longest {:.0} ms",
            1e3 / figure("moving_frame_ms_median"),
            figure("moving_frame_ms_p95"),
            figure("moving_frame_ms_max"),
            100.0 * figure("moving_scale").powi(2),
            stats["response"],
            1e3 / figure("resting_frame_ms_median"),
            figure("resting_frame_ms_p95"),
            figure("resting_frame_ms_max"),
        );
        assert!(number(&stats["response"]["frames_max"]) <= 2.0);
    }
}

#[test]
fn figures_at_rest() {
    let mut window = Window::measured("scene.toml", WINDOW);
    let display = &window.display;
    window.program.wait_for("picture finished");
    let idle = window.program.cpu_seconds_in(Duration::from_secs(2));
    println!("a finished picture: {idle:.2} s of CPU time in 2 s");
    let [x, y] = MIDDLE;
    display.holding_button(1, MIDDLE, || {
        for turn in [60, 0, -60, 0, 60] {
            // What came before, the press too, has been seen, and the words over the picture have changed.
            std::thread::sleep(Duration::from_millis(500));
            let before = display.shoot(window.id);
            let began = Instant::now();
            display.point([x + turn, y]);
            while display.shoot(window.id).difference(&before, &PICTURE) < 0.01 {
                assert!(
                    began.elapsed() < Duration::from_secs(5),
                    "it has not turned"
                );
            }
            let ms = 1e3 * began.elapsed().as_secs_f64();
            println!("from the mouse to other pixels on the display: {ms:.0} ms");
            window.program.wait_for("picture finished");
        }
    });
}

#[test]
fn figures_of_the_first_picture() {
    let folder = Folder::new();
    let display = Display::new();
    folder.write("ball_256x256x256_uint8.raw", &ball());
    for _ in 0..3 {
        let mut program = folder.measure(&display, "ball_256x256x256_uint8.raw", [512, 512]);
        program.wait_for("first picture");
        let said = program.said().last().expect("a line");
        println!(
            "{SIDE}³ voxels of 8 bits: {said}, {:.2} s of CPU time",
            program.cpu_seconds()
        );
    }
}

/// A ball with a ripple on it.
fn ball() -> Vec<u8> {
    let voxel = |i: usize| {
        let at = [i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE];
        let [x, y, z] = at.map(|n| (n as f64 + 0.5) / SIDE as f64 - 0.5);
        let ripple = 0.03 * (20.0 * x).sin() * (20.0 * y).sin() * (20.0 * z).sin();
        let inside = 0.4 + ripple - (x * x + y * y + z * z).sqrt();
        (255.0 * (2.5 * inside).clamp(0.0, 1.0)) as u8
    };
    (0..SIDE.pow(3)).map(voxel).collect()
}

#[test]
fn figures_of_many_resizes() {
    let mut window = Window::open("scene.toml --spp 6 --quiet");
    let mut hand = Hand::seeded(3);
    let mut resident = Vec::new();
    let resizes = RESIZES_A_SECOND * seconds();
    for n in 1..=resizes {
        hand.resize(&window);
        std::thread::sleep(Duration::from_millis(25));
        if n % (resizes / 10) == 0 {
            back_to_first_size(&window);
            std::thread::sleep(Duration::from_millis(300));
            resident.push(window.program.resident_kib() / 1024);
        }
    }
    let stats = window.close();
    let memory = &stats["memory"];
    println!(
        "{resizes} resizes, {} of them with a picture: planned {}, peak {}; resident MiB {resident:?}",
        stats["resizes"], memory["planned_bytes"], memory["peak_bytes"]
    );
}

impl Folder {
    /// The program without what tests watch it by.
    fn measure(&self, display: &Display, input: &str, size: [usize; 2]) -> Program {
        let arguments = format!("{input} --spp 4 --stats stats.json");
        let mut command = self.window(display, &arguments, size);
        Program::start(command.env_remove("ISOLUME_VALIDATION"))
    }
}

impl Window {
    /// The same with its window, in a new folder.
    fn measured(input: &str, size: [usize; 2]) -> Window {
        let (folder, display) = (Folder::new(), Display::new());
        let program = folder.measure(&display, input, size);
        Window::of(program, display, folder)
    }
}
