//! Files that the window leaves: the picture, and the scene. Neither ever takes an old one's place.

use std::path::{Path, PathBuf};

use super::session::Session;
use crate::error::{Error, Result};
use crate::output::{Outputs, Picture, Provenance};
use crate::scene::Background;

/// Writes the picture as it is now, as PNG and EXR, and returns the PNG's name.
pub fn image(session: &mut Session, seed: u32) -> Result<PathBuf> {
    let scene = session.describe();
    let path = free_name(&session.document.path, "png")?;
    let live = session.live.as_mut();
    let live = live.ok_or_else(|| Error::Input("there is no picture to save yet".into()))?;
    let [width, height] = live.scene.render.size;
    live.reduce_to([width, height])?;
    let renderer = &mut live.renderer;
    let (mean, stderr) = match renderer.totals.samples {
        0 => {
            let marched = renderer.march()?;
            let unknown = vec![[f32::INFINITY; 3]; marched.len()];
            (marched, unknown)
        }
        _ => {
            let film = renderer.film()?;
            (film.mean, film.stderr)
        }
    };
    let hits = renderer.first_hits()?;
    let rgb = |texels: &[[f32; 4]]| texels.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
    let last = |texels: &[[f32; 4]]| texels.iter().map(|t| t[3]).collect();
    let render = &live.scene.render;
    let picture = Picture {
        width,
        height,
        rgb: rgb(&mean),
        alpha: (render.background == Background::Transparent).then(|| last(&mean)),
        stderr,
        albedo: rgb(&hits.albedo),
        normal: rgb(&hits.normal_depth),
        depth: last(&hits.normal_depth),
    };
    let provenance = Provenance {
        scene,
        seed,
        device: renderer.frame.device().summary.name.clone(),
        software: concat!("isolume ", env!("CARGO_PKG_VERSION")).into(),
    };
    let mut outputs = Outputs::default();
    outputs.png(&path, &picture, render.exposure, render.tone)?;
    outputs.exr(&path.with_extension("exr"), &picture, &provenance)?;
    outputs.commit()?;
    Ok(path)
}

/// Writes the scene so that `render` makes this picture of it, and returns its name.
pub fn scene(session: &Session) -> Result<PathBuf> {
    let path = free_name(&session.document.path, "toml")?;
    std::fs::write(&path, session.describe()).map_err(|e| Error::io(&path, e))?;
    Ok(path)
}

/// `head.1.png` here, or the next number that is free.
fn free_name(document: &Path, extension: &str) -> Result<PathBuf> {
    let stem = document.file_stem().unwrap_or_default().to_string_lossy();
    let name = |n: u32| PathBuf::from(format!("{stem}.{n}.{extension}"));
    let free = (1..10_000).map(name).find(|path| !path.exists());
    free.ok_or_else(|| Error::Input(format!("{}: there are too many already", name(1).display())))
}
