//! The `[[light]]` table: its keys, their meaning, and how they are printed. Constant environments are added up, and
//! so are images.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use toml::Table;

use super::SceneFile;
use super::numbers::LIGHT;
use super::page::Page;
use crate::error::Result;
use crate::regular_file::open_file;
use crate::scene::{DirectionalLight, Environment, EnvironmentFile, EnvironmentImage, Lights};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightTable {
    #[serde(rename = "type")]
    pub kind: LightKind,
    pub direction: Option<[f64; 3]>,
    pub irradiance: Option<[f64; 3]>,
    pub radiance: Option<[f64; 3]>,
    pub image: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LightKind {
    Directional,
    Environment,
}

impl LightKind {
    /// The keys that a light of this type may have.
    fn keys(self) -> &'static [&'static str] {
        match self {
            LightKind::Directional => &["direction", "irradiance"],
            LightKind::Environment => &["radiance", "image"],
        }
    }
}

impl LightTable {
    /// A light for which only the type is given.
    pub fn new(kind: LightKind) -> LightTable {
        LightTable {
            kind,
            direction: None,
            irradiance: None,
            radiance: None,
            image: None,
        }
    }
}

/// The radiance of an environment that states none, and of the one that stands for no light at all.
const RADIANCE: [f64; 3] = [1.0; 3];

impl SceneFile {
    pub(super) fn lights(&self, notes: &mut Vec<String>) -> Result<Lights> {
        let mut lights = self.lights_without_images()?;
        lights.environment.image = self.environment_image(notes)?;
        Ok(lights)
    }

    /// The lights without images: no file has to be opened for them.
    pub(super) fn lights_without_images(&self) -> Result<Lights> {
        self.refuse_foreign_keys()?;
        let suns = self.lights_of(LightKind::Directional);
        Ok(Lights {
            suns: suns
                .map(|(i, table)| self.sun(i, table))
                .collect::<Result<_>>()?,
            environment: Environment {
                radiance: self.constant_radiance()?,
                image: None,
                files: self.environment_files()?,
            },
        })
    }

    fn environment_files(&self) -> Result<Vec<EnvironmentFile>> {
        let file = |(i, path)| {
            let radiance = self.radiance(i, &self.light[i])?;
            Ok(EnvironmentFile { path, radiance })
        };
        self.numbered_images().map(file).collect()
    }

    /// The images of environments, with the number of their light.
    fn numbered_images(&self) -> impl Iterator<Item = (usize, PathBuf)> {
        let environments = self.lights_of(LightKind::Environment);
        environments.filter_map(|(i, table)| Some((i, self.origins.path(table.image.as_ref()?))))
    }

    /// The images of environments.
    pub fn images(&self) -> impl Iterator<Item = PathBuf> {
        self.numbered_images().map(|(_, path)| path)
    }

    /// Fails if an image cannot be opened: a mistake in its name is found before the volume is read.
    pub(in crate::scene) fn check_images(&self) -> Result<()> {
        for (i, path) in self.numbered_images() {
            open_file(&path).map_err(|why| {
                let problem = format!("{}: {why}", path.display());
                self.origins.error(&format!("light.{i}.image"), problem)
            })?;
        }
        Ok(())
    }

    /// Fails for a key that only lights of another type have.
    fn refuse_foreign_keys(&self) -> Result<()> {
        for (i, light) in self.light.iter().enumerate() {
            let given = Table::try_from(light).expect("a light is representable as TOML");
            let known = light.kind.keys();
            let is_foreign = |key: &&String| *key != "type" && !known.contains(&key.as_str());
            if let Some(key) = given.keys().find(is_foreign) {
                let problem = format!("a light of type {} has no {key}", given["type"]);
                return Err(self.origins.error(&format!("light.{i}.{key}"), problem));
            }
        }
        Ok(())
    }

