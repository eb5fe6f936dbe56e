//! Whatever call of the kernel or of Vulkan fails, the program ends as its contract says: with the right exit status and one
//! sentence, with outputs that are whole or absent, and with a checkpoint from which it goes on to the same bytes.
//!
//! A sound run lists the calls; then one after the other of them is made to fail (`support/faults.rs`). The suite tries an even
//! spread of them: `ISOLUME_FAULTS=100` tries so many places of each fault, and `ISOLUME_FAULTS=all` each place, which takes
//! hours. What came of it is printed with `--nocapture`.

mod subject;

use std::sync::{LazyLock, OnceLock};

use isolume::scene::volume::{Endian, VoxelType};

use crate::Folder;
use crate::dicom_files::Syntax;
use crate::dicom_scan::Scan;
use crate::faulty::{Call, Fault, run, run_command};
use crate::number::number;
use crate::tiff_files::Tiff;
use crate::volume_files::Array;
use crate::zarr_files::{Codec, Zarr};
use subject::{Outcome, Subject, Tried, judge, tried};

const ENOSPC: &str = "28";
const EIO: &str = "5";
/// Of a file system without locks.
const ENOLCK: &str = "37";
const EROFS: &str = "30";
const EDQUOT: &str = "122";
const OUT_OF_HOST_MEMORY: &str = "-1";
const OUT_OF_DEVICE_MEMORY: &str = "-2";
const DEVICE_LOST: &str = "-4";

/// A picture with all its files, and a checkpoint that is written now and then.
const KEPT: Subject = Subject {
    folder: Folder::new,
    arguments: "render ball.toml --quiet --variant non-caching --spp 3 --size 8x8 -o a.exr -o a.png \
                --stats s.json --profile p.json --checkpoint c.exr --checkpoint-every 1e-6",
    outputs: &["a.exr", "a.png", "s.json", "p.json"],
    kept: &["c.exr"],
    never: &[],
};

/// A picture that goes on from a checkpoint and its cache.
const RESUMED: Subject = Subject {
    folder: half_done,
    arguments: "render ball.toml --quiet --variant caching --cache-scale 0.25 --size 8x8 --spp 4 \
                --checkpoint c.exr -o a.exr",
    outputs: &["a.exr"],
    kept: &["c.exr", "c.exr.cache"],
    never: &[],
};

/// A picture of a volume that streams, whose bricks are read again and again: units that are sampled together are in the
/// mean of some pixels before they are in that of others.
const STREAMED: Subject = Subject {
    folder: streaming,
    arguments: "render ball.toml --quiet --variant non-caching --size 8x8 --set volume.path=\"large_96x96x96_uint8.raw\" \
                --vram-budget 5300000B --ram-budget 100kB --spp 32 --checkpoint c.exr -o a.exr",
    outputs: &["a.exr"],
    kept: &["c.exr"],
    never: &[],
};

/// Two shards and their merging, which needs no device.
const MERGED: Subject = Subject {
    folder: shards,
    arguments: "merge m.exr 0.exr 1.exr",
    outputs: &["m.exr"],
    kept: &[],
    never: &[],
};

/// A picture, by as few calls of Vulkan as it takes.
const DRAWN: Subject = Subject {
    folder: Folder::new,
    arguments: "render ball.toml --quiet --variant non-caching --spp 1 --size 8x8 -o a.exr",
    outputs: &["a.exr"],
    kept: &[],
    never: &[],
};

fn half_done() -> Folder {
    static CHECKPOINT: LazyLock<[Vec<u8>; 2]> = LazyLock::new(|| {
        let folder = Folder::new();
        folder.succeed(&RESUMED.arguments.replace("--spp 4", "--spp 2"));
        ["c.exr", "c.exr.cache"].map(|name| folder.read(name))
    });
    let folder = Folder::new();
    let [picture, cache] = &*CHECKPOINT;
    folder.write("c.exr", picture);
    folder.write("c.exr.cache", cache);
    folder
}

/// With the checkpoint of a picture of few samples.
fn streaming() -> Folder {
    static CHECKPOINT: OnceLock<Vec<u8>> = OnceLock::new();
    let folder = Folder::new();
    let value = |i: usize| {
        let axis = |step: usize| ((i / step % 96) as f64 - 47.5).powi(2);
        let distance = (axis(1) + axis(96) + axis(96 * 96)).sqrt();
        (255.0 - 4.0 * distance).max(0.0) as u8
    };
    let voxels: Vec<u8> = (0..96 * 96 * 96).map(value).collect();
    folder.write("large_96x96x96_uint8.raw", &voxels);
    let checkpoint = CHECKPOINT.get_or_init(|| {
        let begun = STREAMED
            .arguments
            .replace("--spp 32", "--spp 4 --stats s.json");
        folder.succeed(&begun);
        let stats: serde_json::Value =
            serde_json::from_slice(&folder.read("s.json")).expect("JSON");
        assert!(number(&stats["bricks"]["resident"]) < 27.0, "{stats}");
        for name in ["a.exr", "s.json"] {
            std::fs::remove_file(folder.path(name)).expect("an output");
        }
        folder.read("c.exr")
    });
    folder.write("c.exr", checkpoint);
    folder
}

