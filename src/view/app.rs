//! A frame of the window, from top to bottom.

use std::time::{Duration, Instant};

use winit::event_loop::EventLoopProxy;

use super::document::Document;
use super::hud::{Hud, MemoryNow, Message};
use super::interface::{Asked, Interface};
use super::keys::Action;
use super::live::Live;
use super::load::Load;
use super::picture_size::PictureSize;
use super::report::Report;
use super::session::Session;
use super::stage::Stage;
use super::watch::Watch;
use crate::cli::{ViewArgs, message};
use crate::error::{Error, Result};
use crate::output::Outputs;

/// Time between two updates of the figures while work goes on.
const FIGURES: Duration = Duration::from_millis(250);

pub struct App<'a> {
    pub(super) args: &'a ViewArgs,
    pub(super) proxy: EventLoopProxy<()>,
    pub(super) stage: Option<Stage>,
    pub(super) opening: Option<Load<Document>>,
    pub(super) session: Option<Session>,
    pub(super) watch: Option<Watch>,
    pub(super) report: Report,
    pub(super) hud: Hud,
    pub(super) shows_panels: bool,
    pub(super) message: Option<Message>,
    /// The picture's rectangle in the window, in pixels: low and high corner.
    pub(super) picture_rect: [[u32; 2]; 2],
    pub(super) picture_size: PictureSize,
    /// When the interface has to run next, unless an event comes first.
    pub(super) interface_due: Option<Instant>,
    /// Whether a picture has been there, or something else than the scene of the command line was asked for: then a document
    /// that cannot be shown does not end the program.
    pub(super) outlives_errors: bool,
    /// The error that ended the program, if one did.
    pub(super) failure: Option<Error>,
}

