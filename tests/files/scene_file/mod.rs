//! From TOML and flags to a scene: the defaults of the contract, and one sentence for each mistake.

mod changes;
mod described;
mod meaning;
mod mistakes;
mod sky;
mod views;

use std::path::Path;

use isolume::error::Result;
use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::{Edit, Scene, SceneFile, resolve};

/// A box of 100 × 200 × 50 with values from 0 to 254.
fn volume(axes: Option<&str>) -> Volume {
    let voxels = Voxels::U8((0..2000).map(|i| (i % 255) as u8).collect());
    let mut volume = Volume::from_values([10, 20, 10], [10.0, 10.0, 5.0], voxels).unwrap();
    volume.axes = axes.map(|axes| axes.parse().unwrap());
    volume
}

fn edits(changes: &[&str]) -> Vec<Edit> {
    changes
        .iter()
        .map(|change| change.parse().unwrap())
        .collect()
}

fn parse(text: &str) -> Result<SceneFile> {
    SceneFile::parse(text, Path::new("scenes/head.toml"), &[])
}

fn resolved(text: &str) -> Result<(Scene, Vec<String>)> {
    resolve(&parse(text)?, &volume(None))
}

fn message(result: Result<impl Sized>) -> String {
    let error = result.err().expect("accepted bad input");
    assert_eq!(error.exit_status(), 3, "{error}");
    error.to_string()
}
