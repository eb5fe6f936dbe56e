//! `auto` tries both variants where a surface is seen and time matters, and says what it found.

use crate::{Folder, last_line};

fn reason(folder: &Folder, arguments: &str) -> String {
    let output = folder.succeed(&format!(
        "render ball.toml --set medium.g=0 -o a.png --stats s.json {arguments}"
    ));
    let reason = folder.json("s.json")["reason"].as_str().map(String::from);
    let reason = reason.expect("a reason");
    let line = last_line(&output);
    assert!(line.ends_with(&format!(", because {reason}")), "{line}");
    reason
}

#[test]
fn a_trial_decides_where_a_surface_is_seen() {
    let folder = Folder::new();
    for limit in ["--time 1", "--error 0.05", "--error 0.05 --orbit 3"] {
        let reason = reason(&folder, limit);
        let is_found = reason.contains("without one")
            || reason == "the work is done before a cache would be filled";
        assert!(is_found, "{limit}: {reason}");
    }
}

#[test]
fn counted_samples_are_not_tried_so_that_bits_repeat() {
    let folder = Folder::new();
    let first = reason(&folder, "--spp 3");
    assert!(first.starts_with("nothing better is needed"), "{first}");
    let picture = folder.read("a.png");
    assert_eq!(reason(&folder, "--spp 3"), first);
    assert_eq!(folder.read("a.png"), picture);
}
