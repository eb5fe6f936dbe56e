//! Unpacks the pixels of one frame.
//!
//! Decoders from other crates are guarded: their allocations are bounded beforehand by the file's length, a frame of
//! another size is refused before it is decoded, and a panic inside becomes a sentence.
//!
//! JPEG-LS and run lengths are unpacked here, JPEG is read by `jpeg-decoder`, and JPEG 2000 by `hayro-jpeg2000`,
//! which forbids unsafe code. OpenJPEG, translated to Rust or not, is full of it.

use hayro_jpeg2000::{DecodeSettings, DecoderContext};
use jpeg_decoder::{Decoder, Error, PixelFormat, UnsupportedFeature};

use crate::panic_guard::guarded;
use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::voxel_type::Endian;

use super::fragments::Fragments;
use super::image::{Image, Samples};
use super::jpeg_ls;
use super::run_length;
use super::syntax::{GDCMCONV, Packing};

/// The most pixels for each byte. A JPEG's blocks of 64 take at least 2 bits; a picture of one value takes next to
/// nothing in JPEG 2000.
const LARGEST_JPEG_RATIO: u64 = 256;
const LARGEST_JPEG_2000_RATIO: u64 = 1 << 15;
/// The most pixels for each byte: a row takes a bit or more.
const LARGEST_JPEG_LS_RATIO: u64 = 1 << 15;

/// The words of a frame.
#[derive(Debug)]
pub struct Unpacked {
    pub words: Vec<u8>,
    pub samples: Samples,
    pub endian: Endian,
}

impl Packing {
    /// The most pixels for each byte.
    pub fn most_pixels(self) -> u64 {
        match self {
            Packing::Plain => 1,
            Packing::RunLength => run_length::LARGEST_RATIO,
            Packing::Jpeg => LARGEST_JPEG_RATIO,
            Packing::Jpeg2000 => LARGEST_JPEG_2000_RATIO,
            Packing::JpegLs => LARGEST_JPEG_LS_RATIO,
        }
    }
}

pub fn unpack(
    image: &Image,
    fragments: &Fragments,
    frame: u32,
    packing: Packing,
) -> Parsed<Unpacked> {
    let packed = fragments.read(image, frame)?;
    let most = packing.most_pixels().saturating_mul(packed.len() as u64);
    if image.frame_pixels() > most {
        return Err(format!(
            "{} packed bytes cannot hold {}×{} pixels: the file is truncated, or its header wrong",
            packed.len(),
            image.columns,
            image.rows
        ));
    }
    let name = image.transfer.name;
    let unpacked = guarded(|| match packing {
        Packing::Plain | Packing::RunLength => run_length(&packed, image),
        Packing::Jpeg => jpeg(&packed, image),
        Packing::Jpeg2000 => jpeg_2000(&packed, image),
        Packing::JpegLs => jpeg_ls(&packed, image),
    });
    unpacked.map_err(|fault| format!("{name}: {fault}"))
}

fn run_length(packed: &[u8], image: &Image) -> Parsed<Unpacked> {
    let size = image.samples.bytes() as usize;
    Ok(Unpacked {
        words: run_length::unpack(packed, image.frame_pixels() as usize, size)?,
        samples: image.samples,
        endian: Endian::Little,
    })
}

/// Fails for lossless JPEG in a form that the decoder reads wrongly: with restart intervals, after which it goes on from the
/// pixel before, and with a point transform, before which it predicts.
fn check_lossless(packed: &[u8]) -> Parsed<()> {
    const START_OF_IMAGE: usize = 2;
    const LOSSLESS: u8 = 0xC3;
    const RESTART_INTERVAL: u8 = 0xDD;
    const START_OF_SCAN: u8 = 0xDA;
    let mut rest = packed.get(START_OF_IMAGE..).unwrap_or_default();
    let (mut is_lossless, mut has_restarts) = (false, false);
    while let [0xFF, marker, high, low, segment @ ..] = rest {
        let length = usize::from(u16::from_be_bytes([*high, *low])).saturating_sub(2);
        let body = segment.get(..length).unwrap_or_default();
        match *marker {
            LOSSLESS => is_lossless = true,
            RESTART_INTERVAL => has_restarts = body.iter().any(|byte| *byte != 0),
            START_OF_SCAN => {
                let has_point_transform = body.last().is_some_and(|last| last & 0x0F != 0);
                return if is_lossless && (has_restarts || has_point_transform) {
                    Err(format!(
                        "it is lossless with {}, which is not read; {GDCMCONV}",
                        if has_restarts {
                            "restart intervals"
                        } else {
                            "a point transform"
                        }
                    ))
                } else {
                    Ok(())
                };
            }
            _ => {}
        }
        rest = segment.get(length..).unwrap_or_default();
    }
    Ok(())
}

fn jpeg(packed: &[u8], image: &Image) -> Parsed<Unpacked> {
    check_lossless(packed)?;
    let mut decoder = Decoder::new(packed);
    decoder.read_info().map_err(jpeg_fault)?;
    let info = decoder.info().ok_or("it has no header")?;
    check_size(image, info.width.into(), info.height.into())?;
    let allocated = match info.pixel_format {
        PixelFormat::L8 => 8,
        PixelFormat::L16 => 16,
        found => {
            return Err(format!(
                "its pixels are {found:?}, expected one grey value each"
            ));
        }
    };
    decoder.set_max_decoding_buffer_size(image.frame_pixels() as usize * 2);
    let words = decoder.decode().map_err(jpeg_fault)?;
    Ok(Unpacked {
        words,
        samples: allocated_anew(image.samples, allocated)?,
        endian: Endian::NATIVE,
    })
}

