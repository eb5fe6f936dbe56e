//! Folders of no format of their own, and pictures beside a scan: what is opened, and what the message names.

use std::fs;

use isolume::scene::volume::{Endian, VolumeOverrides, VoxelType};

use super::tiff::textured;
use crate::dicom_files::Syntax;
use crate::dicom_scan::{COLUMNS, ROWS, SLICES, Scan};
use crate::tiff_files::Tiff;
use crate::volume_files::write;
use crate::volume_formats::{folder, plain, refusal, u8s, values};
use crate::zarr_files::{Codec, Zarr};

#[test]
fn a_folder_names_what_can_be_opened_in_it() {
    let parent = folder();
    let folder = parent.path().join("study");
    fs::create_dir(&folder).unwrap();
    let message = || refusal(&folder, &VolumeOverrides::default());
    assert!(message().contains("holds no DICOM image, expected the slices"));

    write(&folder, "002.PNG", "a picture");
    write(&folder, "001.png", "a picture");
    write(&folder, "notes.txt", "");
    write(&folder, "damaged.dcm", "no DICOM");
    let expected = "holds no DICOM image, but pictures such as 001.png; save the slices as TIFF";
    assert!(message().contains(expected), "{}", message());

    write(&folder, "t1.nii.gz", u8s().nifti().bytes);
    let expected = "holds no DICOM image, but t1.nii.gz; open that";
    assert!(message().contains(expected), "{}", message());

    write(&folder, ".hidden.nii", u8s().nifti().bytes);
    write(&folder, "cloud.vdb", "a cloud");
    write(&folder, "V.NRRD", u8s().nrrd("raw", ""));
    write(&folder, "z.mha", u8s().mha(""));
    let zarr = Zarr::new(false, &[1, 2, 3], Codec::Plain);
    zarr.write(&folder.join("cells.zarr"), "zyx", &[2, 3, 4], &u8s());
    let expected = "but V.NRRD, cells.zarr, cloud.vdb and 2 more; open one of these";
    assert!(message().contains(expected), "{}", message());
}

#[test]
fn one_picture_beside_folders_of_a_scan_is_not_the_volume() {
    let folder = folder();
    let page = textured([5, 4, 1], VoxelType::U8, Endian::Little);
    write(folder.path(), "screen.tif", Tiff::default().write(&page));
    assert_eq!(values(&plain(folder.path())), page.values);
    let inner = folder.path().join("study/series");
    fs::create_dir_all(&inner).unwrap();
    Scan::ct().write(&inner, Syntax::Explicit, |n| format!("{n}.dcm"));
    write(folder.path(), "t1.nii", u8s().nifti().bytes);
    let scan = [COLUMNS, ROWS, SLICES].map(|size| size as u32);
    assert_eq!(plain(folder.path()).dims, scan);
    // Two are a stack.
    write(folder.path(), "screen 2.tif", Tiff::default().write(&page));
    assert_eq!(plain(folder.path()).dims, [5, 4, 2]);
}
