//! The `[volume]` table: its keys, their meaning, and how they are printed.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::SceneFile;
use super::numbers::VOXEL_SIZE;
use super::page::Page;
use crate::error::{Error, Location, Result};
use crate::scene::volume::{Pick, Volume, VolumeOverrides};

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct VolumeTable {
    /// The path as written, relative to the scene file. [`SceneFile::volume_path`] is the path to open.
    pub path: Option<PathBuf>,
    pub dims: Option<[u32; 3]>,
    #[serde(rename = "type")]
    pub voxel_type: Option<String>,
    pub endian: Option<String>,
    pub channel: Option<u32>,
    pub time: Option<u32>,
    pub level: Option<u32>,
    pub spacing: Option<[f64; 3]>,
    pub axes: Option<String>,
    pub crop: Option<[[u32; 3]; 2]>,
    pub series: Option<Pick>,
    pub fill_gaps: Option<bool>,
}

impl SceneFile {
    /// The file or folder that holds the volume.
    pub fn volume_path(&self) -> Result<PathBuf> {
        let missing = || {
            self.origins
                .error("volume.path", "missing: it names the volume's file")
        };
        let written = self.volume.path.as_ref().ok_or_else(missing)?;
        if written.as_os_str().is_empty() {
            let empty = "found an empty path, expected that of the volume's file";
            return Err(self.origins.error("volume.path", empty));
        }
        Ok(self.origins.path(written))
    }

    pub fn volume_overrides(&self) -> Result<VolumeOverrides> {
        let table = &self.volume;
        if let Some(dims) = table.dims.filter(|dims| dims.contains(&0)) {
            let found = format!("found {dims:?}, expected three whole numbers ≥ 1");
            return Err(self.origins.error("volume.dims", found));
        }
        if let Some(spacing) = table.spacing {
            self.triple("volume.spacing", spacing, VOXEL_SIZE)?;
        }
        if let Some([low, high]) = table.crop
            && (0..3).any(|axis| low[axis] >= high[axis])
        {
            let found = format!(
                "found [{low:?}, {high:?}], expected a low and a higher corner: [low, high) \
                 keeps at least one voxel on each axis"
            );
            return Err(self.origins.error("volume.crop", found));
        }
        Ok(VolumeOverrides {
            dims: table.dims,
            voxel_type: self.word("volume.type", &table.voxel_type)?,
            endian: self.word("volume.endian", &table.endian)?,
            channel: table.channel,
            time: table.time,
            level: table.level,
            spacing: table.spacing,
            axes: self.word("volume.axes", &table.axes)?,
            crop: table.crop,
            series: table.series.clone(),
            fill_gaps: table.fill_gaps.unwrap_or(false),
        })
    }

    /// An error of loading the volume, told where the key was written that it is about, if it is about one.
    pub(crate) fn at_its_key(&self, error: Error) -> Error {
        match error {
            Error::Input {
                location:
                    Location {
                        origin,
                        key: Some(key),
                    },
                problem,
            } => {
                let file = Location::from(origin);
                self.origins.error(&key, format!("{file}{problem}"))
            }
            other => other,
        }
    }
}

pub(super) fn describe_volume(page: &mut Page, file: &SceneFile, volume: &Volume) {
    let table = &file.volume;
    page.table("[volume]");
    if let Some(path) = &table.path {
        page.line("path", file.origins.path(path).to_string_lossy(), "");
    }
    let series = "DICOM: number in `isolume info`, or the SeriesInstanceUID; 1 is the largest";
    page.line_or_comment("series", table.series.as_ref(), &Pick::Number(1), series);
    let gaps = "DICOM: missing slices are interpolated instead of refused";
    page.line_or_comment("fill_gaps", table.fill_gaps, false, gaps);
    let [low, high] = volume.range;
    page.comment(&format!("the data go from {low} to {high}"));
    let raw = "raw files only";
    page.line_or_comment("dims", table.dims, volume.file_dims, raw);
    let voxel_type = volume.voxel_type.to_string();
    page.line_or_comment("type", table.voxel_type.as_ref(), &voxel_type, raw);
    let endian = "raw files only: \"little\" | \"big\"";
    page.line_or_comment("endian", table.endian.as_deref(), "little", endian);
    for (key, given, meaning) in [
        ("channel", table.channel, "counted from 0"),
        ("time", table.time, "counted from 0"),
        ("level", table.level, "counted from 0, the finest"),
    ] {
        page.line_or_comment(key, given, 0, meaning);
    }
    // As keys, they would be wrong for another series or level, or another file.
    let world = "world units a voxel";
    page.line_or_comment("spacing", table.spacing, volume.spacing, world);
    let grow = "where i, j, k of the file grow: L|R, A|P, S|I";
    let example = format!("axes = \"LPI\" says {grow}");
    match (&table.axes, volume.file_axes) {
        (Some(written), _) => page.line("axes", written, grow),
        (None, Some(axes)) => {
            page.comment(&format!("axes: {axes}, from the file; a key {example}"))
        }
        (None, None) => page.comment(&format!("axes: orientation unknown; a key {example}")),
    }
    let whole = [[0; 3], volume.dims];
    page.line_or_comment("crop", table.crop, whole, "voxels, [low, high)");
}
