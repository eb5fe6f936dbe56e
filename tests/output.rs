//! What is written: pictures, statistics, traces, progress; and that nothing is written by halves.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::Path;
use std::sync::{Arc, Mutex};

use exr::prelude::{AttributeValue, FlatSamples, Text, read_first_flat_layer_from_file};
use isolume::error::Error;
use isolume::output::progress::{Goal, Progress};
use isolume::output::stats::{CacheStats, MemoryStats, PassStats, ResourceStats, Stats};
use isolume::output::trace::Trace;
use isolume::output::{Format, Outputs, Picture, Provenance, check_writable, write_exr, write_png};
use isolume::scene::Tone;
use serde_json::{Value, json};
use tempfile::TempDir;

/// One row of pixels.
fn row(rgb: &[[f32; 3]], alpha: Option<&[f32]>) -> Picture {
    let layer = |offset: f32| rgb.iter().map(|p| p.map(|v| v + offset)).collect();
    Picture {
        width: rgb.len() as u32,
        height: 1,
        rgb: rgb.to_vec(),
        alpha: alpha.map(<[f32]>::to_vec),
        stderr: layer(10.0),
        albedo: layer(20.0),
        normal: layer(30.0),
        depth: (0..rgb.len())
            .map(|i| [f32::INFINITY, 1.5][i % 2])
            .collect(),
    }
}

fn names_in(folder: &TempDir) -> Vec<String> {
    let entries = fs::read_dir(folder.path()).unwrap();
    let mut names: Vec<_> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn an_exr_holds_every_layer_bit_by_bit() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("a.exr");
    let picture = row(&[[0.1, 0.2, 0.3], [1e-30, 7e9, -0.0]], Some(&[0.25, 1.0]));
    let scene = "[volume]\npath = \"頭部 é.nrrd\"\n";
    write_exr(
        &path,
        &picture,
        &Provenance {
            scene: scene.into(),
            seed: 7,
            device: "a device".into(),
            software: "isolume 1.2".into(),
        },
    )
    .unwrap();

    let image = read_first_flat_layer_from_file(&path).unwrap();
    let attributes = &image.layer_data.attributes;
    let utf8 = |text: &Text| String::from_utf8(text.as_slice().to_vec()).unwrap();
    match &attributes.other[&Text::from("isolume.scene")] {
        AttributeValue::Text(text) => assert_eq!(utf8(text), scene),
        other => panic!("the scene is {other:?}"),
    }
    let comments = attributes.comments.as_ref().map(utf8);
    assert_eq!(comments.as_deref(), Some("seed 7\ndevice a device"));
    let software = attributes.software_name.as_ref().map(utf8);
    assert_eq!(software.as_deref(), Some("isolume 1.2"));

    let bits = |values: Vec<f32>| values.into_iter().map(f32::to_bits).collect::<Vec<_>>();
    let component = |layer: &[[f32; 3]], c: usize| layer.iter().map(|p| p[c]).collect();
    let mut expected = vec![("A".to_owned(), bits(vec![0.25, 1.0]))];
    for (prefix, names, layer) in [
        ("", "RGB", &picture.rgb),
        ("stderr.", "RGB", &picture.stderr),
        ("albedo.", "RGB", &picture.albedo),
        ("normal.", "XYZ", &picture.normal),
    ] {
        for (c, name) in names.chars().enumerate() {
            expected.push((format!("{prefix}{name}"), bits(component(layer, c))));
        }
    }
    expected.push(("depth.Z".to_owned(), bits(vec![f32::INFINITY, 1.5])));
    expected.sort();
    let channels = &image.layer_data.channel_data.list;
    let found: Vec<_> = channels
        .iter()
        .map(|channel| match &channel.sample_data {
            FlatSamples::F32(values) => (channel.name.to_string(), bits(values.clone())),
            other => panic!("{} is {other:?}", channel.name),
        })
        .collect();
    assert_eq!(found, expected);
}

#[test]
fn an_opaque_exr_has_no_alpha() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("a.exr");
    write_exr(&path, &row(&[[1.0; 3]], None), &Provenance::default()).unwrap();
    let image = read_first_flat_layer_from_file(&path).unwrap();
    assert_eq!(image.layer_data.channel_data.list.len(), 13);
}

