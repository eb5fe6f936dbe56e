//! Environment images.

use std::path::{Path, PathBuf};

use exr::prelude::{SpecificChannels, WritableImage};
use image::{Rgb, Rgb32FImage};
use isolume::scene::preset::Preset;
use isolume::scene::{SceneFile, open, resolve};

use super::{message, volume};

pub fn write_image(
    folder: &Path,
    name: &str,
    width: u32,
    height: u32,
    value: impl Fn(u32, u32) -> f32,
) -> PathBuf {
    let image = Rgb32FImage::from_fn(width, height, |i, j| Rgb([value(i, j); 3]));
    let path = folder.join(name);
    image.save(&path).unwrap();
    path
}

/// Why a scene in this folder whose sky is `sky.exr` is refused before its volume is read, which may take minutes.
fn refused_sky(folder: &Path) -> String {
    let path = folder.join("scene.toml");
    let text =
        "[volume]\npath = \"v.nrrd\"\n[[light]]\ntype = \"environment\"\nimage = \"sky.exr\"";
    std::fs::write(&path, text).unwrap();
    let opened = open(&path, Preset::Auto, &[], |_, _| {
        panic!("the volume was read")
    });
    opened.expect_err("no image").to_string()
}

#[test]
fn a_missing_image_is_found_before_the_volume_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let error = refused_sky(folder.path());
    assert!(
        error.contains("scene.toml:5: light.0.image: ") && error.contains("sky.exr: No such file"),
        "{error}"
    );
}

/// Reading a pipe or a device could wait for ever.
#[test]
fn an_image_is_a_regular_file() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("sky.exr")).unwrap();
    let error = refused_sky(folder.path());
    assert!(error.contains("sky.exr: is not a regular file"), "{error}");
}

#[test]
fn environment_images_are_scaled_and_added() {
    let folder = tempfile::tempdir().unwrap();
    write_image(folder.path(), "a.exr", 4, 2, |i, _| i as f32);
    write_image(folder.path(), "b.exr", 2, 2, |i, _| 10.0 * i as f32);
    let path = folder.path().join("scene.toml");
    let light = |image: &str, radiance: &str| {
        format!("[[light]]\ntype = \"environment\"\nimage = \"{image}\"\nradiance = {radiance}\n")
    };
    let environment = |text: &str| {
        let file = SceneFile::parse(text, &path, &[]).unwrap();
        let (scene, notes) = resolve(&file, &volume(None)).unwrap();
        (scene.lights.environment, notes)
    };
    let (one, _) = environment(&light("a.exr", "[2, 1, 0]"));
    assert_eq!(one.radiance, [0.0; 3]);
    assert_eq!(one.image.unwrap().texels[3], [6.0, 3.0, 0.0]);

    let two = light("a.exr", "[2, 1, 0]") + &light("a.exr", "[1, 1, 1]");
    let (two, notes) =
        environment(&(two + "[[light]]\ntype = \"environment\"\nradiance = [5, 5, 5]"));
    assert_eq!(two.radiance, [5.0; 3]);
    assert_eq!(two.image.unwrap().texels[3], [9.0, 6.0, 3.0]);
    assert!(!notes.iter().any(|note| note.contains("resampled")));

    // b's columns 0 and 10, resampled to four: 2.5, 2.5, 7.5, 7.5, wrapping round at the edge.
    let (sum, notes) = environment(&(light("a.exr", "[1, 1, 1]") + &light("b.exr", "[1, 1, 1]")));
    let sum = sum.image.unwrap();
    assert_eq!(
        sum.texels[..4].iter().map(|t| t[0]).collect::<Vec<_>>(),
        [2.5, 3.5, 9.5, 10.5]
    );
    assert!(
        notes
            .iter()
            .any(|note| note.contains("light.1.image") && note.contains("4x2"))
    );

    let (black, _) = environment(&light("a.exr", "[0, 0, 0]"));
    assert_eq!(black.image, None);
}

