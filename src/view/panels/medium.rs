//! Controls for the medium's density, and for where it scatters.

use egui::Ui;

use super::slider;
use crate::scene::{Medium, TransferPoint};
use crate::view::session::Session;

/// Highest density, as a multiple of a scene's default.
const DENSEST: f64 = 40.0;

pub fn show(ui: &mut Ui, session: &mut Session) {
    let volume = &session.document.opened.volume;
    let usual = Medium::default_density(volume.extent());
    let [low, high] = session.document.range();
    let Some(medium) = &mut session.scene.medium else {
        if ui.button("Add a medium").clicked() {
            session.scene.medium = Some(ramp(low, high, usual));
        }
        return;
    };
    let most = DENSEST * usual;
    slider(ui, "density", &mut medium.density, [0.0, most], true);
    slider(ui, "g (forward > 0)", &mut medium.g, [-0.95, 0.95], false);
    if ui.button("Remove the medium").clicked() {
        session.scene.medium = None;
    }
}

/// A medium that is clear at the low end of the data and a little opaque at the high end.
fn ramp(low: f64, high: f64, density: f64) -> Medium {
    let point = |value, opacity| TransferPoint {
        value,
        opacity,
        color: [0.9; 3],
    };
    Medium::isotropic(
        density,
        vec![point(0.5 * (low + high), 0.0), point(high, 0.2)],
    )
}
