//! The event loop, and a frame from top to bottom.

use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use egui::{CentralPanel, Rect};
use winit::application::ApplicationHandler;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoopProxy};
use winit::window::{Fullscreen, WindowId};

use super::hud::{self, Hud, MemoryNow, Message};
use super::keys::{Wish, wishes};
use super::load::{Document, Load, open_document};
use super::panels::render::VARIANTS;
use super::report::Report;
use super::session::Session;
use super::stage::Stage;
use super::watch::{INTERVAL, Watch};
use super::{INTERRUPTED, camera, clip, gizmo, panels, pointer, save};
use crate::cli::ViewArgs;
use crate::error::{Error, Result};
use crate::output::Outputs;
use crate::scene::file::{SceneFile, is_scene};
use crate::scene::{Camera, Scene, resolve};

/// Figures are brought up to date so often while work goes on.
const FIGURES: Duration = Duration::from_millis(250);
pub struct App<'a> {
    args: &'a ViewArgs,
    proxy: EventLoopProxy<()>,
    stage: Option<Stage>,
    opening: Option<Load<Document>>,
    session: Option<Session>,
    watch: Option<Watch>,
    report: Report,
    hud: Hud,
    shows_panels: bool,
    message: Option<Message>,
    /// Where the picture is, in pixels: low and high corner.
    place: [[u32; 2]; 2],
    /// The size there, when the picture's was chosen.
    fitted: [u32; 2],
    /// When the interface is to be run next, if nothing happens before.
    interface_due: Option<Instant>,
    /// What ended the session, if it did not end well.
    failure: Option<Error>,
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
            place: [[0; 2]; 2],
            fitted: [0; 2],
            interface_due: Some(Instant::now()),
            failure: None,
        }
    }

    /// Everything from what arrived to what is shown. Work on the GPU is in slices, so that none of it
    /// takes long.
    fn frame(&mut self) -> Result<()> {
        self.take_opened()?;
        self.take_built()?;
        let has_interface = self.interface_due.is_some_and(|due| due <= Instant::now());
        if has_interface {
            let wishes = self.run_interface()?;
            self.carry_out(wishes);
            self.fit_picture()?;
            self.follow_scene()?;
        }
        let has_picture = self.advance_picture()?;
        if has_interface || has_picture {
            self.show(has_picture)?;
        }
        Ok(())
    }

    fn take_opened(&mut self) -> Result<()> {
        let Some(result) = self.opening.as_ref().and_then(Load::result) else {
            return Ok(());
        };
        self.opening = None;
        self.interface_due = Some(Instant::now());
        match result {
            Ok(document) => {
                for note in &document.opened.notes {
                    self.report.say(&format!("note: {note}"));
                }
                self.watch = is_scene(&document.path).then(|| Watch::new(&document.path));
                self.set_title(&document);
                // The renderer of the scene before has to make room.
                self.session = None;
                self.session = Some(Session::new(document));
                self.message = None;
            }
            Err(error) if self.session.is_some() => self.complain(error),
            Err(error) => return Err(error),
        }
        Ok(())
    }

    fn set_title(&self, document: &Document) {
        if let Some(stage) = &self.stage {
            let name = document.path.file_name().unwrap_or_default();
            let title = format!("{} – Isolume", name.to_string_lossy());
            stage.window.set_title(&title);
        }
    }

    fn take_built(&mut self) -> Result<()> {
        let Some(session) = &mut self.session else {
            return Ok(());
        };
        let is_building = session.building.is_some();
        let problem = session.take_built(&mut self.report)?;
        if is_building && session.building.is_none() {
            self.interface_due = Some(Instant::now());
        }
        if let Some(error) = problem {
            self.complain(error);
        }
        Ok(())
    }

    /// An edit of the scene file shows at once; one that is wrong is told, over the last good picture.
    fn look_at_file(&mut self) {
        let Some(watch) = self.watch.as_mut().filter(|_| self.opening.is_none()) else {
            return;
        };
        if !watch.has_changed() {
            return;
        }
        let path = watch.path.clone();
        match self.read_again(&path) {
            Ok(()) => {
                self.message = None;
                self.report.say("scene file read again");
            }
            Err(error) => self.complain(error),
        }
        self.interface_due = Some(Instant::now());
    }

    fn read_again(&mut self, path: &std::path::Path) -> Result<()> {
        let edits = self.args.scene.edits();
        let file = SceneFile::read(path, &edits)?;
        let Some(session) = &mut self.session else {
            return Ok(());
        };
        let opened = &session.document.opened;
        if file.volume != opened.file.volume {
            self.open(path.to_path_buf());
            return Ok(());
        }
        let (scene, notes) = resolve(&file, &opened.volume)?;
        for note in notes {
            self.report.say(&format!("note: {note}"));
        }
        let mut scene = Scene {
            camera: session.scene.camera,
            ..scene
        };
        scene.render.size = session.scene.render.size;
        session.reread(file, scene);
        Ok(())
    }

    fn open(&mut self, path: PathBuf) {
        let args = &self.args.scene;
        let edits = match self.session.is_some() {
            // What the command line changed was meant for its own scene.
            true => Vec::new(),
            false => args.edits(),
        };
        self.opening = Some(open_document(path, args.preset, edits, &self.proxy));
        self.interface_due = Some(Instant::now());
    }

    /// Panels, mouse and keys: they change the scene, and wish for the rest.
    fn run_interface(&mut self) -> Result<Vec<Wish>> {
        let is_waiting = self.is_waiting();
        let App {
            stage: Some(stage),
            session,
            opening,
            report,
            hud,
            message,
            shows_panels,
            ..
        } = self
        else {
            return Ok(Vec::new());
        };
        let memory = MemoryNow::of(stage);
        let scale = stage.window.scale_factor() as f32 * stage.egui.zoom_factor();
        let (mut asked, mut rect) = (Vec::new(), Rect::NOTHING);
        let (mut gives_up, mut has_read) = (false, false);
        let delay = stage.run_interface(|ui| {
            asked = wishes(ui);
            if let Some(session) = session.as_mut().filter(|_| *shows_panels) {
                asked.extend(panels::show(ui, session));
            }
            CentralPanel::no_frame().show(ui, |ui| {
                rect = ui.max_rect();
                if let Some(session) = session {
                    let axes = session.document.opened.volume.axes;
                    pointer::steer(ui, rect, session);
                    clip::handle(ui, rect, session);
                    gizmo::draw(ui, rect, &session.scene.camera, axes);
                    hud::status(ui, rect, session, report, &memory);
                    hud::windows(ui, hud, report, session.live.as_ref(), &memory);
                    if !ui.input(|i| i.pointer.any_down()) {
                        session.history.settle(&session.scene);
                    }
                    if let Some(building) = &session.building {
                        hud::progress(ui, rect, building);
                    }
                }
                if let Some(opening) = opening {
                    hud::progress(ui, rect, opening);
                    gives_up = ui.input(|i| i.key_pressed(egui::Key::Escape));
                }
                if let Some(message) = message {
                    has_read = hud::message(ui, rect, message);
                }
            });
        })?;
        let corner = |p: egui::Pos2| [p.x, p.y].map(|x| (x * scale).round().max(0.0) as u32);
        self.place = [corner(rect.min), corner(rect.max)];
        let delay = match is_waiting {
            true => delay.min(FIGURES),
            false => delay,
        };
        self.interface_due = Instant::now().checked_add(delay);
        if has_read || self.message.as_ref().is_some_and(Message::is_old) {
            self.message = None;
        }
        if gives_up && let Some(opening) = self.opening.take() {
            opening.stop();
            self.tell("cancelled".into());
        }
        Ok(asked)
    }

    fn carry_out(&mut self, wishes: Vec<Wish>) {
        for wish in wishes {
            let done = self.carry_out_one(wish);
            match done {
                Ok(Some(text)) => self.tell(text),
                Ok(None) => {}
                Err(error) => self.complain(error),
            }
            self.interface_due = Some(Instant::now());
        }
    }

    /// Returns what to say about it.
    fn carry_out_one(&mut self, wish: Wish) -> Result<Option<String>> {
        match wish {
            Wish::PassTimes => self.hud.shows_times ^= true,
            Wish::Memory => self.hud.shows_memory ^= true,
            Wish::Help => self.hud.shows_help ^= true,
            Wish::Panels => self.shows_panels ^= true,
            Wish::FullScreen => self.toggle_full_screen(),
            _ => {}
        }
        let Some(session) = &mut self.session else {
            return Ok(None);
        };
        match wish {
            Wish::Home => session.scene.camera = session.home,
            Wish::View(n) => session.scene.camera = from_side(session, n),
            Wish::Clip => clip::toggle(session),
            Wish::Undo => session.history.undo(&mut session.scene),
            Wish::Redo => session.history.redo(&mut session.scene),
            Wish::NextVariant => {
                let variant = &mut session.scene.render.variant;
                let now = VARIANTS.iter().position(|(_, v)| v == variant);
                let (name, next) = VARIANTS[(now.unwrap_or(0) + 1) % VARIANTS.len()];
                *variant = next;
                return Ok(Some(format!("variant: {name}")));
            }
            Wish::SaveImage => {
                let path = save::image(session, self.args.seed)?;
                return Ok(Some(format!("saved {}", path.display())));
            }
            Wish::SaveScene => {
                let path = save::scene(session)?;
                return Ok(Some(format!("saved {}", path.display())));
            }
            _ => {}
        }
        Ok(None)
    }

    fn toggle_full_screen(&self) {
        if let Some(stage) = &self.stage {
            let window = &stage.window;
            window.set_fullscreen(match window.fullscreen() {
                Some(_) => None,
                None => Some(Fullscreen::Borderless(None)),
            });
        }
    }

    /// Makes pictures of the size that there is room for on the screen, or, where memory is short, of a
    /// half or a quarter of it.
    fn fit_picture(&mut self) -> Result<()> {
        let (Some(stage), Some(session)) = (&mut self.stage, &mut self.session) else {
            return Ok(());
        };
        let [low, high] = self.place;
        let whole: [u32; 2] = std::array::from_fn(|a| high[a].saturating_sub(low[a]).max(1));
        let is_settled = whole == self.fitted && !stage.is_outdated();
        let size = stage.picture_size();
        if is_settled
            && session
                .live
                .as_ref()
                .is_none_or(|l| l.scene.render.size == size)
        {
            session.scene.render.size = size;
            return Ok(());
        }
        self.fitted = whole;
        let mut size = whole;
        for divisor in [1, 2, 4, 8] {
            size = whole.map(|n| n.div_ceil(divisor));
            let for_window = bytes(&stage.plan(size)?);
            let has_room = match &session.live {
                Some(live) => live.has_room_for(size, for_window, &session.document)?,
                None => for_window <= stage.memory.budget,
            };
            if has_room {
                break;
            }
        }
        let is_new = size != stage.picture_size();
        if is_new {
            stage.resize_picture(size)?;
            self.report.resized(size);
        }
        session.scene.render.size = size;
        if let Some(live) = &mut session.live
            && (is_new || live.scene.render.size != size || stage.is_outdated())
        {
            let for_window = bytes(&stage.plan(size)?);
            live.resize(size, for_window, &session.document)?;
        }
        Ok(())
    }

    fn follow_scene(&mut self) -> Result<()> {
        let (Some(stage), Some(session)) = (&self.stage, &mut self.session) else {
            return Ok(());
        };
        let followed = session.follow(stage, &self.proxy, self.args, &mut self.report);
        match followed {
            Err(Error::Device(why)) => return Err(Error::Device(why)),
            Err(error) => self.complain(error),
            Ok(()) => {}
        }
        Ok(())
    }

    fn advance_picture(&mut self) -> Result<bool> {
        let (Some(stage), Some(session)) = (&self.stage, &mut self.session) else {
            return Ok(false);
        };
        let Some(live) = &mut session.live else {
            return Ok(false);
        };
        let was_finished = live.picture.is_finished();
        let changed = live.advance(stage.shown())?;
        self.report.planned(live.planned_bytes());
        self.report
            .take_times(&mut live.renderer.frame.timings.spans);
        if live.picture.is_finished() && !was_finished {
            self.report.finished(live);
            self.interface_due = Some(Instant::now());
        }
        Ok(changed)
    }

    fn show(&mut self, has_picture: bool) -> Result<()> {
        let Some(stage) = &mut self.stage else {
            return Ok(());
        };
        stage.show(self.place)?;
        self.report.take_times(&mut stage.frame.timings.spans);
        let live = self.session.as_ref().and_then(|s| s.live.as_ref());
        let is_moving = has_picture && live.is_some_and(|live| live.picture.is_moving());
        self.report.frame(is_moving, has_picture);
        Ok(())
    }

    /// There is something to do without waiting for an event.
    fn is_busy(&self) -> bool {
        let live = self.session.as_ref().and_then(|s| s.live.as_ref());
        live.is_some_and(|live| !live.picture.is_finished())
            || self.stage.as_ref().is_some_and(Stage::is_outdated)
    }

    /// Figures, bars or messages on the screen change without an event.
    fn is_waiting(&self) -> bool {
        self.is_busy()
            || self.opening.is_some()
            || self.message.as_ref().is_some_and(|m| !m.is_error)
            || self.session.as_ref().is_some_and(|s| s.building.is_some())
    }

    fn tell(&mut self, text: String) {
        self.report.say(&text);
        self.message = Some(Message::new(text, false));
    }

    fn complain(&mut self, error: Error) {
        self.report.say(&format!("error: {error}"));
        self.message = Some(Message::new(error.to_string(), true));
        self.interface_due = Some(Instant::now());
    }

    /// Writes the statistics and says how it ended.
    pub fn finish(mut self) -> Result<u8> {
        if let Some(error) = self.failure.take() {
            return Err(error);
        }
        let Some(stage) = &self.stage else {
            return Ok(0);
        };
        if let Some(message) = stage.device().validation_messages().first() {
            return Err(Error::Device(format!("Vulkan validation: {message}")));
        }
        if let Some(path) = &self.args.stats {
            let live = self.session.as_ref().and_then(|s| s.live.as_ref());
            let mut outputs = Outputs::default();
            outputs.json(path, &self.report.stats(stage, live))?;
            outputs.commit()?;
        }
        Ok(0)
    }

    fn fail(&mut self, event_loop: &ActiveEventLoop, error: Error) {
        self.failure.get_or_insert(error);
        event_loop.exit();
    }
}

