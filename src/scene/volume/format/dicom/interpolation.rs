//! Interpolates slices that no frame holds: between two frames where none lies at a slice's place, and between the rows
//! of a frame where the gantry was tilted.

use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::region::Region;

use super::frame_reader::FrameReader;
use super::numbers::{add, write};
use super::slices::Slice;

/// Reads the part of a slice that lies in a region. `shifts` are the rows by which each frame lies below the volume's
/// first row.
pub fn interpolate(
    reader: &FrameReader,
    shifts: &[f64],
    slice: Slice,
    region: Region,
    bytes: &mut [u8],
) -> Parsed<()> {
    let [width, height, _] = region.dims.map(|size| size as usize);
    let mut row: Vec<f64> = vec![0.0; width];
    let size = reader.voxel_type().bytes();
    for n in 0..height {
        row.fill(0.0);
        let y = f64::from(region.low[1]) + n as f64;
        let [below, above] = [1.0 - slice.share, slice.share];
        for (frame, weight) in [(slice.below, below), (slice.above, above)] {
            if weight > 0.0 {
                let first = region.low[0] as usize;
                add_row(reader, frame, y - shifts[frame], weight, first, &mut row)?;
            }
        }
        let part = &mut bytes[n * width * size..][..width * size];
        write(&row, reader.voxel_type(), part);
    }
    Ok(())
}

/// Adds a frame's row at a position between two of its rows, from the column `first` on.
fn add_row(
    reader: &FrameReader,
    n: usize,
    y: f64,
    weight: f64,
    first: usize,
    row: &mut [f64],
) -> Parsed<()> {
    let image = reader.image(n);
    let last = f64::from(image.rows - 1);
    if y < -0.5 || y > last + 0.5 {
        row.iter_mut()
            .for_each(|sum| *sum += weight * reader.filler());
        return Ok(());
    }
    let y = y.clamp(0.0, last);
    let numbers = reader.numbers(n)?;
    let voxel_type = reader.voxel_type();
    let lower = y.floor();
    let share = y - lower;
    for (y, weight) in [
        (lower, weight * (1.0 - share)),
        (lower + 1.0, weight * share),
    ] {
        if weight > 0.0 {
            let first = y as usize * image.columns as usize + first;
            add(
                &numbers[first * voxel_type.bytes()..],
                voxel_type,
                weight,
                row,
            );
        }
    }
    Ok(())
}
