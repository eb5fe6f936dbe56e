//! A scene's parts in the shaders' terms: stored values, single precision, and the switches that leave
//! out what it has no need of.

use bytemuck::Zeroable;
use glam::DVec3;

use super::constants::TransferPoint;
use super::shared::{
    Clip, Features, SHADING_DISNEY, SHADING_LAMBERT, SHADING_PHONG, SceneConstants, Sun, Surface,
};
use crate::scene::volume::Volume;
use crate::scene::{
    Background, Camera, ClipPlane, Isosurface, LightModel, Normals, Projection, Scene, Shading,
};

pub(super) fn features(
    scene: &Scene,
    transfer: &[TransferPoint],
    opacity_is_linear: bool,
    suns: &[Sun],
    volume: &Volume,
    filter_in_shader: bool,
) -> Features {
    let medium = scene.medium.as_ref().filter(|m| m.density > 0.0);
    let iso = &scene.surfaces.iso;
    let has_one_color = transfer.windows(2).all(|w| w[0].color == w[1].color);
    let any = |wanted: fn(&Shading) -> bool| iso.iter().any(|s| wanted(&s.shading));
    Features {
        has_medium: medium.is_some(),
        has_one_color,
        is_linear: has_one_color && opacity_is_linear,
        surface_count: iso.len() as u32,
        full_light: !iso.is_empty() && scene.surfaces.light == LightModel::Full,
        analytic_normals: scene.surfaces.normals == Normals::Analytic,
        has_phong: any(|s| matches!(s, Shading::Phong { .. })),
        has_disney: any(|s| matches!(s, Shading::Disney(_))),
        sun_count: suns.len() as u32,
        has_environment_image: scene.environment.image.is_some(),
        is_anisotropic: medium.is_some_and(|m| m.g != 0.0),
        clip_count: scene.clips.len() as u32,
        is_orthographic: matches!(scene.camera.projection, Projection::Orthographic { .. }),
        background_is_color: matches!(scene.render.background, Background::Color(_)),
        background_is_transparent: scene.render.background == Background::Transparent,
        filter_in_shader,
        cache_order: 0,
        cache_is_f16: false,
        volume_bits: 8 * volume.stored.bytes() as u32,
    }
}

/// A value in the data's units as a stored value.
fn stored(volume: &Volume, value: f64) -> f32 {
    ((value - volume.offset) / volume.scale) as f32
}

pub(super) fn transfer(scene: &Scene, volume: &Volume) -> Vec<TransferPoint> {
    let points = scene.medium.iter().flat_map(|m| &m.transfer);
    points
        .map(|p| TransferPoint {
            value: stored(volume, p.value),
            opacity: p.opacity as f32,
            color: p.color.map(|c| c as f32),
        })
        .collect()
}

/// From points: from each to the next, and one more if the last is a step, which begins where it ends.
pub(super) fn transfer_segments(points: &[TransferPoint]) -> u32 {
    let steps_at_end = matches!(points, [.., a, b] if a.value == b.value);
    let segments = points.len().max(2) - 1;
    (segments + usize::from(steps_at_end)) as u32
}

/// Opacity at stored value 0 and what it gains per unit, if one straight line holds for all voxels.
pub(super) fn linear_opacity(transfer: &[TransferPoint], volume: &Volume) -> Option<[f32; 2]> {
    let [low, high] = volume.range.map(|value| stored(volume, value));
    let line = |n: usize| {
        let [a, b] = [&transfer[n], &transfer[n + 1]];
        // At a step the upper point counts.
        let ends_in_a_step = transfer.get(n + 2).is_some_and(|c| c.value == b.value);
        let holds = a.value <= low && high <= b.value && a.value < b.value && !ends_in_a_step;
        let slope = f64::from(b.opacity - a.opacity) / f64::from(b.value - a.value);
        let at_zero = f64::from(a.opacity) - slope * f64::from(a.value);
        holds.then_some([at_zero as f32, slope as f32])
    };
    (0..transfer.len().saturating_sub(1)).find_map(line)
}

pub(super) fn surfaces(scene: &Scene, volume: &Volume) -> Vec<Surface> {
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
            Shading::Disney(d) => {
                s.shading = SHADING_DISNEY;
                s.metallic = d.metallic as f32;
                s.roughness = d.roughness as f32;
                s.specular = d.specular as f32;
                s.specular_tint = d.specular_tint as f32;
                s.sheen = d.sheen as f32;
                s.sheen_tint = d.sheen_tint as f32;
                s.subsurface = d.subsurface as f32;
                s.clearcoat = d.clearcoat as f32;
                s.clearcoat_gloss = d.clearcoat_gloss as f32;
            }
        }
        s
    };
    scene.surfaces.iso.iter().map(surface).collect()
}

/// The suns that shine, picked in proportion to their irradiance.
pub(super) fn suns(scene: &Scene) -> Vec<Sun> {
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

pub(super) fn clips(scene: &Scene) -> Vec<Clip> {
    let clip = |c: &ClipPlane| Clip {
        normal: c.normal.map(|n| n as f32),
        offset: c.offset as f32,
    };
    scene.clips.iter().map(clip).collect()
}

pub(super) fn place_camera(constants: &mut SceneConstants, camera: &Camera) {
    let [forward, right, up] = camera.basis();
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
