//! The `[surfaces]` table: its keys, their meaning, and how they are printed.

use serde::{Deserialize, Serialize};

use super::SceneFile;
use super::numbers::{FINITE, SHININESS, UNIT};
use super::page::Page;
use crate::error::{Result, figure};
use crate::scene::surface::{self, MOST_SURFACES};
use crate::scene::volume::Volume;
use crate::scene::words::words;
use crate::scene::{Disney, Isosurface, LightModel, Normals, Scene, Shading, Surfaces};

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SurfacesTable {
    pub light: Option<LightModel>,
    pub normals: Option<Normals>,
    pub iso: Vec<IsoTable>,
}

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IsoTable {
    pub value: f64,
    pub opacity: Option<f64>,
    pub shading: Option<ShadingModel>,
    pub color: Option<[f64; 3]>,
    pub specular: Option<f64>,
    pub shininess: Option<f64>,
    pub roughness: Option<f64>,
    pub metallic: Option<f64>,
    pub specular_tint: Option<f64>,
    pub sheen: Option<f64>,
    pub sheen_tint: Option<f64>,
    pub subsurface: Option<f64>,
    pub clearcoat: Option<f64>,
    pub clearcoat_gloss: Option<f64>,
}

words! {
    #[derive(Default)]
    pub enum ShadingModel {
        #[default]
        Lambert = "lambert",
        Phong = "phong",
        Disney = "disney",
    }
}

impl SceneFile {
    pub(super) fn surfaces(&self) -> Result<Surfaces> {
        let count = self.surfaces.iso.len();
        if let Some(found) = surface::excess(count) {
            return Err(self
                .origins
                .error(&format!("surfaces.iso.{MOST_SURFACES}"), found));
        }
        let mut iso: Vec<Isosurface> = Vec::with_capacity(count);
        for (i, table) in self.surfaces.iso.iter().enumerate() {
            let surface = self.isosurface(i, table)?;
            if let Some(same) = iso.iter().position(|other| other.value == surface.value) {
                let found = format!(
                    "found {}, which surfaces.iso.{same} has as well; expected different values",
                    figure(surface.value)
                );
                return Err(self
                    .origins
                    .error(&format!("surfaces.iso.{i}.value"), found));
            }
            iso.push(surface);
        }
        Ok(Surfaces {
            light: self.surfaces.light.unwrap_or(LightModel::Local),
            normals: self.surfaces.normals.unwrap_or(Normals::Smooth),
            iso,
        })
    }

    fn isosurface(&self, i: usize, table: &IsoTable) -> Result<Isosurface> {
        let key = |name: &str| format!("surfaces.iso.{i}.{name}");
        let unit = |name: &str, value: Option<f64>, default: f64| {
            self.number(&key(name), value.unwrap_or(default), UNIT)
        };
        let default = Disney::default();
        let specular = unit("specular", table.specular, default.specular)?;
        let shininess = table.shininess.unwrap_or(32.0);
        let shininess = self.number(&key("shininess"), shininess, SHININESS)?;
        let disney = Disney {
            metallic: unit("metallic", table.metallic, default.metallic)?,
            roughness: unit("roughness", table.roughness, default.roughness)?,
            specular,
            specular_tint: unit("specular_tint", table.specular_tint, default.specular_tint)?,
            sheen: unit("sheen", table.sheen, default.sheen)?,
            sheen_tint: unit("sheen_tint", table.sheen_tint, default.sheen_tint)?,
            subsurface: unit("subsurface", table.subsurface, default.subsurface)?,
            clearcoat: unit("clearcoat", table.clearcoat, default.clearcoat)?,
            clearcoat_gloss: unit(
                "clearcoat_gloss",
                table.clearcoat_gloss,
                default.clearcoat_gloss,
            )?,
        };
        Ok(Isosurface {
            value: self.number(&key("value"), table.value, FINITE)?,
            opacity: unit("opacity", table.opacity, 1.0)?,
            color: self.triple(&key("color"), table.color.unwrap_or([0.8; 3]), UNIT)?,
            shading: match table.shading.unwrap_or_default() {
                ShadingModel::Lambert => Shading::Lambert,
                ShadingModel::Phong => Shading::Phong {
                    specular,
                    shininess,
                },
                ShadingModel::Disney => Shading::Disney(disney),
            },
        })
    }

