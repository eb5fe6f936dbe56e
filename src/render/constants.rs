//! A scene as the shaders read it: values become stored values, directions become unit vectors.

use std::sync::Arc;

use bytemuck::Zeroable;
use glam::DVec3;

use super::environment_table;
use super::filter_probe::filter_is_precise;
use super::shared::{
    self, Clip, EnvironmentCell, Features, MACROCELL, SHADING_DISNEY, SHADING_LAMBERT,
    SHADING_PHONG, SceneConstants, Sun, Surface, TransferPoint,
};
use crate::error::Result;
use crate::gpu::{Device, Format, Shaders};
use crate::scene::volume::{Volume, Voxels};
use crate::scene::{
    Background, Camera, EnvironmentImage, Isosurface, LightModel, Normals, Projection, Scene,
    Shading,
};

/// What the scene puts on the GPU, besides the volume.
pub struct SceneBuffers {
    pub constants: SceneConstants,
    pub features: Features,
    pub transfer: Vec<TransferPoint>,
    pub surfaces: Vec<Surface>,
    pub suns: Vec<Sun>,
    pub clips: Vec<Clip>,
    pub sky: Vec<EnvironmentCell>,
    /// A single black texel if the scene has no image.
    pub environment: EnvironmentImage,
}

impl SceneBuffers {
    /// Probes the device's filter, which decides how the shaders read the volume.
    pub fn new(
        device: &Arc<Device>,
        scene: &Scene,
        volume: &Volume,
        seed: u32,
    ) -> Result<SceneBuffers> {
        let shaders = Shaders::new(shared::glsl())?;
        let precise = filter_is_precise(device, &shaders, volume_format(volume))?;
        Ok(SceneBuffers::with_filter(scene, volume, seed, !precise))
    }

    /// Without a probe, for a plan: nothing of it decides a size.
    pub fn unprobed(scene: &Scene, volume: &Volume) -> SceneBuffers {
        SceneBuffers::with_filter(scene, volume, 0, false)
    }

    fn with_filter(scene: &Scene, volume: &Volume, seed: u32, filter_in_shader: bool) -> Self {
        let suns = suns(scene);
        let image = scene.environment.image.as_ref();
        let table = image.map(environment_table::build).unwrap_or_default();
        let image_probability = match (image, suns.is_empty()) {
            (None, _) => 0.0,
            (Some(_), true) => 1.0,
            (Some(_), false) => 0.5,
        };
        let mut constants = SceneConstants {
            dims: volume.dims,
            macrocells: macrocells(volume.dims),
            spacing: volume.spacing.map(|s| s as f32),
            half_extent: volume.extent().map(|e| (0.5 * e) as f32),
            stored_max: match volume.voxels {
                Voxels::U8(_) => 255.0,
                Voxels::U16(_) => 65535.0,
                Voxels::F32(_) => 1.0,
            },
            density: scene.medium.as_ref().map_or(0.0, |m| m.density as f32),
            g: scene.medium.as_ref().map_or(0.0, |m| m.g as f32),
            transfer_points: scene.medium.as_ref().map_or(0, |m| m.transfer.len() as u32),
            max_bounces: scene.render.max_bounces,
            seed,
            size: scene.render.size,
            environment: scene.environment.radiance.map(|c| c as f32),
            image_probability,
            image_cells: table.cells,
            background: match scene.render.background {
                Background::Color(color) => color.map(|c| c as f32),
                _ => [0.0; 3],
            },
            ..SceneConstants::zeroed()
        };
        place_camera(&mut constants, &scene.camera);
        SceneBuffers {
            constants,
            features: features(scene, &suns, filter_in_shader),
            transfer: transfer(scene, volume),
            surfaces: surfaces(scene, volume),
            clips: clips(scene),
            suns,
            sky: table.sky,
            environment: image.cloned().unwrap_or(EnvironmentImage {
                width: 1,
                height: 1,
                texels: vec![[0.0; 3]],
            }),
        }
    }
}

fn features(scene: &Scene, suns: &[Sun], filter_in_shader: bool) -> Features {
    let medium = scene.medium.as_ref().filter(|m| m.density > 0.0);
    let iso = &scene.surfaces.iso;
    let any = |wanted: fn(&Shading) -> bool| iso.iter().any(|s| wanted(&s.shading));
    Features {
        has_medium: medium.is_some(),
        surface_count: iso.len() as u32,
        full_light: !iso.is_empty() && scene.surfaces.light == LightModel::Full,
        analytic_normals: scene.surfaces.normals == Normals::Analytic,
        has_phong: any(|s| matches!(s, Shading::Phong { .. })),
        has_disney: any(|s| matches!(s, Shading::Disney { .. })),
        sun_count: suns.len() as u32,
        has_environment_image: scene.environment.image.is_some(),
        is_anisotropic: medium.is_some_and(|m| m.g != 0.0),
        clip_count: scene.clips.len() as u32,
        is_orthographic: matches!(scene.camera.projection, Projection::Orthographic { .. }),
        background_is_color: matches!(scene.render.background, Background::Color(_)),
        background_is_transparent: scene.render.background == Background::Transparent,
        filter_in_shader,
    }
}

