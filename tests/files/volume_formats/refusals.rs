//! Files that cannot be used: each gets one sentence that names the fact and a remedy.

use isolume::scene::volume::{Endian, Volume, VolumeOverrides, VoxelType};

use crate::volume_files::{Array, gzip, write};
use crate::volume_formats::{DIMS, folder, load_bytes, refusal, refuses, u8s, values};

#[test]
fn shape_is_for_raw_files_only() {
    let folder = folder();
    let path = write(folder.path(), "v.nrrd", u8s().nrrd("raw", ""));
    let overrides = VolumeOverrides {
        dims: Some(DIMS),
        ..Default::default()
    };
    assert!(refusal(&path, &overrides).contains("`dims` is only for .raw"));
    let overrides = VolumeOverrides {
        fill_gaps: true,
        ..Default::default()
    };
    assert!(refusal(&path, &overrides).contains("`fill_gaps` is only for DICOM"));
}

#[test]
fn sheared_axes_are_refused_by_name() {
    let directions = "space: LPS\nspace directions: (1,0,0) (0,1,0) (0,0.2,1)\n";
    refuses(
        "v.nrrd",
        u8s().nrrd("raw", directions),
        &["j and k", "sheared", "78.69"],
    );
    refuses(
        "v.mha",
        u8s().mha("TransformMatrix = 1 0 0 0.1 1 0 0 0 1\n"),
        &["i and j", "sheared"],
    );
    let mut nifti = u8s().nifti();
    nifti.int16(254, 1);
    nifti.floats(280, &[1., 0., 0.5, 0., 0., 1., 0., 0., 0., 0., 1., 0.]);
    refuses("v.nii", nifti.bytes, &["sform", "i and k", "sheared"]);
    let parallel = "space: LPS\nspace directions: (1,0,0) (1,0,0) (0,0,1)\n";
    refuses(
        "v.nrrd",
        u8s().nrrd("raw", parallel),
        &["i and j", "sheared"],
    );
    let nothing = "space: LPS\nspace directions: (0,0,0) (1,0,0) (0,0,1)\n";
    refuses("v.nrrd", u8s().nrrd("raw", nothing), &["axis i"]);
}

#[test]
fn lengths_that_a_gpu_cannot_square_are_refused() {
    for (spacings, found) in [
        ("1 1 3e21", "along z is 3e21"),
        ("-1 1 1e-16", "along z is 1e-16"),
    ] {
        refuses(
            "v.nrrd",
            u8s().nrrd("raw", &format!("spacings: {spacings}\n")),
            &[found, "expected 1e-15 to 1e15 world units"],
        );
    }
}

#[test]
fn sheared_axes_open_with_spacing_and_axes_of_the_user() {
    let folder = folder();
    let mut nifti = u8s().nifti();
    nifti.int16(254, 1);
    nifti.floats(280, &[1., 0.5, 0., 0., 0., 1., 0., 0., 0., 0., 1., 0.]);
    let directions = "space: LPS\nspace directions: (1,0,0) (0,1,0) (0,0.2,1)\n";
    let paths = [
        write(folder.path(), "v.nrrd", u8s().nrrd("raw", directions)),
        write(
            folder.path(),
            "v.mha",
            u8s().mha("TransformMatrix = 1 0 0 0.1 1 0 0 0 1\n"),
        ),
        write(folder.path(), "v.nii", nifti.bytes),
    ];
    let spacing = VolumeOverrides {
        spacing: Some([1.0, 2.0, 3.0]),
        ..Default::default()
    };
    let both = VolumeOverrides {
        axes: Some("RAS".parse().unwrap()),
        ..spacing.clone()
    };
    for path in paths {
        let message = refusal(&path, &spacing);
        let remedy = "give `spacing` and `axes`, which replace the file's";
        assert!(message.contains(remedy), "{message}");
        let volume = Volume::load(&path, &both).unwrap();
        assert_eq!((volume.spacing, volume.axes), ([1.0, 2.0, 3.0], both.axes));
    }
}

#[test]
fn npy_refuses_what_is_no_scalar_volume() {
    let changed = |from: &str, to: &str| {
        assert_eq!(from.len(), to.len());
        let bytes = u8s().npy(1, false);
        let at = bytes.windows(from.len()).position(|w| w == from.as_bytes());
        let at = at.unwrap();
        [&bytes[..at], to.as_bytes(), &bytes[at + to.len()..]].concat()
    };
    refuses(
        "v.npy",
        changed("(2, 3, 4)", "(2, 3*4) "),
        &["`shape`", "three"],
    );
    refuses(
        "v.npy",
        changed("'|u1'", "'|O8'"),
        &["`descr` is `|O8`", "astype"],
    );
    refuses(
        "v.npy",
        changed("'|u1'", "[(,)]"),
        &["`descr`", "one plain number type"],
    );
    refuses("v.npy", changed("shape", "shade"), &["no `shape`"]);
    refuses("v.npy", b"PK\x03\x04", &["version 1, 2 or 3"]);
}

