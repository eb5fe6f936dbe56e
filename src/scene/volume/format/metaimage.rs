//! MetaImage (`.mha`, `.mhd`): <https://itk.org/Wiki/ITK/MetaIO/Documentation>.

use std::path::Path;

use super::header::{About, Header, first_bytes};
use super::several::{Key, Several};
use super::text::{Fields, TEXT_LIMIT, beside, lines, names_several_files};
use crate::regular_file::open_file;
use crate::scene::volume::orientation::{Axes, Coordinates, Orientation};
use crate::scene::volume::overrides::VolumeOverrides;
use crate::scene::volume::parsed::{Keyed, Parsed, unexpected};
use crate::scene::volume::source::file::{Data, Encoding, Part, Start};
use crate::scene::volume::source::watched::read_at;
use crate::scene::volume::voxel_type::{Endian, VoxelType};

pub fn read(path: &Path, overrides: &VolumeOverrides) -> Keyed<Header> {
    let bytes = first_bytes(path, TEXT_LIMIT)?;
    let (fields, end) = fields(&bytes)?;
    let (dims, axes, several) = shape(&fields)?;
    if !flag(&fields, "BinaryData")?.unwrap_or(true) {
        return Err(
            "`BinaryData` is False, expected binary data, not text; save it anew as binary".into(),
        );
    }
    let slope = fields.number("ElementToIntensityFunctionSlope", "a number")?;
    let intercept = fields.number("ElementToIntensityFunctionOffset", "a number")?;
    let voxel_type = voxel_type(fields.require("ElementType")?)?;
    let data = data(path, &fields, end)?;
    let (source, storage) = several.open(data, path, dims, voxel_type, overrides)?;
    Ok(Header {
        dims,
        voxel_type,
        endian: endian(&fields)?,
        geometry: geometry(&fields, axes),
        slope: slope.unwrap_or(1.0),
        intercept: intercept.unwrap_or(0.0),
        notes: storage.notes(),
        storage,
        about: About::default(),
        source,
    })
}

/// The sizes, the number of axes, and what there is beside one volume: a fourth axis is time, and the channels of a
/// voxel lie side by side.
fn shape(fields: &Fields) -> Parsed<([u32; 3], usize, Several)> {
    let axes = match fields.get("NDims") {
        None | Some("3") => 3,
        Some("4") => 4,
        Some(other) => {
            let expected = "3, or 4 of which one is time: neither a single picture nor more axes";
            return Err(unexpected("NDims", other, expected));
        }
    };
    let sizes = fields.sizes("DimSize", axes)?;
    let one_or_more = "a whole number from 1 up";
    let channels = fields.number("ElementNumberOfChannels", one_or_more)?;
    let channels: u32 = channels.unwrap_or(1);
    let times = sizes.get(3).copied().unwrap_or(1);
    for (key, count) in [("ElementNumberOfChannels", channels), ("DimSize", times)] {
        if count == 0 {
            return Err(unexpected(key, fields.require(key)?, one_or_more));
        }
    }
    let several = Several {
        within: (channels > 1).then_some((Key::Channel, channels)),
        beyond: (times > 1)
            .then_some((Key::Time, times))
            .into_iter()
            .collect(),
    };
    Ok(([sizes[0], sizes[1], sizes[2]], axes, several))
}

/// All fields up to `ElementDataFile`, which is the last one, and the offset of the data after it.
fn fields(bytes: &[u8]) -> Parsed<(Fields, usize)> {
    let mut fields = Fields::default();
    for (number, (line, end)) in lines(bytes).enumerate() {
        // Few programs write a colon, but MetaIO itself reads it.
        let Some((key, value)) = line.split_once(['=', ':']) else {
            if line.is_empty() {
                continue;
            }
            return Err(format!("line {}: expected `Key = value`", number + 1));
        };
        fields.insert(key, value)?;
        if key.trim().eq_ignore_ascii_case("ElementDataFile") {
            return Ok((fields, end));
        }
    }
    Err("the header has no `ElementDataFile`".into())
}

fn flag(fields: &Fields, key: &str) -> Parsed<Option<bool>> {
    match fields.get(key).map(str::to_lowercase).as_deref() {
        None => Ok(None),
        Some("true" | "1") => Ok(Some(true)),
        Some("false" | "0") => Ok(Some(false)),
        Some(other) => Err(unexpected(key, other, "True or False")),
    }
}

