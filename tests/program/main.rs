//! The program from outside: the real binary in a folder of its own, judged by its exit status, what
//! it prints and the files that it leaves. Vulkan's validation layers watch every render. The tests send
//! signals and start shells: they are for Unix.

#![cfg(unix)]

#[path = "../support/dicom_files.rs"]
mod dicom_files;
#[path = "../support/dicom_scan.rs"]
mod dicom_scan;
#[cfg(target_os = "linux")]
#[path = "../support/faults.rs"]
mod faulty;
#[path = "../support/folder.rs"]
mod folder;
#[path = "../support/number.rs"]
mod number;
#[cfg(target_os = "linux")]
#[path = "../support/tiff_files.rs"]
mod tiff_files;
#[cfg(target_os = "linux")]
#[path = "../support/volume_files.rs"]
mod volume_files;
#[cfg(target_os = "linux")]
#[path = "../support/zarr_files/mod.rs"]
mod zarr_files;

mod allocations;
mod bench;
mod checkpoint_refusals;
mod checkpoints;
mod choosing;
mod dicom;
mod doctor;
#[cfg(target_os = "linux")]
mod faults;
mod outputs;
mod refusals;
#[cfg(target_os = "linux")]
mod resident;
mod shards;
mod statistics;
mod stopping;
mod stores;

use std::process::{Command, Output};

use folder::Folder;

/// A ball inside a haze, lit by a sun and a sky.
const SCENE: &str = r#"
[volume]
path = "ball_16x16x16_uint8.raw"
[medium]
density = 0.2
g = 0.3
[[medium.transfer]]
value = 20
opacity = 0.0
[[medium.transfer]]
value = 100
opacity = 1.0
color = [0.9, 0.8, 0.7]
[[surfaces.iso]]
value = 150
[[light]]
type = "directional"
direction = [0.3, -1.0, -0.4]
irradiance = [3.0, 3.0, 3.0]
[[light]]
type = "environment"
radiance = [0.5, 0.5, 0.5]
[render]
size = [24, 16]
"#;

impl Folder {
    /// It holds `ball.toml` and its volume.
    fn new() -> Folder {
        let folder = Folder::empty();
        let voxel = |i: usize| {
            let axis = |step: usize| ((i / step % 16) as f64 - 7.5).powi(2);
            (255.0 - 30.0 * (axis(1) + axis(16) + axis(256)).sqrt()).max(0.0) as u8
        };
        let voxels: Vec<u8> = (0..16 * 16 * 16).map(voxel).collect();
        folder.write("ball_16x16x16_uint8.raw", &voxels);
        folder.write("ball.toml", SCENE.as_bytes());
        folder
    }

    #[track_caller]
    fn run(&self, arguments: &str) -> Output {
        ended(&mut self.isolume(arguments))
    }

    /// Runs what must succeed.
    #[track_caller]
    fn succeed(&self, arguments: &str) -> Output {
        let output = self.run(arguments);
        assert!(output.status.success(), "{arguments}: {output:?}");
        output
    }
}

/// Runs to the end. Validation has nothing to say then, not even of what the device left behind.
#[track_caller]
fn ended(command: &mut Command) -> Output {
    let output = command.output().expect("the program starts");
    assert!(
        !text(&output.stderr).contains("Vulkan validation"),
        "{output:?}"
    );
    output
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("UTF-8")
}

fn last_line(output: &Output) -> &str {
    text(&output.stderr).lines().last().expect("a line")
}
