//! Everything that turns random numbers into something else, where it runs: histograms of samples
//! against the densities that the estimators divide by, and those against exact formulas.

mod brdf;
mod half_vectors;
mod mean_medium;
mod numbers;
mod phase;
mod sky;
mod sobol;
mod statistics;

use crate::support::common;
use crate::support::probe::{Probe, Shader};
use isolume::scene::*;

mod twins {
    #![allow(non_camel_case_types)]
    use isolume::gpu::types::*;

    isolume::shared! {
        pub struct CountPush {
            pub count: uint,
        }

        pub struct WalkPush {
            pub count: uint,
            pub flights: uint,
        }

        pub struct PhaseInput {
            /// To sample with.
            pub word: uint,
            /// To take the density at: 1 − the cosine from the lobe's axis.
            pub x: float,
            /// To take the density between.
            pub before: vec3,
            pub after: vec3,
        }

        pub struct PhaseOutput {
            pub x: float,
            pub density: float,
            pub between: float,
        }

        /// Values of the field at a step's ends, and how far it is off a straight line half way.
        pub struct StepValues {
            pub a: float,
            pub b: float,
            pub bend: float,
        }

        pub struct MeanMedium {
            pub sigma_t: float,
            pub albedo: vec3,
        }

        /// Where a stream of random numbers begins.
        pub struct Stream {
            pub pixel: uint,
            pub sample_index: uint,
            pub dimension: uint,
        }

        pub struct Displacement {
            pub squared: float,
        }

        pub struct Words {
            pub x: uint,
            pub y: uint,
            pub z: uint,
            pub w: uint,
        }

        pub struct RandomWord {
            pub word: uint,
        }

        pub struct Transformed {
            pub exponential: float,
            pub unit_interval: float,
        }

        pub struct SkyInput {
            pub direction: vec3,
            pub u: vec2,
            pub word: uint,
            pub pick: float,
        }

        pub struct SkyOutput {
            pub position: vec2,
            pub image: vec3,
            pub density: float,
            pub sampled: vec3,
            pub sampled_radiance: vec3,
            pub sampled_density: float,
            /// `escaping_radiance` for a density of 0: it must be 0, not NaN.
            pub lost: vec3,
        }

        pub struct BrdfPush {
            pub count: uint,
            /// The isosurface's index.
            pub surface: uint,
        }

        /// Unit vectors that point away from the surface, and numbers to sample with.
        pub struct BrdfInput {
            pub normal: vec3,
            pub view: vec3,
            pub light: vec3,
            pub u: vec3,
        }

        pub struct BrdfOutput {
            pub value: vec3,
            pub density: float,
            pub sampled: vec3,
        }
    }
}
pub use twins::*;

/// One voxel, seen from +z, with nothing in the scene yet.
fn scene() -> Scene {
    let camera = Camera {
        eye: [0.0, 0.0, 3.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Perspective { fov_y: 30.0 },
    };
    common::empty_scene([8, 8], camera)
}

fn probe(scene: &Scene) -> Probe {
    Probe::new(scene, &common::constant_field(1.0, [1; 3], [1.0; 3]))
}
