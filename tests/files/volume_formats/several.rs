//! NIfTI, NRRD and MetaImage with several times or channels: each is found where it lies, and nothing beyond it is read.

use std::path::Path;

use isolume::scene::volume::{Endian, Volume, VolumeOverrides, VoxelType};

use crate::volume_files::{Array, gzip, write, zlib};
use crate::volume_formats::{DIMS, folder, refusal, values};

/// Volumes that differ in each voxel.
fn volumes(count: usize) -> Vec<Array> {
    let mut rng = fastrand::Rng::with_seed(5);
    let volume = |_| {
        let mut array = Array::new(DIMS, VoxelType::I16, Endian::Big);
        array.values.fill_with(|| f64::from(rng.i16(..)));
        array
    };
    (0..count).map(volume).collect()
}

/// One volume after another.
fn in_turn(volumes: &[Array]) -> Vec<u8> {
    volumes.iter().flat_map(Array::bytes).collect()
}

/// The values of one voxel after another.
fn side_by_side(volumes: &[Array]) -> Vec<u8> {
    let values =
        (0..volumes[0].values.len()).flat_map(|n| volumes.iter().map(move |v| v.values[n]));
    let all = Array {
        values: values.collect(),
        ..volumes[0].clone()
    };
    all.bytes()
}

fn at(channel: Option<u32>, time: Option<u32>) -> VolumeOverrides {
    VolumeOverrides {
        channel,
        time,
        ..Default::default()
    }
}

fn is_read(path: &Path, overrides: &VolumeOverrides, expected: &Array) {
    let volume = Volume::load(path, overrides).unwrap();
    assert_eq!(volume.dims, DIMS, "{}", path.display());
    assert_eq!(values(&volume), expected.values, "{overrides:?}");
    let crop = VolumeOverrides {
        crop: Some([[1, 1, 1], [3, 2, 2]]),
        ..overrides.clone()
    };
    let part = Volume::load(path, &crop).unwrap();
    assert_eq!(values(&part), expected.values[17..19], "{overrides:?}");
}

/// A file of several times, of which the first is shown by default.
fn has_times(path: &Path, times: &[Array]) {
    is_read(path, &at(None, None), &times[0]);
    for (time, expected) in times.iter().enumerate() {
        is_read(path, &at(None, Some(time as u32)), expected);
    }
    let volume = Volume::load(path, &at(None, Some(1))).unwrap();
    let count = times.len() as u32;
    assert_eq!(
        (volume.storage.times, volume.storage.time),
        (count, Some(1))
    );
    let note = format!("time 1 of {count} is shown; `--set volume.time=N`");
    assert!(volume.notes[0].contains(&note), "{:?}", volume.notes);
    let message = refusal(path, &at(None, Some(count)));
    let expected = format!("volume.time: found {count}, expected 0 to {}", count - 1);
    assert!(message.contains(&expected), "{message}");
    assert!(refusal(path, &at(Some(1), None)).contains("there is only one"));
}

fn has_channels(path: &Path, channels: &[Array]) {
    is_read(path, &at(None, None), &channels[0]);
    for (channel, expected) in channels.iter().enumerate() {
        is_read(path, &at(Some(channel as u32), None), expected);
    }
    let volume = Volume::load(path, &at(Some(1), None)).unwrap();
    assert_eq!(volume.storage.channels as usize, channels.len());
    assert!(
        volume.notes[0].contains("channel 1 of"),
        "{:?}",
        volume.notes
    );
}

#[test]
fn nifti_has_times_and_components() {
    let all = volumes(6);
    let mut narrow = all[0].nifti();
    narrow.int16(40, 4);
    narrow.int16(48, 6);
    narrow.bytes.truncate(352);
    narrow.bytes.extend(in_turn(&all));
    let mut wide = all[0].nifti_2();
    wide.int64(16, 4);
    wide.int64(48, 6);
    wide.bytes.truncate(544);
    wide.bytes.extend(in_turn(&all));
    let folder = folder();
    for file in [&narrow, &wide] {
        has_times(&write(folder.path(), "v.nii", &file.bytes), &all);
        has_times(&write(folder.path(), "v.nii.gz", gzip(&file.bytes)), &all);
    }
    narrow.int16(40, 5);
    narrow.int16(48, 2);
    narrow.int16(50, 3);
    let path = write(folder.path(), "v.nii", &narrow.bytes);
    for channel in 0..3 {
        for time in 0..2 {
            let expected = &all[(2 * channel + time) as usize];
            is_read(&path, &at(Some(channel), Some(time)), expected);
        }
    }
    narrow.int16(48, 1);
    has_channels(&write(folder.path(), "v.nii", &narrow.bytes), &all[..3]);
}

