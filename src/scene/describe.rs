//! Prints a resolved scene as a scene file: every key, its unit in a comment. Reading it again gives
//! the same scene to the last bit, so it is also what an EXR's header carries.

use serde::Serialize;
use toml::Value;

use super::file::{LightKind, SceneFile, ShadingModel};
use super::volume::Volume;
use super::{Isosurface, Medium, Projection, Scene, Shading};

/// `file` still knows the paths, which a resolved scene has no need of. They are printed as seen from
/// where this process stands.
pub fn describe(file: &SceneFile, volume: &Volume, scene: &Scene) -> String {
    let mut page = Page::default();
    page.comment(
        "Every key of the scene, defaults filled in. Colours are linear Rec. 709, lengths",
    );
    page.comment("are world units (those of the volume's spacing), values are the data's own.");
    describe_volume(&mut page, file, volume);
    if let Some(medium) = &scene.medium {
        describe_medium(&mut page, medium);
    }
    describe_surfaces(&mut page, scene);
    describe_lights(&mut page, file, scene);
    for clip in &scene.clips {
        page.table("[[clip]]");
        page.line("normal", clip.normal, "dot(normal, p) > offset is cut away");
        page.line("offset", clip.offset, "world units");
    }
    describe_camera(&mut page, scene);
    describe_render(&mut page, scene);
    page.text
}

fn describe_volume(page: &mut Page, file: &SceneFile, volume: &Volume) {
    let table = &file.volume;
    page.table("[volume]");
    if let Some(path) = &table.path {
        page.line("path", file.origins.path(path).to_string_lossy(), "");
    }
    if let Some(series) = &table.series {
        page.line(
            "series",
            series,
            "number in `isolume info`, or the SeriesInstanceUID",
        );
    }
    if let Some(fill_gaps) = table.fill_gaps {
        page.line("fill_gaps", fill_gaps, "missing slices are interpolated");
    }
    let [low, high] = volume.range;
    page.comment(&format!("the data go from {low} to {high}"));
    let raw = "raw files only";
    page.line_or_comment("dims", table.dims, volume.dims, raw);
    let voxel_type = volume.voxel_type.to_string();
    page.line_or_comment("type", table.voxel_type.as_ref(), &voxel_type, raw);
    if let Some(endian) = table.endian {
        page.line("endian", endian, raw);
    }
    for (key, given, meaning) in [
        ("channel", table.channel, "counted from 0"),
        ("time", table.time, "counted from 0"),
        ("level", table.level, "counted from 0, the finest"),
    ] {
        if let Some(given) = given {
            page.line(key, given, meaning);
        }
    }
    page.line("spacing", volume.spacing, "world units a voxel");
    // Axes that the loader has already turned would be turned again if they were written as a key.
    match (&table.axes, volume.axes) {
        (Some(written), _) => page.line("axes", written, "where i, j, k of the file grow"),
        (None, Some(axes)) => page.comment(&format!("axes: {axes}, from the file")),
        (None, None) => page.comment("axes: orientation unknown"),
    }
    let whole = [[0; 3], volume.dims];
    page.line("crop", table.crop.unwrap_or(whole), "voxels, [low, high)");
}

fn describe_medium(page: &mut Page, medium: &Medium) {
    page.table("[medium]");
    page.line(
        "density",
        medium.density,
        "extinction where opacity is 1, per world unit",
    );
    page.line("g", medium.g, "Henyey-Greenstein, > 0 forward");
    for point in &medium.transfer {
        page.table("[[medium.transfer]]");
        page.line("value", point.value, "");
        page.line("opacity", point.opacity, "");
        page.line("color", point.color, "single-scattering albedo");
    }
}

fn describe_surfaces(page: &mut Page, scene: &Scene) {
    page.table("[surfaces]");
    page.line("light", scene.surfaces.light, "\"local\" | \"full\"");
    page.line(
        "normals",
        scene.surfaces.normals,
        "\"smooth\" | \"analytic\"",
    );
    for iso in &scene.surfaces.iso {
        page.table("[[surfaces.iso]]");
        page.line("value", iso.value, "");
        page.line("opacity", iso.opacity, "probability of reflecting");
        page.line("color", iso.color, "");
        describe_shading(page, iso);
    }
}

