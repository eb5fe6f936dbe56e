//! The pictures of a render: their scenes, and their way into files.

use std::path::{Path, PathBuf};

use crate::cli::RenderArgs;
use crate::engine::{Engine, Picture, Sums};
use crate::error::Result;
use crate::output::{Continuation, Format, Outputs, Provenance};
use crate::scene::{Opened, Scene, describe};
use crate::shard::{Fingerprints, Header};

/// One picture of an orbit, or the only one.
pub struct View {
    /// Number of the picture, from 1 on.
    pub number: u32,
    pub scene: Scene,
    pub files: Vec<PathBuf>,
}

/// The names of each picture's files, in order.
pub fn files(args: &RenderArgs) -> Vec<Vec<PathBuf>> {
    let Some(count) = args.orbit else {
        return vec![args.outputs()];
    };
    let numbered = |file: PathBuf, number: u32| {
        let extension = file.extension().unwrap_or_default().to_string_lossy();
        file.with_extension(format!("{number:04}.{extension}"))
    };
    let of = |number| {
        let files = args.outputs().into_iter();
        files.map(|file| numbered(file, number)).collect()
    };
    (1..=count.get()).map(of).collect()
}

/// All pictures of the render, in order, which go into these files. An orbit whose distance is not given keeps the whole box in
/// all of them.
pub fn views(files: Vec<Vec<PathBuf>>, args: &RenderArgs, opened: &Opened) -> Vec<View> {
    let mut first = opened.scene.camera;
    if args.orbit.is_some_and(|count| count.get() > 1) && opened.file.camera.eye.is_none() {
        let [width, height] = opened.scene.render.size.map(f64::from);
        first = first.framing_a_turn(opened.volume.extent(), width / height);
    }
    let view = |(number, files): (u32, Vec<PathBuf>)| {
        let mut scene = opened.scene.clone();
        if let Some(count) = args.orbit {
            let share = f64::from(number - 1) / f64::from(count.get());
            scene.camera = first.orbited(share);
        }
        View {
            number,
            scene,
            files,
        }
    };
    (1..).zip(files).map(view).collect()
}

/// A picture as its files hold it.
pub struct Saved {
    pub picture: Picture,
    pub provenance: Provenance,
}

/// What the EXR of a shard or of a checkpoint holds beside the picture.
pub struct Summed {
    pub header: Header,
    pub sums: Sums,
}

impl Saved {
    pub fn of(engine: &mut Engine, view: &View, opened: &Opened) -> Result<Saved> {
        let text = describe(&opened.file, &opened.volume, &view.scene);
        Ok(Saved {
            picture: engine.picture()?,
            provenance: provenance(engine, text),
        })
    }

    pub fn with_sums(
        engine: &mut Engine,
        view: &View,
        opened: &Opened,
        fingerprints: &Fingerprints,
    ) -> Result<(Saved, Summed)> {
        let text = describe(&opened.file, &opened.volume, &view.scene);
        let (picture, sums) = engine.picture_with_sums()?;
        let header = fingerprints.header(engine, &view.scene, &text, &sums)?;
        let saved = Saved {
            picture,
            provenance: provenance(engine, text),
        };
        Ok((saved, Summed { header, sums }))
    }

    /// Writes the view's files, still under temporary names; `summed`, where the picture is a shard.
    pub fn write_aside(
        &self,
        outputs: &mut Outputs,
        view: &View,
        opened: &Opened,
        summed: Option<&Summed>,
    ) -> Result<()> {
        let Saved {
            picture,
            provenance,
        } = self;
        for file in &view.files {
            let path: &Path = file;
            match Format::of(path)? {
                Format::Exr => match summed {
                    Some(Summed { header, sums }) => {
                        let continuation = Continuation::of(header, sums)?;
                        outputs.exr_with(path, picture, provenance, continuation)?
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

fn provenance(engine: &Engine, text: String) -> Provenance {
    Provenance::new(text, engine.seed(), engine.host().summary().name.clone())
}
