//! The medium's mean along a step of a march, against integrals in double precision.

use fastrand::Rng;

use super::*;
use crate::support::small_scenes::medium;

const MEAN_MEDIUM: Shader = Shader {
    name: "mean_medium",
    text: include_str!("../../support/glsl/mean_medium.comp"),
    uses: &["scene_block", "volume", "transfer"],
};

const DENSITY: f64 = 2.0;
const PAIRS: usize = 1 << 14;

type Point = (f64, f64, [f64; 3]);

const SAND: [f64; 3] = [0.9, 0.6, 0.3];
const SKY: [f64; 3] = [0.2, 0.5, 1.0];

/// Opacity times colour and opacity, just above a value.
fn transfer(points: &[Point], v: f64) -> [f64; 4] {
    let next = points.iter().position(|p| p.0 > v);
    let [a, b] = match next {
        Some(0) => [points[0]; 2],
        Some(i) => [points[i - 1], points[i]],
        None => [points[points.len() - 1]; 2],
    };
    let t = if b.0 > a.0 {
        (v - a.0) / (b.0 - a.0)
    } else {
        0.0
    };
    let mix = |x: f64, y: f64| x + t * (y - x);
    let opacity = mix(a.1, b.1);
    let color = |i: usize| opacity * mix(a.2[i], b.2[i]);
    [color(0), color(1), color(2), opacity]
}

/// The mean between two values: Simpson's rule is exact within a segment.
fn exact(points: &[Point], a: f64, b: f64) -> [f64; 4] {
    let (low, high) = (a.min(b), a.max(b));
    if low == high {
        return transfer(points, low);
    }
    let inner = points.iter().map(|p| p.0).filter(|&v| v > low && v < high);
    let ends: Vec<f64> = [low].into_iter().chain(inner).chain([high]).collect();
    let mut sum = [0.0; 4];
    for pair in ends.windows(2).filter(|pair| pair[1] > pair[0]) {
        let (x, width) = (pair[0], pair[1] - pair[0]);
        // Not at its very ends, where the function may step.
        let at = |share: f64| transfer(points, x + share * width);
        let [start, middle, end] = [at(1e-9), at(0.5), at(1.0 - 1e-9)];
        sum = std::array::from_fn(|i| sum[i] + width * (start[i] + 4.0 * middle[i] + end[i]) / 6.0);
    }
    sum.map(|s| s / (high - low))
}

/// Of a volume that may hold any values, since a transfer function is cut off beyond those that a volume holds.
fn probe_of_any_values(scene: &Scene) -> Probe {
    let mut volume = common::constant_field(1.0, [1; 3], [1.0; 3]);
    volume.range = [-1e30, 1e30];
    Probe::new(scene, &volume)
}

fn assert_exact(points: &[Point]) {
    let mut scene = scene();
    scene.medium = Some(medium(DENSITY, 0.0, points));
    let mut probe = probe_of_any_values(&scene);
    probe.features.is_linear = false;
    let mut random = Rng::with_seed(3);
    let [first, last] = [points[0].0, points[points.len() - 1].0];
    let mut value = || (first - 20.0 + random.f64() * (last - first + 40.0)) as f32;
    let mut pairs: Vec<StepValues> = (0..PAIRS)
        .map(|_| StepValues {
            a: value(),
            b: value(),
            bend: 0.0,
        })
        .collect();
    // Steps across next to nothing, and across nothing, also at a point.
    for (i, pair) in pairs.iter_mut().step_by(4).enumerate() {
        let (at, _, _) = points[i % points.len()];
        pair.a = if i % 3 == 0 { at as f32 } else { pair.a };
        pair.b = pair.a + [0.0, 1e-4, -1e-2][i / 3 % 3];
    }
    let at = |value: f64| exact(points, value, value);
    let push = CountPush {
        count: PAIRS as u32,
    };
    let found: Vec<MeanMedium> = probe.run(&MEAN_MEDIUM, &push, &pairs, PAIRS, PAIRS);
    for (pair, mean) in pairs.iter().zip(found) {
        let [a, b] = [pair.a, pair.b].map(f64::from);
        let exact = exact(points, a, b);
        let opacity = f64::from(mean.sigma_t) / DENSITY;
        let mut said = mean.albedo.map(|c| f64::from(c) * opacity).to_vec();
        said.push(opacity);
        // A step across less than 1e-4 of the area may pass over a point that lies in it: then the mean is anything that
        // the step meets.
        let (low, high) = (a.min(b) - 1e-3, a.max(b) + 1e-3);
        let inside = points.iter().map(|point| point.0);
        let inside = inside.filter(|value| (low..=high).contains(value));
        let met: Vec<[f64; 4]> = [low, high].into_iter().chain(inside).map(at).collect();
        let passed_over = (b - a).abs() < 0.011 && met.len() > 2;
        for (channel, (said, exact)) in said.into_iter().zip(exact).enumerate() {
            let of = |limit: fn(f64, f64) -> f64| met.iter().map(|met| met[channel]).reduce(limit);
            let spread = of(f64::max)
                .zip(of(f64::min))
                .map_or(0.0, |(high, low)| high - low);
            let tolerance = 2e-3 + if passed_over { spread } else { 0.0 };
            assert!(
                (said - exact).abs() <= tolerance,
                "{a} to {b}: {said}, not {exact}"
            );
            assert!((-1e-6..=1.0 + 1e-6).contains(&said), "{a} to {b}: {said}");
        }
    }
}

