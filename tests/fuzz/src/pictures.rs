//! Small pictures in the formats and compressions that skies and pictures come in.

use std::io::Cursor;

use exr::prelude::*;
use image::{DynamicImage, ImageFormat, Rgb32FImage, RgbImage};

const SIZE: [u32; 2] = [5, 3];

fn texel(x: u32, y: u32) -> [f32; 3] {
    [x as f32, y as f32, 0.25 * (x * y) as f32]
}

/// OpenEXR: every lossless compression and two that are not, in lines and in tiles.
pub fn exr() -> Vec<Vec<u8>> {
    let lines = Blocks::ScanLines;
    let tiles = Blocks::Tiles(Vec2(4, 2));
    [
        (Compression::Uncompressed, lines),
        (Compression::RLE, lines),
        (Compression::ZIP1, lines),
        (Compression::ZIP16, tiles),
        (Compression::PIZ, lines),
        (Compression::PXR24, lines),
        (Compression::B44, lines),
    ]
    .map(|(compression, blocks)| {
        let [width, height] = SIZE.map(|n| n as usize);
        let pixels = SpecificChannels::rgb(|Vec2(x, y)| {
            let [r, g, b] = texel(x as u32, y as u32);
            (r, g, b)
        });
        let encoding = Encoding {
            compression,
            blocks,
            line_order: LineOrder::Increasing,
        };
        let attributes = LayerAttributes::named("");
        let layer = Layer::new((width, height), attributes, encoding, pixels);
        let mut bytes = Cursor::new(Vec::new());
        let image = Image::from_layer(layer);
        image
            .write()
            .non_parallel()
            .to_buffered(&mut bytes)
            .expect("an EXR");
        bytes.into_inner()
    })
    .into()
}

pub fn png() -> Vec<Vec<u8>> {
    let [width, height] = SIZE;
    let image = RgbImage::from_fn(width, height, |x, y| {
        texel(x, y).map(|c| (20.0 * c) as u8).into()
    });
    let image = DynamicImage::from(image);
    let all = [
        image.clone(),
        image.to_luma8().into(),
        image.to_rgba16().into(),
    ];
    all.map(|image| encoded(&image, ImageFormat::Png)).into()
}

pub fn hdr() -> Vec<u8> {
    let [width, height] = [9, 3];
    let image = Rgb32FImage::from_fn(width, height, |x, y| texel(x, y).into());
    encoded(&image.into(), ImageFormat::Hdr)
}

fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).expect("a picture");
    bytes.into_inner()
}

/// What reading a picture may allocate: a byte of its file may become 2¹⁴ pixels.
pub fn allowed(bytes: usize) -> usize {
    (64 << 20) + (64 << 14) * bytes
}
