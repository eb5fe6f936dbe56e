//! When two renders count as the same picture.
//!
//! Finding no difference proves little: noise may hide it. So both are asked of the image and of
//! each tile: that the difference is no larger than chance makes it (Welch's t), and that it cannot be
//! larger than a limit (its 99 % bound), which a picture with too much noise fails. Every channel
//! has to pass for itself, or swapped ones would go unseen.
//!
//! Pixels are independent of each other, so their variances add up; Welch and Satterthwaite's formula
//! does the same for what is known about these variances.

use std::fmt;

use isolume::compare::LinearImage;
use isolume::render::Film;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// An estimate of a picture, row 0 on top.
pub struct Picture {
    pub width: usize,
    pub mean: Vec<[f64; 3]>,
    /// Of each mean.
    pub stderr: Vec<[f64; 3]>,
    /// Independent runs from which `stderr` was taken.
    pub runs: u32,
}

impl Picture {
    pub fn from_film(film: &Film, width: u32, runs: u32) -> Picture {
        let rgb = |&[r, g, b, _]: &[f32; 4]| [r, g, b].map(f64::from);
        Picture {
            width: width as usize,
            mean: film.mean.iter().map(rgb).collect(),
            stderr: film.stderr.iter().map(|s| s.map(f64::from)).collect(),
            runs,
        }
    }

    pub fn from_image(image: &LinearImage, runs: u32) -> Picture {
        let wide = |pixels: &[[f32; 3]]| pixels.iter().map(|p| p.map(f64::from)).collect();
        let stderr = image.stderr.as_deref();
        Picture {
            width: image.width,
            mean: wide(&image.rgb),
            stderr: wide(stderr.expect("a picture that knows its own noise")),
            runs,
        }
    }
}

/// How far a region's mean is from the reference's, in one channel, relative to the reference.
#[derive(Debug, Clone, Copy)]
pub struct Difference {
    pub relative: f64,
    pub stderr: f64,
    /// Degrees of freedom of `stderr`.
    pub freedom: f64,
}

impl Difference {
    pub fn t(&self) -> f64 {
        self.relative / self.stderr
    }

    /// The difference is smaller than this, with 99 % confidence.
    pub fn bound(&self) -> f64 {
        self.relative.abs() + CONFIDENCE * self.stderr
    }

    /// Whether the difference is shown to be within the limit.
    fn is_within(&self, limit: f64) -> bool {
        self.bound() <= limit
    }

    /// Whether equal pictures might well fail `is_within`: more than once in a hundred times.
    fn is_noisy(&self, limit: f64) -> bool {
        2.0 * CONFIDENCE * self.stderr > limit
    }

    /// Of a larger t by chance; 0 where there is no number to judge.
    fn probability(&self) -> f64 {
        if !self.t().is_finite() {
            return 0.0;
        }
        let t = StudentsT::new(0.0, 1.0, self.freedom).expect("degrees of freedom");
        2.0 * t.sf(self.t().abs())
    }
}

/// What two pictures have to keep to.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Side of a tile in pixels.
    pub tile: usize,
    /// 99 % bounds on relative differences.
    pub image: f64,
    pub each_tile: f64,
    /// Tiles that may have too much noise to tell, and are then held to Welch's test alone.
    pub undecided: usize,
}

pub struct Comparison {
    pub limits: Limits,
    /// Per channel.
    pub image: [Difference; 3],
    /// Row by row, per channel.
    pub tiles: Vec<[Difference; 3]>,
}

/// Standard errors to either side of 99 %.
const CONFIDENCE: f64 = 2.58;
/// Largest |t| of the image.
const MOST_T: f64 = 4.0;
/// Probability that any tile of equal pictures is found different (Šidák).
const FAMILY_ALPHA: f64 = 1e-3;
/// What single precision does to a mean.
const ROUNDING: f64 = 1e-6;

pub fn compare(reference: &Picture, test: &Picture, limits: Limits) -> Comparison {
    assert_eq!(
        reference.mean.len(),
        test.mean.len(),
        "pictures of one size"
    );
    let (width, height) = (reference.width, reference.mean.len() / reference.width);
    let region = |x0: usize, y0: usize, width: usize, height: usize| {
        let pixels: Vec<usize> = (y0..y0 + height)
            .flat_map(|y| (x0..x0 + width).map(move |x| y * reference.width + x))
            .collect();
        [0, 1, 2].map(|channel| difference(reference, test, &pixels, channel))
    };
    let side = limits.tile;
    let starts = |length: usize| (0..length / side).map(move |n| n * side);
    Comparison {
        limits,
        image: region(0, 0, width, height),
        tiles: starts(height)
            .flat_map(|y| starts(width).map(move |x| (x, y)))
            .map(|(x, y)| region(x, y, side, side))
            .collect(),
    }
}

