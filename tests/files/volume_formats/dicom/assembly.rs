//! Where slices form no grid: what is done, what is told, and what is refused.

use isolume::scene::volume::{Pick, Volume, VolumeOverrides};

use super::{
    everything, folder, has, hounsfield, loaded, plain, refused, refused_scan, values, written,
};
use crate::dicom_files::Syntax;
use crate::dicom_scan::{COLUMNS, ROWS, SLICES, Scan};
use crate::volume_files::write;

#[test]
fn left_stays_left_whichever_way_the_scanner_went() {
    // Feet first, the patient lies on the belly: rows run to the right, columns to the front.
    let mut turned = Scan::ct();
    turned.orientation = [-1.0, 0.0, 0.0, 0.0, -1.0, 0.0];
    assert_eq!(loaded(&turned).axes.unwrap().to_string(), "RAS");
    let mut coronal = Scan::ct();
    coronal.orientation = [1.0, 0.0, 0.0, 0.0, 0.0, -1.0];
    for (n, slice) in coronal.slices.iter_mut().enumerate() {
        slice.position = [0.0, 2.5 * n as f64, 0.0];
    }
    let volume = loaded(&coronal);
    assert_eq!(volume.axes.unwrap().to_string(), "LIP");
    assert_eq!(values(&volume), hounsfield());
    // The normal of these rows and columns points down: the slices come in reverse.
    let mut mirrored = Scan::ct();
    mirrored.orientation = [-1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let volume = loaded(&mirrored);
    assert_eq!(volume.axes.unwrap().to_string(), "RPI");
    let slice = ROWS * COLUMNS;
    assert_eq!(
        values(&volume)[..slice],
        hounsfield()[(SLICES - 1) * slice..]
    );
}

#[test]
fn copies_are_left_out_however_they_are_stored() {
    let folder = folder();
    Scan::ct().write(folder.path(), Syntax::Explicit, |n| format!("I{n}"));
    Scan::ct().write(folder.path(), Syntax::BigEndian, |n| format!("b{n}"));
    Scan::ct().write(folder.path(), Syntax::RunLength, |n| format!("r{n}"));
    let mut signed = Scan::ct().with(|common| {
        common
            .word((0x28, 0x101), 16)
            .word((0x28, 0x102), 15)
            .word((0x28, 0x103), 1)
    });
    signed
        .slices
        .iter_mut()
        .for_each(|slice| slice.intercept = 0.0);
    for word in signed.slices.iter_mut().flat_map(|slice| &mut slice.words) {
        *word = word.wrapping_sub(1024);
    }
    signed.write(folder.path(), Syntax::Implicit, |n| format!("s{n}"));
    let volume = plain(folder.path());
    assert_eq!(values(&volume), hounsfield());
    has(&volume.notes, "15 slices lie where others lie");
}

#[test]
fn a_copy_that_cannot_be_read_is_no_loss() {
    let folder = folder();
    Scan::ct().write(folder.path(), Syntax::Explicit, |n| format!("I{n}"));
    for n in [1, 3] {
        let whole = Scan::ct().slice_file(n, Syntax::Implicit);
        write(
            folder.path(),
            &format!("cut{n}"),
            &whole[..whole.len() - 10],
        );
    }
    let volume = plain(folder.path());
    assert_eq!(values(&volume), hounsfield());
    has(&volume.notes, "2 × copy that cannot be read");
    std::fs::remove_file(folder.path().join("I3")).unwrap();
    let message = refused(folder.path(), &VolumeOverrides::default());
    assert!(message.contains("cut3: holds"), "{message}");
}

#[test]
fn different_pixels_at_one_place_are_refused() {
    let mut scan = Scan::ct();
    scan.slices[3].position = scan.slices[2].position;
    let message = refused_scan(&scan);
    for part in ["I2 and I3", "one position", "different pixels"] {
        assert!(message.contains(part), "{message}");
    }
    assert!(!message.contains("volume.series"), "{message}");
    let folder = written(&scan);
    let series = Volume::series(folder.path()).unwrap();
    let note = "1 slice lies where another lies, and is left out if it holds the same pixels";
    has(&series[0].notes, note);

    // With smaller volumes beside them.
    for (others, end) in [
        (
            1,
            "there is 1 other volume, which `isolume info FOLDER` lists and `--set volume.series=N` picks",
        ),
        (
            2,
            "there are 2 other volumes, which `isolume info FOLDER` lists and `--set volume.series=N` picks",
        ),
    ] {
        let uid = format!("1.2.3.4.{}", others + 1);
        let mut small = Scan::ct().with(|common| common.text((0x20, 0x0e), "UI", uid));
        small.slices.truncate(2);
        small.write(folder.path(), Syntax::Explicit, |n| format!("{others}{n}"));
        let message = refused(folder.path(), &VolumeOverrides::default());
        assert!(
            message.contains("I2 and I3") && message.ends_with(end),
            "{message}"
        );
    }
    let first = VolumeOverrides {
        series: Some(Pick::Number(1)),
        ..VolumeOverrides::default()
    };
    let message = refused(folder.path(), &first);
    assert!(
        message.ends_with("expected one slice per position"),
        "{message}"
    );
}

#[test]
fn missing_slices_are_named_or_filled() {
    let mut scan = Scan::ct();
    scan.slices.remove(2);
    let folder = written(&scan);
    let message = refused(folder.path(), &VolumeOverrides::default());
    for part in [
        "1 of 5 slices is missing",
        "at 35 mm",
        "volume.fill_gaps=true",
    ] {
        assert!(message.contains(part), "{message}");
    }
    let fill = VolumeOverrides {
        fill_gaps: true,
        ..VolumeOverrides::default()
    };
    let volume = Volume::load(folder.path(), &fill).unwrap();
    has(
        &volume.notes,
        "at 35 mm along the slices' normal; they are interpolated",
    );
    // The user may mean a series that is whole.
    let mut other = Scan::ct().with(|common| common.text((0x20, 0xe), "UI", "1.2.3.77"));
    other.slices.truncate(2);
    other.write(folder.path(), Syntax::Explicit, |n| format!("other{n}"));
    let message = refused(folder.path(), &VolumeOverrides::default());
    assert!(message.contains("1 of 5 slices is missing"), "{message}");
    assert!(message.contains("there is 1 other volume"), "{message}");
    let (found, whole, slice) = (values(&volume), hounsfield(), ROWS * COLUMNS);
    for n in 0..slice {
        let mean = 0.5 * (whole[slice + n] + whole[3 * slice + n]);
        assert!((found[2 * slice + n] - mean).abs() <= 0.5);
        assert_eq!(found[3 * slice + n], whole[3 * slice + n]);
    }
}

/// The first slices of the CT, at these places along z.
fn with_slices_at(places: &[f64]) -> Scan {
    let mut scan = Scan::ct();
    scan.slices.truncate(places.len());
    for (slice, place) in scan.slices.iter_mut().zip(places) {
        slice.position[2] = *place;
    }
    scan
}

/// Half of the distances are as long as two.
#[test]
fn a_slice_is_missed_where_there_are_few() {
    let message = refused_scan(&with_slices_at(&[0.0, 1.0, 3.0]));
    assert!(
        message.contains("1 of 4 slices is missing, at 2 mm"),
        "{message}"
    );
}

#[test]
fn pixels_without_a_size_are_refused() {
    let mut scan = Scan::ct();
    scan.pixel_spacing = [0.0, 0.5];
    let message = refused_scan(&scan);
    assert!(
        message.contains("its PixelSpacing is 0\\0.5, expected two lengths above 0"),
        "{message}"
    );
}

#[test]
fn slices_that_are_uneven_as_well_are_missed_all_the_same() {
    let message = refused_scan(&with_slices_at(&[0.0, 2.6, 4.98, 9.95, 12.5]));
    assert!(
        message.contains("1 of 6 slices is missing, at 7.465 mm"),
        "{message}"
    );
}

#[test]
fn uneven_slices_are_resampled_to_their_median() {
    let places = [0.0, 2.5, 5.0, 8.5, 11.0];
    let volume = loaded(&with_slices_at(&places));
    has(
        &volume.notes,
        "2.5 to 3.5 mm apart and resampled linearly to the median, 2.5 mm",
    );
    has(&volume.notes, "up to 1 mm from given ones");
    assert_eq!(volume.dims, [COLUMNS as u32, ROWS as u32, 5]);
    assert_eq!(volume.spacing, [0.5, 0.75, 2.5]);
    let (found, whole, slice) = (values(&volume), hounsfield(), ROWS * COLUMNS);
    for n in 0..slice {
        let between = |a: usize, share: f64| {
            (1.0 - share) * whole[a * slice + n] + share * whole[(a + 1) * slice + n]
        };
        assert!((found[3 * slice + n] - between(2, 2.5 / 3.5)).abs() <= 0.5);
        assert!((found[4 * slice + n] - between(3, 1.5 / 2.5)).abs() <= 0.5);
    }
}

/// With slices at these places, each as thick as it says, where it says so.
fn with_thick_slices(slices: &[(f64, Option<f64>)]) -> Scan {
    let mut scan = Scan::ct();
    let copies = scan.slices.clone();
    scan.slices = slices
        .iter()
        .zip(copies.iter().cycle())
        .map(|((place, thickness), copy)| {
            let mut slice = copy.clone();
            slice.position[2] = *place;
            slice.thickness = *thickness;
            slice
        })
        .collect();
    scan
}

/// As in many a head: thick ones are farther apart, and nothing lies between them.
#[test]
fn thick_slices_above_thin_ones_are_no_gaps() {
    let thin = [0.0, 1.0, 2.0, 3.0, 4.0].map(|place| (place, Some(1.0)));
    let with = |places: &[f64], thickness: Option<f64>| {
        let thick = places.iter().map(|place| (*place, thickness));
        with_thick_slices(&thin.into_iter().chain(thick).collect::<Vec<_>>())
    };
    let touching = [6.0, 8.0, 10.0, 12.0];
    let volume = loaded(&with(&touching, Some(2.0)));
    has(&volume.notes, "1 to 2 mm apart and resampled");
    // One of them is missing, also where most are thick.
    let one = "1 of 10 slices is missing, at 10 mm";
    let message = refused_scan(&with(&[6.0, 8.0, 12.0, 14.0], Some(2.0)));
    assert!(message.contains(one), "{message}");
    let message = refused_scan(&with(
        &[6.0, 8.0, 12.0, 14.0, 16.0, 18.0, 20.0, 22.0],
        Some(2.0),
    ));
    assert!(
        message.contains("1 of 14 slices is missing, at 10 mm"),
        "{message}"
    );
    // Slices that overlap elsewhere, and those of unknown thickness, are missing where there are none.
    let four = "4 of 13 slices are missing";
    let message = refused_scan(&with(&touching, None));
    assert!(message.contains(four), "{message}");
    let overlapping = refused_scan(&with(&[5.0, 6.0, 8.0, 10.0], Some(2.0)));
    assert!(
        overlapping.contains("2 of 11 slices are missing"),
        "{overlapping}"
    );
    let message = refused_scan(&with(&[6.0], Some(2.0)));
    assert!(
        message.contains("1 of 7 slices is missing, at 5 mm"),
        "{message}"
    );
}

#[test]
fn places_that_differ_by_rounding_are_even() {
    let mut scan = Scan::ct();
    for (n, slice) in scan.slices.iter_mut().enumerate() {
        slice.position[2] = (0.625 * n as f64 * 1000.0).round() / 1000.0;
    }
    let volume = loaded(&scan);
    assert!(volume.notes.is_empty(), "{:?}", volume.notes);
    assert_eq!(values(&volume), hounsfield());
}

/// Those of the first and of the last slice as well.
#[test]
fn places_near_even_ones_are_even_wherever_the_first_lies() {
    let volume = loaded(&with_slices_at(&[0.02, 2.48, 5.02, 7.48, 10.02]));
    assert!(volume.notes.is_empty(), "{:?}", volume.notes);
    assert_eq!(volume.spacing, [0.5, 0.75, 2.5]);
    assert_eq!(values(&volume), hounsfield());
}

/// The rows of a gantry tilted by an angle whose tangent is 3/4 lie half a row lower from slice to slice.
#[test]
fn a_tilt_is_sheared_out() {
    let mut scan = Scan::ct();
    let (sine, cosine) = (0.6, 0.8);
    scan.orientation = [1.0, 0.0, 0.0, 0.0, cosine, sine];
    // The table moves along z: by 1 mm along the normal and by 3/4 of it along the columns.
    for (n, slice) in scan.slices.iter_mut().enumerate() {
        slice.position = [0.0, 0.0, 1.25 * n as f64];
    }
    scan.pixel_spacing = [1.5, 1.0];
    let volume = loaded(&scan);
    has(
        &volume.notes,
        "tilted by 36.87 degrees, which is sheared out",
    );
    assert_eq!(
        volume.dims,
        [COLUMNS as u32, ROWS as u32 + 2, SLICES as u32]
    );
    assert!((volume.spacing[2] - 1.0).abs() < 1e-9);
    let (found, whole) = (values(&volume), hounsfield());
    let smallest = whole.iter().copied().fold(f64::INFINITY, f64::min);
    for z in 0..SLICES {
        let shift = 0.5 * z as f64;
        for y in 0..ROWS + 2 {
            for x in 0..COLUMNS {
                let value = |row: usize| whole[(z * ROWS + row) * COLUMNS + x];
                let row = y as f64 - shift;
                let last = (ROWS - 1) as f64;
                let expected = if (-0.5..=last + 0.5).contains(&row) {
                    let row = row.clamp(0.0, last);
                    let lower = row.floor() as usize;
                    let upper = (lower + 1).min(ROWS - 1);
                    value(lower) + row.fract() * (value(upper) - value(lower))
                } else {
                    smallest
                };
                let found = found[(z * (ROWS + 2) + y) * COLUMNS + x];
                assert!(
                    (found - expected).abs() <= 0.5,
                    "{x} {y} {z}: {found}, {expected}"
                );
            }
        }
    }
}

#[test]
fn other_shears_are_refused_by_name() {
    let mut scan = Scan::ct();
    for (n, slice) in scan.slices.iter_mut().enumerate() {
        slice.position[0] = 0.3 * n as f64;
    }
    let message = refused_scan(&scan);
    assert!(message.contains("axes i and k are sheared"), "{message}");
    let mut astray = Scan::ct();
    astray.slices[2].position[1] += 4.0;
    let message = refused_scan(&astray);
    assert!(
        message.contains("I2 lies 4.000 mm along its columns beside"),
        "{message}"
    );
}

#[test]
fn slices_with_a_position_each_make_one_volume_though_each_has_its_own_acquisition() {
    let scan = Scan::ct();
    let expected = everything(&loaded(&scan));
    let folder = super::folder();
    for n in 0..SLICES {
        let one = scan
            .clone()
            .with(|common| common.text((0x20, 0x12), "IS", n));
        write(
            folder.path(),
            &format!("{n}"),
            one.slice_file(n, Syntax::Explicit),
        );
    }
    assert_eq!(everything(&plain(folder.path())), expected);
}
