//! `isolume render`: opens, plans, renders until the stop is reached, and writes.

use std::cmp::Ordering;
use std::time::Duration;

use super::checkpoint::{CheckpointWriter, Earlier};
use super::checkpointed_render::CheckpointedRender;
use super::clock::Clock;
use super::interruptible;
use super::preparation::{make_engine, open};
use super::summary::{RenderedPicture, Summary, Taken};
use super::views::{Saved, View, files, views};
use crate::cli::RenderArgs;
use crate::engine::{Engine, Host, Outcome, Run, Setup, Stop, StopReason, Stopwatch, Tried};
use crate::error::{Error, Result};
use crate::interrupt::is_interrupted;
use crate::output::progress::ProgressLine;
use crate::output::stats::{FILL_CACHE, RENDER};
use crate::output::{Outputs, check_inputs_stay, check_writable};
use crate::scene::Opened;
use crate::shard::{Fingerprints, Found, side_files};

pub fn render(args: &RenderArgs) -> Result<u8> {
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
    // The checkpoint is written, also where a picture's file cannot be.
    let checkpointed = match &pictures {
        Err(error) if !error.is_about_input() => Ok(()),
        _ => render.write_checkpoint(),
    };
    let (mut outputs, taken) = pictures?;
    host.check_validation()?;
    let Render {
        clock,
        engine,
        writer,
        stop,
        progress,
        ..
    } = render;
    progress.finish();
    let restored_paths = writer.as_ref().map_or(0, CheckpointWriter::restored_paths);
    let mut summary = Summary::of(args, &clock, engine, restored_paths, &taken, &stop);
    summary.write_aside(&mut outputs, &host, &clock)?;
    outputs.commit()?;
    checkpointed?;
    if !args.quiet {
        summary.print();
    }
    Ok(summary.status())
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
    writer: Option<CheckpointWriter<'a>>,
    /// Of shards; with a checkpoint, its writer has them.
    fingerprints: Option<Fingerprints>,
    /// The time that earlier runs have spent on the picture under way, according to the checkpoint.
    earlier: Duration,
    /// Index of the picture under way: at first that of the checkpoint.
    under_way: usize,
    /// Whether an interruption has cut the trial of variants or the filling of the cache.
    is_cut: bool,
    /// How the picture that the engine has was begun; `None` before the first, and where the engine could not turn to one.
    beginning: Option<Beginning>,
}

