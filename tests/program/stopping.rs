//! A render ends at the first of its limits, and says which; Ctrl-C is one of them.

use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};

use crate::{Folder, last_line};

#[test]
fn the_last_line_says_why_it_stopped() {
    let folder = Folder::new();
    for (limit, reason) in [
        ("--spp 5", "stopped because --spp 5 is reached"),
        ("--time 0.5", "s are over"),
        (
            "--error 0.5",
            "stopped because the relative error is below 0.5",
        ),
        ("--spp 1000000 --time 0.5", "s are over"),
        (
            "--spp 3 --time 600 --error 1e-9",
            "stopped because --spp 3 is reached",
        ),
    ] {
        let output = folder.succeed(&format!("render ball.toml -o a.png {limit}"));
        let line = last_line(&output);
        assert!(
            line.starts_with("a.png: ") && line.contains(reason),
            "{line}"
        );
    }
}

#[test]
fn ctrl_c_writes_what_there_is() {
    let folder = Folder::new();
    // The first line of progress: samples are there, and the handler is.
    let rest = interrupted(
        &folder,
        "render ball.toml -o a.exr -o a.png --stats s.json --time 600",
        " spp, ",
    );
    assert!(rest.contains("stopped because of Ctrl-C"), "{rest}");
    let spp = folder.json("s.json")["spp"].as_u64();
    assert!(spp > Some(0));
    assert_eq!(
        image::open(folder.path("a.png")).expect("a PNG").width(),
        24
    );
    assert!(folder.exr("a.exr").layer_data[0].channel_data.list.len() >= 13);
    assert!(folder.names().iter().all(|name| !name.starts_with('.')));
}

#[test]
fn ctrl_c_ends_a_bench_with_a_report() {
    let folder = Folder::new();
    folder.succeed("render ball.toml -o given.exr --spp 4");
    interrupted(
        &folder,
        "bench ball.toml -o report --reference given.exr --variants non-caching --seconds 0.1,600",
        " spp, ",
    );
    let report = folder.json("report/report.json");
    let points = &report["subjects"][0]["runs"][0]["points"];
    assert_eq!(points.as_array().map(Vec::len), Some(1), "{report:#}");
    folder.exr("report/non-caching.0.1s.exr");
}

/// Runs what has no end until it says `sign`, presses Ctrl-C, and returns what it says then.
fn interrupted(folder: &Folder, arguments: &str, sign: &str) -> String {
    let mut child = folder
        .isolume(arguments)
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut said = BufReader::new(child.stderr.take().expect("a pipe"));
    let mut line = String::new();
    while !line.contains(sign) {
        line.clear();
        let read = said.read_line(&mut line).expect("a line");
        assert!(read > 0, "it ended by itself");
    }
    // The shell's own: a small system has no program of that name.
    let kill = Command::new("sh")
        .args(["-c", &format!("kill -INT {}", child.id())])
        .status();
    assert!(kill.expect("a shell").success());
    let mut rest = String::new();
    said.read_to_string(&mut rest).expect("the rest");
    assert_eq!(child.wait().expect("an end").code(), Some(130), "{rest}");
    rest
}
