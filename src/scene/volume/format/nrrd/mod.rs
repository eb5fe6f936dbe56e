//! NRRD (`.nrrd`, `.nhdr`): <https://teem.sourceforge.net/nrrd/format.html>.

mod axes;
mod units;
mod vectors;

use std::io::{BufRead, BufReader, Seek};
use std::path::Path;

use axes::FileAxes;
use units::Units;
use vectors::vectors;

use super::header::{About, Header, first_bytes};
use super::text::{Fields, TEXT_LIMIT, beside, lines, names_several_files};
use crate::error::first_of;
use crate::regular_file::open_file;
use crate::scene::volume::orientation::{Axes, Coordinates, Orientation};
use crate::scene::volume::overrides::VolumeOverrides;
use crate::scene::volume::parsed::{Keyed, Parsed, unexpected};
use crate::scene::volume::source::file::{Data, Encoding, Part, Start};
use crate::scene::volume::storage::in_one_unit;
use crate::scene::volume::voxel_type::{Endian, VoxelType};

/// All fields that the format has, without the spaces in their names.
const FIELDS: &str = "axismaxs axismins blocksize byteskip centerings centers content datafile dimension encoding endian \
    kinds labels lineskip max measurementframe min number oldmax oldmin sampleunits sizes space spacedimension \
    spacedirections spaceorigin spaceunits spacings thicknesses type units";
/// The most unknown fields that a note names.
const MOST_NAMED: usize = 3;

pub fn read(path: &Path, overrides: &VolumeOverrides) -> Keyed<Header> {
    let bytes = first_bytes(path, TEXT_LIMIT)?;
    let (fields, end) = fields(&bytes)?;
    let voxel_type = voxel_type(fields.require("type")?)?;
    let axes = FileAxes::read(&fields)?;
    let (dims, several) = (axes.dims, &axes.several);
    let data = data(path, &fields, end)?;
    let mut unknown_size = None;
    let units = units(&fields, &axes);
    let geometry = geometry(&fields, &axes, &units, &mut unknown_size);
    let unknown_size = unknown_size.filter(|_| overrides.spacing.is_none());
    let (source, mut storage) = several.open(data, path, dims, voxel_type, overrides)?;
    storage.unit = units.symbol();
    Ok(Header {
        dims,
        voxel_type,
        endian: endian(&fields, voxel_type)?,
        geometry,
        slope: 1.0,
        intercept: 0.0,
        notes: storage
            .notes()
            .into_iter()
            .chain(unknown_size)
            .chain(unknown_fields(&fields))
            .collect(),
        storage,
        about: About::default(),
        source,
    })
}

/// All fields, and the offset of an attached header's end: after the first empty line.
fn fields(bytes: &[u8]) -> Parsed<(Fields, Option<usize>)> {
    let mut fields = Fields::default();
    if !bytes.starts_with(b"NRRD000") {
        return Err("does not start with `NRRD000`, so it is no NRRD file".into());
    }
    for (number, (line, end)) in lines(bytes).enumerate().skip(1) {
        if line.is_empty() {
            return Ok((fields, Some(end)));
        }
        // `key:=value` lines are free text, where patients' names live: skipped unread.
        if line.starts_with('#') || line.contains(":=") {
            continue;
        }
        let Some((key, value)) = line.split_once(':') else {
            return Err(format!("line {}: expected `field: value`", number + 1));
        };
        fields.insert(key, value)?;
        // The lines after a list are file names.
        if fields
            .get("data file")
            .is_some_and(|name| name.split_whitespace().next() == Some("LIST"))
        {
            break;
        }
    }
    Ok((fields, None))
}

/// A note about fields that NRRD does not have, as one whose name is misspelt.
fn unknown_fields(fields: &Fields) -> Option<String> {
    let unknown = fields.others(|key| FIELDS.split(' ').any(|known| known == key));
    (!unknown.is_empty()).then(|| {
        let named = first_of(&unknown, MOST_NAMED);
        format!("NRRD does not have these fields of the header, which are ignored: {named}")
    })
}

