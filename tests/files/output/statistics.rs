//! Statistics and traces as scripts read them.

use isolume::engine::figures::{CacheStats, MemoryStats, PassStats, ResourceStats};
use isolume::output::stats::Stats;
use isolume::output::trace::Trace;
use serde_json::{Value, json};

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
                "gpu_ms_median": 11.0, "gpu_ms_p95": 20.0, "gpu_ms_total": 231.0,
                "peak_share": null
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
    trace.add_gpu("track", 10.0, 5.5, Some(0.25));
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
    assert_eq!(gpu["args"], json!({"peak_share": 0.25}));
    assert!(cpu.get("args").is_none());
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
