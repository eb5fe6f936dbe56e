//! NRRD: names of types, skips, and directions of every kind.

use isolume::scene::volume::{Axes, Endian, Volume, VolumeOverrides, VoxelType};

use crate::volume_files::{Array, gzip, write};
use crate::volume_formats::{folder, load_bytes, plain, refuses, u8s, values};

#[test]
fn nrrd_knows_every_name_of_a_type() {
    let names = [
        (VoxelType::I8, "signed char,int8,int8_t"),
        (VoxelType::U8, "uchar,unsigned char,uint8,uint8_t"),
        (
            VoxelType::I16,
            "short,short int,signed short,signed short int,int16,int16_t",
        ),
        (
            VoxelType::U16,
            "ushort,unsigned short,unsigned short int,uint16,uint16_t",
        ),
        (VoxelType::I32, "int,signed int,int32,int32_t"),
        (VoxelType::U32, "uint,unsigned int,uint32,uint32_t"),
        (
            VoxelType::I64,
            "longlong,long long,long long int,signed long long,int64,int64_t",
        ),
        (
            VoxelType::U64,
            "ulonglong,unsigned long long,unsigned long long int,uint64,uint64_t",
        ),
        (VoxelType::F32, "float"),
        (VoxelType::F64, "double"),
    ];
    for (voxel_type, aliases) in names {
        for alias in aliases.split(',') {
            let header = format!(
                "NRRD0001\ntype: {alias}\ndimension: 3\nsizes: 1 1 1\nendian: big\nencoding: raw\n\n"
            );
            let volume = load_bytes("v.nrrd", [header.as_bytes(), &[0; 8]].concat());
            assert_eq!(volume.voxel_type, voxel_type, "{alias}");
        }
    }
    let text = u8s().nrrd_header("raw", "\n").replace("uint8", "block");
    refuses("v.nrrd", text, &["`type` is `block`"]);
    let text = u8s().nrrd_header("raw", "kinds: RGB-color domain domain\n\n");
    let expected = "expected domain or space for three axes";
    refuses(
        "v.nrrd",
        text,
        &["`kinds` is `RGB-color domain domain`", expected],
    );
}

#[test]
fn nrrd_skips_lines_and_bytes() {
    let array = u8s();
    let folder = folder();
    let body = [b"one\ntwo\n.....".as_slice(), &array.bytes()].concat();
    write(folder.path(), "v.bin", &body);
    for skips in [
        "line skip: 2\nbyte skip: 5\n",
        "byte skip: 13\n",
        "byteskip: -1\n",
    ] {
        let header = array.nrrd_header("raw", &format!("{skips}data file: v.bin\n"));
        let volume = plain(&write(folder.path(), "v.nhdr", header));
        assert_eq!(values(&volume), array.values, "{skips}");
    }
    let header = array.nrrd_header("raw", "line skip: 1\ndata file: gone.bin\n");
    refuses(
        "v.nhdr",
        header,
        &["its data file ", "gone.bin: No such file"],
    );
    let packed = [
        b"one\n",
        &gzip(&[b"....".as_slice(), &array.bytes()].concat())[..],
    ]
    .concat();
    write(folder.path(), "v.gz", packed);
    let header = array.nrrd_header("gzip", "line skip: 1\nbyte skip: 4\ndata file: v.gz\n");
    let volume = plain(&write(folder.path(), "v.nhdr", header));
    assert_eq!(values(&volume), array.values);
}

/// Letters and spacing for a NRRD with these lines.
fn nrrd_axes(space: &str, directions: &str) -> (String, [f64; 3], Volume) {
    let more = format!("space: {space}\nspace directions: {directions}\n");
    let volume = load_bytes("v.nrrd", u8s().nrrd("raw", &more));
    let letters = volume.axes.map_or("none".into(), |axes| axes.to_string());
    (letters, volume.spacing, volume)
}

