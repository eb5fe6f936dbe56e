//! A render's state on disk: `FILE.exr` shows the picture so far and holds its sums, `FILE.exr.cache` holds the
//! cache.
//!
//! Samples are only kept if they have read a filled cache: while a filling is under way, the picture is the one that
//! the cache shows, and none of its samples count.

use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use serde::{Deserialize, Serialize};

use super::cache_file::CacheFile;
use super::file::{Pixels, has_header, read_header};
use super::header::Header;
use super::identity::Named;
use super::lock::Lock;
use super::settings::Settings;
use crate::engine::{Engine, SampleRange, Stop};
use crate::error::{Error, Location, Result};
use crate::output::target_of;
use crate::render::Totals;
use crate::scene::RenderSettings;

/// The header of a checkpoint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct State {
    #[serde(flatten)]
    pub header: Header,
    pub settings: Settings,
    /// Number of the picture under way, and of all pictures of the orbit; from 1 on.
    pub picture: u32,
    pub pictures: u32,
    #[serde(default)]
    pub manner: Manner,
    /// Of each picture that is done, the fingerprints of its files by their names.
    #[serde(default)]
    pub written: Vec<BTreeMap<String, String>>,
    /// Seconds spent on this picture, over all runs, and those of all cores' CPU time.
    pub seconds: f64,
    #[serde(default)]
    pub cpu_seconds: f64,
    pub runs: Vec<RunOf>,
}

/// The conditions besides the scene under which the pictures of an orbit can be continued.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Manner {
    /// Where they end: "8 samples".
    ends: String,
    /// Exposure and tone of the PNG files; `None` if none are written.
    shown: Option<String>,
}

impl Manner {
    pub fn of(stop: &Stop, render: &RenderSettings, has_pngs: bool) -> Manner {
        let RenderSettings { exposure, tone, .. } = render;
        let shown = || format!("render.exposure {exposure} and render.tone {}", tone.name());
        Manner {
            ends: stop.to_string(),
            shown: has_pngs.then(shown),
        }
    }

    /// How pictures that are there differ from those to come.
    fn difference(&self, to_come: &Manner) -> Option<String> {
        if self.ends != to_come.ends {
            let (had, asked) = (&self.ends, &to_come.ends);
            return Some(format!(
                "its earlier views end after {had}, not after {asked}"
            ));
        }
        let (Some(had), Some(asked)) = (&self.shown, &to_come.shown) else {
            return None;
        };
        (had != asked).then(|| format!("its earlier views are shown with {had}, not with {asked}"))
    }
}

impl State {
    /// How its orbit differs from one of `pictures` pictures.
    fn other_pictures(&self, pictures: usize) -> Option<String> {
        if self.pictures as usize != pictures {
            return Some(format!(
                "it is of {} pictures, not of {pictures} (--orbit)",
                self.pictures
            ));
        }
        if !(1..=self.pictures).contains(&self.picture) {
            let picture = self.picture;
            return Some(format!(
                "it is damaged: its picture {picture} is not one of {pictures}"
            ));
        }
        None
    }

    /// How its earlier pictures were made and shown in another manner.
    fn other_manner(&self, manner: &Manner) -> Option<String> {
        self.manner.difference(manner).filter(|_| self.picture > 1)
    }

    /// How the samples of the picture under way differ from those that `stop` asks for.
    fn other_samples(&self, stop: &Stop) -> Option<String> {
        let had = self.header.samples.first()?;
        let asked = stop.first_sample();
        if had.first != asked || self.header.samples.len() > 1 {
            return Some(format!(
                "its first sample is {}, not {asked} (--samples)",
                had.first
            ));
        }
        None
    }

    /// Fails if the picture under way has more samples than `stop` asks for.
    fn check_goal(&self, name: &str, stop: &Stop) -> Result<()> {
        let had = self.header.count();
        match stop.count().filter(|&goal| goal < had) {
            None => Ok(()),
            Some(goal) => Err(Error::input(
                Location::file(name),
                format!(
                    "it has {had} samples, more than {goal}, which are asked for; --restart begins anew"
                ),
            )),
        }
    }
}

