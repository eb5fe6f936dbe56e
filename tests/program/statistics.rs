//! What a command says of its cost: `--stats` and `--profile`.

use serde_json::Value;

use crate::number::number;
use crate::{Folder, last_line, text};

#[test]
fn statistics_keep_their_contract() {
    let folder = Folder::new();
    folder.succeed(
        "render ball.toml --variant non-caching -o a.exr --stats s.json --spp 16 --seed 3",
    );
    let stats = folder.json("s.json");
    for key in ["variant", "reason", "device", "driver"] {
        assert!(stats[key].as_str().is_some_and(|s| !s.is_empty()), "{key}");
    }
    assert_eq!(
        (stats["spp"].as_u64(), stats["seed"].as_u64()),
        (Some(16), Some(3))
    );
    assert_eq!(stats["paths"], 16 * 24 * 16);
    assert!(number(&stats["views"][0]["cpu_s"]) > 0.0);
    for key in [
        "wall_s",
        "first_frame_s",
        "lookups_per_path",
        "relative_error",
    ] {
        assert!(number(&stats[key]) > 0.0, "{key}");
    }
    assert!(number(&stats["first_frame_s"]) < number(&stats["wall_s"]));

    let passes = stats["passes"].as_array().expect("passes");
    let tracking = passes.iter().find(|p| p["name"] == "delta_tracking");
    let tracking = tracking.expect("the pass that does the work");
    assert!(number(&tracking["runs"]) >= 16.0);
    let [median, p95, total] =
        ["gpu_ms_median", "gpu_ms_p95", "gpu_ms_total"].map(|key| number(&tracking[key]));
    assert!(0.0 < median && median <= p95 && p95 <= total);
    assert_shares(passes);

    let memory = &stats["memory"];
    let [budget, planned, peak] =
        ["budget_bytes", "planned_bytes", "peak_bytes"].map(|key| number(&memory[key]));
    assert!(
        planned >= peak && planned <= 1.01 * peak && planned <= budget,
        "{memory:#}"
    );
    let resources = memory["resources"].as_array().expect("resources");
    let sum: f64 = resources.iter().map(|r| number(&r["bytes"])).sum();
    assert_eq!(sum, peak);
    assert!(resources.iter().all(|r| r["name"].is_string()));
}

/// The peak is measured within the budget, or not at all.
#[test]
fn a_small_budget_has_no_room_to_measure_the_peak() {
    let folder = Folder::new();
    folder.succeed(
        "render ball.toml --variant non-caching -o a.exr --stats s.json --spp 1 --vram-budget 16MiB",
    );
    let stats = folder.json("s.json");
    let passes = stats["passes"].as_array().expect("passes");
    assert!(!passes.is_empty() && passes.iter().all(|pass| pass["peak_share"].is_null()));
}

/// Each pass has its share of the device's peak.
fn assert_shares(passes: &[Value]) {
    let is_share = |share: f64| 0.0 < share && share <= 1.2;
    let without: Vec<_> = passes
        .iter()
        .filter(|pass| !pass["peak_share"].as_f64().is_some_and(is_share))
        .collect();
    assert!(without.is_empty(), "{without:#?}");
}

#[test]
fn each_pass_of_each_variant_has_its_share_of_the_peak() {
    let folder = Folder::new();
    for options in [
        "--variant caching --set surfaces.light=full --set medium.g=0.5",
        "--variant caching --cache-scale 0.5 --time 0.2",
        "--variant published",
    ] {
        folder.succeed(&format!(
            "render ball.toml {options} -o a.exr --spp 8 --stats s.json"
        ));
        let stats = folder.json("s.json");
        assert_shares(stats["passes"].as_array().expect("passes"));
    }
}

#[test]
fn a_profile_accounts_for_the_wall_time() {
    let folder = Folder::new();
    let render = "render ball.toml --variant caching -o a.exr --time 1";
    let output = folder.succeed(&format!("{render} --stats s.json"));
    let said = text(&output.stderr);
    for name in [
        "open the scene",
        "read and decode the voxels",
        "read headers, find the range",
        "compile",
        "save the pictures",
        "not covered",
        "node_tracking",
        "paths/s",
    ] {
        let named = |line: &str| line.contains(name);
        assert!(said.lines().any(named), "{name}: {said}");
    }
    assert!(last_line(&output).contains("stopped because"), "{said}");

    let stats = folder.json("s.json");
    let sum = |list: &Value, key: &str| -> f64 {
        let entries = list.as_array().expect("a list");
        entries.iter().map(|e| number(&e[key])).sum()
    };
    let wall_ms = 1e3 * number(&stats["wall_s"]);
    let covered = sum(&stats["stages"], "ms");
    assert!((0.95 * wall_ms..=wall_ms).contains(&covered), "{stats:#}");
    let busy = sum(&stats["stages"], "gpu_ms");
    let passes = sum(&stats["passes"], "gpu_ms_total");
    assert!((passes - busy).abs() <= 0.05 * passes, "{stats:#}");

    let silent = folder.succeed(&format!("{render} --stats s.json --quiet"));
    assert_eq!(text(&silent.stderr), "");
    let usual = folder.succeed(render);
    assert!(!text(&usual.stderr).contains("GPU pass"), "{usual:?}");
}
