//! Light that no sample of a picture has met.
//!
//! Samples that are all alike have no spread, and that says nothing of what is rare: through a faint haze under a bright sun,
//! thousands of paths may pass without a collision. What none of n paths has met has a probability below 3/n, at a confidence
//! of 95 % (the "rule of three": Hanley and Lippman-Hand, "If Nothing Goes Wrong, Is Everything All Right?", JAMA 1983), and
//! adds about as much as all light that arrives there.

use super::Engine;
use super::picture::{mean, radiance, relative_error};
use crate::render::Film;

/// Paths after which what none of them has met is taken not to be there.
const PATHS_TO_TRUST: f64 = (1 << 24) as f64;

impl Engine {
    /// Relative error of a picture of several units: that of its spread or, where it has none, of what may be unseen.
    pub fn relative_error_of(&self, film: &Film) -> f64 {
        let rgb = radiance(film.mean.iter().copied());
        match relative_error(&rgb, &film.stderr) {
            0.0 => self.unseen(&rgb),
            spread => spread,
        }
    }

    /// Relative error by which a render may stop: that of the picture's spread, and no less than that of what may be unseen.
    pub fn sure_error_of(&self, film: &Film) -> f64 {
        let rgb = radiance(film.mean.iter().copied());
        relative_error(&rgb, &film.stderr).max(self.unseen(&rgb))
    }

    /// Relative error of a picture because of what none of its paths has met. Marches meet all of the medium.
    fn unseen(&self, rgb: &[[f32; 3]]) -> f64 {
        let parts = &self.full.parts;
        let is_empty = parts.medium.is_vacuum() && parts.surfaces.iso.is_empty();
        if is_empty || self.renderer.is_marched() {
            return 0.0;
        }
        let [width, height] = self.renderer.size().map(f64::from);
        let paths = f64::from(self.totals().samples) * width * height;
        let light = f64::from(parts.lights.brightest());
        unseen(light, paths, mean(rgb))
    }
}

/// The same for a picture of this mean, if so much light arrives everywhere.
fn unseen(light: f64, paths: f64, mean: f64) -> f64 {
    if light == 0.0 || paths >= PATHS_TO_TRUST {
        0.0
    } else {
        3.0 * light / (paths * mean)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_unseen_is_unknown_only_where_there_is_light_and_paths_are_few() {
        assert_eq!(unseen(1.0, 65536.0, 0.0), f64::INFINITY);
        assert_eq!(unseen(0.0, 65536.0, 0.0), 0.0);
        assert_eq!(unseen(1.0, PATHS_TO_TRUST, 0.0), 0.0);
        assert!(unseen(1.0, 65536.0, 1.0) < 1e-4, "a sky that all paths see");
        assert!(
            unseen(1e6, 65536.0, 1e-3) > 1.0,
            "a sun that no path has met"
        );
    }
}
