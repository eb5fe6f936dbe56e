//! The bench: a whole report or none, and figures that follow from each other.

use serde_json::Value;

use crate::folder::Folder;
use crate::number::number;
use crate::refusals::refused;
use crate::{ended, text};

const BENCH: &str = "bench ball.toml -o report --size 24x16";

fn list(value: &Value) -> &[Value] {
    value.as_array().unwrap_or_else(|| panic!("{value}"))
}

#[test]
fn a_report_holds_what_the_contract_names() {
    let folder = Folder::new();
    folder.succeed(&format!(
        "{BENCH} --variants published,non-caching,caching:0.5:f16 --seconds 0.2,1.6 --seed 3"
    ));
    let expected = [
        "caching-0.5-f16.0.2s.exr",
        "caching-0.5-f16.1.6s.exr",
        "caching-0.5-f16.new-view.exr",
        "error_time.svg",
        "non-caching.0.2s.exr",
        "non-caching.1.6s.exr",
        "psnr_time.svg",
        "published.0.2s.exr",
        "published.1.6s.exr",
        "reference-centres.exr",
        "reference.exr",
        "report.json",
        "report.md",
        "similarity_time.svg",
    ];
    assert_eq!(folder.names_in("report"), expected);
    for name in expected.iter().filter(|name| name.ends_with(".exr")) {
        folder.exr(&format!("report/{name}"));
    }
    let page = folder.read("report/report.md");
    for name in ["error_time.svg", "psnr_time.svg", "similarity_time.svg"] {
        let svg = folder.read(&format!("report/{name}"));
        let svg = text(&svg).trim();
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>"), "{name}");
        assert!(text(&page).contains(&format!("({name})")), "{name}");
    }

    let report = folder.json("report/report.json");
    assert_eq!(report["seed"], 3);
    assert!(text(&page).contains(report["command"].as_str().expect("a command")));
    let subject = &report["subjects"][0];
    assert!(number(&subject["reference"]["noise"]["mse"]) > 0.0);
    let runs = list(&subject["runs"]);
    assert_eq!(runs.len(), 3);
    runs.iter().for_each(check_run);
    // Eight times as long is 9 dB less noise; the other variants may be at their bias.
    let uncached = list(&runs[0]["points"]);
    let [first, last] = [0, 1].map(|i| number(&uncached[i]["psnr"]));
    assert!(last > first + 3.0, "{first} dB, then {last} dB");

    let cached = &runs[2];
    assert_eq!(cached["variant"], "caching:0.5:f16");
    let orbit = &cached["orbit"];
    let [median, p99] = ["march_ms_median", "march_ms_p99"].map(|key| number(&orbit[key]));
    assert!(orbit["frames"] == 24 && 0.0 < median && median <= p99);
    assert!(
        number(&cached["bytes_per_active_cell"]) >= 16.0,
        "g is not 0"
    );
    assert!(!list(&cached["new_view"]).is_empty());
    assert!(number(&cached["same_rays"]["psnr"]) > 20.0 && runs[0]["same_rays"].is_null());
    for seen in ["surfaces", "medium"] {
        assert!(number(&cached["bias_apart"][seen]).abs() < 0.1, "{seen}");
    }
    let dragged = list(&cached["isovalue"]["points"]);
    assert!(number(&dragged[0]["psnr"]) > 20.0 && runs[0]["isovalue"].is_null());
    assert!(number(&subject["reference_of_centres"]["noise"]["mse"]) > 0.0);
    assert_eq!(list(&subject["similarity"]).len(), 2);
    check_settings(list(&subject["cache_settings"]));
}

/// The times, metrics and memory of one variant.
fn check_run(run: &Value) {
    let points = list(&run["points"]);
    assert_eq!(points.len(), 2, "{run:#}");
    for point in points {
        let [asked, seconds, mse] = ["asked_s", "seconds", "mse"].map(|key| number(&point[key]));
        assert!(seconds >= asked, "{point:#}");
        for key in ["relmse", "psnr", "ssim", "flip", "bias"] {
            assert!(number(&point[key]).is_finite(), "{key}");
        }
        let efficiency = number(&point["efficiency"]) * mse * seconds;
        assert!((efficiency - 1.0).abs() < 1e-9, "{point:#}");
    }
    for key in ["seconds_to_30_db", "seconds_to_40_db"] {
        let reached = points.iter().any(|p| {
            let decibels = if key.contains("30") { 30.0 } else { 40.0 };
            number(&p["psnr"]) >= decibels
        });
        assert_eq!(run[key].is_number(), reached, "{run:#}");
    }
    let memory = &run["memory"];
    let [planned, peak] = ["planned_bytes", "peak_bytes"].map(|key| number(&memory[key]));
    assert!(planned >= peak && planned <= 1.01 * peak, "{memory:#}");
    assert!(number(&run["paths_per_second"]) > 0.0);
}

/// Coarser caches take less; rounding to 16 bits alone is not seen.
fn check_settings(settings: &[Value]) {
    assert_eq!(settings.len(), 5);
    assert!(settings[0]["psnr"].is_null(), "the measure itself");
    assert!(number(&settings[1]["psnr"]) > 60.0, "{:#}", settings[1]);
    assert!(settings[1].get("psnr_at_least").is_none(), "the same paths");
    for coarse in &settings[2..] {
        let least = number(&coarse["psnr_at_least"]);
        let expected = coarse["psnr_without_noise"].as_f64();
        assert!(expected.is_none_or(|psnr| psnr >= least), "{coarse:#}");
    }
    assert_eq!(settings[0]["paths_per_cell"], settings[1]["paths_per_cell"]);
    let bytes: Vec<f64> = settings.iter().map(|s| number(&s["bytes"])).collect();
    assert!(bytes[0] > bytes[1] && bytes[2..].is_sorted_by(|a, b| a >= b));
}

