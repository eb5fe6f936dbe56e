//! The open scene: its state in the panels, its state on the GPU, and how the latter follows the former.

use std::sync::Arc;

use winit::event_loop::EventLoopProxy;

use super::document::Document;
use super::history::{History, like};
use super::live::{BuildOrder, Live};
use super::load::{Load, build};
use super::report::Report;
use super::stage::Stage;
use crate::cli::ViewArgs;
use crate::engine::{Changed, SavedLight};
use crate::error::{Error, Result};
use crate::scene::volume::Preview;
use crate::scene::{Camera, Scene, SceneFile, Variant, describe};

pub struct Session {
    pub document: Arc<Document>,
    /// The scene's file as last read.
    file: SceneFile,
    /// The scene to show; panels change it as they like.
    pub scene: Scene,
    on_gpu: OnGpu,
    /// The list of `series` while it is being made.
    pub listing: Option<Load<Vec<Preview>>>,
    /// The volumes of the document's folder, if there are several.
    pub series: Vec<Preview>,
    pub history: History,
    /// The camera at the beginning.
    pub home: Camera,
    /// The last scene that was shown before the build under way.
    shown: Option<Scene>,
    /// The selected item in each list of the panels.
    pub chosen: Chosen,
}

/// What the GPU has of the scene.
enum OnGpu {
    Nothing,
    /// The build of the document before. Nobody wants its result, but until it has ended there may be no memory for
    /// another one.
    Ending(Load<Live>),
    Building(Build),
    Live(Box<Live>),
    /// Nothing, since this scene could not be built, with nothing to show in its place.
    Failed(Scene),
}

/// A renderer under way, and the scene that it is for. There is one at a time, since its plan counts on all memory that the
/// window leaves.
struct Build {
    scene: Scene,
    load: Load<Live>,
}

#[derive(Default)]
pub struct Chosen {
    pub point: usize,
    /// The values that the transfer function's plot showed last.
    pub range: Option<[f64; 2]>,
    pub surface: usize,
    pub sun: usize,
    /// The colour that the selected sun had when it was last not black, and the sun's number.
    pub sun_hue: Option<(usize, [f64; 3])>,
    /// The same of the sky.
    pub sky_hue: Option<[f64; 3]>,
    /// The plane that the key C has made; it may have been removed.
    pub clip: Option<usize>,
    /// The variant that was selected last, if it has failed, and the one that is shown in its place.
    pub failed_variant: Option<[Variant; 2]>,
    /// A drag on the picture turns the sun, where there is one, instead of the camera.
    pub aims_sun: bool,
}

impl Session {
    /// Opens a document in the place of the one before, whose renderer goes first to make room.
    pub fn new(document: Document, before: Option<Session>) -> Session {
        let (mut on_gpu, mut series) = (OnGpu::Nothing, Vec::new());
        let mut scene = document.opened.scene.clone();
        let home = scene.camera;
        if let Some(before) = before {
            before.document.close();
            if document.is_edit_of(&before.document) {
                scene.camera = before.scene.camera;
            }
            if let OnGpu::Building(Build { load, .. }) | OnGpu::Ending(load) = before.on_gpu {
                on_gpu = OnGpu::Ending(load);
            }
            // The list of volumes stays until the same folder's new list is there, so that the panel does not jump
            // when the user picks from it.
            if before.document.path == document.path {
                series = before.series;
            }
        }
        Session {
            history: History::new(&scene),
            home,
            file: document.opened.file.clone(),
            scene,
            document: Arc::new(document),
            on_gpu,
            listing: None,
            series,
            shown: None,
            chosen: Chosen::default(),
        }
    }

    /// Brings the GPU up to date with the scene: at once, or by compiling anew. Returns whether the next picture is
    /// another one.
    pub fn follow(
        &mut self,
        stage: &Stage,
        proxy: &EventLoopProxy<()>,
        args: &ViewArgs,
        report: &mut Report,
    ) -> Result<bool> {
        let mut light = None;
        match &mut self.on_gpu {
            OnGpu::Live(live) if *live.engine.scene() == self.scene => return Ok(false),
            OnGpu::Live(live) => {
                // A change that fails may have stopped half way.
                let before = live.engine.scene().clone();
                match live.follow(&self.scene) {
                    Ok(Changed::Nothing) => return Ok(false),
                    Ok(Changed::Display | Changed::Picture) => return Ok(true),
                    Ok(Changed::Light) => {
                        report.cache_cleared();
                        return Ok(true);
                    }
                    Ok(Changed::Impossible) => {
                        light = match live.engine.light_for(&self.scene) {
                            Err(Error::Device(why)) => return Err(Error::Device(why)),
                            // What cannot be kept is traced anew.
                            kept => kept.unwrap_or_default(),
                        };
                    }
                    Err(Error::Device(why)) => return Err(Error::Device(why)),
                    // If a new renderer fails for the same reason, that is reported.
                    Err(_) => {}
                }
                self.shown = Some(before);
            }
            OnGpu::Ending(_) | OnGpu::Building(_) => return Ok(false),
            OnGpu::Failed(failed) if is_same_but_for_camera(failed, &self.scene) => {
                return Ok(false);
            }
            OnGpu::Failed(_) | OnGpu::Nothing => {}
        }
        // The old renderer is dropped first to make room.
        self.on_gpu = OnGpu::Nothing;
        self.on_gpu = OnGpu::Building(Build {
            scene: self.scene.clone(),
            load: self.begin_build(stage, proxy, args, light)?,
        });
        Ok(false)
    }

