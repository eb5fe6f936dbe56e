//! `isolume render`: opens, plans, renders until the stop is reached, and writes.

use std::cmp::Ordering;
use std::num::NonZeroU32;
use std::time::Duration;

use super::checkpoint::{Earlier, Keeper, KeptRender};
use super::clock::Clock;
use super::interruptible;
use super::preparation::{choose, open, prepare, try_variants};
use super::shards::Fingerprints;
use super::summary::{RenderedPicture, Summary, Taken};
use super::views::{Saved, View, files, views};
use crate::cli::RenderArgs;
use crate::engine::{Engine, Host, Outcome, Run, Stop, Stopwatch, Subject, Task, Tried};
use crate::error::{Error, Result};
use crate::interrupt::{self, is_interrupted};
use crate::output::progress::ProgressLine;
use crate::output::stats::{FILL_CACHE, RENDER};
use crate::output::{Outputs, check_inputs_stay, check_writable};
use crate::scene::Opened;
use crate::shard::{Found, side_files};

pub fn render(args: &RenderArgs) -> Result<u8> {
    interrupt::catch_signals();
    let mut clock = Clock::new();
    let others = [&args.checkpoint, &args.stats, &args.profile];
    let beside = args.checkpoint.as_deref().map(side_files);
    let pictures = files(args);
    let outputs = || {
        let others = others.into_iter().flatten();
        pictures
            .iter()
            .flatten()
            .chain(others)
            .chain(beside.iter().flatten())
    };
    check_writable(outputs())?;
    let (opened, host) = open(args, &mut clock)?;
    let inputs = [vec![args.scene.input.clone()], opened.inputs()?].concat();
    check_inputs_stay(outputs(), &inputs)?;
    let views = views(pictures, args, &opened);
    let mut render = Render::begin(args, &host, &opened, &views, clock)?;
    render.fill()?;
    let pictures = render.take_pictures();
    // What has been sampled is kept, also where a picture's file cannot be written.
    let kept = match &pictures {
        Err(error) if !error.is_about_input() => Ok(()),
        _ => render.keep(),
    };
    let (mut outputs, taken) = pictures?;
    host.check_validation()?;
    let Render {
        clock,
        engine,
        keeper,
        stop,
        progress,
        ..
    } = render;
    progress.finish();
    let restored_paths = keeper.as_ref().map_or(0, Keeper::restored_paths);
    let mut summary = Summary::of(args, &clock, engine, restored_paths, &taken, &stop);
    summary.stage(&mut outputs, &host, &clock)?;
    outputs.commit()?;
    kept?;
    if !args.quiet {
        summary.print();
    }
    Ok(interrupt::status())
}

/// A render under way.
struct Render<'a> {
    args: &'a RenderArgs,
    opened: &'a Opened,
    views: &'a [View],
    stop: Stop,
    clock: Clock,
    progress: ProgressLine,
    engine: Engine,
    /// Time spent on the picture under way, by earlier runs as well; for the first picture it includes the filling of the
    /// cache.
    watch: Stopwatch,
    /// `Some` with `--checkpoint`.
    keeper: Option<Keeper<'a>>,
    /// Fingerprint of the volume, for shards without a checkpoint.
    volume: Option<String>,
    /// The time that earlier runs have spent on the picture under way, according to the checkpoint.
    earlier: Duration,
    /// Index of the picture under way: at first that of the checkpoint.
    under_way: usize,
    /// How the last picture was begun.
    beginning: Beginning,
}

/// How a picture is begun.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Beginning {
    /// It was done before, and a file of it is gone. Meanwhile the checkpoint stays that of the picture under way.
    Again,
    /// As the picture under way: where the checkpoint ends, or else with what the cache was filled for it.
    UnderWay,
    /// As the next one, with its first sample.
    Next,
}