fn shards() -> Folder {
    static SHARDS: LazyLock<[Vec<u8>; 2]> = LazyLock::new(|| {
        ["0..2", "2..4"].map(|range| {
            let folder = Folder::new();
            let flags = format!("--variant non-caching --size 8x8 --samples {range} -o a.exr");
            folder.succeed(&format!("render ball.toml {flags}"));
            folder.read("a.exr")
        })
    });
    let folder = Folder::empty();
    for (number, shard) in SHARDS.iter().enumerate() {
        folder.write(&format!("{number}.exr"), shard);
    }
    folder
}

/// A volume in each kind of file that is read in a way of its own.
fn volumes() -> Folder {
    let folder = Folder::empty();
    let array = Array::new([12, 10, 8], VoxelType::U16, Endian::Little);
    folder.write("plain.nrrd", &array.nrrd("raw", ""));
    folder.write("packed.nrrd", &array.nrrd("gzip", ""));
    folder.write("pages.tif", &Tiff::default().write(&array));
    for name in ["scan", "chunks"] {
        std::fs::create_dir(folder.path(name)).expect("a folder");
    }
    Scan::ct().write(&folder.path("scan"), Syntax::Explicit, |n| format!("a{n}"));
    let zarr = Zarr::new(true, &[4, 5, 6], Codec::Gzip);
    zarr.write(&folder.path("chunks"), "zyx", &[8, 10, 12], &array);
    folder
}

fn is_told(call: &Call, outcome: Outcome) -> bool {
    // A folder that cannot be flushed still has its files, and the validation layers look for their settings.
    let is_of_no_account = call.name == "." || call.name.starts_with("vk_layer_settings");
    is_of_no_account || matches!(outcome, Outcome::Note | Outcome::Refusal(3))
}

fn is_harmless(_: &Call, outcome: Outcome) -> bool {
    outcome == Outcome::Success
}

fn is_refused_or_harmless(_: &Call, outcome: Outcome) -> bool {
    matches!(outcome, Outcome::Success | Outcome::Refusal(3))
}

fn is_noticed_or_harmless(call: &Call, outcome: Outcome) -> bool {
    is_refused_or_harmless(call, outcome) || outcome == Outcome::Note
}

#[test]
fn a_disk_may_fail_wherever_it_is_written() {
    let once = |most| {
        [
            tried("create", EROFS, most, is_told),
            tried("create", EDQUOT, most, is_told),
            tried("write", EIO, 2 * most, is_told),
            tried("write", EDQUOT, most, is_told),
            tried("write", "short", most, is_harmless),
            tried("fsync", EIO, 2 * most, is_told),
            tried("fsync", EDQUOT, most, is_told),
            tried("rename", EROFS, most, is_told),
            tried("rename", EIO, 2 * most, is_told),
        ]
    };
    let full = ["create", "write", "fsync"].map(|kind| Tried {
        lasts: true,
        ..tried(kind, ENOSPC, 1, is_told)
    });
    let others = [
        // A temporary file is opened to see whether it is abandoned.
        tried("open", EIO, 1, |call, outcome| {
            is_told(call, outcome) || call.name.starts_with(".isolume-")
        }),
        tried("lock", EIO, 1, |call, outcome| {
            is_told(call, outcome) || is_harmless(call, outcome)
        }),
        Tried {
            lasts: true,
            ..tried("lock", ENOLCK, 1, is_harmless)
        },
        tried("remove", EIO, 1, |_, outcome| outcome == Outcome::Success),
    ];
    let faults: Vec<Tried> = once(1).into_iter().chain(full).chain(others).collect();
    KEPT.try_all(&faults).print("a render with a checkpoint");
    MERGED.try_all(&once(4)).print("a merge");
}

/// What `--restart` ignores is there until whole files take its place.
#[test]
fn a_restart_on_a_full_disk_keeps_the_checkpoint_before() {
    let folder = half_done();
    let files = || ["c.exr", "c.exr.cache"].map(|name| folder.read(name));
    let before = files();
    let full = Fault {
        kind: "write".into(),
        number: 0,
        how: ENOSPC.into(),
        lasts: true,
    };
    let ended = run(
        &folder,
        &format!("{} --restart", RESUMED.arguments),
        Some(&full),
    );
    assert_eq!(ended.status.code(), Some(3), "{ended:?}");
    assert!(
        ended.failed().any(|call| call.name.contains("isolume")),
        "{ended:?}"
    );
    assert!(files() == before, "{ended:?}");
}

