//! A small grey picture of a slice, by which users tell series apart.

/// Pixels along the longer side.
const SIDE: u32 = 48;
/// The share of pixels that becomes black, and the share that becomes white: a few bright spots, as metal
/// makes in a CT, would leave the rest dark.
const CLIPPED: f64 = 0.02;

/// Grey levels, encoded for display, row 0 on top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Thumbnail {
    /// Columns and rows, at least 2 and at most 48 each.
    pub size: [u32; 2],
    pub levels: Vec<u8>,
}

impl Thumbnail {
    /// Shrinks a slice of `dims` values, rows first, whose pixels have a size of `spacing`.
    pub(super) fn of(values: &[f64], dims: [u32; 2], spacing: [f64; 2]) -> Thumbnail {
        let extent = [0, 1].map(|a| f64::from(dims[a]) * spacing[a]);
        let longest = extent[0].max(extent[1]);
        let size = extent.map(|length| {
            let pixels = f64::from(SIDE) * length / longest;
            (pixels.round() as u32).clamp(2, SIDE)
        });
        let places = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
        let means: Vec<f64> = places
            .map(|at| {
                mean(
                    values,
                    dims,
                    [0, 1].map(|a| covered(at[a], size[a], dims[a])),
                )
            })
            .collect();
        let mut sorted: Vec<f64> = means.iter().copied().filter(|m| m.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let quantile = |share: f64| {
            let last = sorted.len().saturating_sub(1) as f64;
            sorted.get((share * last).round() as usize).copied()
        };
        let low = quantile(CLIPPED).unwrap_or(0.0);
        let high = quantile(1.0 - CLIPPED).unwrap_or(0.0);
        // Where all values are equal, or not finite, the picture is black.
        let width = (high - low).max(f64::MIN_POSITIVE);
        let level = |mean: &f64| (255.0 * ((mean - low) / width).clamp(0.0, 1.0)).round() as u8;
        Thumbnail {
            size,
            levels: means.iter().map(level).collect(),
        }
    }
}

/// The range of values along one axis that a pixel covers, at least one.
fn covered(pixel: u32, pixels: u32, values: u32) -> [usize; 2] {
    let border = |n: u32| (u64::from(n) * u64::from(values) / u64::from(pixels)) as usize;
    let first = border(pixel);
    [first, border(pixel + 1).max(first + 1)]
}

fn mean(values: &[f64], dims: [u32; 2], [columns, rows]: [[usize; 2]; 2]) -> f64 {
    let row = |y: usize| &values[y * dims[0] as usize..][columns[0]..columns[1]];
    let sum: f64 = (rows[0]..rows[1]).flat_map(row).sum();
    sum / ((columns[1] - columns[0]) * (rows[1] - rows[0])) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wide_slice_makes_a_wide_picture_from_black_to_white() {
        // Values grow along a row; pixels are twice as high as wide.
        let values: Vec<f64> = (0..80 * 20).map(|n| f64::from(n % 80)).collect();
        let thumbnail = Thumbnail::of(&values, [80, 20], [0.5, 1.0]);
        assert_eq!(thumbnail.size, [48, 24]);
        let row = &thumbnail.levels[..48];
        assert_eq!((row[0], row[47]), (0, 255));
        assert!(row.is_sorted(), "{row:?}");
        assert!(thumbnail.levels.chunks(48).all(|other| other == row));
    }

    #[test]
    fn one_value_everywhere_is_black() {
        let thumbnail = Thumbnail::of(&[7.0; 6], [3, 2], [1.0; 2]);
        assert!(thumbnail.levels.iter().all(|level| *level == 0));
    }
}