#[test]
fn of_a_tent_in_two_colors() {
    assert_exact(&[
        (10.0, 0.0, SAND),
        (12.0, 1.0, SAND),
        (15.0, 0.25, SKY),
        (70.0, 0.5, SKY),
    ]);
}

#[test]
fn of_steps_in_one_color() {
    assert_exact(&[
        (0.0, 0.8, SAND),
        (5.0, 0.8, SAND),
        (5.0, 0.0, SAND),
        (30.0, 0.0, SAND),
        (30.0, 1.0, SAND),
        (30.5, 1.0, SAND),
        (30.5, 0.1, SAND),
    ]);
}

#[test]
fn of_a_single_point() {
    assert_exact(&[(40.0, 0.7, SKY)]);
}

/// Means of what the field passes that goes from `a` to `b` and is off a straight line by `bend` half way, as a parabola.
fn along_bend(points: &[Point], [a, b, bend]: [f64; 3]) -> [f64; 4] {
    const COUNT: u32 = 2000;
    let mut sum = [0.0; 4];
    for n in 0..COUNT {
        let x = (f64::from(n) + 0.5) / f64::from(COUNT);
        let here = transfer(points, a + x * (b - a) + 4.0 * bend * x * (1.0 - x));
        sum = std::array::from_fn(|i| sum[i] + here[i] / f64::from(COUNT));
    }
    sum
}

/// The largest errors of the opacity times colour, and of the opacity, of steps that rise or fall by so much, with bends up to
/// `most`.
fn largest_errors(points: &[Point], begins: [f64; 2], rises: [f64; 2], most: f64) -> [f64; 2] {
    let mut scene = scene();
    scene.medium = Some(medium(DENSITY, 0.0, points));
    let mut probe = probe_of_any_values(&scene);
    probe.features.is_linear = false;
    let mut random = Rng::with_seed(5);
    let mut within = |[low, high]: [f64; 2]| low + random.f64() * (high - low);
    let pairs: Vec<StepValues> = (0..1 << 10)
        .map(|_| {
            let (a, rise) = (within(begins), within(rises));
            let b = if within([0.0, 1.0]) < 0.5 {
                a - rise
            } else {
                a + rise
            };
            StepValues {
                a: a as f32,
                b: b as f32,
                bend: within([-most, most]) as f32,
            }
        })
        .collect();
    let count = pairs.len();
    let push = CountPush {
        count: count as u32,
    };
    let found: Vec<MeanMedium> = probe.run(&MEAN_MEDIUM, &push, &pairs, count, count);
    let mut largest = [0.0f64; 2];
    for (pair, mean) in pairs.iter().zip(found) {
        let exact = along_bend(points, [pair.a, pair.b, pair.bend].map(f64::from));
        let opacity = f64::from(mean.sigma_t) / DENSITY;
        let said = mean.albedo.map(|c| f64::from(c) * opacity);
        for (said, exact) in said.iter().zip(&exact) {
            largest[0] = largest[0].max((said - exact).abs());
        }
        largest[1] = largest[1].max((opacity - exact[3]).abs());
    }
    largest
}

/// The points with values that are so many times as large.
fn scaled(points: &[Point], scale: f64) -> Vec<Point> {
    points.iter().map(|p| (scale * p.0, p.1, p.2)).collect()
}

#[test]
fn of_a_bend_within_a_segment() {
    let points = [(0.0, 0.0, SAND), (90.0, 0.9, SKY), (100.0, 1.0, SKY)];
    let level = [(0.0, 1.0, SAND), (90.0, 1.0, SKY), (100.0, 1.0, SKY)];
    for points in [points, level] {
        for scale in [1.0, 1e25, 1e-25] {
            let [begins, rises] = [[40.0, 50.0], [0.0, 20.0]].map(|of| of.map(|x| scale * x));
            let errors = largest_errors(&scaled(&points, scale), begins, rises, 20.0 * scale);
            let is_exact = errors.iter().all(|error| *error < 1e-5);
            assert!(is_exact, "{errors:?} at {scale:e}");
        }
    }
}

/// Over up to two points, of which one may be a step, what is said is right to first order: the error falls with the square of
/// the bend. Colours in a part are taken as if their change were even.
#[test]
fn of_a_bend_over_points() {
    let ramps = [
        (0.0, 0.0, SAND),
        (30.0, 0.1, SKY),
        (50.0, 0.8, SAND),
        (65.0, 0.2, SKY),
        (100.0, 0.6, SAND),
    ];
    let steps = [
        (0.0, 0.1, SAND),
        (40.0, 0.1, SAND),
        (40.0, 0.7, SKY),
        (75.0, 0.7, SKY),
        (75.0, 0.2, SAND),
        (100.0, 0.2, SAND),
    ];
    for points in [&ramps[..], &steps] {
        let errors = |most| largest_errors(points, [30.0, 70.0], [20.0, 30.0], most);
        let [large, small] = [4.0, 0.4].map(errors);
        println!("{large:.5?}, {small:.6?}");
        assert!(large.iter().all(|error| *error < 0.05));
        assert!(small[1] < 0.02 * large[1] && small[0] < 0.04 * large[0]);
    }
}
