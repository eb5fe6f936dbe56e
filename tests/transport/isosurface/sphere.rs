//! A ball's distance field through the camera and the whole of `iso_depth`, against the ball itself.
//!
//! Interpolating d(x) = R − |x − c| between voxels of size h is off by at most h²/8·Σ|∂ᵢᵢd| =
//! h²/4r, always towards the inside, since d is concave; its gradient by at most h/2·|(∂ᵢᵢd)| ≤
//! h/√2r, and the smoothed gradient by some (h/r)². Terms of the next order are below a tenth of that
//! here, and the bounds leave them that much room.

use crate::support::common;
use std::sync::Arc;

use super::*;
use glam::Vec3;
use isolume::gpu::{Memory, Shaders};
use isolume::render::{FirstHits, GpuScene, Renderer};

const H: f64 = 0.5;
/// World units.
const RADIUS: f64 = 15.2;
const CENTER: DVec3 = DVec3::new(0.13, -0.21, 0.34);
const SIZE: [u32; 2] = [400, 400];
const FOV_Y: f64 = 40.0;
const EYE: DVec3 = DVec3::new(0.0, 0.0, 60.0);
const ORTHOGRAPHIC_HEIGHT: f64 = 34.0;

fn first_hits(eye: DVec3, projection: Projection, normals: Normals) -> FirstHits {
    first_hits_by(&common::shaders(), eye, projection, normals)
}

fn first_hits_by(
    shaders: &Shaders,
    eye: DVec3,
    projection: Projection,
    normals: Normals,
) -> FirstHits {
    let to_world = |g: DVec3| (g - 0.5) * H - 48.0 * H;
    let voxels = sampled([96; 3], |g| RADIUS - to_world(g).distance(CENTER));
    let volume = volume([96; 3], [H; 3], floats(voxels));
    let mut scene = surfaces(&[0.0]);
    scene.camera = Camera {
        eye: eye.to_array(),
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection,
    };
    scene.render.size = SIZE;
    scene.surfaces.normals = normals;
    let device = common::device();
    let memory = Memory::new(&device, common::BUDGET).expect("memory");
    let scene = GpuScene::new(&scene, &volume, 1);
    let renderer = Renderer::with_shaders(&memory, shaders, &volume, scene);
    let mut renderer = renderer.expect("a renderer");
    let hits = renderer.first_hits().expect("first hits");
    common::assert_silent(&Arc::clone(&device));
    hits
}

/// Through the centre of a pixel.
fn camera_ray(projection: Projection, x: u32, y: u32) -> (DVec3, DVec3) {
    let film = |i: u32, n: u32| (2.0 * (f64::from(i) + 0.5) / f64::from(n)) - 1.0;
    let (u, v) = (film(x, SIZE[0]), -film(y, SIZE[1]));
    match projection {
        Projection::Perspective { fov_y } => {
            let half = (fov_y.to_radians() / 2.0).tan();
            (EYE, DVec3::new(u * half, v * half, -1.0).normalize())
        }
        Projection::Orthographic { height } => {
            let across = DVec3::new(u, v, 0.0) * height / 2.0;
            (EYE + across, DVec3::NEG_Z)
        }
    }
}

fn assert_ball(projection: Projection, normals: Normals, normal_error: f64) {
    let seen = first_hits(EYE, projection, normals);
    let (mut hits, mut farthest, mut most_turned) = (0, 0.0_f64, 0.0_f64);
    for (i, &[x, y, z, depth]) in seen.normal_depth.iter().enumerate() {
        let (column, row) = (i as u32 % SIZE[0], i as u32 / SIZE[0]);
        let (origin, direction) = camera_ray(projection, column, row);
        let nearest = (CENTER - origin).dot(direction);
        let rim = (origin + nearest * direction).distance(CENTER);
        let inwards = H * H / (4.0 * RADIUS) * 1.1;
        if depth.is_infinite() {
            assert!(rim > RADIUS - inwards, "{column}, {row}: missed by {rim}");
            continue;
        }
        hits += 1;
        let depth = f64::from(depth);
        let point = origin + depth * direction;
        let off = RADIUS - point.distance(CENTER);
        // 1e-3 of a voxel, and single precision at the distance of the eye.
        let slack = 1e-3 * H + 60.0 * f64::from(f32::EPSILON);
        assert!(
            off > -slack && off < inwards + slack,
            "{column}, {row}: {off:e} off"
        );
        assert!(depth < nearest + 1.0, "{column}, {row}: the far side");
        farthest = farthest.max(off);
        let normal = DVec3::new(x.into(), y.into(), z.into());
        assert!(
            (normal.length() - 1.0).abs() < 1e-5,
            "{column}, {row}: {normal}"
        );
        let turned = normal.distance((point - CENTER).normalize());
        // At the rim a normal of the right surface may face away from the ray, where another stands in.
        if direction.dot(point - CENTER) < -2.0 * normal_error * RADIUS {
            most_turned = most_turned.max(turned);
            assert!(
                turned < normal_error,
                "{column}, {row}: turned by {turned:e}"
            );
        }
    }
    println!(
        "{projection:?} {normals:?}: {hits} hits, {farthest:.1e} inwards, turned {most_turned:.1e}"
    );
    assert!(hits > 60_000, "only {hits} hits");
    // The bounds are near the truth, or they would prove little.
    assert!(farthest > 0.3 * H * H / (4.0 * RADIUS) && most_turned > 0.1 * normal_error);
}

