//! A folder of DICOM files from outside.

use std::fs::create_dir;

use serde_json::json;

use crate::dicom_files::Syntax;
use crate::dicom_scan::{SECRET, Scan};
use crate::{Folder, text};

/// A folder `scan` with a volume of five slices and one of three.
fn two_volumes(scan: &Scan) -> Folder {
    let folder = Folder::empty();
    create_dir(folder.path("scan")).unwrap();
    let path = folder.path("scan");
    scan.write(&path, Syntax::Explicit, |n| format!("a{n}"));
    let mut small = scan
        .clone()
        .with(|common| common.text((0x20, 0x0e), "UI", "1.2.3.4.2"));
    small.slices.truncate(3);
    small.write(&path, Syntax::RunLength, |n| format!("b{n}"));
    folder
}

#[test]
fn a_folder_renders_and_the_other_volumes_are_listed() {
    let folder = two_volumes(&Scan::ct());
    let output = folder.succeed("render scan --spp 1 --size 16x16");
    let said = text(&output.stderr);
    assert!(
        said.contains("3 slices of 16×12 (--set volume.series=2)"),
        "{said}"
    );
    assert_eq!(folder.names(), ["scan", "scan.exr", "scan.png"]);
    let other = folder.succeed("scene scan --set volume.series=2");
    let scene = text(&other.stdout);
    assert!(scene.contains("series = 2 "), "{scene}");
    assert!(scene.contains("crop = [[0, 0, 0], [16, 12, 3]]"), "{scene}");
    // The printed scene of one volume opens another as a whole.
    folder.write("other.toml", scene.as_bytes());
    let first = folder.succeed("scene other.toml --set volume.series=1");
    let first = text(&first.stdout);
    assert!(first.contains("crop = [[0, 0, 0], [16, 12, 5]]"), "{first}");
    let by_uid = folder.succeed("scene scan --set volume.series=1.2.3.4.2");
    assert!(text(&by_uid.stdout).contains("series = \"1.2.3.4.2\""));
}

#[test]
fn info_lists_the_series_of_a_folder() {
    let folder = two_volumes(&Scan::ct());
    let output = folder.succeed("info scan --json");
    let info: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let expected = json!({
        "number": 2, "uid": "1.2.3.4.2", "description": "Thorax 2.5", "modality": "CT", "slices": 3,
        "dims": [16, 12, 3], "spacing": [0.5, 0.75, 2.5], "notes": []
    });
    assert_eq!(info["series"][1], expected);
    assert_eq!(info["orientation"], "LPS");
    assert_eq!(info["dims"], json!([16, 12, 5]));
    let other = folder.succeed("info scan --set volume.series=2 --json");
    let other: serde_json::Value = serde_json::from_slice(&other.stdout).expect("JSON");
    assert_eq!(other["dims"], json!([16, 12, 3]));
    let wrong = folder.run("info scan --set medium.g=0.5");
    assert_eq!(wrong.status.code(), Some(2));
    assert!(text(&wrong.stderr).contains("only keys of the volume"));
    // Of a volume that cannot be loaded the list is all the more of use.
    std::fs::remove_file(folder.path("scan/a2")).unwrap();
    let output = folder.run("info scan --json");
    assert_eq!(output.status.code(), Some(3));
    let info: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(info["series"][0]["slices"], 4);
    assert!(
        info["series"][0]["notes"][0]
            .as_str()
            .unwrap()
            .contains("at 35 mm")
    );
    assert!(text(&output.stderr).contains("volume.fill_gaps=true"));
}

#[test]
fn no_name_reaches_an_output() {
    let folder = two_volumes(&Scan::ct().with_names());
    let mut said = Vec::new();
    for arguments in [
        "render scan -o a.exr -o a.png --stats s.json --profile p.json --spp 1 --size 16x16",
        "render scan -o b.exr --samples 0..1 --size 16x16 --variant caching --checkpoint c.exr",
        "render scan -o d.exr --samples 0..1 --size 16x16 --variant non-caching",
        "render scan -o e.exr --samples 1..2 --size 16x16 --variant non-caching",
        "merge m.exr d.exr e.exr",
        "bench scan -o report --size 16x16 --seconds 0.05 --variants non-caching",
        "info scan",
        "info scan --json",
        "scene scan",
        "plan scan",
        "info scan/a0",
    ] {
        let output = folder.succeed(arguments);
        said.extend(output.stdout);
        said.extend(output.stderr);
    }
    let report = folder.names_in("report");
    let report = report.iter().map(|name| format!("report/{name}"));
    let written: Vec<String> = folder.names().into_iter().chain(report).collect();
    let files = || written.iter().filter(|name| folder.path(name).is_file());
    for name in [
        "a.exr",
        "c.exr",
        "c.exr.cache",
        "m.exr",
        "report/report.json",
    ] {
        assert!(files().any(|file| file == name), "{name} of {written:?}");
    }
    files().for_each(|name| said.extend(folder.read(name)));
    let secret = SECRET.as_bytes();
    assert!(!said.windows(secret.len()).any(|part| part == secret));
}