fn png_bytes(picture: &Picture, exposure: f64, tone: Tone) -> (image::ColorType, Vec<u8>) {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("a.png");
    write_png(&path, picture, exposure, tone).unwrap();
    let image = image::open(&path).unwrap();
    (image.color(), image.into_bytes())
}

#[test]
fn png_is_exposed_clipped_and_rounded() {
    // sRGB of 0.5 is 187.516 / 255, of 0.25 136.96 / 255, of 0.001 3.29 / 255.
    let picture = row(
        &[[0.0, 0.25, 0.5], [1.0, 2.0, -1.0], [0.001, 1e30, 0.5]],
        None,
    );
    let (color, bytes) = png_bytes(&picture, 0.0, Tone::Linear);
    assert_eq!(color, image::ColorType::Rgb8);
    assert_eq!(bytes, [0, 137, 188, 255, 255, 0, 3, 255, 188]);
    let (_, brighter) = png_bytes(&picture, 1.0, Tone::Linear);
    assert_eq!(brighter[..3], [0, 188, 255]);
}

#[test]
fn filmic_png_follows_the_published_curve() {
    // Narkowicz's curve gives 0.26690 at 0.18, 0.80380 at 1 and 0.98528 at 5.
    let picture = row(&[[0.0, 0.18, 1.0], [5.0, 1e30, -1.0]], None);
    let (_, bytes) = png_bytes(&picture, 0.0, Tone::Filmic);
    assert_eq!(bytes, [0, 141, 232, 253, 255, 0]);
}

#[test]
fn a_transparent_png_has_straight_colours() {
    let picture = row(&[[0.125, 0.25, 0.0], [0.3, 0.3, 0.3]], Some(&[0.25, 0.0]));
    let (color, bytes) = png_bytes(&picture, 0.0, Tone::Linear);
    assert_eq!(color, image::ColorType::Rgba8);
    assert_eq!(bytes, [188, 255, 0, 64, 0, 0, 0, 0]);
}

#[test]
fn relative_error_is_rms_over_mean() {
    let mut picture = row(&[[1.0, 2.0, 3.0], [2.0, 2.0, 2.0]], None);
    picture.stderr = vec![[0.3, 0.0, 0.0], [0.0, 0.0, 0.3]];
    let expected = (2.0 * 0.09_f64 / 6.0).sqrt() / 2.0;
    assert!((picture.relative_error() - expected).abs() < 1e-7);
    picture.stderr.fill([0.0; 3]);
    picture.rgb.fill([0.0; 3]);
    assert_eq!(picture.relative_error(), 0.0);
}

#[test]
fn formats_go_by_extension() {
    assert_eq!(Format::of(Path::new("a.EXR")).unwrap(), Format::Exr);
    assert_eq!(Format::of(Path::new("a.b.png")).unwrap(), Format::Png);
    for name in ["a.jpg", "exr", ".png"] {
        let error = Format::of(Path::new(name)).unwrap_err();
        assert!(matches!(error, Error::Usage(_)));
        let message = error.to_string();
        assert!(message.contains(name) && message.contains(".exr") && message.contains(".png"));
    }
}

#[test]
fn a_failure_leaves_nothing_of_any_output() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("old.json"), "old").unwrap();
    let picture = row(&[[1.0; 3]], None);
    {
        let mut outputs = Outputs::default();
        outputs
            .exr(
                &folder.path().join("a.exr"),
                &picture,
                &Provenance::default(),
            )
            .unwrap();
        outputs
            .json(&folder.path().join("old.json"), &json!({}))
            .unwrap();
        let full = outputs.stage(&folder.path().join("b.png"), |file| {
            file.write_all(b"half")?;
            Err(ErrorKind::StorageFull.into())
        });
        let message = full.unwrap_err().to_string();
        assert!(message.contains("b.png"), "{message}");
    }
    assert_eq!(names_in(&folder), ["old.json"]);
    assert_eq!(
        fs::read_to_string(folder.path().join("old.json")).unwrap(),
        "old"
    );
}

