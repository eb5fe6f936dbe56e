//! Volumes that repeat at each place of a series.

use std::path::Path;

use isolume::scene::volume::{Pick, Volume};

use super::{folder, has, hounsfield, picked, values};
use crate::dicom_files::{Object, Pixels, Syntax, file};
use crate::dicom_scan::{COLUMNS, SLICES, Scan};

/// Moments of a heartbeat, say, which no element tells apart but the number of the file, `number(n, moment)` from 0 on. All but
/// those that are `lost`, each in so many copies.
fn moments(
    number: impl Fn(usize, usize) -> usize,
    lost: &[(usize, usize)],
    copies: usize,
) -> tempfile::TempDir {
    stated_moments(number, lost, copies, |_, _, header| header)
}

/// The same, where `state` adds to the header of each slice of each moment.
fn stated_moments(
    number: impl Fn(usize, usize) -> usize,
    lost: &[(usize, usize)],
    copies: usize,
    state: impl Fn(usize, usize, Object) -> Object,
) -> tempfile::TempDir {
    let folder = folder();
    for (n, moment) in (0..SLICES).flat_map(|n| (0..MOMENTS).map(move |moment| (n, moment))) {
        if lost.contains(&(n, moment)) {
            continue;
        }
        let instance = number(n, moment) + 1;
        let mut scan = Scan::ct();
        scan.slices[n].intercept += 100.0 * moment as f64;
        let header = state(n, moment, scan.header(n).text((0x20, 0x13), "IS", instance));
        let words = std::slice::from_ref(&scan.slices[n].words);
        let bytes = file(&header, Syntax::Explicit, Pixels::Words(words), COLUMNS);
        for copy in 0..copies {
            crate::volume_files::write(
                folder.path(),
                &format!("I{instance}-{n}-{moment}-{copy}"),
                &bytes,
            );
        }
    }
    folder
}

const MOMENTS: usize = 3;

fn of_moment(moment: usize) -> Vec<f64> {
    let values = hounsfield().into_iter();
    values.map(|value| value + 100.0 * moment as f64).collect()
}

#[test]
fn what_repeats_at_each_place_is_several_volumes() {
    for copies in [1, 2] {
        let folder = moments(|n, moment| MOMENTS * n + moment, &[], copies);
        let series = Volume::series(folder.path()).unwrap();
        let slices: Vec<_> = series.iter().map(|one| one.slices).collect();
        assert_eq!(slices, [SLICES as u32; MOMENTS]);
        has(
            &series[1].notes,
            "the first of its slices has InstanceNumber 2",
        );
        expect_moments(folder.path(), MOMENTS, "");
    }
}

/// The first volumes are so many moments, in their order.
fn expect_moments(folder: &Path, count: usize, case: &str) {
    for moment in 0..count {
        let volume = picked(folder, Pick::Number(moment as u32 + 1)).unwrap();
        assert_eq!(values(&volume), of_moment(moment), "{case}");
    }
}

/// How most scanners count instances.
fn volume_by_volume(n: usize, moment: usize) -> usize {
    SLICES * moment + n
}

type State = fn(usize, usize, Object) -> Object;

