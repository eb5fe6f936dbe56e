//! What a command leaves behind when all is well.

use exr::prelude::{AttributeValue, Text};
use serde_json::{Value, json};

use crate::number::number;
use crate::refusals::refused;
use crate::shards::channel;
use crate::{Folder, ended, last_line, text};

#[test]
fn a_render_leaves_whole_files_and_nothing_else() {
    let folder = Folder::new();
    folder.succeed("render ball.toml -o a.exr -o a.png --stats s.json --profile p.json --spp 16");
    let expected = [
        "a.exr",
        "a.png",
        "ball.toml",
        "ball_16x16x16_uint8.raw",
        "p.json",
        "s.json",
    ];
    assert_eq!(folder.names(), expected);

    let png = image::open(folder.path("a.png")).expect("a PNG");
    assert_eq!((png.width(), png.height()), (24, 16));
    assert!(!png.color().has_alpha());

    let trace = folder.json("p.json");
    let events = trace["traceEvents"].as_array().expect("events");
    for (phase, name) in [
        ("X", "node_tracking"),
        ("X", "cached_tracking"),
        ("X", "render"),
        ("C", "device memory"),
    ] {
        let found = events.iter().any(|e| e["ph"] == phase && e["name"] == name);
        assert!(found, "{name}: {events:#?}");
    }
}

#[test]
fn the_exr_holds_layers_and_says_how_it_was_made() {
    let folder = Folder::new();
    let coloured = crate::SCENE.replace("value = 150", "value = 150\ncolor = [0.9, 0.5, 0.2]");
    folder.write("ball.toml", coloured.as_bytes());
    folder.succeed("render ball.toml -o a.exr --spp 16 --seed 5");
    let image = folder.exr("a.exr");
    let layer = &image.layer_data[0];
    let channels = &layer.channel_data.list;
    let names: Vec<String> = channels.iter().map(|c| c.name.to_string()).collect();
    let expected = [
        "B", "G", "R", "albedo.B", "albedo.G", "albedo.R", "depth.Z", "normal.X", "normal.Y",
        "normal.Z", "stderr.B", "stderr.G", "stderr.R",
    ];
    assert_eq!(names, expected);
    let value = |channel: &str, pixel: usize| {
        let at = names.iter().position(|n| n == channel).unwrap();
        let samples = &channels[at].sample_data;
        samples.value_by_flat_index(pixel).to_f32()
    };
    let (corner, center) = (0, 8 * 24 + 12);
    assert_eq!(value("depth.Z", corner), f32::INFINITY);
    assert!(value("depth.Z", center).is_finite());
    let albedo = ["albedo.R", "albedo.G", "albedo.B"].map(|channel| value(channel, center));
    assert_eq!(albedo, [0.9, 0.5, 0.2]);
    assert!(value("normal.Z", center) > 0.9, "it faces the camera");
    assert_eq!(
        value("stderr.G", corner),
        0.0,
        "the sky is the same in every sample"
    );
    assert!(value("stderr.G", center) > 0.0);

    let header = &layer.attributes;
    let scene = match header.other.get(&Text::from("isolume.scene")) {
        Some(AttributeValue::Text(text)) => text.to_string(),
        other => panic!("{other:?}"),
    };
    assert!(scene.contains("[[surfaces.iso]]"), "{scene}");
    let software = header.software_name.as_ref().map(Text::to_string);
    let expected = concat!("isolume ", env!("CARGO_PKG_VERSION"));
    assert_eq!(software.as_deref(), Some(expected));
    let comments = header.comments.as_ref().map(Text::to_string);
    let comments = comments.expect("comments");
    assert!(comments.starts_with("seed 5\ndevice "), "{comments}");
}

