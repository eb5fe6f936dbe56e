//! What comes before the first sample of a render: opening the scene and the device, planning, compiling, and trying variants.

use std::panic::resume_unwind;
use std::thread;

use super::clock::Clock;
use super::open_scene_timed;
use super::shards::check_variant;
use crate::cli::RenderArgs;
use crate::engine::{Engine, Host, Stop, Subject, Task, Trial, Tried};
use crate::error::Result;
use crate::interrupt;
use crate::output::say;
use crate::output::stats::TRY_VARIANTS;
use crate::render::Choice;
use crate::scene::{Opened, Variant};
use crate::shard::{Settings, volume_fingerprint};

/// Opens the scene while the device starts.
pub fn open(args: &RenderArgs, clock: &mut Clock) -> Result<(Opened, Host)> {
    thread::scope(|scope| {
        let host = scope.spawn(|| Host::open(&args.gpu.host_options()));
        let opened = open_scene_timed(&args.scene, args.quiet, clock)?;
        let host = clock.time("open the device", || host.join());
        Ok((opened, host.unwrap_or_else(|panic| resume_unwind(panic))?))
    })
}

/// Plans. What was picked before stands, whatever is free now.
pub fn choose(
    args: &RenderArgs,
    subject: &Subject<'_>,
    before: Option<&Settings>,
) -> Result<Choice> {
    let Subject {
        host,
        volume,
        scene,
        ..
    } = *subject;
    let settled = before.map(|before| before.settle(scene));
    let mut choice = host.plan(volume, settled.as_ref().unwrap_or(scene))?;
    let with_sums = args.samples.is_some() || args.checkpoint.is_some();
    host.check_picture(&choice.plan, scene.render.size, with_sums)?;
    if let Some(before) = before {
        choice.reason = before.reason.clone();
    }
    for (is_given, flag) in [
        (args.samples.is_some(), "--samples"),
        (args.checkpoint.is_some(), "--checkpoint"),
    ] {
        if is_given {
            check_variant(&choice.plan.variant, flag)?;
        }
    }
    Ok(choice)
}

/// Makes the engine; variants are tried, if there is anything to try. Returns the volume's fingerprint as well, if it is
/// needed.
pub fn try_variants(
    args: &RenderArgs,
    subject: Subject<'_>,
    choice: Choice,
    task: Option<Task<'_>>,
    clock: &mut Clock,
) -> Result<(Tried, Option<String>)> {
    let (trial, fingerprint) = clock.time("compile and upload", || {
        compile(args, subject, choice, task)
    })?;
    clock.part("compile", trial.compiling());
    interrupt::keep_work();
    let tried = if trial.is_open() {
        clock.time(TRY_VARIANTS, || trial.end())
    } else {
        trial.end()
    };
    Ok((tried?, fingerprint))
}

/// Makes an engine whose scene still leaves open what was chosen, as do those of the other pictures. Meanwhile computes the
/// fingerprint of the volume for what is to be put together later.
fn compile<'a>(
    args: &RenderArgs,
    subject: Subject<'a>,
    choice: Choice,
    task: Option<Task<'a>>,
) -> Result<(Trial<'a>, Option<String>)> {
    thread::scope(|scope| {
        let walks = args.samples.is_some() || args.checkpoint.is_some();
        let walk = walks.then(|| scope.spawn(|| volume_fingerprint(subject.volume)));
        let begun = Trial::begin(subject, choice, task)?;
        let walked = walk.map(|walk| walk.join().unwrap_or_else(|panic| resume_unwind(panic)));
        Ok((begun, walked.transpose()?))
    })
}

/// Tells a new engine what pictures are to be made, and the user what it cannot do.
pub fn prepare(engine: &mut Engine, args: &RenderArgs, stop: &Stop) {
    let is_published = engine.scene().render.variant == Variant::Published;
    if is_published && args.error.is_some() && !args.quiet {
        say("note: published does not know its error, and does not stop by --error");
    }
    if args.orbit.is_some_and(|pictures| pictures.get() > 1) {
        engine.look_from_everywhere();
    }
    if let Some(shard) = stop.samples {
        engine.begin_at_sample(shard.first);
    }
}
