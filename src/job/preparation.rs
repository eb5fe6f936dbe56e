//! What comes before the first sample of a render: opening the scene and the device, planning, compiling, and trying variants.

use std::num::NonZeroU32;
use std::panic::resume_unwind;
use std::thread;

use super::clock::Clock;
use super::open_scene_timed;
use crate::cli::RenderArgs;
use crate::engine::{Choice, Host, Setup, Stop, Task, Trial, Tried};
use crate::error::{Error, Location, Result};
use crate::interrupt;
use crate::output::say;
use crate::output::stats::TRY_VARIANTS;
use crate::scene::{Opened, Variant};
use crate::shard::{Fingerprints, Settings};

/// Opens the scene while the device starts.
pub fn open(args: &RenderArgs, clock: &mut Clock) -> Result<(Opened, Host)> {
    thread::scope(|scope| {
        let host = scope.spawn(|| Host::open(&args.gpu.host_options()));
        let opened = open_scene_timed(&args.scene, args.quiet, clock)?;
        let host = clock.time("open the device", || host.join());
        Ok((opened, host.unwrap_or_else(|panic| resume_unwind(panic))?))
    })
}

/// Makes the engine for a render that stops at `stop`; variants are tried, if there is anything to try. What was picked
/// `before` stands, whatever is free now. Returns the volume's fingerprint as well, if pictures are to be put together or
/// continued later.
pub fn make_engine(
    args: &RenderArgs,
    setup: Setup<'_>,
    stop: Stop,
    before: Option<&Settings>,
    clock: &mut Clock,
) -> Result<(Tried, Option<Fingerprints>)> {
    let choice = clock.time("plan", || choose(args, &setup, before))?;
    let task = before.is_none().then_some(Task {
        stop,
        pictures: args.orbit.map_or(1, NonZeroU32::get),
        interrupt: &interrupt::INTERRUPTED,
    });
    let (trial, fingerprints) =
        clock.time("compile and upload", || compile(args, setup, choice, task))?;
    clock.part("compile", trial.compiling());
    interrupt::finish_on_interrupt();
    let mut tried = if trial.is_open() {
        clock.time(TRY_VARIANTS, || trial.end())?
    } else {
        trial.end()?
    };
    let is_published = tried.engine.scene().render.variant == Variant::Published;
    if is_published && args.error.is_some() && !args.quiet {
        say(
            "note: the variant \"published\" cannot estimate its error, so --error does not stop it",
        );
    }
    if args.orbit.is_some_and(|pictures| pictures.get() > 1) {
        tried.engine.serve_all_views();
    }
    Ok((tried, fingerprints))
}

/// Plans.
fn choose(args: &RenderArgs, setup: &Setup<'_>, before: Option<&Settings>) -> Result<Choice> {
    let Setup {
        host,
        volume,
        scene,
        ..
    } = *setup;
    let applied = before.map(|before| before.apply_to(scene));
    let mut choice = host.plan(volume, applied.as_ref().unwrap_or(scene))?;
    host.check_picture(volume, &choice.plan, scene.render.size, args.keeps_sums())?;
    if let Some(before) = before {
        choice.reason = before.reason.clone();
    }
    for (is_given, flag) in [
        (args.samples.is_some(), "--samples"),
        (args.checkpoint.is_some(), "--checkpoint"),
    ] {
        if is_given && !choice.plan.variant.has_samples() {
            return Err(Error::input(
                Location::flag(flag),
                format!(
                    "the variant \"{}\" has no samples by number; use another one",
                    choice.plan.variant.word()
                ),
            ));
        }
    }
    Ok(choice)
}

/// Makes an engine whose scene still leaves open what was chosen, as do those of the other pictures. Meanwhile computes the
/// fingerprint of the volume.
fn compile<'a>(
    args: &RenderArgs,
    setup: Setup<'a>,
    choice: Choice,
    task: Option<Task<'a>>,
) -> Result<(Trial<'a>, Option<Fingerprints>)> {
    thread::scope(|scope| {
        let walk = args
            .keeps_sums()
            .then(|| scope.spawn(|| Fingerprints::of_volume(setup.volume)));
        let begun = Trial::begin(setup, choice, task)?;
        let walked = walk.map(|walk| walk.join().unwrap_or_else(|panic| resume_unwind(panic)));
        Ok((begun, walked.transpose()?))
    })
}
