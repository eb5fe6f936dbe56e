//! OpenVDB: sparse grids on a tree of nodes with 32³, 16³ and 8³ slots.
//! <https://www.openvdb.org/documentation/doxygen/overview.html>; what lies where in a file stands nowhere but in OpenVDB's
//! own source (`openvdb/io`, `openvdb/tree`). The one crate for it, `vdb-rs`, ends the program on damaged files, and loses
//! backgrounds (`tools/measurements/files.md`).
//!
//! The volume is the box of a grid's active voxels, as `copyToArray` of OpenVDB's Python would make it: an inactive
//! voxel in it has its own value, and where there is no node, the grid's background. Each grid of a file is a channel.
//!
//! A file is read in two steps: on opening, the nodes above the leaves ([`tree`]), and voxels when they are asked for, in
//! chunks, leaf by leaf ([`leaves`]).

mod archive;
mod leaves;
mod mask;
mod number;
mod packed;
mod stream;
mod transform;
mod tree;

use std::path::Path;

use archive::Archive;
use leaves::Leaves;
use tree::Tree;

use super::header::{About, Header};
use super::several::pick;
use crate::scene::volume::overrides::VolumeOverrides;
use crate::scene::volume::parsed::Keyed;
use crate::scene::volume::quantity::Quantity;
use crate::scene::volume::source::chunked::Chunked;
use crate::scene::volume::source::codec::LARGEST_RATIO;
use crate::scene::volume::source::file::{shape, voxel_bytes};
use crate::scene::volume::source::watched::WatchedFile;
use crate::scene::volume::storage::{Level, Storage};
use crate::scene::volume::voxel_type::Endian;

/// The name that programs give to the density of a medium; this grid is shown if the user picks none.
const DENSITY: &str = "density";
/// Voxels of a chunk along each axis: several leaves, since they need not begin where the volume does.
const CHUNK: u32 = 64;

pub fn read(path: &Path, overrides: &VolumeOverrides) -> Keyed<Header> {
    let file = WatchedFile::open(path)?;
    let archive = Archive::read(&file)?;
    let grids = &archive.scalar;
    let density = grids.iter().position(|grid| grid.name == DENSITY);
    let wanted = overrides.channel.or(density.map(|n| n as u32));
    let channel = pick("channel", wanted, grids.len() as u32)?;
    let time = pick("time", overrides.time, 1)?;
    let names: Vec<String> = grids.iter().map(|grid| grid.name.clone()).collect();
    let name = names[channel as usize].clone();
    let in_grid = |fault| format!("grid `{name}`: {fault}");
    let grid = archive.open(&file, channel as usize).map_err(in_grid)?;
    let tree = Tree::read(&file, &grid).map_err(in_grid)?;
    let dims = tree.dims().map_err(in_grid)?;

    let storage = Storage {
        compression: grid.compression.name(),
        channels: grids.len() as u32,
        channel_names: names,
        times: 1,
        levels: vec![Level {
            dims,
            spacing: grid.geometry.as_ref().map_or([1.0; 3], |known| known.0),
        }],
        channel: Some(channel),
        time: Some(time),
        ..Storage::default()
    };
    let mut notes = storage.notes();
    notes.extend(archive.left_out());
    let voxel_type = grid.number.voxel_type;
    if voxel_bytes(dims, voxel_type)? / LARGEST_RATIO > file.bytes() {
        return Err(in_grid(format!(
            "its box is {}, in which nearly all voxels have one value; leave out those that lie far from all others",
            shape(dims, voxel_type)
        ))
        .into());
    }
    let mut about = About {
        quantity: quantity(&grid.class, &name),
        facts: Vec::new(),
    };
    if !grid.class.is_empty() {
        about.facts.push(("grid class", grid.class.clone()));
    }
    let geometry = grid.geometry.clone();
    let leaves = Leaves::new(file, grid, tree, [CHUNK; 3]);
    let source = Chunked::new(dims, [CHUNK; 3], voxel_type.bytes(), Box::new(leaves));
    Ok(Header {
        geometry,
        storage,
        notes,
        about,
        ..Header::of_source(Box::new(source), dims, voxel_type, Endian::Little)
    })
}

/// What the values of a grid are.
fn quantity(class: &str, name: &str) -> Option<Quantity> {
    match class {
        "fog volume" => Some(Quantity::Density),
        "level set" => Some(Quantity::Distance),
        _ => (name == DENSITY).then_some(Quantity::Density),
    }
}
