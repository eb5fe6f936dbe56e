//! Writes a render's state to disk while it works: at intervals, when SIGUSR1 asks for it, and at its end.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::checkpointed_render::CheckpointedRender;
use super::views::{Saved, Summed, View};
use crate::engine::{Engine, Stopwatch};
use crate::error::Result;
use crate::interrupt;
use crate::output::{Continuation, Outputs, say};
use crate::scene::describe;
use crate::shard::{
    About, CacheFile, Fingerprint, Fingerprints, Found, Identity, Manner, RunOf, Settings, State,
};

/// A checkpoint and the state of writing it.
pub struct CheckpointWriter<'a> {
    path: &'a Path,
    render: CheckpointedRender<'a>,
    found: Found,
    /// Paths of earlier runs, for the cache and for the picture that have been restored.
    restored_paths: u64,
    pub fingerprints: Fingerprints,
    /// Identity of the scene as it was opened; an orbit's pictures have other cameras.
    identity: Identity,
    fill_state: FillState,
    manner: Manner,
    /// As in [`State`].
    written: Vec<BTreeMap<String, String>>,
    runs: Vec<RunOf>,
    began: Instant,
    /// When a checkpoint was last due, whether it could be written or not; at first, when the work began.
    last_due: Instant,
}

/// The time that earlier runs have spent on the picture under way.
#[derive(Debug, Clone, Copy, Default)]
pub struct Earlier {
    pub took: Duration,
    pub cpu: Duration,
}

/// The state of the cache's filling; a variant without a cache needs none.
#[derive(Clone, Copy, PartialEq)]
enum FillState {
    UnderWay,
    /// The checkpoint holds the state in which an interruption has found the filling, after a whole batch.
    Written,
    /// Some nodes have had a batch and some not, so the cache cannot be continued.
    Interrupted,
    /// `is_saved`: the state of the filled cache is on disk.
    Done {
        is_saved: bool,
    },
}

