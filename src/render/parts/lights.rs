//! Suns and sky.

use std::sync::Arc;

use super::sky_image::SkyImage;
use super::{is_grey, over};
use crate::render::features::Features;
use crate::render::shared::Sun;
use crate::scene::{self, DirectionalLight};

#[derive(Debug, Clone, PartialEq)]
pub struct Lights {
    /// The suns that shine, with the probabilities by which next-event estimation picks them.
    pub suns: Vec<Sun>,
    /// Radiance of the constant part of the sky.
    pub environment: [f32; 3],
    /// The sky's image, if there is one.
    pub sky_image: Option<Arc<SkyImage>>,
}

impl Lights {
    /// `before` is the sky of an earlier state of the scene; it is used again if the image is the same.
    pub fn new(lights: &scene::Lights, before: Option<&Arc<SkyImage>>) -> Lights {
        let sky_image = lights.environment.image.as_ref().map(|image| {
            let known = before.filter(|sky| sky.image == *image);
            known
                .cloned()
                .unwrap_or_else(|| Arc::new(SkyImage::new(image)))
        });
        Lights {
            suns: suns(&lights.suns),
            environment: lights.environment.radiance.map(|c| c as f32),
            sky_image,
        }
    }

    /// Sets the features that shaders are compiled with because of the lights.
    pub fn require(&self, features: &mut Features) {
        features.sun_count = self.suns.len() as u32;
        features.has_environment_image = self.sky_image.is_some();
    }

    /// Probability that next-event estimation picks the sky's image over a sun.
    pub fn image_probability(&self) -> f32 {
        match (&self.sky_image, self.suns.is_empty()) {
            (None, _) => 0.0,
            (Some(_), true) => 1.0,
            (Some(_), false) => 0.5,
        }
    }

    /// The radiance that the cache holds as 1, channel by channel: as much as all lights together shine. It is 1
    /// where none shines.
    pub fn cache_unit(&self) -> [f32; 3] {
        self.all().map(|all| if all > 0.0 { all } else { 1.0 })
    }

    /// What all lights together shine in the channel in which it is most.
    pub fn brightest(&self) -> f32 {
        self.all().into_iter().fold(0.0, f32::max)
    }

    fn all(&self) -> [f32; 3] {
        let sky = self.sky_radiance();
        std::array::from_fn(|c| {
            let suns: f32 = self.suns.iter().map(|sun| sun.irradiance[c]).sum();
            suns + sky[c]
        })
    }

    /// Mean radiance of the sky, its image included.
    pub fn sky_radiance(&self) -> [f32; 3] {
        let image = self.mean_of_image();
        std::array::from_fn(|c| self.environment[c] + image[c])
    }

    /// The same in units of [`cache_unit`](Lights::cache_unit).
    pub fn sky_in_cache_units(&self) -> [f32; 3] {
        over(self.sky_radiance(), self.cache_unit())
    }

    /// [`SkyImage::unevenness`] of the whole sky.
    pub fn unevenness(&self) -> f32 {
        let grey = |light: [f32; 3]| light.iter().sum::<f32>();
        let sky = grey(self.sky_radiance());
        match &self.sky_image {
            Some(image) if sky > 0.0 => image.unevenness * grey(image.mean) / sky,
            _ => 0.0,
        }
    }

    /// Cells of the sampling table of the sky's image along u and v; 0 without an image.
    pub fn image_cells(&self) -> [u32; 2] {
        let image = self.sky_image.as_ref();
        image.map_or([0; 2], |sky| sky.table.cells)
    }

    /// Whether all lights have the same colour, apart from rounding.
    pub fn have_one_color(&self) -> bool {
        let unit = self.cache_unit();
        let suns = self.suns.iter().map(|sun| sun.irradiance);
        let mut lights = suns.chain([self.environment, self.mean_of_image()]);
        let sky = self.sky_image.as_ref();
        lights.all(|light| is_grey(over(light, unit))) && sky.is_none_or(|sky| sky.has_one_color)
    }

    /// Whether all suns have the same colour, apart from rounding.
    pub fn suns_have_one_color(&self) -> bool {
        let is_like = |one: [f32; 3], other: [f32; 3]| {
            [[0, 1], [1, 2], [2, 0]].iter().all(|&[c, d]| {
                let products = [one[c] * other[d], one[d] * other[c]];
                (products[0] - products[1]).abs() <= 1e-6 * products[0].abs()
            })
        };
        let mut pairs = self.suns.windows(2);
        pairs.all(|pair| is_like(pair[0].irradiance, pair[1].irradiance))
    }

    fn mean_of_image(&self) -> [f32; 3] {
        self.sky_image.as_ref().map_or([0.0; 3], |sky| sky.mean)
    }

    /// Sum over the suns of the mean over channels of irradiance/unit.
    pub fn suns_grey(&self) -> f32 {
        let unit = self.cache_unit();
        let grey = |sun: &Sun| over(sun.irradiance, unit).iter().sum::<f32>() / 3.0;
        self.suns.iter().map(grey).sum()
    }

    /// Whether each light has the same share in all light as in `other`, apart from rounding. The cache holds shares
    /// alone, so it outlives a brightness or a colour that all lights take on alike.
    pub fn have_shares_of(&self, other: &Lights) -> bool {
        let Lights {
            suns,
            environment: _, // which has no direction
            sky_image,
        } = other;
        let directions = |suns: &[Sun]| suns.iter().map(|s| s.direction).collect::<Vec<_>>();
        let size = |sky: &Option<Arc<SkyImage>>| sky.as_ref().map(|sky| sky.image.size());
        directions(&self.suns) == directions(suns)
            && size(&self.sky_image) == size(sky_image)
            && self.are_scaled_to(other)
    }

    fn are_scaled_to(&self, other: &Lights) -> bool {
        let factor = over(other.cache_unit(), self.cache_unit());
        let is_scaled = |a: [f32; 3], b: [f32; 3]| {
            (0..3).all(|c| (factor[c] * a[c] - b[c]).abs() <= 1e-6 * b[c].abs())
        };
        let Lights {
            suns,
            environment,
            sky_image,
        } = self;
        let suns = suns.iter().zip(&other.suns);
        let images = sky_image.iter().zip(&other.sky_image);
        suns.map(|(a, b)| (a.irradiance, b.irradiance))
            .chain([(*environment, other.environment)])
            .all(|(a, b)| is_scaled(a, b))
            && images.into_iter().all(|(a, b)| {
                if Arc::ptr_eq(a, b) {
                    // An image shared by both is not compared texel by texel: it is scaled by 1, or not at all.
                    is_scaled(a.mean, b.mean)
                } else {
                    let mut texels = a.image.texels.iter().zip(b.image.texels.iter());
                    texels.all(|(&a, &b)| is_scaled(a, b))
                }
            })
    }
}

/// The suns that shine, picked in proportion to their irradiance.
fn suns(lights: &[DirectionalLight]) -> Vec<Sun> {
    let power = |irradiance: [f64; 3]| irradiance.iter().sum::<f64>();
    let shining = || lights.iter().filter(|s| power(s.irradiance) > 0.0);
    let total: f64 = shining().map(|s| power(s.irradiance)).sum();
    let mut below = 0.0;
    shining()
        .map(|s| {
            below += power(s.irradiance);
            Sun {
                direction: s.direction.map(|c| c as f32),
                irradiance: s.irradiance.map(|c| c as f32),
                cumulative_probability: (below / total) as f32,
            }
        })
        .collect()
}