/// How a picture is begun.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Beginning {
    /// It was done before, and a file of it is gone. Meanwhile the checkpoint stays that of the picture under way.
    Again,
    /// It is the picture under way: continued from the checkpoint, or begun with the time already spent on filling the
    /// cache.
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
        let stop = args.stop(opened.scene.render.variant);
        let before = found.as_ref().and_then(Found::settings);
        let setup = Setup {
            host,
            volume: &opened.volume,
            scene: &views[0].scene,
            seed: args.seed,
        };
        let (tried, fingerprints) = make_engine(args, setup, stop, before, &mut clock)?;
        let Tried {
            mut engine,
            mut watch,
            was_interrupted,
        } = tried;
        let render = CheckpointedRender {
            args,
            opened,
            views,
            stop,
            is_variant_open: was_interrupted,
        };
        let (writer, fingerprints) = match (&args.checkpoint, found, fingerprints) {
            (Some(path), Some(found), Some(fingerprints)) => {
                let take_up =
                    || CheckpointWriter::begin(path, render, found, &mut engine, fingerprints);
                (Some(clock.time("open the checkpoint", take_up)?), None)
            }
            (_, _, fingerprints) => (None, fingerprints),
        };
        let earlier = writer
            .as_ref()
            .map_or(Earlier::default(), CheckpointWriter::earlier);
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
            fingerprints,
            earlier: earlier.took,
            under_way: writer.as_ref().map_or(0, CheckpointWriter::picture),
            is_cut: was_interrupted,
            beginning: None,
            writer,
        })
    }

    /// Fills the cache, if there is one that has not been filled before.
    fn fill(&mut self) -> Result<()> {
        if self
            .writer
            .as_ref()
            .is_some_and(CheckpointWriter::is_filled)
        {
            return Ok(());
        }
        let Render { engine, clock, .. } = self;
        let pictures = self.views.len() as u32;
        let work = Work {
            stop: self.stop,
            view: &self.views[self.under_way],
            watch: &self.watch,
            progress: &mut self.progress,
        };
        let is_enough = clock.time(FILL_CACHE, || {
            work.run(self.writer.as_mut(), |run| engine.fill(run, pictures))
        })?;
        self.is_cut |= !is_enough && is_interrupted();
        // A cache whose time is over gets no more paths either, even if that cut a batch.
        let has_light = engine.updates() > 0;
        let is_final = is_enough || has_light && !is_interrupted();
        match (&mut self.writer, &mut self.fingerprints) {
            (Some(writer), _) => clock.time("write the checkpoint", || {
                writer.fill_ended(engine, is_final)
            }),
            (None, Some(fingerprints)) => fingerprints.add_fill(engine),
            (None, None) => Ok(()),
        }
    }

    /// Takes one picture after another, until all are done or an interruption has come. An orbit's files have their
    /// final names then; those of a single picture still have temporary ones.
    fn take_pictures(&mut self) -> Result<(Outputs, Taken<'a>)> {
        let mut outputs = Outputs::independent();
        let (mut pictures, mut missing) = (Vec::new(), None);
        for (index, view) in self.views.iter().enumerate() {
            let beginning = self.beginning_of(index);
            let earlier = match beginning {
                Beginning::Again if self.has_written(index, view) => continue,
                Beginning::UnderWay => self.earlier,
                Beginning::Again | Beginning::Next => Duration::ZERO,
            };
            let Some(outcome) = self.take(index, beginning, !pictures.is_empty())? else {
                missing = Some(view.number);
                break;
            };
            pictures.push(RenderedPicture {
                view,
                outcome,
                earlier,
            });
            self.write_aside(view, &mut outputs)?;
            if self.args.orbit.is_some() {
                std::mem::replace(&mut outputs, Outputs::independent()).commit()?;
                if let Some(writer) = &mut self.writer {
                    writer.picture_written(index, &view.files);
                }
            }
        }
        let stopped = pictures.last().map(|picture| &picture.outcome.stopped);
        let is_interrupted =
            self.is_cut || missing.is_some() || stopped == Some(&StopReason::Interrupted);
        let taken = Taken {
            pictures,
            missing,
            is_interrupted,
        };
        Ok((outputs, taken))
    }

    /// Takes the picture with this index. Where an interruption prevents it, that is an error only if there are no others.
    fn take(
        &mut self,
        index: usize,
        beginning: Beginning,
        has_others: bool,
    ) -> Result<Option<Outcome>> {
        let taken = if is_interrupted() && has_others {
            Err(Error::Interrupted)
        } else {
            self.begin_picture(index, beginning)
                .and_then(|()| self.take_picture(&self.views[index], beginning))
        };
        let taken = match taken {
            // One that is made again must not be half as good as the others: no checkpoint would tell.
            Ok(_) if beginning == Beginning::Again && is_interrupted() => Err(Error::Interrupted),
            taken => taken,
        };
        match taken {
            Err(Error::Interrupted) if has_others => Ok(None),
            taken => taken.map(Some),
        }
    }

    fn has_written(&self, index: usize, view: &View) -> bool {
        let writer = self.writer.as_ref();
        writer.is_some_and(|writer| writer.has_written(index, &view.files))
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
        self.beginning = None;
        self.watch.pause();
        if let Some(writer) = &mut self.writer {
            writer.begin_picture(beginning == Beginning::UnderWay);
        }
        if index > 0 {
            let scene = &self.views[index].scene;
            let changed = clock.time("look from elsewhere", || engine.change_in_place(scene))?;
            changed.must_be_possible()?;
        }
        match beginning {
            Beginning::Again => {}
            Beginning::UnderWay => {
                self.watch.go_on();
                if let Some(writer) = &mut self.writer {
                    clock.time("open the checkpoint", || writer.restore_picture(engine))?;
                }
            }
            Beginning::Next => {
                self.under_way = index;
                self.watch = Stopwatch::started();
            }
        }
        self.beginning = Some(beginning);
        Ok(())
    }

    fn take_picture(&mut self, view: &View, beginning: Beginning) -> Result<Outcome> {
        let Render { engine, clock, .. } = self;
        self.progress.begin_picture(view.number, self.views.len());
        let own_watch = Stopwatch::started();
        let (writer, watch) = match beginning {
            Beginning::Again => (None, &own_watch),
            Beginning::UnderWay | Beginning::Next => (self.writer.as_mut(), &self.watch),
        };
        let work = Work {
            stop: self.stop,
            view,
            watch,
            progress: &mut self.progress,
        };
        clock.time(RENDER, || work.run(writer, |run| engine.sample(run, watch)))
    }

    /// Writes a picture's files under temporary names.
    fn write_aside(&mut self, view: &View, outputs: &mut Outputs) -> Result<()> {
        let Render { engine, opened, .. } = self;
        let writer = self.writer.as_ref().filter(|_| self.args.samples.is_some());
        let checkpointed = writer.map(|writer| &writer.fingerprints);
        let fingerprints = checkpointed.or(self.fingerprints.as_ref());
        self.clock.time("save the pictures", || match fingerprints {
            Some(fingerprints) => {
                let (saved, summed) = Saved::with_sums(engine, view, opened, fingerprints)?;
                saved.write_aside(outputs, view, opened, Some(&summed))
            }
            None => Saved::of(engine, view, opened)?.write_aside(outputs, view, opened, None),
        })
    }

    /// Writes the checkpoint at the end, if the engine has the picture under way.
    fn write_checkpoint(&mut self) -> Result<()> {
        match (&mut self.writer, self.beginning) {
            (None, _) | (_, None | Some(Beginning::Again)) => Ok(()),
            (Some(writer), Some(Beginning::UnderWay | Beginning::Next)) => {
                writer.end(&mut self.engine, &self.views[self.under_way], &self.watch)
            }
        }
    }
}

/// Work on a picture: it ends at the stop or with an interruption, and its progress is shown.
struct Work<'a> {
    stop: Stop,
    view: &'a View,
    watch: &'a Stopwatch,
    progress: &'a mut ProgressLine,
}

impl Work<'_> {
    /// Does what `work` makes the engine do; on its way, checkpoints are written.
    fn run<T>(
        self,
        mut writer: Option<&mut CheckpointWriter<'_>>,
        work: impl FnOnce(&mut Run<'_>) -> Result<T>,
    ) -> Result<T> {
        let mut between = |engine: &mut Engine| match &mut writer {
            Some(writer) => writer.step(engine, self.view, self.watch),
            None => Ok(()),
        };
        let mut show = |step| self.progress.show(step);
        work(&mut Run {
            between: Some(&mut between),
            ..interruptible(self.stop, &mut show)
        })
    }
}
