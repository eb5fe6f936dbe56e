//! `tone_map` puts a picture of some size on a display of another: it interpolates radiance, encodes it, and leaves
//! alone what lies beside either. That it encodes as a PNG does is tested with the other twins of Rust and GLSL.

use std::sync::Arc;

use fastrand::Rng;
use isolume::gpu::*;
use isolume::output::display::display_value;
use isolume::render::{Display, ToneMapPush, shared};
use isolume::scene::*;

use crate::support::common::*;
use crate::support::probe::{NOTHING, Probe};

/// Half a level is rounding, the rest single precision.
const MOST_LEVELS: f64 = 0.51;

fn scene(size: [u32; 2]) -> Scene {
    let camera = Camera {
        eye: [0.0, 0.0, 3.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height: 1.0 },
    };
    empty_scene(size, camera)
}

fn push(source: [u32; 2], size: [u32; 2]) -> ToneMapPush {
    ToneMapPush {
        source,
        size,
        exposure: 1.0,
        filmic: 0,
    }
}

/// A display of `extent` pixels, black at first.
fn display(memory: &Arc<Memory>, [width, height]: [u32; 2]) -> Image {
    let desc = ImageDesc::flat("display", [width, height], Format::R8G8B8A8_UNORM)
        .written()
        .zeroed();
    Image::new(memory, desc).expect("a display")
}

/// What a display shows, row 0 on top.
fn shown(memory: &Arc<Memory>, display: &Image) -> Vec<[u8; 4]> {
    let desc = BufferDesc::host_cached("shown", display.desc().bytes());
    let bytes = Buffer::new(memory, desc).expect("a buffer");
    let mut frame = Frame::new(memory.device()).expect("a frame");
    frame
        .run(|recording| recording.download(display, &bytes, [0; 3], display.desc().extent))
        .expect("a download");
    assert_silent(memory.device());
    bytes.read_vec(display.desc().texels() as usize)
}

/// The pass alone, without a renderer that gives it its push constants.
pub fn tone_map_pass(device: &Arc<Device>) -> Pass {
    let desc = PassDesc {
        name: "tone_map",
        specialization: &[],
        push: ToneMapPush::PUSH,
        macros: &[],
    };
    let shaders = Shaders::new(shared::glsl());
    Pass::new(device, &shaders, &desc).expect("a pass")
}

/// What a display of `extent` pixels shows of `picture`, which is `size` pixels.
fn shown_of(
    picture: &[[f32; 4]],
    size: [u32; 2],
    extent: [u32; 2],
    push: ToneMapPush,
) -> Vec<[u8; 4]> {
    let mut probe = Probe::new(&scene(size), &constant_field(1.0, [1; 3], [1.0; 3]));
    let display = display(&probe.memory, extent);
    let texels = Buffer::with_data(&probe.memory, "texels", picture).expect("texels");
    let pass = tone_map_pass(probe.memory.device());
    let (frame, r) = probe.renderer.probed();
    let run = frame.run(|recording| {
        recording.upload(&texels, &r.mean, [0; 3], [size[0], size[1], 1])?;
        let bindings = [
            ("picture", Binding::Image(&r.mean)),
            ("shown", Binding::Image(&display)),
        ];
        recording.dispatch(&pass, &bindings, &push, [push.size[0], push.size[1], 1])
    });
    run.expect("a run");
    shown(&probe.memory, &display)
}

fn assert_shows(shown: [u8; 4], radiance: [f64; 3], at: &str) {
    for (shown, radiance) in shown.iter().zip(radiance) {
        let exact = 255.0 * display_value(radiance, 0.0, Tone::Linear);
        let difference = (f64::from(*shown) - exact).abs();
        assert!(
            difference <= MOST_LEVELS,
            "{at}: {exact} is shown as {shown}"
        );
    }
    assert_eq!(shown[3], 255, "{at}: a display is opaque");
}

/// Radiance between the centres of the four pixels around a point, by linear interpolation; the outermost pixels'
/// beyond their centres. `width` is that of the rows, `source` that of the picture in them.
fn interpolated(picture: &[[f32; 4]], width: u32, source: [u32; 2], point: [f64; 2]) -> [f64; 3] {
    let axis = |a: usize| {
        let last = f64::from(source[a] - 1);
        let x = (point[a] - 0.5).clamp(0.0, last);
        let low = x.floor();
        let high = (low + 1.0).min(last);
        (low as usize, high as usize, x - low)
    };
    let (left, right, s) = axis(0);
    let (top, bottom, t) = axis(1);
    std::array::from_fn(|c| {
        let pixel = |x: usize, y: usize| f64::from(picture[y * width as usize + x][c]);
        let row = |y: usize| pixel(left, y) + s * (pixel(right, y) - pixel(left, y));
        row(top) + t * (row(bottom) - row(top))
    })
}

