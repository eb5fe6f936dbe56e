//! Small shards and checkpoints, as a render would have written them.

use isolume::Picture;
use isolume::engine::SampleRange;
use isolume::output::{Continuation, Outputs, Provenance};
use isolume::render::{Sums, Variant};
use isolume::shard::{Fingerprint, Header, Identity, Manner, RunOf, Settings, State};
use serde_json::{Value, json, to_value};

use crate::folder;

const SIZE: [u32; 2] = [3, 2];
const SCENE: &str = "[medium]\ng = 0.5\n[render]\nsize = [3, 2]\n";

pub fn identity() -> Identity {
    Identity {
        scene: "5".repeat(32),
        volume: "7".repeat(32),
        size: SIZE,
        seed: 1,
        variant: "non-caching".into(),
        transport: "0.1.0-1".into(),
    }
}

/// A shard of these samples as bytes of an EXR. `is_quick`: without compression.
pub fn shard(first: u32, end: u32, is_quick: bool) -> Vec<u8> {
    let header = header(first, end);
    exr(&to_value(header).expect("JSON"), is_quick)
}

/// A checkpoint as bytes of an EXR.
pub fn checkpoint(end: u32) -> Vec<u8> {
    let state = State {
        header: header(0, end),
        settings: Settings::of(&Variant::NonCaching, "it was asked for"),
        picture: 1,
        pictures: 1,
        manner: Manner::default(),
        written: Vec::new(),
        seconds: 1.0,
        cpu_seconds: 0.0,
        runs: vec![RunOf {
            host: "here".into(),
            device: "a device".into(),
            began: 1,
            seconds: 1.0,
            samples: end,
        }],
    };
    exr(&to_value(state).expect("JSON"), true)
}

/// The header of a cache's file.
pub fn cache_header() -> Value {
    let pace = json!({ "paths": 100, "took": { "secs": 1, "nanos": 0 } });
    json!({
        "identity": identity(),
        "scene": SCENE,
        "settings": Settings::of(&Variant::NonCaching, "it was asked for"),
        "fill": "9".repeat(32),
        "is_filled": true,
        "state": {
            "updates": 4, "batches": 3, "paths": 100, "lookups": 1000, "relative_error": 0.1, "error_at_rest": 0.1,
            "took": { "secs": 1, "nanos": 0 }, "gathering": pace, "tracing": pace,
            "is_wide": false, "all_from": null, "has_looked": true, "bricks": 1, "shown": 6,
            "shown_at_rest": 0,
        },
    })
}

fn header(first: u32, end: u32) -> Header {
    let sums = sums();
    let checksum = Fingerprint::default()
        .with(bytemuck::cast_slice(&sums.mean))
        .with(bytemuck::cast_slice(&sums.squares));
    Header {
        identity: identity(),
        samples: vec![SampleRange { first, end }],
        units: 2,
        paths: 24,
        lookups: 100,
        halves: None,
        fills: Vec::new(),
        devices: vec!["a device".into()],
        checksum: checksum.text(),
    }
}

fn sums() -> Sums {
    let pixels = (SIZE[0] * SIZE[1]) as usize;
    Sums {
        mean: vec![[0.5; 4]; pixels],
        squares: vec![[0.25; 4]; pixels],
        halves: None,
    }
}

fn exr(header: &Value, is_quick: bool) -> Vec<u8> {
    let [width, height] = SIZE;
    let sums = sums();
    let pixels = sums.mean.len();
    let picture = Picture {
        width,
        height,
        // Where the picture is not the mean, the file holds both.
        rgb: vec![[if is_quick { 0.5 } else { 0.0 }; 3]; pixels],
        alpha: None,
        stderr: vec![[0.1; 3]; pixels],
        albedo: vec![[0.0; 3]; pixels],
        normal: vec![[0.0; 3]; pixels],
        depth: vec![f32::INFINITY; pixels],
    };
    let provenance = Provenance {
        scene: SCENE.into(),
        ..Provenance::default()
    };
    let continuation = Continuation::of(&header, &sums).expect("JSON");
    let continuation = if is_quick {
        continuation.quick()
    } else {
        continuation
    };
    let path = folder::path("seed.exr");
    let mut outputs = Outputs::default();
    outputs
        .exr_with(&path, &picture, &provenance, continuation)
        .expect("an EXR");
    outputs.commit().expect("a file");
    std::fs::read(path).expect("the file")
}
