//! `isolume render`: open, plan, render until it is enough, write.

use std::num::NonZeroU32;
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::thread;

use super::clock::{self, Clock};
use super::open_scene_timed;
use super::shards::{Origin, check_variant, to_json};
use crate::cli::RenderArgs;
use crate::engine::schedule::cache_goal;
use crate::engine::{Engine, Host, Outcome, Picture, Stopwatch, Work};
use crate::error::Result;
use crate::interrupt::{self, is_interrupted};
use crate::output::profile;
use crate::output::progress::Progress;
use crate::output::stats::{Stats, ViewStats};
use crate::output::{Format, Outputs, Parts, Provenance, check_writable};
use crate::render::Sums;
use crate::scene::Opened;
use crate::scene::{Scene, Variant, describe};
use crate::shard::volume_fingerprint;

pub fn render(args: &RenderArgs) -> Result<u8> {
    interrupt::catch_signals();
    let mut clock = Clock::new();
    let files = args.outputs();
    check_writable(files.iter().chain(&args.stats).chain(&args.profile))?;
    let (opened, host) = thread::scope(|scope| {
        let host = scope.spawn(|| Host::open(&args.gpu.host_options()));
        let opened = open_scene_timed(&args.scene, args.quiet, &mut clock)?;
        let host = clock.time("open the device", || host.join());
        Ok((opened, host.unwrap_or_else(|panic| resume_unwind(panic))?))
    })?;
    let Opened { volume, scene, .. } = &opened;
    let choice = clock.time("plan", || host.plan(volume, scene))?;
    let stop = args.stop(scene.render.variant);
    let pictures = args.orbit.map_or(1, NonZeroU32::get);
    if args.samples.is_some() {
        check_variant(&choice.plan.variant, "--samples")?;
    }
    let work = Work {
        stop,
        pictures,
        interrupt: &interrupt::INTERRUPTED,
    };
    let (mut engine, volume_fingerprint) = clock.time("compile and upload", || {
        thread::scope(|scope| {
            let walks = args.samples.is_some();
            let walk = walks.then(|| scope.spawn(|| volume_fingerprint(volume)));
            let engine = Engine::for_work(&host, volume, &opened.scene, choice, args.seed, work)?;
            let walked = walk.map(|walk| walk.join().unwrap_or_else(|panic| resume_unwind(panic)));
            Ok((engine, walked.transpose()?))
        })
    })?;
    interrupt::keep_work();
    clock.part("compile", engine.compiling());
    if scene.render.variant == Variant::Published && args.error.is_some() && !args.quiet {
        eprintln!("note: published does not know its error, and does not stop by --error");
    }
    let mut progress = Progress::new(args.quiet, stop);
    let mut show = |step| progress.show(step);
    let mut run = interrupt::run(stop, &mut show);
    if pictures > 1 {
        engine.look_from_everywhere();
    }
    let mut watch = Stopwatch::started();
    engine.begin_at_sample(stop.first_sample());
    clock.time("fill the cache", || engine.fill(&mut run, pictures))?;
    let origin = volume_fingerprint.map(|volume| Origin::of(&mut engine, volume));
    let origin = origin.transpose()?;
    let mut outputs = Outputs::default();
    let mut outcomes: Vec<Outcome> = Vec::new();
    for view in views(args, &opened) {
        if !outcomes.is_empty() {
            watch = Stopwatch::started();
            clock.time("look from elsewhere", || {
                engine.change_in_place(&view.scene)
            })?;
        }
        let mut outcome = clock.time("render", || engine.sample(&mut run, &watch))?;
        if is_interrupted() {
            outcome.why_stopped = interrupt::reason().into();
        }
        clock.time("save the pictures", || {
            let saved = Saved::of(&mut engine, &view, &opened, origin.as_ref())?;
            stage_pictures(&mut outputs, &view, &opened, &saved)
        })?;
        if args.orbit.is_some() {
            std::mem::take(&mut outputs).commit()?;
        }
        outcomes.push(outcome);
        if is_interrupted() {
            break;
        }
    }
    progress.finish();
    host.check_validation()?;
    let stats = stats(args, &clock, &engine, &outcomes, cache_goal(&stop));
    if let Some(path) = &args.stats {
        outputs.json(path, &stats)?;
    }
    if let Some(path) = &args.profile {
        outputs.json(path, &clock::trace(&clock, &engine))?;
    }
    outputs.commit()?;
    if !args.quiet {
        if args.stats.is_some() || args.profile.is_some() {
            eprint!("{}", profile::table(&stats));
        }
        let last = &outcomes[outcomes.len() - 1];
        let line = last_line(&stats, &files, &last.why_stopped);
        eprintln!("{line}{}", why_variant(scene.render.variant, &stats.reason));
    }
    Ok(interrupt::status())
}

