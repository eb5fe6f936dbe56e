//! A node's mean after a million paths, in 16 bits.

use isolume::scene::*;

use crate::support::common::*;

/// A single node seen through all of it: the picture is the node's value.
#[test]
fn a_million_updates_in_16_bits_end_within_one_unit_in_the_last_place() {
    let camera = Camera {
        eye: [0.0, 0.0, 3.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic { height: 0.1 },
    };
    let mut scene = empty_scene([8, 8], camera);
    scene.medium = Some(uniform_medium(1.0, 0.7, 0.0));
    scene.lights.environment.radiance = [0.7, 0.2, 0.05];
    scene.render.background = Background::Color([0.0; 3]);
    let volume = constant_field(1.0, [1; 3], [1.0; 3]);
    // The same random numbers: only rounding differs.
    let shown = |format| cached(&scene, &volume, 1.0, format, 1 << 20, 3).march()[0];
    let (short, long) = (shown(CacheFormat::F16), shown(CacheFormat::F32));
    for c in 0..3 {
        let difference = (short[c] / long[c] - 1.0).abs();
        println!(
            "channel {c}: {:.2} units in the last place",
            difference * 1024.0
        );
        assert!(
            difference <= 2f32.powi(-10),
            "{} is not {}",
            short[c],
            long[c]
        );
    }
}
