//! From TOML and flags to a scene: the defaults of the contract, and one sentence for each mistake.

mod changes;
mod described;
mod meaning;
mod mistakes;
mod sky;
mod views;

use std::path::Path;
use std::sync::OnceLock;

use isolume::error::Result;
use isolume::scene::volume::{Volume, VoxelType, Voxels};
use isolume::scene::{Edit, Scene, SceneFile, resolve};

/// A box of 100 × 200 × 50 with values from 0 to 254.
fn volume(axes: Option<&str>) -> Volume {
    Volume {
        dims: [10, 20, 10],
        spacing: [10.0, 10.0, 5.0],
        voxels: Voxels::U8((0..2000).map(|i| (i % 255) as u8).collect()),
        scale: 1.0,
        offset: 0.0,
        range: [0.0, 254.0],
        axes: axes.map(|axes| axes.parse().unwrap()),
        voxel_type: VoxelType::U8,
        notes: Vec::new(),
        macrocell_ranges: OnceLock::new(),
    }
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
