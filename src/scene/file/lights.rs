//! The `[[light]]` tables: directional lights, and environments that add up.

use super::resolve::NOT_NEGATIVE;
use super::{LightKind, LightTable, SceneFile};
use crate::error::Result;
use crate::scene::{DirectionalLight, Environment, EnvironmentImage};

impl SceneFile {
    pub(super) fn suns(&self) -> Result<Vec<DirectionalLight>> {
        let lights = self.lights(LightKind::Directional);
        lights.map(|(i, table)| self.sun(i, table)).collect()
    }

    fn sun(&self, i: usize, table: &LightTable) -> Result<DirectionalLight> {
        self.refuse(i, "radiance", table.radiance.is_some(), "directional")?;
        self.refuse(i, "image", table.image.is_some(), "directional")?;
        let key = format!("light.{i}.direction");
        let missing = || {
            let expected = "missing: expected where the light travels, as in [0.3, -1.0, -0.4]";
            self.origins.error(&key, expected)
        };
        let (direction, _) = self.direction(&key, table.direction.ok_or_else(missing)?)?;
        let irradiance = table.irradiance.unwrap_or([1.0; 3]);
        let key = format!("light.{i}.irradiance");
        let irradiance = self.triple(&key, irradiance, NOT_NEGATIVE)?;
        Ok(DirectionalLight {
            direction,
            irradiance,
        })
    }

    /// The environments without their images; where there is no light at all, one of radiance 1.
    pub(super) fn constant_environments(&self) -> Result<[f64; 3]> {
        if self.light.is_empty() {
            return Ok([1.0; 3]);
        }
        let mut sum = [0.0; 3];
        for (i, table) in self.lights(LightKind::Environment) {
            self.refuse(i, "direction", table.direction.is_some(), "environment")?;
            self.refuse(i, "irradiance", table.irradiance.is_some(), "environment")?;
            let radiance = self.radiance(i, table)?;
            if table.image.is_none() {
                sum = std::array::from_fn(|c| sum[c] + radiance[c]);
            }
        }
        Ok(sum)
    }

    pub(super) fn environment(&self, notes: &mut Vec<String>) -> Result<Environment> {
        let radiance = self.constant_environments()?;
        let mut sum: Option<EnvironmentImage> = None;
        for (i, table) in self.lights(LightKind::Environment) {
            let Some(image) = &table.image else { continue };
            let key = format!("light.{i}.image");
            let wrong = |problem| self.origins.error(&key, problem);
            let image = EnvironmentImage::load(&self.origins.path(image)).map_err(wrong)?;
            let image = image.times(self.radiance(i, table)?).map_err(wrong)?;
            sum = Some(match sum {
                None => image,
                Some(others) => {
                    let added = others.plus(&image);
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
        let image = sum.filter(|image| image.texels.iter().flatten().any(|texel| *texel > 0.0));
        Ok(Environment { radiance, image })
    }

    fn radiance(&self, i: usize, table: &LightTable) -> Result<[f64; 3]> {
        let radiance = table.radiance.unwrap_or([1.0; 3]);
        self.triple(&format!("light.{i}.radiance"), radiance, NOT_NEGATIVE)
    }

    fn lights(&self, kind: LightKind) -> impl Iterator<Item = (usize, &LightTable)> {
        let numbered = self.light.iter().enumerate();
        numbered.filter(move |(_, table)| table.kind == kind)
    }

    fn refuse(&self, i: usize, name: &str, given: bool, kind: &str) -> Result<()> {
        if !given {
            return Ok(());
        }
        let problem = format!("a light of type \"{kind}\" has no {name}");
        Err(self.origins.error(&format!("light.{i}.{name}"), problem))
    }
}
