//! Low-discrepancy points: each pair fills the square as a (0, 2)-sequence does, and is independent of all others.

use super::statistics::{assert_fits, assert_mean, uniform_bins};
use super::*;

const WORDS: Shader = Shader {
    name: "sobol_words",
    text: include_str!("../../support/glsl/sobol_words.comp"),
    uses: &["scene_block"],
};

/// Two pairs for each of the pixels' samples, pixel by pixel.
fn points(
    pixels: u32,
    samples: impl Iterator<Item = u32> + Clone,
    pairs: u32,
) -> Vec<[[u32; 2]; 2]> {
    let streams = (0..pixels).flat_map(|pixel| {
        samples.clone().map(move |sample_index| Stream {
            pixel,
            sample_index,
            dimension: pairs,
        })
    });
    let inputs: Vec<Stream> = streams.collect();
    let push = CountPush {
        count: inputs.len() as u32,
    };
    let words: Vec<Words> = probe(&scene()).run(&WORDS, &push, &inputs, inputs.len(), inputs.len());
    words.iter().map(|w| [[w.x, w.y], [w.z, w.w]]).collect()
}

/// How often a box of 2^-x by 2^-y has other than one of 2^(x + y) points.
fn uneven_boxes(points: &[[u32; 2]], x: u32) -> usize {
    let y = points.len().ilog2() - x;
    let mut counts = vec![0; points.len()];
    for &[u, v] in points {
        let column = u64::from(u) >> (32 - x);
        let row = u64::from(v) >> (32 - y);
        counts[(row << x | column) as usize] += 1;
    }
    counts.iter().filter(|&&n| n != 1).count()
}

/// From zero, from anywhere that is aligned, and where the cache's samples begin.
#[test]
fn aligned_blocks_of_samples_have_one_in_each_box() {
    for first in [0, 3 << 10, 0x8000_0000] {
        for block in points(5, first..first + 1024, 4).chunks(1024) {
            for size in [4, 16, 32, 256, 1024] {
                for part in block.chunks(size) {
                    for pair in 0..2 {
                        let points: Vec<_> = part.iter().map(|p| p[pair]).collect();
                        for x in 0..=size.ilog2() {
                            assert_eq!(uneven_boxes(&points, x), 0, "{first} {size} {pair} {x}");
                        }
                    }
                }
            }
        }
    }
}

/// What one sample gives is uniform over pixels, down to its lowest bits.
#[test]
fn each_sample_alone_is_uniform() {
    for sample in [0, 1, 2, 77, 0x8000_0003] {
        let points = points(1 << 16, std::iter::once(sample), 2);
        for pair in 0..2 {
            for axis in 0..2 {
                for shift in [0, 12, 24] {
                    let bins = points
                        .iter()
                        .map(|p| (p[pair][axis] >> shift & 0xff) as usize);
                    let what = format!("sample {sample}, pair {pair}, axis {axis}, shift {shift}");
                    assert_fits(&what, &uniform_bins(256, bins));
                }
            }
        }
    }
}

/// Sums over a pixel's samples of one pair's numbers and another's, or the next pixel's, have no
/// correlation: neither the order nor the scrambling is the same.
#[test]
fn pairs_and_pixels_know_nothing_of_each_other() {
    let centered = |word: u32| f64::from(word) / 2f64.powi(32) - 0.5;
    let points = points(4096, 0..8, 0);
    let of_pixel: Vec<_> = points.chunks(8).collect();
    let products = |f: &dyn Fn(usize, usize) -> f64| -> Vec<f64> {
        (0..of_pixel.len() - 1)
            .map(|p| (0..8).map(|s| 12.0 * f(p, s)).sum())
            .collect()
    };
    for a in 0..2 {
        for b in 0..2 {
            let pairs =
                products(&|p, s| centered(of_pixel[p][s][0][a]) * centered(of_pixel[p][s][1][b]));
            assert_mean("pairs", pairs.into_iter(), 0.0);
            let pixels = products(&|p, s| {
                centered(of_pixel[p][s][0][a]) * centered(of_pixel[p + 1][s][0][b])
            });
            assert_mean("pixels", pixels.into_iter(), 0.0);
        }
    }
}
