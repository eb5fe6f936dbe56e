//! EXR and PNG, value by value.

use exr::prelude::{AttributeValue, FlatSamples, Text, read_first_flat_layer_from_file};
use isolume::engine::Picture;
use isolume::output::{Provenance, write_exr, write_png};
use isolume::scene::Tone;
use tempfile::TempDir;

use super::row;

#[test]
fn an_exr_holds_every_layer_bit_by_bit() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("a.exr");
    let picture = row(&[[0.1, 0.2, 0.3], [1e-30, 7e9, -0.0]], Some(&[0.25, 1.0]));
    let scene = "[volume]\npath = \"頭部 é.nrrd\"\n";
    write_exr(
        &path,
        &picture,
        &Provenance {
            scene: scene.into(),
            seed: 7,
            device: "a device".into(),
            software: "isolume 1.2".into(),
        },
    )
    .unwrap();

    let image = read_first_flat_layer_from_file(&path).unwrap();
    let attributes = &image.layer_data.attributes;
    let utf8 = |text: &Text| String::from_utf8(text.as_slice().to_vec()).unwrap();
    match &attributes.other[&Text::from("isolume.scene")] {
        AttributeValue::Text(text) => assert_eq!(utf8(text), scene),
        other => panic!("the scene is {other:?}"),
    }
    let comments = attributes.comments.as_ref().map(utf8);
    assert_eq!(comments.as_deref(), Some("seed 7\ndevice a device"));
    let software = attributes.software_name.as_ref().map(utf8);
    assert_eq!(software.as_deref(), Some("isolume 1.2"));

    let bits = |values: Vec<f32>| values.into_iter().map(f32::to_bits).collect::<Vec<_>>();
    let component = |layer: &[[f32; 3]], c: usize| layer.iter().map(|p| p[c]).collect();
    let mut expected = vec![("A".to_owned(), bits(vec![0.25, 1.0]))];
    for (prefix, names, layer) in [
        ("", "RGB", &picture.rgb),
        ("stderr.", "RGB", &picture.stderr),
        ("albedo.", "RGB", &picture.albedo),
        ("normal.", "XYZ", &picture.normal),
    ] {
        for (c, name) in names.chars().enumerate() {
            expected.push((format!("{prefix}{name}"), bits(component(layer, c))));
        }
    }
    expected.push(("depth.Z".to_owned(), bits(vec![f32::INFINITY, 1.5])));
    expected.sort();
    let channels = &image.layer_data.channel_data.list;
    let found: Vec<_> = channels
        .iter()
        .map(|channel| match &channel.sample_data {
            FlatSamples::F32(values) => (channel.name.to_string(), bits(values.clone())),
            other => panic!("{} is {other:?}", channel.name),
        })
        .collect();
    assert_eq!(found, expected);
}

#[test]
fn an_opaque_exr_has_no_alpha() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("a.exr");
    write_exr(&path, &row(&[[1.0; 3]], None), &Provenance::default()).unwrap();
    let image = read_first_flat_layer_from_file(&path).unwrap();
    assert_eq!(image.layer_data.channel_data.list.len(), 13);
}

fn png_bytes(picture: &Picture, exposure: f64, tone: Tone) -> (image::ColorType, Vec<u8>) {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("a.png");
    write_png(&path, picture, exposure, tone).unwrap();
    let image = image::open(&path).unwrap();
    (image.color(), image.into_bytes())
}

#[test]
fn png_is_exposed_clipped_and_rounded() {
    // sRGB of 0.5 is 187.516 / 255, of 0.25 136.96 / 255, of 0.001 3.29 / 255.
    let picture = row(
        &[[0.0, 0.25, 0.5], [1.0, 2.0, -1.0], [0.001, 1e30, 0.5]],
        None,
    );
    let (color, bytes) = png_bytes(&picture, 0.0, Tone::Linear);
    assert_eq!(color, image::ColorType::Rgb8);
    assert_eq!(bytes, [0, 137, 188, 255, 255, 0, 3, 255, 188]);
    let (_, brighter) = png_bytes(&picture, 1.0, Tone::Linear);
    assert_eq!(brighter[..3], [0, 188, 255]);
}

#[test]
fn filmic_png_follows_the_published_curve() {
    // Narkowicz's curve gives 0.26690 at 0.18, 0.80380 at 1 and 0.98528 at 5.
    let picture = row(&[[0.0, 0.18, 1.0], [5.0, 1e30, -1.0]], None);
    let (_, bytes) = png_bytes(&picture, 0.0, Tone::Filmic);
    assert_eq!(bytes, [0, 141, 232, 253, 255, 0]);
}

#[test]
fn a_transparent_png_has_straight_colours() {
    let picture = row(&[[0.125, 0.25, 0.0], [0.3, 0.3, 0.3]], Some(&[0.25, 0.0]));
    let (color, bytes) = png_bytes(&picture, 0.0, Tone::Linear);
    assert_eq!(color, image::ColorType::Rgba8);
    assert_eq!(bytes, [188, 255, 0, 64, 0, 0, 0, 0]);
}

#[test]
fn relative_error_is_rms_over_mean() {
    let mut picture = row(&[[1.0, 2.0, 3.0], [2.0, 2.0, 2.0]], None);
    picture.stderr = vec![[0.3, 0.0, 0.0], [0.0, 0.0, 0.3]];
    let expected = (2.0 * 0.09_f64 / 6.0).sqrt() / 2.0;
    assert!((picture.relative_error() - expected).abs() < 1e-7);
    picture.stderr.fill([0.0; 3]);
    picture.rgb.fill([0.0; 3]);
    assert_eq!(picture.relative_error(), 0.0);
}
