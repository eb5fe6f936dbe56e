//! Headerless voxels (`.raw`): their shape comes from the user or from the file's name, as in
//! `head_512x512x460_uint16.raw`.

use std::path::Path;

use super::header::Header;
use crate::regular_file::open_file;
use crate::scene::volume::overrides::VolumeOverrides;
use crate::scene::volume::parsed::{Fault, Keyed};
use crate::scene::volume::source::file::{shape, voxel_bytes};
use crate::scene::volume::voxel_type::{Endian, VoxelType};

pub fn read(path: &Path, overrides: &VolumeOverrides) -> Keyed<Header> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    // NAME_DIMS_TYPE, and the name may have such words as well.
    let stem = stem.to_lowercase();
    let words = || stem.split('_').rev();
    let dims = overrides.dims.or_else(|| words().find_map(dims));
    let named_type = || words().find_map(|word| word.parse::<VoxelType>().ok());
    let voxel_type = overrides.voxel_type.or_else(named_type);
    let (Some(dims), Some(voxel_type)) = (dims, voxel_type) else {
        return Err(format!(
            "the {} of raw voxels is unknown: give `dims` and `type`, or name the file like \
             head_512x512x460_uint16.raw",
            if dims.is_none() { "size" } else { "type" }
        )
        .into());
    };
    let endian = overrides.endian.unwrap_or(Endian::Little);
    // A byte too many is as telling as one too few: wrong dims show as a skewed picture at best.
    let (_, metadata) = open_file(path)?;
    let (found, expected) = (metadata.len(), voxel_bytes(dims, voxel_type)?);
    if found != expected {
        let given = [
            ("dims", overrides.dims.is_some()),
            ("type", overrides.voxel_type.is_some()),
        ];
        return Err(Fault {
            key: given.iter().find(|(_, given)| *given).map(|(key, _)| *key),
            problem: format!(
                "holds {found} bytes, expected {expected} for {}; check `dims` and `type`",
                shape(dims, voxel_type)
            ),
        });
    }
    Ok(Header::of_plain_file(path, 0, dims, voxel_type, endian)?)
}

/// "512x512x460"
fn dims(part: &str) -> Option<[u32; 3]> {
    let sizes: Option<Vec<u32>> = part.split('x').map(|size| size.parse().ok()).collect();
    sizes?.try_into().ok()
}