#[test]
fn nrrd_directions_become_letters() {
    let straight = "(0.5,0,0) (0,2,0) (0,0,3)";
    for (space, letters) in [
        ("left-posterior-superior", "LPS"),
        ("LPS", "LPS"),
        ("RAS", "RAS"),
        ("right-anterior-superior", "RAS"),
        ("3D-right-handed", "none"),
        ("scanner-xyz", "none"),
    ] {
        let (found, spacing, volume) = nrrd_axes(space, straight);
        assert_eq!(found, letters, "{space}");
        assert_eq!(spacing, [0.5, 2.0, 3.0]);
        assert_eq!(values(&volume), u8s().values);
    }
    // Sagittal slices: i runs to the back, j down, k to the right.
    let (letters, spacing, _) = nrrd_axes("LPS", "(0, 2, 0) (0, 0, -3) (-4, 0, 0)");
    assert_eq!((letters.as_str(), spacing), ("PIR", [2.0, 3.0, 4.0]));
    // 30° about the first axis.
    let (letters, spacing, _) = nrrd_axes("RAS", "(2,0,0) (0,1.7320508,1) (0,-1,1.7320508)");
    assert_eq!(letters, "RAS");
    assert!((spacing[1] - 2.0).abs() < 1e-6);
    refuses(
        "v.nrrd",
        u8s().nrrd(
            "raw",
            "space: LPS\nspace directions: none (1,0,0) (0,1,0)\n",
        ),
        &["`space directions`", "three vectors"],
    );
    refuses(
        "v.nrrd",
        u8s().nrrd(
            "raw",
            "space: somewhere\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n",
        ),
        &["`space` is `somewhere`"],
    );
}

#[test]
fn left_handed_axes_are_reversed_along_the_slowest() {
    let array = u8s();
    let flipped: Vec<f64> = [&array.values[12..], &array.values[..12]].concat();
    let straight = "(1,0,0) (0,1,0) (0,0,1)";
    for (space, directions, letters) in [
        ("LPS", "(-1,0,0) (0,1,0) (0,0,1)", "RPI"),
        ("LAS", straight, "LAI"),
        ("3D-left-handed", straight, "none"),
        ("3D-right-handed", "(0,1,0) (1,0,0) (0,0,1)", "none"),
    ] {
        let (found, _, volume) = nrrd_axes(space, directions);
        assert_eq!(found, letters, "{space}");
        assert_eq!(values(&volume), flipped, "{space}");
        assert!(
            volume.notes[0].contains("left-handed"),
            "{:?}",
            volume.notes
        );
    }

    let folder = folder();
    let path = write(folder.path(), "v.nrrd", array.nrrd("raw", ""));
    let said = |axes: &str| VolumeOverrides {
        axes: Some(axes.parse().unwrap()),
        ..Default::default()
    };
    let left = Volume::load(&path, &said("LPI")).unwrap();
    assert_eq!(
        (left.axes.unwrap().to_string().as_str(), values(&left)),
        ("LPS", flipped)
    );
    let right = Volume::load(&path, &said("RAS")).unwrap();
    assert_eq!(
        (right.axes.unwrap().to_string().as_str(), values(&right)),
        ("RAS", array.values)
    );
    assert!(right.notes.is_empty());
}

#[test]
fn oblique_axes_get_distinct_letters_of_their_own_handedness() {
    // 60° about (1,1,1): each axis is as near to one direction as to another.
    let (letters, _, volume) = nrrd_axes("LPS", "(2,2,-1) (-1,2,2) (2,-1,2)");
    let axes: Axes = letters.parse().unwrap();
    assert!(!axes.left_handed() && volume.notes.is_empty());
}