fn stats(
    args: &RenderArgs,
    clock: &Clock,
    engine: &Engine,
    outcomes: &[Outcome],
    cache_goal: f64,
) -> Stats {
    let (first, last) = (&outcomes[0], &outcomes[outcomes.len() - 1]);
    let choice = engine.choice();
    let device = engine.host().summary();
    Stats {
        variant: choice.plan.variant.word().into(),
        reason: choice.reason.clone(),
        device: device.name.clone(),
        driver: device.driver.clone(),
        spp: u64::from(engine.totals().samples),
        seed: u64::from(args.seed),
        wall_s: clock.began.elapsed().as_secs_f64(),
        first_frame_s: first
            .first_frame
            .map_or(f64::NAN, |at| at.duration_since(clock.began).as_secs_f64()),
        passes: engine.passes(),
        stages: clock.stages(engine.timings()),
        memory: engine.memory_stats(),
        paths: engine.paths(),
        lookups_per_path: engine.lookups() as f64 / engine.paths() as f64,
        relative_error: last.relative_error,
        cache: engine.cache_stats(cache_goal),
        views: outcomes.iter().map(ViewStats::of).collect(),
    }
}

/// One picture of an orbit, or the only one.
struct View {
    scene: Scene,
    files: Vec<PathBuf>,
}

fn views(args: &RenderArgs, opened: &Opened) -> Vec<View> {
    let Some(count) = args.orbit else {
        return vec![View {
            scene: opened.scene.clone(),
            files: args.outputs(),
        }];
    };
    let numbered = |file: PathBuf, number: u32| {
        let extension = file.extension().unwrap_or_default().to_string_lossy();
        file.with_extension(format!("{number:04}.{extension}"))
    };
    let view = |number: u32| {
        let mut scene = opened.scene.clone();
        let share = f64::from(number - 1) / f64::from(count.get());
        scene.camera = scene.camera.orbited(share);
        let files = args.outputs().into_iter();
        View {
            scene,
            files: files.map(|file| numbered(file, number)).collect(),
        }
    };
    (1..=count.get()).map(view).collect()
}

/// Where a picture comes from; `scene` is the resolved scene as text.
pub fn provenance(scene: String, host: &Host, seed: u32) -> Provenance {
    Provenance {
        scene,
        seed,
        device: host.summary().name.clone(),
        software: software(),
    }
}

/// Name and version.
pub fn software() -> String {
    concat!("isolume ", env!("CARGO_PKG_VERSION")).into()
}

/// A picture with what its EXR says of it.
struct Saved {
    picture: Picture,
    provenance: Provenance,
    /// In a shard.
    parts: Option<(String, Sums)>,
}

impl Saved {
    fn of(
        engine: &mut Engine,
        view: &View,
        opened: &Opened,
        origin: Option<&Origin>,
    ) -> Result<Saved> {
        let text = describe(&opened.file, &opened.volume, &view.scene);
        let parts = match origin {
            Some(origin) => {
                let (header, sums) = origin.header(engine, &view.scene, &text)?;
                Some((to_json(&header)?, sums))
            }
            None => None,
        };
        Ok(Saved {
            picture: engine.picture()?,
            provenance: provenance(text, engine.host(), engine.seed()),
            parts,
        })
    }
}

fn stage_pictures(
    outputs: &mut Outputs,
    view: &View,
    opened: &Opened,
    saved: &Saved,
) -> Result<()> {
    let Saved {
        picture,
        provenance,
        parts,
    } = saved;
    for file in &view.files {
        let path: &Path = file;
        match Format::of(path)? {
            Format::Exr => match parts {
                Some((header, sums)) => {
                    let parts = Parts {
                        header,
                        sums,
                        is_quick: false,
                    };
                    outputs.exr_with(path, picture, provenance, parts)?
                }
                None => outputs.exr(path, picture, provenance)?,
            },
            Format::Png => {
                let render = &opened.scene.render;
                outputs.png(path, picture, render.exposure, render.tone)?
            }
        }
    }
    Ok(())
}

/// Why this variant, where the program has picked it.
fn why_variant(asked: Variant, reason: &str) -> String {
    match asked {
        Variant::Auto => format!(", because {reason}"),
        _ => String::new(),
    }
}

fn last_line(stats: &Stats, files: &[PathBuf], why_stopped: &str) -> String {
    let files: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
    let samples = match stats.variant.as_str() {
        "published" => "updates per cell",
        _ => "samples per pixel",
    };
    let error = match stats.relative_error.is_finite() {
        true => format!("{:.4}", stats.relative_error),
        false => "unknown".into(),
    };
    format!(
        "{}: {} {samples} in {:.1} s, relative error {error}, stopped because {why_stopped}; {} on {}",
        files.join(", "),
        stats.spp,
        stats.wall_s,
        stats.variant,
        stats.device,
    )
}
