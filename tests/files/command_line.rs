//! What the user types becomes typed values, or exit status 2.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::{CommandFactory, Parser};
use isolume::cli::{Cli, Command, RenderArgs};
use isolume::engine::{HostOptions, Limit};
use isolume::scene::preset::Preset;
use isolume::scene::{CacheScale, SceneFile, Side, Variant};

fn render(arguments: &str) -> Result<RenderArgs, clap::Error> {
    let words = ["isolume", "render", "head.toml"]
        .into_iter()
        .chain(arguments.split_whitespace());
    match Cli::try_parse_from(words)?.command {
        Command::Render(render) => Ok(*render),
        other => panic!("{other:?}"),
    }
}

#[test]
fn flags_become_values() {
    let args =
        render("-o a.exr -o b.PNG --spp 8 --time 1.5 --error 0.01 --seed 7 --device 1 --quiet")
            .unwrap();
    assert_eq!(
        args.outputs(),
        [PathBuf::from("a.exr"), PathBuf::from("b.PNG")]
    );
    let stop = args.stop(Variant::Auto);
    assert_eq!(stop.count(), Some(8));
    assert_eq!(stop.time, Some(Duration::from_millis(1500)));
    assert_eq!(stop.relative_error, Some(0.01));
    let HostOptions { device, .. } = args.gpu.host_options();
    assert_eq!(
        (args.seed, device.as_deref(), args.quiet),
        (7, Some("1"), true)
    );
    assert_eq!(args.scene.preset, Preset::Auto);
}

#[test]
fn defaults_without_flags() {
    let args = render("").unwrap();
    assert_eq!(
        args.outputs(),
        [PathBuf::from("head.png"), PathBuf::from("head.exr")]
    );
    let stop = args.stop(Variant::Auto);
    assert_eq!(
        (stop.samples, stop.time, stop.relative_error),
        (None, Some(Duration::from_secs(60)), Some(0.02))
    );
    let only_samples = render("--spp 3").unwrap().stop(Variant::Auto);
    assert_eq!(
        (only_samples.time, only_samples.relative_error),
        (None, None)
    );
}

#[test]
fn scene_flags_change_the_scene() {
    let args = render(
        "--view -x --iso -5 --size 320x200 --variant non-caching --cache-scale 0.5 \
         --cache-format f16 --set medium.g=0.5 --set medium.transfer.0.value=3",
    )
    .unwrap();
    let file = SceneFile::parse("", Path::new("head.toml"), &args.scene.edits()).unwrap();
    assert_eq!(file.camera.view, Some(Side::MinusX));
    assert_eq!(file.surfaces.iso[0].value, -5.0);
    assert_eq!(file.render.size, Some([320, 200]));
    assert_eq!(file.render.variant, Some(Variant::NonCaching));
    assert_eq!(file.render.cache_scale, Some(CacheScale::Fixed(0.5)));
    assert_eq!(file.medium.unwrap().g, Some(0.5));
}

#[test]
fn budgets() {
    let budget = |text: &str| {
        let flag = format!("--vram-budget={text}");
        let parsed = Cli::try_parse_from(["isolume", "render", "head.toml", &flag]);
        parsed
            .map_err(|error| error.kind())
            .map(|cli| match cli.command {
                Command::Render(render) => render.gpu.host_options().vram_budget,
                other => panic!("{other:?}"),
            })
    };
    assert_eq!(budget("2GiB"), Ok(Some(Limit::Bytes(2 << 30))));
    assert_eq!(budget("1.5GB"), Ok(Some(Limit::Bytes(1_500_000_000))));
    assert_eq!(budget("512 MiB"), Ok(Some(Limit::Bytes(512 << 20))));
    assert_eq!(budget("500MB"), Ok(Some(Limit::Bytes(500_000_000))));
    assert_eq!(budget("512KiB"), Ok(Some(Limit::Bytes(512 << 10))));
    assert_eq!(budget("4096"), Ok(Some(Limit::Bytes(4096))));
    assert_eq!(budget("80%"), Ok(Some(Limit::Percent(80.0))));
    for wrong in [
        "",
        "0",
        "-1",
        "2 parsecs",
        "0%",
        "101%",
        "GiB",
        "nan",
        "inf",
        "1e300GiB",
        "0.1",
    ] {
        assert!(budget(wrong).is_err(), "{wrong}");
    }
}