#[test]
fn commit_names_every_output_and_nothing_else() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("s.json"), "old").unwrap();
    let picture = row(&[[1.0; 3]], None);
    let mut outputs = Outputs::default();
    outputs
        .exr(
            &folder.path().join("a.exr"),
            &picture,
            &Provenance::default(),
        )
        .unwrap();
    outputs
        .png(&folder.path().join("a.png"), &picture, 0.0, Tone::Linear)
        .unwrap();
    outputs
        .json(&folder.path().join("s.json"), &json!({"spp": 1}))
        .unwrap();
    outputs
        .text(&folder.path().join("r.md"), "# Report\n")
        .unwrap();
    assert!(
        !folder.path().join("a.exr").exists(),
        "named before all were written"
    );
    outputs.commit().unwrap();
    assert_eq!(names_in(&folder), ["a.exr", "a.png", "r.md", "s.json"]);
    let stats: Value =
        serde_json::from_slice(&fs::read(folder.path().join("s.json")).unwrap()).unwrap();
    assert_eq!(stats, json!({"spp": 1}));
}

#[test]
fn unusable_places_are_named_before_anything_is_written() {
    let folder = TempDir::new().unwrap();
    let missing = folder.path().join("none/a.exr");
    let message = check_writable(&missing).unwrap_err().to_string();
    assert!(
        message.contains("none does not exist; create it"),
        "{message}"
    );
    let message = check_writable(folder.path()).unwrap_err().to_string();
    assert!(message.contains("is a folder"), "{message}");
    check_writable(&folder.path().join("a.exr")).unwrap();
    assert_eq!(names_in(&folder), [""; 0]);
}

#[cfg(unix)]
#[test]
fn outputs_have_ordinary_permissions_and_keep_links_and_pipes() {
    use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name);
    let text = |name: &str| {
        let mut outputs = Outputs::default();
        outputs.text(&at(name), "text").unwrap();
        outputs.commit().unwrap();
    };

    File::create(at("ordinary")).unwrap();
    text("ours");
    let mode = |name: &str| at(name).metadata().unwrap().permissions().mode();
    assert_eq!(mode("ours"), mode("ordinary"));

    symlink("ordinary", at("link")).unwrap();
    text("link");
    assert!(at("link").is_symlink());
    assert_eq!(fs::read_to_string(at("ordinary")).unwrap(), "text");

    assert!(
        std::process::Command::new("mkfifo")
            .arg(at("pipe"))
            .status()
            .unwrap()
            .success()
    );
    let pipe = at("pipe");
    let reader = std::thread::spawn(move || fs::read_to_string(pipe).unwrap());
    text("pipe");
    assert!(at("pipe").metadata().unwrap().file_type().is_fifo());
    assert_eq!(reader.join().unwrap(), "text");
}

#[test]
fn stats_have_the_keys_that_scripts_rely_on() {
    let runs: Vec<f64> = (1..=21).rev().map(f64::from).collect();
    let stats = Stats {
        passes: vec![PassStats::from_runs("track", &runs)],
        memory: MemoryStats {
            resources: vec![ResourceStats {
                name: "volume".to_owned(),
                bytes: 8,
            }],
            ..MemoryStats::default()
        },
        lookups_per_path: f64::NAN,
        relative_error: f64::INFINITY,
        ..Stats::default()
    };
    let mut found = serde_json::to_value(&stats).unwrap();
    assert_eq!(
        found,
        json!({
            "variant": "", "reason": "", "device": "", "driver": "", "spp": 0, "seed": 0,
            "wall_s": 0.0, "first_frame_s": 0.0,
            "passes": [{
                "name": "track", "runs": 21,
                "gpu_ms_median": 11.0, "gpu_ms_p95": 20.0, "gpu_ms_total": 231.0
            }],
            "stages": [],
            "memory": {
                "budget_bytes": 0, "planned_bytes": 0, "peak_bytes": 0,
                "resources": [{"name": "volume", "bytes": 8}]
            },
            "paths": 0, "lookups_per_path": null, "relative_error": null, "views": []
        })
    );

    let cache = CacheStats {
        dims: [1, 2, 3],
        format: "f16".to_owned(),
        bytes: 48,
        cells: 6,
        active_cells: 5,
        updates_per_cell: 2.0,
        relative_error: 0.5,
        converged: false,
        seconds_to_converge: None,
    };
    found = serde_json::to_value(Stats {
        cache: Some(cache),
        ..stats
    })
    .unwrap();
    assert_eq!(
        found["cache"],
        json!({
            "dims": [1, 2, 3], "format": "f16", "bytes": 48, "cells": 6, "active_cells": 5,
            "updates_per_cell": 2.0, "relative_error": 0.5, "converged": false,
            "seconds_to_converge": null
        })
    );
}

