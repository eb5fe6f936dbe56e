//! Damaged files: one sentence, and nothing worse.

use isolume::scene::volume::VolumeOverrides;

use super::{folder, has, plain, refused};
use crate::dicom_files::{Pixels, Syntax, file};
use crate::dicom_scan::{COLUMNS, ROWS, SLICES, Scan};
use crate::volume_files::write;

#[test]
fn a_slice_without_all_of_its_pixels_is_named() {
    for syntax in [
        Syntax::Explicit,
        Syntax::RunLength,
        Syntax::JpegLossless,
        Syntax::Deflated,
    ] {
        let folder = folder();
        let scan = Scan::ct();
        scan.write(folder.path(), syntax, |n| format!("I{n}"));
        let bytes = scan.slice_file(3, syntax);
        write(folder.path(), "I3", &bytes[..bytes.len() - 60]);
        let message = refused(folder.path(), &VolumeOverrides::default());
        assert!(message.contains("I3: "), "{syntax:?}: {message}");
        assert!(
            [
                "truncated",
                "damaged",
                "fragment",
                "missing",
                "marker",
                "JPEG"
            ]
            .iter()
            .any(|word| message.contains(word)),
            "{syntax:?}: {message}"
        );
    }
}

/// As the last slice of a copy that was interrupted: without it, the others are a volume as well.
#[test]
fn a_slice_that_ends_in_its_header_is_named() {
    for syntax in [Syntax::Explicit, Syntax::Implicit, Syntax::Deflated] {
        let folder = folder();
        let scan = Scan::ct();
        scan.write(folder.path(), syntax, |n| format!("{n}.dcm"));
        let bytes = scan.slice_file(SLICES - 1, syntax);
        let pixels = match syntax {
            Syntax::Deflated => bytes.len() / 2,
            _ => bytes.len() - 2 * ROWS * COLUMNS - 8,
        };
        for length in 0..pixels {
            write(folder.path(), "4.dcm", &bytes[..length]);
            has(&plain(folder.path()).notes, "cannot be read: 4.dcm (");
        }
    }
    // Files of other programs beside the slices are no slices.
    let folder = folder();
    Scan::ct().write(folder.path(), Syntax::Explicit, |n| n.to_string());
    for name in ["._0.dcm", "notes.txt", "none.txt"] {
        let contents = if name == "none.txt" { "" } else { "no slice" };
        write(folder.path(), name, contents);
    }
    assert!(plain(folder.path()).notes.is_empty());
    write(folder.path(), "5", "");
    has(&plain(folder.path()).notes, "5 (is empty)");
}

#[test]
fn a_packing_that_is_not_read_is_named_with_a_remedy() {
    let folder = folder();
    Scan::ct().write(folder.path(), Syntax::JpegXl, |n| format!("I{n}"));
    let message = refused(folder.path(), &VolumeOverrides::default());
    assert!(
        message.contains("I0: its pixels are packed as JPEG XL, which is not read; unpack"),
        "{message}"
    );
}

#[test]
fn jpeg_of_12_bits_is_refused_with_a_remedy() {
    let scan = Scan::ct();
    let frame = [
        &[0xff, 0xd8, 0xff, 0xc1, 0, 11, 12, 0, ROWS as u8][..],
        &[0, COLUMNS as u8, 1, 1, 0x11, 0, 0xff, 0xd9],
    ];
    let frames = [frame.concat()];
    let pixels = Pixels::Packed(&frames);
    let bytes = file(&scan.header(0), Syntax::JpegExtended, pixels, COLUMNS);
    let folder = folder();
    let path = write(folder.path(), "v.dcm", bytes);
    let message = refused(&path, &VolumeOverrides::default());
    for part in [
        "JPEG extended",
        "have 12 bits, expected 8",
        "gdcmconv --raw",
    ] {
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn wrong_elements_are_named() {
    let cases = [
        ((0x28, 0x100), "BitsAllocated is 12"),
        ((0x28, 0x101), "BitsStored is 17"),
    ];
    for ((group, element), part) in cases {
        let value = if element == 0x100 { 12 } else { 17 };
        let scan = Scan::ct().with(|common| common.word((group, element), value));
        let folder = folder();
        let path = write(folder.path(), "v.dcm", scan.slice_file(0, Syntax::Explicit));
        let message = refused(&path, &VolumeOverrides::default());
        assert!(message.contains(part), "{message}");
    }
    let mut scan = Scan::ct();
    scan.orientation = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0];
    let folder = folder();
    let path = write(folder.path(), "v.dcm", scan.slice_file(0, Syntax::Explicit));
    let message = refused(&path, &VolumeOverrides::default());
    assert!(message.contains("ImageOrientationPatient"), "{message}");
}