/// One of the runs that a render took.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunOf {
    pub host: String,
    pub device: String,
    /// Its start, in seconds since 1970.
    pub began: u64,
    pub seconds: f64,
    /// Samples of the picture under way at the end of the run.
    pub samples: u32,
}

impl RunOf {
    /// A run of this process, which begins now.
    pub fn begun_now(engine: &Engine) -> RunOf {
        let since_1970 = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        RunOf {
            host: sysinfo::System::host_name().unwrap_or_default(),
            device: engine.host().summary().name.clone(),
            began: since_1970.map_or(0, |time| time.as_secs()),
            seconds: 0.0,
            samples: 0,
        }
    }
}

/// The parts of a checkpoint that exist when a render begins.
pub struct Found {
    path: PathBuf,
    state: Option<(State, String)>,
    cache: Option<CacheFile>,
    /// Whether there may be files that the render is to ignore.
    is_ignored: bool,
    _lock: Lock,
}

impl Found {
    /// Looks for a checkpoint; with `restart`, ignores it. No other process may work with it until this is dropped.
    ///
    /// # Errors
    ///
    /// If another process works with it, or it is damaged.
    pub fn open(path: &Path, restart: bool) -> Result<Found> {
        let lock = Lock::take(path)?;
        let exists = path.try_exists().map_err(|error| Error::io(path, error))?;
        if exists {
            check_is_checkpoint(path)?;
        }
        Ok(Found {
            path: path.to_owned(),
            state: if exists && !restart {
                Some(read_header(path).map_err(or_restart)?)
            } else {
                None
            },
            cache: if restart {
                None
            } else {
                CacheFile::open(path).map_err(or_restart)?
            },
            is_ignored: restart,
            _lock: lock,
        })
    }

    /// Removes the files of an ignored checkpoint. To be called before the first file of the new one gets its name, since
    /// files of two checkpoints do not go together.
    pub fn make_way(&mut self) -> Result<()> {
        if !self.is_ignored {
            return Ok(());
        }
        let checkpoint = target_of(&self.path);
        let cache = super::beside(&self.path, "cache");
        for file in [checkpoint, cache] {
            match fs::remove_file(&file) {
                Err(error) if error.kind() != ErrorKind::NotFound => {
                    return Err(Error::io(&file, error));
                }
                _ => {}
            }
        }
        self.is_ignored = false;
        Ok(())
    }

    pub fn state(&self) -> Option<&State> {
        self.state.as_ref().map(|(state, _)| state)
    }

    /// Whether the cache has had all its paths.
    pub fn is_filled(&self) -> bool {
        self.cache.as_ref().is_some_and(|c| c.header.is_filled)
    }

    /// The devices and drivers that have rendered the picture under way.
    pub fn devices(&self) -> Vec<String> {
        self.state()
            .map_or(Vec::new(), |state| state.header.devices.clone())
    }

    /// The time that the filling of the cache has taken so far.
    pub fn filled_for(&self) -> Duration {
        let cache = self.cache.as_ref();
        cache.map_or(Duration::ZERO, |cache| cache.header.took())
    }

    /// The settings that were picked before.
    pub fn settings(&self) -> Option<&Settings> {
        let of_cache = || self.cache.as_ref().map(|cache| &cache.header.settings);
        self.state().map(|state| &state.settings).or_else(of_cache)
    }

    /// Fingerprint of the cache's light, once it has had all its paths.
    pub fn fill(&self) -> Option<String> {
        let cache = self.cache.as_ref().filter(|cache| cache.header.is_filled);
        cache.map(|cache| cache.header.fill.clone())
    }

