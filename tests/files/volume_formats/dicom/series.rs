//! A folder with several volumes.

use isolume::scene::volume::{Pick, Volume, VolumeOverrides};

use super::{folder, has, hounsfield, picked, plain, refused, values};
use crate::dicom_files::{Object, Pixels, Syntax, file};
use crate::dicom_scan::{COLUMNS, ROWS, SLICES, Scan, stored};

/// A large volume, a small one of another series, and one of the same series with another acquisition.
fn several() -> tempfile::TempDir {
    let folder = folder();
    let large = Scan::ct();
    let mut small = large.clone().with(|common| {
        common
            .text((0x20, 0x0e), "UI", "1.2.3.4.2")
            .text((8, 0x60), "CS", "MR")
            .text((8, 0x103e), "LO", "T1 axial")
    });
    small.slices.truncate(3);
    let mut later = large
        .clone()
        .with(|common| common.text((0x20, 0x12), "IS", 2));
    later.slices.truncate(4);
    large.write(folder.path(), Syntax::Explicit, |n| format!("b{n}"));
    small.write(folder.path(), Syntax::RunLength, |n| format!("a{n}"));
    later.write(folder.path(), Syntax::Implicit, |n| format!("c{n}"));
    folder
}

#[test]
fn the_largest_is_taken_and_the_others_are_named_with_their_flags() {
    let folder = several();
    let volume = plain(folder.path());
    assert_eq!(values(&volume), hounsfield());
    has(
        &volume.notes,
        "there are 3 volumes; this is number 1, CT, 5 slices of 16×12",
    );
    has(
        &volume.notes,
        "CT, 4 slices of 16×12 (--set volume.series=2)",
    );
    has(
        &volume.notes,
        "MR, 3 slices of 16×12 (--set volume.series=3)",
    );
    assert!(
        !volume.notes.concat().contains("1.2.3.4"),
        "{:?}",
        volume.notes
    );
}

#[test]
fn other_series_have_no_part_in_a_volume() {
    let folder = folder();
    let shown = Scan::ct();
    let mut inverse = shown.clone().with(|common| {
        let common = common.text((0x20, 0x0e), "UI", "1.2.3.4.2");
        common
            .text((0x28, 4), "CS", "MONOCHROME1")
            .word((0x28, 0x120), 0)
    });
    inverse.slices.truncate(2);
    // In the order of names between the others.
    shown.write(folder.path(), Syntax::Explicit, |n| format!("I{}", 2 * n));
    inverse.write(folder.path(), Syntax::Explicit, |n| {
        format!("I{}", 2 * n + 1)
    });
    let volume = plain(folder.path());
    assert_eq!(values(&volume), hounsfield());
    assert!(!volume.notes.iter().any(|note| note.contains("MONOCHROME1")));
    let mut files = volume.files.clone();
    files.sort();
    let own = (0..SLICES).map(|n| folder.path().join(format!("I{}", 2 * n)));
    assert_eq!(files, own.collect::<Vec<_>>());
}

#[test]
fn a_series_is_picked_by_its_number_or_its_uid() {
    let folder = several();
    let depth = |pick| picked(folder.path(), pick).unwrap().dims[2];
    assert_eq!(depth(Pick::Number(2)), 4);
    assert_eq!(depth(Pick::Number(3)), 3);
    assert_eq!(depth(Pick::Uid("1.2.3.4.2".into())), 3);
    assert_eq!(depth(Pick::Uid("1.2.3.4.1".into())), 5);
    let message = picked(folder.path(), Pick::Number(4))
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("volume.series: found 4, expected a number from 1 to 3"),
        "{message}"
    );
    let message = picked(folder.path(), Pick::Uid("9".into()))
        .unwrap_err()
        .to_string();
    assert!(message.contains("none of the 3 volumes"), "{message}");
}

#[test]
fn the_list_says_what_each_is() {
    let folder = several();
    let series = Volume::series(folder.path()).unwrap();
    let numbers: Vec<u32> = series.iter().map(|one| one.number).collect();
    assert_eq!(numbers, [1, 2, 3]);
    assert_eq!(series[2].uid, "1.2.3.4.2");
    assert_eq!(
        (series[2].description.as_str(), series[2].modality.as_str()),
        ("T1 axial", "MR")
    );
    assert_eq!(series[2].slices, 3);
    assert_eq!(series[0].dims, [COLUMNS as u32, ROWS as u32, SLICES as u32]);
    assert_eq!(series[0].spacing, [0.5, 0.75, 2.5]);
    // Two volumes are of one series.
    assert_eq!(series[0].notes, ["acquisition 1"]);
    assert!(series[2].notes.is_empty());
}

