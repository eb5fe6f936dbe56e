//! `caching` against `non-caching`: tiles of the same picture, from volumes that were measured.

use std::path::Path;

use isolume::render::Film;
use isolume::scene::preset::Preset;
use isolume::scene::volume::Volume;
use isolume::scene::*;

use crate::support::common::{cached, render};

const TILE: usize = 16;

struct Setting {
    /// Of a scene in `tests/references`.
    scene: &'static str,
    edits: &'static [&'static str],
    /// Paths a node, of a young cache and of a grown one.
    updates: [u32; 2],
    /// Samples a pixel of either variant.
    at_rest: u32,
    reference: u32,
}

fn open(setting: &Setting, more: &[String]) -> (Scene, Volume) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/references");
    let own = setting.edits.iter().map(|e| e.to_string());
    let edits: Vec<Edit> = own
        .chain(more.iter().cloned())
        .map(|e| e.parse().expect("an edit"))
        .collect();
    let path = folder.join(setting.scene).with_extension("toml");
    let opened = isolume::scene::open(&path, Preset::Auto, &edits, Volume::load).expect("a scene");
    (opened.scene, opened.volume)
}

/// Of each tile and channel: relative difference of the means, and its standard error's square.
fn differences(test: &Film, reference: &Film, width: usize) -> Vec<(f64, f64)> {
    let height = test.mean.len() / width;
    let mut differences = Vec::new();
    for y in (0..height).step_by(TILE) {
        for x in (0..width).step_by(TILE) {
            let pixels = (y..y + TILE).flat_map(|j| (x..x + TILE).map(move |i| j * width + i));
            let pixels: Vec<usize> = pixels.collect();
            for c in 0..3 {
                let mean = |film: &Film| pixels.iter().map(|&p| f64::from(film.mean[p][c])).sum();
                let (a, b): (f64, f64) = (mean(test), mean(reference));
                let variance: f64 = pixels
                    .iter()
                    .map(|&p| f64::from(reference.stderr[p][c]).powi(2))
                    .sum();
                differences.push(((a - b) / b, variance / (b * b)));
            }
        }
    }
    differences
}

/// RMS over tiles of the relative difference, without what the reference's own noise adds to it; and of that noise.
fn tile_rmse(test: &Film, reference: &Film, width: usize) -> [f64; 2] {
    let differences = differences(test, reference, width);
    let count = differences.len() as f64;
    let excess: f64 = differences.iter().map(|(d, noise)| d * d - noise).sum();
    let noise: f64 = differences.iter().map(|(_, noise)| noise).sum();
    [excess.max(0.0), noise].map(|sum| (sum / count).sqrt())
}

fn assert_agrees(setting: Setting) {
    for light in ["local", "full"] {
        // With g = ½, paths read the cache from their third collision on.
        for g in [0.0, 0.5] {
            let edits = [
                format!("medium.g={g}"),
                format!("surfaces.light=\"{light}\""),
            ];
            let (scene, volume) = open(&setting, &edits);
            let width = scene.render.size[0] as usize;
            let reference = render(&scene, &volume, 16, setting.reference / 16, 1);
            let format = CacheFormat::F16;
            let mut cache = cached(&scene, &volume, 1.0, format, 0, 2);
            for (updates, limit) in setting.updates.into_iter().zip([0.01, 0.005]) {
                // Where paths read the cache late, most of the difference is their own noise.
                let limit = if g == 0.0 { limit } else { 0.008 };
                cache.fill(updates);
                cache.renderer.begin_picture();
                let film = cache.at_rest(16, setting.at_rest / 16);
                let [rmse, noise] = tile_rmse(&film, &reference, width);
                println!(
                    "{:<8} {light:<5} g {g:<4} tile RMSE {:.2} % (at most {:.1} %, noise {:.2} %) after {updates}",
                    setting.scene,
                    100.0 * rmse,
                    100.0 * limit,
                    100.0 * noise
                );
                assert!(noise < 0.5 * limit, "the reference is noisy: {noise}");
                assert!(rmse <= limit, "{}, {light}, g = {g}: {rmse}", setting.scene);
            }
        }
    }
}

#[test]
fn blobs() {
    assert_agrees(Setting {
        scene: "blobs",
        edits: &[
            "render.size=[48, 48]",
            "volume.crop=[[8, 8, 8], [32, 32, 32]]",
        ],
        updates: [8, 64],
        at_rest: 64,
        reference: 192,
    });
}

#[test]
fn tissue() {
    assert_agrees(Setting {
        scene: "tissue",
        edits: &[
            "render.size=[48, 48]",
            "surfaces.iso=[{ value = 150.0, opacity = 0.5 }]",
        ],
        updates: [8, 64],
        at_rest: 64,
        reference: 192,
    });
}

/// Its light is curved within a cell: interpolation alone would lose two percent of it at half scale, and a picture at rest
/// reads most of that back. The cache's own noise is 0.2 % in the mean of the picture.
#[test]
fn a_dense_cloud() {
    for (scale, updates) in [(1.0, [32, 128]), (0.5, [256, 512])] {
        let setting = Setting {
            scene: "cloud",
            edits: &["render.size=[48, 48]"],
            updates,
            at_rest: 64,
            reference: 256,
        };
        let (scene, volume) = open(&setting, &[]);
        let reference = render(&scene, &volume, 16, setting.reference / 16, 1);
        let format = CacheFormat::F16;
        let sum = |film: &Film| -> f64 {
            let radiance = film.mean.iter().flat_map(|pixel| &pixel[..3]);
            radiance.map(|&x| f64::from(x)).sum()
        };
        let mut cache = cached(&scene, &volume, scale, format, 0, 2);
        for updates in setting.updates {
            cache.fill(updates);
            let marched = Film::marched(cache.march());
            cache.renderer.begin_picture();
            let film = cache.at_rest(16, setting.at_rest / 16);
            let [moving, bias] = [&marched, &film].map(|film| sum(film) / sum(&reference) - 1.0);
            println!(
                "cloud, scale {scale}: bias {:+.2} %, in motion {:+.2} % after {updates}",
                100.0 * bias,
                100.0 * moving
            );
            assert!(bias.abs() < 0.0075, "{bias}");
            assert!(moving.abs() < 0.01, "in motion: {moving}");
        }
    }
}