/// The header of an array of Python 2, and those of arrays with an axis too many, which is 1 long.
#[test]
fn npy_shapes_are_read_in_each_spelling() {
    let array = u8s();
    for shape in [
        "(2L, 3L, 4L)",
        "(1, 2, 3, 4)",
        "(2, 3, 4, 1)",
        "( 2,3 ,4L,)",
    ] {
        let bytes = array.npy(2, false);
        let from = "(2, 3, 4)";
        let at = bytes.windows(from.len()).position(|w| w == from.as_bytes());
        let (before, after) = bytes.split_at(at.unwrap());
        let mut changed = [before, shape.as_bytes(), &after[from.len()..]].concat();
        changed[8] += (shape.len() - from.len()) as u8;
        assert_eq!(
            values(&load_bytes("v.npy", changed)),
            array.values,
            "{shape}"
        );
    }
}

#[test]
fn truncated_files_say_how_much_is_missing() {
    let array = Array::new([16, 16, 16], VoxelType::U16, Endian::Little);
    let array = Array {
        values: (0..4096u32)
            .map(|n| f64::from(n.wrapping_mul(2654435761) >> 16))
            .collect(),
        ..array
    };
    let cut = |mut bytes: Vec<u8>, by: usize| {
        bytes.truncate(bytes.len() - by);
        bytes
    };
    let all = "expected 8192 for 16×16×16 uint16";
    refuses(
        "v.nrrd",
        cut(array.nrrd("raw", ""), 100),
        &["holds 8092 bytes", all],
    );
    refuses("v.mha", cut(array.mha(""), 8192), &["holds 0 bytes", all]);
    refuses(
        "v.nii",
        cut(array.nifti().bytes, 1),
        &["holds 8191 bytes", all],
    );
    refuses(
        "v.npy",
        cut(array.npy(1, false), 1),
        &["holds 8191 bytes", all],
    );
    refuses(
        "v.nrrd",
        cut(array.nrrd("gzip", ""), 4000),
        &["bytes of voxels", all],
    );
    refuses(
        "v.nii.gz",
        cut(gzip(&array.nifti().bytes), 4000),
        &["bytes of voxels", all],
    );
    refuses(
        "v.mha",
        cut(array.mha("CompressedData = True\n"), 4000),
        &["bytes of voxels", all],
    );
    refuses(
        "v.nrrd",
        array.nrrd_header("raw", ""),
        &["header does not end"],
    );
}

/// Only numbers make a pattern of a name with `%d` in it, and only if no file has that name.
#[test]
fn names_with_a_per_cent_sign_are_names() {
    let folder = folder();
    let array = u8s();
    for name in [
        "a%20b.raw",
        "a%d.raw",
        "50 %.raw",
        "s%02d.raw 0 9 1",
        "LISTED.raw",
        "100%",
    ] {
        write(folder.path(), name, array.bytes());
        let nrrd = array.nrrd_header("raw", &format!("data file: {name}\n"));
        let nrrd = write(folder.path(), "v.nhdr", nrrd);
        let meta = write(folder.path(), "v.mhd", array.meta_header("", name));
        for path in [nrrd, meta] {
            let volume = Volume::load(&path, &VolumeOverrides::default());
            assert_eq!(values(&volume.unwrap()), array.values, "{name}");
        }
    }
    for name in ["gone%20b.raw", "gone%d.raw"] {
        let nrrd = array.nrrd_header("raw", &format!("data file: {name}\n"));
        refuses("v.nhdr", nrrd, &["its data file", "No such file"]);
    }
    for name in ["gone%03d.raw 0 8 1", "gone %d 1 9 1 2", "LIST 2"] {
        let nrrd = array.nrrd_header("raw", &format!("data file: {name}\n"));
        let found = format!("`data file` is `{name}`, expected one file");
        refuses("v.nhdr", nrrd, &[&found]);
        refuses("v.mhd", array.meta_header("", name), &["or one file"]);
    }
}