/// Such instances run forth and back, and say nothing.
#[test]
fn settings_and_times_tell_repetitions_apart() {
    let forth_and_back = |n: usize, moment: usize| match n % 2 {
        0 => MOMENTS * n + moment,
        _ => MOMENTS * n + (MOMENTS - 1 - moment),
    };
    let states: [(State, &str); 7] = [
        (
            |_, moment, header| header.text((0x18, 0x81), "DS", [2.46, 4.92, 13.5][moment]),
            "echo time 4.92 ms",
        ),
        (
            |_, moment, header| header.text((0x18, 0x82), "DS", 100 * (moment + 1)),
            "inversion time 200 ms",
        ),
        (
            |_, moment, header| header.text((0x18, 0x1314), "DS", 5 * moment + 2),
            "flip angle 7 degrees",
        ),
        // No two heartbeats are as long.
        (
            |n, moment, header| header.text((0x18, 0x1060), "DS", 90 * moment + n),
            "trigger time 90 ms",
        ),
        (
            |_, moment, header| {
                let echo = Object::default().double((0x18, 0x9082), moment as f64 + 0.5);
                header.items((0x18, 0x9114), vec![echo])
            },
            "echo time 1.5 ms",
        ),
        (
            |n, moment, header| {
                let time = format!("{:06}.{:06}", 120000 + moment, 100 * n);
                header.text((8, 0x32), "TM", time)
            },
            "",
        ),
        // Over midnight.
        (
            |n, moment, header| {
                let (date, time) = [
                    ("20260301", "235958"),
                    ("20260301", "235959"),
                    ("20260302", "000000"),
                ][moment];
                let header = header.text((8, 0x22), "DA", date);
                header.text((8, 0x32), "TM", format!("{time}.{n}"))
            },
            "",
        ),
    ];
    for (state, told) in states {
        let folder = stated_moments(forth_and_back, &[], 1, state);
        expect_moments(folder.path(), MOMENTS, told);
        let notes = &Volume::series(folder.path()).unwrap()[1].notes;
        assert!(notes[0].contains(told), "{notes:?}");
    }
    // Where it is the same at all places, it also says which volume lacks a slice.
    let folder = stated_moments(forth_and_back, &[(2, 1)], 1, states[0].0);
    let third = picked(folder.path(), Pick::Number(3))
        .unwrap_err()
        .to_string();
    assert!(third.contains("1 of 5 slices is missing"), "{third}");
    for (pick, moment) in [(1, 0), (2, 2)] {
        let volume = picked(folder.path(), Pick::Number(pick)).unwrap();
        assert_eq!(values(&volume), of_moment(moment));
    }
}

/// What differs without a meaning outranks nothing that tells volumes apart.
#[test]
fn stray_values_mix_no_volumes() {
    let states: [State; 4] = [
        // One image with another echo time, beside inversion times.
        |n, moment, header| {
            let echo = if (n, moment) == (3, 0) { 2.41 } else { 2.4 };
            let header = header.text((0x18, 0x81), "DS", echo);
            header.text((0x18, 0x82), "DS", 100 + 400 * moment)
        },
        // Noise in all of them.
        |n, moment, header| {
            let echo = 2.4 + 0.01 * ((7 * n + 3 * moment) % 5) as f64;
            header.text((0x18, 0x81), "DS", echo)
        },
        // A trigger at any time.
        |n, moment, header| header.text((0x18, 0x1060), "DS", (37 * n + 61 * moment) % 97),
        // Over midnight, within a volume, without a date.
        |n, moment, header| {
            let second = 86_388 + 2 * (SLICES * moment + n);
            let [h, m, s] = [second / 3600 % 24, second / 60 % 60, second % 60];
            header.text((8, 0x32), "TM", format!("{h:02}{m:02}{s:02}"))
        },
    ];
    for (case, state) in states.into_iter().enumerate() {
        let folder = stated_moments(volume_by_volume, &[], 1, state);
        expect_moments(folder.path(), MOMENTS, &format!("case {case}"));
    }
}

/// Directions of diffusion have one b-value.
#[test]
fn volumes_with_one_value_are_listed_with_their_numbers() {
    let folder = stated_moments(volume_by_volume, &[], 1, |_, moment, header| {
        header.double((0x18, 0x9087), [0.0, 1000.0, 1000.0][moment])
    });
    let series = Volume::series(folder.path()).unwrap();
    let told: Vec<&str> = series.iter().map(|one| one.notes[0].as_str()).collect();
    let expected = [
        "b-value 0",
        "b-value 1000, the first of its slices has InstanceNumber 6",
        "b-value 1000, the first of its slices has InstanceNumber 11",
    ];
    assert_eq!(told, expected);
}

/// What was last may be counted first.
#[test]
fn volumes_are_numbered_in_the_order_of_time() {
    let backwards = |n: usize, moment: usize| SLICES * (MOMENTS - 1 - moment) + n;
    let folder = stated_moments(backwards, &[], 1, |n, moment, header| {
        let time = format!("{:06}", 120_000 + 10 * moment + n);
        header.text((8, 0x32), "TM", time)
    });
    expect_moments(folder.path(), MOMENTS, "");
}