fn jpeg_fault(error: Error) -> String {
    match error {
        Error::Unsupported(UnsupportedFeature::SamplePrecision(bits)) => {
            format!("its pixels have {bits} bits, expected 8 unless they are lossless; {GDCMCONV}")
        }
        Error::Unsupported(feature) => format!("it has {feature:?}, which is not read; {GDCMCONV}"),
        error => error.to_string(),
    }
}

/// The samples with words of another width.
fn allocated_anew(samples: Samples, allocated: u32) -> Parsed<Samples> {
    match samples {
        Samples::Integers {
            stored, is_signed, ..
        } if stored <= allocated || !is_signed => Ok(Samples::Integers {
            allocated,
            stored: stored.min(allocated),
            high: stored.min(allocated) - 1,
            is_signed,
        }),
        _ => Err(format!(
            "its pixels have {allocated} bits, expected those of {samples:?}"
        )),
    }
}

fn jpeg_2000(packed: &[u8], image: &Image) -> Parsed<Unpacked> {
    let settings = DecodeSettings {
        resolve_palette_indices: false,
        strict: true,
        target_resolution: None,
    };
    let picture = hayro_jpeg2000::Image::new(packed, &settings).map_err(|e| e.to_string())?;
    check_size(image, picture.width(), picture.height())?;
    let (precision, has_sign) = precision(packed).ok_or("its codestream has no size marker")?;
    let Samples::Integers {
        stored, is_signed, ..
    } = image.samples
    else {
        return Err("its pixels are floats, expected integers".into());
    };
    let mut context = DecoderContext::default();
    let decoded = picture.decode(&mut context).map_err(|e| e.to_string())?;
    let [component] = decoded.components() else {
        let count = decoded.components().len();
        return Err(format!("it has {count} components, expected 1"));
    };
    if component.samples().len() as u64 != image.frame_pixels() {
        return Err("its component has another size than its picture".into());
    }
    // The decoder shifts signed values up as if they were unsigned. Other writers put signed values into
    // an unsigned codestream, where the top bit of its own precision is the sign. What a lossy codestream makes of an
    // edge between the extremes may lie beyond them.
    let shift = 32 - precision;
    let most = (1 << precision) - 1;
    let word = |sample: &f32| {
        let bits = (sample.round() as i64).clamp(0, most);
        match (has_sign, is_signed) {
            (true, _) => (bits - (1 << (precision - 1))) as i32,
            (false, true) => ((bits as i32) << shift) >> shift,
            (false, false) => bits as i32,
        }
    };
    let words = component
        .samples()
        .iter()
        .flat_map(|sample| word(sample).to_le_bytes());
    Ok(Unpacked {
        words: words.collect(),
        samples: Samples::Integers {
            allocated: 32,
            stored,
            high: stored - 1,
            is_signed,
        },
        endian: Endian::Little,
    })
}

fn jpeg_ls(packed: &[u8], image: &Image) -> Parsed<Unpacked> {
    let header = jpeg_ls::Header::parse(packed)?;
    check_size(image, header.width, header.height)?;
    let pixels = jpeg_ls::decode(packed, &header)?;
    Ok(Unpacked {
        words: pixels
            .iter()
            .flat_map(|pixel| pixel.to_le_bytes())
            .collect(),
        samples: allocated_anew(image.samples, 16)?,
        endian: Endian::Little,
    })
}

/// The bits per value of a codestream, and whether they have a sign, from its first marker, that of the size.
fn precision(packed: &[u8]) -> Option<(u32, bool)> {
    const BEGIN: [u8; 4] = [0xff, 0x4f, 0xff, 0x51];
    let begin = packed.windows(4).position(|bytes| bytes == BEGIN)?;
    let depth = *packed.get(begin + 42)?;
    let precision = u32::from(depth & 0x7f) + 1;
    (precision <= 32).then_some((precision, depth & 0x80 != 0))
}

fn check_size(image: &Image, width: u32, height: u32) -> Parsed<()> {
    if [width, height] == [image.columns, image.rows] {
        Ok(())
    } else {
        Err(format!(
            "its picture is {width}×{height}, expected {}×{} as in the header",
            image.columns, image.rows
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lossless_pictures_that_would_be_read_wrongly_are_refused() {
        let file = |frame: u8, restarts: u8, point_transform: u8| {
            let segments: [&[u8]; 4] = [
                &[0xFF, 0xD8],
                &[0xFF, frame, 0, 3, 8],
                &[0xFF, 0xDD, 0, 4, 0, restarts],
                &[0xFF, 0xDA, 0, 8, 1, 1, 0, 1, 0, point_transform],
            ];
            segments.concat()
        };
        for (file, is_read) in [
            (file(0xC3, 0, 0), true),
            (file(0xC3, 32, 0), false),
            (file(0xC3, 0, 1), false),
            (file(0xC0, 32, 0), true),
        ] {
            assert_eq!(check_lossless(&file).is_ok(), is_read, "{file:x?}");
        }
    }
}
