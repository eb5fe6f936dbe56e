//! The result of every format: the shape, meaning and source of the voxels.
//!
//! A format's module only fills in a [`Header`]; all further steps are written once, for all formats. Messages made
//! here do not name the file, which is added once by the code that knows the path.
//!
//! Headers of medical files carry names and birthdays. Nothing but the fields below leaves a parser, and messages
//! quote only values of fields that are needed.

use std::io::Read;
use std::path::Path;

use crate::regular_file::open_file;
use crate::scene::volume::orientation::Orientation;
use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::quantity::Quantity;
use crate::scene::volume::source::Source;
use crate::scene::volume::source::file::{Data, Encoding, Part, Start};
use crate::scene::volume::storage::Storage;
use crate::scene::volume::stored::Conversion;
use crate::scene::volume::voxel_type::{Endian, VoxelType};

#[derive(Debug)]
pub struct Header {
    /// Voxels along each axis, each ≥ 1.
    pub dims: [u32; 3],
    pub voxel_type: VoxelType,
    pub endian: Endian,
    /// The voxel size, and the axes' directions; or their fault, which counts unless the user gives both.
    pub geometry: Parsed<([f64; 3], Orientation)>,
    /// A voxel's value is intercept + slope · the number in the source.
    pub slope: f64,
    pub intercept: f64,
    pub storage: Storage,
    /// Remarks for the user: one sentence each.
    pub notes: Vec<String>,
    /// The source of `dims` voxels of the type and byte order above.
    pub source: Box<dyn Source>,
    pub about: About,
}

/// Further contents of a file beside the shape and meaning of its voxels.
#[derive(Debug, Default)]
pub struct About {
    /// Facts for `isolume info`: a name and a value each.
    pub facts: Vec<(&'static str, String)>,
    /// What the values are, where the file says it.
    pub quantity: Option<Quantity>,
}

impl Header {
    /// The header of plain voxels from byte `start` of a file that does not say where they are in the world.
    pub fn of_plain_file(
        path: &Path,
        start: u64,
        dims: [u32; 3],
        voxel_type: VoxelType,
        endian: Endian,
    ) -> Parsed<Header> {
        let data = Data {
            path: path.to_path_buf(),
            start: Start::At(start),
            encoding: Encoding::Raw,
            skip: 0,
            part: Part::WHOLE,
        };
        let source = data.open(path, dims, voxel_type)?;
        Ok(Header::of_source(source, dims, voxel_type, endian))
    }

    /// The header of voxels of which only the source is known.
    pub fn of_source(
        source: Box<dyn Source>,
        dims: [u32; 3],
        voxel_type: VoxelType,
        endian: Endian,
    ) -> Header {
        Header {
            dims,
            voxel_type,
            endian,
            geometry: Ok(([1.0; 3], Orientation::UNKNOWN)),
            slope: 1.0,
            intercept: 0.0,
            storage: Storage::default(),
            notes: Vec::new(),
            source,
            about: About::default(),
        }
    }

    /// The way from the source's numbers to what they mean.
    pub fn conversion(&self) -> Parsed<Conversion> {
        check_rescale(self.slope, self.intercept)?;
        Ok(Conversion {
            from: self.voxel_type,
            endian: self.endian,
            slope: self.slope,
            intercept: self.intercept,
        })
    }
}

/// Values must also survive the GPU's 32 bits.
pub fn check_rescale(slope: f64, intercept: f64) -> Parsed<()> {
    if (slope as f32).is_normal() && (intercept as f32).is_finite() {
        Ok(())
    } else {
        Err(format!(
            "values are rescaled with slope {slope} and intercept {intercept}, expected finite numbers \
             and a slope that is not 0"
        ))
    }
}

/// The first bytes of a file, where its header is.
pub fn first_bytes(path: &Path, limit: u64) -> Parsed<Vec<u8>> {
    let (file, _) = open_file(path)?;
    let mut bytes = Vec::new();
    file.take(limit)
        .read_to_end(&mut bytes)
        .map_err(|e| e.to_string())?;
    Ok(bytes)
}