/// A file that ends behind the wanted time is enough for that.
#[test]
fn times_that_are_not_wanted_are_not_read() {
    let all = volumes(3);
    let mut file = all[0].nifti();
    file.int16(40, 4);
    file.int16(48, 3);
    file.bytes.truncate(352);
    file.bytes.extend(in_turn(&all[..2]));
    let folder = folder();
    let path = write(folder.path(), "v.nii", &file.bytes);
    is_read(&path, &at(None, Some(1)), &all[1]);
    let message = refusal(&path, &at(None, Some(2)));
    assert!(
        message.contains("holds 0 bytes of voxels, expected 48"),
        "{message}"
    );
}

fn nrrd(sizes: &str, encoding: &str, more: &str, data: &[u8]) -> Vec<u8> {
    let count = sizes.split(' ').count();
    let header = format!(
        "NRRD0004\ntype: int16\ndimension: {count}\nsizes: {sizes}\nendian: big\nencoding: {encoding}\n{more}\n"
    );
    let body = match encoding {
        "gzip" => gzip(data),
        _ => data.to_vec(),
    };
    [header.as_bytes(), &body].concat()
}

#[test]
fn nrrd_has_times_after_space() {
    let all = volumes(5);
    let folder = folder();
    let straight = "space: RAS\nspace directions: (2,0,0) (0,3,0) (0,0,4)";
    for more in [
        "".to_string(),
        "kinds: domain domain domain time\n".into(),
        "kinds: space space space ???\n".into(),
        "byte skip: -1\n".into(),
        "spacings: 2 3 4 nan\n".into(),
        format!("{straight} none\n"),
        "space: RAST\nspace directions: (2,0,0,0) (0,3,0,0) (0,0,4,0) (0,0,0,1.5)\n".into(),
    ] {
        for encoding in ["raw", "gzip"] {
            if encoding == "gzip" && more.contains("skip") {
                continue;
            }
            let file = nrrd("4 3 2 5", encoding, &more, &in_turn(&all));
            let path = write(folder.path(), "v.nrrd", file);
            has_times(&path, &all);
            let volume = Volume::load(&path, &at(None, None)).unwrap();
            if more.contains("spac") && !more.contains("kinds") {
                assert_eq!(volume.spacing, [2.0, 3.0, 4.0], "{more}");
            }
            let letters = volume.axes.map(|axes| axes.to_string());
            assert_eq!(letters.is_some(), more.contains("RAS"), "{more}");
        }
    }
    let file = nrrd(
        "4 3 2 5",
        "raw",
        "kinds: space space space list\n",
        &in_turn(&all),
    );
    has_channels(&write(folder.path(), "v.nrrd", file), &all);
}

#[test]
fn nrrd_has_channels_before_space() {
    let all = volumes(6);
    let folder = folder();
    let directions = "space: LPS\nspace directions: none (2,0,0) (0,3,0) (0,0,4)\n";
    for more in [
        "kinds: vector domain domain domain\n".to_string(),
        "kinds: RGB-color space space space\nspacings: nan 1 1 1\n".into(),
        format!("kinds: list domain domain domain\n{directions}"),
        directions.into(),
    ] {
        for encoding in ["raw", "gzip"] {
            let file = nrrd("6 4 3 2", encoding, &more, &side_by_side(&all));
            has_channels(&write(folder.path(), "v.nrrd", file), &all);
        }
    }
    // Times of vectors: the values of a voxel first, whole volumes last.
    let [early, late] = [&all[..3], &all[3..]].map(side_by_side);
    let more = "kinds: 3-vector domain domain domain time\n";
    let file = nrrd("3 4 3 2 2", "raw", more, &[early, late].concat());
    let path = write(folder.path(), "v.nrrd", file);
    for (n, expected) in all.iter().enumerate() {
        let (channel, time) = (n as u32 % 3, n as u32 / 3);
        is_read(&path, &at(Some(channel), Some(time)), expected);
    }
}

