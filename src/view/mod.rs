//! The window: `isolume view`.
//!
//! One thread runs the event loop ([`events`]), and [`app`] holds its frame from top to bottom: panels and mouse
//! change the scene, [`live`] brings the GPU up to date with it, and [`picture`] spends the frame's slice of time on
//! whatever the picture needs most. Opening a volume and compiling a scene's passes take longer than a frame and
//! happen on a thread of their own ([`load`]).

mod actions;
mod app;
mod camera;
mod clip;
mod document;
mod events;
mod gizmo;
mod history;
mod hud;
mod input_runs;
mod interface;
mod keys;
mod live;
mod load;
mod opening;
mod panels;
mod picture_size;
mod planned;
mod pointer;
mod recent;
mod report;
mod response;
mod save;
mod session;
mod stage;
mod textures;
mod watch;

use winit::event_loop::EventLoop;

use crate::cli::ViewArgs;
use crate::error::{DeviceError, Result};
use crate::interrupt;
use crate::output::{check_inputs_stay, check_writable};
use crate::panic_guard::unless_it_panics;

pub fn view(args: &ViewArgs) -> Result<u8> {
    check_writable(&args.stats)?;
    check_inputs_stay(&args.stats, std::slice::from_ref(&args.scene.input))?;
    let event_loop = event_loop().map_err(|problem| {
        let input = args.scene.input.display();
        DeviceError::Display(format!(
            "{problem}; `isolume render {input} -o picture.png` needs no window"
        ))
    })?;
    let proxy = event_loop.create_proxy();
    // An interruption closes the window.
    interrupt::finish_on_interrupt();
    interrupt::catch_signals_and(move || {
        let _ = proxy.send_event(());
    });
    let mut app = app::App::new(args, event_loop.create_proxy());
    let ran = event_loop.run_app(&mut app);
    app.end_build();
    ran.map_err(|e| DeviceError::Display(format!("the window system failed: {e}")))?;
    let status = app.finish()?;
    if interrupt::is_interrupted() {
        Ok(interrupt::status())
    } else {
        Ok(status)
    }
}

/// The error is a sentence without its end.
fn event_loop() -> Result<EventLoop<()>, String> {
    match unless_it_panics(|| EventLoop::with_user_event().build()) {
        Some(built) => built.map_err(|e| {
            // winit puts a line of its own source in front of the reason.
            let text = e.to_string();
            let reason = text.rsplit(": ").next().unwrap_or_default();
            let reason = reason.trim_end_matches('.');
            format!("there is no display to open a window on ({reason})")
        }),
        // winit takes for granted what an X server may lack.
        None => Err("the display cannot be used: an X server needs the XKEYBOARD extension, and this machine the \
             descriptions of keyboards that Debian's xkb-data installs"
            .into()),
    }
}
