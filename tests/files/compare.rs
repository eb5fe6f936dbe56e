//! Metrics against the tools whose definitions they follow, and what cannot be compared.
//!
//! The frozen numbers come from NumPy 2.4 in double precision, scikit-image 0.26 and
//! flip-evaluator 1.7 on the images of `noisy`, `r` and `t` being sRGB-encoded clipped values:
//!
//! ```python
//! structural_similarity(r, t, channel_axis=-1, data_range=1.0, gaussian_weights=True, sigma=1.5,
//!                       use_sample_covariance=False)
//! flip_evaluator.evaluate(r, t, "LDR", inputsRGB=True, applyMagma=False)[1]
//! ```

use std::fs;
use std::path::{Path, PathBuf};

use exr::prelude::*;
use isolume::compare::{Comparison, LinearImage, compare_files, compare_images, without_noise};
use isolume::engine::Picture;
use isolume::output::{Provenance, write_exr, write_png};
use isolume::scene::Tone;
use tempfile::TempDir;

const WIDTH: u32 = 100;
const HEIGHT: u32 = 70;

/// Ramps, a disc's edge and stripes, brighter than 1 in places, times uniform relative noise.
fn noisy(seed: u32, noise: f64) -> Picture {
    let (mut rgb, mut stderr) = (Vec::new(), Vec::new());
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let clean: [f64; 3] = std::array::from_fn(|c| {
                let ramp = f64::from((x + 1) * (c as u32 + 1)) / f64::from(2 * WIDTH);
                let (dx, dy) = (f64::from(x) - f64::from(WIDTH) / 3.0, f64::from(y) - 35.0);
                let disc = if dx * dx + dy * dy < 17.5 * 17.5 {
                    0.8
                } else {
                    0.0
                };
                let stripe = f64::from((x / 4 + y / 8) % 2) * 0.25 * f64::from(y) / 70.0;
                ramp + disc + stripe
            });
            rgb.push(std::array::from_fn(|c| {
                let index = (y * WIDTH + x) * 3 + c as u32;
                let random = hash(index.wrapping_add(seed.wrapping_mul(0x9e37_79b9)));
                (clean[c] * (1.0 + noise * (f64::from(random) / 4_294_967_296.0 - 0.5))) as f32
            }));
            stderr.push(clean.map(|v| (v * noise / 12f64.sqrt()) as f32));
        }
    }
    let layer = vec![[0.0; 3]; rgb.len()];
    Picture {
        width: WIDTH,
        height: HEIGHT,
        depth: vec![f32::INFINITY; rgb.len()],
        rgb,
        alpha: None,
        stderr,
        albedo: layer.clone(),
        normal: layer,
    }
}

fn hash(mut x: u32) -> u32 {
    x = (x ^ x >> 16).wrapping_mul(0x7feb_352d);
    x = (x ^ x >> 15).wrapping_mul(0x846c_a68b);
    x ^ x >> 16
}

fn exr(folder: &TempDir, name: &str, picture: &Picture) -> PathBuf {
    let path = folder.path().join(name);
    write_exr(&path, picture, &Provenance::default()).unwrap();
    path
}

fn compare_noisy(noise: f64, exposure: f64) -> Comparison {
    let folder = TempDir::new().unwrap();
    let a = exr(&folder, "a.exr", &noisy(1, noise));
    let b = exr(&folder, "b.exr", &noisy(2, noise));
    compare_files([&a, &b], None, exposure).unwrap().comparison
}

#[track_caller]
fn assert_close(found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{found} is not {expected} ± {tolerance}"
    );
}