#[test]
fn nrrd_drops_axes_of_length_1() {
    let [array] = &volumes(1)[..] else { panic!() };
    let folder = folder();
    for (sizes, more) in [
        ("1 4 3 2", ""),
        ("4 3 2 1", ""),
        ("1 4 3 2", "kinds: list domain domain domain\n"),
        ("4 1 3 2", "kinds: domain stub domain domain\n"),
    ] {
        let file = nrrd(sizes, "raw", more, &array.bytes());
        let path = write(folder.path(), "v.nrrd", file);
        is_read(&path, &at(None, None), array);
        let volume = Volume::load(&path, &at(None, None)).unwrap();
        assert!(volume.notes.is_empty(), "{:?}", volume.notes);
    }
}

#[test]
fn nrrd_refuses_axes_that_it_cannot_place() {
    let folder = folder();
    for (sizes, more, part) in [
        ("4 3", "", "`dimension` is `2`"),
        ("4 3 2 0", "", "`sizes` has 0 for axis 4"),
        (
            "4 3 2 5 5",
            "",
            "only one axis of channels and one of times",
        ),
        (
            "4 3 5 2",
            "kinds: domain domain list domain\n",
            "the first axis or the last",
        ),
        (
            "4 3 2 5",
            "kinds: domain domain\n",
            "one for each of 4 axes",
        ),
        (
            "4 3 2 5",
            "kinds: list list domain domain\n",
            "domain or space for three axes",
        ),
        (
            "4 3 2 5",
            "space directions: (1,0,0)\n",
            "for each of 4 axes",
        ),
    ] {
        let path = write(
            folder.path(),
            "v.nrrd",
            nrrd(sizes, "raw", more, &[0; 4000]),
        );
        let message = refusal(&path, &at(None, None));
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
}

fn mha(changes: &[(&str, &str)], more: &str, data: &[u8]) -> Vec<u8> {
    let mut header = volumes(1)[0].meta_header(more, "LOCAL");
    for (from, to) in changes {
        assert!(header.contains(from));
        header = header.replace(from, to);
    }
    let body = if more.contains("CompressedData = True") {
        zlib(data)
    } else {
        data.to_vec()
    };
    [header.as_bytes(), &body].concat()
}

#[test]
fn metaimage_has_times_and_channels() {
    let all = volumes(5);
    let folder = folder();
    let in_time = [("NDims = 3", "NDims = 4"), ("4 3 2", "4 3 2 5")];
    let matrix = "ElementSpacing = 2 3 4 1.5\nTransformMatrix = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n";
    // ITK has no letters for four axes.
    for (packed, letters) in [
        ("", "AnatomicalOrientation = ????\n"),
        ("CompressedData = True\n", ""),
    ] {
        let more = format!("{packed}{matrix}{letters}");
        let path = write(folder.path(), "v.mha", mha(&in_time, &more, &in_turn(&all)));
        has_times(&path, &all);
        let volume = Volume::load(&path, &at(None, None)).unwrap();
        assert_eq!(volume.spacing, [2.0, 3.0, 4.0]);
        assert_eq!(volume.axes.unwrap().to_string(), "LPS");
        let more = format!("{packed}ElementNumberOfChannels = 5\n");
        let file = mha(&[], &more, &side_by_side(&all));
        has_channels(&write(folder.path(), "v.mha", file), &all);
    }
    let none = mha(&[in_time[0], ("4 3 2", "4 3 2 0")], "", &[]);
    let path = write(folder.path(), "v.mha", none);
    let message = refusal(&path, &at(None, None));
    assert!(message.contains("`DimSize` is `4 3 2 0`"), "{message}");
}

/// So many values a voxel that they are not read together.
#[test]
fn voxels_may_have_very_many_values() {
    let folder = folder();
    let mut array = Array::new([200_000, 2, 1], VoxelType::I16, Endian::Little);
    let last = array.values.len() - 1;
    (array.values[199_999], array.values[last]) = (-7.0, 9.0);
    let header = array.meta_header("ElementNumberOfChannels = 200000\n", "LOCAL");
    let header = header.replace("200000 2 1", "1 2 1");
    let file = [header.as_bytes(), &array.bytes()].concat();
    let path = write(folder.path(), "v.mha", file);
    let volume = Volume::load(&path, &at(Some(199_999), None)).unwrap();
    assert_eq!(values(&volume), [-7.0, 9.0]);
}
