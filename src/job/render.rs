//! `isolume render`: open, plan, render until it is enough, write.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::plan::{self, Budget, check_fits, check_supported};
use super::report::{self, Clock};
use super::schedule::{Done, next_unit, reason_to_stop};
use super::{device_choice, open_scene};
use crate::cli::{RenderArgs, Stop};
use crate::error::{Error, Result};
use crate::gpu::{Device, Memory};
use crate::output::progress::{Goal, Progress};
use crate::output::stats::Stats;
use crate::output::{Format, Outputs, Picture, Provenance, check_writable, relative_error};
use crate::render::{Film, FirstHits, Plan, Renderer, SceneBuffers};

use crate::scene::file::Opened;
use crate::scene::{Background, Scene, describe};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Exit status after Ctrl-C with the outputs written.
const INTERRUPTED_STATUS: u8 = 130;

/// What rendering left, besides the picture.
struct Outcome {
    picture: Picture,
    relative_error: f64,
    first_frame_s: f64,
    why_stopped: String,
}

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
    let plan = Plan::new(&device, &opened.volume, &opened.scene)?;
    check_fits(&plan, &budget)?;
    let memory = Memory::new(&device, budget.bytes)?;
    let buffers = clock.time("prepare the scene", || {
        SceneBuffers::new(&device, &opened.scene, &opened.volume, args.seed)
    })?;
    let mut renderer = clock.time("compile and upload", || {
        Renderer::new(&memory, &opened.volume, &buffers)
    })?;
    catch_interrupts();
    let progress = Progress::new(args.quiet, goal(&args.stop()));
    let began = clock.began;
    let outcome = clock.time("render", || {
        trace_until(&args.stop(), &mut renderer, &opened.scene, began, progress)
    })?;
    check_validation(&device)?;

    let mut outputs = Outputs::default();
    clock.time("encode the picture", || {
        stage_pictures(
            &mut outputs,
            &files,
            &opened,
            &outcome.picture,
            &device,
            args.seed,
        )
    })?;
    let stats = Stats {
        variant: "non-caching".into(),
        reason: plan::REASON.into(),
        device: device.summary.name.clone(),
        driver: device.summary.driver.clone(),
        spp: renderer.totals.samples as u64,
        seed: args.seed as u64,
        wall_s: clock.began.elapsed().as_secs_f64(),
        first_frame_s: outcome.first_frame_s,
        passes: report::passes(&renderer.frame.timings),
        stages: clock.stages(),
        memory: report::memory(&memory, plan.bytes()),
        paths: renderer.totals.paths,
        lookups_per_path: renderer.totals.lookups as f64 / renderer.totals.paths as f64,
        relative_error: outcome.relative_error,
        cache: None,
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
        eprintln!("{}", last_line(&stats, &files, &outcome.why_stopped));
    }
    match INTERRUPTED.load(Ordering::Relaxed) {
        true => Ok(INTERRUPTED_STATUS),
        false => Ok(0),
    }
}

fn goal(stop: &Stop) -> Goal {
    Goal {
        spp: stop.spp.map(|n| n.get() as u64),
        seconds: stop.time.map(|t| t.as_secs_f64()),
        relative_error: stop.relative_error,
    }
}

fn catch_interrupts() {
    // Fails only where a handler is set already, and that one does the same.
    let _ = ctrlc::set_handler(|| INTERRUPTED.store(true, Ordering::Relaxed));
}

/// Unit after unit, until `stop` or Ctrl-C. `--time` counts from here, not from the program's start.
fn trace_until(
    stop: &Stop,
    renderer: &mut Renderer,
    scene: &Scene,
    program_began: Instant,
    mut progress: Progress,
) -> Result<Outcome> {
    let began = Instant::now();
    let mut first_frame_s = f64::NAN;
    let mut done = Done {
        samples: 0,
        units: 0,
        took: began.elapsed(),
        relative_error: f64::INFINITY,
    };
    let why_stopped = loop {
        if let Some(reason) = reason_to_stop(stop, &done) {
            break reason;
        }
        if !renderer.unit(next_unit(stop, &done), &INTERRUPTED)? {
            break "of Ctrl-C".into();
        }
        if done.units == 0 {
            first_frame_s = program_began.elapsed().as_secs_f64();
        }
        done.samples = renderer.totals.samples;
        done.units = renderer.totals.units;
        done.relative_error = match done.units {
            1 => f64::INFINITY,
            _ => {
                let film = renderer.film()?;
                relative_error(&rgb(&film.mean), &film.stderr)
            }
        };
        done.took = began.elapsed();
        progress.update(
            done.samples as u64,
            done.took.as_secs_f64(),
            done.relative_error,
        );
    };
    if done.units == 0 {
        return Err(Error::Interrupted);
    }
    progress.finish();
    Ok(Outcome {
        picture: picture(renderer.film()?, renderer.first_hits()?, scene),
        relative_error: done.relative_error,
        first_frame_s,
        why_stopped,
    })
}

fn rgb(texels: &[[f32; 4]]) -> Vec<[f32; 3]> {
    texels.iter().map(|&[r, g, b, _]| [r, g, b]).collect()
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
    files: &[std::path::PathBuf],
    opened: &Opened,
    picture: &Picture,
    device: &Device,
    seed: u32,
) -> Result<()> {
    let provenance = Provenance {
        scene: describe(&opened.file, &opened.volume, &opened.scene),
        seed,
        device: device.summary.name.clone(),
        software: concat!("isolume ", env!("CARGO_PKG_VERSION")).into(),
    };
    for file in files {
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

fn last_line(stats: &Stats, files: &[std::path::PathBuf], why_stopped: &str) -> String {
    let files: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
    format!(
        "{}: {} samples per pixel in {:.1} s, relative error {:.4}, stopped because {why_stopped}; {} on {}",
        files.join(", "),
        stats.spp,
        stats.wall_s,
        stats.relative_error,
        stats.variant,
        stats.device,
    )
}