impl<'a> CheckpointWriter<'a> {
    /// Continues from the checkpoint, if there is one, and restores the cache. `fingerprints` has only the volume's so far.
    ///
    /// # Errors
    ///
    /// If the checkpoint belongs to another render, or is damaged.
    pub fn begin(
        path: &'a Path,
        render: CheckpointedRender<'a>,
        found: Found,
        engine: &mut Engine,
        mut fingerprints: Fingerprints,
    ) -> Result<CheckpointWriter<'a>> {
        let manner = render.manner();
        let identity = render.check(&found, &manner, engine, &fingerprints.volume)?;
        let paths_before = engine.paths();
        found.restore_cache(engine)?;
        let restored_paths = engine.paths().saturating_sub(paths_before);
        let written = found
            .state()
            .map_or(Vec::new(), |state| state.written.clone());
        let mut runs = found.state().map_or(Vec::new(), |state| state.runs.clone());
        runs.push(RunOf::begun_now(engine));
        fingerprints.fill = found.fill();
        fingerprints.devices_before = found.devices();
        Ok(CheckpointWriter {
            path,
            fingerprints,
            fill_state: if found.is_filled() {
                FillState::Done { is_saved: true }
            } else {
                FillState::UnderWay
            },
            render,
            found,
            restored_paths,
            identity,
            manner,
            written,
            runs,
            began: Instant::now(),
            last_due: Instant::now(),
        })
    }

    /// Index of the picture under way.
    pub fn picture(&self) -> usize {
        let number = self.found.state().map_or(1, |state| state.picture);
        number.saturating_sub(1) as usize
    }

    /// Whether the files of an orbit's picture are those that this render has written. Where that cannot be told, as of
    /// pipes, they are not.
    pub fn has_written(&self, index: usize, files: &[PathBuf]) -> bool {
        let Some(written) = self.written.get(index) else {
            return false;
        };
        let is_kept = |file: &PathBuf| {
            let before = written.get(&name_of(file));
            before.is_some_and(|before| Fingerprint::of_file(file).is_ok_and(|now| now == *before))
        };
        files.iter().all(is_kept)
    }

    /// To be called once the files of an orbit's picture have their names.
    pub fn picture_written(&mut self, index: usize, files: &[PathBuf]) {
        if self.written.len() <= index {
            self.written.resize(index + 1, BTreeMap::new());
        }
        for file in files {
            if let Ok(fingerprint) = Fingerprint::of_file(file) {
                self.written[index].insert(name_of(file), fingerprint);
            }
        }
    }

    /// The time that has been spent on the picture under way.
    pub fn earlier(&self) -> Earlier {
        let state = self.found.state();
        let time = |seconds: fn(&State) -> f64| {
            Duration::try_from_secs_f64(state.map_or(0.0, seconds)).unwrap_or_default()
        };
        // A process that ended right after it had filled the cache has written nothing else.
        let filling = match self.picture() {
            0 => self.found.filled_for(),
            _ => Duration::ZERO,
        };
        Earlier {
            took: time(|state| state.seconds).max(filling),
            cpu: time(|state| state.cpu_seconds),
        }
    }

    pub fn restored_paths(&self) -> u64 {
        self.restored_paths
    }

    pub fn is_filled(&self) -> bool {
        matches!(self.fill_state, FillState::Done { .. })
    }

    /// To be called before each picture: `is_continued` if earlier runs may have begun it, on other devices.
    pub fn begin_picture(&mut self, is_continued: bool) {
        self.fingerprints.devices_before = if is_continued {
            self.found.devices()
        } else {
            Vec::new()
        };
    }

    /// Restores the picture under way. The engine's scene must be that of the picture.
    pub fn restore_picture(&mut self, engine: &mut Engine) -> Result<()> {
        let before = engine.paths();
        self.found.restore_picture(engine)?;
        self.restored_paths += engine.paths() - before;
        Ok(())
    }

    /// To be called when the filling of the cache has ended; `is_final` says whether no run gives it any more paths.
    pub fn fill_ended(&mut self, engine: &mut Engine, is_final: bool) -> Result<()> {
        if is_final {
            self.fill_state = FillState::Done { is_saved: false };
            let is_saved = noted(self.save_filled(engine))?;
            self.fill_state = FillState::Done { is_saved };
            if is_saved {
                return Ok(());
            }
        } else if self.fill_state != FillState::Written {
            self.fill_state = FillState::Interrupted;
        }
        self.fingerprints.add_fill(engine)
    }

    /// Writes the state of a cache that is filled.
    fn save_filled(&mut self, engine: &mut Engine) -> Result<()> {
        let mut outputs = Outputs::default();
        self.fingerprints.fill = self.write_cache_aside(engine, &mut outputs)?;
        // Without a cache there is nothing yet that an older checkpoint could make way for.
        match self.fingerprints.fill {
            Some(_) => self.commit(outputs),
            None => Ok(()),
        }
    }

    /// To be called whenever the state could be continued: writes the checkpoint, if it is time.
    pub fn step(&mut self, engine: &mut Engine, view: &View, watch: &Stopwatch) -> Result<()> {
        let is_last = self.fill_state == FillState::UnderWay && interrupt::is_interrupted();
        let unwritten = self
            .last_due
            .elapsed()
            .saturating_add(self.time_of_next_batch(engine));
        let is_due = unwritten >= self.render.args.checkpoint_every;
        if self.obstacle().is_some() || self.fill_state == FillState::Written {
            return Ok(());
        }
        // A request that comes where nothing can be written waits.
        let is_asked = interrupt::takes_request();
        if !(is_asked || is_last || is_due) {
            return Ok(());
        }
        let is_written = noted(self.write(engine, view, watch))?;
        if is_written && is_last {
            self.fill_state = FillState::Written;
        }
        self.last_due = Instant::now();
        Ok(())
    }

    /// The moment at which the work is, if the render could not be continued from it.
    fn obstacle(&self) -> Option<&'static str> {
        if self.render.is_variant_open {
            Some("before it was known which variant is the fastest")
        } else if self.fill_state == FillState::Interrupted {
            Some("in the middle of a batch of the cache's paths")
        } else {
            None
        }
    }

    /// The time that the cache's next batch is expected to take, during which nothing can be written.
    fn time_of_next_batch(&self, engine: &Engine) -> Duration {
        let seconds = match self.fill_state {
            FillState::UnderWay => engine.seconds_of_next_batch(),
            _ => 0.0,
        };
        Duration::try_from_secs_f64(seconds).unwrap_or_default()
    }

    /// To be called when the work has ended: writes the checkpoint, unless the render could not be continued from it or it is
    /// written already.
    pub fn end(&mut self, engine: &mut Engine, view: &View, watch: &Stopwatch) -> Result<()> {
        match self.obstacle() {
            Some(moment) => self.tell_of_none(moment),
            None if self.fill_state == FillState::Written => {}
            None => self.write(engine, view, watch)?,
        }
        Ok(())
    }

    /// Writes the state of the render.
    fn write(&mut self, engine: &mut Engine, view: &View, watch: &Stopwatch) -> Result<()> {
        let mut outputs = Outputs::default();
        if self.fill_state != (FillState::Done { is_saved: true }) {
            self.write_cache_aside(engine, &mut outputs)?;
        }
        let (saved, Summed { header, sums }) =
            Saved::with_sums(engine, view, self.render.opened, &self.fingerprints)?;
        if let Some(run) = self.runs.last_mut() {
            run.seconds = self.began.elapsed().as_secs_f64();
            run.samples = engine.totals().samples;
        }
        let state = State {
            header,
            settings: settings(engine),
            picture: view.number,
            pictures: self.render.views.len() as u32,
            manner: self.manner.clone(),
            written: self.written.clone(),
            seconds: watch.elapsed().as_secs_f64(),
            cpu_seconds: watch.cpu().as_secs_f64(),
            runs: self.runs.clone(),
        };
        let continuation = Continuation::of(&state, &sums)?.quick();
        outputs.exr_with(self.path, &saved.picture, &saved.provenance, continuation)?;
        self.commit(outputs)?;
        if self.is_filled() {
            self.fill_state = FillState::Done { is_saved: true };
        }
        Ok(())
    }

    /// Gives files that are whole their names, in the place of those of a checkpoint that is ignored.
    fn commit(&mut self, outputs: Outputs) -> Result<()> {
        self.found.make_way()?;
        outputs.commit()
    }

    /// Says that no checkpoint was written because of the moment at which the work ended.
    fn tell_of_none(&self, moment: &str) {
        if self.render.args.quiet {
            return;
        }
        let path = self.path.display();
        let before = if self.path.exists() {
            format!("{path} is as it was before")
        } else {
            format!("there is no {path}")
        };
        say(format!(
            "note: no checkpoint was written at the end, since the interruption came {moment}: {before}"
        ));
    }

    /// Writes the cache's state under a temporary name, and returns the fingerprint of its light; `None` without a cache.
    fn write_cache_aside(
        &self,
        engine: &mut Engine,
        outputs: &mut Outputs,
    ) -> Result<Option<String>> {
        let opened = self.render.opened;
        let settings = settings(engine);
        CacheFile::write_aside(
            self.path,
            engine,
            About {
                identity: &self.identity,
                scene: &describe(&opened.file, &opened.volume, &opened.scene),
                settings,
                is_filled: self.is_filled(),
            },
            outputs,
        )
    }
}

fn name_of(file: &Path) -> String {
    file.file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

/// Returns whether a checkpoint was written. An error of its file is only reported: a disk that is full now may have room
/// the next time.
fn noted(written: Result<()>) -> Result<bool> {
    match written {
        Err(error) if error.is_about_input() => {
            say(format!("note: no checkpoint was written: {error}"));
            Ok(false)
        }
        written => written.map(|()| true),
    }
}

fn settings(engine: &Engine) -> Settings {
    let choice = engine.choice();
    Settings::of(&choice.plan.variant, &choice.reason)
}
