//! The cache's state beside a checkpoint: `FILE.exr.cache`.
//!
//! The file begins with a line that identifies its format; then come the state's bytes (`render::CacheState`), then a
//! header as JSON and the number of its bytes (eight of them, little-endian), then a fingerprint of all that
//! (sixteen).

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::fingerprints::save_light;
use super::settings::Settings;
use super::{Fingerprint, Identity, beside};
use crate::engine::Engine;
use crate::error::{Error, Location, Result};
use crate::output::Outputs;
use crate::render::CacheState;

const MAGIC: &[u8] = b"isolume cache 1\n";
/// Bytes after the header: the header's length, and the fingerprint.
const TAIL: u64 = 8 + 16;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CacheHeader {
    pub identity: Identity,
    /// The resolved scene.
    pub scene: String,
    pub settings: Settings,
    /// Fingerprint of the cache's light.
    pub fill: String,
    /// Whether the cache has had all paths that the picture asks for.
    pub is_filled: bool,
    state: CacheState,
}

impl CacheHeader {
    /// The time that the filling of the cache has taken.
    pub fn took(&self) -> Duration {
        self.state.took()
    }
}

/// A file that is known to be complete, with its header.
pub struct CacheFile {
    path: PathBuf,
    pub header: CacheHeader,
    /// Bytes of the state.
    bytes: u64,
}

/// The fields of the header besides the state.
pub struct About<'a> {
    pub identity: &'a Identity,
    pub scene: &'a str,
    pub settings: Settings,
    pub is_filled: bool,
}

impl CacheFile {
    /// Writes the state of the engine's cache beside a checkpoint, still under a temporary name, and returns the fingerprint of
    /// its light; `None` if the engine has no cache. In the middle of a batch, the cache must get no more paths.
    pub fn write_aside(
        checkpoint: &Path,
        engine: &mut Engine,
        about: About<'_>,
        outputs: &mut Outputs,
    ) -> Result<Option<String>> {
        let Some(mut caching) = engine.caching() else {
            return Ok(None);
        };
        let mut light = String::new();
        let path = beside(checkpoint, "cache");
        // An error of the device is kept apart from errors of the file.
        let mut fault = None;
        let written = outputs.write_aside(&path, |file| {
            let mut fingerprint = Fingerprint::default();
            let mut put = |bytes: &[u8]| -> io::Result<()> {
                fingerprint.add(bytes);
                file.write_all(bytes)
            };
            put(MAGIC)?;
            let mut save = || -> Result<CacheState> {
                let mut put = |bytes: &[u8]| put(bytes).map_err(|error| Error::io(&path, error));
                light = save_light(&mut caching, &mut put)?;
                caching.save_rest(&mut put)
            };
            let state = match save() {
                Ok(state) => state,
                Err(error) => {
                    fault = Some(error);
                    return Err(io::Error::other(
                        "the cache's state could not be read from the device",
                    ));
                }
            };
            let header = serde_json::to_vec(&CacheHeader {
                identity: about.identity.clone(),
                scene: about.scene.into(),
                settings: about.settings,
                fill: light.clone(),
                is_filled: about.is_filled,
                state,
            })?;
            put(&header)?;
            put(&(header.len() as u64).to_le_bytes())?;
            file.write_all(&fingerprint.bytes())
        });
        written.map_err(|error| fault.unwrap_or(error))?;
        Ok(Some(light))
    }

    /// The file beside a checkpoint, if there is one.
    ///
    /// # Errors
    ///
    /// If it cannot be read, or is damaged.
    pub fn open(checkpoint: &Path) -> Result<Option<CacheFile>> {
        let path = beside(checkpoint, "cache");
        let read = |error| Error::io(&path, error);
        let file = match File::open(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            file => file.map_err(read)?,
        };
        let damaged = || Error::input(path.as_path(), "it is damaged");
        let length = file.metadata().map_err(read)?.len();
        let mut file = BufReader::new(file);
        if !is_complete(&mut file, length).map_err(read)? {
            return Err(damaged());
        }
        let header_end = length - TAIL;
        let mut number = [0; 8];
        file.seek(SeekFrom::Start(header_end)).map_err(read)?;
        file.read_exact(&mut number).map_err(read)?;
        let header_bytes = u64::from_le_bytes(number);
        if header_bytes > header_end - MAGIC.len() as u64 {
            return Err(damaged());
        }
        let header_start = header_end - header_bytes;
        file.seek(SeekFrom::Start(header_start)).map_err(read)?;
        let mut json = vec![0; header_bytes as usize];
        file.read_exact(&mut json).map_err(read)?;
        Ok(Some(CacheFile {
            header: serde_json::from_slice(&json).map_err(|_| damaged())?,
            bytes: header_start - MAGIC.len() as u64,
            path,
        }))
    }

    pub fn name(&self) -> String {
        self.path.display().to_string()
    }

    /// Restores the state in an engine.
    ///
    /// # Errors
    ///
    /// If the engine's cache has another layout, or the file cannot be read any more.
    pub fn restore(&self, engine: &mut Engine) -> Result<()> {
        let read = |error| Error::io(&self.path, error);
        let state = &self.header.state;
        let caching = engine.caching();
        let fits = |bytes: Option<u64>| bytes == Some(self.bytes);
        let Some(mut caching) = caching.filter(|caching| fits(caching.bytes_of(state))) else {
            return Err(Error::input(
                Location::file(self.name()),
                "it is the state of a cache of another layout",
            ));
        };
        let mut file = BufReader::new(File::open(&self.path).map_err(read)?);
        file.seek(SeekFrom::Start(MAGIC.len() as u64))
            .map_err(read)?;
        caching.restore(state, &mut |bytes| file.read_exact(bytes).map_err(read))
    }
}

/// Whether a file begins and ends as this format requires.
fn is_complete(file: &mut (impl Read + Seek), length: u64) -> io::Result<bool> {
    if length < MAGIC.len() as u64 + TAIL {
        return Ok(false);
    }
    let mut left = length - 16;
    let mut fingerprint = Fingerprint::default();
    let mut bytes = vec![0; 1 << 16];
    let mut begins = None;
    while left > 0 {
        let piece = &mut bytes[..left.min(1 << 16) as usize];
        file.read_exact(piece)?;
        begins.get_or_insert_with(|| piece.starts_with(MAGIC));
        fingerprint.add(piece);
        left -= piece.len() as u64;
    }
    let mut expected = [0; 16];
    file.read_exact(&mut expected)?;
    Ok(begins == Some(true) && fingerprint.bytes() == expected)
}
