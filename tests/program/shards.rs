//! Shards of a picture merge to what a single run renders, in whatever order they are given.

use std::process::Command;

use exr::prelude::FlatImage;

use crate::checkpoints::shard_header;
use crate::refusals::refused;
use crate::{Folder, ended, last_line, text};

const SHARDS: [&str; 4] = ["0..32", "32..100", "100..128", "128..256"];
const NAMES: [&str; 4] = ["a.exr", "b.exr", "c.exr", "d.exr"];

fn render_shards(folder: &Folder, flags: &str) {
    for (name, range) in NAMES.into_iter().zip(SHARDS) {
        folder.succeed(&format!(
            "render ball.toml {flags} --samples {range} -o {name}"
        ));
    }
}

pub fn channel(image: &FlatImage, name: &str) -> Vec<f64> {
    let channels = &image.layer_data[0].channel_data.list;
    let found = channels.iter().find(|channel| channel.name.eq(name));
    let samples = &found.unwrap_or_else(|| panic!("{name}")).sample_data;
    samples.values_as_f32().map(f64::from).collect()
}

/// The largest difference of two pictures relative to the first one's mean, of the channels with a prefix.
pub fn difference(a: &FlatImage, b: &FlatImage, prefix: &str) -> f64 {
    let channels = |image| {
        ["R", "G", "B"]
            .map(|c| channel(image, &format!("{prefix}{c}")))
            .concat()
    };
    let [a, b] = [a, b].map(channels);
    let largest = a
        .iter()
        .zip(&b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    largest / (a.iter().sum::<f64>() / a.len() as f64)
}

#[test]
fn shards_merge_to_the_picture_of_a_single_run() {
    let folder = Folder::new();
    render_shards(&folder, "--variant non-caching");
    folder.succeed("render ball.toml --variant non-caching --spp 256 -o single.exr");
    let mut merged = None;
    for order in orders() {
        let names = order.map(|i| NAMES[i]).join(" ");
        folder.succeed(&format!("merge merged.exr {names}"));
        let bytes = folder.read("merged.exr");
        assert!(*merged.get_or_insert(bytes.clone()) == bytes, "{names}");
    }
    // The name of the file to write was forgotten.
    let said = refused(&folder, "merge a.exr b.exr c.exr d.exr", 3);
    assert!(
        said.contains("a.exr: it holds the samples 0..32 of this picture, which would be lost"),
        "{said}"
    );
    let [single, merged] = ["single.exr", "merged.exr"].map(|name| folder.exr(name));
    let [mean, stderr] = ["", "stderr."].map(|prefix| difference(&single, &merged, prefix));
    println!("mean differs by {mean:.1e} of the mean, standard error by {stderr:.1e} of its own");
    assert!(mean <= 1e-6 && stderr <= 0.01, "{mean:.1e} {stderr:.1e}");
    let render = "render ball.toml --variant non-caching";
    folder.succeed(&format!("{render} --samples 512..528 -o short.exr"));
    let errors = channel(&folder.exr("short.exr"), "stderr.R");
    assert!(
        errors.iter().all(|error| error.is_finite()),
        "a short shard does not know its error"
    );
    for layer in ["albedo.R", "normal.Z", "depth.Z"] {
        assert_eq!(channel(&single, layer), channel(&merged, layer));
    }

    // What has been merged is a shard again.
    folder.succeed("merge early.exr b.exr a.exr");
    folder.succeed("merge late.exr d.exr c.exr");
    folder.succeed("merge both.exr late.exr early.exr");
    let both = folder.exr("both.exr");
    assert!(difference(&both, &merged, "") <= 1e-6);
    let output = folder.succeed("merge gap.exr a.exr c.exr");
    let said = text(&output.stderr);
    assert!(
        said.contains("note: the samples 32..100 are in none of the files"),
        "{said}"
    );
    assert!(
        said.contains("60 samples per pixel (0..32, 100..128)"),
        "{said}"
    );
}

fn orders() -> Vec<[usize; 4]> {
    let all = (0..256).map(|n| [n & 3, n >> 2 & 3, n >> 4 & 3, n >> 6]);
    all.filter(|order| (0..4).all(|i| order.contains(&i)))
        .collect()
}

#[test]
fn a_transparent_picture_keeps_its_coverage() {
    let folder = Folder::new();
    let render = "render ball.toml --variant non-caching --set render.background=transparent";
    folder.succeed(&format!("{render} --samples 0..64 -o single.exr"));
    for (name, range) in [("a.exr", "0..32"), ("b.exr", "32..64")] {
        folder.succeed(&format!("{render} --samples {range} -o {name}"));
    }
    folder.succeed("merge merged.exr a.exr b.exr");
    folder.succeed(&format!(
        "{render} --samples 0..32 -o c.exr --checkpoint kept.exr"
    ));
    folder.succeed(&format!(
        "{render} --samples 0..64 -o continued.exr --checkpoint kept.exr"
    ));
    let single = folder.exr("single.exr");
    let coverage = channel(&single, "A");
    assert!(coverage.iter().any(|a| (0.1..0.9).contains(a)));
    let continued = folder.exr("continued.exr");
    let merged = folder.exr("merged.exr");
    assert_eq!(coverage, channel(&continued, "A"));
    let largest = coverage
        .iter()
        .zip(channel(&merged, "A"))
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    assert!(largest <= 1e-6, "{largest:.1e}");
    assert!(difference(&single, &continued, "") == 0.0);
    let apart = difference(&single, &merged, "");
    assert!(apart <= 2e-6, "{apart:.1e}");
}

/// Samples that correct the cache's light may be below 0. A picture is not, but goes on from what was sampled.
#[test]
fn a_shard_may_have_sampled_less_than_nothing() {
    let folder = Folder::new();
    let sun = "{type=\"directional\",direction=[0.3,-1,-0.4],irradiance=[3,3,3]}";
    let render = format!(
        "render ball.toml --set surfaces.iso=[] --set medium.g=0 --set medium.density=2 --set light=[{sun}] \
         --variant caching --cache-scale 1 --size 48x48"
    );
    folder.succeed(&format!("{render} --samples 0..1 -o a.exr"));
    folder.succeed("merge merged.exr a.exr");
    let merged = folder.exr("merged.exr");
    let least = |prefix: &str| {
        let channels = ["R", "G", "B"].map(|c| channel(&merged, &format!("{prefix}{c}")));
        channels.concat().into_iter().fold(f64::INFINITY, f64::min)
    };
    assert!(least("mean.") < 0.0);
    assert_eq!(least(""), 0.0);
}

/// Equal numbers of samples fill a cache in the same way.
#[test]
fn shards_through_one_filling_count_its_error_once() {
    let folder = Folder::new();
    let cached = "render ball.toml --variant caching --cache-scale 0.5";
    for (name, range) in [
        ("a.exr", "0..64"),
        ("b.exr", "64..128"),
        ("c.exr", "128..144"),
    ] {
        folder.succeed(&format!("{cached} --samples {range} -o {name}"));
    }
    let one = folder.succeed("merge ab.exr a.exr b.exr");
    assert!(!text(&one.stderr).contains("fillings"), "{one:?}");
    let two = folder.succeed("merge abc.exr a.exr b.exr c.exr");
    let said = text(&two.stderr);
    assert!(
        said.contains("the shards read 2 fillings of the cache"),
        "{said}"
    );
    let error = |name: &str| channel(&folder.exr(name), "stderr.G").iter().sum::<f64>();
    assert!(error("ab.exr") < error("a.exr"));
    // A few more samples, of whose spread nothing is known, do not make the others independent.
    folder.succeed(&format!("{cached} --samples 128..132 -o d.exr"));
    folder.succeed("merge abd.exr a.exr b.exr d.exr");
    println!(
        "{:.4} {:.4} {:.4}",
        error("a.exr"),
        error("ab.exr"),
        error("abd.exr")
    );
    assert!(error("abd.exr") < 1.1 * error("ab.exr"));
}

#[test]
fn what_does_not_belong_together_is_not_merged() {
    let folder = Folder::new();
    let render = |flags: &str, name: &str| {
        folder.succeed(&format!(
            "render ball.toml --variant non-caching {flags} -o {name}"
        ));
    };
    render("--samples 0..8", "a.exr");
    render("--samples 8..16 --seed 1", "seed.exr");
    render("--samples 8..16", "rest.exr");
    render("--samples 8..16 --size 24x17", "size.exr");
    render("--samples 8..16 --set medium.g=0.25", "scene.exr");
    render("--samples 4..16", "overlap.exr");
    render("--spp 8", "plain.exr");
    folder.succeed("render ball.toml --variant caching --samples 8..16 -o variant.exr");
    let mut voxels = folder.read("ball_16x16x16_uint8.raw");
    voxels[2000] ^= 1;
    folder.write("ball_16x16x16_uint8.raw", &voxels);
    render("--samples 8..16", "volume.exr");
    let whole = folder.read("rest.exr");
    folder.write("short.exr", &whole[..whole.len() / 2]);
    let mut damaged = whole.clone();
    let end = damaged.len() - 1;
    damaged[end] ^= 0x10;
    folder.write("damaged.exr", &damaged);
    for (other, expected) in [
        (
            "seed.exr",
            "it is of another picture than a.exr: the seed is 0 in a.exr and 1 in seed.exr",
        ),
        (
            "size.exr",
            "the size is 24x16 in a.exr and 24x17 in size.exr",
        ),
        (
            "scene.exr",
            "medium.g is 0.3 in a.exr and 0.25 in scene.exr",
        ),
        (
            "variant.exr",
            "the variant is non-caching in a.exr and caching at scale",
        ),
        ("volume.exr", "the volume in a.exr has other voxels"),
        ("overlap.exr", "it holds the samples 4..8, as does"),
        ("a.exr", "it holds the samples 0..8, as does"),
        (
            "plain.exr",
            "plain.exr: it is neither a shard nor a checkpoint",
        ),
        ("short.exr", "short.exr: "),
        ("damaged.exr", "damaged.exr: it is damaged"),
        ("missing.exr", "missing.exr: "),
        ("ball.toml", "ball.toml: not readable as OpenEXR"),
    ] {
        let said = refused(&folder, &format!("merge out.exr a.exr {other}"), 3);
        assert!(said.contains(expected), "{other}: {said}");
        assert_eq!(said.lines().count(), 1, "{said}");
    }
}

#[test]
fn a_merged_picture_takes_the_place_of_no_shard() {
    let folder = Folder::new();
    folder.succeed("render ball.toml --variant non-caching --size 8x8 --samples 0..4 -o a.exr");
    let before = folder.read("a.exr");
    let said = refused(&folder, "merge a.exr a.exr", 2);
    assert!(said.contains("this file is read"), "{said}");
    assert_eq!(folder.read("a.exr"), before);
}

/// Not those of the views before.
#[test]
fn a_shard_of_an_orbit_counts_its_own_paths() {
    let folder = Folder::new();
    folder.succeed(
        "render ball.toml --variant non-caching --size 8x8 --orbit 3 --samples 0..4 -o o.exr",
    );
    for file in ["o.0001.exr", "o.0003.exr"] {
        assert_eq!(shard_header(&folder, file)["paths"], 8 * 8 * 4, "{file}");
    }
}

/// A single sample does not tell its error.
#[test]
fn an_unknown_error_is_called_so() {
    let folder = Folder::new();
    folder.succeed("render ball.toml --variant non-caching --samples 0..1 -o a.exr");
    let merged = folder.succeed("merge m.exr a.exr");
    assert!(
        last_line(&merged).contains("relative error unknown"),
        "{merged:?}"
    );
}

#[test]
fn a_range_of_samples_is_all_that_counts() {
    let folder = Folder::new();
    for flags in ["--spp 4", "--time 1", "--error 0.1"] {
        refused(
            &folder,
            &format!("render ball.toml -o a.exr --samples 0..4 {flags}"),
            2,
        );
    }
    for range in ["4", "4..4", "4..2", "0..16777217", "-1..2", "a..b"] {
        refused(
            &folder,
            &format!("render ball.toml -o a.exr --samples {range}"),
            2,
        );
    }
    let published = "render ball.toml -o a.exr --variant published --samples 0..4";
    let said = refused(&folder, published, 3);
    assert!(said.contains("has no samples by number"), "{said}");
    let output = folder.succeed("render ball.toml -o a.exr --samples 3..10");
    assert!(text(&output.stderr).contains("stopped because --samples 3..10 are done"));
}

/// What a cluster does for each task of an array, without one.
#[cfg(unix)]
#[test]
fn tasks_of_an_array_render_what_merges_to_one_picture() {
    let folder = Folder::new();
    let slurm = concat!(env!("CARGO_MANIFEST_DIR"), "/tools/slurm");
    let script = |words: &str, task: u32| {
        let mut command = Command::new("bash");
        command
            .args(format!("{slurm}/{words}").split(' '))
            .current_dir(folder.path(""))
            .env("ISOLUME", env!("CARGO_BIN_EXE_isolume"))
            .env("SLURM_ARRAY_TASK_ID", task.to_string())
            .env("SLURMD_NODENAME", "here");
        let output = ended(&mut command);
        assert!(output.status.success(), "{words}, {task}: {output:?}");
    };
    for task in 0..3 {
        script(
            "shard ball.toml head 100 3 --variant non-caching --quiet",
            task,
        );
    }
    script("merge head", 0);
    folder.succeed("render ball.toml --variant non-caching --spp 100 -o single.exr");
    let [single, merged] = ["single.exr", "head.exr"].map(|name| folder.exr(name));
    assert!(difference(&single, &merged, "") < 1e-6);
}
