//! LDR-FLIP: the difference a viewer sees when flipping between two pictures (Andersson, Nilsson,
//! Akenine-Möller, Oskarsson, Åström, Fairchild, "FLIP: A Difference Evaluator for Alternating
//! Images", HPG 2020). Symbols and constants are the paper's.
//!
//! The existing crate (nv-flip) takes 8-bit pictures only. Between renders that have nearly
//! converged, the rounding is the larger part of the difference: at 1 % of noise it turns 0.0073
//! into 0.0102. So this is the paper on floating-point values, tested against NVIDIA's own tool.

use std::f64::consts::PI;

use super::filter::Plane;
use crate::srgb;

/// The authors' default, about 67: a monitor 3840 pixels wide, seen from as far as it is wide.
const PIXELS_PER_DEGREE: f64 = 3840.0 * PI / 180.0;

/// Contrast sensitivity of the achromatic, red-green and blue-yellow channels: sums of Gaussians
/// a·√(π/b)·exp(−π²x²/b), x in degrees.
const SENSITIVITY: [&[(f64, f64)]; 3] = [
    &[(1.0, 0.0047)],
    &[(1.0, 0.0053)],
    &[(34.1, 0.04), (13.5, 0.025)],
];
/// The widest of these; all filters share its radius.
const WIDEST_B: f64 = 0.04;

/// Exponent of the colour difference.
const Q_C: f64 = 0.7;
/// Colour differences below `P_C` of the largest possible one are mapped to [0, `P_T`].
const P_C: f64 = 0.4;
const P_T: f64 = 0.95;
/// Width of detected edges and points, in degrees.
const FEATURE_WIDTH: f64 = 0.082;
/// Exponent of the feature difference.
const Q_F: f64 = 0.5;

/// CIE D65 white for the sRGB primaries below.
const WHITE: [f64; 3] = [0.950_428_545, 1.0, 1.088_900_371];

/// The mean error in [0, 1] between two pictures of sRGB-encoded values.
pub(super) fn flip(reference: &[Plane; 3], test: &[Plane; 3]) -> f64 {
    let (reference, test) = (Seen::new(reference), Seen::new(test));
    let largest = largest_color_difference();
    let error = |i: usize| {
        let color = color_error(hyab(reference.lab[i], test.lab[i]), largest);
        let edge = (reference.edges[i] - test.edges[i]).abs();
        let point = (reference.points[i] - test.points[i]).abs();
        let feature = (edge.max(point) / f64::sqrt(2.0)).powf(Q_F);
        color.powf(1.0 - feature)
    };
    let count = reference.lab.len();
    (0..count).map(error).sum::<f64>() / count as f64
}

/// A picture as it is seen from the viewer's distance.
struct Seen {
    /// Hunt-adjusted L*a*b*.
    lab: Vec<[f64; 3]>,
    edges: Vec<f64>,
    points: Vec<f64>,
}

impl Seen {
    fn new(display: &[Plane; 3]) -> Seen {
        let opponent = opponent_planes(display);
        let [y, cx, cz]: [Plane; 3] = std::array::from_fn(|i| blur(&opponent[i], SENSITIVITY[i]));
        let blurred = y.values.iter().zip(&cx.values).zip(&cz.values);
        let lab = blurred
            .map(|((&y, &cx), &cz)| hunt_lab(linear_rgb([y, cx, cz])))
            .collect();

        let grey = y_normalized(&opponent[0]);
        let [gaussian, first, second] = feature_kernels();
        let magnitude = |derivative: &[f64]| {
            let (dx, dy) = (
                grey.filter(derivative, &gaussian),
                grey.filter(&gaussian, derivative),
            );
            dx.combine(&dy, f64::hypot).values
        };
        Seen {
            lab,
            edges: magnitude(&first),
            points: magnitude(&second),
        }
    }
}

