//! Light reflected and transmitted by plane-parallel media. Under a sky that is 1 above and 0 below,
//! a slab seen along its normal shows, by reciprocity, the flux that it would reflect or transmit of
//! a collimated beam. The sky's red is above, its green below and its blue everywhere, so that one
//! picture shows both and their sum.

use isolume::scene::volume::{Volume, Voxels};
use isolume::scene::*;

use crate::support::common::*;
use crate::support::exact::expect;

/// Where the camera stands.
#[derive(Clone, Copy)]
enum Side {
    Above,
    Below,
}

fn camera(side: Side) -> Camera {
    let y = match side {
        Side::Above => 2.0,
        Side::Below => -2.0,
    };
    Camera {
        eye: [0.0, y, 0.0],
        target: [0.0; 3],
        up: [0.0, 0.0, 1.0],
        projection: Projection::Orthographic { height: 1.0 },
    }
}

fn two_coloured_sky() -> EnvironmentImage {
    const ROWS: usize = 256;
    let row = |j| {
        if j < ROWS / 2 {
            [1.0, 0.0, 1.0]
        } else {
            [0.0, 1.0, 1.0]
        }
    };
    EnvironmentImage {
        width: 1,
        height: ROWS as u32,
        texels: (0..ROWS).map(row).collect(),
    }
}

/// A slab of thickness 1, which edge losses do not reach.
fn layers(values: &[f32]) -> Volume {
    let dims = [1, values.len() as u32, 1];
    let spacing = [100.0, 1.0 / values.len() as f64, 100.0];
    Volume::from_values(dims, spacing, Voxels::F32(values.to_vec())).expect("a volume")
}

/// Reflectance and transmittance depend on the optical depth alone, however it is spread over the
/// layers: opacity is the value, and the layers' mean is ½.
const UNIFORM: &[f32] = &[0.5];
const LAYERED: &[f32] = &[0.1, 0.9, 0.9, 0.0, 0.0, 0.5, 1.0, 0.2, 0.2, 0.6, 0.7, 0.9];

struct Slab {
    side: Side,
    layers: &'static [f32],
    albedo: f64,
    g: f64,
    depth: f64,
}

fn slab_scene(slab: &Slab) -> Scene {
    let mut scene = empty_scene([32, 32], camera(slab.side));
    let point = |value: f64| TransferPoint {
        value,
        opacity: value,
        color: [slab.albedo; 3],
    };
    scene.medium = Some(Medium {
        g: slab.g,
        ..Medium::isotropic(2.0 * slab.depth, vec![point(0.0), point(1.0)])
    });
    scene.lights.environment.image = Some(two_coloured_sky());
    scene
}

/// Numbers by adding–doubling with 64 nodes, for a beam along the normal.
fn expect_slab(slab: Slab, reflected: f64, transmitted: f64) {
    let (r, t) = (reflected, transmitted);
    let exact = match slab.side {
        Side::Above => [r, t, r + t],
        Side::Below => [t, r, r + t],
    };
    expect("slab", &slab_scene(&slab), &layers(slab.layers), exact);
}

macro_rules! slabs {
    ($($name:ident: $side:ident, $layers:ident, albedo $a:literal, g $g:literal, depth $depth:literal
       => $r:literal, $t:literal;)*) => {
        $(#[test]
        fn $name() {
            let slab = Slab {
                side: Side::$side,
                layers: $layers,
                albedo: $a,
                g: $g,
                depth: $depth,
            };
            expect_slab(slab, $r, $t);
        })*
    };
}

slabs! {
    white_half: Above, UNIFORM, albedo 1.0, g 0.0, depth 0.5 => 0.202506, 0.797494;
    white_1: Below, LAYERED, albedo 1.0, g 0.0, depth 1.0 => 0.341329, 0.658671;
    white_4: Above, LAYERED, albedo 1.0, g 0.0, depth 4.0 => 0.690926, 0.309074;
    white_16: Below, UNIFORM, albedo 1.0, g 0.0, depth 16.0 => 0.903632, 0.096368;
    white_64: Below, UNIFORM, albedo 1.0, g 0.0, depth 64.0 => 0.974338, 0.025662;
    pale_8: Above, LAYERED, albedo 0.99, g 0.0, depth 8.0 => 0.728750, 0.122068;
    grey_1: Below, LAYERED, albedo 0.9, g 0.0, depth 1.0 => 0.267410, 0.591625;
    darker_1: Above, LAYERED, albedo 0.8, g 0.0, depth 1.0 => 0.210847, 0.541400;
    dark_1: Below, UNIFORM, albedo 0.5, g 0.0, depth 1.0 => 0.099119, 0.446058;
    forward_white_1: Above, LAYERED, albedo 1.0, g 0.5, depth 1.0 => 0.176115, 0.823885;
    forward_grey_2: Below, LAYERED, albedo 0.9, g 0.75, depth 2.0 => 0.097395, 0.660958;
    peaked_white_16: Above, UNIFORM, albedo 1.0, g 0.85, depth 16.0 => 0.557209, 0.442791;
    peaked_grey_4: Below, LAYERED, albedo 0.9, g 0.85, depth 4.0 => 0.081289, 0.493072;
}

/// Nothing comes back from a depth of 150: over it, albedo .999 differs by 2e-7 from a half-space.
/// One sky all around will do.
fn expect_half_space(albedo: [f64; 3], reflected: [f64; 3]) {
    let mut scene = empty_scene([32, 32], camera(Side::Above));
    let point = TransferPoint {
        value: 0.0,
        opacity: 1.0,
        color: albedo,
    };
    scene.medium = Some(Medium::isotropic(150.0, vec![point]));
    scene.lights.environment.radiance = [1.0; 3];
    expect("half-space", &scene, &layers(UNIFORM), reflected);
}

/// Chandrasekhar: R = 1 − √(1 − a)·H(1).
#[test]
fn dark_half_spaces() {
    expect_half_space([0.5, 0.8, 0.9], [0.115226, 0.285255, 0.414947]);
}

#[test]
fn pale_half_spaces() {
    expect_half_space([0.9, 0.99, 0.999], [0.414947, 0.752721, 0.912845]);
}
