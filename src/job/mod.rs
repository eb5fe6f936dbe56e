//! Carries out the commands of the command line: one function for each, which returns the exit status.

mod bench;
mod checkpoint;
mod checkpointed_render;
mod clock;
mod info;
mod merge;
mod plan;
mod preparation;
mod render;
mod summary;
mod views;

use std::path::Path;
use std::time::{Duration, Instant};

use crate::bytes::human;
use crate::cli::{CleanArgs, CompareArgs, DoctorArgs, SceneArgs, wants_validation};
use crate::compare;
use crate::doctor;
use crate::engine::{Progress, Run, Stop};
use crate::error::{DEVICE_STATUS, DeviceError, Error, Result};
use crate::gpu::list_devices;
use crate::interrupt::{INTERRUPTED, is_interrupted};
use crate::output::{say, to_json};
use crate::scene::Opened;
use crate::scene::volume::{self, Reading, Volume, VolumeOverrides};
use crate::scene::{describe, open};
use clock::Clock;

pub use bench::bench;
pub use info::info;
pub use merge::merge;
pub use plan::plan;
pub use render::render;

/// A run that an interruption ends.
fn interruptible(stop: Stop, progress: &mut dyn FnMut(Progress)) -> Run<'_> {
    Run {
        stop,
        interrupt: Some(&INTERRUPTED),
        progress,
        waits: false,
        between: None,
    }
}

fn open_scene(args: &SceneArgs, quiet: bool) -> Result<Opened> {
    open_scene_timed(args, quiet, &mut Clock::new())
}

fn open_scene_timed(args: &SceneArgs, quiet: bool, clock: &mut Clock) -> Result<Opened> {
    let (mut loading, reading) = (Duration::ZERO, Reading::default());
    let stores = args.cache.stores(quiet, is_interrupted);
    let load = |path: &Path, overrides: &VolumeOverrides| {
        let began = Instant::now();
        let volume = Volume::load_watched(path, overrides, &reading, stores.as_ref())?;
        loading = began.elapsed();
        Ok(volume)
    };
    let opened = clock.time("open the scene", || {
        open(&args.input, args.preset, &args.edits(), load)
    })?;
    clock.part("read and decode the voxels", reading.took());
    clock.part(
        "read headers, find the range",
        loading.saturating_sub(reading.took()),
    );
    if !quiet {
        for note in &opened.notes {
            say(format!("note: {note}"));
        }
    }
    Ok(opened)
}

/// `isolume scene`.
pub fn scene(args: &SceneArgs) -> Result<u8> {
    let Opened {
        file,
        volume,
        scene,
        ..
    } = open_scene(args, false)?;
    print(&describe(&file, &volume, &scene))
}

/// `isolume compare`.
pub fn compare(args: &CompareArgs) -> Result<u8> {
    let again = args.again.as_deref().and_then(|again| match again {
        [a, b] => Some([a.as_path(), b.as_path()]),
        _ => None,
    });
    let compared = compare::compare_files([&args.a, &args.b], again, args.exposure)?;
    if args.json {
        print(&to_json(&compared)?)
    } else {
        print(&compared.table())
    }
}

/// `isolume doctor`.
pub fn doctor(args: &DoctorArgs) -> Result<u8> {
    let devices = list_devices()?;
    if devices.is_empty() {
        return Err(DeviceError::NoDriver.into());
    }
    let examinations = doctor::examine_all(devices, wants_validation());
    if args.json {
        print(&to_json(&examinations)?)?
    } else {
        print(&doctor::page(&examinations))?
    };
    if examinations.iter().all(|examination| examination.holds) {
        Ok(0)
    } else {
        Ok(DEVICE_STATUS)
    }
}

/// `isolume clean`.
pub fn clean(args: &CleanArgs) -> Result<u8> {
    let Some(folder) = args.cache.folder() else {
        return Err(Error::Usage(
            "the system has no folder for stores; name one by --cache-dir".into(),
        ));
    };
    let removed = volume::clean(&folder)?;
    let what = match removed.files {
        1 => "store was",
        _ => "stores were",
    };
    print(&format!(
        "{} {what} removed from {}, {} bytes ({})",
        removed.files,
        folder.display(),
        removed.bytes,
        human(removed.bytes)
    ))
}

/// Prints to stdout; a reader that has closed the pipe is no error.
fn print(text: &str) -> Result<u8> {
    use std::io::Write;
    match writeln!(std::io::stdout(), "{}", text.trim_end()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::io(Path::new("standard output"), e))
        }
        _ => Ok(0),
    }
}
