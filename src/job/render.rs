//! `isolume render`: open, plan, render until it is enough, write.

use std::num::NonZeroU32;
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::thread;

use super::open_scene_timed;
use super::plan::check_supported;
use super::report::{self, Clock};
use super::schedule::cache_goal;
use super::setup::{Host, Loaded};
use super::trace::{self, Outcome, Stopwatch, rgb};
use crate::cli::RenderArgs;
use crate::error::Result;
use crate::output::profile;
use crate::output::progress::Progress;
use crate::output::stats::Stats;
use crate::output::{Format, Outputs, Picture, Provenance, check_writable};
use crate::render::{Film, FirstHits};
use crate::scene::file::Opened;
use crate::scene::{Background, Scene, Variant, describe};

/// Exit status after Ctrl-C with the outputs written.
pub const INTERRUPTED_STATUS: u8 = 130;

pub fn render(args: &RenderArgs) -> Result<u8> {
    let mut clock = Clock::new();
    let files = args.outputs();
    check_writable(files.iter().chain(&args.stats).chain(&args.profile))?;
    let (opened, host) = thread::scope(|scope| {
        let host = scope.spawn(|| Host::open(&args.gpu));
        let opened = open_scene_timed(&args.scene, args.quiet, &mut clock)?;
        check_supported(&opened.scene)?;
        let host = clock.time("open the device", || host.join());
        Ok((opened, host.unwrap_or_else(|panic| resume_unwind(panic))?))
    })?;
    let Opened { volume, scene, .. } = &opened;
    let choice = clock.time("plan", || host.choose(volume, scene))?;
    let mut loaded = host.load(volume, scene, choice, args.seed, &mut clock)?;
    trace::catch_interrupts();
    let stop = match scene.render.variant {
        Variant::Published => {
            if args.error.is_some() && !args.quiet {
                eprintln!("note: published does not know its error, and does not stop by --error");
            }
            args.stop().without_error()
        }
        _ => args.stop(),
    };
    let mut progress = Progress::new(args.quiet, trace::goal(&stop));
    let pictures = args.orbit.map_or(1, NonZeroU32::get);
    if let Some(cache) = loaded.renderer.cache.as_mut().filter(|_| pictures > 1) {
        cache.widen_focus();
    }
    let mut watch = Stopwatch::started();
    clock.time("fill the cache", || {
        trace::fill_until(&stop, &mut loaded.renderer, pictures, &mut progress)
    })?;
    let mut outputs = Outputs::default();
    let mut outcomes: Vec<Outcome> = Vec::new();
    for view in views(args, &opened) {
        if !outcomes.is_empty() {
            watch = Stopwatch::started();
            clock.time("look from elsewhere", || {
                loaded.look_from(&view.scene.camera)
            })?;
        }
        let renderer = &mut loaded.renderer;
        let outcome = clock.time("render", || {
            trace::trace_until(&stop, renderer, &watch, &mut progress)
        })?;
        clock.time("save the pictures", || {
            let picture = picture(renderer.film()?, renderer.first_hits()?, &view.scene);
            stage_pictures(&mut outputs, &view, &opened, &picture, &host, args.seed)
        })?;
        if args.orbit.is_some() {
            std::mem::take(&mut outputs).commit()?;
        }
        outcomes.push(outcome);
        if trace::interrupted() {
            break;
        }
    }
    progress.finish();
    host.check_validation()?;

    let Loaded {
        choice,
        memory,
        renderer,
        ..
    } = &loaded;
    let (first, last) = (&outcomes[0], &outcomes[outcomes.len() - 1]);
    let stats = Stats {
        variant: choice.plan.variant().into(),
        reason: choice.reason.clone(),
        device: host.device.summary.name.clone(),
        driver: host.device.summary.driver.clone(),
        spp: renderer.totals.samples as u64,
        seed: args.seed as u64,
        wall_s: clock.began.elapsed().as_secs_f64(),
        first_frame_s: first
            .first_frame
            .map_or(f64::NAN, |at| at.duration_since(clock.began).as_secs_f64()),
        passes: report::passes(&renderer.frame.timings),
        stages: clock.stages(&renderer.frame.timings),
        memory: loaded.memory_stats(),
        paths: renderer.paths(),
        lookups_per_path: renderer.lookups() as f64 / renderer.paths() as f64,
        relative_error: last.relative_error,
        cache: report::cache(renderer, &choice.plan, cache_goal(&stop)),
        views: outcomes.iter().map(Outcome::stats).collect(),
    };
    if let Some(path) = &args.stats {
        outputs.json(path, &stats)?;
    }
    if let Some(path) = &args.profile {
        let trace = report::trace(&clock, &renderer.frame.timings, memory);
        outputs.json(path, &trace)?;
    }
    outputs.commit()?;
    if !args.quiet {
        if args.stats.is_some() || args.profile.is_some() {
            eprint!("{}", profile::table(&stats));
        }
        eprintln!("{}", last_line(&stats, &files, &last.why_stopped));
    }
    match trace::interrupted() {
        true => Ok(INTERRUPTED_STATUS),
        false => Ok(0),
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

pub fn picture(film: Film, hits: FirstHits, scene: &Scene) -> Picture {
    let last = |texels: &[[f32; 4]]| texels.iter().map(|t| t[3]).collect();
    let [width, height] = scene.render.size;
    Picture {
        width,
        height,
        rgb: rgb(&film.mean),
        alpha: (scene.render.background == Background::Transparent).then(|| last(&film.mean)),
        stderr: film.stderr,
        albedo: rgb(&hits.albedo),
        normal: rgb(&hits.normal_depth),
        depth: last(&hits.normal_depth),
    }
}

/// `scene` as text.
pub fn provenance(scene: String, host: &Host, seed: u32) -> Provenance {
    Provenance {
        scene,
        seed,
        device: host.device.summary.name.clone(),
        software: concat!("isolume ", env!("CARGO_PKG_VERSION")).into(),
    }
}

fn stage_pictures(
    outputs: &mut Outputs,
    view: &View,
    opened: &Opened,
    picture: &Picture,
    host: &Host,
    seed: u32,
) -> Result<()> {
    let scene = describe(&opened.file, &opened.volume, &view.scene);
    let provenance = provenance(scene, host, seed);
    for file in &view.files {
        let path: &Path = file;
        match Format::of(path)? {
            Format::Exr => outputs.exr(path, picture, &provenance)?,
            Format::Png => {
                let render = &opened.scene.render;
                outputs.png(path, picture, render.exposure, render.tone)?
            }
        }
    }
    Ok(())
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