/// A `long` has 32 bits here whatever the platform: MetaIO says so.
fn voxel_type(name: &str) -> Parsed<VoxelType> {
    Ok(match name.to_uppercase().as_str() {
        "MET_CHAR" => VoxelType::I8,
        "MET_UCHAR" => VoxelType::U8,
        "MET_SHORT" => VoxelType::I16,
        "MET_USHORT" => VoxelType::U16,
        "MET_INT" | "MET_LONG" => VoxelType::I32,
        "MET_UINT" | "MET_ULONG" => VoxelType::U32,
        "MET_LONG_LONG" => VoxelType::I64,
        "MET_ULONG_LONG" => VoxelType::U64,
        "MET_FLOAT" => VoxelType::F32,
        "MET_DOUBLE" => VoxelType::F64,
        _ => {
            let expected =
                "MET_[U]CHAR, MET_[U]SHORT, MET_[U]INT, MET_[U]LONG_LONG, MET_FLOAT or MET_DOUBLE";
            return Err(unexpected("ElementType", name, expected));
        }
    })
}

fn endian(fields: &Fields) -> Parsed<Endian> {
    let big = match flag(fields, "BinaryDataByteOrderMSB")? {
        Some(big) => big,
        None => flag(fields, "ElementByteOrderMSB")?.unwrap_or(false),
    };
    Ok(if big { Endian::Big } else { Endian::Little })
}

/// The voxel size and the axes' directions, of which there may be one for time.
fn geometry(fields: &Fields, axes: usize) -> Parsed<([f64; 3], Orientation)> {
    let size = match fields.numbers("ElementSpacing", axes, "numbers")? {
        Some(spacing) => Some(spacing),
        None => fields.numbers("ElementSize", axes, "numbers")?,
    };
    let size: Vec<f64> = size.unwrap_or(vec![1.0; axes]);
    let orientation = orientation(fields, axes)?;
    Ok(([size[0], size[1], size[2]], orientation))
}

/// Each row of the matrix is one axis' direction, in left-posterior-superior coordinates unless the orientation is
/// declared unknown ("???").
///
/// `AnatomicalOrientation` names where axes come *from*: ITK writes "RAI" beside the identity, and
/// MetaIO's own table spells R as "RL" (its documentation says the reverse). It counts only where
/// there is no matrix.
fn orientation(fields: &Fields, axes: usize) -> Parsed<Orientation> {
    let letters = fields.get("AnatomicalOrientation");
    // ITK has letters for three axes alone, and writes `????` beside the matrix of four.
    let unknown = letters.is_some_and(|letters| letters.contains('?')) && axes == 3;
    for key in ["TransformMatrix", "Rotation", "Orientation"] {
        if let Some(matrix) = fields.numbers::<f64>(key, axes * axes, "numbers")? {
            let frame = if unknown {
                Coordinates::RightHanded
            } else {
                Coordinates::Anatomical(Axes::LPS)
            };
            let steps = [0, 1, 2].map(|i| [0, 1, 2].map(|x| matrix[i * axes + x]));
            return Ok(Orientation::from_steps(steps, frame)?.1);
        }
    }
    match letters {
        Some(from) if !from.contains('?') => from
            .parse()
            .map(|from: Axes| from.opposite().into())
            .map_err(|_| unexpected("AnatomicalOrientation", from, "letters such as RAI")),
        _ => Ok(Orientation::UNKNOWN),
    }
}

fn data(path: &Path, fields: &Fields, end: usize) -> Parsed<Data> {
    let is_compressed = flag(fields, "CompressedData")?.unwrap_or(false);
    let name = fields.require("ElementDataFile")?;
    let (file, begin) = match name {
        name if name.eq_ignore_ascii_case("LOCAL") => (path.to_path_buf(), end as u64),
        "" => return Err(unexpected("ElementDataFile", name, "LOCAL or a file")),
        name if names_several_files(path, name) => {
            let expected = "LOCAL or one file; join the slices into one .mha first";
            return Err(unexpected("ElementDataFile", name, expected));
        }
        name => (beside(path, name), 0),
    };
    let header_size: i64 = fields
        .number("HeaderSize", "-1 or a whole number from 0 up")?
        .unwrap_or(0);
    let start = match header_size {
        0 => Start::At(begin),
        -1 if !is_compressed => Start::FromEnd,
        size => Start::At(
            u64::try_from(size)
                .map_err(|_| unexpected("HeaderSize", &size.to_string(), "0 or more"))?,
        ),
    };
    let encoding = match start {
        Start::At(start) if is_compressed => compression(&file, start),
        _ => Encoding::Raw,
    };
    Ok(Data {
        path: file,
        start,
        encoding,
        skip: 0,
        part: Part::WHOLE,
    })
}

/// MetaIO writes zlib's format and, as zlib finds out which of the two it is, reads gzip's as well. No stream of zlib's begins
/// as one of gzip does. A file that cannot be read has its fault told when it is opened for its voxels.
fn compression(file: &Path, start: u64) -> Encoding {
    let mut magic = [0; 2];
    let read = open_file(file).map(|(file, _)| read_at(&file, &mut magic, start));
    match (read, magic) {
        (Ok(Ok(2)), [0x1f, 0x8b]) => Encoding::Gzip,
        _ => Encoding::Zlib,
    }
}
