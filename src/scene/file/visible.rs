//! Checks that the picture is not empty for a reason that can be named: isovalues outside the data, or a medium that is
//! clear everywhere.

use super::SceneFile;
use crate::error::{Result, figure};
use crate::scene::{Medium, Scene};

impl SceneFile {
    /// Fails for an isovalue that the data never reach, or a medium that is clear wherever there are data; anything
    /// that may be intended is only a note.
    pub(super) fn check_visible(
        &self,
        scene: &Scene,
        range: [f64; 2],
        notes: &mut Vec<String>,
    ) -> Result<()> {
        let [low, high] = range;
        for (i, iso) in scene.surfaces.iso.iter().enumerate() {
            let key = format!("surfaces.iso.{i}.value");
            if !(low..=high).contains(&iso.value) {
                let [found, low, high] = [iso.value, low, high].map(figure);
                let found = format!("found {found}, but the data go from {low} to {high}");
                return Err(self.origins.error(&key, found));
            }
            if iso.value == low {
                let low = figure(low);
                let flat = format!("no voxel lies below {low}, so this isosurface is empty");
                notes.push(self.origins.sentence(&key, flat));
            }
        }
        match &scene.medium {
            Some(medium) if medium.density > 0.0 => {
                if let Some(why) = why_clear(medium, range) {
                    if scene.surfaces.iso.is_empty() {
                        let nothing = format!("{why}, so there is nothing to see");
                        return Err(self.origins.error("medium.transfer", nothing));
                    }
                    notes.push(self.origins.sentence("medium.transfer", why));
                }
            }
            _ if scene.surfaces.iso.is_empty() => {
                let empty = "no medium and no isosurface: the picture is the background alone";
                notes.push(self.origins.sentence("medium", empty));
            }
            _ => {}
        }
        Ok(())
    }
}

/// The reason why no value between `low` and `high` has an opacity; `None` if one has.
fn why_clear(medium: &Medium, [low, high]: [f64; 2]) -> Option<String> {
    let points = &medium.transfer;
    // Opacity is linear in between, so it is positive at one of these if it is anywhere.
    let inside = points.iter().filter(|p| low < p.value && p.value <= high);
    let mut opacities = inside
        .map(|p| p.opacity)
        .chain([medium.classify(low).0, medium.classify(high).0]);
    if opacities.any(|opacity| opacity > 0.0) {
        return None;
    }
    let Some(first) = points.iter().position(|p| p.opacity > 0.0) else {
        return Some("opacity is 0 at every point".to_string());
    };
    let start = points[first.saturating_sub(1)].value;
    let last = points
        .iter()
        .rposition(|p| p.opacity > 0.0)
        .unwrap_or(first);
    let end = points[(last + 1).min(points.len() - 1)].value;
    let [from, to] = [low, high].map(figure);
    Some(if start >= high {
        format!("opacity starts at {}, the data end at {to}", figure(start))
    } else if end <= low {
        format!("opacity ends at {}, the data start at {from}", figure(end))
    } else {
        format!("opacity is 0 everywhere from {from} to {to}, where the data are")
    })
}
