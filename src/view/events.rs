//! The event loop: events from the window system, and when the next frame is due.

use std::time::Instant;

use winit::application::ApplicationHandler;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::window::WindowId;

use super::app::App;
use super::stage::Stage;
use super::watch::INTERVAL;
use crate::error::Error;
use crate::interrupt::is_interrupted;

impl ApplicationHandler<()> for App<'_> {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.stage.is_some() {
            return;
        }
        self.report.window_opened();
        // First, since it runs in parallel with opening the device.
        self.open(self.args.scene.input.clone());
        match Stage::open(event_loop, self.args) {
            Ok(stage) => self.stage = Some(stage),
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
            WindowEvent::DroppedFile(path) => {
                self.outlives_errors = true;
                self.open(path);
            }
            WindowEvent::RedrawRequested => {
                let drawn = stage
                    .is_hidden()
                    .and_then(|hidden| if hidden { Ok(()) } else { self.frame() });
                drawn.unwrap_or_else(|error| self.fail(event_loop, error));
            }
            _ if wants_frame => {
                self.report.response.received();
                self.want_interface();
            }
            _ => {}
        }
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, (): ()) {
        if is_interrupted() {
            event_loop.exit();
        }
        self.want_interface();
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        self.reload_if_edited();
        let is_hidden = match self.stage.as_ref().map(Stage::is_hidden) {
            Some(Err(error)) => return self.fail(event_loop, error),
            Some(Ok(is_hidden)) => is_hidden,
            None => true,
        };
        let Some(stage) = self.stage.as_ref().filter(|_| !is_hidden) else {
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

impl App<'_> {
    fn fail(&mut self, event_loop: &ActiveEventLoop, error: Error) {
        self.failure.get_or_insert(error);
        event_loop.exit();
    }
}