/// A device may round the polynomial of a cell otherwise where a crossing is refined than where it was found. A crossing
/// that is lost there would let the ray through to whatever is behind.
#[test]
fn a_crossing_is_not_lost_where_it_is_refined() {
    let lost = common::shaders_with(
        "include/surface.glsl",
        include_str!("../../../glsl/include/surface.glsl"),
        "float u = refine(c, change.low, change.high, is_inside);",
        "float u = 2.0;",
    );
    let projection = Projection::Perspective { fov_y: FOV_Y };
    let right = first_hits(EYE, projection, Normals::Analytic);
    let late = first_hits_by(&lost, EYE, projection, Normals::Analytic);
    let depths = |hits: &FirstHits| {
        hits.normal_depth
            .iter()
            .map(|hit| hit[3])
            .collect::<Vec<_>>()
    };
    let mut differ = 0;
    for (right, late) in depths(&right).into_iter().zip(depths(&late)) {
        assert_eq!(right.is_finite(), late.is_finite(), "{right}, {late}");
        if right.is_finite() {
            let behind = f64::from(late - right);
            assert!((-1e-4..=3_f64.sqrt() * H).contains(&behind), "{behind}");
            differ += i32::from(behind > 1e-3);
        }
    }
    assert!(differ > 60_000, "{differ}");
}

#[test]
fn a_balls_depth_and_normals_are_the_balls() {
    let perspective = Projection::Perspective { fov_y: FOV_Y };
    let orthographic = Projection::Orthographic {
        height: ORTHOGRAPHIC_HEIGHT,
    };
    let voxels = H / RADIUS;
    let analytic = 1.1 * voxels / f64::sqrt(2.0);
    let smooth = voxels * voxels;
    assert_ball(perspective, Normals::Analytic, analytic);
    assert_ball(perspective, Normals::Smooth, smooth);
    assert_ball(orthographic, Normals::Smooth, smooth);
}

/// All rays of a distant eye are parallel to those of an orthographic camera, and meet the same points: within 4e-5 of the
/// radius even in perspective.
#[test]
fn a_distant_eye_costs_no_digits() {
    let orthographic = Projection::Orthographic {
        height: ORTHOGRAPHIC_HEIGHT,
    };
    let towards_eye = DVec3::new(0.3, 0.5, 0.81).normalize();
    let [close, distance] = [60.0, 1e6];
    let near = first_hits(close * towards_eye, orthographic, Normals::Smooth);
    let half = 0.5 * ORTHOGRAPHIC_HEIGHT / distance;
    let narrow = Projection::Perspective {
        fov_y: 2.0 * half.atan().to_degrees(),
    };
    for projection in [orthographic, narrow] {
        let far = first_hits(distance * towards_eye, projection, Normals::Smooth);
        let (mut compared, mut most_turned) = (0, 0.0_f32);
        for (a, b) in near.normal_depth.iter().zip(&far.normal_depth) {
            let [near, far] = [a, b].map(|&[x, y, z, _]| Vec3::new(x, y, z));
            // At the rim, a ray that is off by little meets another point.
            if near.dot(towards_eye.as_vec3()) < 0.5 {
                continue;
            }
            compared += 1;
            most_turned = most_turned.max(near.distance(far));
            let off = f64::from(b[3]) - f64::from(a[3]) - (distance - close);
            let rounding = 2.0 * distance * f64::from(f32::EPSILON);
            assert!(off.abs() < rounding, "{projection:?}: {off} in depth");
        }
        println!("{projection:?}: turned by {most_turned:.1e}");
        assert!(
            compared > 50_000 && most_turned < 1e-4,
            "{projection:?}: {most_turned}"
        );
    }
}
