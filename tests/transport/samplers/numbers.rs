//! Random words: no two streams share any, and what they are turned into is exact at both ends.

use super::statistics::{assert_fits, assert_mean, uniform_bins};
use super::*;

const WORDS: Shader = Shader {
    name: "random_words",
    text: include_str!("../../support/glsl/random_words.comp"),
    uses: &["scene_block"],
};

const TRANSFORMS: Shader = Shader {
    name: "transforms",
    text: include_str!("../../support/glsl/transforms.comp"),
    uses: &["scene_block"],
};

/// Neighbours along each of pixel, sample, dimension and seed.
const SIDE: usize = 32;

/// The blocks of SIDE⁴ streams, seeds slowest and pixels fastest.
fn blocks() -> Vec<[u32; 4]> {
    let mut probe = probe(&scene());
    let mut inputs = Vec::new();
    for dimension in 0..SIDE as u32 {
        for sample_index in 0..SIDE as u32 {
            inputs.extend((0..SIDE as u32).map(|pixel| Stream {
                pixel,
                sample_index,
                dimension,
            }));
        }
    }
    let push = CountPush {
        count: inputs.len() as u32,
    };
    let mut blocks = Vec::new();
    for seed in 0..SIDE as u32 {
        probe.constants.seed = seed;
        let words: Vec<Words> = probe.run(&WORDS, &push, &inputs, inputs.len(), inputs.len());
        blocks.extend(words.iter().map(|b| [b.x, b.y, b.z, b.w]));
    }
    blocks
}

#[test]
fn streams_neither_overlap_nor_resemble_their_neighbours() {
    let blocks = blocks();
    let mut sorted = blocks.clone();
    sorted.sort_unstable();
    assert!(
        sorted.windows(2).all(|w| w[0] != w[1]),
        "two streams share a block"
    );
    for word in 0..4 {
        assert_birthdays(&blocks, word);
        assert_equidistributed(&blocks, word);
        for (stride, what) in [
            (1, "pixels"),
            (SIDE, "samples"),
            (SIDE * SIDE, "dimensions"),
            (SIDE * SIDE * SIDE, "seeds"),
        ] {
            for other in 0..4 {
                assert_uncorrelated(&blocks, stride, what, word, other);
            }
        }
    }
}

/// Pairs of equal words are as many as among independent ones: Poisson with mean n²/2³³.
fn assert_birthdays(blocks: &[[u32; 4]], word: usize) {
    let mut words: Vec<u32> = blocks.iter().map(|b| b[word]).collect();
    words.sort_unstable();
    let pairs: usize = words
        .chunk_by(|a, b| a == b)
        .map(|equal| equal.len() * (equal.len() - 1) / 2)
        .sum();
    let expected = (words.len() as f64).powi(2) / 2f64.powi(33);
    let deviations = (pairs as f64 - expected) / expected.sqrt();
    assert!(
        deviations.abs() < 4.0,
        "word {word}: {pairs} pairs, expected {expected}"
    );
}

fn assert_equidistributed(blocks: &[[u32; 4]], word: usize) {
    for shift in [0, 8, 20] {
        let indices = blocks.iter().map(|b| (b[word] >> shift & 0xfff) as usize);
        let what = format!("bits {shift} to {} of word {word}", shift + 12);
        assert_fits(&what, &uniform_bins(1 << 12, indices));
    }
}

/// Between streams `stride` apart, the correlation of `word` of one and `other` of the next.
fn assert_uncorrelated(blocks: &[[u32; 4]], stride: usize, what: &str, word: usize, other: usize) {
    let centered = |w: u32| f64::from(w) / 2f64.powi(32) - 0.5;
    let pairs = (0..blocks.len() - stride).filter(|i| i / stride % SIDE != SIDE - 1);
    let (mut n, mut sum) = (0.0_f64, 0.0);
    for i in pairs {
        n += 1.0;
        sum += centered(blocks[i][word]) * centered(blocks[i + stride][other]);
    }
    // Uniform numbers have variance 1/12.
    let deviations = 12.0 * sum / n.sqrt();
    assert!(
        deviations.abs() < 4.5,
        "words {word} and {other} of neighbouring {what}: {deviations:.1} deviations"
    );
}

fn transformed(words: &[u32]) -> Vec<Transformed> {
    let inputs: Vec<RandomWord> = words.iter().map(|&word| RandomWord { word }).collect();
    let push = CountPush {
        count: words.len() as u32,
    };
    probe(&scene()).run(&TRANSFORMS, &push, &inputs, words.len(), words.len())
}

/// Both ends, the seam between the two branches, every power of two, and random words.
fn telling_words() -> Vec<u32> {
    let mut random = fastrand::Rng::with_seed(2);
    let powers = (0..32).flat_map(|p| [1u32 << p, (1 << p) - 1, !(1 << p)]);
    let seam = (1u32 << 24) - 500..(1 << 24) + 500;
    let ends = (0..1000).flat_map(|i| [i, u32::MAX - i]);
    let tiny = (0..100_000).map(|i| i * 211);
    let mut words: Vec<u32> = powers.chain(seam).chain(ends).chain(tiny).collect();
    words.extend((0..400_000).map(|_| random.u32(..)));
    words
}

#[test]
fn free_flights_are_exponential_to_the_last_word() {
    let words = telling_words();
    let mut longest = 0.0_f32;
    for (&word, t) in words.iter().zip(transformed(&words)) {
        let length = t.exponential;
        assert!(
            length.is_finite() && length > 0.0,
            "word {word:#x}: {length}"
        );
        longest = longest.max(length);
        let u = (f64::from(word) + 0.5) * 2f64.powi(-32);
        let exact = -(-u).ln_1p();
        let error = (f64::from(length) - exact).abs();
        // A short flight has its digits; elsewhere it is as exact as Vulkan demands of a logarithm:
        // 2⁻²¹ around 1, three units in the last place beyond.
        let short = u >= 2f64.powi(-8) || error < 1e-5 * exact;
        let allowed = 2f64.powi(-21) + 4.0 * 2f64.powi(-24) * exact;
        assert!(short && error < allowed, "word {word:#x}: {error:e} off");
    }
    assert!(longest > 20.0, "no flight is longer than {longest}");
}

#[test]
fn free_flights_have_mean_and_variance_one() {
    let mut random = fastrand::Rng::with_seed(3);
    let words: Vec<u32> = (0..1 << 21).map(|_| random.u32(..)).collect();
    let flights = transformed(&words);
    let lengths = || flights.iter().map(|t| f64::from(t.exponential));
    assert_mean("mean", lengths(), 1.0);
    assert_mean("variance", lengths().map(|l| (l - 1.0).powi(2)), 1.0);
    const BINS: usize = 1024;
    let shares = lengths().map(|l| ((-(-l).exp_m1() * BINS as f64) as usize).min(BINS - 1));
    assert_fits("distribution", &uniform_bins(BINS, shares));
}

#[test]
fn a_unit_number_is_never_one() {
    let words = telling_words();
    for (&word, t) in words.iter().zip(transformed(&words)) {
        let exact = f64::from(word >> 8) * 2f64.powi(-24);
        assert_eq!(f64::from(t.unit_interval), exact, "word {word:#x}");
        assert!(t.unit_interval < 1.0, "word {word:#x}");
    }
}
