//! Surfaces in both light models through whole pictures.

use super::*;
use crate::support::fields::field;
use crate::support::oracle::render;
use isolume::scene::DirectionalLight;
use std::f64::consts::PI;

const LIGHTS: [LightModel; 2] = [LightModel::Local, LightModel::Full];

/// Value j in the j-th layer from below, practically infinite across: V = y + 3.5.
fn layers() -> Volume {
    volume(
        [1, 8, 1],
        [1e4, 1.0, 1e4],
        (0..8).map(|n| n as f32).collect(),
    )
}

/// A floor at y = −2 and a sheet over it at y = 2.
fn floor_and_sheet(floor: f64, sheet: f64, opacity: f64) -> Vec<Isosurface> {
    vec![lambert(5.5, opacity, sheet), lambert(1.5, 1.0, floor)]
}

/// Distance from the centre: a ball whose inside is below the value.
fn ball() -> Volume {
    field([8; 3], [1.0; 3], |p| p.length() as f32)
}

#[test]
fn white_furnace_with_white_surfaces() {
    let (outside, inside) = ([3.0, 5.0, 20.0], [0.3, 0.2, 0.1]);
    for light in LIGHTS {
        for (opacity, eye) in [(0.3, outside), (0.3, inside), (1.0, outside)] {
            let mut scene = scene();
            scene.medium = constant(0.5, 1.0, 0.7);
            scene.surfaces.light = light;
            scene.surfaces.iso = vec![lambert(2.3, opacity, 1.0), lambert(3.1, opacity, 1.0)];
            scene.lights.environment = uniform_sky(1.0);
            scene.camera.eye = eye;
            scene.camera.projection = Projection::Perspective { fov_y: 30.0 };
            assert_every_pixel(&render(&scene, &ball(), 300, 1), 1.0);
        }
    }
}

/// Light between the two is a geometric series.
#[test]
fn a_sheet_over_a_floor_under_a_uniform_sky() {
    let (floor, sheet, opacity) = (0.8, 0.6, 0.4);
    let open = 1.0 - opacity;
    let mut scene = scene();
    scene.surfaces.iso = floor_and_sheet(floor, sheet, opacity);
    scene.lights.environment = uniform_sky(1.0);
    assert_average(
        &render(&scene, &layers(), 30_000, 2),
        opacity * sheet + open * floor,
    );

    scene.surfaces.light = LightModel::Full;
    let below = open / (1.0 - opacity * sheet * floor);
    let exact = opacity * sheet + open * floor * below;
    assert_average(&render(&scene, &layers(), 30_000, 3), exact);

    // Passing through is no bounce; the last bounce still receives direct light.
    let once = opacity * sheet + open * floor * open;
    let thrice = once + open * floor * opacity * sheet * floor * open;
    for (bounces, exact) in [(1, once), (2, once), (3, thrice)] {
        scene.render.max_bounces = bounces;
        assert_average(&render(&scene, &layers(), 30_000, 4), exact);
    }
}

#[test]
fn a_sheet_over_a_floor_under_the_sun() {
    let (floor, sheet, opacity) = (0.8, 0.6, 0.4);
    let open = 1.0 - opacity;
    let irradiance = 2.0 * 0.8;
    let mut scene = scene();
    scene.surfaces.iso = floor_and_sheet(floor, sheet, opacity);
    scene.surfaces.normals = Normals::Smooth;
    scene.lights.suns = vec![DirectionalLight {
        direction: [0.6, -0.8, 0.0],
        irradiance: [2.0; 3],
    }];
    let exact = irradiance / PI * (opacity * sheet + open * floor);
    assert_average(&render(&scene, &layers(), 30_000, 5), exact);

    scene.surfaces.light = LightModel::Full;
    let below = open / (1.0 - opacity * sheet * floor);
    let exact = irradiance / PI * (opacity * sheet + open * floor * below);
    assert_average(&render(&scene, &layers(), 30_000, 6), exact);
}

/// Down to the floor and back up to the sun, 6 and 6 / 0.8 long, through a black medium.
#[test]
fn a_medium_dims_a_surface_and_its_sun() {
    for light in LIGHTS {
        let mut scene = scene();
        scene.medium = constant(0.02, 0.0, 0.0);
        scene.surfaces.light = light;
        scene.surfaces.iso = vec![lambert(1.5, 1.0, 0.8)];
        scene.lights.suns = vec![DirectionalLight {
            direction: [0.6, -0.8, 0.0],
            irradiance: [2.0; 3],
        }];
        let exact = 0.8 / PI * 1.6 * (-0.02_f64 * (6.0 + 6.0 / 0.8)).exp();
        assert_average(&render(&scene, &layers(), 30_000, 7), exact);
    }
}

/// A black sheet in a scattering slab halves what leaves from below it, and in `full` what enters, too.
#[test]
fn surfaces_shade_the_medium_only_in_full() {
    let above = -0.05_f64 * 2.0;
    for light in LIGHTS {
        let mut scene = scene();
        scene.medium = constant(0.05, 1.0, 0.0);
        scene.render.max_bounces = 1;
        scene.surfaces.light = light;
        scene.surfaces.iso = vec![lambert(5.5, 0.5, 0.0)];
        scene.lights.suns = vec![DirectionalLight {
            direction: [0.0, -1.0, 0.0],
            irradiance: [1.0; 3],
        }];
        // Backscattered once, above and below the sheet, from the optical depths 0–0.1–0.4.
        let between = |a: f64, b: f64| ((2.0 * a).exp() - (2.0 * b).exp()) / (8.0 * PI);
        let shadow = if light == LightModel::Full { 0.5 } else { 1.0 };
        let exact = between(0.0, above) + 0.5 * shadow * between(above, 4.0 * above);
        assert_average(&render(&scene, &layers(), 20_000, 8), exact);
    }
}

#[test]
fn a_closed_black_ball_is_black_from_inside() {
    let mut scene = scene();
    scene.surfaces.iso = vec![lambert(2.5, 1.0, 1.0)];
    scene.surfaces.light = LightModel::Full;
    scene.lights.environment = uniform_sky(1.0);
    scene.lights.suns = vec![DirectionalLight {
        direction: [0.0, -1.0, 0.0],
        irradiance: [1.0; 3],
    }];
    scene.render.max_bounces = 50;
    scene.camera.eye = [0.3, 0.2, 0.1];
    scene.camera.projection = Projection::Perspective { fov_y: 90.0 };
    assert_every_pixel(&render(&scene, &ball(), 500, 9), 0.0);
}