fn difference(a: &Picture, b: &Picture, pixels: &[usize], channel: usize) -> Difference {
    let mean = |p: &Picture| pixels.iter().map(|&n| p.mean[n][channel]).sum::<f64>();
    let (reference, test) = (mean(a), mean(b));
    // Σ s² and Σ s⁴/ν.
    let spread = |p: &Picture| {
        pixels.iter().fold((0.0, 0.0), |(sum, weight), &n| {
            let variance = p.stderr[n][channel].powi(2);
            (
                sum + variance,
                weight + variance.powi(2) / f64::from(p.runs - 1),
            )
        })
    };
    let ((va, wa), (vb, wb)) = (spread(a), spread(b));
    let variance = va + vb + (ROUNDING * reference).powi(2);
    Difference {
        relative: (test - reference) / reference,
        stderr: variance.sqrt() / reference,
        // Without noise there is only rounding, whose size is known.
        freedom: (variance.powi(2) / (wa + wb)).min(1e9),
    }
}

impl Comparison {
    /// The channel with the largest bound.
    pub fn worst_image(&self) -> Difference {
        worst(&self.image)
    }

    pub fn worst_tile(&self) -> Difference {
        worst(self.tiles.as_flattened())
    }

    /// Tiles that are not within the limit for their noise alone.
    pub fn undecided(&self) -> usize {
        let limit = self.limits.each_tile;
        let is_undecided = |tile: &&[Difference; 3]| {
            let mut outside = tile.iter().filter(|d| !d.is_within(limit)).peekable();
            outside.peek().is_some() && outside.all(|d| d.is_noisy(limit))
        };
        self.tiles.iter().filter(is_undecided).count()
    }

    /// One sentence for everything that tells the pictures apart; none if they are equivalent.
    pub fn findings(&self) -> Vec<String> {
        [self.differences(), self.doubts()].concat()
    }

    /// Differences that are no chance.
    pub fn differences(&self) -> Vec<String> {
        let tests = 3 * self.tiles.len();
        let alpha = -(f64::ln_1p(-FAMILY_ALPHA) / tests as f64).exp_m1();
        let image = named("image".into(), &self.image, |d| d.t().abs() <= MOST_T);
        let tiles =
            self.tiles.iter().enumerate().flat_map(|(n, tile)| {
                named(format!("tile {n}"), tile, |d| d.probability() >= alpha)
            });
        let no_chance = |what: String| format!("{what} is no chance");
        image.into_iter().chain(tiles).map(no_chance).collect()
    }

    /// Differences that might be larger than allowed.
    fn doubts(&self) -> Vec<String> {
        let Limits {
            image,
            each_tile,
            undecided,
            ..
        } = self.limits;
        let image = named("image".into(), &self.image, |d| d.is_within(image));
        let tiles = self.tiles.iter().enumerate().flat_map(|(n, tile)| {
            named(format!("tile {n}"), tile, |d| {
                d.is_within(each_tile) || d.is_noisy(each_tile)
            })
        });
        let too_large = |what: String| format!("{what} may be too much");
        let noisy = self.undecided();
        let noisy =
            (noisy > undecided).then(|| format!("{noisy} tiles have too much noise to tell"));
        image
            .into_iter()
            .chain(tiles)
            .map(too_large)
            .chain(noisy)
            .collect()
    }
}

/// The channels that are not good; NaN never is.
fn named(
    place: String,
    region: &[Difference; 3],
    is_good: impl Fn(&Difference) -> bool,
) -> Vec<String> {
    let channels = ["red", "green", "blue"].iter().zip(region);
    channels
        .filter(|(_, d)| !is_good(d))
        .map(|(channel, d)| format!("{place}, {channel}: {d}"))
        .collect()
}

fn worst(differences: &[Difference]) -> Difference {
    let smaller = |a: &&Difference, b: &&Difference| a.bound().total_cmp(&b.bound());
    *differences.iter().max_by(smaller).expect("a tile")
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [relative, stderr] = [self.relative, self.stderr].map(|x| 100.0 * x);
        write!(f, "{relative:+.3} ± {stderr:.3} % (t = {:.1})", self.t())
    }
}
