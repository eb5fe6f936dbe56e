//! `auto` tries both variants where work is long enough for a trial, and says what it found.

use rustix::process::Signal;

use crate::shards::channel;
use crate::stopping::{read_until, send, started};
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
fn long_work_is_tried_with_and_without_a_cache() {
    let folder = Folder::new();
    for limit in ["--error 0.001", "--error 0.002 --orbit 2"] {
        let arguments = format!("render ball.toml --size 96x64 -o a.png --stats s.json {limit}");
        let mut child = started(&folder, &arguments);
        // Once it fills a cache or samples, the choice is made; the last line says the same if it has come to its end.
        read_until(&mut child, ", relative error ");
        send(Signal::INT, &child);
        let status = child.process.wait().expect("an end").code();
        assert!(matches!(status, Some(0 | 130)), "{limit}: {status:?}");
        let reason = folder.json("s.json")["reason"].to_string();
        assert!(reason.contains("without one"), "{limit}: {reason}");
    }
}

#[test]
fn a_trial_need_not_come_before_short_work() {
    let folder = Folder::new();
    for limit in ["--time 1", "--error 0.05", "--error 0.05 --orbit 3"] {
        let reason = reason(&folder, limit);
        let is_found = reason.contains("without one")
            || reason == "the work is too short to fill a cache for it";
        assert!(is_found, "{limit}: {reason}");
    }
}

#[test]
fn counted_samples_are_not_tried_so_that_bits_repeat() {
    let folder = Folder::new();
    let first = reason(&folder, "--spp 3");
    assert!(first.starts_with("no variant is better"), "{first}");
    let picture = folder.read("a.png");
    assert_eq!(reason(&folder, "--spp 3"), first);
    assert_eq!(folder.read("a.png"), picture);
}

/// Under a bright sun a haze is bright, although next to no path without a cache has a collision in it.
#[test]
fn a_haze_that_paths_pass_is_not_taken_for_nothing() {
    let folder = Folder::new();
    let haze = "render ball.toml --set medium.density=1e-7 --set light=[{type=\"directional\",direction=[0,-1,-1],\
                irradiance=[1e6,1e6,1e6]}] --set render.background=[0,0,0] --set surfaces.iso=[] -o a.exr --stats s.json";
    // Where the phase function has a direction, the first collisions of a picture through a cache are left to paths, too.
    for variant in ["non-caching", "caching --set medium.g=0.5"] {
        folder.succeed(&format!("{haze} --variant {variant} --spp 16"));
        assert!(
            folder.json("s.json")["relative_error"].is_null(),
            "{variant}"
        );
    }
    folder.succeed(&format!("{haze} --set medium.g=0"));
    let stats = folder.json("s.json");
    assert_eq!(stats["variant"], "caching", "{}", stats["reason"]);
    assert!(stats["relative_error"].as_f64().expect("a known error") < 0.02);
    let red = channel(&folder.exr("a.exr"), "R");
    assert!(red.iter().sum::<f64>() > 0.0);
}
