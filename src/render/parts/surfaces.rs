//! Isosurfaces and their materials.

use bytemuck::Zeroable;

use super::{is_grey, stored};
use crate::render::features::Features;
use crate::render::shared::{SHADING_DISNEY, SHADING_LAMBERT, SHADING_PHONG, Surface};
use crate::scene::volume::{StoredType, Volume};
use crate::scene::{self, Isosurface, LightModel, Normals, Shading};

#[derive(Debug, Clone, PartialEq)]
pub struct Surfaces {
    pub iso: Vec<Surface>,
    pub light: LightModel,
    pub normals: Normals,
}

impl Surfaces {
    pub fn new(surfaces: &scene::Surfaces, volume: &Volume) -> Surfaces {
        Surfaces {
            iso: surfaces.iso.iter().map(|s| surface(s, volume)).collect(),
            light: surfaces.light,
            normals: surfaces.normals,
        }
    }

    /// Sets the features that shaders are compiled with because of surfaces.
    pub fn require(&self, features: &mut Features) {
        features.surface_count = self.iso.len() as u32;
        features.full_light = self.is_full_light();
        features.analytic_normals = self.normals == Normals::Analytic;
        features.has_phong = self.any_shaded(SHADING_PHONG);
        features.has_disney = self.any_shaded(SHADING_DISNEY);
    }

    /// Whether every ray sees surfaces, and not the camera's alone.
    pub fn is_full_light(&self) -> bool {
        !self.iso.is_empty() && self.light == LightModel::Full
    }

    /// The surfaces that stop light on its way through the medium.
    pub fn obstacles(&self) -> Option<&Surfaces> {
        Some(self).filter(|surfaces| surfaces.is_full_light())
    }

    /// Whether they reflect all channels of the light alike.
    pub fn are_grey(&self) -> bool {
        self.iso.iter().all(|surface| is_grey(surface.color))
    }

    /// Whether all but the isovalues is the same.
    pub fn have_materials_of(&self, other: &Surfaces) -> bool {
        let materials = |surfaces: &Surfaces| -> Vec<Surface> {
            let iso = surfaces.iso.iter();
            let anywhere = |surface: &Surface| Surface {
                value: 0.0,
                value_rest: 0.0,
                ..*surface
            };
            iso.map(anywhere).collect()
        };
        materials(self) == materials(other)
    }

    fn any_shaded(&self, shading: u32) -> bool {
        self.iso.iter().any(|surface| surface.shading == shading)
    }
}

fn surface(iso: &Isosurface, volume: &Volume) -> Surface {
    let exact = stored(volume, iso.value);
    let value = exact as f32;
    // Voxels that have the isovalue are on one side for every comparison with `value` alone.
    let has_rest = volume.stored != StoredType::F32 && value.fract() != 0.0;
    let mut surface = Surface {
        value,
        value_rest: if has_rest {
            (exact - f64::from(value)) as f32
        } else {
            0.0
        },
        opacity: iso.opacity as f32,
        color: iso.color.map(|c| c as f32),
        ..Surface::zeroed()
    };
    match iso.shading {
        Shading::Lambert => surface.shading = SHADING_LAMBERT,
        Shading::Phong {
            specular,
            shininess,
        } => {
            surface.shading = SHADING_PHONG;
            surface.specular = specular as f32;
            surface.shininess = shininess as f32;
        }
        Shading::Disney(d) => {
            surface.shading = SHADING_DISNEY;
            surface.metallic = d.metallic as f32;
            surface.roughness = d.roughness as f32;
            surface.specular = d.specular as f32;
            surface.specular_tint = d.specular_tint as f32;
            surface.sheen = d.sheen as f32;
            surface.sheen_tint = d.sheen_tint as f32;
            surface.subsurface = d.subsurface as f32;
            surface.clearcoat = d.clearcoat as f32;
            surface.clearcoat_gloss = d.clearcoat_gloss as f32;
        }
    }
    surface
}