impl ApplicationHandler<()> for App<'_> {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.stage.is_some() {
            return;
        }
        self.report.window_opened();
        match Stage::open(event_loop, self.args) {
            Ok(stage) => {
                self.stage = Some(stage);
                self.open(self.args.scene.input.clone());
            }
            Err(error) => self.fail(event_loop, error),
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(stage) = &mut self.stage else {
            return;
        };
        let wants_frame = stage.hear(&event);
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::DroppedFile(path) => self.open(path),
            WindowEvent::RedrawRequested if stage.is_hidden() => {}
            WindowEvent::RedrawRequested => {
                if let Err(error) = self.frame() {
                    self.fail(event_loop, error);
                }
            }
            _ if wants_frame => self.interface_due = Some(Instant::now()),
            _ => {}
        }
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, (): ()) {
        if INTERRUPTED.load(Ordering::Relaxed) {
            event_loop.exit();
        }
        self.interface_due = Some(Instant::now());
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        self.look_at_file();
        let Some(stage) = self.stage.as_ref().filter(|stage| !stage.is_hidden()) else {
            event_loop.set_control_flow(ControlFlow::Wait);
            return;
        };
        let now = Instant::now();
        if self.is_busy() || self.interface_due.is_some_and(|due| due <= now) {
            stage.window.request_redraw();
        }
        let file = self.watch.as_ref().map(|_| now + INTERVAL);
        let next = [file, self.interface_due].into_iter().flatten().min();
        event_loop.set_control_flow(match next {
            Some(at) => ControlFlow::WaitUntil(at),
            None => ControlFlow::Wait,
        });
    }
}

/// The camera on one of the six sides, with the whole box in the picture.
fn from_side(session: &Session, n: usize) -> Camera {
    let volume = &session.document.opened.volume;
    let view = camera::named_views(volume.axes)[n];
    let now = &session.scene.camera;
    let Some(back) = view.towards_eye(volume.axes) else {
        return *now;
    };
    let [width, height] = session.scene.render.size;
    let aspect = f64::from(width) / f64::from(height);
    let up = crate::scene::camera::default_up(back, volume.axes);
    Camera::framing(volume.extent(), [0.0; 3], back, up, now.projection, aspect)
}

fn bytes(resources: &[crate::gpu::ResourceBytes]) -> u64 {
    resources.iter().map(|r| r.bytes).sum()
}
