//! Reading pictures that other programs may have written.
//!
//! A header may claim any size. Memory for a picture is only asked for once its file is long enough to hold it, and where a
//! decoder panics on damaged data, that is an error like any other. OpenEXR is therefore decoded by the thread that asks: a
//! panic on a thread of a pool would end the process.

use std::io::BufReader;
use std::path::Path;

use exr::compression::Compression;
use exr::image::{AnyChannels, FlatSamples, Image, Layer};
use exr::math::Vec2;
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};
use exr::prelude::{IntegerBounds, ReadChannels, ReadLayers};
use image::error::{ImageError, UnsupportedErrorKind};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Rgb, Rgb32FImage, imageops};

use crate::error::first_of;
use crate::panic_guard::guarded;
use crate::regular_file::open_file;

/// Bytes of pixels that a byte of an OpenEXR file becomes at most: Deflate makes 1032 bytes of one, and PXR24 leaves out one
/// byte of four before that.
const MOST_BY_DEFLATE: u64 = 1400;
/// PIZ leaves a few hundred bytes of 32 lines of one colour, however long they are.
const MOST_BY_PIZ: u64 = 1 << 14;
/// Pixels that any file may show, however little data it has.
const ALWAYS_SHOWN: u64 = 1 << 24;
/// Pixels that a byte of another picture becomes at most: Deflate makes 1032 bytes of one, with eight pixels in each.
const MOST_PIXELS: u64 = 8 * 1032;

/// Bytes of a tile that are allowed to any file: tiles may be larger than their picture.
const SMALL_TILE: u64 = 16 << 20;

/// Channels that a message names at most: a rendering may have hundreds.
const MOST_NAMED: usize = 8;

/// The metadata of an OpenEXR file.
///
/// # Errors
///
/// The file cannot be read, is not OpenEXR, or claims more pixels than it can hold.
pub fn exr_meta_data(path: &Path) -> Result<MetaData, String> {
    let (file, metadata) = open_file(path)?;
    let bytes = metadata.len();
    let meta = guarded(|| {
        MetaData::read_from_buffered(BufReader::new(file), false)
            .map_err(|error| format!("not readable as OpenEXR: {error}"))
    })?;
    for header in &meta.headers {
        check_header(header, bytes)?;
    }
    Ok(meta)
}

/// All channels of the first layer of an OpenEXR file, in full resolution.
///
/// # Errors
///
/// As for [`exr_meta_data`], or the pixels are damaged.
pub fn read_exr(path: &Path) -> Result<Image<Layer<AnyChannels<FlatSamples>>>, String> {
    exr_meta_data(path)?;
    guarded(|| {
        exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .non_parallel()
            .from_file(path)
            .map_err(damaged)
    })
}

fn damaged(error: exr::error::Error) -> String {
    format!("it is damaged and not readable as OpenEXR: {error}")
}

/// RGB of the first layer of an OpenEXR file that has it, over the window that is shown; black where there are no pixels.
fn read_exr_colors(path: &Path) -> Result<Rgb32FImage, String> {
    check_colors(&exr_meta_data(path)?)?;
    let (shown, data) = guarded(|| {
        let read = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .rgb_channels(
                |size, _| Rgb32FImage::new(size.x() as u32, size.y() as u32),
                |pixels, at, (r, g, b): (f32, f32, f32)| {
                    pixels.put_pixel(at.x() as u32, at.y() as u32, Rgb([r, g, b]));
                },
            )
            .first_valid_layer()
            .all_attributes()
            .non_parallel()
            .from_file(path)
            .map_err(damaged)?;
        Ok((read.attributes.display_window, read.layer_data))
    })?;
    let position = data.attributes.layer_position;
    Ok(in_window(data.channel_data.pixels, position, shown))
}

/// What the display window of an OpenEXR file shows of a layer at `position`; black where there are no pixels.
pub fn in_window(layer: Rgb32FImage, position: Vec2<i32>, shown: IntegerBounds) -> Rgb32FImage {
    let between = |from: i32, to: i32| i64::from(to) - i64::from(from);
    let x = between(shown.position.x(), position.x());
    let y = between(shown.position.y(), position.y());
    let Vec2(width, height) = shown.size;
    if (x, y, width as u32, height as u32) == (0, 0, layer.width(), layer.height()) {
        return layer;
    }
    let mut image = Rgb32FImage::new(width as u32, height as u32);
    imageops::replace(&mut image, &layer, x, y);
    image
}