fn voxel_type(name: &str) -> Parsed<VoxelType> {
    let words: Vec<String> = name.split_whitespace().map(str::to_lowercase).collect();
    Ok(match words.join(" ").as_str() {
        "signed char" | "char" | "int8" | "int8_t" => VoxelType::I8,
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => VoxelType::U8,
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => {
            VoxelType::I16
        }
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => {
            VoxelType::U16
        }
        "int" | "signed int" | "int32" | "int32_t" => VoxelType::I32,
        "uint" | "unsigned int" | "uint32" | "uint32_t" => VoxelType::U32,
        "longlong"
        | "long long"
        | "long long int"
        | "signed long long"
        | "signed long long int"
        | "int64"
        | "int64_t" => VoxelType::I64,
        "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => {
            VoxelType::U64
        }
        "float" => VoxelType::F32,
        "double" => VoxelType::F64,
        _ => {
            let expected = "an integer of 8, 16, 32 or 64 bits, float or double";
            return Err(unexpected("type", name, expected));
        }
    })
}

fn endian(fields: &Fields, voxel_type: VoxelType) -> Parsed<Endian> {
    match fields.get("endian").map(str::to_lowercase).as_deref() {
        Some("little") => Ok(Endian::Little),
        Some("big") => Ok(Endian::Big),
        None if voxel_type.bytes() == 1 => Ok(Endian::Little),
        Some(other) => Err(unexpected("endian", other, "`little` or `big`")),
        None => Err(format!(
            "the header has no `endian`, which {voxel_type} needs"
        )),
    }
}

/// The units of the lengths that [`geometry`] reads.
fn units<'a>(fields: &'a Fields, axes: &FileAxes) -> Units<'a> {
    if fields.get("space directions").is_some() {
        Units::read(fields, "space units", [0, 1, 2])
    } else {
        Units::read(fields, "units", axes.spatial)
    }
}

fn geometry(
    fields: &Fields,
    axes: &FileAxes,
    units: &Units<'_>,
    unknown_size: &mut Option<String>,
) -> Parsed<([f64; 3], Orientation)> {
    if let Some(text) = fields.get("space directions") {
        let vectors = vectors(text, axes.count)?;
        let [Some(i), Some(j), Some(k)] = axes.spatial.map(|axis| vectors[axis]) else {
            let expected = "three vectors (x,y,z), one for each axis in space";
            return Err(unexpected("space directions", text, expected));
        };
        let steps = [i, j, k].map(|step| in_one_unit(step, units.0));
        return Orientation::from_steps(steps, frame(fields)?);
    }
    let spacings = fields.numbers("spacings", axes.count, "numbers")?;
    let (spacing, why) = match spacings {
        Some(sizes) => {
            let sizes: Vec<f64> = sizes;
            let why = "a `spacings` of NaN means";
            (axes.spatial.map(|axis| sizes[axis].abs()), why)
        }
        None => {
            let why = "`axis mins` and `axis maxs` without an extent mean";
            (between_ends(fields, axes).unwrap_or([1.0; 3]), why)
        }
    };
    if spacing.iter().any(|size| size.is_nan()) {
        *unknown_size = Some(format!(
            "{why} that the size of voxels is not known: it counts as 1; if that is wrong, set volume.spacing"
        ));
    }
    let spacing = in_one_unit(spacing, units.0);
    let known = spacing.map(|size| if size.is_nan() { 1.0 } else { size });
    Ok((known, Orientation::UNKNOWN))
}

/// The spacing of axes of which only the ends are known; NaN for an axis without an extent. The ends are the outer faces
/// of the outer voxels, or their centres where the axis is `node` centred.
fn between_ends(fields: &Fields, axes: &FileAxes) -> Option<[f64; 3]> {
    let (mins, maxs) = (fields.get("axis mins")?, fields.get("axis maxs")?);
    let centerings = fields.get("centerings").or(fields.get("centers"));
    let spacing = |place: usize| {
        let axis = axes.spatial[place];
        let end = |ends: &str| -> Option<f64> { ends.split_whitespace().nth(axis)?.parse().ok() };
        let centering = centerings.and_then(|words| words.split_whitespace().nth(axis));
        let is_node = centering.is_some_and(|word| word.eq_ignore_ascii_case("node"));
        let steps = match axes.dims[place] {
            size if is_node && size > 1 => size - 1,
            size => size,
        };
        let extent = end(maxs)? - end(mins)?;
        let is_known = extent.is_finite() && extent != 0.0;
        is_known.then_some(extent.abs() / f64::from(steps))
    };
    Some([0, 1, 2].map(|place| spacing(place).unwrap_or(f64::NAN)))
}