/// Kept shaders are used only where they are whole; they decide nothing but how long a start takes.
#[cfg(target_os = "linux")]
#[test]
fn shaders_that_are_kept_and_then_broken_change_no_picture() {
    let folder = Folder::new();
    let render = |caches: &str, picture: &str| {
        let words = format!("render ball.toml --spp 1 --quiet -o {picture}");
        let mut command = folder.isolume(&words);
        if let Some(home) = std::env::var_os("HOME") {
            // The driver has its own cache in the same place.
            let drivers = std::path::Path::new(&home).join(".cache");
            command.env("MESA_SHADER_CACHE_DIR", drivers);
        }
        let output = ended(command.env("XDG_CACHE_HOME", folder.path(caches)));
        assert!(output.status.success(), "{caches}: {output:?}");
        assert_eq!(text(&output.stderr), "", "{caches}");
        std::fs::read(folder.path(picture)).expect("a picture")
    };
    let kept = || {
        let versions = std::fs::read_dir(folder.path("caches/isolume/pipelines"));
        let version = versions.expect("a folder").next().expect("a version");
        let files = std::fs::read_dir(version.expect("a version").path()).expect("files");
        let mut paths: Vec<_> = files.map(|file| file.expect("a file").path()).collect();
        paths.sort();
        paths
    };
    let first = render("caches", "first.exr");
    let files = kept();
    assert!(files.len() > 3, "{files:?}");
    assert!(render("caches", "second.exr") == first);
    for (n, file) in files.iter().enumerate() {
        let whole = std::fs::read(file).expect("a file");
        let broken = match n % 3 {
            0 => whole[..whole.len() / 2].to_vec(),
            1 => vec![0x55; whole.len()],
            _ => Vec::new(),
        };
        std::fs::write(file, broken).expect("a broken file");
    }
    assert!(render("caches", "third.exr") == first);
    assert_eq!(kept(), files);
    assert!(render("ball.toml", "fourth.exr") == first);
}

/// More views than files that a process may have open: each is finished before the next.
#[cfg(unix)]
#[test]
fn a_long_orbit_needs_no_more_files_than_a_short_one() {
    let folder = Folder::new();
    let render = "render ball.toml --variant non-caching --orbit 60 --spp 1 --size 4x4 -o turn.png";
    let output = ended(&mut folder.shell("ulimit -n 40;", &format!("{render} --quiet")));
    assert!(output.status.success(), "{}", text(&output.stderr));
    let views = folder.names();
    let views = views.iter().filter(|name| name.starts_with("turn."));
    assert_eq!(views.count(), 60);
}

/// A file larger than the shell's limit is like a disk that is full.
#[cfg(unix)]
#[test]
fn a_picture_above_the_limit_of_files_is_refused_in_a_sentence() {
    let folder = Folder::new();
    let before = folder.names();
    let render =
        "render ball.toml --size 128x128 --spp 1 --variant non-caching -o a.exr --stats s.json";
    let output = ended(&mut folder.shell("ulimit -f 40;", &format!("{render} --quiet")));
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{output:?}");
    assert!(
        said.contains("a.exr") && said.lines().count() == 1,
        "{said}"
    );
    // What there is room for is written all the same.
    assert_eq!(folder.names(), [before, vec!["s.json".into()]].concat());
}

#[test]
fn an_orbit_looks_at_one_cache_from_all_sides() {
    let folder = Folder::new();
    let cached = "render ball.toml --variant caching --cache-scale 0.5 --cache-format f16";
    folder.succeed(&format!(
        "{cached} --orbit 3 --spp 4 -o turn.exr --stats s.json"
    ));
    let names = ["turn.0001.exr", "turn.0002.exr", "turn.0003.exr"];
    let written = folder.names();
    assert!(
        names.iter().all(|n| written.iter().any(|w| w == n)),
        "{written:?}"
    );
    assert_ne!(folder.read(names[0]), folder.read(names[1]));

    let stats = folder.json("s.json");
    assert_eq!(stats["variant"], "caching");
    assert_eq!(stats["views"].as_array().map(Vec::len), Some(3));
    let cache = &stats["cache"];
    assert_eq!(
        (&cache["dims"], &cache["format"]),
        (&json!([8, 8, 8]), &json!("f16"))
    );
    assert_eq!(cache["cells"], 512);
    let figure = |key: &str| number(&cache[key]);
    assert!(figure("active_cells") > 0.0 && figure("active_cells") <= 512.0);
    assert!(figure("updates_per_cell") >= 4.0 && figure("relative_error") > 0.0);
    assert!(figure("bytes") > 0.0 && cache["converged"].is_boolean());
    let passes = stats["passes"].as_array().expect("passes");
    let march = passes.iter().find(|p| p["name"] == "ray_march");
    assert!(
        march.is_some_and(|p| number(&p["peak_share"]) > 0.0),
        "{passes:#?}"
    );
}