impl<'a> Render<'a> {
    /// Plans, makes the engine, and restores the state of a checkpoint.
    fn begin(
        args: &'a RenderArgs,
        host: &Host,
        opened: &'a Opened,
        views: &'a [View],
        mut clock: Clock,
    ) -> Result<Render<'a>> {
        let found = args
            .checkpoint
            .as_ref()
            .map(|path| Found::open(path, args.restart))
            .transpose()?;
        let before = found.as_ref().and_then(Found::settings);
        let stop = args.stop(opened.scene.render.variant);
        let subject = Subject {
            host,
            volume: &opened.volume,
            scene: &opened.scene,
            seed: args.seed,
        };
        let task = before.is_none().then_some(Task {
            stop,
            pictures: args.orbit.map_or(1, NonZeroU32::get),
            interrupt: &interrupt::INTERRUPTED,
        });
        let choice = clock.time("plan", || choose(args, &subject, before))?;
        let (tried, fingerprint) = try_variants(args, subject, choice, task, &mut clock)?;
        let Tried {
            mut engine,
            mut watch,
            was_interrupted,
        } = tried;
        prepare(&mut engine, args, &stop);
        let kept = KeptRender {
            args,
            opened,
            views,
            is_variant_open: was_interrupted,
        };
        let keeper = match (&args.checkpoint, found, fingerprint.clone()) {
            (Some(path), Some(found), Some(volume)) => {
                let take_up = || Keeper::begin(path, kept, found, &mut engine, volume);
                Some(clock.time("open the checkpoint", take_up)?)
            }
            _ => None,
        };
        let earlier = keeper.as_ref().map_or(Earlier::default(), Keeper::earlier);
        watch.add(earlier.took, earlier.cpu);
        watch.go_on();
        Ok(Render {
            args,
            opened,
            views,
            stop,
            clock,
            progress: ProgressLine::new(args.quiet, stop),
            engine,
            watch,
            volume: fingerprint.filter(|_| keeper.is_none()),
            earlier: earlier.took,
            under_way: keeper.as_ref().map_or(0, Keeper::picture),
            beginning: Beginning::UnderWay,
            keeper,
        })
    }

    /// Fills the cache, if there is one that has not been filled before.
    fn fill(&mut self) -> Result<()> {
        if self.keeper.as_ref().is_some_and(Keeper::is_filled) {
            return Ok(());
        }
        let Render {
            engine,
            keeper,
            watch,
            progress,
            ..
        } = self;
        let view = &self.views[self.under_way];
        let mut between = |engine: &mut Engine| match keeper {
            Some(keeper) => keeper.step(engine, view, watch),
            None => Ok(()),
        };
        let mut show = |step| progress.show(step);
        let mut run = Run {
            between: Some(&mut between),
            ..interruptible(self.stop, &mut show)
        };
        let pictures = self.views.len() as u32;
        let is_enough = self
            .clock
            .time(FILL_CACHE, || engine.fill(&mut run, pictures))?;
        match keeper {
            Some(keeper) => self.clock.time("write the checkpoint", || {
                keeper.fill_ended(engine, is_enough)
            }),
            None => Ok(()),
        }
    }

    /// Takes one picture after another, until all are done or an interruption has come. An orbit's files have their
    /// final names then; those of a single picture still have temporary ones.
    fn take_pictures(&mut self) -> Result<(Outputs, Taken<'a>)> {
        let fingerprints = match self.volume.take() {
            Some(volume) => Some(Fingerprints::of(&mut self.engine, volume)?),
            None => None,
        };
        let mut outputs = Outputs::independent();
        let (mut pictures, mut missing) = (Vec::new(), None);
        for (index, view) in self.views.iter().enumerate() {
            let beginning = self.beginning_of(index);
            if beginning == Beginning::Again && view.files.iter().all(|file| file.exists()) {
                continue;
            }
            let outcome = if is_interrupted() && !pictures.is_empty() {
                Err(Error::Interrupted)
            } else {
                self.begin_picture(index, beginning)
                    .and_then(|()| self.take_picture(view))
            };
            // One that is made again must not be half as good as the others: no checkpoint would tell.
            let outcome = if beginning == Beginning::Again && is_interrupted() {
                Err(Error::Interrupted)
            } else {
                outcome
            };
            let outcome = match outcome {
                // The pictures before it are there all the same.
                Err(Error::Interrupted) if !pictures.is_empty() => {
                    missing = Some(view.number);
                    break;
                }
                outcome => outcome?,
            };
            let earlier = match beginning {
                Beginning::UnderWay => self.earlier,
                Beginning::Again | Beginning::Next => Duration::ZERO,
            };
            pictures.push(RenderedPicture {
                view,
                outcome,
                earlier,
            });
            self.stage(view, fingerprints.as_ref(), &mut outputs)?;
            if self.args.orbit.is_some() {
                std::mem::replace(&mut outputs, Outputs::independent()).commit()?;
            }
        }
        Ok((outputs, Taken { pictures, missing }))
    }

    fn beginning_of(&self, index: usize) -> Beginning {
        match index.cmp(&self.under_way) {
            Ordering::Less => Beginning::Again,
            Ordering::Equal => Beginning::UnderWay,
            Ordering::Greater => Beginning::Next,
        }
    }

    /// Turns to the picture with this index.
    fn begin_picture(&mut self, index: usize, beginning: Beginning) -> Result<()> {
        let Render { engine, clock, .. } = self;
        self.beginning = beginning;
        self.watch.pause();
        if index > 0 {
            let scene = &self.views[index].scene;
            let changed = clock.time("look from elsewhere", || engine.change_in_place(scene))?;
            changed.must_be_possible()?;
        }
        match beginning {
            Beginning::Again => {}
            Beginning::UnderWay => {
                self.watch.go_on();
                if let Some(keeper) = &mut self.keeper {
                    clock.time("open the checkpoint", || keeper.restore_picture(engine))?;
                }
            }
            Beginning::Next => {
                self.under_way = index;
                self.watch = Stopwatch::started();
            }
        }
        Ok(())
    }

    fn take_picture(&mut self, view: &View) -> Result<Outcome> {
        let Render {
            engine,
            keeper,
            watch,
            progress,
            ..
        } = self;
        progress.begin_picture();
        let mut own_watch = Stopwatch::started();
        let (mut keeper, watch) = match self.beginning {
            Beginning::Again => (None, &mut own_watch),
            Beginning::UnderWay | Beginning::Next => (keeper.as_mut(), watch),
        };
        let mut between = |engine: &mut Engine| match &mut keeper {
            Some(keeper) => keeper.step(engine, view, watch),
            None => Ok(()),
        };
        let mut show = |step| progress.show(step);
        let mut run = Run {
            between: Some(&mut between),
            ..interruptible(self.stop, &mut show)
        };
        self.clock.time(RENDER, || engine.sample(&mut run, watch))
    }

    /// Writes a picture's files under temporary names. `fingerprints` is set for shards without a checkpoint.
    fn stage(
        &mut self,
        view: &View,
        fingerprints: Option<&Fingerprints>,
        outputs: &mut Outputs,
    ) -> Result<()> {
        let Render { engine, opened, .. } = self;
        let kept = self.keeper.as_ref().filter(|_| self.args.samples.is_some());
        let fingerprints = fingerprints.or(kept.map(|keeper| &keeper.fingerprints));
        self.clock.time("save the pictures", || match fingerprints {
            Some(fingerprints) => {
                let (saved, parts) = Saved::with_parts(engine, view, opened, fingerprints)?;
                saved.stage(outputs, view, opened, Some(&parts))
            }
            None => Saved::of(engine, view, opened)?.stage(outputs, view, opened, None),
        })
    }

    /// Writes the checkpoint at the end.
    fn keep(&mut self) -> Result<()> {
        match (&mut self.keeper, self.beginning) {
            (None, _) | (_, Beginning::Again) => Ok(()),
            (Some(keeper), Beginning::UnderWay | Beginning::Next) => {
                keeper.end(&mut self.engine, &self.views[self.under_way], &self.watch)
            }
        }
    }
}