#[test]
fn wrong_usage_exits_with_2() {
    for wrong in [
        "--spp 0",
        "--spp -1",
        "--spp 1.5",
        "--time 0",
        "--spp 16777217",
        "--time -3",
        "--time nan",
        "--time 1e300",
        "--error 0",
        "--error -1",
        "--error inf",
        "--size 0x5",
        "--size 5",
        "--size 24",
        "--size 5x-5",
        "--size 99999999999x1",
        "--seed -1",
        "--seed 4294967296",
        "--vram-budget 0",
        "--vram-budget lots",
        "--orbit 10000",
        "--variant fast",
        "--cache-scale 0.3",
        "--cache-format f64",
        "--view sideways",
        "--iso abc",
        "--iso nan",
        "--preset mri",
        "--set medium.g",
        "--stats -",
        "--profile -",
        "--set =3",
        "-o a.jpg",
        "-o a",
        "--nope",
    ] {
        let error = render(wrong)
            .err()
            .unwrap_or_else(|| panic!("accepted {wrong}"));
        assert_eq!(error.exit_code(), 2, "{wrong}");
        let flag = wrong
            .split(' ')
            .next()
            .filter(|flag| flag.starts_with("--"));
        let said = error.to_string();
        assert!(said.contains(flag.unwrap_or("-o")), "{said}");
        assert!(said.contains("--help"), "{said}");
    }
    for (line, absent) in [
        ("isolume render", "a scene"),
        ("isolume bench head.toml", "-o"),
    ] {
        let error = Cli::try_parse_from(line.split(' ')).unwrap_err();
        assert_eq!(error.exit_code(), 2, "{line} needs {absent}");
        assert!(error.to_string().contains("--help"), "{error}");
    }
}

#[test]
fn the_other_commands() {
    let parse = |line: &str| {
        Cli::try_parse_from(line.split_whitespace())
            .unwrap()
            .command
    };
    assert!(
        matches!(parse("isolume info --json"), Command::Info(info) if info.json && info.volume.is_none())
    );
    assert!(matches!(parse("isolume info a.nrrd"), Command::Info(info) if info.volume.is_some()));
    assert!(
        matches!(parse("isolume compare a b --exposure -2"), Command::Compare(c) if c.exposure == -2.0)
    );
    assert!(
        matches!(parse("isolume scene a.nii.gz --preset ct"), Command::Scene(s) if s.preset == Preset::Ct)
    );
    let gz = ["isolume", "render", "data/head.nii.gz"];
    let Command::Render(gz) = Cli::try_parse_from(gz).unwrap().command else {
        panic!()
    };
    assert_eq!(gz.outputs()[0], PathBuf::from("head.png"));
}

/// The flags of a command and of those below it.
fn flags_of(command: &clap::Command) -> Vec<String> {
    let own = command.get_arguments().filter_map(clap::Arg::get_long);
    let own = own.map(|flag| format!("--{flag}"));
    own.chain(command.get_subcommands().flat_map(flags_of))
        .collect()
}

/// The files of Rust in a folder and in those below it.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let below = |path: PathBuf| {
        if path.is_dir() {
            sources(&path)
        } else {
            vec![path]
        }
    };
    paths.flat_map(below).collect()
}

/// Messages name flags as remedies, far from where those are defined.
#[test]
fn flags_that_messages_name_exist() {
    // Of gdcmconv, which a message recommends.
    const OF_OTHERS: [&str; 1] = ["--raw"];
    let known = flags_of(&Cli::command());
    assert!(known.iter().any(|flag| flag == "--spp"), "{known:?}");
    let mut named = 0;
    for path in sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src")) {
        let text = std::fs::read_to_string(&path).expect("text");
        let code = text
            .lines()
            .filter(|line| !line.trim_start().starts_with("//"));
        for word in
            code.flat_map(|line| line.split(|c: char| !(c == '-' || c.is_ascii_lowercase())))
        {
            let is_flag = word.len() > 3 && word.starts_with("--") && !word.ends_with('-');
            if is_flag && !OF_OTHERS.contains(&word) {
                named += 1;
                assert!(
                    known.iter().any(|flag| flag == word),
                    "{}: {word}",
                    path.display()
                );
            }
        }
    }
    assert!(named > 30, "{named}");
}

/// README's blocks of commands and scenes.
fn blocks_of_readme(language: &str) -> Vec<&'static str> {
    let parts = include_str!("../../README.md").split("```").skip(1);
    let blocks = parts.step_by(2).filter_map(|part| part.split_once('\n'));
    let blocks = blocks.filter(|(first, _)| *first == language);
    blocks.map(|(_, block)| block).collect()
}

#[test]
fn what_readme_says_can_be_typed() {
    let commands = blocks_of_readme("").into_iter().flat_map(str::lines);
    let commands: Vec<&str> = commands
        .filter(|line| line.starts_with("isolume "))
        .collect();
    assert!(commands.len() > 15, "{commands:?}");
    for command in commands {
        let words = command.split_whitespace();
        let typed: Vec<&str> = words
            .take_while(|word| !["#", ">"].contains(word))
            .collect();
        if let Err(error) = Cli::try_parse_from(&typed) {
            panic!("{command}: {error}");
        }
    }
    let scenes = blocks_of_readme("toml");
    assert!(!scenes.is_empty());
    for scene in scenes {
        SceneFile::parse(scene, Path::new("head.toml"), &[]).expect("a scene");
    }
}