#[test]
fn a_seed_decides_every_bit() {
    let folder = Folder::new();
    let made = |name: &str, seed: u32| {
        let files = format!("-o {name}.exr -o {name}.png");
        folder.succeed(&format!("render ball.toml --spp 8 --seed {seed} {files}"));
        [".exr", ".png"].map(|extension| folder.read(&(name.to_string() + extension)))
    };
    let first = made("a", 1);
    assert!(made("b", 1) == first, "the same seed gives other bytes");
    let other = made("c", 2);
    assert!(other[0] != first[0] && other[1] != first[1]);
}

#[test]
fn a_printed_scene_renders_the_same_picture() {
    let folder = Folder::new();
    let printed = folder.succeed("scene ball.toml --set medium.g=-0.4").stdout;
    folder.write("printed.toml", &printed);
    folder.succeed("render ball.toml --set medium.g=-0.4 --spp 4 -o a.exr -o a.png");
    folder.succeed("render printed.toml --spp 4 -o b.exr -o b.png");
    assert!(folder.read("a.png") == folder.read("b.png"));
    assert!(folder.read("a.exr") == folder.read("b.exr"));
}

#[test]
fn names_come_from_the_input_where_none_are_given() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("here")).unwrap();
    let mut command = folder.isolume("render ../ball.toml --spp 1");
    let output = command.current_dir(folder.path("here")).output();
    assert!(output.expect("the program starts").status.success());
    assert!(folder.path("here/ball.exr").is_file() && folder.path("here/ball.png").is_file());
    assert!(!folder.path("ball.exr").exists());
}

#[test]
fn a_bare_volume_is_rendered_by_a_preset() {
    let folder = Folder::new();
    let arguments = "render ball_16x16x16_uint8.raw --size 16x16 --spp 2 -o a.exr";
    folder.succeed(arguments);
    let scene = folder.succeed("scene ball_16x16x16_uint8.raw");
    assert!(text(&scene.stdout).contains("[[surfaces.iso]]"));
}

#[test]
fn a_transparent_background_leaves_coverage() {
    let folder = Folder::new();
    folder.succeed(
        "render ball.toml --spp 8 -o a.exr -o a.png --set camera.orthographic=24 \
         --set render.background=transparent",
    );
    let image = folder.exr("a.exr");
    let channels = &image.layer_data[0].channel_data.list;
    let alpha = channels.iter().find(|c| c.name.eq("A")).expect("A");
    let at = |pixel| alpha.sample_data.value_by_flat_index(pixel).to_f32();
    assert_eq!((at(0), at(8 * 24 + 12)), (0.0, 1.0));
    let png = image::open(folder.path("a.png")).unwrap().into_rgba8();
    assert_eq!((png.get_pixel(0, 0)[3], png.get_pixel(12, 8)[3]), (0, 255));
}

#[test]
fn the_published_baseline_renders_by_name() {
    let folder = Folder::new();
    let arguments = "--variant published --spp 4 --time 600 -o a.exr -o a.png --stats s.json";
    let output = folder.succeed(&format!("render ball.toml {arguments}"));
    let line = last_line(&output);
    assert!(line.contains("relative error unknown"), "{line}");
    let stats = folder.json("s.json");
    assert_eq!(stats["variant"], "published");
    assert_eq!(stats["reason"], "it was asked for");
    assert!(number(&stats["spp"]) >= 4.0, "{stats:#}");
    assert!(stats["relative_error"].is_null(), "{stats:#}");
    let memory = &stats["memory"];
    assert_eq!(memory["planned_bytes"], memory["peak_bytes"]);
    let cache = &stats["cache"];
    assert_eq!(cache["dims"], serde_json::json!([16, 16, 16]));
    assert_eq!(cache["format"], "f32");
    assert_eq!(cache["bytes"], 56 * 16 * 16 * 16);
    assert_eq!(cache["cells"], cache["active_cells"]);
    assert!(number(&cache["updates_per_cell"]) >= 4.0, "{cache}");
    let plan = folder.succeed("plan ball.toml --variant published --json");
    let plan: Value = serde_json::from_slice(&plan.stdout).expect("JSON");
    assert_eq!(plan["planned_bytes"], memory["planned_bytes"]);
}