/// The data's own width.
pub fn volume_format(volume: &Volume) -> Format {
    match volume.voxels {
        Voxels::U8(_) => Format::R8_UNORM,
        Voxels::U16(_) => Format::R16_UNORM,
        Voxels::F32(_) => Format::R32_SFLOAT,
    }
}

/// Macrocells along each axis that cover all trilinear cells.
fn macrocells(dims: [u32; 3]) -> [u32; 3] {
    dims.map(|n| (n + 1).div_ceil(MACROCELL))
}

/// A value in the data's units as a stored value.
fn stored(volume: &Volume, value: f64) -> f32 {
    ((value - volume.offset) / volume.scale) as f32
}

fn transfer(scene: &Scene, volume: &Volume) -> Vec<TransferPoint> {
    let points = scene.medium.iter().flat_map(|m| &m.transfer);
    points
        .map(|p| TransferPoint {
            value: stored(volume, p.value),
            opacity: p.opacity as f32,
            color: p.color.map(|c| c as f32),
        })
        .collect()
}

fn surfaces(scene: &Scene, volume: &Volume) -> Vec<Surface> {
    let surface = |iso: &Isosurface| {
        let mut s = Surface {
            value: stored(volume, iso.value),
            opacity: iso.opacity as f32,
            color: iso.color.map(|c| c as f32),
            ..Surface::zeroed()
        };
        match iso.shading {
            Shading::Lambert => s.shading = SHADING_LAMBERT,
            Shading::Phong {
                specular,
                shininess,
            } => {
                s.shading = SHADING_PHONG;
                s.specular = specular as f32;
                s.shininess = shininess as f32;
            }
            Shading::Disney {
                metallic,
                roughness,
                specular,
                specular_tint,
                sheen,
                sheen_tint,
                subsurface,
                clearcoat,
                clearcoat_gloss,
            } => {
                s.shading = SHADING_DISNEY;
                s.metallic = metallic as f32;
                s.roughness = roughness as f32;
                s.specular = specular as f32;
                s.specular_tint = specular_tint as f32;
                s.sheen = sheen as f32;
                s.sheen_tint = sheen_tint as f32;
                s.subsurface = subsurface as f32;
                s.clearcoat = clearcoat as f32;
                s.clearcoat_gloss = clearcoat_gloss as f32;
            }
        }
        s
    };
    scene.surfaces.iso.iter().map(surface).collect()
}

/// The suns that shine, picked in proportion to their irradiance.
fn suns(scene: &Scene) -> Vec<Sun> {
    let power = |irradiance: [f64; 3]| irradiance.iter().sum::<f64>();
    let shining = || scene.suns.iter().filter(|s| power(s.irradiance) > 0.0);
    let total: f64 = shining().map(|s| power(s.irradiance)).sum();
    let mut below = 0.0;
    shining()
        .map(|s| {
            below += power(s.irradiance);
            Sun {
                direction: s.direction.map(|c| c as f32),
                irradiance: s.irradiance.map(|c| c as f32),
                cumulative_probability: (below / total) as f32,
            }
        })
        .collect()
}

fn clips(scene: &Scene) -> Vec<Clip> {
    let clip = |c: &crate::scene::ClipPlane| Clip {
        normal: c.normal.map(|n| n as f32),
        offset: c.offset as f32,
    };
    scene.clips.iter().map(clip).collect()
}

fn place_camera(constants: &mut SceneConstants, camera: &Camera) {
    let forward = (DVec3::from(camera.target) - DVec3::from(camera.eye)).normalize();
    let right = forward.cross(DVec3::from(camera.up)).normalize();
    let up = right.cross(forward);
    let half_height = match camera.projection {
        Projection::Perspective { fov_y } => (0.5 * fov_y.to_radians()).tan(),
        Projection::Orthographic { height } => 0.5 * height,
    };
    let half_width = half_height * constants.size[0] as f64 / constants.size[1] as f64;
    constants.eye = DVec3::from(camera.eye).as_vec3().to_array();
    constants.forward = forward.as_vec3().to_array();
    constants.right = (right * half_width).as_vec3().to_array();
    constants.up = (up * half_height).as_vec3().to_array();
}