/// Neither a reference nor a cache's first batch has come then.
#[test]
fn a_picture_that_is_not_there_in_time_is_late() {
    let folder = Folder::new();
    folder.succeed(&format!(
        "{BENCH} --variants non-caching,caching:1:f16 --seconds 0.0001"
    ));
    let report = folder.json("report/report.json");
    for run in list(&report["subjects"][0]["runs"]) {
        let point = &run["points"][0];
        assert!(number(&point["seconds"]) > 0.0001, "{point:#}");
        assert!(number(&point["samples"]) >= 1.0, "{point:#}");
    }
}

#[test]
fn a_reference_can_be_given_and_shading_models_compared() {
    let folder = Folder::new();
    folder.succeed("render ball.toml -o given.exr --variant non-caching --spp 64 --seed 9");
    let short = "--variants non-caching,non-caching --seconds 0.1";
    // What a process that was killed has left.
    std::fs::create_dir(folder.path("report")).unwrap();
    let host = sysinfo::System::host_name().unwrap_or_default();
    let host = host.replace('.', "-");
    folder.write(&format!("report/.isolume-output-old.{host}"), b"");
    folder.succeed(&format!("{BENCH} {short} --reference given.exr --quiet"));
    let expected = [
        "error_time.svg",
        "non-caching.0.1s.exr",
        "psnr_time.svg",
        "report.json",
        "report.md",
    ];
    assert_eq!(folder.names_in("report"), expected);
    let report = folder.json("report/report.json");
    assert_eq!(report["subjects"][0]["reference"]["file"], "given.exr");
    assert_eq!(report["seed"], 0);
    assert_eq!(list(&report["subjects"][0]["runs"]).len(), 1);

    // It is read, so no picture of the report may take its place.
    let before = folder.read("report/non-caching.0.1s.exr");
    let own = format!("{BENCH} {short} --reference report/non-caching.0.1s.exr --quiet");
    let said = refused(&folder, &own, 2);
    assert!(said.contains("an output would take its place"), "{said}");
    assert!(folder.read("report/non-caching.0.1s.exr") == before);

    // With the samples of the reference, what is measured would seem better than it is.
    folder.succeed("render ball.toml -o given.exr --variant non-caching --spp 16");
    folder.succeed(&format!("{BENCH} {short} --reference given.exr"));
    assert_eq!(folder.json("report/report.json")["seed"], 1);
    let same = format!("{BENCH} {short} --reference given.exr --seed 0");
    let said = text(&folder.succeed(&same).stderr).to_string();
    assert!(
        said.contains("the reference has the same seed, 0"),
        "{said}"
    );

    folder.succeed(&format!("{BENCH} {short} --shading lambert,phong,lambert"));
    let report = folder.json("report/report.json");
    let subjects = list(&report["subjects"]);
    let models: Vec<&Value> = subjects.iter().map(|s| &s["shading"]).collect();
    assert_eq!(models, ["lambert", "phong"]);
    for name in ["lambert.reference.exr", "phong.non-caching.0.1s.exr"] {
        folder.exr(&format!("report/{name}"));
    }
}

/// A variant that the user has not named may lack memory when it begins: hours of measurements are kept.
#[test]
fn what_lacks_memory_late_is_left_out_of_the_report() {
    /// In one of the variants after the first, which the others are compared with.
    const LATE: &str = "100";
    let folder = Folder::new();
    let mut command = folder.isolume(&format!("{BENCH} --seconds 0.1"));
    let output = ended(command.env("ISOLUME_FAIL_ALLOCATION", LATE));
    assert!(output.status.success(), "{output:?}");
    let report = folder.json("report/report.json");
    let subject = &report["subjects"][0];
    let skipped: Vec<&str> = list(&subject["skipped"])
        .iter()
        .map(|why| why.as_str().expect("a reason"))
        .collect();
    let lacks_memory = |why: &&&str| why.contains("could not be allocated");
    let [why] = skipped.iter().filter(lacks_memory).collect::<Vec<_>>()[..] else {
        panic!("{skipped:?}");
    };
    assert!(!why.starts_with("non-caching"), "{why}");
    assert_eq!(list(&subject["runs"])[0]["variant"], "non-caching");
}

#[test]
fn what_cannot_be_measured_is_refused_before_anything_is_written() {
    let folder = Folder::new();
    folder.succeed("render ball.toml -o small.exr --size 8x8 --spp 1");
    for (words, status, expected) in [
        ("--variants cached", 2, "cached"),
        ("--variants caching:0.3", 2, "0.3"),
        ("--variants non-caching:1", 2, "non-caching:1"),
        ("--seconds 0", 2, "seconds > 0"),
        ("--variant caching", 2, "--variants"),
        (
            "--reference small.exr --shading lambert,phong",
            2,
            "--shading names 2",
        ),
        ("--reference small.exr", 3, "--size 8x8"),
        ("--reference missing.exr", 3, "missing.exr"),
        (
            "--set surfaces.iso=[] --shading phong",
            3,
            "--shading: it is for surfaces",
        ),
        (
            "--variants caching --set render.max_bounces=2",
            3,
            "max_bounces",
        ),
        ("--vram-budget 1000", 4, "1000 bytes"),
        ("--variants caching:1:f32 --vram-budget 150000", 4, "f32"),
    ] {
        let said = refused(&folder, &format!("{BENCH} {words}"), status);
        assert!(said.contains(expected), "{words}: {said}");
    }
    folder.write("report", b"a file");
    refused(&folder, BENCH, 3);
}