/// Fails where no layer has colours: such a file is whole, but no picture.
fn check_colors(meta: &MetaData) -> Result<(), String> {
    let has = |header: &Header, wanted: &str| {
        let channels = &header.channels.list;
        channels.iter().any(|channel| channel.name.eq(wanted))
    };
    let has_colors = |header: &Header| ["R", "G", "B"].iter().all(|name| has(header, name));
    if meta.headers.iter().any(has_colors) {
        return Ok(());
    }
    let channels = meta.headers.iter().flat_map(|header| &header.channels.list);
    let names: Vec<String> = channels.map(|channel| channel.name.to_string()).collect();
    Err(format!(
        "its channels are {}, expected R, G and B",
        first_of(&names, MOST_NAMED)
    ))
}

fn check_header(header: &Header, bytes: u64) -> Result<(), String> {
    let Vec2(width, height) = header.layer_size;
    let pixel = header.channels.bytes_per_pixel.max(1);
    let Vec2(shown_width, shown_height) = header.shared_attributes.display_window.size;
    let expansion = match header.compression {
        Compression::PIZ => MOST_BY_PIZ,
        _ => MOST_BY_DEFLATE,
    };
    let most = bytes.saturating_mul(expansion);
    check_claim([width, height], most / pixel as u64, bytes)?;
    // What is shown may be larger than the data, and takes no room in the file: the limit bounds what is allocated for it.
    let most_shown = bytes.saturating_mul(MOST_BY_PIZ) / size_of::<Rgb<f32>>() as u64;
    check_claim(
        [shown_width, shown_height],
        most_shown.max(ALWAYS_SHOWN),
        bytes,
    )?;
    if let BlockDescription::Tiles(tiles) = header.blocks {
        let Vec2(width, height) = tiles.tile_size;
        let most = most.max(SMALL_TILE);
        check_claim([width, height], most / pixel as u64, bytes)?;
    }
    Ok(())
}

/// Fails for more pixels than `most`, which is what a file of `bytes` bytes can hold.
fn check_claim([width, height]: [usize; 2], most: u64, bytes: u64) -> Result<(), String> {
    let claimed = (width as u64).saturating_mul(height as u64);
    if claimed <= most {
        Ok(())
    } else {
        Err(format!(
            "it is damaged: it claims {width}x{height} pixels, more than its {bytes} bytes can hold"
        ))
    }
}

/// Reads a picture of a format that is given or told by the file's first bytes.
///
/// # Errors
///
/// The file cannot be read, is no picture, or claims more pixels than it can hold.
pub fn read_image(path: &Path, format: Option<ImageFormat>) -> Result<DynamicImage, String> {
    let (file, metadata) = open_file(path)?;
    let bytes = metadata.len();
    let mut reader = ImageReader::new(BufReader::new(file));
    match format {
        Some(format) => reader.set_format(format),
        None => {
            reader = reader
                .with_guessed_format()
                .map_err(|error| error.to_string())?;
        }
    }
    if reader.format() == Some(ImageFormat::OpenExr) {
        return Ok(read_exr_colors(path)?.into());
    }
    // The library's own cap of 512 MiB is less than an 8K sky needs.
    reader.no_limits();
    guarded(|| {
        let decoder = reader.into_decoder().map_err(unopened)?;
        let (width, height) = decoder.dimensions();
        let most = bytes.saturating_mul(MOST_PIXELS);
        check_claim([width as usize, height as usize], most, bytes)?;
        DynamicImage::from_decoder(decoder).map_err(|error| error.to_string())
    })
}