#[test]
fn what_is_no_volume_is_said() {
    let empty = folder();
    let message = refused(empty.path(), &VolumeOverrides::default());
    assert!(message.contains("no DICOM image"), "{message}");
    let classes = [
        ("1.2.840.10008.5.1.4.1.1.66.4", "segmentation"),
        ("1.2.840.10008.5.1.4.1.1.481.3", "structure set"),
        ("1.2.840.10008.5.1.4.1.1.11.1", "presentation state"),
    ];
    for (class, kind) in classes {
        let scan = Scan::ct().with(|common| common.text((8, 0x16), "UI", class));
        let message = super::refused_scan(&scan);
        assert!(message.contains(&format!("only 5 × {kind}")), "{message}");
        assert!(message.contains(&format!("0: is a {kind}")), "{message}");
    }
}

#[test]
fn captures_are_volumes_only_if_they_have_a_place() {
    let class = "1.2.840.10008.5.1.4.1.1.7";
    let scan = Scan::ct().with(|common| common.text((8, 0x16), "UI", class));
    assert_eq!(values(&super::loaded(&scan)), hounsfield());
    let folder = folder();
    let screen = scan.header(0).without((0x20, 0x32));
    let words = Pixels::Words(std::slice::from_ref(&scan.slices[0].words));
    let bytes = file(&screen, Syntax::Explicit, words, COLUMNS);
    crate::volume_files::write(folder.path(), "I0", bytes);
    let message = refused(folder.path(), &VolumeOverrides::default());
    assert!(message.contains("only 1 × secondary capture"), "{message}");
}

/// The numbers of acquisitions on the way through a head, step by step.
fn stepwise(acquisitions: [u32; SLICES], change: impl Fn(usize, &mut Scan)) -> tempfile::TempDir {
    let folder = folder();
    for (n, number) in acquisitions.into_iter().enumerate() {
        let mut scan = Scan::ct().with(|common| common.text((0x20, 0x12), "IS", number));
        change(n, &mut scan);
        let name = format!("I{n}");
        crate::volume_files::write(folder.path(), &name, scan.slice_file(n, Syntax::Explicit));
    }
    folder
}

#[test]
fn acquisitions_that_continue_one_another_are_one_volume() {
    let depths = |folder: &std::path::Path| -> Vec<u32> {
        let series = Volume::series(folder).unwrap();
        series.iter().map(|one| one.slices).collect()
    };
    for acquisitions in [
        [1, 1, 2, 2, 2],
        [4, 4, 3, 3, 1],
        [1, 2, 3, 4, 5],
        [1, 2, 1, 2, 1],
    ] {
        let folder = stepwise(acquisitions, |_, _| {});
        let volume = plain(folder.path());
        assert_eq!(values(&volume), hounsfield());
        assert!(volume.notes.is_empty(), "{:?}", volume.notes);
    }
    // Of another region; and overlapping, as repetitions do.
    let far = stepwise([1, 1, 2, 2, 2], |n, scan| {
        scan.slices[n].position[2] += if n < 2 { 0.0 } else { 100.0 };
    });
    assert_eq!(depths(far.path()), [3, 2]);
    let repeated = stepwise([1, 1, 2, 2, 2], |n, scan| {
        scan.slices[n].position[2] -= if n < 2 { 0.0 } else { 3.0 };
    });
    assert_eq!(depths(repeated.path()), [3, 2]);
}

/// Scanners that state something else for each slice, or for one, mean no other volume by it.
#[test]
fn what_differs_with_each_slice_tells_no_volumes_apart() {
    let depths = |differs: &dyn Fn(usize, Object) -> Object| -> Vec<u32> {
        let folder = stepwise([1; SLICES], |n, scan| {
            *scan = scan.clone().with(|common| differs(n, common));
        });
        let series = Volume::series(folder.path()).unwrap();
        series.iter().map(|one| one.slices).collect()
    };
    let image_type = |common: Object, is_derived: bool| {
        if is_derived {
            common.text((8, 8), "CS", "DERIVED\\PRIMARY\\AXIAL")
        } else {
            common
        }
    };
    let whole = [SLICES as u32];
    assert_eq!(
        depths(&|n, common| common.text((0x20, 0x9056), "SH", n)),
        whole
    );
    assert_eq!(
        depths(&|n, common| common.text((0x20, 0x100), "IS", n)),
        whole
    );
    assert_eq!(
        depths(&|n, common| common.double((0x18, 0x9087), n as f64)),
        whole
    );
    assert_eq!(depths(&|n, common| image_type(common, n == 2)), whole);
    assert_eq!(
        depths(&|n, common| image_type(common, n == SLICES - 1)),
        whole
    );
    // Every second slice is of the other kind.
    assert_eq!(depths(&|n, common| image_type(common, n % 2 == 1)), [3, 2]);
    // Thin slices below, and thick ones above.
    assert_eq!(depths(&|n, common| image_type(common, n < 2)), whole);
    let folder = stepwise([1; SLICES], |n, scan| {
        *scan = scan.clone().with(|common| image_type(common, n < 2));
        scan.slices[n].position[2] += 2.0 * n.saturating_sub(1) as f64;
    });
    let volume = plain(folder.path());
    // 16 mm, at the median of the distances.
    assert_eq!(volume.dims[2], 4);
    has(&volume.notes, "2.5 to 4.5 mm apart and resampled");
}

