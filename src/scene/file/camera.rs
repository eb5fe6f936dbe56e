//! The `[camera]` table: its keys, their meaning, and how they are printed.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::SceneFile;
use super::numbers::{Expected, FINITE, POSITIVE};
use super::page::Page;
use crate::error::Result;
use crate::scene::camera::{default_up, parallel};
use crate::scene::volume::Axes;
use crate::scene::{Camera, Projection, Side};

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CameraTable {
    pub eye: Option<[f64; 3]>,
    pub view: Option<Side>,
    pub target: Option<[f64; 3]>,
    pub up: Option<[f64; 3]>,
    pub fov_y: Option<f64>,
    pub orthographic: Option<f64>,
}

const ANGLE: Expected = (
    |a| a > 0.0 && a < 180.0,
    "degrees between 0 and 180, both excluded",
);

/// The angle of view where none is set.
const FOV_Y: f64 = 40.0;

impl SceneFile {
    /// Finds the mistakes that do not depend on the volume.
    pub(super) fn check_camera(&self) -> Result<()> {
        let table = &self.camera;
        self.projection()?;
        self.triple("camera.target", table.target.unwrap_or_default(), FINITE)?;
        if let Some(up) = table.up {
            self.direction("camera.up", up)?;
        }
        let is_known = |view: Side| view.towards_eye(None).is_some();
        if table.eye.is_some() || table.view.is_some_and(is_known) {
            self.camera([1.0; 3], None, 1.0).map(drop)
        } else {
            Ok(())
        }
    }

    pub(super) fn projection(&self) -> Result<Projection> {
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
                fov_y: self.number("camera.fov_y", fov_y.unwrap_or(FOV_Y), ANGLE)?,
            }),
        }
    }

    pub(super) fn camera(
        &self,
        extent: [f64; 3],
        axes: Option<Axes>,
        aspect: f64,
    ) -> Result<Camera> {
        let table = &self.camera;
        let projection = self.projection()?;
        let target = self.triple("camera.target", table.target.unwrap_or([0.0; 3]), FINITE)?;
        let towards_eye = self.towards_eye(target, axes)?;
        let up = self.up(towards_eye, axes)?;
        if let Some(eye) = table.eye {
            return Ok(Camera {
                eye,
                target,
                up,
                projection,
            });
        }
        let camera = Camera::framing(extent, target, towards_eye, up, projection, aspect);
        let eye = self.triple("camera.eye", camera.eye, FINITE);
        if eye.is_ok_and(|eye| eye != target) {
            Ok(camera)
        } else {
            let missing = format!(
                "missing, and the whole box is seen from {:?}; expected a point other than target, \
                     within ±3e38",
                camera.eye
            );
            Err(self.origins.error("camera.eye", missing))
        }
    }

    /// The direction from the target to the eye, of any length.
    fn towards_eye(&self, target: [f64; 3], axes: Option<Axes>) -> Result<[f64; 3]> {
        match (self.camera.eye, self.camera.view) {
            (Some(_), Some(_)) => {
                let both = "found together with eye, expected one of them";
                Err(self.origins.error("camera.view", both))
            }
            (Some(eye), None) => {
                let eye = self.triple("camera.eye", eye, FINITE)?;
                if eye == target {
                    let same = "found the same point as target, expected a point to look from";
                    return Err(self.origins.error("camera.eye", same));
                }
                Ok((DVec3::from(eye) - DVec3::from(target)).to_array())
            }
            (None, view) => self.side(view.unwrap_or(Side::default_for(axes)), axes),
        }
    }

    fn up(&self, towards_eye: [f64; 3], axes: Option<Axes>) -> Result<[f64; 3]> {
        let Some(up) = self.camera.up else {
            return Ok(default_up(towards_eye, axes));
        };
        let (_, _) = self.direction("camera.up", up)?;
        if parallel(up, towards_eye) {
            let found =
                format!("found {up:?}, expected a direction that is not parallel to the view");
            return Err(self.origins.error("camera.up", found));
        }
        Ok(up)
    }

    fn side(&self, view: Side, axes: Option<Axes>) -> Result<[f64; 3]> {
        view.towards_eye(axes).ok_or_else(|| {
            let unknown = "found an anatomical view, but the volume's orientation is unknown: \
                           set volume.axes (as in \"LPS\") or use +x -x +y -y +z -z";
            self.origins.error("camera.view", unknown)
        })
    }
}

pub(super) fn describe_camera(page: &mut Page, camera: &Camera) {
    page.table("[camera]");
    page.line("eye", camera.eye, "world units");
    let views = "instead of eye: anterior posterior left right superior inferior +x -x +y -y +z -z";
    page.unset(|page| page.line("view", Side::PlusZ, views));
    page.line("target", camera.target, "world units");
    page.line("up", camera.up, "");
    let [angle, height] = ["degrees", "the picture's height in world units"];
    match camera.projection {
        Projection::Perspective { fov_y } => {
            page.line("fov_y", fov_y, angle);
            let instead = format!("instead of fov_y: {height}");
            page.unset(|page| page.line("orthographic", 100.0, &instead));
        }
        Projection::Orthographic { height: given } => {
            page.line("orthographic", given, height);
            let instead = format!("instead of orthographic: {angle}");
            page.unset(|page| page.line("fov_y", FOV_Y, &instead));
        }
    }
}
