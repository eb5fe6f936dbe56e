//! Rays that start or run where arithmetic has to choose sides.

use isolume::scene::volume::Volume;
use isolume::scene::*;

use crate::hard_cases::quadrature::*;
use crate::hard_cases::transfer::absorbing;
use crate::support::common::*;
use crate::support::exact::expect;
use crate::support::fields::{field, indexed_field};

/// Its mean is ½ along every axis-parallel line: a checkerboard.
fn checkerboard() -> Volume {
    indexed_field([16; 3], [1.0; 3], |[x, y, z]| ((x + y + z) % 2) as f32)
}

fn ramp(density: f64) -> Medium {
    absorbing(density, &[(0.0, 0.0), (1.0, 1.0)])
}

/// The picture is 1e-9 high, less than single precision resolves at that distance: all its rays coincide.
fn single_ray(through: [f64; 3], towards: [f64; 3]) -> Camera {
    Camera {
        eye: std::array::from_fn(|a| through[a] - 40.0 * towards[a]),
        target: through,
        up: [0.3, 0.8, 0.5],
        projection: Projection::Orthographic { height: 1e-9 },
    }
}

const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]];

fn expect_single_rays(through: [f64; 3], directions: &[[f64; 3]]) {
    for towards in directions {
        let scene = absorbing_scene(ramp(0.05), single_ray(through, *towards));
        let volume = checkerboard();
        let exact = transmittance(&scene, &volume, 1);
        expect("a ray", &scene, &volume, [exact; 3]);
    }
}

/// The origin is a corner of eight voxels, and of eight boxes of voxels that share a majorant.
#[test]
fn along_edges_of_voxels() {
    expect_single_rays([0.0; 3], &AXES);
}

#[test]
fn through_centres_of_voxels() {
    expect_single_rays([0.5; 3], &AXES);
}

/// Where cells of interpolation, and macrocells, touch.
#[test]
fn through_corners() {
    let d = 1.0 / 3.0f64.sqrt();
    let e = 0.5f64.sqrt();
    let diagonals = [[d, d, d], [-d, d, -d], [e, -e, 0.0]];
    expect_single_rays([-0.5; 3], &diagonals);
    expect_single_rays([0.0; 3], &diagonals);
}

/// From one corner of the box to the opposite one, and light scattered on the way in all directions.
#[test]
fn leaving_at_a_corner() {
    let d = 1.0 / 3.0f64.sqrt();
    let mut scene = absorbing_scene(ramp(0.5), single_ray([0.0; 3], [d, d, d]));
    for point in &mut scene.medium.as_mut().expect("a medium").transfer {
        point.color = [1.0; 3];
    }
    for pixel in render(&scene, &checkerboard(), 2, 64, 1).mean {
        assert!((pixel[0] - 1.0).abs() < 1e-5, "{pixel:?}");
    }
}

/// In the box's own face a ray may be inside or outside, but nothing in between.
#[test]
fn along_a_face_of_the_box() {
    let mut scene = absorbing_scene(ramp(1e4), single_ray([8.0, 0.5, 0.5], AXES[2]));
    for x in [-8.0, 8.0] {
        scene.camera = single_ray([x, 0.5, 0.5], AXES[2]);
        for pixel in render(&scene, &checkerboard(), 2, 2, 1).mean {
            assert!(pixel[0] == 0.0 || pixel[0] == 1.0, "{pixel:?}");
        }
    }
}

/// The eye's plane cuts the box in two, and only the part before it counts.
#[test]
fn camera_inside_the_medium() {
    let medium = uniform_medium(0.1, 0.0, 0.0);
    let mut camera = orthographic([0.0, 0.0, 3.0], 4.0);
    let volume = constant_field(1.0, [16; 3], [1.0; 3]);
    let scene = absorbing_scene(medium, camera);
    expect("inside", &scene, &volume, [(-1.1f64).exp(); 3]);
    camera.projection = Projection::Perspective { fov_y: 90.0 };
    let scene = absorbing_scene(uniform_medium(0.3, 1.0, 0.5), camera);
    for pixel in render(&scene, &volume, 2, 4, 1).mean {
        assert!((pixel[0] - 1.0).abs() < 1e-5, "{pixel:?}");
    }
}