/// Convolution with a sum of two-dimensional Gaussians that adds up to 1.
fn blur(plane: &Plane, gaussians: &[(f64, f64)]) -> Plane {
    let radius = (3.0 * (WIDEST_B / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
    // Separable, so each direction takes the root of the factor.
    let kernels: Vec<Vec<f64>> = gaussians
        .iter()
        .map(|&(a, b)| {
            let weight = |x: i32| (-(PI * f64::from(x) / PIXELS_PER_DEGREE).powi(2) / b).exp();
            (-radius..=radius)
                .map(|x| (a * (PI / b).sqrt()).sqrt() * weight(x))
                .collect()
        })
        .collect();
    let total: f64 = kernels
        .iter()
        .map(|kernel| kernel.iter().sum::<f64>().powi(2))
        .sum();
    kernels
        .iter()
        .map(|kernel| {
            let kernel: Vec<f64> = kernel.iter().map(|weight| weight / total.sqrt()).collect();
            plane.filter(&kernel, &kernel)
        })
        .reduce(|sum, plane| sum.combine(&plane, |a, b| a + b))
        .expect("a channel's sensitivity has at least one Gaussian")
}

/// A Gaussian and its first and second derivative; positive weights add up to 1, negative to −1.
fn feature_kernels() -> [Vec<f64>; 3] {
    let deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
    let radius = (3.0 * deviation).ceil() as i32;
    let kernel = |factor: fn(f64) -> f64| {
        let weights = (-radius..=radius).map(|x| {
            let x = f64::from(x) / deviation;
            factor(x) * (-0.5 * x * x).exp()
        });
        balanced(weights.collect())
    };
    [kernel(|_| 1.0), kernel(|x| -x), kernel(|x| x * x - 1.0)]
}

fn balanced(kernel: Vec<f64>) -> Vec<f64> {
    let positive: f64 = kernel.iter().filter(|&&weight| weight > 0.0).sum();
    let negative: f64 = kernel.iter().filter(|&&weight| weight < 0.0).sum();
    let scale = |weight: f64| {
        if weight > 0.0 {
            weight / positive
        } else {
            -weight / negative
        }
    };
    kernel.into_iter().map(scale).collect()
}

fn color_error(difference: f64, largest: f64) -> f64 {
    let (difference, largest) = (difference.powf(Q_C), largest.powf(Q_C));
    let knee = P_C * largest;
    if difference < knee {
        difference * P_T / knee
    } else {
        P_T + (difference - knee) / (largest - knee) * (1.0 - P_T)
    }
}

/// Between the two primaries that lie farthest apart.
fn largest_color_difference() -> f64 {
    hyab(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0]))
}

/// City-block distance of lightness, Euclidean distance of chroma.
fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// Achromatic, red-green and blue-yellow channels (Y, Cx, Cz): L*a*b* without its cube root.
fn opponent_planes(display: &[Plane; 3]) -> [Plane; 3] {
    let mut opponent = display.clone();
    for i in 0..display[0].values.len() {
        let [x, y, z] = relative_xyz(std::array::from_fn(|c| srgb::decode(display[c].values[i])));
        let channels = [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)];
        for (plane, value) in opponent.iter_mut().zip(channels) {
            plane.values[i] = value;
        }
    }
    opponent
}

fn y_normalized(achromatic: &Plane) -> Plane {
    achromatic.with(
        achromatic
            .values
            .iter()
            .map(|y| (y + 16.0) / 116.0)
            .collect(),
    )
}

/// Back from the opponent channels, clipped to what a display can show.
fn linear_rgb([y, cx, cz]: [f64; 3]) -> [f64; 3] {
    let y = (y + 16.0) / 116.0;
    let [x, y, z] = [
        (y + cx / 500.0) * WHITE[0],
        y * WHITE[1],
        (y - cz / 200.0) * WHITE[2],
    ];
    [
        3.241_003_275 * x - 1.537_398_934 * y - 0.498_615_861 * z,
        -0.969_224_334 * x + 1.875_930_071 * y + 0.041_554_224 * z,
        0.055_639_423 * x - 0.204_011_202 * y + 1.057_148_933 * z,
    ]
    .map(|value| value.clamp(0.0, 1.0))
}

/// XYZ of linear sRGB, white being 1, 1, 1.
fn relative_xyz([r, g, b]: [f64; 3]) -> [f64; 3] {
    [
        (10_135_552.0 * r + 8_788_810.0 * g + 4_435_075.0 * b) / 24_577_794.0 / WHITE[0],
        (2_613_072.0 * r + 8_788_810.0 * g + 887_015.0 * b) / 12_288_897.0 / WHITE[1],
        (1_425_312.0 * r + 8_788_810.0 * g + 70_074_185.0 * b) / 73_733_382.0 / WHITE[2],
    ]
}

/// L*a*b* with chroma scaled by lightness (the Hunt effect: darker looks less colourful).
fn hunt_lab(linear_rgb: [f64; 3]) -> [f64; 3] {
    const DELTA: f64 = 6.0 / 29.0;
    let [x, y, z] = relative_xyz(linear_rgb).map(|value| {
        if value > DELTA.powi(3) {
            value.cbrt()
        } else {
            value / (3.0 * DELTA * DELTA) + 4.0 / 29.0
        }
    });
    let lightness = 116.0 * y - 16.0;
    let hunt = 0.01 * lightness;
    [lightness, hunt * 500.0 * (x - y), hunt * 200.0 * (y - z)]
}
