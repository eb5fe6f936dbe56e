//! Files that the window writes: the picture and the scene. They never replace existing files.

use std::path::{Path, PathBuf};

use super::session::Session;
use crate::error::{Error, Result};
use crate::output::{Outputs, Provenance, stem};

/// Writes the picture as it is now, as PNG and EXR, and returns the PNG's name.
pub fn image(session: &mut Session, seed: u32) -> Result<PathBuf> {
    let path = free_name(&session.document.path, ["png", "exr"])?;
    let live = session.live();
    let live = live.filter(|live| live.engine.has_picture());
    let scene = live.map(|live| session.describe(live.engine.scene()));
    let (Some(scene), Some(live)) = (scene, session.live_mut()) else {
        return Err(Error::value("not all pixels have been rendered yet"));
    };
    let engine = &mut live.engine;
    let picture = live.picture.taken(engine)?;
    let provenance = Provenance::new(scene, seed, engine.host().summary().name.clone());
    let mut outputs = Outputs::default();
    let render = &engine.scene().render;
    outputs.png(&path, &picture, render.exposure, render.tone)?;
    outputs.exr(&path.with_extension("exr"), &picture, &provenance)?;
    outputs.commit()?;
    Ok(path)
}

/// Writes the scene so that `render` makes this picture from it, and returns the file's name.
pub fn scene(session: &Session) -> Result<PathBuf> {
    let path = free_name(&session.document.path, ["toml"])?;
    let mut outputs = Outputs::default();
    outputs.text(&path, &session.describe(&session.scene))?;
    outputs.commit()?;
    Ok(path)
}

/// `head.1.png` here, or the next number for which no file exists with any of the extensions; the name has the first
/// extension.
fn free_name<const N: usize>(document: &Path, extensions: [&str; N]) -> Result<PathBuf> {
    let stem = stem(document);
    let name = |n: u32, extension: &str| PathBuf::from(format!("{stem}.{n}.{extension}"));
    let is_free = |n: &u32| extensions.iter().all(|e| !name(*n, e).exists());
    match (1..10_000).find(is_free) {
        Some(n) => Ok(name(n, extensions[0])),
        None => {
            let first = name(1, extensions[0]);
            Err(Error::input(first.as_path(), "there are too many already"))
        }
    }
}
