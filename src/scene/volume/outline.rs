//! A volume without voxels: its size and the range of its values, which is all that a plan needs of one. Its voxels
//! cannot be read.

use std::path::PathBuf;
use std::sync::Arc;

use super::grid::Grid;
use super::parsed::Parsed;
use super::region::Region;
use super::source::{Access, Cursor, Source};
use super::statistics::Statistics;
use super::stored::{Conversion, StoredType};
use super::{MACROCELL, Storage, Volume};

/// A source of no voxels.
#[derive(Debug)]
struct Nowhere;

impl Source for Nowhere {
    fn access(&self) -> Access {
        Access::Direct
    }

    fn files(&self) -> Vec<PathBuf> {
        Vec::new()
    }

    fn cursor(&self) -> Box<dyn Cursor + '_> {
        Box::new(Nowhere)
    }
}

impl Cursor for Nowhere {
    fn read(&mut self, _: Region, _: &mut [u8]) -> Parsed<()> {
        Err("only the volume's outline is known, and none of its voxels".into())
    }
}

impl Volume {
    /// A volume of these dimensions, each ≥ 1, with voxels of size 1 and 16 bits, whose values may lie anywhere between the
    /// two of `range`: for planning. Reading it fails.
    pub fn outline(dims: [u32; 3], range: [f64; 2]) -> Volume {
        let stored = StoredType::U16;
        let conversion = Conversion::none(stored);
        let macrocells = dims.map(|n| (n as usize + 1).div_ceil(MACROCELL as usize));
        let ranges = vec![range.map(|value| value as f32); macrocells.iter().product()];
        Volume {
            dims,
            file_dims: dims,
            file_axes: None,
            spacing: [1.0; 3],
            stored,
            scale: 1.0,
            offset: 0.0,
            range,
            axes: None,
            voxel_type: conversion.from,
            storage: Storage::default(),
            notes: Vec::new(),
            facts: Vec::new(),
            quantity: None,
            files: Vec::new(),
            grid: Arc::new(Grid {
                source: Box::new(Nowhere),
                region: Region::whole(dims),
                is_mirrored: false,
                conversion,
                filler: None,
                name: "an outline".into(),
            }),
            statistics: Arc::new(Statistics::new(ranges, Vec::new(), None)),
            keeping: None,
        }
    }
}