    /// Adds a note for each parameter that the chosen shading does not have.
    pub(super) fn note_idle_parameters(&self, notes: &mut Vec<String>) {
        for (i, table) in self.surfaces.iso.iter().enumerate() {
            let shading = table.shading.unwrap_or_default();
            for (name, users) in parameters(table) {
                if !users.contains(&shading) {
                    let key = format!("surfaces.iso.{i}.{name}");
                    let idle = format!("has no effect with {} shading", shading.name());
                    notes.push(self.origins.sentence(&key, idle));
                }
            }
        }
    }
}

/// The parameters that are set, each with the shadings on which it has an effect.
fn parameters(table: &IsoTable) -> Vec<(&'static str, &'static [ShadingModel])> {
    use ShadingModel::{Disney, Phong};
    [
        (
            "specular",
            table.specular,
            &[Phong, Disney] as &[ShadingModel],
        ),
        ("shininess", table.shininess, &[Phong]),
        ("roughness", table.roughness, &[Disney]),
        ("metallic", table.metallic, &[Disney]),
        ("specular_tint", table.specular_tint, &[Disney]),
        ("sheen", table.sheen, &[Disney]),
        ("sheen_tint", table.sheen_tint, &[Disney]),
        ("subsurface", table.subsurface, &[Disney]),
        ("clearcoat", table.clearcoat, &[Disney]),
        ("clearcoat_gloss", table.clearcoat_gloss, &[Disney]),
    ]
    .into_iter()
    .filter(|(_, given, _)| given.is_some())
    .map(|(name, _, users)| (name, users))
    .collect()
}

pub(super) fn describe_surfaces(page: &mut Page, scene: &Scene, volume: &Volume) {
    page.table("[surfaces]");
    page.line("light", scene.surfaces.light, "\"local\" | \"full\"");
    page.line(
        "normals",
        scene.surfaces.normals,
        "\"smooth\" | \"analytic\"",
    );
    if scene.surfaces.iso.is_empty() {
        let [low, high] = volume.range;
        let example = Isosurface {
            value: 0.5 * (low + high),
            opacity: 1.0,
            color: [0.8; 3],
            shading: Shading::Lambert,
        };
        page.unset(|page| describe_isosurface(page, &example));
    }
    for iso in &scene.surfaces.iso {
        describe_isosurface(page, iso);
    }
}

fn describe_isosurface(page: &mut Page, iso: &Isosurface) {
    page.table("[[surfaces.iso]]");
    page.line("value", iso.value, "");
    page.line("opacity", iso.opacity, "probability of reflecting");
    page.line("color", iso.color, "");
    describe_shading(page, iso);
}

fn describe_shading(page: &mut Page, iso: &Isosurface) {
    let models = "\"lambert\" | \"phong\" | \"disney\", each with parameters of its own";
    match iso.shading {
        Shading::Lambert => page.line("shading", ShadingModel::Lambert, models),
        Shading::Phong {
            specular,
            shininess,
        } => {
            page.line("shading", ShadingModel::Phong, models);
            page.line("specular", specular, "share of the lobe");
            page.line("shininess", shininess, "exponent");
        }
        Shading::Disney(d) => {
            page.line("shading", ShadingModel::Disney, models);
            page.line("metallic", d.metallic, "");
            page.line("roughness", d.roughness, "");
            page.line("specular", d.specular, "");
            page.line("specular_tint", d.specular_tint, "");
            page.line("sheen", d.sheen, "");
            page.line("sheen_tint", d.sheen_tint, "");
            page.line("subsurface", d.subsurface, "");
            page.line("clearcoat", d.clearcoat, "");
            page.line("clearcoat_gloss", d.clearcoat_gloss, "");
        }
    }
}