/// The fields that stand for the spacing where it is not written itself.
#[test]
fn nrrd_axes_from_a_minimum_to_a_maximum_have_a_spacing() {
    let known = |lines: &str| {
        let volume = load_bytes("v.nrrd", u8s().nrrd("raw", lines));
        assert!(volume.notes.is_empty(), "{lines}: {:?}", volume.notes);
        volume.spacing
    };
    let ends = "axis mins: -1 0 6\naxis maxs: 1 1.5 -6\n";
    assert_eq!(known(ends), [0.5, 0.5, 6.0]);
    assert_eq!(known(&ends.replace("axis m", "axism")), [0.5, 0.5, 6.0]);
    for field in ["centerings", "centers"] {
        let centred = format!("{ends}{field}: cell node node\n");
        assert_eq!(known(&centred), [0.5, 0.75, 12.0]);
    }
    let unknown_centring = format!("{ends}centerings: ??? none cell\n");
    assert_eq!(known(&unknown_centring), [0.5, 0.5, 6.0]);
    assert_eq!(known(&format!("spacings: 1 2 3\n{ends}")), [1.0, 2.0, 3.0]);
    let directions = "space directions: (1,0,0) (0,2,0) (0,0,3)\n";
    assert_eq!(known(&format!("{directions}{ends}")), [1.0, 2.0, 3.0]);
    assert_eq!(known("axis mins: 5 5 5\n"), [1.0; 3]);

    for ends in [
        "axis mins: -1 nan 6\naxis maxs: 1 1.5 -6\n",
        "axis mins: -1 0 6\naxis maxs: 1 0 -6\n",
    ] {
        let volume = load_bytes("v.nrrd", u8s().nrrd("raw", ends));
        assert_eq!(volume.spacing, [0.5, 1.0, 6.0]);
        let note = &volume.notes[0];
        assert!(note.contains("`axis mins` and `axis maxs`"), "{note}");
    }
    let short = "axis mins: -1\naxis maxs: 1 1.5 -6\n";
    let volume = load_bytes("v.nrrd", u8s().nrrd("raw", short));
    assert_eq!(volume.spacing, [0.5, 1.0, 1.0]);

    // A single slice has no second node, and the channels' axis is no place.
    let array = Array::new([3, 4, 1], VoxelType::U8, Endian::Little);
    let lines = "axis mins: 0 0 0\naxis maxs: 4 6 2\ncenterings: node node node\n";
    let volume = load_bytes("v.nrrd", array.nrrd("raw", lines));
    assert_eq!(volume.spacing, [2.0, 2.0, 2.0]);
    let four = "NRRD0001\ntype: uint8\ndimension: 4\nsizes: 2 2 2 2\nencoding: raw\n\
                kinds: vector space space space\naxis mins: NaN 0 0 0\naxis maxs: NaN 2 4 6\n\n";
    let volume = load_bytes("v.nrrd", [four.as_bytes(), &[0; 16]].concat());
    assert_eq!(volume.spacing, [1.0, 2.0, 3.0]);
    let about_ends = |note: &String| note.contains("axis mins");
    assert!(!volume.notes.iter().any(about_ends), "{:?}", volume.notes);
}

#[test]
fn a_negative_spacing_is_as_long() {
    let volume = load_bytes("v.nrrd", u8s().nrrd("raw", "spacings: 0.5 -1 -2\n"));
    assert_eq!(volume.spacing, [0.5, 1.0, 2.0]);
}

/// A misspelt field would otherwise leave its default without a word.
#[test]
fn fields_that_nrrd_does_not_have_are_told() {
    let volume = load_bytes(
        "v.nrrd",
        u8s().nrrd("raw", "spacing: 2 2 2\nThickness: 3\n"),
    );
    assert_eq!(volume.spacing, [1.0; 3]);
    let note =
        "NRRD does not have these fields of the header, which are ignored: spacing, thickness";
    assert_eq!(volume.notes, [note]);
    let known =
        "content: a\nold min: 0\nkinds: domain domain domain\nsample units: HU\nkey:=value\n";
    assert!(
        load_bytes("v.nrrd", u8s().nrrd("raw", known))
            .notes
            .is_empty()
    );
    let twice = u8s().nrrd("raw", "spacings: 1 1 1\nspacings: 1 1 2\n");
    refuses(
        "v.nrrd",
        twice,
        &["the header has `spacings` twice, with different values"],
    );
    let same = u8s().nrrd("raw", "spacings: 1 1 2\nspacings: 1 1 2\n");
    assert_eq!(load_bytes("v.nrrd", same).spacing, [1.0, 1.0, 2.0]);
}

/// The unit of x is that of the world.
#[test]
fn nrrd_lengths_are_in_one_unit() {
    let directions = "space: left-posterior-superior\nspace directions: (2,0,0) (0,3,0) (0,0,40)\n";
    for (fields, unit, spacing) in [
        (directions.to_string(), None, [2.0, 3.0, 40.0]),
        (
            format!("{directions}space units: \"mm\" \"mm\" \"mm\"\n"),
            Some("mm"),
            [2.0, 3.0, 40.0],
        ),
        (
            format!("{directions}space units: \"millimeter\" \"cm\" \"um\"\n"),
            Some("mm"),
            [2.0, 30.0, 0.04],
        ),
        (
            "spacings: 2 3 40\nunits: \"um\" \"mm\" \"\"\n".to_string(),
            Some("µm"),
            [2.0, 3000.0, 40.0],
        ),
        (
            "spacings: 2 3 40\nunits: \"???\" \"???\" \"???\"\n".to_string(),
            None,
            [2.0, 3.0, 40.0],
        ),
    ] {
        let text = u8s().nrrd_header("raw", &format!("{fields}\n"));
        let volume = load_bytes("v.nrrd", [text.as_bytes(), &u8s().bytes()].concat());
        assert_eq!(volume.storage.unit.as_deref(), unit, "{fields}");
        assert_eq!(volume.spacing, spacing, "{fields}");
    }
}
