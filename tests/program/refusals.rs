//! What cannot be done is refused with the exit status of its kind, one sentence that names the fact,
//! and no output file.

use crate::{Folder, SCENE, text};

/// Runs what must fail, and returns its sentence.
#[track_caller]
pub fn refused(folder: &Folder, arguments: &str, status: i32) -> String {
    let before = folder.names();
    let output = folder.run(arguments);
    let said = text(&output.stderr).trim_end().to_string();
    assert_eq!(output.status.code(), Some(status), "{arguments}: {said}");
    assert!(output.stdout.is_empty(), "{output:?}");
    assert_eq!(folder.names(), before, "{arguments}: {said}");
    said
}

/// Renders a scene in which `from` has become `to`: it must be called bad input in one sentence.
#[track_caller]
fn bad_scene(from: &str, to: &str, expected: &str) {
    assert!(SCENE.contains(from), "{from}");
    let folder = Folder::new();
    folder.write("bad.toml", SCENE.replacen(from, to, 1).as_bytes());
    let said = refused(&folder, "render bad.toml -o a.exr -o a.png --spp 1", 3);
    let expected = format!("isolume: {expected}");
    assert!(said.starts_with(&expected), "{said}\nis not\n{expected}");
    assert_eq!(said.lines().count(), 1, "{said}");
}

#[test]
fn mistakes_in_a_scene_are_named_by_file_line_and_key() {
    for (from, to, expected) in [
        (
            "density",
            "densty",
            "bad.toml:5: medium.densty: unknown key; did you mean \"density\"?",
        ),
        (
            "0.2",
            "\"thick\"",
            "bad.toml:5: medium.density: found \"thick\", expected a number",
        ),
        (
            "0.2",
            "nan",
            "bad.toml:5: medium.density: found NaN, expected a finite number",
        ),
        (
            "[0.3, -1.0, -0.4]",
            "[0, 0, 0]",
            "bad.toml:18: light.0.direction: found [0.0, 0.0, 0.0]",
        ),
        (
            "value = 150",
            "value = 256",
            "bad.toml:15: surfaces.iso.0.value: found 256, but the data go",
        ),
        (
            "value = 150",
            "value = inf",
            "bad.toml:15: surfaces.iso.0.value: found inf, expected a finite",
        ),
        (
            "path =",
            "crop = [[0, 0, 0], [0, 16, 16]]\npath =",
            "bad.toml:3: volume.crop: found ",
        ),
        ("[24, 16]", "[24, 0]", "bad.toml:24: render.size"),
        ("[render]", "[render", "bad.toml:23: not valid TOML"),
    ] {
        bad_scene(from, to, expected);
    }
}

/// What a volume's file does not allow is the fault of whoever asks for it, and not of the path.
#[test]
fn settings_that_do_not_fit_the_volume_are_named_where_they_are_written() {
    let folder = Folder::new();
    let volume = "ball_16x16x16_uint8.raw";
    for (key, value) in [
        ("time", "99"),
        ("series", "9"),
        ("dims", "[17,16,16]"),
        ("crop", "[[0,0,0],[17,16,16]]"),
        ("spacing", "[1e20,1,1]"),
    ] {
        let setting = format!("--set volume.{key}={value}");
        let fault = match key {
            // No file has such voxels, so that it need not be read.
            "spacing" => "found [1e20, 1.0, 1.0], expected each".into(),
            _ => format!("{volume}: "),
        };
        let expected = format!("isolume: {setting}: volume.{key}: {fault}");
        for command in [
            "scene ball.toml",
            &format!("scene {volume}"),
            &format!("info {volume}"),
        ] {
            let said = refused(&folder, &format!("{command} {setting}"), 3);
            assert!(said.starts_with(&expected), "{said}\nis not\n{expected}");
        }
    }
    let expected = format!("bad.toml:3: volume.time: {volume}: ");
    bad_scene("path =", "time = 99\npath =", &expected);
}

#[test]
fn a_medium_needs_points_that_show_something() {
    let folder = Folder::new();
    let empty = "--set medium.transfer=[] -o a.exr --spp 1";
    let said = refused(&folder, &format!("render ball.toml {empty}"), 3);
    assert!(
        said.contains("medium.transfer: found no point, expected at least one"),
        "{said}"
    );
    let clear = "--set surfaces={} --set medium.transfer.0.value=256 \
                 --set medium.transfer.1.value=257 -o a.exr --spp 1";
    let said = refused(&folder, &format!("render ball.toml {clear}"), 3);
    assert!(
        said.contains("opacity starts at 256, the data end at "),
        "{said}"
    );
}

#[test]
fn files_that_cannot_be_read_are_named() {
    let folder = Folder::new();
    let header = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 4 4\nencoding: raw\n\n";
    folder.write("short.nrrd", &[header.as_bytes(), &[1; 63]].concat());
    folder.write("scan.dcm", &[0; 200]);
    for (input, expected) in [
        ("nowhere.toml", "isolume: nowhere.toml: "),
        ("nowhere.nrrd", "isolume: nowhere.nrrd: "),
        ("short.nrrd", "isolume: short.nrrd: "),
        ("scan.dcm", "isolume: scan.dcm: "),
    ] {
        let said = refused(&folder, &format!("render {input} -o a.exr --spp 1"), 3);
        assert!(said.starts_with(expected), "{said}");
        assert_eq!(said.lines().count(), 1, "{said}");
    }
    let said = refused(&folder, "info short.nrrd", 3);
    assert!(said.contains("63") && said.contains("64"), "{said}");
    let other_size = "render ball.toml --set volume.dims=[17,16,16] -o a.exr";
    let said = refused(&folder, other_size, 3);
    assert!(said.contains("4096") && said.contains("4352"), "{said}");
    let long = "x".repeat(300);
    let said = refused(
        &folder,
        &format!("render ball.toml -o {long}.exr --time 60"),
        3,
    );
    assert!(said.contains("name too long"), "{said}");
    let said = refused(&folder, "render ball.toml -o nowhere/a.exr --spp 1", 3);
    assert!(said.contains("the folder nowhere does not exist"), "{said}");
}

