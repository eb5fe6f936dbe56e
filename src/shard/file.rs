//! Reads a shard's EXR back.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use ::exr::meta::MetaData;
use ::exr::prelude::*;

use super::header::{Header, checksum};
use crate::decoding::{exr_meta_data, read_exr};
use crate::engine::Picture;
use crate::error::{Error, Result};
use crate::output::{HEADER_ATTRIBUTE, SCENE_ATTRIBUTE, channels};
use crate::render::{Halves, Sums};

/// The picture of a shard, and the sums behind it.
pub struct Pixels {
    pub picture: Picture,
    pub sums: Sums,
}

/// The header and the resolved scene of a shard. `T` is [`Header`] or has further fields.
///
/// # Errors
///
/// If the file cannot be read, or is not a shard.
pub fn read_header<T: serde::de::DeserializeOwned>(path: &Path) -> Result<(T, String)> {
    let wrong = |why: &str| Error::input(path, why);
    let Some((json, scene)) = texts(path)? else {
        return Err(wrong(
            "it is neither a shard nor a checkpoint; expected a picture of `isolume render` with --samples or \
             --checkpoint, or of `isolume merge`",
        ));
    };
    let header = serde_json::from_str(&json)
        .map_err(|error| wrong(&format!("its header is damaged: {error}")))?;
    Ok((header, scene))
}

/// Whether an EXR has the header of a shard or a checkpoint.
pub(super) fn has_header(path: &Path) -> Result<bool> {
    texts(path).map(|texts| texts.is_some())
}

/// The texts of the header and of the resolved scene; `None` in an EXR without them.
fn texts(path: &Path) -> Result<Option<(String, String)>> {
    let meta = meta_data(path)?;
    let header = meta.headers.first();
    let header = header.ok_or_else(|| Error::input(path, "it holds no picture"))?;
    let attribute = |name: &str| {
        let own = header.own_attributes.other.get(&Text::from(name));
        match own.or(header.shared_attributes.other.get(&Text::from(name))) {
            Some(AttributeValue::Text(text)) => String::from_utf8(text.as_slice().to_vec()).ok(),
            _ => None,
        }
    };
    Ok(attribute(HEADER_ATTRIBUTE).zip(attribute(SCENE_ATTRIBUTE)))
}

impl Pixels {
    /// Reads those of the shard with this header.
    ///
    /// # Errors
    ///
    /// If the file cannot be read, or does not agree with its header.
    pub fn read(path: &Path, header: &Header) -> Result<Pixels> {
        let wrong = |why: &str| Error::input(path, why);
        header.check().map_err(|why| wrong(&why))?;
        check_size(path, &meta_data(path)?, header.identity.size)?;
        let image = read_exr(path).map_err(|why| wrong(&why))?;
        let [width, height] = header.identity.size;
        let file = Channels {
            path,
            list: &image.layer_data.channel_data.list,
            pixels: width as usize * height as usize,
        };
        let has_mean = file.get(channels::MEAN[0]).is_some();
        let [red, green, blue] = if has_mean {
            channels::MEAN
        } else {
            channels::RGB
        };
        let sums = Sums {
            mean: file.texels([red, green, blue, channels::COVERAGE])?,
            squares: file.texels(channels::SQUARES)?,
            halves: match header.halves {
                Some(samples) => Some(Arc::new(Halves {
                    samples,
                    mean: file.texels(channels::HALVES)?,
                    variance_ratio: file.needed(channels::VARIANCE_RATIO)?.to_vec(),
                })),
                None => None,
            },
        };
        if checksum(&sums) != header.checksum {
            let now = read_header::<Header>(path);
            let has_changed = now.is_ok_and(|(now, _)| now.checksum != header.checksum);
            return Err(wrong(if has_changed {
                "it was written anew while it was read; try again"
            } else {
                "it is damaged: its pixels are not those that were written"
            }));
        }
        let picture = Picture {
            width,
            height,
            rgb: file.texels(channels::RGB)?,
            alpha: file.get(channels::ALPHA).map(<[f32]>::to_vec),
            stderr: file.texels(channels::STDERR)?,
            albedo: file.texels(channels::ALBEDO)?,
            normal: file.texels(channels::NORMAL)?,
            depth: file.needed(channels::DEPTH)?.to_vec(),
        };
        Ok(Pixels { picture, sums })
    }
}

/// The channels of a shard's file.
struct Channels<'a> {
    path: &'a Path,
    list: &'a [AnyChannel<FlatSamples>],
    pixels: usize,
}

impl<'a> Channels<'a> {
    /// `None` if there is none of 32-bit floats with a value for each pixel.
    fn get(&self, name: &str) -> Option<&'a [f32]> {
        let channel = self.list.iter().find(|channel| channel.name.eq(name))?;
        match &channel.sample_data {
            FlatSamples::F32(samples) if samples.len() == self.pixels => Some(samples),
            _ => None,
        }
    }

    fn needed(&self, name: &str) -> Result<&'a [f32]> {
        self.get(name)
            .ok_or_else(|| Error::input(self.path, format!("the channel {name} is missing")))
    }

    /// These channels side by side, pixel by pixel.
    fn texels<const N: usize>(&self, names: [&str; N]) -> Result<Vec<[f32; N]>> {
        let components = names.map(|name| self.needed(name));
        let components = components.into_iter().collect::<Result<Vec<_>>>()?;
        let texel = |pixel: usize| std::array::from_fn(|c| components[c][pixel]);
        Ok((0..self.pixels).map(texel).collect())
    }
}

fn meta_data(path: &Path) -> Result<MetaData> {
    if let Err(error) = fs::metadata(path) {
        return Err(Error::io(path, error));
    }
    exr_meta_data(path).map_err(|why| Error::input(path, why))
}

/// Fails for a file of another size than that in its header.
fn check_size(path: &Path, meta: &MetaData, size: [u32; 2]) -> Result<()> {
    let [width, height] = size.map(|n| n as usize);
    let is_whole = |header: &::exr::meta::header::Header| header.layer_size == Vec2(width, height);
    if meta.headers.len() == 1 && meta.headers.iter().all(is_whole) {
        Ok(())
    } else {
        Err(Error::input(
            path,
            format!("it is damaged: it does not hold {width}x{height} pixels"),
        ))
    }
}
