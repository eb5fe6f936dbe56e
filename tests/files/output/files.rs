//! Files appear whole or not at all, and all together where they are not independent.

use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::path::Path;

use isolume::error::Error;
use isolume::output::{Format, Outputs, Provenance, check_writable};
use isolume::scene::Tone;
use serde_json::{Value, json};
use tempfile::TempDir;

use super::row;

fn names_in(folder: &TempDir) -> Vec<String> {
    let entries = fs::read_dir(folder.path()).unwrap();
    let mut names: Vec<_> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn formats_go_by_extension() {
    assert_eq!(Format::of(Path::new("a.EXR")).unwrap(), Format::Exr);
    assert_eq!(Format::of(Path::new("a.b.png")).unwrap(), Format::Png);
    for name in ["a.jpg", "exr", ".png"] {
        let error = Format::of(Path::new(name)).unwrap_err();
        assert!(matches!(error, Error::Usage(_)));
        let message = error.to_string();
        assert!(message.contains(name) && message.contains(".exr") && message.contains(".png"));
    }
}

#[test]
fn a_failure_leaves_nothing_of_any_output() {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("old.json"), "old").unwrap();
    let picture = row(&[[1.0; 3]], None);
    {
        let mut outputs = Outputs::default();
        outputs
            .exr(&at("a.exr"), &picture, &Provenance::default())
            .unwrap();
        outputs.json(&at("old.json"), &json!({})).unwrap();
        let full = outputs.write_aside(&at("b.png"), |file| {
            file.write_all(b"half")?;
            Err(ErrorKind::StorageFull.into())
        });
        let message = full.unwrap_err().to_string();
        assert!(message.contains("b.png"), "{message}");
    }
    assert_eq!(names_in(&folder), ["old.json"]);
    assert_eq!(fs::read_to_string(at("old.json")).unwrap(), "old");
}

/// A disk that is full, or a folder that somebody has removed, costs only what would go there.
#[test]
fn independent_outputs_are_written_without_those_that_cannot_be() {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("gone")).unwrap();
    let mut outputs = Outputs::independent();
    outputs.text(&at("gone/a.md"), "A").unwrap();
    outputs.text(&at("b.md"), "B").unwrap();
    let full = |file: &mut std::io::BufWriter<&mut File>| {
        file.write_all(b"half")?;
        Err(ErrorKind::StorageFull.into())
    };
    outputs.write_aside(&at("c.md"), full).unwrap();
    outputs.text(&at("d.md"), "D").unwrap();
    fs::remove_dir_all(at("gone")).unwrap();
    let message = outputs.commit().unwrap_err().to_string();
    assert!(message.contains("c.md"), "{message}");
    assert_eq!(names_in(&folder), ["b.md", "d.md"]);
}

#[test]
fn commit_names_every_output_and_nothing_else() {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("s.json"), "old").unwrap();
    let picture = row(&[[1.0; 3]], None);
    let mut outputs = Outputs::default();
    outputs
        .exr(&at("a.exr"), &picture, &Provenance::default())
        .unwrap();
    outputs
        .png(&at("a.png"), &picture, 0.0, Tone::Linear)
        .unwrap();
    outputs.json(&at("s.json"), &json!({"spp": 1})).unwrap();
    outputs.text(&at("r.md"), "# Report\n").unwrap();
    assert!(!at("a.exr").exists(), "named before all were written");
    outputs.commit().unwrap();
    assert_eq!(names_in(&folder), ["a.exr", "a.png", "r.md", "s.json"]);
    let stats: Value = serde_json::from_slice(&fs::read(at("s.json")).unwrap()).unwrap();
    assert_eq!(stats, json!({"spp": 1}));
}

#[test]
fn unusable_places_are_named_before_anything_is_written() {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name);
    let missing = at("none/a.exr");
    let message = check_writable([&missing]).unwrap_err().to_string();
    assert!(
        message.contains("none does not exist; create it"),
        "{message}"
    );
    let message = check_writable([&folder.path().to_path_buf()])
        .unwrap_err()
        .to_string();
    assert!(message.contains("is a folder"), "{message}");
    check_writable([&at("a.exr")]).unwrap();
    let twice = [&at("a.exr"), &at("b.exr"), &at("./a.exr")];
    let message = check_writable(twice).unwrap_err().to_string();
    assert!(message.contains("two outputs have this name"), "{message}");
    assert_eq!(names_in(&folder), [""; 0]);
}

#[cfg(unix)]
#[test]
fn outputs_have_ordinary_permissions_and_keep_links_and_pipes() {
    use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name);
    let text = |name: &str| {
        let mut outputs = Outputs::default();
        outputs.text(&at(name), "text").unwrap();
        outputs.commit().unwrap();
    };

    File::create(at("ordinary")).unwrap();
    text("ours");
    let mode = |name: &str| at(name).metadata().unwrap().permissions().mode();
    assert_eq!(mode("ours"), mode("ordinary"));

    symlink("ordinary", at("link")).unwrap();
    text("link");
    assert!(at("link").is_symlink());
    assert_eq!(fs::read_to_string(at("ordinary")).unwrap(), "text");

    // A link may name a file that is still to come.
    fs::create_dir(at("elsewhere")).unwrap();
    symlink("elsewhere/new", at("between")).unwrap();
    symlink("between", at("ahead")).unwrap();
    let twice = ["ahead", "elsewhere/new"].map(at);
    check_writable(&twice).expect_err("the same file");
    text("ahead");
    assert!(at("ahead").is_symlink() && at("between").is_symlink());
    assert_eq!(fs::read_to_string(at("elsewhere/new")).unwrap(), "text");

    assert!(
        std::process::Command::new("mkfifo")
            .arg(at("pipe"))
            .status()
            .unwrap()
            .success()
    );
    let pipe = at("pipe");
    let reader = std::thread::spawn(move || fs::read_to_string(pipe).unwrap());
    text("pipe");
    assert!(at("pipe").metadata().unwrap().file_type().is_fifo());
    assert_eq!(reader.join().unwrap(), "text");
}