/// Instances that are numbered anew in each volume, or all alike, are no copies of one another.
#[test]
fn instances_that_repeat_are_told_apart_by_what_differs() {
    let anew = |n: usize, _: usize| n;
    let alike = |_: usize, _: usize| 0;
    let echo: State = |_, moment, header| header.text((0x18, 0x81), "DS", 10 * (moment + 1));
    let time: State = |n, moment, header| {
        let time = format!("{:06}", 120_000 + 10 * moment + n);
        header.text((8, 0x32), "TM", time)
    };
    for state in [echo, time] {
        for number in [&anew as &dyn Fn(usize, usize) -> usize, &alike] {
            let folder = stated_moments(number, &[], 1, state);
            expect_moments(folder.path(), MOMENTS, "");
        }
    }
}

/// The last of several volumes may have a few slices alone.
#[test]
fn a_scan_that_was_ended_early_has_its_whole_volumes() {
    let lost: Vec<(usize, usize)> = (1..SLICES).map(|n| (n, MOMENTS - 1)).collect();
    let folder = moments(volume_by_volume, &lost, 1);
    expect_moments(folder.path(), MOMENTS - 1, "");
}

/// Positions are rounded.
#[test]
fn places_are_the_same_within_a_hundredth_of_a_pixel() {
    let folder = stated_moments(volume_by_volume, &[], 1, |n, moment, header| {
        let z = 30.0 + 2.5 * n as f64 + 5e-4 * ((n + 2 * moment) % 3) as f64;
        header.text((0x20, 0x32), "DS", format!("-10\\-20\\{z}"))
    });
    expect_moments(folder.path(), MOMENTS, "");
}

#[test]
fn echoes_and_b_values_are_numbered_upwards() {
    let backwards = |n: usize, moment: usize| SLICES * (MOMENTS - 1 - moment) + n;
    let echo = |_, moment, header: Object| header.text((0x18, 0x86), "IS", [2, 10, 11][moment]);
    let b_value = |_, moment, header: Object| header.double((0x18, 0x9087), 500.0 * moment as f64);
    let folders = [
        stated_moments(backwards, &[], 1, echo),
        stated_moments(backwards, &[], 1, b_value),
    ];
    for (folder, told) in folders.iter().zip(["echo 10", "b-value 500"]) {
        let series = Volume::series(folder.path()).unwrap();
        assert_eq!(series[1].notes, [told]);
        expect_moments(folder.path(), MOMENTS, "");
    }
}

#[test]
fn a_lost_slice_is_one_of_one_repetition() {
    let place_by_place = |n: usize, moment: usize| MOMENTS * n + moment;
    let numberings: [&dyn Fn(usize, usize) -> usize; 2] = [&place_by_place, &volume_by_volume];
    for (number, lost) in numberings
        .into_iter()
        .flat_map(|number| [(0, 0), (1, 1), (3, 0), (4, 2)].map(|lost| (number, lost)))
    {
        let folder = moments(number, &[lost], 1);
        let series = Volume::series(folder.path()).unwrap();
        let slices: Vec<_> = series.iter().map(|one| one.slices).collect();
        let [all, fewer] = [SLICES as u32, SLICES as u32 - 1];
        assert_eq!(slices, [all, all, fewer], "without {lost:?}");
        let whole = (0..MOMENTS).filter(|moment| *moment != lost.1);
        for (moment, pick) in whole.zip(1..) {
            let volume = picked(folder.path(), Pick::Number(pick)).unwrap();
            assert_eq!(values(&volume), of_moment(moment), "without {lost:?}");
        }
        if (1..SLICES - 1).contains(&lost.0) {
            let message = picked(folder.path(), Pick::Number(3))
                .unwrap_err()
                .to_string();
            assert!(message.contains("1 of 5 slices is missing"), "{message}");
        }
    }
}
