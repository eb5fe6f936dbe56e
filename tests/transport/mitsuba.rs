//! Other people's renderer: the pictures of `tests/references`, made by Mitsuba 3, against ours.
//!
//! `cargo test --test transport mitsuba -- --nocapture` prints the figures.

use crate::support::common;
use std::path::Path;
use std::time::Instant;

use crate::support::equivalence::{Limits, Picture, compare};
use isolume::compare::LinearImage;
use isolume::scene::preset::Preset;
use isolume::scene::volume::Volume;

/// Independent batches behind the references' standard errors.
const BATCHES: u32 = 32;
const UNITS: u32 = 16;

/// `undecided`: dark tiles, and tiles with rare glints, that would take minutes more.
fn assert_mitsuba_agrees(name: &str, samples: u32, undecided: usize) {
    let limits = Limits {
        tile: 16,
        image: 0.003,
        each_tile: 0.03,
        undecided,
    };
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/references");
    let scene = folder.join(format!("{name}.toml"));
    let opened = isolume::scene::open(&scene, Preset::Auto, &[], Volume::load).expect("a scene");
    let reference = LinearImage::read(&folder.join(format!("{name}.exr"))).expect("a reference");
    let began = Instant::now();
    let film = common::render(&opened.scene, &opened.volume, UNITS, samples / UNITS, 1);
    let seconds = began.elapsed().as_secs_f64();
    let comparison = compare(
        &Picture::from_image(&reference, BATCHES),
        &Picture::from_film(&film, opened.scene.render.size[0], UNITS),
        limits,
    );
    let tile = comparison.worst_tile();
    println!(
        "{name:<7} {samples:>4} spp {seconds:4.0} s   image {}   worst tile {tile}, {} undecided",
        comparison.worst_image(),
        comparison.undecided(),
    );
    let findings = comparison.findings();
    assert!(findings.is_empty(), "{name}: {findings:#?}");
}

#[test]
fn head() {
    assert_mitsuba_agrees("head", 256, 0);
}

#[test]
fn tissue() {
    assert_mitsuba_agrees("tissue", 64, 0);
}

#[test]
fn cloud() {
    assert_mitsuba_agrees("cloud", 512, 2);
}

#[test]
fn blobs() {
    assert_mitsuba_agrees("blobs", 128, 0);
}

#[test]
fn face() {
    assert_mitsuba_agrees("face", 768, 1);
}
