//! What the values of flags may be, read from their text. A mistake becomes a sentence that says what was expected;
//! clap names the flag.

use std::num::NonZeroU32;
use std::path::PathBuf;
use std::time::Duration;

use clap::builder::{PathBufValueParser, TypedValueParser};
use serde::Serialize;
use serde::de::DeserializeOwned;
use toml::Value;

use crate::engine::{Limit, SampleRange};
use crate::output::Format;
use crate::scene::file::EXPOSURE;
use crate::scene::{CacheFormat, CacheScale, Edit, Side, Variant};

/// The value of `--vram-budget` and of `--ram-budget`.
pub(super) fn limit(text: &str) -> Result<Limit, String> {
    let wrong = || {
        "expected bytes, a size in kB, KiB, MB, MiB, GB or GiB such as 512MiB, or a share such as 80% (at most 100%)"
            .to_string()
    };
    let split = text
        .find(|c: char| c.is_alphabetic() || c == '%')
        .unwrap_or(text.len());
    let (number, unit) = (text[..split].trim(), &text[split..]);
    let number = positive(number).map_err(|_| wrong())?;
    let unit = match unit {
        "" | "B" => 1.0,
        "kB" => 1e3,
        "KiB" => 1024.0,
        "MB" => 1e6,
        "MiB" => 1_048_576.0,
        "GB" => 1e9,
        "GiB" => 1_073_741_824.0,
        "%" if number <= 100.0 => return Ok(Limit::Percent(number)),
        _ => return Err(wrong()),
    };
    let bytes = (number * unit).floor();
    if !(1.0..=1e18).contains(&bytes) {
        return Err(wrong());
    }
    Ok(Limit::Bytes(bytes as u64))
}

/// The value of `--device`: a name, a part of one, or an index.
pub(super) fn device(text: &str) -> Result<String, String> {
    match text.trim() {
        "" => Err("expected a device's name or index".to_string()),
        name => Ok(name.to_string()),
    }
}

/// The most views of an orbit: their names count them with four digits.
const MOST_VIEWS: u32 = 9999;

/// The value of `--seed`.
pub(super) fn seed(text: &str) -> Result<u32, String> {
    let whole = text.trim().parse();
    whole.map_err(|_| format!("expected a whole number from 0 to {}", u32::MAX))
}

/// The value of `--orbit`.
pub(super) fn views(text: &str) -> Result<NonZeroU32, String> {
    let count = text.trim().parse().ok().and_then(NonZeroU32::new);
    count
        .filter(|count| count.get() <= MOST_VIEWS)
        .ok_or(format!("expected a whole number from 1 to {MOST_VIEWS}"))
}

/// A word or a number that one of the scene's own types understands.
pub(super) fn word<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    let value = text.parse().unwrap_or_else(|_| Value::String(text.into()));
    value.try_into().map_err(|error: toml::de::Error| {
        let message = error.message();
        // The flag's name and what was found stand before this already.
        let expected = message
            .find("expected ")
            .filter(|_| message.starts_with("unknown variant"));
        message[expected.unwrap_or(0)..].to_string()
    })
}

/// The edit that a flag stands for, once its value is known to be right.
fn edit<T>(flag: &str, key: &str, text: &str) -> Result<Edit, String>
where
    T: DeserializeOwned + Serialize,
{
    let value = Value::try_from(word::<T>(text)?).map_err(|error| error.to_string())?;
    Ok(Edit::set(format!("--{flag} {text}"), key, value))
}

pub(super) fn view(text: &str) -> Result<Edit, String> {
    word::<Side>(text).map(Edit::view)
}

pub(super) fn iso(text: &str) -> Result<Edit, String> {
    finite(text).map(Edit::iso)
}

pub(super) fn variant(text: &str) -> Result<Edit, String> {
    edit::<Variant>("variant", "render.variant", text)
}

pub(super) fn cache_scale(text: &str) -> Result<Edit, String> {
    edit::<CacheScale>("cache-scale", "render.cache_scale", text)
}

pub(super) fn cache_format(text: &str) -> Result<Edit, String> {
    edit::<CacheFormat>("cache-format", "render.cache_format", text)
}

pub(super) fn extent(text: &str) -> Result<[u32; 2], String> {
    let parsed = text.split_once('x').and_then(|(width, height)| {
        let side = |text: &str| text.parse::<NonZeroU32>().ok();
        Some([side(width)?, side(height)?].map(NonZeroU32::get))
    });
    parsed.ok_or("expected WIDTHxHEIGHT in pixels, as in 1920x1080".into())
}

pub(super) fn size(text: &str) -> Result<Edit, String> {
    let pixels = Value::from(extent(text)?.map(i64::from).to_vec());
    Ok(Edit::set(format!("--size {text}"), "render.size", pixels))
}

/// The value of `--spp`.
pub(super) fn spp(text: &str) -> Result<NonZeroU32, String> {
    let number = text.parse().ok();
    number
        .filter(|spp: &NonZeroU32| spp.get() <= SampleRange::MOST)
        .ok_or(format!(
            "expected a number of samples from 1 to {}",
            SampleRange::MOST
        ))
}

/// The value of `--samples`.
pub(super) fn samples(text: &str) -> Result<SampleRange, String> {
    let parsed = text.split_once("..").and_then(|(first, end)| {
        let [first, end] = [first, end].map(|text| text.parse().ok());
        let (first, end) = (first?, end?);
        (first < end && end <= SampleRange::MOST).then_some(SampleRange { first, end })
    });
    parsed.ok_or(format!(
        "expected the first sample and the one after the last, up to {}, as in 256..512",
        SampleRange::MOST
    ))
}

/// The name of a picture to write.
pub(super) fn picture() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| match Format::of(&path) {
        Ok(_) => Ok(path),
        Err(_) => Err("expected a file name that ends in .exr or .png"),
    })
}

/// The name of a file to write that is no picture. Nothing is written to the standard output: it may be a pipe, and files
/// appear whole.
pub(super) fn written() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| {
        if path.as_os_str() == "-" {
            Err("expected the name of a file")
        } else {
            Ok(path)
        }
    })
}

/// The name of an EXR.
pub(super) fn exr() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| match Format::of(&path) {
        Ok(Format::Exr) => Ok(path),
        _ => Err("expected a file name that ends in .exr"),
    })
}

pub(super) fn seconds(text: &str) -> Result<Duration, String> {
    let wrong = |_| "expected a number of seconds > 0".to_string();
    let seconds = positive(text).map_err(wrong)?;
    Duration::try_from_secs_f64(seconds).map_err(|_| "too many seconds".into())
}

pub(super) fn positive(text: &str) -> Result<f64, String> {
    let number = finite(text).ok().filter(|number| *number > 0.0);
    number.ok_or("expected a number > 0".to_string())
}

pub(super) fn exposure(text: &str) -> Result<f64, String> {
    let (is_allowed, expected) = EXPOSURE;
    let number = finite(text).ok().filter(|stops| is_allowed(*stops));
    number.ok_or(format!("expected {expected}"))
}

fn finite(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or("expected a finite number".to_string())
}
