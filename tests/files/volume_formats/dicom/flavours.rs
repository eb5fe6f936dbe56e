use std::path::Path;

use isolume::scene::volume::{Endian, Quantity, VoxelType};

use super::{everything, folder, hounsfield, loaded, plain, values};
use crate::dicom_files::{Object, PLAIN, Pixels, Syntax, file};
use crate::dicom_scan::{COLUMNS, ROWS, SLICES, Scan};
use crate::tiff_files::Tiff;
use crate::volume_files::{Array, write};

#[test]
fn a_ct_is_what_was_scanned() {
    let volume = loaded(&Scan::ct());
    assert_eq!(volume.dims, [COLUMNS as u32, ROWS as u32, SLICES as u32]);
    assert_eq!(volume.spacing, [0.5, 0.75, 2.5]);
    assert_eq!(volume.axes.unwrap().to_string(), "LPS");
    assert_eq!(volume.voxel_type, VoxelType::U16);
    assert_eq!(volume.quantity, Some(Quantity::Hounsfield));
    assert_eq!(values(&volume), hounsfield());
    assert!(volume.notes.is_empty(), "{:?}", volume.notes);
}

/// The slices as codestreams that other programs made: OpenJPEG, and CharLS as DCMTK has it.
fn packed(scan: &Scan, syntax: Syntax, extension: &str, folder: &Path) {
    for n in 0..SLICES {
        let name = format!("tests/support/dicom/slice{n}.{extension}");
        let packed = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
        let frames = [std::fs::read(packed).unwrap()];
        let bytes = file(&scan.header(n), syntax, Pixels::Packed(&frames), COLUMNS);
        write(folder, &format!("{n}"), bytes);
    }
}

#[test]
fn one_ct_in_every_flavour_is_one_volume() {
    let scan = Scan::ct();
    let expected = everything(&loaded(&scan));
    for syntax in PLAIN
        .into_iter()
        .chain([Syntax::RunLength, Syntax::JpegLossless])
    {
        let classic = folder();
        scan.write(classic.path(), syntax, |n| format!("{n}.dcm"));
        assert_eq!(everything(&plain(classic.path())), expected, "{syntax:?}");
        let enhanced = folder();
        let path = write(enhanced.path(), "all.dcm", scan.enhanced(syntax));
        assert_eq!(everything(&plain(&path)), expected, "enhanced, {syntax:?}");
        assert_eq!(
            everything(&plain(enhanced.path())),
            expected,
            "enhanced, {syntax:?}"
        );
    }
    for (syntax, extension) in [(Syntax::Jpeg2000, "j2k"), (Syntax::JpegLs, "jls")] {
        let folder = folder();
        packed(&scan, syntax, extension, folder.path());
        assert_eq!(everything(&plain(folder.path())), expected, "{syntax:?}");
    }
}

#[test]
fn names_numbers_folders_and_other_files_mean_nothing() {
    let scan = Scan::ct();
    let expected = everything(&loaded(&scan));
    let mixed = folder();
    let inner = mixed.path().join("b/c");
    std::fs::create_dir_all(&inner).unwrap();
    let names = ["z", "b/c/10", "b/c/2.ima", "a.txt", "b/1"];
    scan.write(mixed.path(), Syntax::Explicit, |n| names[n].to_string());
    write(mixed.path(), "README", "no image");
    let picture = Array::new([4, 3, 1], VoxelType::U8, Endian::Little);
    write(mixed.path(), "a.tif", Tiff::default().write(&picture));
    write(&inner, "thumbs.db", [0xff; 400]);
    // A localizer of another size, and a slice once more.
    let localizer = scan
        .clone()
        .with(|common| common.text((8, 8), "CS", "ORIGINAL\\PRIMARY\\LOCALIZER"));
    write(mixed.path(), "l", localizer.slice_file(0, Syntax::Implicit));
    write(mixed.path(), "again", scan.slice_file(2, Syntax::RunLength));
    let volume = plain(mixed.path());
    assert_eq!(everything(&volume), expected);
    super::has(&volume.notes, "1 slice lies where another lies");
    super::has(&volume.notes, "1 × localizer");

    let backwards = folder();
    let mut reversed = scan;
    reversed.slices.reverse();
    reversed.write(backwards.path(), Syntax::Explicit, |n| n.to_string());
    assert_eq!(everything(&plain(backwards.path())), expected);
}

#[test]
fn a_dicomdir_lists_the_files() {
    let folder = folder();
    let scan = Scan::ct();
    std::fs::create_dir(folder.path().join("IMAGES")).unwrap();
    scan.write(folder.path(), Syntax::Explicit, |n| format!("IMAGES/I{n}"));
    write(folder.path(), "IMAGES/X", "not listed");
    let record = |n| Object::default().text((4, 0x1500), "CS", format!("IMAGES\\I{n}"));
    let records = [Object::default()]
        .into_iter()
        .chain((0..SLICES).map(record));
    let directory = Object::default().items((4, 0x1220), records.collect());
    let bytes = file(&directory, Syntax::Explicit, Pixels::Words(&[]), 1);
    let path = write(folder.path(), "DICOMDIR", bytes);
    assert_eq!(values(&plain(&path)), hounsfield());
}

#[test]
fn one_file_is_one_slice() {
    let folder = folder();
    let path = write(
        folder.path(),
        "no_extension",
        Scan::ct().slice_file(1, Syntax::Explicit),
    );
    let volume = plain(&path);
    assert_eq!(volume.dims, [COLUMNS as u32, ROWS as u32, 1]);
}

#[test]
fn a_crop_is_the_same_wherever_it_is_cut() {
    use isolume::scene::volume::{Volume, VolumeOverrides};
    let whole = hounsfield();
    for syntax in [Syntax::Explicit, Syntax::RunLength] {
        let folder = folder();
        Scan::ct().write(folder.path(), syntax, |n| n.to_string());
        let crop = VolumeOverrides {
            crop: Some([[3, 2, 1], [9, 11, 4]]),
            ..VolumeOverrides::default()
        };
        let volume = Volume::load(folder.path(), &crop).unwrap();
        let places = (1..4).flat_map(|z| (2..11).flat_map(move |y| (3..9).map(move |x| (x, y, z))));
        let expected =
            places.map(|(x, y, z): (usize, usize, usize)| whole[(z * ROWS + y) * COLUMNS + x]);
        assert_eq!(values(&volume), expected.collect::<Vec<_>>(), "{syntax:?}");
    }
}
