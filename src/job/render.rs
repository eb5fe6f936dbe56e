//! `isolume render`: open, plan, render until it is enough, write.

use std::num::NonZeroU32;
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use super::checkpoint::{Keeper, Subject};
use super::clock::{self, Clock};
use super::open_scene_timed;
use super::shards::{Origin, check_variant, to_json};
use crate::cli::RenderArgs;
use crate::engine::figures;
use crate::engine::schedule::cache_goal;
use crate::engine::{Engine, Host, Outcome, Picture, Run, Stopwatch, Work};
use crate::error::Result;
use crate::interrupt::{self, is_interrupted};
use crate::output::profile;
use crate::output::progress::Progress;
use crate::output::stats::{Stats, ViewStats};
use crate::output::{Format, Outputs, Parts, Provenance, check_writable};
use crate::render::Sums;
use crate::scene::Opened;
use crate::scene::{Scene, Variant, describe};
use crate::shard::{Found, Header, volume_fingerprint};

pub fn render(args: &RenderArgs) -> Result<u8> {
    interrupt::catch_signals();
    let mut clock = Clock::new();
    let files = args.outputs();
    let others = [&args.checkpoint, &args.stats, &args.profile]
        .into_iter()
        .flatten();
    check_writable(files.iter().chain(others))?;
    let (opened, host) = thread::scope(|scope| {
        let host = scope.spawn(|| Host::open(&args.gpu.host_options()));
        let opened = open_scene_timed(&args.scene, args.quiet, &mut clock)?;
        let host = clock.time("open the device", || host.join());
        Ok((opened, host.unwrap_or_else(|panic| resume_unwind(panic))?))
    })?;
    let Opened { volume, scene, .. } = &opened;
    let found = args
        .checkpoint
        .as_ref()
        .map(|path| Found::open(path, args.restart));
    let found = found.transpose()?;
    let settled = found
        .as_ref()
        .map_or(scene.clone(), |found| found.settle(scene));
    let choice = clock.time("plan", || host.plan(volume, &settled))?;
    let stop = args.stop(scene.render.variant);
    let pictures = args.orbit.map_or(1, NonZeroU32::get);
    for (is_given, flag) in [
        (args.samples.is_some(), "--samples"),
        (args.checkpoint.is_some(), "--checkpoint"),
    ] {
        if is_given {
            check_variant(&choice.plan.variant, flag)?;
        }
    }
    let work = Work {
        stop,
        pictures,
        interrupt: &interrupt::INTERRUPTED,
    };
    let (mut engine, volume_fingerprint) = clock.time("compile and upload", || {
        thread::scope(|scope| {
            let walks = args.samples.is_some() || args.checkpoint.is_some();
            let walk = walks.then(|| scope.spawn(|| volume_fingerprint(volume)));
            let engine = Engine::for_work(&host, volume, &settled, choice, args.seed, work)?;
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
    if pictures > 1 {
        engine.look_from_everywhere();
    }
    engine.begin_at_sample(stop.first_sample());
    let views = views(args, &opened);
    let mut origin = None;
    let mut keeper = None;
    match (volume_fingerprint, found, &args.checkpoint) {
        (Some(volume), Some(found), Some(path)) => {
            let subject = Subject {
                args,
                opened: &opened,
                views: &views,
            };
            let take_up = || Keeper::begin(path, subject, found, &mut engine, volume);
            keeper = Some(clock.time("open the checkpoint", take_up)?);
        }
        (volume, ..) => origin = volume,
    }
    let first = keeper.as_ref().map_or(0, Keeper::picture);
    let spent = keeper.as_ref().map_or(Duration::ZERO, Keeper::seconds);
    let mut watch = Stopwatch::started_after(spent);
    if !keeper.as_ref().is_some_and(Keeper::is_filled) {
        clock.time("fill the cache", || {
            let mut between = |engine: &mut Engine| match &mut keeper {
                Some(keeper) => keeper.step(engine, &views[first], &watch),
                None => Ok(()),
            };
            let mut run = Run {
                between: Some(&mut between),
                ..interrupt::run(stop, &mut show)
            };
            let is_enough = engine.fill(&mut run, pictures)?;
            match &mut keeper {
                Some(keeper) => keeper.fill_ended(&mut engine, is_enough),
                None => Ok(()),
            }
        })?;
    }
    let origin = match origin {
        Some(volume) => Some(Origin::of(&mut engine, volume)?),
        None => None,
    };
    let mut outputs = Outputs::default();
    let mut outcomes: Vec<Outcome> = Vec::new();
    let mut last = first;
    for (index, view) in views.iter().enumerate() {
        // An orbit that goes on has those before on disk.
        if index < first && view.files.iter().all(|file| file.exists()) {
            continue;
        }
        last = index;
        if index > 0 {
            watch = Stopwatch::started();
            clock.time("look from elsewhere", || {
                engine.change_in_place(&view.scene)
            })?;
        }
        if let Some(keeper) = keeper.as_ref().filter(|_| index == first) {
            watch = Stopwatch::started_after(spent);
            clock.time("open the checkpoint", || {
                keeper.restore_picture(&mut engine)
            })?;
        }
        let mut between = |engine: &mut Engine| match &mut keeper {
            Some(keeper) if index >= first => keeper.step(engine, view, &watch),
            _ => Ok(()),
        };
        let mut run = Run {
            between: Some(&mut between),
            ..interrupt::run(stop, &mut show)
        };
        let mut outcome = clock.time("render", || engine.sample(&mut run, &watch))?;
        if is_interrupted() {
            outcome.why_stopped = interrupt::reason().into();
        }
        clock.time("save the pictures", || {
            let kept = keeper.as_ref().filter(|_| args.samples.is_some());
            let origin = origin.as_ref().or(kept.map(|keeper| &keeper.origin));
            let saved = Saved::of(&mut engine, view, &opened, origin)?;
            stage_pictures(&mut outputs, view, &opened, &saved)
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
    let mut stats = stats(args, &clock, &engine, &outcomes, cache_goal(&stop));
    // The last that needs the engine: it gives back its memory before the device's peak is measured.
    let kept = match keeper.as_mut().filter(|_| last >= first) {
        Some(keeper) => keeper.write(&mut engine, &views[last], &watch),
        None => Ok(()),
    };
    let memory = engine.memory_history();
    let timings = engine.into_timings();
    let is_measured = args.stats.is_some() || args.profile.is_some();
    // Where the peak cannot be measured, the shares of it are unknown, and the rest stands.
    let peak = is_measured.then(|| host.peak().ok()).flatten();
    stats.passes = figures::passes(&timings, peak.as_ref());
    if let Some(path) = &args.stats {
        outputs.json(path, &stats)?;
    }
    if let Some(path) = &args.profile {
        let trace = clock::trace(&clock, &timings, &memory, peak.as_ref());
        outputs.json(path, &trace)?;
    }
    outputs.commit()?;
    kept?;
    if !args.quiet {
        if is_measured {
            eprint!("{}", profile::table(&stats));
        }
        let last = &outcomes[outcomes.len() - 1];
        let line = last_line(&stats, &files, &last.why_stopped);
        eprintln!("{line}{}", why_variant(scene.render.variant, &stats.reason));
    }
    Ok(interrupt::status())
}

/// All but the passes, which are held against the device's peak once the engine has given back its memory.
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
    let wall_s = clock.began.elapsed().as_secs_f64();
    Stats {
        variant: choice.plan.variant.word().into(),
        reason: choice.reason.clone(),
        device: device.name.clone(),
        driver: device.driver.clone(),
        spp: u64::from(engine.totals().samples),
        seed: u64::from(args.seed),
        wall_s,
        first_frame_s: first
            .first_frame
            .map_or(f64::NAN, |at| at.duration_since(clock.began).as_secs_f64()),
        passes: Vec::new(),
        stages: clock.stages(engine.timings()),
        memory: engine.memory_stats(),
        paths: engine.paths(),
        lookups_per_path: engine.lookups() as f64 / engine.paths() as f64,
        relative_error: last.relative_error,
        cache: engine.cache_stats(cache_goal),
        bricks: engine.brick_stats(wall_s),
        views: outcomes.iter().map(ViewStats::of).collect(),
    }
}

/// One picture of an orbit, or the only one.
pub struct View {
    /// From 1 on.
    pub number: u32,
    pub scene: Scene,
    files: Vec<PathBuf>,
}

fn views(args: &RenderArgs, opened: &Opened) -> Vec<View> {
    let Some(count) = args.orbit else {
        return vec![View {
            number: 1,
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
            number,
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
pub struct Saved {
    pub picture: Picture,
    pub provenance: Provenance,
    /// In a shard.
    pub parts: Option<(Header, Sums)>,
}

impl Saved {
    pub fn of(
        engine: &mut Engine,
        view: &View,
        opened: &Opened,
        origin: Option<&Origin>,
    ) -> Result<Saved> {
        let text = describe(&opened.file, &opened.volume, &view.scene);
        let parts = match origin {
            Some(origin) => Some(origin.header(engine, &view.scene, &text)?),
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
                        header: &to_json(header)?,
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
