//! What stored values mean.

use isolume::scene::volume::{Quantity, StoredType, VoxelType};

use super::{folder, has, hounsfield, loaded, plain, refused_scan, values};
use crate::dicom_files::{Object, Pixels, Syntax, file};
use crate::dicom_scan::Scan;
use crate::volume_files::write;

const PADDING: u16 = 2000;

fn bits(common: Object, stored: u16, high: u16, is_signed: bool) -> Object {
    common
        .word((0x28, 0x101), stored)
        .word((0x28, 0x102), high)
        .word((0x28, 0x103), is_signed.into())
}

fn change_words(scan: &mut Scan, change: impl Fn(u16) -> u16) {
    for slice in &mut scan.slices {
        slice
            .words
            .iter_mut()
            .for_each(|word| *word = change(*word));
    }
}

#[test]
fn only_the_bits_that_are_stored_count() {
    let mut scan = Scan::ct();
    // An overlay above the values.
    change_words(&mut scan, |word| word | (word & 1) << 15);
    assert_eq!(values(&loaded(&scan)), hounsfield());
    // Values in the upper bits, with something below them.
    let mut high = Scan::ct().with(|common| bits(common, 12, 15, false));
    change_words(&mut high, |word| word << 4 | 5);
    assert_eq!(values(&loaded(&high)), hounsfield());
}

#[test]
fn signs_are_kept() {
    for stored in [12, 13, 16] {
        let mut scan = Scan::ct().with(|common| bits(common, stored, stored - 1, true));
        let mask = ((1u32 << stored) - 1) as u16;
        change_words(&mut scan, |word| word.wrapping_sub(1024) & mask);
        scan.slices
            .iter_mut()
            .for_each(|slice| slice.intercept = 0.0);
        let expected = |value: f64| match stored {
            // 12 bits hold −2048 to 2047: the values from 2048 on are negative.
            12 if value > 2047.0 => value - 4096.0,
            _ => value,
        };
        let expected: Vec<f64> = hounsfield().into_iter().map(expected).collect();
        let volume = loaded(&scan);
        assert_eq!(values(&volume), expected);
        assert_eq!(volume.voxel_type, VoxelType::I16);
    }
}

#[test]
fn monochrome1_leaves_values_as_they_are() {
    let scan = Scan::ct().with(|common| common.text((0x28, 4), "CS", "MONOCHROME1"));
    let volume = loaded(&scan);
    assert_eq!(values(&volume), hounsfield());
    assert_eq!(volume.quantity, Some(Quantity::Hounsfield));
    has(&volume.notes, "values are as they are stored");
}

#[test]
fn padding_becomes_the_smallest_value_that_was_measured() {
    let padded = || {
        let mut scan =
            Scan::ct().with(|common| bits(common, 16, 15, false).word((0x28, 0x120), PADDING));
        let corner = |n: usize| n.is_multiple_of(5);
        for (z, slice) in scan.slices.iter_mut().enumerate() {
            for (n, word) in slice.words.iter_mut().enumerate() {
                *word = if corner(n) {
                    PADDING
                } else {
                    100 * z as u16 + 3000 + *word % 50
                };
            }
        }
        scan
    };
    let volume = loaded(&padded());
    let [low, _] = volume.range;
    assert!((1976.0..2026.0).contains(&low), "{low}");
    let found = values(&volume);
    assert!(
        (0..found.len())
            .filter(|n| n % 192 % 5 == 0)
            .all(|n| found[n] == low)
    );
    let signed = padded().with(|common| bits(common, 16, 15, true));
    assert_eq!(values(&loaded(&signed)), found);
}

/// A padding of 16 bits among values of 12 is no value whose lower 12 bits are the same.
#[test]
fn padding_beyond_the_stored_bits_erases_no_value() {
    let padding: u16 = 0xf000 | PADDING;
    let mut scan = Scan::ct().with(|common| common.word((0x28, 0x120), padding));
    scan.slices[0].words[..2].copy_from_slice(&[padding, PADDING]);
    let mut expected = hounsfield();
    expected[1] = f64::from(PADDING) - 1024.0;
    expected[0] = expected[1..].iter().copied().fold(f64::INFINITY, f64::min);
    assert_eq!(values(&loaded(&scan)), expected);
}

/// Some writers give 8 bits a padding of 16, which none of them can be.
#[test]
fn padding_beyond_8_bits_erases_no_value() {
    let words: Vec<u16> = (0..192)
        .map(|n| u16::from_le_bytes([2 * n, 2 * n + 1].map(|n: u32| n as u8)))
        .collect();
    for (is_signed, padding) in [(false, 0xffff), (false, 256), (true, 0xf831)] {
        let header = bits(Scan::ct().header(0), 8, 7, is_signed)
            .word((0x28, 0x10), 12)
            .word((0x28, 0x11), 32)
            .word((0x28, 0x100), 8)
            .word((0x28, 0x120), padding);
        let folder = folder();
        let pixels = Pixels::Words(std::slice::from_ref(&words));
        let path = write(
            folder.path(),
            "I0",
            file(&header, Syntax::Explicit, pixels, 32),
        );
        let wrap = if is_signed { 128 } else { 256 };
        let value = |n: usize| f64::from(n as u8) - if n % 256 < wrap { 0.0 } else { 256.0 };
        let expected: Vec<f64> = (0..384).map(|n| value(n) - 1024.0).collect();
        assert_eq!(values(&plain(&path)), expected, "{padding}");
    }
}