/// What is said of a volume that can be read is said of it as it was.
#[test]
fn a_volume_may_fail_wherever_it_is_read() {
    let faults = |most| {
        [
            // A folder is looked at for each of the formats that it may be.
            tried("open", EIO, most, is_refused_or_harmless),
            tried("list", EIO, most, is_refused_or_harmless),
            tried("stat", EIO, most, is_refused_or_harmless),
            // More is read than is needed.
            tried("read", EIO, most, is_refused_or_harmless),
            tried("read", "short", most, is_harmless),
            tried("read", "end", most, is_noticed_or_harmless),
            tried("read", "shrink", most, is_noticed_or_harmless),
            tried("read", "change", most, is_noticed_or_harmless),
        ]
    };
    for (arguments, never) in [
        (
            "info plain.nrrd --json",
            &["list"] as &'static [&'static str],
        ),
        ("info packed.nrrd --json", &["list"]),
        ("info pages.tif --json", &["list"]),
        ("scene scan", &[]),
        ("info chunks --json", &[]),
    ] {
        let subject = Subject {
            folder: volumes,
            arguments,
            outputs: &[],
            kept: &[],
            never,
        };
        subject.try_all(&faults(8)).print(arguments);
    }
    MERGED.try_all(&faults(6)).print("a merge");
    let faults = [
        tried("read", EIO, 1, is_refused_or_harmless),
        tried("read", "short", 1, is_harmless),
        tried("read", "end", 1, is_refused_or_harmless),
        tried("read", "shrink", 2, is_refused_or_harmless),
    ];
    RESUMED.try_all(&faults).print("a render that goes on");
}

#[test]
fn the_bricks_of_a_volume_may_fail_wherever_they_are_read() {
    let faults = [tried("read", EIO, 4, is_refused_or_harmless)];
    STREAMED.try_all(&faults).print("a render that streams");
}

#[test]
fn vulkan_may_fail_wherever_it_is_called() {
    let mut kinds: Vec<String> = DRAWN
        .sound()
        .ended
        .calls
        .into_iter()
        .map(|call| call.kind)
        .collect();
    kinds.retain(|kind| kind.starts_with("vk"));
    kinds.sort();
    kinds.dedup();
    assert!(kinds.len() > 25, "{kinds:?}");
    let faults: Vec<Tried> = kinds.iter().flat_map(|kind| on_the_device(kind)).collect();
    DRAWN.try_all(&faults).print("a render");
}

/// How a function of Vulkan's may fail.
fn on_the_device(kind: &str) -> Vec<Tried> {
    let out_of_memory = |_: &Call, outcome| outcome == Outcome::Refusal(4);
    let lost = |_: &Call, outcome| outcome == Outcome::Refusal(5);
    match kind {
        "vkQueueSubmit2" | "vkWaitForFences" | "vkGetQueryPoolResults" => vec![
            tried(kind, DEVICE_LOST, 2, lost),
            tried(kind, OUT_OF_HOST_MEMORY, 1, out_of_memory),
        ],
        // Another kind of memory takes its place, if there is one.
        "vkAllocateMemory" | "vkMapMemory" => vec![
            tried(kind, OUT_OF_DEVICE_MEMORY, 1, |_, outcome| {
                matches!(outcome, Outcome::Success | Outcome::Refusal(4))
            }),
            Tried {
                lasts: true,
                ..tried(kind, OUT_OF_DEVICE_MEMORY, 1, out_of_memory)
            },
        ],
        // Pipelines are made without it, an extension is not used, and at the end nothing is left to be waited for.
        "vkCreatePipelineCache"
        | "vkGetPipelineCacheData"
        | "vkEnumerateDeviceExtensionProperties"
        | "vkDeviceWaitIdle" => vec![tried(kind, OUT_OF_HOST_MEMORY, 1, is_harmless)],
        _ => vec![tried(kind, OUT_OF_DEVICE_MEMORY, 1, out_of_memory)],
    }
}

/// Another process's end at any moment: what it leaves is whole, and the next run removes the rest.
#[test]
fn a_render_may_be_killed_at_any_call() {
    let killed = |most| tried("any", "kill", most, |_, outcome| outcome == Outcome::Death);
    KEPT.try_all(&[killed(3)])
        .print("a render with a checkpoint");
    RESUMED.try_all(&[killed(2)]).print("a render that goes on");
    MERGED.try_all(&[killed(10)]).print("a merge");
}

/// Nothing depends on the clock of the day, which somebody may set.
#[test]
fn the_clock_may_jump() {
    let sound = KEPT.sound();
    for seconds in ["100000", "-1000000000"] {
        let folder = Folder::new();
        let mut command = folder.isolume(KEPT.arguments);
        let ended = run_command(command.env("FAULT_CLOCK", seconds), &folder, None);
        let about = format!("a clock that goes by {seconds} s");
        assert_eq!(judge(&ended, &about), Outcome::Success, "{about}");
        KEPT.check_outputs(&folder, &sound, true, &about);
    }
}
