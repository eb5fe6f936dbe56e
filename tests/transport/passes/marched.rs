//! Marches count the samples of the volume that they take.

use isolume::scene::{CacheFormat, Camera, Projection};

use crate::support::common::*;

#[test]
fn a_march_takes_a_sample_a_voxel() {
    const SIDE: u32 = 16;
    const SIZE: [u32; 2] = [24, 24];
    let camera = Camera {
        eye: [0.0, 0.0, 3.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height: 0.9 },
    };
    let mut scene = empty_scene(SIZE, camera);
    scene.medium = Some(uniform_medium(0.1, 0.8, 0.0));
    let volume = constant_field(1.0, [SIDE; 3], [1.0 / f64::from(SIDE); 3]);
    let mut cached = cached(&scene, &volume, 0.5, CacheFormat::F16, 1, 1);
    for pass in ["ray_march", "camera_march"] {
        cached.renderer.timings_mut().take();
        match pass {
            "ray_march" => drop(cached.march()),
            _ => drop(cached.at_rest(1, 1)),
        }
        let total = *cached.renderer.timings().total(pass).expect("it ran");
        let rays = f64::from(SIZE[0] * SIZE[1]);
        let a_ray = total.work.samples as f64 / rays;
        println!("{pass}: {a_ray} samples a ray");
        let steps = f64::from(SIDE);
        assert!((steps..=steps + 3.0).contains(&a_ray), "{pass}: {a_ray}");
    }
}