#[test]
fn a_picture_is_stretched_to_the_display_and_nothing_beside_it_counts() {
    let mut random = Rng::with_seed(4);
    let size = [21, 18];
    for (source, shown_size) in [
        ([17, 13], [17, 13]),
        ([17, 13], [40, 33]),
        ([5, 3], [33, 47]),
        ([20, 17], [9, 30]),
        ([1, 1], [8, 8]),
        ([12, 1], [7, 9]),
    ] {
        // Beside the picture its image holds what no display should show.
        let picture: Vec<[f32; 4]> = (0..size[0] * size[1])
            .map(|n| match [n % size[0], n / size[0]] {
                [x, y] if x < source[0] && y < source[1] => {
                    std::array::from_fn(|_| random.f32().powi(2))
                }
                _ => [1e9; 4],
            })
            .collect();
        let extent = shown_size.map(|n| n + 3);
        let shown = shown_of(&picture, size, extent, push(source, shown_size));
        for (n, &pixel) in shown.iter().enumerate() {
            let at = [n as u32 % extent[0], n as u32 / extent[0]];
            let case = format!("{source:?} in {shown_size:?}, pixel {at:?}");
            if at[0] >= shown_size[0] || at[1] >= shown_size[1] {
                assert_eq!(pixel, [0; 4], "{case} lies beside what is shown");
                continue;
            }
            let point = std::array::from_fn(|a| {
                (f64::from(at[a]) + 0.5) * f64::from(source[a]) / f64::from(shown_size[a])
            });
            let exact = interpolated(&picture, size[0], source, point);
            assert_shows(pixel, exact, &case);
        }
    }
}

/// A transparent background is black on a display: radiance is that of what covers the pixel, times its coverage.
#[test]
fn coverage_does_not_change_what_is_shown() {
    let size = [16, 4];
    let coverage = |n: u32| [0.0, 0.25, 0.5, 1.0][n as usize / 16];
    let radiance = |n: u32| 0.05 * (n % 16) as f32;
    let picture: Vec<[f32; 4]> = (0..64)
        .map(|n| [radiance(n), 0.5 * radiance(n), 0.1, coverage(n)])
        .collect();
    let shown = shown_of(&picture, size, size, push(size, size));
    for (n, (&pixel, texel)) in shown.iter().zip(&picture).enumerate() {
        let [r, g, b, _] = texel.map(f64::from);
        assert_shows(pixel, [r, g, b], &format!("pixel {n}"));
    }
}

/// With a cache there are two pictures, the march and the mean of the samples: each is shown by its own call.
#[test]
fn a_march_is_shown_in_one_step_as_in_two() {
    let size = [16, 12];
    let mut scene = scene(size);
    scene.medium = Some(uniform_medium(1.5, 0.8, 0.0));
    scene.lights.environment.radiance = [0.3, 0.6, 0.9];
    let volume = constant_field(1.0, [8; 3], [0.1; 3]);
    // The cache shows a guess: nobody traces a path.
    let shaders = shaders()
        .with_file("node_tracking.comp", NOTHING)
        .with_file("camera_march.comp", NOTHING);
    let device = device();
    let scene = scene_with_cache(&scene, &volume, 1.0, CacheFormat::F32, 1);
    let mut cached = empty_cache(device.clone(), &shaders, &volume, scene);
    let memory = Memory::new(&device, 1 << 20).expect("memory");
    let [at_once, afterwards, samples] = [(); 3].map(|()| display(&memory, size));
    let as_it_is = Display {
        exposure: 0.0,
        tone: Tone::Linear,
    };
    let mut caching = cached.caching();
    caching.guess_light().expect("a guess");
    caching.march_at_once(&at_once, as_it_is).expect("a march");
    let marched = caching.march().expect("a march");
    caching.tone_map(&afterwards, as_it_is).expect("a run");
    cached.renderer.tone_map(&samples, as_it_is).expect("a run");
    let [at_once, afterwards, samples] =
        [at_once, afterwards, samples].map(|display| shown(&memory, &display));
    assert_eq!(at_once, afterwards);
    assert!(marched.iter().any(|pixel| pixel[1] > 0.1));
    for (n, (&pixel, texel)) in afterwards.iter().zip(&marched).enumerate() {
        let [r, g, b, _] = texel.map(f64::from);
        assert_shows(pixel, [r, g, b], &format!("pixel {n}"));
    }
    let black = [0, 0, 0, 255];
    assert_eq!(
        samples,
        vec![black; samples.len()],
        "there is no sample yet"
    );
}