/// Which values are wrong, `files command_line` knows.
#[test]
fn wrong_usage_exits_with_2() {
    let folder = Folder::new();
    for arguments in ["", "paint ball.toml", "render ball.toml --colour red"] {
        let said = refused(&folder, arguments, 2);
        assert!(
            said.contains("Usage") || said.contains("--help"),
            "{arguments}: {said}"
        );
    }
}

/// Pictures are named after their scene, and so may be skies.
#[test]
fn no_output_takes_the_place_of_what_is_read() {
    let folder = Folder::new();
    folder.succeed("render ball.toml --size 8x4 --spp 1 -o sky.exr");
    let volume = "ball_16x16x16_uint8.raw";
    let before = ["sky.exr", "ball.toml", volume].map(|name| folder.read(name));
    let render = "render ball.toml --size 8x4 --spp 1 --set light.1.image=sky.exr";
    for (flags, name) in [
        ("-o ./sky.exr".to_string(), "./sky.exr"),
        ("-o a.exr --checkpoint sky.exr --restart".into(), "sky.exr"),
        ("-o a.exr --stats ball.toml".into(), "ball.toml"),
        (format!("-o a.exr --profile {volume}"), volume),
    ] {
        let said = refused(&folder, &format!("{render} {flags}"), 2);
        let expected = format!("{name}: this file is read");
        assert!(said.contains(&expected), "{flags}: {said}");
    }
    assert!(["sky.exr", "ball.toml", volume].map(|name| folder.read(name)) == before);
}

/// A volume's voxels are read, also where the command line names only the header.
#[test]
fn no_output_takes_the_place_of_voxels() {
    let folder = Folder::new();
    let voxels = "ball_16x16x16_uint8.raw";
    let header = format!(
        "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 16 16 16\nencoding: raw\ndata file: {voxels}\n\n"
    );
    folder.write("ball.nhdr", header.as_bytes());
    let before = folder.read(voxels);
    let command = format!("render ball.nhdr -o a.exr --stats {voxels} --spp 1");
    let said = refused(&folder, &command, 2);
    let expected = format!("{voxels}: this file is read");
    assert!(said.contains(&expected), "{said}");
    assert!(folder.read(voxels) == before);
}

#[test]
fn a_budget_that_is_too_small_exits_with_4() {
    let folder = Folder::new();
    let arguments = "render ball.toml --size 512x512 --vram-budget 1MiB -o a.exr --spp 1";
    let said = refused(&folder, arguments, 4);
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(said.contains("budget"), "{said}");
}

#[test]
fn a_device_that_is_not_there_exits_with_5() {
    let folder = Folder::new();
    let said = refused(
        &folder,
        "render ball.toml --device nosuch -o a.exr --spp 1",
        5,
    );
    assert!(said.contains("nosuch"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
}

/// Whatever names have in them, a message is one line, and nothing in it steers the terminal.
#[test]
fn control_characters_are_escaped() {
    let folder = Folder::new();
    let output = folder.isolume("info").arg("a\nb\u{1b}[31m.nrrd").output();
    let output = output.expect("the program starts");
    assert_eq!(output.status.code(), Some(3));
    let said = text(&output.stderr);
    assert!(
        said.starts_with("isolume: a\\nb\\u{1b}[31m.nrrd: "),
        "{said:?}"
    );
    assert_eq!(said.lines().count(), 1, "{said:?}");
}

#[test]
fn a_volume_that_is_named_is_the_one_that_is_shown() {
    let folder = Folder::new();
    let volume = "ball_16x16x16_uint8.raw";
    for command in ["info", "render -o a.exr"] {
        for edit in ["volume.path=b.raw", "volume={path=\"b.raw\"}"] {
            let said = refused(&folder, &format!("{command} {volume} --set {edit}"), 2);
            let expected = format!("--set {edit}: the volume is ball");
            assert!(said.contains(&expected), "{said}");
        }
    }
}

#[test]
fn flags_are_named_that_contradict_another_or_lengthen_a_list() {
    let folder = Folder::new();
    for (flags, expected) in [
        (
            "--view left --set camera.eye=[1,2,3]",
            "isolume: --view left: contradicts --set camera.eye=[1,2,3]: expected one of them",
        ),
        (
            "--set render.size.2=5",
            "isolume: --set render.size.2=5: render.size: found [",
        ),
    ] {
        let said = refused(&folder, &format!("scene ball.toml {flags}"), 3);
        assert!(said.starts_with(expected), "{said}\nis not\n{expected}");
    }
}

#[test]
fn a_scene_file_that_is_no_text_is_refused_by_its_line() {
    let folder = Folder::new();
    std::fs::write(folder.path("bad.toml"), b"[volume]\npath = \"\xff\"\n").expect("a file");
    let said = refused(&folder, "scene bad.toml", 3);
    let expected = "isolume: bad.toml:2: found a byte that is no UTF-8, expected";
    assert!(said.starts_with(expected), "{said}");
}
