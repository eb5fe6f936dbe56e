//! A folder with several volumes: the largest is shown, and the others are picked from a list.

use std::path::Path;
use std::time::Duration;

use crate::dicom_files::Syntax;
use crate::dicom_scan::{SECRET, Scan, Slice};
use crate::display::{Area, Shot};
use crate::folder::Folder;
use crate::window::Window;

/// Pixels along a side of a slice.
const SIDE: usize = 64;
const WINDOW: [usize; 2] = [640, 480];
/// Where the first thumbnail and the second are, without their borders.
const THUMBNAILS: [Area; 2] = [[400..436, 64..100], [400..436, 122..158]];

/// A ball in a CT of so many slices, or a ring in an MR.
fn scan(slices: usize, is_ring: bool) -> Scan {
    let middle = (SIDE as f64 - 1.0) / 2.0;
    let value = |x: usize, y: usize, z: usize| {
        let along = (z as f64 - (slices as f64 - 1.0) / 2.0) * SIDE as f64 / slices as f64;
        let across = (x as f64 - middle).hypot(y as f64 - middle);
        let from_middle = across.hypot(along);
        let distance = if is_ring {
            (across - 20.0).abs() * 3.0
        } else {
            from_middle
        };
        (3000.0 - 100.0 * distance).max(0.0) as u16
    };
    let slice = |z| Slice {
        position: [0.0, 0.0, z as f64],
        words: (0..SIDE * SIDE)
            .map(|n| value(n % SIDE, n / SIDE, z))
            .collect(),
        slope: 1.0,
        intercept: -1024.0,
        thickness: None,
    };
    let scan = Scan {
        slices: (0..slices).map(slice).collect(),
        columns: SIDE,
        ..Scan::ct()
    };
    if is_ring {
        scan.with_names().with(|common| {
            common
                .text((0x20, 0x0e), "UI", "1.2.3.4.2")
                .text((8, 0x60), "CS", "MR")
        })
    } else {
        scan
    }
}

fn write(folder: &Path) {
    std::fs::create_dir(folder).expect("a folder");
    scan(40, false).write(folder, Syntax::Explicit, |n| format!("a{n}"));
    scan(24, true).write(folder, Syntax::RunLength, |n| format!("b{n}"));
}

/// How much of an area is nearly white.
fn bright(shot: &Shot, [columns, rows]: &Area) -> f64 {
    let all = rows
        .clone()
        .flat_map(|y| columns.clone().map(move |x| (x, y)));
    let bright = all.filter(|(x, y)| shot.at(*x, *y).iter().all(|c| *c > 200));
    bright.count() as f64 / (columns.len() * rows.len()) as f64
}

#[test]
fn a_dropped_folder_lists_its_series_and_a_click_opens_one() {
    let folder = Folder::new();
    write(&folder.path("study"));
    let mut window = Window::open_sized(folder, "scene.toml --spp 1", WINDOW);
    window.program.wait_for("showing");
    window.drop_file("study");
    window
        .program
        .wait_for("note: there are 2 volumes; this is number 1, CT, 40 slices");
    window.program.wait_for("showing");
    window.listed().save("window_series.png");
    window.pick([500, 140], "number 2, MR, 24 slices");

    // A scene that is saved has the choice in it.
    let saved = window.saved("study.1.toml");
    assert!(saved.contains("series = 2"), "{saved}");

    // It lists them as well, and what is picked lasts while the file is edited.
    window.drop_file("study.1.toml");
    window
        .program
        .wait_for("note: there are 2 volumes; this is number 2, MR, 24 slices");
    window.program.wait_for("showing");
    window.listed();
    window.pick([500, 82], "number 1, CT, 40 slices");
    window
        .folder
        .write("study.1.toml", format!("{saved}\n# edited\n").as_bytes());
    window.program.wait_for("scene file read again");
    let said = window.program.said().concat();
    assert!(!said.contains(SECRET), "{said}");
    window.close();
}

impl Window {
    /// The window once it shows the list of series, which comes in its own time.
    fn listed(&self) -> Shot {
        let has_list = |shot: &Shot| {
            let shares = THUMBNAILS.each_ref().map(|area| bright(shot, area));
            shares.iter().all(|share| (0.02..0.9).contains(share))
        };
        let shots = std::iter::repeat_with(|| {
            std::thread::sleep(Duration::from_millis(500));
            self.display.shoot(self.id)
        });
        shots.take(600).find(has_list).expect("two thumbnails")
    }

    /// Picks the series at a place of the list, which is then shown.
    fn pick(&mut self, at: [i16; 2], series: &str) {
        self.display.point(at);
        self.display.click(1);
        let note = format!("note: there are 2 volumes; this is {series}");
        self.program.wait_for(&note);
        self.program.wait_for("showing");
    }
}