/// OpenJPEG's packing of a chequerboard of 0 and 4095 in a third of its bytes, which it unpacks with errors of up to 125:
/// beside the edges, the codestream lies beyond both ends.
#[test]
fn what_lies_beyond_the_ends_of_a_lossy_codestream_stays_at_the_ends() {
    let packed = [include_bytes!("../../../support/dicom/extremes.j2k").to_vec()];
    let header = Scan::ct()
        .header(0)
        .word((0x28, 0x10), 32)
        .word((0x28, 0x11), 48);
    let folder = folder();
    let bytes = file(&header, Syntax::Jpeg2000, Pixels::Packed(&packed), 48);
    let path = write(folder.path(), "I0", bytes);
    let found = values(&plain(&path));
    for (n, found) in found.iter().enumerate() {
        let is_low = (n % 48 / 9 + n / 48 / 7) % 2 == 0;
        let expected = if is_low { -1024.0 } else { 3071.0 };
        assert!((found - expected).abs() <= 126.0, "pixel {n}: {found}");
    }
}

#[test]
fn slices_with_rescalings_of_their_own_stay_integers_where_they_can() {
    let mut scan = Scan::ct();
    for (z, slice) in scan.slices.iter_mut().enumerate() {
        slice.intercept = -1000.0 - z as f64;
        slice
            .words
            .iter_mut()
            .for_each(|word| *word = *word - *word % 2);
        if z % 2 == 1 {
            slice.slope = 2.0;
            slice.words.iter_mut().for_each(|word| *word /= 2);
        }
    }
    let volume = loaded(&scan);
    let slice = volume.dims[0] as usize * volume.dims[1] as usize;
    let expected = |(n, value): (usize, f64)| {
        let stored = value + 1024.0;
        stored - stored % 2.0 - 1000.0 - (n / slice) as f64
    };
    let expected: Vec<f64> = hounsfield().into_iter().enumerate().map(expected).collect();
    assert_eq!(values(&volume), expected);
    assert_eq!(
        (volume.voxel_type, volume.stored),
        (VoxelType::I16, StoredType::U16)
    );

    // As those of PET do; the second ones are nearly 0.
    for (first, step) in [(0.37, 0.01), (3e-7, -1e-8)] {
        let mut scan = Scan::ct().with(|common| common.text((8, 0x60), "CS", "PT"));
        for (z, slice) in scan.slices.iter_mut().enumerate() {
            (slice.slope, slice.intercept) = (first + step * z as f64, 0.0);
        }
        let volume = loaded(&scan);
        assert_eq!(volume.voxel_type, VoxelType::F32);
        assert_eq!(volume.quantity, Some(Quantity::Other));
        let stored = |(n, value): (usize, f64)| {
            let slope = first + step * (n / slice) as f64;
            f64::from((slope * (value + 1024.0)) as f32)
        };
        let expected: Vec<f64> = hounsfield().into_iter().enumerate().map(stored).collect();
        assert_eq!(values(&volume), expected);
    }
}

#[test]
fn a_blank_slice_of_pet_is_its_intercept() {
    let mut scan = Scan::ct().with(|common| common.text((8, 0x60), "CS", "PT"));
    for (z, slice) in scan.slices.iter_mut().enumerate() {
        (slice.slope, slice.intercept) = (if z == 2 { 0.0 } else { 0.5 }, 0.0);
    }
    let volume = loaded(&scan);
    let slice = (volume.dims[0] * volume.dims[1]) as usize;
    let stored = |(n, value): (usize, f64)| match n / slice {
        2 => 0.0,
        _ => 0.5 * (value + 1024.0),
    };
    let expected: Vec<f64> = hounsfield().into_iter().enumerate().map(stored).collect();
    assert_eq!(values(&volume), expected);

    // Where all slopes are 0, they say nothing.
    let rescaled = |slope: f64| {
        let mut scan = Scan::ct();
        scan.slices.iter_mut().for_each(|slice| slice.slope = slope);
        values(&loaded(&scan))
    };
    assert_eq!(rescaled(0.0), rescaled(1.0));
}

#[test]
fn a_range_beyond_16_bits_signed_is_kept_in_16_with_an_offset() {
    let mut scan = Scan::ct().with(|common| bits(common, 16, 15, false));
    scan.slices.iter_mut().for_each(|slice| slice.slope = -1.0);
    change_words(&mut scan, |word| 60000 - word);
    scan.slices
        .iter_mut()
        .for_each(|slice| slice.intercept = 58976.0);
    let volume = loaded(&scan);
    assert_eq!(volume.stored, StoredType::U16);
    assert_eq!(values(&volume), hounsfield());
}

#[test]
fn colours_and_palettes_are_refused() {
    let palette = Scan::ct().with(|common| common.text((0x28, 4), "CS", "PALETTE COLOR"));
    assert!(refused_scan(&palette).contains("5 × colour image"));
    let folder = super::folder();
    let path = crate::volume_files::write(
        folder.path(),
        "v.dcm",
        palette.slice_file(0, crate::dicom_files::Syntax::Explicit),
    );
    let message = super::refused(&path, &Default::default());
    assert!(
        message.contains("a palette") && message.contains("expected one grey value"),
        "{message}"
    );
}
