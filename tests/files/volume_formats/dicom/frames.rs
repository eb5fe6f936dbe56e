//! Files of many frames: what tells the frames apart, and where each lies.

use isolume::scene::volume::{Volume, VolumeOverrides};

use super::{everything, folder, has, hounsfield, loaded, plain, refused, values};
use crate::dicom_files::{Object, Pixels, Syntax, file};
use crate::dicom_scan::{COLUMNS, SLICES, Scan};
use crate::volume_files::write;

const SPACING: (u16, u16) = (0x18, 0x88);
const FRAME_INCREMENT: (u16, u16) = (0x28, 0x09);

/// The scan once for each of so many times, with values that grow from time to time.
fn timed(times: u16) -> Scan {
    let mut scan = Scan::ct();
    let slices = std::mem::take(&mut scan.slices);
    for time in 0..times {
        scan.slices.extend(slices.iter().cloned().map(|mut slice| {
            slice.words.iter_mut().for_each(|word| *word += time);
            slice
        }));
    }
    scan
}

/// Numbers such as 9 and 32 are white space if they are taken for text.
#[test]
fn times_are_told_apart_whatever_their_numbers() {
    const TIMES: u16 = 13;
    let scan = timed(TIMES);
    let folder = folder();
    for syntax in [Syntax::Explicit, Syntax::BigEndian] {
        let bytes = scan.enhanced_with(syntax, |n, group| {
            let time = (n / SLICES + 1) as u32;
            let content = Object::default().long((0x20, 0x9128), time);
            group.items((0x20, 0x9111), vec![content])
        });
        let path = write(folder.path(), "v.dcm", bytes);
        let series = Volume::series(&path).unwrap();
        let depths: Vec<u32> = series.iter().map(|one| one.slices).collect();
        assert_eq!(depths, [SLICES as u32; TIMES as usize]);
        assert_eq!(values(&plain(&path)), hounsfield());
    }
}

#[test]
fn frames_without_groups_of_their_own_lie_at_the_distance_of_slices() {
    let scan = Scan::ct();
    let folder = folder();
    let bytes = scan.multi_frame(|object| object.text(SPACING, "DS", 2.5));
    let path = write(folder.path(), "v.dcm", bytes);
    assert_eq!(everything(&plain(&path)), everything(&loaded(&scan)));
    // A film: its frames differ in time.
    let bytes = scan.multi_frame(|object| {
        let film = object.text(SPACING, "DS", 2.5);
        film.words(FRAME_INCREMENT, "AT", &[0x18, 0x1063])
    });
    let film = write(folder.path(), "v.dcm", bytes);
    let message = refused(&film, &VolumeOverrides::default());
    for part in ["has 5 frames that do not say where", "SpacingBetweenSlices"] {
        assert!(message.contains(part), "{message}");
    }
    let message = refused(folder.path(), &VolumeOverrides::default());
    let counted = "holds no volume, only 1 × image without a place in the patient";
    assert!(message.contains(counted), "{message}");
}

#[test]
fn gated_nuclear_medicine_is_a_volume_for_each_time_slot() {
    let bytes = timed(3).gated();
    let folder = folder();
    let path = write(folder.path(), "v.dcm", bytes);
    let series = Volume::series(&path).unwrap();
    let depths: Vec<u32> = series.iter().map(|one| one.slices).collect();
    assert_eq!(depths, [SLICES as u32; 3]);
    let volume = plain(&path);
    assert_eq!(volume.spacing, [0.5, 0.75, 2.5]);
    assert_eq!(values(&volume), hounsfield());
}

#[test]
fn images_without_a_place_beside_slices_are_passed_over_and_told() {
    let scan = Scan::ct();
    let folder = folder();
    scan.write(folder.path(), Syntax::Explicit, |n| format!("I{n}"));
    let words = Pixels::Words(std::slice::from_ref(&scan.slices[0].words));
    let lost = scan.header(0).without((0x20, 0x32));
    let bytes = file(&lost, Syntax::Explicit, words, COLUMNS);
    write(folder.path(), "lost", bytes);
    let volume = plain(folder.path());
    assert_eq!(values(&volume), hounsfield());
    has(&volume.notes, "1 × image without a place in the patient");
}

/// Enhanced ultrasound has axes of its own, which nobody knows in the patient.
#[test]
fn slices_of_ultrasound_lie_in_their_own_axes() {
    let scan = Scan::ct();
    let directions = Object::default().doubles((0x20, 0x9302), &[0.0, 1.0, 0.0, -1.0, 0.0, 0.0]);
    let bytes = scan.enhanced_with(Syntax::Implicit, |n, group| {
        let place = Object::default().doubles((0x20, 0x9301), &[5.0, 6.0, 0.75 * n as f64]);
        group
            .without((0x20, 0x9113))
            .items((0x20, 0x930e), vec![place])
            .items((0x20, 0x930f), vec![directions.clone()])
    });
    let folder = folder();
    let volume = plain(&write(folder.path(), "us.dcm", bytes));
    assert_eq!(volume.spacing, [0.5, 0.75, 0.75]);
    assert_eq!(volume.axes, None);
    assert_eq!(values(&volume), hounsfield());
}

/// What is said of a size that is not stated is untrue where the user states it.
#[test]
fn an_unknown_size_of_pixels_is_told() {
    let folder = folder();
    let scan = Scan::ct();
    for n in 0..SLICES {
        let header = scan.header(n).without((0x28, 0x30));
        let words = [scan.slices[n].words.clone()];
        let bytes = file(&header, Syntax::Explicit, Pixels::Words(&words), COLUMNS);
        write(folder.path(), &n.to_string(), bytes);
    }
    let told = "the size of its pixels is not known and taken as 1 mm";
    has(&plain(folder.path()).notes, told);
    let spacing = VolumeOverrides {
        spacing: Some([0.5, 0.5, 2.0]),
        ..VolumeOverrides::default()
    };
    let volume = Volume::load(folder.path(), &spacing).unwrap();
    assert!(volume.notes.iter().all(|note| !note.contains(told)));
}
