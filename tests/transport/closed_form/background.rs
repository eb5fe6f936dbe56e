//! What lies behind a medium that only absorbs: a colour of its own, or nothing, which leaves the picture's alpha. Each is
//! rendered by paths, by the march at rest and by the march in motion.

use isolume::scene::*;

use crate::support::common::*;

const DEPTH: f64 = 1.2;
const SIZE: [u32; 2] = [16, 8];

type Pixels = Vec<[f32; 4]>;

/// The slab fills the middle half of the picture; on both sides of it is vacuum. Its own light would be white.
fn pictures(background: Background) -> [(&'static str, f64, Pixels); 3] {
    let camera = Camera {
        eye: [0.0, 0.0, 2.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height: 1.0 },
    };
    let mut scene = empty_scene(SIZE, camera);
    scene.medium = Some(uniform_medium(DEPTH, 0.0, 0.0));
    scene.lights.environment.radiance = [1.0; 3];
    scene.render.background = background;
    let volume = constant_field(1.0, [8; 3], [0.125; 3]);
    let paths = render(&scene, &volume, 16, 64, 5).mean;
    let mut cache = cached(&scene, &volume, 1.0, CacheFormat::F32, 1, 5);
    let moving = cache.march();
    let resting = cache.at_rest(2, 4).mean;
    // Paths of a hundredth of the slab's 65536 samples fewer or more: five standard errors.
    [
        ("paths", 0.01, paths),
        ("in motion", 1e-5, moving),
        ("at rest", 1e-5, resting),
    ]
}

/// Mean of the slab's pixels. Each pixel beside it has to show `vacuum`.
fn slab_beside(vacuum: [f32; 4], way: &str, pixels: &[[f32; 4]]) -> [f64; 4] {
    let [width, height] = SIZE.map(|n| n as usize);
    let mut sum = [0.0; 4];
    for (i, pixel) in pixels.iter().enumerate() {
        if (width / 4..3 * width / 4).contains(&(i % width)) {
            (0..4).for_each(|c| sum[c] += f64::from(pixel[c]));
        } else {
            // A mean of many samples is rounded as often.
            let differs = (0..4).any(|c| (pixel[c] - vacuum[c]).abs() > 1e-6);
            assert!(!differs, "{way}: vacuum, pixel {i}: {pixel:?}");
        }
    }
    sum.map(|sum| sum / (width * height / 2) as f64)
}

#[test]
fn a_color_behind_is_attenuated_channel_by_channel() {
    let color = [0.1, 0.2, 0.3];
    for (way, error, pixels) in pictures(Background::Color(color)) {
        let [r, g, b] = color.map(|c| c as f32);
        let slab = slab_beside([r, g, b, 0.0], way, &pixels);
        println!("{way}: {slab:?}");
        for c in 0..3 {
            let share = slab[c] / color[c];
            assert!((share - (-DEPTH).exp()).abs() < error, "{way}: {slab:?}");
        }
    }
}

#[test]
fn over_a_transparent_background_only_alpha_is_left() {
    for (way, error, pixels) in pictures(Background::Transparent) {
        let [r, g, b, alpha] = slab_beside([0.0; 4], way, &pixels);
        println!("{way}: {alpha}");
        assert_eq!([r, g, b], [0.0; 3], "{way}");
        assert!((alpha + (-DEPTH).exp_m1()).abs() < error, "{way}: {alpha}");
    }
}