    /// The renderer of the scene, or of the one before the last changes.
    pub fn live(&self) -> Option<&Live> {
        match &self.on_gpu {
            OnGpu::Live(live) => Some(live),
            _ => None,
        }
    }

    pub fn live_mut(&mut self) -> Option<&mut Live> {
        match &mut self.on_gpu {
            OnGpu::Live(live) => Some(live),
            _ => None,
        }
    }

    /// Whether something of this document has been shown.
    pub fn has_been_shown(&self) -> bool {
        self.live().is_some() || self.shown.is_some()
    }

    /// Drops the renderer to make room, and remembers what it showed.
    pub fn drop_live(&mut self) {
        if let Some(live) = self.live() {
            self.shown = Some(live.engine.scene().clone());
            self.on_gpu = OnGpu::Nothing;
        }
    }

    /// The build under way, wanted or not.
    pub fn build_under_way(&self) -> Option<&Load<Live>> {
        match &self.on_gpu {
            OnGpu::Building(Build { load, .. }) | OnGpu::Ending(load) => Some(load),
            _ => None,
        }
    }

    /// Ends a build under way and waits for it: a process that ends while its driver compiles may crash.
    pub fn end_build(&mut self) {
        self.document.close();
        match std::mem::replace(&mut self.on_gpu, OnGpu::Nothing) {
            OnGpu::Building(Build { load, .. }) | OnGpu::Ending(load) => load.join(),
            other => self.on_gpu = other,
        }
    }

    fn begin_build(
        &self,
        stage: &Stage,
        proxy: &EventLoopProxy<()>,
        args: &ViewArgs,
        light: Option<SavedLight>,
    ) -> Result<Load<Live>> {
        let order = BuildOrder {
            host: stage.host.clone(),
            memory: stage.memory.clone(),
            planned: stage.planned.clone(),
            scene: self.scene.clone(),
            seed: args.seed,
            samples: args.spp.get(),
            for_window: stage.bytes_now()?,
            light,
        };
        Ok(build(order, self.document.clone(), proxy))
    }

    /// Takes the renderer that was built, if it is ready. A scene that could not be built is replaced by the last one that
    /// was shown, unless it has been changed since, and the error is returned.
    ///
    /// # Errors
    ///
    /// If nothing of this document has been shown yet, or what was shown cannot be shown any more, if only for the picture's
    /// size, or the device is lost.
    pub fn take_built(&mut self, report: &mut Report) -> Result<Option<Error>> {
        let Some(result) = self.build_under_way().and_then(Load::result) else {
            return Ok(None);
        };
        let ended = std::mem::replace(&mut self.on_gpu, OnGpu::Nothing);
        let OnGpu::Building(Build { scene: ordered, .. }) = ended else {
            // It was the build of the document before.
            return Ok(None);
        };
        match result {
            Ok(live) => {
                report.built(&live);
                self.on_gpu = OnGpu::Live(Box::new(live));
                Ok(None)
            }
            Err(Error::Device(why)) => Err(Error::Device(why)),
            Err(error) => {
                let is_another = |shown: &mut Scene| like(shown, &self.scene) != self.scene;
                let Some(shown) = self.shown.take_if(is_another) else {
                    self.on_gpu = OnGpu::Failed(ordered);
                    return Err(error);
                };
                if like(&ordered, &self.scene) != self.scene {
                    self.shown = Some(shown);
                    return Ok(None);
                }
                if ordered.render.variant != shown.render.variant {
                    let variants = [&ordered, &shown].map(|scene| scene.render.variant);
                    self.chosen.failed_variant = Some(variants);
                }
                self.scene = like(&shown, &self.scene);
                self.history.retract(&self.scene);
                Ok(Some(error))
            }
        }
    }

    /// Adopts a file that has been edited on disk, whose camera is `home`.
    pub fn reread(&mut self, file: SceneFile, scene: Scene, home: Camera) {
        self.scene = scene;
        self.home = home;
        self.file = file;
        self.chosen.clip = None;
    }

    /// A scene of this document as a file that `render` reads.
    pub fn describe(&self, scene: &Scene) -> String {
        describe(&self.file, &self.document.opened.volume, scene)
    }
}

/// Whether two scenes differ in their camera at most: a build that failed for one would fail for the other.
fn is_same_but_for_camera(a: &Scene, b: &Scene) -> bool {
    let camera = b.camera;
    Scene {
        camera,
        ..a.clone()
    } == *b
}
