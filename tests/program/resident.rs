//! A volume passes through the program's memory on its way to the device, and is never all there.
//!
//! A CPU driver's "device" is memory of the same process. So what a large volume takes is compared with
//! what a few of its voxels take, of which everything but the volume is the same, and the device
//! memory of both, which the program states to the byte, is left out.

use std::fs::{File, read_to_string};
use std::io::{BufWriter, Write};
use std::thread::sleep;
use std::time::Duration;

use flate2::Compression;
use flate2::write::GzEncoder;

use crate::Folder;

const SIDE: usize = 512;
/// What opening and uploading may take.
const ALLOWED: i64 = 64 << 20;

/// 512³ voxels of 16 bits, nearly all of them 0.
fn write_voxels(mut file: impl Write) {
    let mut slice = vec![0u8; 2 * SIDE * SIDE];
    for z in 0..SIDE {
        slice.fill(if z / 8 == 20 { 3 } else { 0 });
        file.write_all(&slice).expect("voxels");
    }
}

/// The largest resident set of a render, without what the device holds of it.
fn beside_the_device(folder: &Folder, volume: &str, crop: &str) -> i64 {
    let arguments = format!(
        "render ball.toml -o a.exr --stats s.json --spp 1 --variant non-caching \
         --set volume.path=\"{volume}\" {crop}"
    );
    let mut command = folder.isolume(&arguments);
    let mut program = command.env_remove("ISOLUME_VALIDATION").spawn().unwrap();
    let status = format!("/proc/{}/status", program.id());
    let mut largest = 0;
    while program.try_wait().unwrap().is_none() {
        // Linux keeps the maximum, so that nothing is missed between two looks.
        let status = read_to_string(&status).unwrap_or_default();
        let line = status.lines().find(|line| line.starts_with("VmHWM:"));
        if let Some(kib) = line.and_then(|line| line.split_whitespace().nth(1)) {
            largest = 1024 * kib.parse::<i64>().expect("a number of KiB");
        }
        sleep(Duration::from_millis(2));
    }
    assert!(program.wait().unwrap().success());
    let planned = folder.json("s.json")["memory"]["planned_bytes"].as_i64();
    largest - planned.expect("a number")
}

#[test]
fn a_volume_is_never_all_in_memory() {
    let folder = Folder::new();
    let raw = "v_512x512x512_uint16.raw";
    write_voxels(BufWriter::new(File::create(folder.path(raw)).unwrap()));
    let header = "NRRD0004\ntype: uint16\ndimension: 3\nsizes: 512 512 512\nendian: little\n\
                  encoding: gzip\n\n";
    let mut packed = File::create(folder.path("v.nrrd")).unwrap();
    packed.write_all(header.as_bytes()).unwrap();
    let mut packed = GzEncoder::new(packed, Compression::fast());
    write_voxels(&mut packed);
    packed.finish().unwrap();

    let few = "--set volume.crop=[[0,0,158],[8,8,166]]";
    // What the driver takes to compile the shaders goes up and down.
    let least = (0..2).map(|_| beside_the_device(&folder, raw, few)).min();
    for volume in [raw, "v.nrrd"] {
        let more = beside_the_device(&folder, volume, "") - least.unwrap();
        println!("{volume} takes {:.1} MiB", more as f64 / (1 << 20) as f64);
        assert!(more <= ALLOWED, "{volume} takes {more} bytes");
    }
}
