//! What is read and written: arguments, scene files, volumes, presets, pictures, statistics. No device is needed.

#[path = "../support/dicom_files.rs"]
mod dicom_files;
#[path = "../support/dicom_scan.rs"]
mod dicom_scan;
#[path = "../support/tiff_files.rs"]
mod tiff_files;
#[path = "../support/vdb_files.rs"]
mod vdb_files;
#[path = "../support/volume_files.rs"]
mod volume_files;
#[path = "../support/zarr_files/mod.rs"]
mod zarr_files;

mod command_line;
mod compare;
mod output;
mod presets;
mod scene_file;
mod volume_formats;
