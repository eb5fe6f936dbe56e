//! From what the user wrote to what is rendered: fills in every default, checks every value.
//!
//! One method a table builds that part of the scene and is its only check. [`SceneFile::check`]
//! calls those that need no volume and drops what they build.

use std::path::PathBuf;
use std::str::FromStr;

use glam::DVec3;

use super::{Endianness, IsoTable, SceneFile, ShadingModel};
use crate::error::{Error, Result};
use crate::scene::camera::{default_up, parallel};
use crate::scene::volume::{Axes, Endian, Volume, VolumeOverrides};
use crate::scene::{
    Camera, ClipPlane, Disney, Isosurface, LightModel, Medium, Normals, Projection, Scene, Shading,
    Surfaces, TransferPoint, View,
};

/// Which numbers are right, and how a message calls them. The GPU computes in single precision, so
/// what overflows there is wrong everywhere.
pub(super) type Expected = (fn(f64) -> bool, &'static str);

pub(super) const FINITE: Expected = (|_| true, "a finite number within ±3e38");
pub(super) const UNIT: Expected = (|x| (0.0..=1.0).contains(&x), "a number from 0 to 1");
pub(super) const NOT_NEGATIVE: Expected = (|x| x >= 0.0, "a finite number ≥ 0");
const POSITIVE: Expected = (|x| x > 0.0, "a finite number > 0");
const ASYMMETRY: Expected = (
    |g| (g as f32).abs() < 1.0,
    "a number between -1 and 1, both excluded",
);
const ANGLE: Expected = (
    |a| a > 0.0 && a < 180.0,
    "degrees between 0 and 180, both excluded",
);

/// The scene, and what the user should know about it: one sentence each.
pub fn resolve(file: &SceneFile, volume: &Volume) -> Result<(Scene, Vec<String>)> {
    let extent = volume.extent();
    let mut notes = Vec::new();
    let render = file.render_settings()?;
    let aspect = f64::from(render.size[0]) / f64::from(render.size[1]);
    let scene = Scene {
        medium: file.medium(Medium::default_density(extent))?,
        surfaces: file.surfaces()?,
        suns: file.suns()?,
        environment: file.environment(&mut notes)?,
        clips: file.clips()?,
        camera: file.camera(extent, volume.axes, aspect)?,
        render,
    };
    file.note_idle_parameters(&mut notes);
    file.check_visible(&scene, volume.range, &mut notes)?;
    Ok((scene, notes))
}

impl SceneFile {
    /// Everything that is wrong whatever the volume.
    pub(super) fn check(&self) -> Result<()> {
        self.volume_overrides()?;
        self.medium(1.0)?;
        self.surfaces()?;
        self.suns()?;
        self.constant_environments()?;
        self.clips()?;
        self.projection()?;
        if self.camera.eye.is_some() {
            self.camera([1.0; 3], None, 1.0)?;
        }
        self.render_settings()?;
        Ok(())
    }

    /// The file or folder that holds the volume.
    pub fn volume_path(&self) -> Result<PathBuf> {
        let missing = || {
            self.origins
                .error("volume.path", "missing: it names the volume's file")
        };
        let written = self.volume.path.as_ref().ok_or_else(missing)?;
        Ok(self.origins.path(written))
    }

    pub fn volume_overrides(&self) -> Result<VolumeOverrides> {
        let table = &self.volume;
        if let Some(dims) = table.dims.filter(|dims| dims.contains(&0)) {
            let found = format!("found {dims:?}, expected three whole numbers ≥ 1");
            return Err(self.origins.error("volume.dims", found));
        }
        if let Some(spacing) = table.spacing {
            self.triple("volume.spacing", spacing, POSITIVE)?;
        }
        if let Some([low, high]) = table.crop
            && (0..3).any(|axis| low[axis] >= high[axis])
        {
            let found = format!(
                "found [{low:?}, {high:?}], expected a low and a higher corner: [low, high) \
                 keeps at least one voxel on each axis"
            );
            return Err(self.origins.error("volume.crop", found));
        }
        Ok(VolumeOverrides {
            dims: table.dims,
            voxel_type: self.word("volume.type", &table.voxel_type)?,
            endian: table.endian.map(|endian| match endian {
                Endianness::Little => Endian::Little,
                Endianness::Big => Endian::Big,
            }),
            channel: table.channel,
            time: table.time,
            level: table.level,
            spacing: table.spacing,
            axes: self.word("volume.axes", &table.axes)?,
            crop: table.crop,
            series: table.series.clone(),
            fill_gaps: table.fill_gaps.unwrap_or(false),
        })
    }

    fn medium(&self, default_density: f64) -> Result<Option<Medium>> {
        let Some(table) = &self.medium else {
            return Ok(None);
        };
        if table.transfer.is_empty() {
            let found = "found no point, expected at least one (leave [medium] out for vacuum)";
            return Err(self.origins.error("medium.transfer", found));
        }
        let mut transfer: Vec<TransferPoint> = Vec::with_capacity(table.transfer.len());
        for (i, point) in table.transfer.iter().enumerate() {
            let key = |name: &str| format!("medium.transfer.{i}.{name}");
            let value = self.number(&key("value"), point.value, FINITE)?;
            if let Some(before) = transfer.last()
                && before.value > value
            {
                let found = format!(
                    "found {value} after {}, expected values that do not decrease",
                    before.value
                );
                return Err(self.origins.error(&key("value"), found));
            }
            transfer.push(TransferPoint {
                value,
                opacity: self.number(&key("opacity"), point.opacity.unwrap_or(1.0), UNIT)?,
                color: self.triple(&key("color"), point.color.unwrap_or([1.0; 3]), UNIT)?,
            });
        }
        let density = table.density.unwrap_or(default_density);
        Ok(Some(Medium {
            density: self.number("medium.density", density, NOT_NEGATIVE)?,
            g: self.number("medium.g", table.g.unwrap_or(0.0), ASYMMETRY)?,
            transfer,
        }))
    }

    fn surfaces(&self) -> Result<Surfaces> {
        let mut iso: Vec<Isosurface> = Vec::with_capacity(self.surfaces.iso.len());
        for (i, table) in self.surfaces.iso.iter().enumerate() {
            let surface = self.isosurface(i, table)?;
            if let Some(same) = iso.iter().position(|other| other.value == surface.value) {
                let found = format!(
                    "found {}, which surfaces.iso.{same} has as well; expected different values",
                    surface.value
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
        let shininess = self.number(&key("shininess"), shininess, NOT_NEGATIVE)?;
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

    fn clips(&self) -> Result<Vec<ClipPlane>> {
        let clip = |(i, table): (usize, &super::ClipTable)| {
            let offset = table.offset.unwrap_or(0.0);
            let offset = self.number(&format!("clip.{i}.offset"), offset, FINITE)?;
            let (normal, length) = self.direction(&format!("clip.{i}.normal"), table.normal)?;
            Ok(ClipPlane {
                normal,
                offset: offset / length,
            })
        };
        self.clip.iter().enumerate().map(clip).collect()
    }

    fn projection(&self) -> Result<Projection> {
        let table = &self.camera;
        match (table.fov_y, table.orthographic) {
            (Some(_), Some(_)) => Err(self.origins.error(
                "camera.orthographic",
                "found together with fov_y, expected one of them",
            )),
            (None, Some(height)) => Ok(Projection::Orthographic {
                height: self.number("camera.orthographic", height, POSITIVE)?,
            }),
            (fov_y, None) => Ok(Projection::Perspective {
                fov_y: self.number("camera.fov_y", fov_y.unwrap_or(40.0), ANGLE)?,
            }),
        }
    }

    fn camera(&self, extent: [f64; 3], axes: Option<Axes>, aspect: f64) -> Result<Camera> {
        let table = &self.camera;
        let projection = self.projection()?;
        let target = self.triple("camera.target", table.target.unwrap_or([0.0; 3]), FINITE)?;
        let towards_eye = match (table.eye, table.view) {
            (Some(_), Some(_)) => {
                let both = "found together with eye, expected one of them";
                return Err(self.origins.error("camera.view", both));
            }
            (Some(eye), None) => {
                let eye = self.triple("camera.eye", eye, FINITE)?;
                let back = DVec3::from(eye) - DVec3::from(target);
                if back == DVec3::ZERO {
                    let same = "found the same point as target, expected a point to look from";
                    return Err(self.origins.error("camera.eye", same));
                }
                back.to_array()
            }
            (None, view) => self.side(view.unwrap_or(View::default_for(axes)), axes)?,
        };
        let up = match table.up {
            None => default_up(towards_eye, axes),
            Some(up) => {
                let (_, _) = self.direction("camera.up", up)?;
                if parallel(up, towards_eye) {
                    let found = format!(
                        "found {up:?}, expected a direction that is not parallel to the view"
                    );
                    return Err(self.origins.error("camera.up", found));
                }
                up
            }
        };
        Ok(match table.eye {
            Some(eye) => Camera {
                eye,
                target,
                up,
                projection,
            },
            None => Camera::framing(extent, target, towards_eye, up, projection, aspect),
        })
    }

    fn side(&self, view: View, axes: Option<Axes>) -> Result<[f64; 3]> {
        view.towards_eye(axes).ok_or_else(|| {
            let unknown = "found an anatomical view, but the volume's orientation is unknown: \
                           set volume.axes (as in \"LPS\") or use +x -x +y -y +z -z";
            self.origins.error("camera.view", unknown)
        })
    }

    pub(super) fn number(&self, key: &str, value: f64, (holds, expected): Expected) -> Result<f64> {
        if value.abs() <= f64::from(f32::MAX) && holds(value) {
            return Ok(value);
        }
        Err(self
            .origins
            .error(key, format!("found {value}, expected {expected}")))
    }

    pub(super) fn triple(
        &self,
        key: &str,
        value: [f64; 3],
        expected: Expected,
    ) -> Result<[f64; 3]> {
        for component in value {
            self.number(key, component, expected).map_err(|_| {
                let found = format!("found {value:?}, expected each to be {}", expected.1);
                self.origins.error(key, found)
            })?;
        }
        Ok(value)
    }

    /// A vector that points somewhere, at unit length, and its length. One that has unit length
    /// already stays as it is to the last bit, so that a printed scene reads back as the same scene.
    pub(super) fn direction(&self, key: &str, vector: [f64; 3]) -> Result<([f64; 3], f64)> {
        self.triple(key, vector, FINITE)?;
        let length = DVec3::from(vector).length();
        if length < f64::from(f32::MIN_POSITIVE) {
            let found = format!("found {vector:?}, expected a direction, which is not zero");
            return Err(self.origins.error(key, found));
        }
        if (length - 1.0).abs() < 4.0 * f64::EPSILON {
            return Ok((vector, 1.0));
        }
        Ok((vector.map(|x| x / length), length))
    }

    fn word<T: FromStr<Err: std::fmt::Display>>(
        &self,
        key: &str,
        word: &Option<String>,
    ) -> Result<Option<T>> {
        let parse = |word: &String| {
            let wrong = |expected| -> Error {
                self.origins
                    .error(key, format!("found \"{word}\", {expected}"))
            };
            word.parse().map_err(wrong)
        };
        word.as_ref().map(parse).transpose()
    }
}
