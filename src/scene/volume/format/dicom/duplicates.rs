//! Compares frames that lie at one place: copies are left out, and different pixels at one place are no volume.

use rayon::prelude::*;

use crate::scene::volume::parsed::Parsed;

use super::frame_reader::FrameReader;
use super::group::{At, frame};
use super::values::{FrameConversion, Values};

/// Fails unless the frames of each pair are the same. `remedy` is the end of the sentence.
pub fn compare(reader: &FrameReader, duplicates: &[(At, At)], remedy: &str) -> Parsed<()> {
    let images = reader.images();
    let name = |at: At| images[at.image].frame_name(frame(images, at).index);
    duplicates.par_iter().try_for_each(|(one, other)| {
        if holds_same(reader, [*one, *other])? {
            Ok(())
        } else {
            Err(format!(
                "{} and {} have one position but different pixels, expected one slice per position{remedy}",
                name(*one),
                name(*other)
            ))
        }
    })
}

/// Whether two frames have the same values, however they are stored.
fn holds_same(reader: &FrameReader, pair: [At; 2]) -> Parsed<bool> {
    let images = reader.images();
    let described = pair.map(|at| (&images[at.image], frame(images, at)));
    let values = Values::of(&described)?;
    let numbers = |n: usize| {
        let (image, _) = described[n];
        let unpacked = reader.words(pair[n])?;
        let mut numbers = vec![0; image.frame_pixels() as usize * values.voxel_type.bytes()];
        FrameConversion::new(&unpacked, values.maps[n], values.voxel_type)
            .convert(&unpacked.words, &mut numbers);
        Ok::<_, String>(numbers)
    };
    Ok(numbers(0)? == numbers(1)?)
}
