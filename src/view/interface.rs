//! The interface of a frame: panels, mouse, keys, and what lies over the picture. It changes the scene directly; everything
//! else is asked for.

use egui::{CentralPanel, Key, Rect, Ui};

use super::document::Document;
use super::hud::{self, Hud, MemoryNow, Message};
use super::keys::{Action, actions};
use super::load::Load;
use super::report::Report;
use super::session::Session;
use super::{clip, gizmo, panels, pointer};

/// What the interface shows and changes.
pub struct Interface<'a> {
    pub session: Option<&'a mut Session>,
    pub opening: Option<&'a Load<Document>>,
    pub message: Option<&'a Message>,
    pub report: &'a Report,
    pub hud: &'a mut Hud,
    pub memory: MemoryNow,
    pub shows_panels: bool,
}

/// What the user has asked for besides.
pub struct Asked {
    pub actions: Vec<Action>,
    /// The picture's place.
    pub rect: Rect,
    /// What is being opened is no longer wanted.
    pub gives_up: bool,
    /// The message has been read.
    pub has_read: bool,
}

impl Asked {
    pub const NOTHING: Asked = Asked {
        actions: Vec::new(),
        rect: Rect::NOTHING,
        gives_up: false,
        has_read: false,
    };
}

impl Interface<'_> {
    /// Runs the interface, more than once in a frame that has several runs of input or that egui lays out again; each key is
    /// taken once.
    pub fn run(&mut self, ui: &mut Ui, asked: &mut Asked) {
        asked.actions.extend(actions(ui));
        if let Some(session) = self.session.as_mut().filter(|_| self.shows_panels) {
            asked.actions.extend(panels::show(ui, session));
        }
        CentralPanel::no_frame().show(ui, |ui| {
            asked.rect = ui.max_rect();
            self.over_picture(ui, asked.rect);
            if let Some(opening) = self.opening {
                hud::progress(ui, asked.rect, opening);
                asked.gives_up |= ui.input(|i| i.key_pressed(Key::Escape));
            }
            if let Some(message) = self.message {
                asked.has_read |= hud::message(ui, asked.rect, message);
            }
        });
    }

    fn over_picture(&mut self, ui: &mut Ui, rect: Rect) {
        let Some(session) = &mut self.session else {
            return;
        };
        let axes = session.document.opened.volume.axes;
        pointer::steer(ui, rect, session);
        clip::handle(ui, rect, session);
        panels::separate_isovalues(session);
        gizmo::draw(ui, rect, &session.scene.camera, axes);
        hud::status(ui, rect, session, self.report, &self.memory);
        let live = session.live();
        hud::windows(ui, self.hud, self.report, live, &self.memory);
        if !ui.input(|i| i.pointer.any_down()) {
            session.history.commit(&session.scene);
        }
        // One progress at a time: what is being opened comes first.
        let building = session.build_under_way();
        if let Some(building) = building.filter(|_| self.opening.is_none()) {
            hud::progress(ui, rect, building);
        }
    }
}