    fn sun(&self, i: usize, table: &LightTable) -> Result<DirectionalLight> {
        let key = format!("light.{i}.direction");
        let missing = || {
            let expected = "missing: expected where the light travels, as in [0.3, -1.0, -0.4]";
            self.origins.error(&key, expected)
        };
        let (direction, _) = self.direction(&key, table.direction.ok_or_else(missing)?)?;
        let irradiance = table.irradiance.unwrap_or([1.0; 3]);
        let key = format!("light.{i}.irradiance");
        let irradiance = self.triple(&key, irradiance, LIGHT)?;
        Ok(DirectionalLight {
            direction,
            irradiance,
        })
    }

    /// The sum of the environments without an image; where there is no light at all, radiance 1.
    fn constant_radiance(&self) -> Result<[f64; 3]> {
        if self.light.is_empty() {
            return Ok(RADIANCE);
        }
        let mut sum = [0.0; 3];
        for (i, table) in self.lights_of(LightKind::Environment) {
            let radiance = self.radiance(i, table)?;
            if table.image.is_none() {
                sum = std::array::from_fn(|c| sum[c] + radiance[c]);
            }
        }
        self.triple("light", sum, LIGHT)
    }

    /// The sum of the environments' images, if there are any.
    fn environment_image(&self, notes: &mut Vec<String>) -> Result<Option<EnvironmentImage>> {
        let mut sum: Option<EnvironmentImage> = None;
        for (i, table) in self.lights_of(LightKind::Environment) {
            let Some(image) = &table.image else { continue };
            let key = format!("light.{i}.image");
            let wrong = |problem| self.origins.error(&key, problem);
            let image = EnvironmentImage::load(&self.origins.path(image)).map_err(wrong)?;
            let image = image.times(self.radiance(i, table)?).map_err(wrong)?;
            sum = Some(match sum {
                None => image,
                Some(others) => {
                    let added = others.plus(&image).map_err(wrong)?;
                    if [&others, &image]
                        .iter()
                        .any(|one| one.size() != added.size())
                    {
                        let [width, height] = added.size();
                        let resampled = format!(
                            "the environment images differ in size: all are resampled to \
                             {width}x{height}"
                        );
                        notes.push(self.origins.sentence(&key, resampled));
                    }
                    added
                }
            });
        }
        // Black images light nothing, and there is nothing in them to sample.
        Ok(sum.filter(|image| image.texels.iter().flatten().any(|texel| *texel > 0.0)))
    }

    fn radiance(&self, i: usize, table: &LightTable) -> Result<[f64; 3]> {
        let radiance = table.radiance.unwrap_or(RADIANCE);
        self.triple(&format!("light.{i}.radiance"), radiance, LIGHT)
    }

    fn lights_of(&self, kind: LightKind) -> impl Iterator<Item = (usize, &LightTable)> {
        let numbered = self.light.iter().enumerate();
        numbered.filter(move |(_, table)| table.kind == kind)
    }
}

/// Prints the lights. The constant environments were added up, so one stands for all. It is printed if it is dark as
/// well, since a scene without any light would be read as one with a bright sky.
pub(super) fn describe_lights(page: &mut Page, lights: &Lights) {
    if lights.suns.is_empty() {
        let example = DirectionalLight {
            direction: [0.0, -1.0, 0.0],
            irradiance: [1.0; 3],
        };
        page.unset(|page| describe_sun(page, &example));
    }
    lights.suns.iter().for_each(|sun| describe_sun(page, sun));
    describe_environment(page, lights.environment.radiance, None);
    for file in &lights.environment.files {
        describe_environment(page, file.radiance, Some(&file.path));
    }
}

fn describe_sun(page: &mut Page, sun: &DirectionalLight) {
    page.table("[[light]]");
    page.line("type", LightKind::Directional, "");
    page.line("direction", sun.direction, "in which the light travels");
    page.line("irradiance", sun.irradiance, "on a plane facing it");
}

fn describe_environment(page: &mut Page, radiance: [f64; 3], image: Option<&Path>) {
    page.table("[[light]]");
    page.line("type", LightKind::Environment, "");
    page.line("radiance", radiance, "times the image, if there is one");
    let image = image.map(Path::to_string_lossy);
    let meaning = "latitude-longitude, +y on top";
    page.line_or_comment("image", image, "sky.exr".into(), meaning);
}
