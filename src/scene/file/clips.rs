//! The `[[clip]]` table: its keys, their meaning, and how they are printed.

use serde::{Deserialize, Serialize};

use super::SceneFile;
use super::numbers::FINITE;
use super::page::Page;
use crate::error::{Result, figure};
use crate::scene::ClipPlane;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClipTable {
    pub normal: [f64; 3],
    pub offset: Option<f64>,
}

impl SceneFile {
    pub(super) fn clips(&self) -> Result<Vec<ClipPlane>> {
        let clip = |(i, table): (usize, &ClipTable)| {
            let given = table.offset.unwrap_or(0.0);
            let key = format!("clip.{i}.offset");
            self.number(&key, given, FINITE)?;
            let (normal, length) = self.direction(&format!("clip.{i}.normal"), table.normal)?;
            let offset = self.number(&key, given / length, FINITE).map_err(|_| {
                let given = figure(given);
                let found = format!("found {given} with a normal of length {length:e}");
                let expected = format!("expected their quotient to be {}", FINITE.1);
                self.origins.error(&key, format!("{found}, {expected}"))
            })?;
            Ok(ClipPlane { normal, offset })
        };
        self.clip.iter().enumerate().map(clip).collect()
    }
}

pub(super) fn describe_clips(page: &mut Page, clips: &[ClipPlane]) {
    if clips.is_empty() {
        let example = ClipPlane {
            normal: [1.0, 0.0, 0.0],
            offset: 0.0,
        };
        page.unset(|page| describe_clip(page, &example));
    }
    clips.iter().for_each(|clip| describe_clip(page, clip));
}

fn describe_clip(page: &mut Page, clip: &ClipPlane) {
    page.table("[[clip]]");
    page.line("normal", clip.normal, "dot(normal, p) > offset is cut away");
    page.line("offset", clip.offset, "world units");
}