/// V = z over the box; V ≥ 0 is solid. The eye is inside the solid, outside it, and on its surface.
#[test]
fn camera_inside_the_surface() {
    let volume = field([16; 3], [1.0; 3], |p| p.z as f32);
    let see = |eye: [f64; 3], target: [f64; 3]| {
        let mut scene = empty_scene([16, 16], orthographic(eye, 4.0));
        scene.camera.target = target;
        scene.lights.environment.radiance = [1.0; 3];
        scene.surfaces.iso = vec![Isosurface {
            value: 0.0,
            opacity: 1.0,
            color: [0.5; 3],
            shading: Shading::Lambert,
        }];
        let film = render(&scene, &volume, 2, 16, 1);
        (film, first_hits(&scene, &volume).normal_depth)
    };
    // From inside, from outside, and from so close that the box has not begun to end.
    for (z, normal) in [(5.0f32, 1.0f32), (-6.0, -1.0), (1e-3, 1.0)] {
        let (film, hits) = see([0.0, 0.0, z.into()], [0.0, 0.0, (-z).into()]);
        for (hit, pixel) in hits.iter().zip(&film.mean) {
            assert!((hit[3] - z.abs()).abs() < 1e-3, "{hit:?}");
            assert!((hit[2] - normal).abs() < 1e-5, "{hit:?}");
            assert!((pixel[0] - 0.5).abs() < 1e-5, "{pixel:?}");
        }
    }
    // Away from it: there is nothing to see.
    for (film, hits) in [
        see([0.0, 0.0, 1.0], [0.0, 0.0, 2.0]),
        see([0.0, 0.0, -1.0], [0.0, 0.0, -2.0]),
    ] {
        assert!(hits.iter().all(|hit| hit[3] == f32::INFINITY));
        assert!(film.mean.iter().all(|pixel| pixel[0] == 1.0));
    }
}

/// Boxes without medium lie between, before and behind those with it.
#[test]
fn majorants_of_zero() {
    const ALONG_X: [f32; 8] = [0.0, 0.0, 1.0, 0.0, 0.0, 0.6, 0.0, 0.0];
    let volume = indexed_field([40, 8, 8], [0.1; 3], |[x, ..]| ALONG_X[x as usize / 5]);
    for eye in [[9.0, 0.0, 0.0], [-5.0, 1.0, 0.5], [0.0, 0.0, 7.0]] {
        let scene = absorbing_scene(ramp(1.0), orthographic(eye, 0.5));
        expect_transmittance("gaps", &scene, &volume);
    }
}

/// What is clipped away is vacuum: half of the depth along the normal, a wedge askew.
#[test]
fn clip_planes() {
    let volume = constant_field(1.0, [4; 3], [0.25; 3]);
    let half = ClipPlane {
        normal: [0.0, 0.0, 1.0],
        offset: 0.0,
    };
    let askew = ClipPlane {
        normal: [0.6, 0.8, 0.0],
        offset: 0.1,
    };
    for eye in [[0.0, 0.0, 5.0], [0.0, 0.0, -5.0]] {
        let mut scene = absorbing_scene(uniform_medium(2.0, 0.0, 0.0), orthographic(eye, 0.5));
        scene.clips = vec![half.clone()];
        expect("half", &scene, &volume, [(-1.0f64).exp(); 3]);
        scene.clips.push(askew.clone());
        expect_transmittance("a wedge", &scene, &volume);
    }
    let camera = orthographic([0.0, 5.0, 0.0], 0.5);
    let mut scene = absorbing_scene(uniform_medium(2.0, 1.0, 0.0), camera);
    scene.clips = vec![half, askew];
    for pixel in render(&scene, &volume, 2, 4, 1).mean {
        assert!((pixel[0] - 1.0).abs() < 1e-5, "{pixel:?}");
    }
}