#[test]
fn a_median_lies_between_two_runs_and_is_missing_without_any() {
    assert_eq!(
        PassStats::from_runs("twice", &[3.0, 1.0]).gpu_ms_median,
        2.0
    );
    let stats = serde_json::to_value(PassStats::from_runs("idle", &[])).unwrap();
    assert_eq!(stats["runs"], 0);
    assert_eq!(stats["gpu_ms_total"], 0.0);
    assert!(stats["gpu_ms_median"].is_null());
}

#[test]
fn a_trace_has_one_track_for_each_processor_and_a_memory_counter() {
    let mut trace = Trace::default();
    trace.add_gpu("track", 10.0, 5.5);
    trace.add_cpu("load", 0.0, 9.0);
    trace.add_memory(3.0, 4096);
    let trace = serde_json::to_value(&trace).unwrap();
    let events = trace["traceEvents"].as_array().unwrap();
    let phase = |ph: &str| {
        events
            .iter()
            .filter(|event| event["ph"] == ph)
            .collect::<Vec<_>>()
    };

    let complete = phase("X");
    assert_eq!(complete.len(), 2);
    let (gpu, cpu) = (complete[0], complete[1]);
    assert_eq!(
        (&gpu["name"], &gpu["ts"], &gpu["dur"]),
        (&json!("track"), &json!(10.0), &json!(5.5))
    );
    assert_eq!(
        (&cpu["name"], &cpu["ts"], &cpu["dur"]),
        (&json!("load"), &json!(0.0), &json!(9.0))
    );
    let track_name = |event: &Value| {
        let named = |meta: &&&Value| meta["name"] == "thread_name" && meta["tid"] == event["tid"];
        phase("M").iter().find(named).unwrap()["args"]["name"].clone()
    };
    assert_eq!(track_name(gpu), "GPU passes");
    assert_eq!(track_name(cpu), "CPU stages");

    let memory = phase("C");
    assert_eq!(memory[0]["args"], json!({"bytes": 4096}));
    assert!(events.iter().all(|event| event["pid"] == gpu["pid"]));
}

#[test]
fn the_goal_that_comes_first_decides_what_remains() {
    let spp = Goal {
        spp: Some(100),
        ..Goal::default()
    };
    assert_eq!(spp.remaining(25, 10.0, f64::NAN), Some(30.0));
    let error = Goal {
        relative_error: Some(0.02),
        ..Goal::default()
    };
    // Half the error takes four times as long.
    assert_eq!(error.remaining(1, 10.0, 0.04), Some(30.0));
    assert_eq!(error.remaining(1, 10.0, 0.01), Some(0.0));
    assert_eq!(error.remaining(1, 10.0, f64::INFINITY), None);
    let both = Goal {
        seconds: Some(35.0),
        ..error
    };
    assert_eq!(both.remaining(1, 10.0, 0.04), Some(25.0));
    assert_eq!(both.remaining(1, 10.0, f64::NAN), Some(25.0));
    assert_eq!(spp.remaining(0, 0.0, f64::NAN), None);
}

#[derive(Clone, Default)]
struct Log(Arc<Mutex<Vec<u8>>>);

impl Write for Log {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_log_gets_a_line_every_ten_seconds() {
    let log = Log::default();
    let goal = Goal {
        seconds: Some(60.0),
        ..Goal::default()
    };
    let mut progress = Progress::log(goal, Box::new(log.clone()));
    for second in 0..25 {
        progress.update(second * 4, second as f64, 0.5);
    }
    progress.finish();
    let lines = String::from_utf8(log.0.lock().unwrap().clone()).unwrap();
    let expected = "40 spp, relative error 0.5000, 00:00:50 left\n\
                    80 spp, relative error 0.5000, 00:00:40 left\n";
    assert_eq!(lines, expected);
}