fn unopened(error: ImageError) -> String {
    let is_other_format = matches!(
        &error,
        ImageError::Unsupported(why) if matches!(why.kind(), UnsupportedErrorKind::Format(_))
    );
    if is_other_format {
        format!("{error}, expected OpenEXR, Radiance HDR or PNG")
    } else {
        error.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of one colour takes the least room.
    fn black(format: ImageFormat) -> Vec<u8> {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let image = match format {
            ImageFormat::OpenExr => image::Rgb32FImage::new(512, 256).into(),
            _ => DynamicImage::from(image::GrayImage::new(512, 256)),
        };
        image.write_to(&mut bytes, format).expect("a picture");
        bytes.into_inner()
    }

    fn read(bytes: &[u8]) -> Result<DynamicImage, String> {
        let file = tempfile::NamedTempFile::new().expect("a file");
        std::fs::write(&file, bytes).expect("a file");
        read_image(file.path(), None)
    }

    #[test]
    fn what_is_as_short_as_can_be_is_read() {
        for format in [ImageFormat::Png, ImageFormat::OpenExr] {
            assert_eq!(read(&black(format)).expect("a picture").width(), 512);
        }
    }

    #[test]
    fn long_lines_of_one_colour_are_read() {
        use exr::prelude::*;
        let channels = SpecificChannels::rgb(|_| (0.0_f32, 0.0_f32, 0.0_f32));
        let encoding = Encoding {
            compression: Compression::PIZ,
            ..Encoding::FAST_LOSSLESS
        };
        let layer = Layer::new(
            (8192, 64),
            LayerAttributes::named("sky"),
            encoding,
            channels,
        );
        let mut bytes = std::io::Cursor::new(Vec::new());
        let image = Image::from_layer(layer);
        let written = image.write().to_buffered(&mut bytes);
        written.expect("a picture");
        assert_eq!(
            super::tests::read(&bytes.into_inner())
                .expect("a sky")
                .width(),
            8192
        );
    }

    #[test]
    fn a_header_that_claims_more_than_its_file_holds_is_refused() {
        let png = black(ImageFormat::Png);
        let mut claim = png.clone();
        // The width in the first chunk, and no checksum that would notice: the chunk is read before it is checked.
        claim[16..20].copy_from_slice(&0x7000_0000_u32.to_be_bytes());
        let mut hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\n".to_vec();
        hdr.extend([2, 2, 0xea, 0x60]);
        for claim in [claim, hdr] {
            read(&claim).expect_err("a picture that cannot be");
        }
    }

    /// A tiled OpenEXR file in which these numbers take the place of the last ones of an attribute.
    fn exr_with(attribute: &str, numbers: [i32; 2]) -> Vec<u8> {
        use exr::prelude::{Blocks, Encoding, Image, Layer, SpecificChannels, WritableImage};
        let encoding = Encoding {
            blocks: Blocks::Tiles(Vec2(8, 8)),
            ..Encoding::UNCOMPRESSED
        };
        let black = SpecificChannels::rgb(|_| (0.0_f32, 0.0_f32, 0.0_f32));
        let layer = Layer::new((16, 8), Default::default(), encoding, black);
        let mut file = std::io::Cursor::new(Vec::new());
        let image = Image::from_layer(layer);
        image.write().to_buffered(&mut file).expect("a picture");
        let mut bytes = file.into_inner();
        let is_here = |part: &[u8]| part == attribute.as_bytes();
        let name = bytes.windows(attribute.len()).position(is_here);
        let end = name.expect("the attribute") + attribute.len();
        bytes[end - 8..end].copy_from_slice(bytemuck::bytes_of(&numbers));
        bytes
    }

    #[test]
    fn an_exr_that_claims_more_than_its_file_holds_is_refused() {
        let window = |name: &str| {
            format!(
                "{name}\0box2i\0\u{10}\0\0\0{}{}",
                "\0".repeat(8),
                "\u{f}\0\0\0\u{7}\0\0\0"
            )
        };
        let tiles = "tiles\0tiledesc\0\t\0\0\0\u{8}\0\0\0\u{8}\0\0\0";
        let [data, shown] = ["dataWindow", "displayWindow"].map(window);
        read(&exr_with(&data, [15, 7])).expect("a picture");
        for (attribute, numbers) in [
            (&data[..], [99_999, 99_999]),
            (&shown, [99_999, 99_999]),
            (&shown, [4_999, 4_999]),
            (tiles, [99_999, 99_999]),
        ] {
            let why = read(&exr_with(attribute, numbers)).expect_err("a claim");
            assert!(why.contains("claims"), "{why}");
        }
    }
}
