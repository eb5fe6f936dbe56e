//! Environment images: OpenEXR, Radiance HDR and PNG, told apart by their content.

#![no_main]

use isolume::scene::EnvironmentImage;
use isolume_fuzz::{folder, guard, pictures, target};

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
        assert!(sky.at(0.3, 0.7).iter().all(|x| x.is_finite()));
    }
}

target!(seeds, parse);
