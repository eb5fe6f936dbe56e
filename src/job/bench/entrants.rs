//! The subjects of a bench: each shading model of the scene, and for each the variants that are possible.

use std::time::Duration;

use super::entrant_run::snapshot_file;
use super::reference::Rays;
use super::warm::new_view_file;
use crate::cli::{BenchArgs, BenchVariant, message};
use crate::engine::{Choice, Engine, Host};
use crate::error::{Error, Location, Result};
use crate::scene::Opened;
use crate::scene::file::{SceneFile, ShadingModel};
use crate::scene::volume::Volume;
use crate::scene::{CacheFormat, Scene, Variant, describe, resolve};

/// The variants that are measured if the user names none, as far as they fit.
const DEFAULT: [BenchVariant; 5] = [
    BenchVariant::without_cache(Variant::NonCaching),
    BenchVariant::caching(1.0, CacheFormat::F16),
    BenchVariant::caching(0.5, CacheFormat::F16),
    BenchVariant::caching(0.25, CacheFormat::F16),
    BenchVariant::without_cache(Variant::Published),
];

/// The scene with one shading model.
pub struct Subject {
    /// The shading model; `None` leaves it as the scene has it.
    pub shading: Option<ShadingModel>,
    /// Prefix of the names of its files where there are several subjects, as in `phong.`.
    pub prefix: String,
    file: SceneFile,
    pub entrants: Vec<Entrant>,
    /// Variants that the user has not named and that are not possible here, with the reasons.
    pub skipped: Vec<String>,
}

/// One variant of a subject.
pub struct Entrant {
    pub word: String,
    pub scene: Scene,
    /// The scene as text, for a picture's header.
    pub text: String,
    pub choice: Choice,
}

pub fn subjects(args: &BenchArgs, host: &Host, opened: &Opened) -> Result<Vec<Subject>> {
    let models = args.shading();
    if !models.is_empty() && opened.scene.surfaces.iso.is_empty() {
        let scene = args.scene.input.display();
        return Err(Error::input(
            Location::flag("--shading"),
            format!("it is for surfaces, and {scene} has none; --iso VALUE adds one"),
        ));
    }
    let several = models.len() > 1;
    let models: Vec<Option<ShadingModel>> = if models.is_empty() {
        vec![None]
    } else {
        models.into_iter().map(Some).collect()
    };
    models
        .into_iter()
        .map(|model| Subject::new(args, host, opened, model, several))
        .collect()
}

impl Subject {
    fn new(
        args: &BenchArgs,
        host: &Host,
        opened: &Opened,
        shading: Option<ShadingModel>,
        is_one_of_several: bool,
    ) -> Result<Subject> {
        let mut file = opened.file.clone();
        if shading.is_some() {
            for iso in &mut file.surfaces.iso {
                iso.shading = shading;
            }
        }
        let mut subject = Subject {
            shading,
            prefix: match (shading, is_one_of_several) {
                (Some(model), true) => format!("{}.", model.name()),
                _ => String::new(),
            },
            file,
            entrants: Vec::new(),
            skipped: Vec::new(),
        };
        let named = args.variants();
        let variants = if named.is_empty() {
            &DEFAULT[..]
        } else {
            &named[..]
        };
        for variant in variants {
            match subject.entrant(host, &opened.volume, variant) {
                Ok(entrant) => subject.entrants.push(entrant),
                Err(error) if !named.is_empty() || variant.variant == Variant::NonCaching => {
                    return Err(error);
                }
                Err(why) => subject
                    .skipped
                    .push(format!("{variant}: {}", message(&why))),
            }
        }
        // Non-caching comes first, since the others are compared with its pictures.
        subject
            .entrants
            .sort_by_key(|e| !e.choice.plan.variant.is_unbiased());
        Ok(subject)
    }

    /// Resolves the scene for one variant, and plans it.
    pub fn entrant(&self, host: &Host, volume: &Volume, variant: &BenchVariant) -> Result<Entrant> {
        let mut file = self.file.clone();
        file.render.variant = Some(variant.variant);
        file.render.cache_scale = Some(variant.scale);
        file.render.cache_format = Some(variant.format);
        let (scene, _) = resolve(&file, volume)?;
        let choice = host.plan(volume, &scene)?;
        host.check_picture(volume, &choice.plan, scene.render.size, false)?;
        Ok(Entrant {
            word: variant.to_string(),
            text: describe(&file, volume, &scene),
            choice,
            scene,
        })
    }

    /// Names of all pictures that a bench with these times may write of the subject.
    pub fn files(&self, seconds: &[Duration], has_reference: bool) -> Vec<String> {
        let of_entrant = |entrant: &Entrant| {
            let prefix = self.prefix_of(entrant);
            let at_times = seconds.iter().map(|time| snapshot_file(&prefix, *time));
            at_times.chain([new_view_file(&prefix)]).collect::<Vec<_>>()
        };
        let own = (!has_reference).then_some(Rays::Anywhere);
        let references = own.into_iter().chain([Rays::Centres]);
        let references = references.map(|rays| self.reference_file(rays));
        references
            .chain(self.entrants.iter().flat_map(of_entrant))
            .collect()
    }

    pub fn reference_file(&self, rays: Rays) -> String {
        let rays = match rays {
            Rays::Anywhere => "reference",
            Rays::Centres => "reference-centres",
        };
        format!("{}{rays}.exr", self.prefix)
    }

    /// Prefix of the names of an entrant's files.
    pub fn prefix_of(&self, entrant: &Entrant) -> String {
        format!("{}{}", self.prefix, entrant.file_word())
    }

    pub fn has_cache(&self) -> bool {
        let nodes = |e: &Entrant| e.choice.plan.variant.cache().map(|c| c.active_nodes());
        self.entrants.iter().any(|e| nodes(e) > Some(0))
    }
}

impl Entrant {
    /// The scene on the device, with nothing left to compile.
    pub fn load(&self, host: &Host, volume: &Volume, seed: u32) -> Result<Engine> {
        let mut engine = Engine::with_plan(host, volume, &self.scene, self.choice.clone(), seed)?;
        engine.warm_up()?;
        Ok(engine)
    }

    /// The variant as a part of a file's name, which must not contain a colon.
    fn file_word(&self) -> String {
        self.word.replace(':', "-")
    }
}
