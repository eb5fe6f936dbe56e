//! The user's settings for a volume's file.

use super::orientation::Axes;
use super::voxel_type::{Endian, VoxelType};

/// The user's settings, which override those of the file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct VolumeOverrides {
    /// Raw files only, x fastest.
    pub dims: Option<[u32; 3]>,
    /// Raw files only.
    pub voxel_type: Option<VoxelType>,
    /// Raw files only; little if absent.
    pub endian: Option<Endian>,
    pub spacing: Option<[f64; 3]>,
    /// Index of the channel, counted from 0; the first if absent, or the OpenVDB grid that is named `density`. Formats that may
    /// hold several only.
    pub channel: Option<u32>,
    /// Index of the time, likewise.
    pub time: Option<u32>,
    /// Index of the resolution, counted from 0, the finest; the finest if absent. TIFF and OME-Zarr only.
    pub level: Option<u32>,
    /// The directions in which the file's i, j and k grow: left-handed ones are reversed like a header's.
    pub axes: Option<Axes>,
    /// The file's voxels [low, high) along i, j and k; only these are kept.
    pub crop: Option<[[u32; 3]; 2]>,
    /// DICOM only: which of several volumes; the largest if absent.
    pub series: Option<Pick>,
    /// DICOM only: missing slices are interpolated instead of refused.
    pub fill_gaps: bool,
}

/// How the user names one of several volumes.
#[derive(Debug, Clone, PartialEq)]
pub enum Pick {
    /// Its number in `isolume info`, from 1 on.
    Number(u32),
    /// DICOM's SeriesInstanceUID.
    Uid(String),
}
