//! The `[render]` table: its keys, their meaning, and how they are printed.

use serde::{Deserialize, Serialize};
use toml::Value;

use super::SceneFile;
use super::numbers::{Expected, UNIT};
use super::page::Page;
use crate::error::Result;
use crate::scene::{Background, CacheFormat, CacheScale, RenderSettings, Tone, Variant};

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RenderTable {
    pub size: Option<[u32; 2]>,
    pub max_bounces: Option<u32>,
    pub variant: Option<Variant>,
    pub cache_scale: Option<CacheScale>,
    pub cache_format: Option<CacheFormat>,
    pub background: Option<Background>,
    pub exposure: Option<f64>,
    pub tone: Option<Tone>,
}

impl SceneFile {
    pub(super) fn render_settings(&self) -> Result<RenderSettings> {
        let table = &self.render;
        let size = table.size.unwrap_or([1024, 1024]);
        if size.contains(&0) {
            let found = format!("found {size:?}, expected a width and a height of at least 1");
            return Err(self.origins.error("render.size", found));
        }
        let background = table.background.unwrap_or(Background::Environment);
        if let Background::Color(color) = background {
            self.triple("render.background", color, UNIT)?;
        }
        let exposure = table.exposure.unwrap_or(0.0);
        let settings = RenderSettings {
            size,
            max_bounces: table.max_bounces.unwrap_or(0),
            variant: table.variant.unwrap_or(Variant::Auto),
            cache_scale: table.cache_scale.unwrap_or(CacheScale::Auto),
            cache_format: table.cache_format.unwrap_or(CacheFormat::Auto),
            background,
            exposure: self.number("render.exposure", exposure, EXPOSURE)?,
            tone: table.tone.unwrap_or(Tone::Linear),
        };
        match settings.conflict() {
            Some(conflict) => Err(self.origins.error("render.max_bounces", conflict)),
            None => Ok(settings),
        }
    }

    /// Adds a note for each key of the cache that is set where there is no cache.
    pub(super) fn note_idle_cache_keys(&self, notes: &mut Vec<String>) {
        let table = &self.render;
        let Some(variant @ (Variant::NonCaching | Variant::Published)) = table.variant else {
            return;
        };
        let is_set = [
            (
                "render.cache_scale",
                matches!(table.cache_scale, Some(CacheScale::Fixed(_))),
            ),
            (
                "render.cache_format",
                table
                    .cache_format
                    .is_some_and(|format| format != CacheFormat::Auto),
            ),
        ];
        for (key, _) in is_set.iter().filter(|(_, is_set)| *is_set) {
            let idle = format!("has no effect with variant \"{}\"", variant.name());
            notes.push(self.origins.sentence(key, idle));
        }
    }
}

/// A range far larger than any picture needs, in which 2^exposure stays representable.
pub const EXPOSURE: Expected = (
    |stops| stops.abs() <= 100.0,
    "a number of stops from -100 to 100",
);

impl TryFrom<Value> for CacheScale {
    type Error = String;

    fn try_from(value: Value) -> Result<CacheScale, String> {
        match value {
            Value::String(word) if word == "auto" => Ok(CacheScale::Auto),
            Value::Integer(1) => Ok(CacheScale::Fixed(1.0)),
            Value::Float(scale) if [1.0, 0.5, 0.25, 0.125].contains(&scale) => {
                Ok(CacheScale::Fixed(scale))
            }
            _ => Err("expected \"auto\", 1, 0.5, 0.25 or 0.125".to_string()),
        }
    }
}

impl From<CacheScale> for Value {
    fn from(scale: CacheScale) -> Value {
        match scale {
            CacheScale::Auto => "auto".into(),
            CacheScale::Fixed(scale) => scale.into(),
        }
    }
}

impl TryFrom<Value> for Background {
    type Error = String;

    fn try_from(value: Value) -> Result<Background, String> {
        let expected = || "expected \"environment\", \"transparent\" or [r, g, b]".to_string();
        match value {
            Value::String(word) if word == "environment" => Ok(Background::Environment),
            Value::String(word) if word == "transparent" => Ok(Background::Transparent),
            array => array
                .try_into()
                .map(Background::Color)
                .map_err(|_| expected()),
        }
    }
}

impl From<Background> for Value {
    fn from(background: Background) -> Value {
        match background {
            Background::Environment => "environment".into(),
            Background::Transparent => "transparent".into(),
            Background::Color(color) => color.to_vec().into(),
        }
    }
}

pub(super) fn describe_render(page: &mut Page, render: &RenderSettings) {
    page.table("[render]");
    page.line("size", render.size, "pixels");
    let bounces = "collisions and reflections on a path; 0 = no limit";
    page.line("max_bounces", render.max_bounces, bounces);
    let variants = "\"auto\" | \"caching\" | \"non-caching\" | \"published\"";
    page.line("variant", render.variant, variants);
    page.line(
        "cache_scale",
        render.cache_scale,
        "nodes per voxel and axis: \"auto\", 1, 0.5, 0.25, 0.125",
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
