//! Fuzzing guided by coverage: libFuzzer changes inputs, keeps those that reach code which no other has reached, and
//! changes them further. `tools/fuzz` builds and runs the targets, which are in `targets/`, one for each parser.
//!
//! A target is two functions: `seeds` makes the first inputs, with the same writers that the tests of formats use, and the
//! other one parses an input. It has a finding when that panics, hangs, or allocates more than the input is worth, and when
//! what was parsed contradicts itself. Panics in decoders of other people are no findings where the library catches them.

pub mod archive;
pub mod folder;
pub mod guard;
pub mod pictures;
pub mod shards;
pub mod volume;

#[path = "../../support/dicom_files.rs"]
pub mod dicom_files;
#[path = "../../support/dicom_scan.rs"]
pub mod dicom_scan;
#[path = "../../support/tiff_files.rs"]
pub mod tiff_files;
#[path = "../../support/vdb_files.rs"]
pub mod vdb_files;
#[path = "../../support/volume_files.rs"]
pub mod volume_files;
#[path = "../../support/zarr_files/mod.rs"]
pub mod zarr_files;

/// Defines the program of a target: its seeds, and what is done with each input.
#[macro_export]
macro_rules! target {
    ($seeds:expr, $parse:expr) => {
        libfuzzer_sys::fuzz_target!(init: $crate::guard::start($seeds), |bytes: &[u8]| { $parse(bytes) });
    };
}