#[test]
fn files_that_cannot_be_read_are_named() {
    let folder = several();
    let whole = Scan::ct().slice_file(0, Syntax::Explicit);
    crate::volume_files::write(folder.path(), "broken", &whole[..300]);
    let volume = plain(folder.path());
    has(
        &volume.notes,
        "there is 1 file that cannot be read: broken (ends at byte 300, inside its header",
    );
    crate::volume_files::write(folder.path(), "cut", &whole[..300]);
    let volume = plain(folder.path());
    has(
        &volume.notes,
        "there are 2 files that cannot be read: broken (ends",
    );
}

#[cfg(unix)]
#[test]
fn what_the_system_does_not_return_is_named_by_its_own_path() {
    let folder = several();
    let link = folder.path().join("link");
    std::os::unix::fs::symlink("link", &link).unwrap();
    let message = refused(folder.path(), &VolumeOverrides::default());
    assert!(
        message.contains("its file link cannot be read: "),
        "{message}"
    );
    std::fs::remove_file(link).unwrap();
    // A path that is longer than any that the system opens.
    let name = "n".repeat(250);
    let [inner, outer] = ["inner", "outer"].map(|name| folder.path().join(name));
    std::fs::create_dir(&inner).unwrap();
    for _ in 0..17 {
        std::fs::create_dir(&outer).unwrap();
        std::fs::rename(&inner, outer.join(&name)).unwrap();
        std::fs::rename(&outer, &inner).unwrap();
    }
    let message = refused(folder.path(), &VolumeOverrides::default());
    let path = format!("its folder inner/{name}/{name}/");
    assert!(
        message.contains(&path) && message.contains("cannot be read: "),
        "{message}"
    );
}

#[test]
fn previews_show_the_middle_slice_of_each_and_need_no_other() {
    let folder = several();
    // In the order of their places the middle one of the largest volume is the third.
    let middle = folder.path().join("b2");
    for n in [0, 1, 3, 4] {
        let name = folder.path().join(format!("b{n}"));
        let mut bytes = std::fs::read(&name).unwrap();
        let pixels = bytes.len() - 2 * COLUMNS * ROWS;
        bytes[pixels..].fill(0);
        std::fs::write(name, bytes).unwrap();
    }
    let previews = Volume::previews(folder.path()).unwrap();
    let listed: Vec<_> = previews.iter().map(|p| p.series.clone()).collect();
    assert_eq!(listed, Volume::series(folder.path()).unwrap());
    let thumbnail = previews[0].thumbnail.as_ref().unwrap();
    // 16 pixels of 0.5 mm beside 12 of 0.75 mm.
    assert_eq!(thumbnail.size, [43, 48]);
    let row = |y: usize| (0..COLUMNS).map(move |x| stored(x, y, 2));
    let all: Vec<u16> = (0..ROWS).flat_map(row).collect();
    let brightest = all.iter().zip(0..).max().unwrap().1;
    let [x, y] = [brightest % COLUMNS, brightest / COLUMNS];
    let at = |x: usize, y: usize| (4 * y + 2) * 43 + (x * 43 + 21) / COLUMNS;
    assert_eq!(thumbnail.levels[at(x, y)], 255);
    let darkest = all.iter().zip(0..).min().unwrap().1;
    assert_eq!(
        thumbnail.levels[at(darkest % COLUMNS, darkest / COLUMNS)],
        0
    );

    std::fs::write(&middle, &std::fs::read(&middle).unwrap()[..900]).unwrap();
    let previews = Volume::previews(folder.path()).unwrap();
    assert_eq!(previews.len(), 3);
    assert!(previews[2].thumbnail.is_some());
}

#[test]
fn one_volume_has_nothing_to_choose_from() {
    let folder = folder();
    Scan::ct().write(folder.path(), Syntax::Explicit, |n| format!("I{n}"));
    assert_eq!(Volume::previews(folder.path()).unwrap(), []);
}