    /// Fails if the checkpoint belongs to another render, and says what differs. `picture` is the identity that the
    /// picture under way should have, `whole` that of the cache; there are `pictures` pictures.
    pub fn check(
        &self,
        picture: &Named<'_>,
        whole: &Named<'_>,
        stop: &Stop,
        manner: &Manner,
        pictures: usize,
    ) -> Result<()> {
        if let Some((state, scene)) = &self.state {
            let name = self.path.display().to_string();
            let header = &state.header;
            header
                .check()
                .map_err(|why| or_restart(Error::input(Location::file(&name), why)))?;
            let found = Named {
                name: &name,
                identity: &header.identity,
                scene,
            };
            let difference = match state.other_pictures(pictures) {
                Some(pictures) => Some(pictures),
                None => found
                    .difference(picture)?
                    .or_else(|| state.other_manner(manner))
                    .or_else(|| state.other_samples(stop)),
            };
            check_same_render(&name, difference)?;
            state.check_goal(&name, stop)?;
        }
        if let Some(cache) = &self.cache {
            let name = cache.name();
            let found = Named {
                name: &name,
                identity: &cache.header.identity,
                scene: &cache.header.scene,
            };
            check_same_render(&name, found.difference(whole)?)?;
        }
        self.check_fill()
    }

    /// Fails if the samples have read another filling than that of the cache file.
    fn check_fill(&self) -> Result<()> {
        let Some(fill) = self.state().and_then(|state| state.header.fills.first()) else {
            return Ok(());
        };
        let name = super::beside(&self.path, "cache");
        let samples = format!("the samples in {} have read", self.path.display());
        let refuse = |problem: String| {
            let problem = format!("{problem}; --restart begins anew");
            Err(Error::input(name.as_path(), problem))
        };
        match &self.cache {
            None => refuse(format!("it is missing, and {samples} it")),
            Some(cache) if cache.header.fill != fill.id || !cache.header.is_filled => {
                refuse(format!("it is not the cache that {samples}"))
            }
            Some(_) => Ok(()),
        }
    }

    /// Restores the cache in the engine, if there is one.
    pub fn restore_cache(&self, engine: &mut Engine) -> Result<()> {
        match &self.cache {
            Some(cache) => cache.restore(engine).map_err(or_restart),
            None => Ok(()),
        }
    }

    /// Restores the picture in the engine, if it has samples. The engine must be at that picture.
    pub fn restore_picture(&self, engine: &mut Engine) -> Result<()> {
        let Some(state) = self
            .state()
            .filter(|state| !state.header.samples.is_empty())
        else {
            return Ok(());
        };
        let header = &state.header;
        let pixels = Pixels::read(&self.path, header).map_err(or_restart)?;
        let totals = Totals {
            first_sample: header
                .samples
                .first()
                .map_or(0, |range: &SampleRange| range.first),
            samples: header.count(),
            units: header.units,
            seen_since: Some(Instant::now()),
            paths: header.paths,
            lookups: header.lookups,
            ..Totals::default()
        };
        engine.resume(&pixels.sums, totals)
    }
}

/// Fails where something differs between the checkpoint in the file `name` and this render.
fn check_same_render(name: &str, difference: Option<String>) -> Result<()> {
    match difference {
        None => Ok(()),
        Some(difference) => Err(Error::input(
            Location::file(name),
            format!("it is a checkpoint of another render: {difference}; --restart begins anew"),
        )),
    }
}

/// Fails for a whole picture of another kind, which a checkpoint must not replace.
fn check_is_checkpoint(path: &Path) -> Result<()> {
    let found = match has_header(path) {
        Ok(true) if read_header::<State>(path).is_ok() => return Ok(()),
        Ok(true) if read_header::<Header>(path).is_ok() => "a shard or a merged picture",
        Ok(false) => "a picture without a render's state",
        // It is no EXR, or a damaged one.
        Ok(true) | Err(_) => return Ok(()),
    };
    Err(Error::input(
        path,
        format!("it is {found}, not a checkpoint; name another file"),
    ))
}

/// A fault of a file, with what can be done about it.
fn or_restart(error: Error) -> Error {
    match error {
        Error::Input { location, problem } => Error::Input {
            location,
            problem: problem + "; --restart begins anew",
        },
        other => other,
    }
}