fn describe_shading(page: &mut Page, iso: &Isosurface) {
    let models = "\"lambert\" | \"phong\" | \"disney\"";
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

/// The constant environments were added up, so one stands for all. Without any light at all it has to be
/// said that it is dark, since that is not the default.
fn describe_lights(page: &mut Page, file: &SceneFile, scene: &Scene) {
    for sun in &scene.suns {
        page.table("[[light]]");
        page.line("type", LightKind::Directional, "");
        page.line("direction", sun.direction, "in which the light travels");
        page.line("irradiance", sun.irradiance, "on a plane facing it");
    }
    let images = file.light.iter().filter(|table| table.image.is_some());
    let radiance = scene.environment.radiance;
    if radiance != [0.0; 3] || (scene.suns.is_empty() && images.clone().next().is_none()) {
        page.table("[[light]]");
        page.line("type", LightKind::Environment, "");
        page.line("radiance", radiance, "");
    }
    for table in images {
        page.table("[[light]]");
        page.line("type", LightKind::Environment, "");
        let radiance = table.radiance.unwrap_or([1.0; 3]);
        page.line("radiance", radiance, "times the image");
        let image = table.image.as_ref().map(|image| file.origins.path(image));
        let image = image.unwrap_or_default();
        page.line(
            "image",
            image.to_string_lossy(),
            "latitude-longitude, +y on top",
        );
    }
}

fn describe_camera(page: &mut Page, scene: &Scene) {
    let camera = &scene.camera;
    page.table("[camera]");
    page.line("eye", camera.eye, "world units");
    page.line("target", camera.target, "world units");
    page.line("up", camera.up, "");
    match camera.projection {
        Projection::Perspective { fov_y } => page.line("fov_y", fov_y, "degrees"),
        Projection::Orthographic { height } => {
            page.line(
                "orthographic",
                height,
                "the picture's height in world units",
            );
        }
    }
}

fn describe_render(page: &mut Page, scene: &Scene) {
    let render = &scene.render;
    page.table("[render]");
    page.line("size", render.size, "pixels");
    let bounces = "collisions and reflections on a path; 0 = no limit";
    page.line("max_bounces", render.max_bounces, bounces);
    let variants = "\"auto\" | \"caching\" | \"non-caching\" | \"published\"";
    page.line("variant", render.variant, variants);
    page.line(
        "cache_scale",
        render.cache_scale,
        "cells per voxel and axis: \"auto\", 1, 0.5, 0.25, 0.125",
    );
    page.line(
        "cache_format",
        render.cache_format,
        "\"auto\" | \"f16\" | \"f32\"",
    );
    let backgrounds = "\"environment\" | \"transparent\" | [r, g, b]";
    page.line("background", render.background, backgrounds);
    page.line("exposure", render.exposure, "stops; PNG only");
    page.line(
        "tone",
        render.tone,
        "\"linear\" (clip and sRGB) | \"filmic\"; PNG only",
    );
}

/// TOML in the making.
#[derive(Default)]
struct Page {
    text: String,
}

impl Page {
    fn table(&mut self, header: &str) {
        self.text += &format!("\n{header}\n");
    }

    fn comment(&mut self, comment: &str) {
        self.text += &format!("# {comment}\n");
    }

    fn line(&mut self, key: &str, value: impl Serialize, comment: &str) {
        let value = Value::try_from(value).expect("scene values are representable as TOML");
        let line = format!("{key} = {value}");
        match comment {
            "" => self.text += &format!("{line}\n"),
            _ => self.text += &format!("{line:<40} # {comment}\n"),
        }
    }

    /// A key where the user gave it; a comment that shows it where the file itself knew.
    fn line_or_comment<T: Serialize>(&mut self, key: &str, given: Option<T>, known: T, why: &str) {
        match given {
            Some(value) => self.line(key, value, why),
            None => {
                self.text += "# ";
                self.line(key, known, why);
            }
        }
    }
}
