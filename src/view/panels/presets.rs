//! Presets to start from: a transfer function and surfaces, in the data's own units where they are known, as shares
//! of the range otherwise. Light and camera stay.

use egui::{Button, Ui};

use crate::scene::preset::{BONE, FLESH, IVORY, Point, ROUGHNESS, SKIN, SOFT_TISSUE, film};
use crate::scene::{Disney, Isosurface, Medium, Shading, TransferPoint};
use crate::view::session::Session;

struct Appearance {
    name: &'static str,
    /// Whether values are Hounsfield units; otherwise they are shares of the data's range.
    is_ct: bool,
    /// The density, as a multiple of a scene's default.
    density: f64,
    transfer: &'static [Point],
    /// Value and colour of the surface.
    surface: Option<(f64, [f64; 3])>,
}

const BLOOD: [f64; 3] = [0.95, 0.30, 0.22];
const AIR: [f64; 3] = [0.80, 0.88, 0.96];
const GREY: [f64; 3] = [0.90, 0.89, 0.87];

const APPEARANCES: [Appearance; 6] = [
    Appearance {
        name: "CT bone",
        is_ct: true,
        density: 1.0,
        transfer: &SOFT_TISSUE,
        surface: Some((BONE, IVORY)),
    },
    Appearance {
        name: "CT soft tissue",
        is_ct: true,
        density: 4.0,
        transfer: &[
            (-300.0, 0.0, SKIN),
            (-100.0, 0.35, SKIN),
            (40.0, 0.6, FLESH),
            (200.0, 1.0, IVORY),
        ],
        surface: None,
    },
    Appearance {
        name: "CT lung",
        is_ct: true,
        density: 2.0,
        transfer: &[
            (-960.0, 0.0, AIR),
            (-850.0, 0.03, AIR),
            (-600.0, 0.3, AIR),
            (-450.0, 0.05, FLESH),
            (-200.0, 0.02, FLESH),
        ],
        surface: Some((BONE, IVORY)),
    },
    Appearance {
        name: "CT angiography",
        is_ct: true,
        density: 2.0,
        transfer: &[(90.0, 0.0, BLOOD), (160.0, 0.5, BLOOD), (350.0, 1.0, BLOOD)],
        surface: Some((500.0, IVORY)),
    },
    Appearance {
        name: "MR",
        is_ct: false,
        density: 3.0,
        transfer: &[(0.10, 0.0, FLESH), (0.25, 0.25, FLESH), (0.60, 0.8, GREY)],
        surface: None,
    },
    Appearance {
        name: "film",
        is_ct: false,
        density: 1.0,
        transfer: &film(0.20, 0.26, 0.32),
        surface: Some((0.55, IVORY)),
    },
];

pub fn show(ui: &mut Ui, session: &mut Session) {
    let volume = &session.document.opened.volume;
    let range = session.document.range();
    let usual = Medium::default_density(volume.extent());
    ui.horizontal_wrapped(|ui| {
        for appearance in &APPEARANCES {
            let button = Button::new(appearance.name);
            if ui.add_enabled(appearance.suits(range), button).clicked() {
                let scene = &mut session.scene;
                scene.medium = Some(appearance.medium(range, usual));
                scene.surfaces.iso = appearance.surface(range).into_iter().collect();
                (session.chosen.point, session.chosen.surface) = (0, 0);
            }
        }
    });
}

impl Appearance {
    fn value(&self, value: f64, [low, high]: [f64; 2]) -> f64 {
        if self.is_ct {
            value
        } else {
            low + value * (high - low)
        }
    }

    /// Whether the preset suits data of this range: one of its values lies inside it.
    fn suits(&self, range: [f64; 2]) -> bool {
        let points = self.transfer.iter().map(|(value, ..)| *value);
        let mut values = points.chain(self.surface.map(|(value, _)| value));
        values.any(|value| {
            let value = self.value(value, range);
            range[0] < value && value < range[1]
        })
    }

    fn medium(&self, range: [f64; 2], usual: f64) -> Medium {
        let point = |&(value, opacity, color): &Point| TransferPoint {
            value: self.value(value, range),
            opacity,
            color,
        };
        Medium::isotropic(
            self.density * usual,
            self.transfer.iter().map(point).collect(),
        )
    }

    /// `None` also where its value lies outside of the range: it would show nothing.
    fn surface(&self, range: [f64; 2]) -> Option<Isosurface> {
        let (value, color) = self.surface?;
        let value = self.value(value, range);
        (range[0]..=range[1]).contains(&value).then(|| Isosurface {
            value,
            opacity: 1.0,
            color,
            shading: glossy(),
        })
    }
}

/// The material of a preset's surface, and of one that is switched to Disney's BRDF.
pub fn glossy() -> Shading {
    Shading::Disney(Disney {
        roughness: ROUGHNESS,
        ..Disney::default()
    })
}