#[test]
fn the_plan_is_what_a_render_takes() {
    let folder = Folder::new();
    let variant = "--variant non-caching";
    let plan = folder.succeed(&format!("plan ball.toml {variant} --json"));
    let plan: Value = serde_json::from_slice(&plan.stdout).expect("JSON");
    let planned = plan["planned_bytes"].as_u64().expect("bytes");
    let just_enough = format!("--vram-budget {planned}");
    folder.succeed(&format!(
        "render ball.toml {variant} --spp 1 -o a.png --stats s.json {just_enough}"
    ));
    assert_eq!(folder.json("s.json")["memory"]["peak_bytes"], planned);
    let too_little = format!("--vram-budget {}", planned - 1);
    let output = folder.run(&format!(
        "render ball.toml {variant} --spp 1 -o b.png {too_little}"
    ));
    assert_eq!(output.status.code(), Some(4), "{output:?}");
}

/// The first picture of an orbit is as far away as the others.
#[test]
fn an_orbit_keeps_its_distance() {
    let folder = Folder::new();
    folder.succeed(
        "render ball.toml --size 24x24 --spp 1 --variant non-caching --orbit 4 -o turn.exr",
    );
    let nearest = |number: u32| {
        let depth = channel(&folder.exr(&format!("turn.000{number}.exr")), "depth.Z");
        depth.into_iter().fold(f64::INFINITY, f64::min)
    };
    for number in 2..=4 {
        let (first, other) = (nearest(1), nearest(number));
        assert!((first - other).abs() < 0.01 * first, "{first}, {other}");
    }
}

#[test]
fn info_describes_devices_and_volumes() {
    let folder = Folder::new();
    let devices = folder.succeed("info");
    assert!(
        text(&devices.stdout).contains("device-local"),
        "{devices:?}"
    );
    let devices = folder.succeed("info --json");
    let devices: Value = serde_json::from_slice(&devices.stdout).expect("JSON");
    assert!(devices.as_array().is_some_and(|d| !d.is_empty()));
    let volume = folder.succeed("info ball_16x16x16_uint8.raw");
    assert!(text(&volume.stdout).contains("orientation unknown"));
    let volume = folder.succeed("info ball_16x16x16_uint8.raw --json");
    let volume: Value = serde_json::from_slice(&volume.stdout).expect("JSON");
    assert_eq!(volume["dims"], serde_json::json!([16, 16, 16]));
    assert_eq!(volume["type"], "uint8");
    let bins = volume["histogram"].as_array().expect("a histogram");
    let voxels: u64 = bins.iter().map(|b| b["voxels"].as_u64().unwrap()).sum();
    assert_eq!(voxels, 16 * 16 * 16);
}

#[test]
fn comparing_tells_noise_from_nothing() {
    let folder = Folder::new();
    folder.succeed("render ball.toml --spp 16 --seed 1 -o a.exr");
    folder.succeed("render ball.toml --spp 16 --seed 2 -o b.exr");
    let compared = |arguments: &str| -> Value {
        serde_json::from_slice(&folder.succeed(arguments).stdout).expect("JSON")
    };
    let same = compared("compare a.exr a.exr --json");
    assert_eq!(
        (same["mse"].as_f64(), same["flip"].as_f64()),
        (Some(0.0), Some(0.0))
    );
    let other = compared("compare a.exr b.exr --json");
    assert!(number(&other["mse"]) > 0.0);
    for key in ["relmse", "psnr", "ssim", "flip"] {
        assert!(other[key].is_number(), "{key}: {other:#}");
    }
    let z = other["z_bias"].as_f64().expect("both know their noise");
    assert!(z.abs() < 4.0, "{other:#}");

    // Two pictures of one scene differ by their noise alone, which others of the same scene tell.
    folder.succeed("render ball.toml --spp 16 --seed 3 -o c.exr");
    folder.succeed("render ball.toml --spp 16 --seed 4 -o d.exr");
    let again = compared("compare a.exr b.exr --again c.exr d.exr --json");
    let [with, without] = ["psnr", "psnr_without_noise"].map(|key| number(&again[key]));
    assert!(without > with + 6.0, "{again:#}");
    for flags in ["--again c.exr d.exr --again c.exr d.exr", "--exposure 101"] {
        refused(&folder, &format!("compare a.exr b.exr {flags}"), 2);
    }
}

#[test]
fn quiet_says_nothing() {
    let folder = Folder::new();
    let loud = folder.succeed("render ball.toml --spp 1 -o a.png");
    assert!(last_line(&loud).starts_with("a.png: 1 samples per pixel in "));
    let quiet = folder.succeed("render ball.toml --spp 1 -o a.png --quiet");
    assert!(
        quiet.stdout.is_empty() && quiet.stderr.is_empty(),
        "{quiet:?}"
    );
}