#[test]
fn a_png_sky_is_srgb() {
    let folder = tempfile::tempdir().unwrap();
    let grey = image::RgbImage::from_pixel(2, 1, Rgb([0, 128, 255]));
    grey.save(folder.path().join("sky.png")).unwrap();
    let text = "[[light]]\ntype = \"environment\"\nimage = \"sky.png\"";
    let file = SceneFile::parse(text, &folder.path().join("scene.toml"), &[]).unwrap();
    let (scene, _) = resolve(&file, &volume(None)).unwrap();
    let [r, g, b] = scene.lights.environment.image.unwrap().texels[0];
    assert_eq!((r, b), (0.0, 1.0));
    assert!((g - 0.215_86).abs() < 1e-5, "{g}");
}

/// No light is brighter than 1e15, of whatever it is made.
#[test]
fn a_sky_that_is_too_bright_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    write_image(folder.path(), "bright.exr", 2, 1, |_, _| 8e14);
    let one = |radiance: &str| {
        format!(
            "[[light]]\ntype = \"environment\"\nimage = \"bright.exr\"\nradiance = {radiance}\n"
        )
    };
    let full = "[1.0, 1.0, 1.0]";
    let resolved = |text: String| {
        let file = SceneFile::parse(&text, &folder.path().join("scene.toml"), &[]).unwrap();
        resolve(&file, &volume(None))
    };
    assert!(resolved(one(full)).is_ok());
    let doubled = message(resolved(one("[1.0, 2.0, 1.0]")));
    assert!(
        doubled.contains("light.0.image: radiance [1.0, 2.0, 1.0] times the image reaches 1.6"),
        "{doubled}"
    );
    let together = message(resolved(one(full) + &one(full)));
    assert!(
        together.contains("light.1.image: the sum of the images reaches 1.6"),
        "{together}"
    );
}

#[test]
fn bad_environment_images() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bad) in [
        ("negative.exr", -0.5),
        ("nan.exr", f32::NAN),
        ("inf.exr", f32::INFINITY),
    ] {
        write_image(folder.path(), name, 4, 3, |i, j| {
            if (i, j) == (3, 1) { bad } else { 1.0 }
        });
    }
    std::fs::write(folder.path().join("text.exr"), "no image").unwrap();
    let fails = |name: &str| {
        let text = format!("\n[[light]]\ntype = \"environment\"\nimage = \"{name}\"");
        let file = SceneFile::parse(&text, &folder.path().join("scene.toml"), &[]).unwrap();
        let message = message(resolve(&file, &volume(None)));
        assert!(
            message.contains("scene.toml:4: light.0.image: "),
            "{message}"
        );
        assert!(message.contains(name), "{message}");
        message
    };
    for name in ["negative.exr", "nan.exr", "inf.exr"] {
        assert!(fails(name).contains("column 3, row 1"));
    }
    fails("absent.exr");
    fails("text.exr");
    let grey = SpecificChannels::build()
        .with_channel("Y")
        .with_channel("Z")
        .with_pixel_fn(|_| (0.0_f32, 0.0_f32));
    exr::prelude::Image::from_channels((2, 1), grey)
        .write()
        .to_file(folder.path().join("grey.exr"))
        .unwrap();
    assert!(fails("grey.exr").ends_with("its channels are Y, Z, expected R, G and B"));
    for (name, start) in [
        ("sky.jpg", &[0xff, 0xd8, 0xff, 0xe0][..]),
        ("sky.tif", b"II*\0"),
        ("sky.txt", b"no image"),
    ] {
        std::fs::write(folder.path().join(name), start).unwrap();
        assert!(fails(name).ends_with("expected OpenEXR, Radiance HDR or PNG"));
    }
    for (name, size) in [("flat.hdr", "-Y 0 +X 8"), ("narrow.hdr", "-Y 8 +X 0")] {
        let header = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n");
        std::fs::write(folder.path().join(name), header).unwrap();
        assert!(fails(name).ends_with("pixels, expected at least 1x1"));
    }
}