/// The coordinates of the directions. Without a `space` they are taken as right-handed: nothing is known to the
/// contrary.
fn frame(fields: &Fields) -> Parsed<Coordinates> {
    let Some(space) = fields.get("space") else {
        return Ok(Coordinates::RightHanded);
    };
    let name = space.to_lowercase();
    // Time as a fourth coordinate changes nothing about the others.
    let in_space = match name.as_str() {
        "rast" | "last" | "lpst" => &name[..3],
        name => name.strip_suffix("-time").unwrap_or(name),
    };
    match in_space {
        "scanner-xyz" | "3d-right-handed" => Ok(Coordinates::RightHanded),
        "3d-left-handed" => Ok(Coordinates::LeftHanded),
        name => Axes::from_names(name)
            .or_else(|| name.parse().ok())
            .map(Coordinates::Anatomical)
            .ok_or_else(|| unexpected("space", space, "a name such as left-posterior-superior")),
    }
}

fn data(path: &Path, fields: &Fields, end: Option<usize>) -> Parsed<Data> {
    let encoding = match fields.require("encoding")?.to_lowercase().as_str() {
        "raw" => Encoding::Raw,
        "gzip" | "gz" => Encoding::Gzip,
        "bzip2" | "bz2" => Encoding::Bzip2,
        other => {
            let expected = "raw, gzip or bzip2; write the file again in one of them";
            return Err(unexpected("encoding", other, expected));
        }
    };
    let (file, begin) = match fields.get("data file") {
        Some(name) if names_several_files(path, name) => {
            let expected = "one file; join the slices into one .nrrd first";
            return Err(unexpected("data file", name, expected));
        }
        Some(name) => (beside(path, name), 0),
        None => (
            path.to_path_buf(),
            end.ok_or("the header does not end: expected an empty line before the data")?,
        ),
    };
    let line_skip = fields
        .number("line skip", "a whole number from 0 up")?
        .unwrap_or(0);
    let byte_skip: i64 = fields
        .number("byte skip", "-1 or a whole number from 0 up")?
        .unwrap_or(0);
    let (start, skip) = match byte_skip {
        -1 if encoding == Encoding::Raw => (Start::FromEnd, 0),
        -1 => return Err("`byte skip` is -1, which only goes with raw encoding".into()),
        byte_skip => (
            Start::At(after_lines(&file, begin as u64, line_skip)?),
            u64::try_from(byte_skip)
                .map_err(|_| unexpected("byte skip", &byte_skip.to_string(), "-1 or more"))?,
        ),
    };
    Ok(Data {
        path: file,
        start,
        encoding,
        skip,
        part: Part::WHOLE,
    })
}

/// Offset of the data, `count` lines after `begin`.
fn after_lines(file: &Path, begin: u64, count: u64) -> Parsed<u64> {
    if count == 0 {
        return Ok(begin);
    }
    let unopened = |fault| format!("its data file {}: {fault}", file.display());
    let (file, _) = open_file(file).map_err(unopened)?;
    let mut reader = BufReader::new(file);
    let broken = |e: std::io::Error| e.to_string();
    reader
        .seek(std::io::SeekFrom::Start(begin))
        .map_err(broken)?;
    let mut position = begin;
    for _ in 0..count {
        match reader.skip_until(b'\n').map_err(broken)? {
            0 => {
                return Err(format!(
                    "`line skip` is {count}, but the data have fewer lines"
                ));
            }
            length => position += length as u64,
        }
    }
    Ok(position)
}
