//! Keeps a render's state on disk while it works: at intervals, when SIGUSR1 asks for it, and at its end.

use std::path::Path;
use std::time::{Duration, Instant, SystemTime};

use super::shards::{Fingerprints, to_json};
use super::views::{Saved, View};
use crate::cli::RenderArgs;
use crate::engine::{Engine, Stopwatch};
use crate::error::Result;
use crate::interrupt;
use crate::output::{Outputs, Parts};
use crate::render::doubling;
use crate::scene::{Opened, Scene, describe};
use crate::shard::{About, CacheFile, Found, Identity, Named, RunOf, Settings, State};

/// The render whose state is kept.
pub struct Subject<'a> {
    pub args: &'a RenderArgs,
    pub opened: &'a Opened,
    pub views: &'a [View],
}

/// A checkpoint and the state of keeping it.
pub struct Keeper<'a> {
    path: &'a Path,
    subject: Subject<'a>,
    found: Found,
    pub fingerprints: Fingerprints,
    /// Identity of the scene as it was opened; an orbit's pictures have other cameras.
    identity: Identity,
    fill_state: FillState,
    runs: Vec<RunOf>,
    began: Instant,
    /// When the checkpoint was last written.
    written: Instant,
}

/// The state of the cache's filling; a variant without a cache needs none.
#[derive(Clone, Copy, PartialEq)]
enum FillState {
    UnderWay,
    /// Some nodes have had a batch and some not, so the cache cannot be continued.
    Interrupted,
    Done,
}

