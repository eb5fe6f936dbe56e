//! A scene for a volume without one. A preset only writes what a user could have written, a [`SceneFile`], so that
//! `--set` changes it and `isolume scene` prints it like any other.
//!
//! Both presets show one material as a glassy medium and a denser one inside it as a surface, except for densities and
//! distances, if the file says that its values are such. The medium is a film where the material begins, dense at grazing
//! angles and clear from the front, and a haze behind it. Opacities are chosen for the default density, 50 over the longest
//! side: a haze of α = 0.03 has optical depth 1.5 across the box, whatever the units are.

use std::path::Path;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::camera::{Side, default_up};
use super::file::{
    IsoTable, LightKind, LightTable, MediumTable, SceneFile, ShadingModel, SurfacesTable,
    TransferTable,
};
use super::volume::{Axes, Quantity, Volume};
use crate::error::{Error, Result};
use crate::scene::Background;

pub const SKIN: [f64; 3] = [0.99, 0.78, 0.66];
pub const FLESH: [f64; 3] = [0.98, 0.60, 0.45];
pub const IVORY: [f64; 3] = [0.86, 0.80, 0.68];
/// Roughness of the surfaces, which use Disney's BRDF: a little glossier than by default.
pub const ROUGHNESS: f64 = 0.45;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// `Ct` where the file says that values are Hounsfield units, or where it does not say what they are and they are
    /// integers down to −900 or less, which only Hounsfield units reach; otherwise `Generic`.
    Auto,
    /// Soft tissue as medium, bone as surface.
    Ct,
    /// A medium where the file says that values are densities, a surface at 0 where they are distances; otherwise
    /// thresholds are taken from the histogram.
    Generic,
}

impl Preset {
    /// The scene's name in messages, and the scene, lit for this view; its `volume` table is left open.
    pub fn scene(
        self,
        path: &Path,
        volume: &Volume,
        view: Option<Side>,
    ) -> Result<(String, SceneFile)> {
        let [low, high] = volume.range;
        if low == high {
            let problem = format!("every voxel is {low}, so there is nothing to see");
            return Err(Error::input(path, problem));
        }
        let integer = !volume.voxel_type.is_float();
        let is_hounsfield = match volume.quantity {
            Some(quantity) => quantity == Quantity::Hounsfield,
            None => integer && low <= -900.0,
        };
        let (name, medium, iso) = match (self, volume.quantity) {
            (Preset::Ct, _) => ct(volume),
            (Preset::Auto, _) if is_hounsfield => ct(volume),
            (_, Some(Quantity::Density)) if high > 0.0 => ("generic", Some(fog(high)), None),
            (_, Some(Quantity::Distance)) if low < 0.0 && high > 0.0 => {
                ("generic", None, Some(surface(0.0)))
            }
            (Preset::Auto | Preset::Generic, _) => generic(volume)?,
        };
        let mut scene = SceneFile {
            medium,
            surfaces: SurfacesTable {
                iso: iso.into_iter().collect(),
                ..Default::default()
            },
            light: lights(volume.axes, view),
            ..Default::default()
        };
        scene.render.background = Some(Background::Color([0.012, 0.016, 0.024]));
        Ok((format!("{} (preset {name})", path.display()), scene))
    }
}

type Appearance = (&'static str, Option<MediumTable>, Option<IsoTable>);

/// Value, opacity and colour of a transfer function's point.
pub type Point = (f64, f64, [f64; 3]);

/// Hounsfield units: air −1000, fat −100, water 0, muscle 50, bone from 200 on.
pub const SOFT_TISSUE: [Point; 3] = film(-450.0, -300.0, -150.0);
/// Keeps contrast agent and cartilage out of the bone.
pub const BONE: f64 = 300.0;

fn ct(volume: &Volume) -> Appearance {
    let bone = (volume.range[1] >= BONE).then(|| surface(BONE));
    ("ct", Some(medium(SOFT_TISSUE)), bone)
}

/// Four classes: empty, thin, dense and densest. The medium begins with the thin class, the surface with the dense
/// one.
fn generic(volume: &Volume) -> Result<Appearance> {
    let thresholds = volume.histogram_of_data()?.otsu();
    let (medium, dense) = match thresholds[..] {
        [thin, dense, ..] => {
            let width = dense - thin;
            let medium = medium(film(thin, thin + 0.2 * width, thin + 0.4 * width));
            (Some(medium), Some(dense))
        }
        [dense] => (None, Some(dense)),
        [] => (None, None),
    };
    Ok(("generic", medium, dense.map(surface)))
}

/// A film that is densest at the value `film`, and a haze from `haze` on.
pub const fn film(start: f64, film: f64, haze: f64) -> [Point; 3] {
    [(start, 0.0, SKIN), (film, 1.0, SKIN), (haze, 0.03, FLESH)]
}

/// Extinction in proportion to the value, up to 1 at `most`, which scatters nearly all light as a cloud does.
fn fog(most: f64) -> MediumTable {
    const WHITE: [f64; 3] = [0.99; 3];
    medium([(0.0, 0.0, WHITE), (most, 1.0, WHITE)])
}

fn medium<const N: usize>(points: [Point; N]) -> MediumTable {
    let point = |(value, opacity, color)| TransferTable {
        value,
        opacity: Some(opacity),
        color: Some(color),
    };
    MediumTable {
        transfer: points.map(point).to_vec(),
        ..Default::default()
    }
}

fn surface(value: f64) -> IsoTable {
    IsoTable {
        value,
        color: Some(IVORY),
        shading: Some(ShadingModel::Disney),
        roughness: Some(ROUGHNESS),
        ..Default::default()
    }
}

/// A warm sun over the viewer's left shoulder, and a dim blue sky that fills the shadows. A view that the orientation does
/// not know is refused later.
fn lights(axes: Option<Axes>, view: Option<Side>) -> Vec<LightTable> {
    let default = Side::default_for(axes).towards_eye(axes);
    let back = view.and_then(|view| view.towards_eye(axes)).or(default);
    let back = back.expect("the default view exists for every orientation");
    let up = DVec3::from(default_up(back, axes));
    let back = DVec3::from(back);
    let right = up.cross(back);
    let sun = LightTable {
        direction: Some((0.45 * right - 0.65 * up - 0.6 * back).to_array()),
        irradiance: Some([4.2, 3.9, 3.4]),
        ..LightTable::new(LightKind::Directional)
    };
    let sky = LightTable {
        radiance: Some([0.13, 0.16, 0.21]),
        ..LightTable::new(LightKind::Environment)
    };
    vec![sun, sky]
}
