//! `isolume render`: open, plan, render until it is enough, write.

use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Instant;

use super::plan::{Budget, check_supported};
use super::report::{self, Clock};
use super::schedule::cache_goal;
use super::trace::{self, INTERRUPTED, Outcome, rgb};
use super::{device_choice, open_scene};
use crate::cli::RenderArgs;
use crate::error::{Error, Result};
use crate::gpu::{Device, Memory};
use crate::output::progress::Progress;
use crate::output::stats::Stats;
use crate::output::{Format, Outputs, Picture, Provenance, check_writable};
use crate::render::{Film, FirstHits, Renderer, SceneBuffers, choose};
use crate::scene::file::Opened;
use crate::scene::{Background, Scene, Variant, describe};

/// Exit status after Ctrl-C with the outputs written.
const INTERRUPTED_STATUS: u8 = 130;

pub fn render(args: &RenderArgs) -> Result<u8> {
    let mut clock = Clock::new();
    let files = args.outputs();
    for file in files.iter().chain(&args.stats).chain(&args.profile) {
        check_writable(file)?;
    }
    let opened = clock.time("read the volume", || open_scene(&args.scene, args.quiet))?;
    check_supported(&opened.scene)?;
    let device = clock.time("open the device", || {
        Device::open(&device_choice(args.gpu.device.as_ref()))
    })?;
    let budget = Budget::of(&device, args.gpu.vram_budget);
    let Opened { volume, scene, .. } = &opened;
    let choice = clock.time("plan", || {
        choose(&device, &device.summary, budget.bytes, volume, scene)
    })?;
    let memory = Memory::new(&device, budget.bytes)?;
    let mut buffers = clock.time("prepare the scene", || {
        SceneBuffers::new(&device, scene, volume, args.seed)
    })?;
    if let Some(layout) = &choice.plan.cache {
        buffers = buffers.with_cache(layout.clone());
    }
    let mut renderer = clock.time("compile and upload", || {
        Renderer::new(&memory, volume, &buffers)
    })?;
    trace::catch_interrupts();
    let stop = match scene.render.variant {
        Variant::Published => args.stop().without_error(),
        _ => args.stop(),
    };
    let mut progress = Progress::new(args.quiet, trace::goal(&stop));
    let pictures = args.orbit.map_or(1, NonZeroU32::get);
    let mut began = Instant::now();
    clock.time("fill the cache", || {
        trace::fill_until(&stop, &mut renderer, pictures, &mut progress)
    })?;
    let mut outputs = Outputs::default();
    let mut outcomes: Vec<Outcome> = Vec::new();
    for view in views(args, &opened) {
        if !outcomes.is_empty() {
            began = Instant::now();
            let next = buffers.seen_by(&view.scene.camera);
            renderer.change(&buffers, &next)?;
            buffers = next;
        }
        let outcome = clock.time("render", || {
            trace::trace_until(&stop, &mut renderer, began, &mut progress)
        })?;
        let picture = picture(renderer.film()?, renderer.first_hits()?, &view.scene);
        clock.time("encode the picture", || {
            stage_pictures(&mut outputs, &view, &opened, &picture, &device, args.seed)
        })?;
        outcomes.push(outcome);
        if INTERRUPTED.load(Ordering::Relaxed) {
            break;
        }
    }
    progress.finish();
    check_validation(&device)?;

    let (first, last) = (&outcomes[0], &outcomes[outcomes.len() - 1]);
    let stats = Stats {
        variant: choice.plan.variant().into(),
        reason: choice.reason.clone(),
        device: device.summary.name.clone(),
        driver: device.summary.driver.clone(),
        spp: renderer.totals.samples as u64,
        seed: args.seed as u64,
        wall_s: clock.began.elapsed().as_secs_f64(),
        first_frame_s: (first.first_frame - clock.began).as_secs_f64(),
        passes: report::passes(&renderer.frame.timings),
        stages: clock.stages(),
        memory: report::memory(&memory, choice.plan.bytes()),
        paths: renderer.paths(),
        lookups_per_path: renderer.lookups() as f64 / renderer.paths() as f64,
        relative_error: last.relative_error,
        cache: report::cache(&renderer, &choice.plan, cache_goal(&stop)),
        views: outcomes.iter().map(Outcome::stats).collect(),
    };
    if let Some(path) = &args.stats {
        outputs.json(path, &stats)?;
    }
    if let Some(path) = &args.profile {
        let trace = report::trace(&clock, &renderer.frame.timings, &memory);
        outputs.json(path, &trace)?;
    }
    outputs.commit()?;
    if !args.quiet {
        eprintln!("{}", last_line(&stats, &files, &last.why_stopped));
    }
    match INTERRUPTED.load(Ordering::Relaxed) {
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

fn picture(film: Film, hits: FirstHits, scene: &Scene) -> Picture {
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

fn stage_pictures(
    outputs: &mut Outputs,
    view: &View,
    opened: &Opened,
    picture: &Picture,
    device: &Device,
    seed: u32,
) -> Result<()> {
    let provenance = Provenance {
        scene: describe(&opened.file, &opened.volume, &view.scene),
        seed,
        device: device.summary.name.clone(),
        software: concat!("isolume ", env!("CARGO_PKG_VERSION")).into(),
    };
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

/// Validation is only on where somebody wants to know: any message is an error then.
fn check_validation(device: &Device) -> Result<()> {
    match device.validation_messages().first() {
        Some(message) => Err(Error::Device(format!("Vulkan validation: {message}"))),
        None => Ok(()),
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