impl<'a> Keeper<'a> {
    /// Continues from the checkpoint, if there is one, and restores the cache. `volume` is the volume's fingerprint.
    ///
    /// # Errors
    ///
    /// If the checkpoint belongs to another render, or is damaged.
    pub fn begin(
        path: &'a Path,
        subject: Subject<'a>,
        found: Found,
        engine: &mut Engine,
        volume: String,
    ) -> Result<Keeper<'a>> {
        let Subject {
            args,
            opened,
            views,
        } = subject;
        let identified = |scene: &Scene| -> Result<(Identity, String)> {
            let text = describe(&opened.file, &opened.volume, scene);
            Ok((Identity::of(engine, scene, &text, &volume)?, text))
        };
        let (identity, text) = identified(&opened.scene)?;
        let number = found.state().map_or(1, |state| state.picture);
        let view = views.get(number.saturating_sub(1) as usize);
        let (picture, picture_text) = identified(view.map_or(&opened.scene, |view| &view.scene))?;
        let wanted = |identity, scene| Named {
            name: "this render",
            identity,
            scene,
        };
        let stop = args.stop(opened.scene.render.variant);
        found.check(
            &wanted(&picture, &picture_text),
            &wanted(&identity, &text),
            &stop,
            views.len(),
        )?;
        found.restore_cache(engine)?;
        let mut runs = found.state().map_or(Vec::new(), |state| state.runs.clone());
        let since_1970 = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        runs.push(RunOf {
            host: sysinfo::System::host_name().unwrap_or_default(),
            device: engine.host().summary().name.clone(),
            began: since_1970.map_or(0, |time| time.as_secs()),
            seconds: 0.0,
            samples: 0,
        });
        Ok(Keeper {
            path,
            fingerprints: Fingerprints {
                volume,
                fill: found.fill(),
            },
            fill_state: match found.is_filled() {
                true => FillState::Done,
                false => FillState::UnderWay,
            },
            subject,
            found,
            identity,
            runs,
            began: Instant::now(),
            written: Instant::now(),
        })
    }

    /// Index of the picture under way.
    pub fn picture(&self) -> usize {
        let number = self.found.state().map_or(1, |state| state.picture);
        number.saturating_sub(1) as usize
    }

    /// The time that has been spent on the picture under way.
    pub fn seconds(&self) -> Duration {
        let seconds = self.found.state().map_or(0.0, |state| state.seconds);
        Duration::try_from_secs_f64(seconds).unwrap_or_default()
    }

    pub fn is_filled(&self) -> bool {
        self.fill_state == FillState::Done
    }

    /// Restores the picture under way. The engine's scene must be that of the picture.
    pub fn restore_picture(&self, engine: &mut Engine) -> Result<()> {
        self.found.restore_picture(engine)
    }

    /// To be called when the filling of the cache has ended; `is_enough` says whether the cache is good enough.
    pub fn fill_ended(&mut self, engine: &mut Engine, is_enough: bool) -> Result<()> {
        if is_enough {
            self.fill_state = FillState::Done;
            self.fingerprints.fill = self.write_cache(engine)?;
        } else {
            self.fill_state = FillState::Interrupted;
            let volume = self.fingerprints.volume.clone();
            self.fingerprints = Fingerprints::of(engine, volume)?;
        }
        Ok(())
    }

    /// To be called whenever the state could be continued: writes the checkpoint, if it is time. An error of the file
    /// is only reported: a disk that is full now may have room the next time.
    pub fn step(&mut self, engine: &mut Engine, view: &View, watch: &Stopwatch) -> Result<()> {
        let is_asked = interrupt::takes_request();
        let is_last = self.fill_state == FillState::UnderWay && interrupt::is_interrupted();
        let unwritten = self
            .written
            .elapsed()
            .saturating_add(self.next_batch(engine));
        let is_due = unwritten >= self.subject.args.checkpoint_every;
        if self.fill_state == FillState::Interrupted || !(is_asked || is_last || is_due) {
            return Ok(());
        }
        match self.write(engine, view, watch) {
            Err(error) if error.is_about_input() => {
                eprintln!("note: no checkpoint was written: {error}")
            }
            other => other?,
        }
        self.written = Instant::now();
        Ok(())
    }

    /// The time that the cache's next batch is expected to take, during which nothing can be written.
    fn next_batch(&self, engine: &Engine) -> Duration {
        let is_under_way = self.fill_state == FillState::UnderWay;
        let cache = engine.renderer().cache().filter(|_| is_under_way);
        let seconds = cache.map_or(0.0, |cache| {
            cache.seconds_per_update() * f64::from(doubling(cache.updates))
        });
        Duration::try_from_secs_f64(seconds).unwrap_or_default()
    }

    /// Writes the state of the render, unless it cannot be continued.
    pub fn write(&mut self, engine: &mut Engine, view: &View, watch: &Stopwatch) -> Result<()> {
        if self.fill_state == FillState::Interrupted {
            self.tell_of_none();
            return Ok(());
        }
        self.found.make_way()?;
        if self.fill_state == FillState::UnderWay {
            self.write_cache(engine)?;
        }
        let mut saved = Saved::of(engine, view, self.subject.opened, Some(&self.fingerprints))?;
        let Some((header, sums)) = saved.parts.take() else {
            return Ok(());
        };
        if let Some(run) = self.runs.last_mut() {
            run.seconds = self.began.elapsed().as_secs_f64();
            run.samples = engine.totals().samples;
        }
        let state = State {
            header,
            settings: settings(engine),
            picture: view.number,
            pictures: self.subject.views.len() as u32,
            seconds: watch.elapsed().as_secs_f64(),
            runs: self.runs.clone(),
        };
        let parts = Parts {
            header: &to_json(&state)?,
            sums: &sums,
            is_quick: true,
        };
        let mut outputs = Outputs::default();
        outputs.exr_with(self.path, &saved.picture, &saved.provenance, parts)?;
        outputs.commit()
    }

    /// Says that no checkpoint was written because of the moment of the interruption.
    fn tell_of_none(&self) {
        if self.subject.args.quiet {
            return;
        }
        let path = self.path.display();
        let before = match self.path.exists() {
            true => format!("{path} is as it was before"),
            false => format!("there is no {path}"),
        };
        eprintln!(
            "note: no checkpoint was written at the end, since the interruption came in the middle of a batch of the \
             cache's paths: {before}"
        );
    }

    /// Writes the cache's state, and returns the fingerprint of its light; `None` without a cache.
    fn write_cache(&mut self, engine: &mut Engine) -> Result<Option<String>> {
        if engine.renderer().cache().is_none() {
            return Ok(None);
        }
        self.found.make_way()?;
        let opened = self.subject.opened;
        let settings = settings(engine);
        CacheFile::write(
            self.path,
            engine,
            About {
                identity: &self.identity,
                scene: &describe(&opened.file, &opened.volume, &opened.scene),
                settings,
                is_filled: self.is_filled(),
            },
        )
    }
}

fn settings(engine: &Engine) -> Settings {
    let choice = engine.choice();
    Settings::of(&choice.plan.variant, &choice.reason)
}
