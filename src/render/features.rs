//! Which features of the shaders a scene needs: a pipeline is compiled with these constants, and what they switch off
//! is not in it.

#![allow(non_camel_case_types)]

use super::volume_images::each_volume_image;
use crate::gpu::types::*;
use crate::specialization;

specialization! {
    /// The features that a scene needs; the rest is compiled away.
    pub struct Features {
        pub has_medium: bool,
        /// All points of the transfer function have the same colour.
        pub has_one_color: bool,
        /// Over the volume's values, opacity is linear and there is one colour.
        pub is_linear: bool,
        /// The medium may be so dense that the steps of a march adapt to it (`march.glsl`).
        pub is_dense: bool,
        /// Isosurfaces; 0 = none.
        pub surface_count: uint,
        /// Every ray sees surfaces, not the camera's alone.
        pub full_light: bool,
        pub analytic_normals: bool,
        pub has_phong: bool,
        pub has_disney: bool,
        pub sun_count: uint,
        /// There are several suns that differ in colour or, in an anisotropic medium, in how much of their light is
        /// scattered into a given direction: the one transmittance that the cache holds for all suns does not give their
        /// scattered light.
        pub suns_differ: bool,
        pub has_environment_image: bool,
        pub is_anisotropic: bool,
        pub clip_count: uint,
        pub is_orthographic: bool,
        pub background_is_color: bool,
        pub background_is_transparent: bool,
        /// The collision from which a path reads the cache: 1 is the first, 0 means never.
        pub first_cached_collision: uint,
        pub cache_is_f16: bool,
        /// The cache holds the flux of light at every node: the medium scatters light by its direction.
        pub has_node_flux: bool,
        /// The cache holds two fluxes, of scattered light and of the sky's, at nodes whose indices are even: only surfaces ask
        /// for light by its direction.
        pub has_surface_fluxes: bool,
        /// Columns of a node's sums of flux (`NodeSums`): 1 where it is grey, 3 where each channel has a flux of its own, or
        /// where nodes hold two fluxes; 0 without flux.
        pub flux_columns: uint,
        /// A dense medium may end at a face of the box, at a clip plane or between two voxels (`rim_cubes.comp`).
        pub has_rim_cubes: bool,
        /// There is a cache, and opacity rises and falls again as values grow (`node_start.glsl`).
        pub has_tents: bool,
        /// The march of a picture at rest may leave light to paths (`tail_tracking.comp`).
        pub has_tails: bool,
        /// Bits of a voxel on the GPU.
        pub volume_bits: uint,
        /// The volume is cut into bricks, and not all of them are on the GPU.
        pub is_in_bricks: bool,
        /// Images that hold the volume.
        pub volume_images: uint,
    }
}

impl Features {
    /// Features that a specialization constant cannot express: formats of the images that exist in several, as GLSL's
    /// layout qualifiers, and buffers that are absent.
    pub fn macros(&self) -> Vec<(&'static str, String)> {
        let volume = match self.volume_bits {
            8 => "r8",
            16 => "r16",
            _ => "r32f",
        };
        let cache = if self.cache_is_f16 {
            "rgba16f"
        } else {
            "rgba32f"
        };
        let mut macros = vec![
            ("VOLUME_FORMAT", volume.into()),
            ("CACHE_FORMAT", cache.into()),
            (
                "EACH_VOLUME_IMAGE(DO)",
                each_volume_image(self.volume_images),
            ),
        ];
        if self.is_in_bricks {
            macros.push(("VOLUME_IN_BRICKS", "1".into()));
        }
        macros
    }

    /// Texels of flux of a node that has any.
    pub fn flux_texels(&self) -> u32 {
        if self.has_surface_fluxes {
            2
        } else {
            self.flux_columns
        }
    }

    /// Whether a picture at rest is marched, and not traced: `camera_march.comp` says why.
    pub fn is_marched(&self) -> bool {
        self.first_cached_collision == 1 && self.has_medium
    }

    /// Whether surfaces find in a table how they reflect cached light (`reflectance.glsl`).
    pub fn has_reflectance_table(&self) -> bool {
        self.first_cached_collision > 0 && (self.has_phong || self.has_disney)
    }

    /// Whether a picture at rest leaves the light of some of the cache's cubes to paths (`is_left_to_paths` in cache.glsl).
    pub fn leaves_cubes_to_paths(&self) -> bool {
        self.has_rim_cubes || self.full_light
    }
}