/// Renderers crop what they write to a part of the picture.
#[test]
fn pictures_are_compared_where_they_are_shown() {
    let folder = TempDir::new().unwrap();
    let quarter = |name: &str, x: i32| {
        let pixels = SpecificChannels::rgb(|_: Vec2<usize>| (1.0_f32, 2.0_f32, 3.0_f32));
        let attributes = LayerAttributes {
            layer_position: Vec2(x, 0),
            ..LayerAttributes::default()
        };
        let layer = Layer::new((4, 8), attributes, Encoding::UNCOMPRESSED, pixels);
        let mut image = Image::from_layer(layer);
        image.attributes.display_window = IntegerBounds::from_dimensions((8, 8));
        let path = folder.path().join(name);
        image.write().to_file(&path).unwrap();
        LinearImage::read(&path).unwrap()
    };
    let [left, right] = [quarter("left.exr", 0), quarter("right.exr", 4)];
    assert_eq!((left.width, left.height), (8, 8));
    let row = |image: &LinearImage| image.rgb[..8].iter().map(|rgb| rgb[1]).collect::<Vec<_>>();
    assert_eq!(row(&left), [2.0, 2.0, 2.0, 2.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(row(&right), [0.0, 0.0, 0.0, 0.0, 2.0, 2.0, 2.0, 2.0]);
}

#[test]
fn linear_metrics_and_z_scores_are_those_of_the_reference_script() {
    let found = compare_noisy(0.3, 0.0);
    assert_close(found.mse, 0.009_634_459_079, 1e-9);
    assert_close(found.relmse, 0.013_812_096_011, 1e-9);
    assert_close(found.bias, 0.000_312_000_399, 1e-9);
    assert_close(found.rel_bias, 0.000_461_211_680, 1e-9);
    assert_close(found.z_bias.unwrap(), 0.278_042_658, 1e-6);
    assert_close(found.z_tile_max.unwrap(), 1.683_215_779, 1e-6);
}

/// Noise is judged by how bright a picture is, which radiances in any unit may be.
#[test]
fn dim_pictures_have_the_scores_of_bright_ones() {
    let folder = TempDir::new().unwrap();
    let dim = |seed: u32| {
        let mut picture = noisy(seed, 0.3);
        for rgb in picture.rgb.iter_mut().chain(&mut picture.stderr) {
            *rgb = rgb.map(|value| value * 1e-9);
        }
        exr(&folder, &format!("{seed}.exr"), &picture)
    };
    let found = compare_files([&dim(1), &dim(2)], None, 0.0)
        .unwrap()
        .comparison;
    assert_close(found.z_bias.unwrap(), 0.278_042_658, 1e-4);
    assert_close(found.z_tile_max.unwrap(), 1.683_215_779, 1e-4);
    let mut black = noisy(1, 0.3);
    black.rgb.fill([0.0; 3]);
    let [a, b] = ["a.exr", "b.exr"].map(|name| exr(&folder, name, &black));
    let found = compare_files([&a, &b], None, 0.0).unwrap().comparison;
    assert_eq!(found.rel_bias, 0.0);
}

#[test]
fn display_metrics_are_those_of_scikit_image_and_flip_evaluator() {
    for (noise, exposure, psnr, ssim, flip) in [
        (0.3, 0.0, 29.732_008_757, 0.776_161_730, 0.091_020_256),
        (0.3, 1.0, 31.530_955_895, 0.895_294_368, 0.061_387_371),
        (0.01, 0.0, 59.117_086_419, 0.999_526_917, 0.007_502_148),
        (0.01, 1.0, 60.869_768_135, 0.999_796_688, 0.005_158_733),
    ] {
        let found = compare_noisy(noise, exposure);
        assert_close(found.psnr, psnr, 1e-4);
        assert_close(found.ssim.unwrap(), ssim, 1e-5);
        assert_close(found.flip, flip, 1e-5);
    }
}

#[test]
fn png_files_are_decoded_to_linear_radiance() {
    let folder = TempDir::new().unwrap();
    let [a, b] = [1, 2].map(|seed| {
        let path = folder.path().join(format!("{seed}.png"));
        write_png(&path, &noisy(seed, 0.3), 0.0, Tone::Linear).unwrap();
        path
    });
    let found = compare_files([&a, &b], None, 0.0).unwrap().comparison;
    assert_close(found.mse, 0.003_039_877_010, 1e-8);
    assert_close(found.psnr, 29.724_496_429, 1e-4);
    assert_close(found.ssim.unwrap(), 0.775_900_900, 1e-5);
    assert_close(found.flip, 0.091_005_088, 1e-5);
    assert_eq!((found.z_bias, found.z_tile_max), (None, None));
}

#[test]
fn equal_pictures_have_no_error() {
    let folder = TempDir::new().unwrap();
    let a = exr(&folder, "a.exr", &noisy(1, 0.3));
    let found = compare_files([&a, &a], None, 0.0).unwrap().comparison;
    assert_eq!(
        (found.mse, found.flip, found.psnr),
        (0.0, 0.0, f64::INFINITY)
    );
    assert_close(found.ssim.unwrap(), 1.0, 1e-12);
    assert_eq!(found.z_bias, Some(0.0));

    let psnr = found
        .table()
        .lines()
        .find(|line| line.starts_with("psnr"))
        .map(str::to_owned);
    assert!(psnr.unwrap().contains(" inf "));
    assert!(serde_json::to_value(&found).unwrap()["psnr"].is_null());
}

#[test]
fn a_shift_of_four_standard_errors_shows_as_such() {
    let mut reference = LinearImage::from_picture("reference", &noisy(1, 0.0));
    let mut test = reference.clone();
    // Each pixel has σ = 0.1, on one side only: the mean of a tile has σ = 0.1 / 16.
    reference.stderr = Some(vec![[0.1; 3]; test.rgb.len()]);
    for y in 16..32 {
        for x in 32..48 {
            test.rgb[y * WIDTH as usize + x]
                .iter_mut()
                .for_each(|v| *v -= 4.0 * 0.1 / 16.0);
        }
    }
    let found = compare_images(&reference, &test, 0.0).unwrap();
    assert_close(found.z_tile_max.unwrap(), 4.0, 1e-4);
    let pixels = f64::from(WIDTH * HEIGHT);
    assert_close(
        found.z_bias.unwrap(),
        -256.0 * 0.025 / (0.1 * pixels.sqrt()),
        1e-4,
    );
}

#[test]
fn pictures_smaller_than_a_window_have_no_ssim() {
    let small = LinearImage {
        name: "small".to_owned(),
        width: 10,
        height: 40,
        rgb: vec![[0.5; 3]; 400],
        stderr: None,
    };
    let found = compare_images(&small, &small, 0.0).unwrap();
    assert_eq!((found.ssim, found.flip), (None, 0.0));
}

/// A grey picture with a bright `spot` in it; pixels share their noise by fours.
fn with_spot(spot: f32, seed: u32, noise: f64) -> LinearImage {
    let pixel = |at: u32| {
        let (x, y) = (at % WIDTH, at / WIDTH);
        let square = y / 2 * WIDTH + x / 2;
        let random = f64::from(hash(square ^ hash(seed))) / 4_294_967_296.0 - 0.5;
        let inside = (20..60).contains(&x) && (20..60).contains(&y);
        [0.3 + if inside { spot } else { 0.0 } + (noise * random) as f32; 3]
    };
    LinearImage {
        name: format!("spot {spot}, {seed}"),
        width: WIDTH as usize,
        height: HEIGHT as usize,
        rgb: (0..WIDTH * HEIGHT).map(pixel).collect(),
        stderr: None,
    }
}

/// Psnr without noise and at least, of pictures whose spots differ by `spot`.
fn spots_apart(spot: f32, seed: u32) -> [f64; 2] {
    let noisy = |spot, k| with_spot(spot, 4 * seed + k, 0.05);
    let [r, s] = [noisy(0.0, 0), noisy(0.0, 1)];
    let [t, u] = [noisy(spot, 2), noisy(spot, 3)];
    let found = without_noise([&r, &s], [&t, &u], 0.0).unwrap();
    [found.psnr_without_noise, found.psnr_at_least]
}

#[test]
fn pictures_rendered_twice_are_compared_beyond_their_noise() {
    let clean = [0.0, 0.012].map(|spot| with_spot(spot, 0, 0.0));
    let truth = compare_images(&clean[0], &clean[1], 0.0).unwrap().psnr;
    let noisy = [(0.0, 1), (0.012, 2)].map(|(spot, seed)| with_spot(spot, seed, 0.05));
    let raw = compare_images(&noisy[0], &noisy[1], 0.0).unwrap().psnr;
    assert!(raw < truth - 8.0, "{raw} dB with noise, {truth} dB without");

    // Too good by two standard errors is one in forty.
    let found: Vec<[f64; 2]> = (0..100).map(|seed| spots_apart(0.012, seed)).collect();
    let square = |psnr: f64| 10f64.powf(-0.1 * psnr);
    let mean = found.iter().map(|&[psnr, _]| square(psnr)).sum::<f64>() / 100.0;
    assert_close(-10.0 * mean.log10(), truth, 0.3);
    let too_good = found.iter().filter(|[_, least]| *least > truth).count();
    assert!(too_good <= 8, "{too_good} of 100");

    // Of equal pictures, as far as noise lets anybody say.
    let equal: Vec<[f64; 2]> = (0..100).map(|seed| spots_apart(0.0, seed)).collect();
    let unmeasurable = equal.iter().filter(|[psnr, _]| psnr.is_infinite()).count();
    assert!((30..70).contains(&unmeasurable), "{unmeasurable} of 100");
    assert!(
        equal
            .iter()
            .all(|[psnr, least]| least.is_finite() && least < psnr)
    );
}

#[track_caller]
fn refuses(a: &Path, b: &Path, parts: &[&str]) {
    let error = compare_files([a, b], None, 0.0).expect_err("it is refused");
    assert!(error.is_about_input(), "{error:?}");
    let message = error.to_string();
    for part in parts {
        assert!(message.contains(part), "{message:?} lacks {part:?}");
    }
}

#[test]
fn what_cannot_be_compared_is_named() {
    let folder = TempDir::new().unwrap();
    let a = exr(&folder, "a.exr", &noisy(1, 0.3));

    let mut smaller = noisy(1, 0.3);
    (smaller.width, smaller.height) = (HEIGHT, WIDTH);
    let b = exr(&folder, "turned.exr", &smaller);
    refuses(&a, &b, &["a.exr: it has 100x70", "turned.exr has 70x100"]);

    let mut hole = noisy(1, 0.3);
    hole.rgb[205][1] = f32::NAN;
    let b = exr(&folder, "hole.exr", &hole);
    refuses(&a, &b, &["hole.exr: G is NaN at column 5, row 2"]);
    hole = noisy(1, 0.3);
    hole.stderr[0][2] = f32::NAN;
    let b = exr(&folder, "unsure.exr", &hole);
    refuses(&a, &b, &["unsure.exr: stderr.B is NaN at column 0, row 0"]);

    refuses(
        &a,
        &folder.path().join("none.exr"),
        &["none.exr", "No such file"],
    );
    refuses(
        &a,
        &folder.path().join("none.png"),
        &["none.png", "No such file"],
    );
    refuses(
        &a,
        &folder.path().join("b.jpg"),
        &["b.jpg", ".exr and .png"],
    );

    let whole = fs::read(&a).unwrap();
    for (name, bytes) in [
        ("cut.exr", &whole[..whole.len() / 2]),
        ("text.exr", b"not a picture"),
        ("empty.exr", b""),
        ("text.png", b"not a picture"),
    ] {
        let b = folder.path().join(name);
        fs::write(&b, bytes).unwrap();
        refuses(&a, &b, &[name, "not readable"]);
    }
}

#[test]
fn an_exr_without_colour_lists_what_it_has() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("depth.exr");
    let depth = AnyChannel::new("Z", FlatSamples::F32(vec![1.0; 4]));
    let channels = AnyChannels::sort(SmallVec::from_iter([depth]));
    Image::from_channels((2, 2), channels)
        .write()
        .to_file(&path)
        .unwrap();
    refuses(&path, &path, &["depth.exr", "R, G and B", "there are Z"]);
}
