//! The `[medium]` table: its keys, their meaning, and how they are printed.

use serde::{Deserialize, Serialize};

use super::SceneFile;
use super::numbers::{Expected, FINITE, NOT_NEGATIVE, UNIT};
use super::page::Page;
use crate::error::{Result, figure};
use crate::scene::{Medium, TransferPoint};

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MediumTable {
    pub density: Option<f64>,
    pub g: Option<f64>,
    pub transfer: Vec<TransferTable>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TransferTable {
    pub value: f64,
    pub opacity: Option<f64>,
    pub color: Option<[f64; 3]>,
}

const ASYMMETRY: Expected = (
    |g| (g as f32).abs() < 1.0,
    "a number between -1 and 1, at most 0.99999997 from 0",
);

impl SceneFile {
    pub(super) fn medium(&self, default_density: f64) -> Result<Option<Medium>> {
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
                    "found {} after {}, expected values that do not decrease",
                    figure(value),
                    figure(before.value)
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
}

pub(super) fn describe_medium(page: &mut Page, medium: &Medium) {
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
