//! Keeps a render's state on disk while it works: at intervals, when SIGUSR1 asks for it, and at its end.

use std::path::Path;
use std::time::{Duration, Instant, SystemTime};

use super::shards::{Origin, to_json};
use super::views::{Saved, View};
use crate::cli::RenderArgs;
use crate::engine::{Engine, Stopwatch};
use crate::error::Result;
use crate::interrupt;
use crate::output::{Outputs, Parts};
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
    pub origin: Origin,
    /// Identity of the scene as it was opened; an orbit's pictures have other cameras.
    identity: Identity,
    filling: Filling,
    runs: Vec<RunOf>,
    began: Instant,
    /// When the checkpoint was last written.
    written: Instant,
}

/// The state of the cache's filling; a variant without a cache needs none.
#[derive(Clone, Copy, PartialEq)]
enum Filling {
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
            origin: Origin {
                volume,
                fill: found.fill(),
            },
            filling: match found.is_filled() {
                true => Filling::Done,
                false => Filling::UnderWay,
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
        self.filling == Filling::Done
    }

    /// Restores the picture under way. The engine's scene must be that of the picture.
    pub fn restore_picture(&self, engine: &mut Engine) -> Result<()> {
        self.found.restore_picture(engine)
    }

    /// To be called when the filling of the cache has ended; `is_enough` says whether the cache is good enough.
    pub fn fill_ended(&mut self, engine: &mut Engine, is_enough: bool) -> Result<()> {
        self.filling = match is_enough {
            true => Filling::Done,
            false => Filling::Interrupted,
        };
        if is_enough && let Some(fill) = self.write_cache(engine)? {
            self.origin.fill = Some(fill);
        }
        Ok(())
    }

    /// To be called whenever the state could be continued: writes the checkpoint, if it is time. An error of the file
    /// is only reported: a disk that is full now may have room the next time.
    pub fn step(&mut self, engine: &mut Engine, view: &View, watch: &Stopwatch) -> Result<()> {
        let is_asked = interrupt::takes_request();
        let is_last = self.filling == Filling::UnderWay && interrupt::is_interrupted();
        let is_due = self.written.elapsed() >= self.subject.args.checkpoint_every;
        if self.filling == Filling::Interrupted || !(is_asked || is_last || is_due) {
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

    /// Writes the state of the render, unless it cannot be continued.
    pub fn write(&mut self, engine: &mut Engine, view: &View, watch: &Stopwatch) -> Result<()> {
        match self.filling {
            Filling::Interrupted => return Ok(()),
            Filling::UnderWay => self.write_cache(engine).map(drop)?,
            Filling::Done => {}
        }
        let origin = match self.filling {
            Filling::Done => &self.origin,
            _ => &Origin {
                volume: self.origin.volume.clone(),
                fill: None,
            },
        };
        let mut saved = Saved::of(engine, view, self.subject.opened, Some(origin))?;
        let Some((header, sums)) = saved.parts.take() else {
            return Ok(());
        };
        if let Some(run) = self.runs.last_mut() {
            run.seconds = self.began.elapsed().as_secs_f64();
            run.samples = engine.totals().samples;
        }
        let state = State {
            header,
            settings: Settings::of(&engine.choice().plan.variant),
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

    /// Writes the cache's state, and returns the fingerprint of its light.
    fn write_cache(&self, engine: &mut Engine) -> Result<Option<String>> {
        let opened = self.subject.opened;
        let settings = Settings::of(&engine.choice().plan.variant);
        CacheFile::write(
            self.path,
            engine,
            About {
                identity: &self.identity,
                scene: &describe(&opened.file, &opened.volume, &opened.scene),
                settings,
                is_filled: self.filling == Filling::Done,
            },
        )
    }
}
