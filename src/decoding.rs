//! Reading pictures that other programs may have written.
//!
//! A header may claim any size. Memory for a picture is only asked for once its file is long enough to hold it, and where a
//! decoder panics on damaged data, that is an error like any other.

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use exr::math::Vec2;
use exr::meta::MetaData;
use exr::meta::header::Header;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};

/// Bytes or pixels that a byte of a file becomes at most: Deflate makes 1032 bytes of one, and PXR24 leaves out one byte
/// of four before that.
const MOST_EXPANSION: u64 = 1400;

/// What an OpenEXR file says of itself.
///
/// # Errors
///
/// The file cannot be read, is none, or claims more pixels than it can hold.
pub fn exr_meta_data(path: &Path) -> Result<MetaData, String> {
    let bytes = length(path)?;
    let meta = fenced(|| {
        MetaData::read_from_file(path, false)
            .map_err(|error| format!("not readable as OpenEXR: {error}"))
    })?;
    for header in &meta.headers {
        check_header(header, bytes)?;
    }
    Ok(meta)
}

fn check_header(header: &Header, bytes: u64) -> Result<(), String> {
    let Vec2(width, height) = header.layer_size;
    let pixel = header.channels.bytes_per_pixel.max(1);
    let Vec2(shown_width, shown_height) = header.shared_attributes.display_window.size;
    check_claim([width, height], pixel as u64, bytes)?;
    check_claim([shown_width, shown_height], 1, bytes)
}

/// Fails for more pixels, of so many bytes each, than a file of `bytes` bytes can hold.
fn check_claim([width, height]: [usize; 2], pixel: u64, bytes: u64) -> Result<(), String> {
    let claimed = (width as u64)
        .saturating_mul(height as u64)
        .saturating_mul(pixel);
    match claimed <= bytes.saturating_mul(MOST_EXPANSION) {
        true => Ok(()),
        false => Err(format!(
            "it is damaged: it claims {width}x{height} pixels, more than its {bytes} bytes can hold"
        )),
    }
}

/// Reads a picture of a format that is given or told by the file's first bytes.
///
/// # Errors
///
/// The file cannot be read, is no picture, or claims more pixels than it can hold.
pub fn read_image(path: &Path, format: Option<ImageFormat>) -> Result<DynamicImage, String> {
    let bytes = length(path)?;
    let mut reader = ImageReader::open(path).map_err(|error| error.to_string())?;
    match format {
        Some(format) => reader.set_format(format),
        None => {
            reader = reader
                .with_guessed_format()
                .map_err(|error| error.to_string())?;
        }
    }
    if reader.format() == Some(ImageFormat::OpenExr) {
        exr_meta_data(path)?;
    }
    // The library's own cap of 512 MiB is less than an 8K sky needs.
    reader.no_limits();
    fenced(|| {
        let decoder = reader.into_decoder().map_err(|error| error.to_string())?;
        let (width, height) = decoder.dimensions();
        check_claim([width as usize, height as usize], 1, bytes)?;
        DynamicImage::from_decoder(decoder).map_err(|error| error.to_string())
    })
}

/// A panic in a decoder is an error.
pub fn fenced<T>(decode: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    let outcome = catch_unwind(AssertUnwindSafe(decode));
    outcome.unwrap_or_else(|_| Err("it is damaged: its decoder gave up".into()))
}

fn length(path: &Path) -> Result<u64, String> {
    let metadata = fs::metadata(path).map_err(|error| error.to_string())?;
    Ok(metadata.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of one colour takes least room.
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
        fs::write(&file, bytes).expect("a file");
        read_image(file.path(), None)
    }

    #[test]
    fn what_is_as_short_as_can_be_is_read() {
        for format in [ImageFormat::Png, ImageFormat::OpenExr] {
            assert_eq!(read(&black(format)).expect("a picture").width(), 512);
        }
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
}
