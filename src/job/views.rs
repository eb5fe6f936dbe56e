//! The pictures of a render: their scenes, and their way into files.

use std::path::{Path, PathBuf};

use super::shards::{Origin, to_json};
use crate::cli::RenderArgs;
use crate::engine::{Engine, Host, Picture};
use crate::error::Result;
use crate::output::{Format, Outputs, Parts, Provenance};
use crate::render::Sums;
use crate::scene::{Opened, Scene, describe};
use crate::shard::Header;

/// One picture of an orbit, or the only one.
pub struct View {
    /// Number of the picture, from 1 on.
    pub number: u32,
    pub scene: Scene,
    pub files: Vec<PathBuf>,
}

/// All pictures of the render, in order.
pub fn views(args: &RenderArgs, opened: &Opened) -> Vec<View> {
    let Some(count) = args.orbit else {
        return vec![View {
            number: 1,
            scene: opened.scene.clone(),
            files: args.outputs(),
        }];
    };
    let numbered = |file: PathBuf, number: u32| {
        let extension = file.extension().unwrap_or_default().to_string_lossy();
        file.with_extension(format!("{number:04}.{extension}"))
    };
    let view = |number: u32| {
        let mut scene = opened.scene.clone();
        let share = f64::from(number - 1) / f64::from(count.get());
        scene.camera = scene.camera.orbited(share);
        let files = args.outputs().into_iter();
        View {
            number,
            scene,
            files: files.map(|file| numbered(file, number)).collect(),
        }
    };
    (1..=count.get()).map(view).collect()
}

/// The origin of a picture, for its header; `scene` is the resolved scene as text.
pub fn provenance(scene: String, host: &Host, seed: u32) -> Provenance {
    Provenance {
        scene,
        seed,
        device: host.summary().name.clone(),
        software: software(),
    }
}

/// The program's name and version.
pub fn software() -> String {
    concat!("isolume ", env!("CARGO_PKG_VERSION")).into()
}

/// A picture with the data for its EXR.
pub struct Saved {
    pub picture: Picture,
    pub provenance: Provenance,
    /// Header and sums of a shard.
    pub parts: Option<(Header, Sums)>,
}

impl Saved {
    pub fn of(
        engine: &mut Engine,
        view: &View,
        opened: &Opened,
        origin: Option<&Origin>,
    ) -> Result<Saved> {
        let text = describe(&opened.file, &opened.volume, &view.scene);
        let parts = match origin {
            Some(origin) => Some(origin.header(engine, &view.scene, &text)?),
            None => None,
        };
        Ok(Saved {
            picture: engine.picture()?,
            provenance: provenance(text, engine.host(), engine.seed()),
            parts,
        })
    }

    /// Writes the view's files, still under temporary names.
    pub fn stage(&self, outputs: &mut Outputs, view: &View, opened: &Opened) -> Result<()> {
        let Saved {
            picture,
            provenance,
            parts,
        } = self;
        for file in &view.files {
            let path: &Path = file;
            match Format::of(path)? {
                Format::Exr => match parts {
                    Some((header, sums)) => {
                        let parts = Parts {
                            header: &to_json(header)?,
                            sums,
                            is_quick: false,
                        };
                        outputs.exr_with(path, picture, provenance, parts)?
                    }
                    None => outputs.exr(path, picture, provenance)?,
                },
                Format::Png => {
                    let render = &opened.scene.render;
                    outputs.png(path, picture, render.exposure, render.tone)?
                }
            }
        }
        Ok(())
    }
}