impl<'a> App<'a> {
    pub fn new(args: &'a ViewArgs, proxy: EventLoopProxy<()>) -> App<'a> {
        App {
            args,
            proxy,
            stage: None,
            opening: None,
            session: None,
            watch: None,
            report: Report::new(args.quiet),
            hud: Hud::default(),
            shows_panels: true,
            message: None,
            picture_rect: [[0; 2]; 2],
            picture_size: PictureSize::default(),
            interface_due: Some(Instant::now()),
            outlives_errors: false,
            failure: None,
        }
    }

    /// Has the interface run in the next frame.
    pub(super) fn want_interface(&mut self) {
        self.interface_due = Some(Instant::now());
    }

    /// Runs one frame: takes in what has arrived, works, and shows the picture. Work on the GPU is in slices, so that
    /// none of it takes long.
    pub(super) fn frame(&mut self) -> Result<()> {
        let began = Instant::now();
        self.take_opened()?;
        self.take_built()?;
        let has_interface =
            self.has_old_images() || self.interface_due.is_some_and(|due| due <= Instant::now());
        if has_interface {
            let actions = self.run_interface()?;
            self.carry_out(actions);
            self.fit_picture()?;
            self.fit_window()?;
            self.follow_scene()?;
        }
        let has_picture = self.advance_picture()?;
        if has_interface || has_picture {
            self.show(has_picture)?;
        }
        if self.is_improving() {
            self.report.rested(began.elapsed());
        }
        Ok(())
    }

    fn take_built(&mut self) -> Result<()> {
        let Some(session) = &mut self.session else {
            return Ok(());
        };
        let was_building = session.build_under_way().is_some();
        let problem = match session.take_built(&mut self.report) {
            Err(Error::Device(why)) => return Err(Error::Device(why)),
            // It is built anew for a smaller picture.
            Err(Error::Memory(why))
                if (session.has_been_shown() || why.depends_on_size())
                    && self.picture_size.coarsen() =>
            {
                self.want_interface();
                return Ok(());
            }
            Err(error) if self.outlives_errors => {
                // What has been edited stays, to be saved, or shown again in a smaller window.
                if !session.has_been_shown() {
                    self.session = None;
                }
                self.complain(error);
                return Ok(());
            }
            problem => problem?,
        };
        self.outlives_errors |= session.live().is_some();
        if was_building && session.build_under_way().is_none() {
            self.want_interface();
        }
        if let Some(error) = problem {
            self.complain(error);
        }
        Ok(())
    }

    /// Runs panels, mouse and keys. They change the scene directly; everything else is returned as actions.
    fn run_interface(&mut self) -> Result<Vec<Action>> {
        let Some(stage) = &mut self.stage else {
            return Ok(Vec::new());
        };
        let scale = stage.window.scale_factor() as f32 * stage.egui.zoom_factor();
        let mut interface = Interface {
            memory: MemoryNow::of(stage),
            session: self.session.as_mut(),
            opening: self.opening.as_ref(),
            message: self.message.as_ref(),
            report: &self.report,
            hud: &mut self.hud,
            shows_panels: self.shows_panels,
        };
        let mut asked = Asked::NOTHING;
        let delay = stage.run_interface(|ui| interface.run(ui, &mut asked))?;
        let corner = |p: egui::Pos2| [p.x, p.y].map(|x| (x * scale).round().max(0.0) as u32);
        self.picture_rect = [corner(asked.rect.min), corner(asked.rect.max)];
        let delay = if self.is_waiting() {
            delay.min(FIGURES)
        } else {
            delay
        };
        self.interface_due = Instant::now().checked_add(delay);
        if asked.has_read || self.message.as_ref().is_some_and(Message::is_old) {
            self.message = None;
        }
        if asked.gives_up && self.opening.take().is_some() {
            self.tell("cancelled".into());
        }
        Ok(asked.actions)
    }

    /// Adapts the picture to its place in the window.
    fn fit_picture(&mut self) -> Result<()> {
        if let (Some(stage), Some(session)) = (&mut self.stage, &mut self.session)
            && self
                .picture_size
                .follow(self.picture_rect, stage, session)?
        {
            self.report.resized(stage.picture_size());
        }
        Ok(())
    }

    /// Makes the window's own images anew if necessary, once a smaller picture has made room.
    fn fit_window(&mut self) -> Result<()> {
        let has_old_images = self.has_old_images();
        let Some(stage) = self.stage.as_mut().filter(|_| has_old_images) else {
            return Ok(());
        };
        stage.fit_window()?;
        if let Some(live) = self.session.as_mut().and_then(Session::live_mut) {
            live.reserve(stage.bytes_now()?);
        }
        Ok(())
    }

    /// Whether the window's images can and must be made anew. While a renderer is built they stay as they
    /// are, since its plan counts on them.
    fn has_old_images(&self) -> bool {
        !self.is_building() && self.stage.as_ref().is_some_and(Stage::is_outdated)
    }

    fn follow_scene(&mut self) -> Result<()> {
        let (Some(stage), Some(session)) = (&self.stage, &mut self.session) else {
            return Ok(());
        };
        let followed = session.follow(stage, &self.proxy, self.args, &mut self.report);
        let changes_picture = match followed {
            Err(Error::Device(why)) => return Err(Error::Device(why)),
            Err(error) => {
                self.complain(error);
                false
            }
            Ok(changes_picture) => changes_picture,
        };
        self.report.response.processed(changes_picture);
        Ok(())
    }

    fn advance_picture(&mut self) -> Result<bool> {
        let (Some(stage), Some(session)) = (&self.stage, &mut self.session) else {
            return Ok(false);
        };
        let Some(live) = session.live_mut() else {
            return Ok(false);
        };
        let was_finished = live.picture.is_finished();
        let changed = live.advance(stage.shown())?;
        self.report.take_times(live.engine.timings_mut());
        if live.picture.is_finished() && !was_finished {
            self.report.finished(live);
            self.want_interface();
        }
        Ok(changed)
    }

    fn show(&mut self, has_picture: bool) -> Result<()> {
        let Some(stage) = &mut self.stage else {
            return Ok(());
        };
        let is_presented = stage.show(self.picture_rect)?;
        self.report.take_times(&mut stage.frame.timings);
        if !is_presented {
            return Ok(());
        }
        let is_moving = has_picture && self.live().is_some_and(|live| live.picture.is_moving());
        self.report.frame(is_moving, has_picture);
        Ok(())
    }

    /// What is on the GPU of the open scene.
    fn live(&self) -> Option<&Live> {
        self.session.as_ref().and_then(Session::live)
    }

    /// Whether a picture at rest is shown that is not finished.
    fn is_improving(&self) -> bool {
        self.live()
            .is_some_and(|live| !live.picture.is_moving() && !live.picture.is_finished())
    }

    /// Whether there is something to do without waiting for an event.
    pub(super) fn is_busy(&self) -> bool {
        self.live().is_some_and(|live| !live.picture.is_finished()) || self.has_old_images()
    }

    /// Whether figures, bars or messages on the screen change without an event.
    fn is_waiting(&self) -> bool {
        self.is_busy()
            || self.opening.is_some()
            || self.message.as_ref().is_some_and(|m| !m.is_error)
            || self.is_building()
    }

    fn is_building(&self) -> bool {
        let session = self.session.as_ref();
        session.is_some_and(|s| s.build_under_way().is_some())
    }

    pub(super) fn tell(&mut self, text: String) {
        self.report.say(&text);
        self.message = Some(Message::new(text, false));
    }

    pub(super) fn complain(&mut self, error: Error) {
        let said = message(&error);
        self.report.say(&format!("error: {said}"));
        self.message = Some(Message::new(said, true));
        self.want_interface();
    }

    /// Ends a build that is still under way once the window is closed.
    pub fn end_build(&mut self) {
        if let Some(session) = &mut self.session {
            session.end_build();
        }
    }

    /// Writes the statistics and returns the exit status, or the error that ended the session.
    pub fn finish(mut self) -> Result<u8> {
        if let Some(error) = self.failure.take() {
            return Err(error);
        }
        let Some(stage) = &self.stage else {
            return Ok(0);
        };
        stage.host.check_validation()?;
        if let Some(path) = &self.args.stats {
            let mut outputs = Outputs::default();
            outputs.json(path, &self.report.stats(stage, self.live()))?;
            outputs.commit()?;
        }
        Ok(0)
    }
}
