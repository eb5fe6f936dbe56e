//! Opening scenes and volumes, and the scene file while the user edits it.

use std::path::{Path, PathBuf};

use super::app::App;
use super::document::Document;
use super::load::{Load, list_series, open_document};
use super::picture_size::PictureSize;
use super::session::Session;
use super::watch::Watch;
use crate::error::Result;
use crate::scene::file::SceneFile;
use crate::scene::{Edit, Scene, is_scene, resolve};

impl App<'_> {
    pub(super) fn take_opened(&mut self) -> Result<()> {
        self.take_listed();
        let Some(result) = self.opening.as_ref().and_then(Load::result) else {
            return Ok(());
        };
        self.opening = None;
        self.want_interface();
        match result {
            Ok(document) => {
                for note in &document.opened.notes {
                    self.report.say(&format!("note: {note}"));
                }
                self.watch = is_scene(&document.path)
                    .then(|| Watch::new(&document.path, &document.edits, document.version));
                self.set_title(&document);
                let volume = document.opened.file.volume_path()?;
                let listing = Some(list_series(volume, &self.proxy));
                let mut session = Session::new(document, self.session.take());
                session.listing = listing;
                self.session = Some(session);
                self.picture_size = PictureSize::default();
                self.message = None;
            }
            Err(error) if self.outlives_errors => self.complain(error),
            Err(error) => return Err(error),
        }
        Ok(())
    }

    fn take_listed(&mut self) {
        let Some(session) = &mut self.session else {
            return;
        };
        let Some(result) = session.listing.as_ref().and_then(Load::result) else {
            return;
        };
        session.listing = None;
        match result {
            Ok(series) => {
                session.series = series;
                self.want_interface();
            }
            Err(error) => self.complain(error),
        }
    }

    fn set_title(&self, document: &Document) {
        if let Some(stage) = &self.stage {
            let name = document.path.file_name().unwrap_or_default();
            let title = format!("{} – Isolume", name.to_string_lossy());
            stage.window.set_title(&title);
        }
    }

    /// Shows an edit of the scene file at once; a mistake in it is reported over the last good picture.
    pub(super) fn reload_if_edited(&mut self) {
        let Some(watch) = self.watch.as_mut().filter(|_| self.opening.is_none()) else {
            return;
        };
        if !watch.has_changed() {
            return;
        }
        let (path, edits) = (watch.path.clone(), watch.edits.clone());
        match self.read_again(&path, edits) {
            Ok(is_read) => {
                self.message = None;
                if is_read {
                    self.report.say("scene file read again");
                }
            }
            Err(error) => self.complain(error),
        }
        self.want_interface();
    }

    /// Returns whether the file has been read; otherwise it is being opened again, with its volume.
    fn read_again(&mut self, path: &Path, edits: Vec<Edit>) -> Result<bool> {
        let Some(session) = &mut self.session else {
            // The scene could not be shown before this edit, so that there is no session to update.
            self.open_edited(path.to_path_buf(), edits);
            return Ok(false);
        };
        let file = SceneFile::read(path, &session.document.edits)?;
        let opened = &session.document.opened;
        if file.volume != opened.file.volume {
            self.open_edited(path.to_path_buf(), edits);
            return Ok(false);
        }
        let (scene, notes) = resolve(&file, &opened.volume)?;
        for note in notes {
            self.report.say(&format!("note: {note}"));
        }
        let home = scene.camera;
        let mut scene = Scene {
            camera: session.scene.camera,
            ..scene
        };
        scene.render.size = session.scene.render.size;
        session.reread(file, scene, home);
        Ok(true)
    }

    pub(super) fn open(&mut self, path: PathBuf) {
        let edits = self.edits_of(&path);
        self.open_edited(path, edits);
    }

    /// Opens another of the volumes that the open folder holds.
    pub(super) fn open_series(&mut self, number: u32) {
        let Some(session) = &self.session else {
            return;
        };
        let path = session.document.path.clone();
        let mut edits = self.edits_of(&path);
        let flag = format!("series {number}");
        edits.push(Edit::set(flag, "volume.series", i64::from(number).into()));
        self.outlives_errors = true;
        self.open_edited(path, edits);
    }

    fn open_edited(&mut self, path: PathBuf, edits: Vec<Edit>) {
        self.opening = Some(open_document(path, edits, self.args, &self.proxy));
        self.want_interface();
    }

    /// The changes of the command line: for the scene that it names, whenever that is opened or read, and for no
    /// other.
    fn edits_of(&self, path: &Path) -> Vec<Edit> {
        let named = &self.args.scene.input;
        let is_named = path == named
            || matches!((path.canonicalize(), named.canonicalize()), (Ok(a), Ok(b)) if a == b);
        if is_named {
            self.args.scene.edits()
        } else {
            Vec::new()
        }
    }
}
