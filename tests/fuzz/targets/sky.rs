//! Environment images: OpenEXR, Radiance HDR and PNG, told apart by their content.

#![no_main]

use isolume::scene::EnvironmentImage;
use isolume_fuzz::{folder, guard, pictures, target};

/// Texels of an image that is added to one of another size: enough for every rounding, and quick.
const MOST_RESAMPLED: usize = 1 << 12;

fn seeds() -> Vec<Vec<u8>> {
    [pictures::exr(), pictures::png(), vec![pictures::hdr()]].concat()
}

fn parse(bytes: &[u8]) {
    let path = folder::write("sky.exr", bytes);
    let loaded = guard::run(pictures::allowed(bytes.len()), || {
        EnvironmentImage::load(&path)
    });
    if let Ok(sky) = loaded {
        assert_eq!(sky.texels.len(), sky.width as usize * sky.height as usize);
        assert!(
            sky.texels
                .as_flattened()
                .iter()
                .all(|x| x.is_finite() && *x >= 0.0)
        );
        if sky.texels.len() <= MOST_RESAMPLED {
            let small = EnvironmentImage {
                width: 3,
                height: 2,
                texels: [[0.5; 3]; 6].into(),
            };
            let sum = sky.plus(&small);
            // The sum of images may be brighter than a light may be, but holds no other fault.
            if let Ok(sum) = sum {
                assert!(sum.texels.as_flattened().iter().all(|x| x.is_finite()));
            }
        }
    }
}

target!(seeds, parse);