/// A damaged stream may decode to more bytes than it should.
#[test]
fn what_follows_compressed_voxels_is_checked() {
    let header = u8s().nrrd_header("gzip", "");
    let file = |behind: usize| {
        let bytes = [u8s().bytes(), vec![7; behind]].concat();
        [header.as_bytes(), b"\n", &gzip(&bytes)].concat()
    };
    let values_of = |bytes| values(&load_bytes("v.nrrd", bytes));
    assert_eq!(values_of(file(100)), u8s().values);
    let mut damaged = file(3);
    let checksum = damaged.len() - 8;
    damaged[checksum] ^= 1;
    refuses("v.nrrd", damaged, &["the file is damaged", "checksum"]);
    refuses(
        "v.nrrd",
        file(2 << 20),
        &["1048575 bytes after the voxels", "header is wrong"],
    );
}

#[test]
fn damaged_compressed_voxels_are_refused() {
    let array = Array::new([16, 16, 16], VoxelType::U8, Endian::Little);
    let mut bytes = array.nrrd("gzip", "");
    let checksum = bytes.len() - 8;
    bytes[checksum] ^= 1;
    refuses("v.nrrd", bytes, &["damaged", "checksum"]);
}

#[test]
fn a_header_cannot_promise_more_than_compression_allows() {
    let array = Array::new([100, 100, 100], VoxelType::U8, Endian::Little);
    let header = array.nrrd_header("gzip", "\n");
    let bytes = [header.as_bytes(), &gzip(&[0; 10])].concat();
    refuses(
        "v.nrrd",
        bytes,
        &["compressed bytes cannot hold the 1000000 expected"],
    );
}

#[test]
fn sizes_that_overflow_are_refused() {
    let sized = |sizes: &str| u8s().nrrd_header("raw", "\n").replace("4 3 2", sizes);
    refuses(
        "v.nrrd",
        sized("4294967295 4294967295 4294967295"),
        &["2^64"],
    );
    refuses(
        "v.nrrd",
        sized("4294967295 4294967295 1"),
        &["holds 0 bytes"],
    );
    refuses(
        "v.nrrd",
        sized("4294967296 1 1"),
        &["`sizes` is", "3 whole numbers"],
    );
    refuses("v.nrrd", sized("-4 3 2"), &["`sizes` is `-4 3 2`"]);
    refuses("v.nrrd", sized("4 3"), &["`sizes` is `4 3`"]);
    refuses("v.nrrd", sized("4 0 2"), &["4×0×2", "at least 1"]);
    let far = u8s().nrrd("gzip", "byte skip: 9223372036854775807\n");
    refuses("v.nrrd", far, &["cannot hold"]);
}

#[test]
fn other_formats_get_a_way_out() {
    refuses("v.dcm", [0; 200], &["is no DICOM file"]);
    refuses(
        "v.xyz",
        [0; 200],
        &["unknown extension", ".nrrd", ".nii.gz", ".raw"],
    );
    refuses("v.nrrd", "nonsense", &["NRRD000"]);
    refuses("v.nrrd", u8s().nrrd("hex", ""), &["`encoding` is `hex`"]);
    refuses(
        "v.nhdr",
        u8s().nrrd_header("raw", "data file: LIST\na.raw\n"),
        &["`data file` is `LIST`"],
    );
    refuses(
        "v.nhdr",
        u8s().nrrd_header("raw", "data file: .\n"),
        &["regular file"],
    );
    let folder = folder();
    let series = folder.path().join("series");
    std::fs::create_dir(&series).unwrap();
    assert!(refusal(&series, &VolumeOverrides::default()).contains("holds no DICOM image"));
    let missing = folder.path().join("gone.nrrd");
    assert!(refusal(&missing, &VolumeOverrides::default()).contains("No such file"));
}

#[test]
fn nothing_personal_is_kept_or_quoted() {
    let personal = "PatientName:=Doe^Jane\ncontent: Doe^Jane\n";
    let volume = load_bytes("v.nrrd", u8s().nrrd("raw", personal));
    assert!(!format!("{volume:?}").contains("Doe"));
    let mut nifti = u8s().nifti();
    nifti.bytes[148..156].copy_from_slice(b"Doe^Jane");
    assert!(!format!("{:?}", load_bytes("v.nii", nifti.bytes)).contains("Doe"));
    let folder = folder();
    let broken = u8s().nrrd("raw", "PatientName Doe^Jane\n");
    let path = write(folder.path(), "v.nrrd", broken);
    let message = refusal(&path, &VolumeOverrides::default());
    assert!(
        message.contains("line 8") && !message.contains("Doe"),
        "{message}"
    );
}
