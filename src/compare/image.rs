//! Pictures to compare, as linear radiance, from EXR or PNG files or straight from a render.

use std::path::Path;

use ::exr::prelude::*;
use ::image::{ImageFormat, Rgb32FImage};

use crate::decoding::{self, in_window, read_image};
use crate::engine::Picture;
use crate::error::{Error, Location, Result, first_of};
use crate::output::channels;
use crate::srgb;

/// The most channels that one message names.
const MOST_NAMED: usize = 8;

/// Linear RGB, row 0 on top. Alpha is ignored.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearImage {
    /// The picture's name in messages.
    pub name: String,
    pub width: usize,
    pub height: usize,
    pub rgb: Vec<[f32; 3]>,
    /// Standard error of each pixel's mean, if known.
    pub stderr: Option<Vec<[f32; 3]>>,
}

impl LinearImage {
    pub fn read(path: &Path) -> Result<LinearImage> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("exr") => read_exr(path),
            Some("png") => read_png(path),
            _ => Err(Error::input(
                path,
                "only .exr and .png pictures can be compared",
            )),
        }
    }

    pub fn from_picture(name: impl Into<String>, picture: &Picture) -> LinearImage {
        LinearImage {
            name: name.into(),
            width: picture.width as usize,
            height: picture.height as usize,
            rgb: picture.rgb.clone(),
            stderr: known(picture.stderr.clone()),
        }
    }

    /// Whether every metric of `self` and `test` is defined.
    pub(super) fn check_comparable(&self, test: &LinearImage) -> Result<()> {
        if (self.width, self.height) != (test.width, test.height) {
            return Err(Error::input(
                Location::file(&self.name),
                format!(
                    "it has {}x{} pixels, {} has {}x{}; only pictures of one size can be compared",
                    self.width, self.height, test.name, test.width, test.height
                ),
            ));
        }
        self.check_finite()?;
        test.check_finite()
    }

    fn check_finite(&self) -> Result<()> {
        let layers = [
            Some((&self.rgb, channels::RGB)),
            self.stderr
                .as_ref()
                .map(|stderr| (stderr, channels::STDERR)),
        ];
        for (pixels, names) in layers.into_iter().flatten() {
            let values = pixels.as_flattened();
            let Some(index) = values.iter().position(|v| !v.is_finite()) else {
                continue;
            };
            let problem = format!(
                "{} is {} at column {}, row {}; a comparison needs finite values",
                names[index % 3],
                values[index],
                index / 3 % self.width,
                index / 3 / self.width,
            );
            return Err(Error::input(Location::file(&self.name), problem));
        }
        Ok(())
    }
}

/// A picture of a single sample has no spread to tell its error from: its layer is infinite.
fn known(stderr: Vec<[f32; 3]>) -> Option<Vec<[f32; 3]>> {
    let unknown = stderr.as_flattened().contains(&f32::INFINITY);
    (!unknown).then_some(stderr)
}

fn read_exr(path: &Path) -> Result<LinearImage> {
    let unreadable = |why: String| Error::input(path, why);
    let image = decoding::read_exr(path).map_err(unreadable)?;
    let Layer {
        channel_data: AnyChannels { list },
        size,
        attributes,
        ..
    } = image.layer_data;
    let Some(rgb) = pixels(&list, channels::RGB) else {
        let names: Vec<String> = list
            .iter()
            .map(|channel| channel.name.to_string())
            .collect();
        let found = first_of(&names, MOST_NAMED);
        return Err(unreadable(format!(
            "the channels R, G and B are needed; there are {found}"
        )));
    };
    if rgb.len() != size.area() {
        return Err(unreadable(
            "subsampled channels cannot be compared".to_owned(),
        ));
    }
    let shown = image.attributes.display_window;
    let placed = |pixels: Vec<[f32; 3]>| {
        let (width, height) = (size.width() as u32, size.height() as u32);
        let layer = Rgb32FImage::from_raw(width, height, pixels.into_flattened());
        let layer = layer.expect("as many pixels as the layer has");
        let window = in_window(layer, attributes.layer_position, shown);
        window.into_raw().as_chunks().0.to_vec()
    };
    Ok(LinearImage {
        name: path.display().to_string(),
        width: shown.size.width(),
        height: shown.size.height(),
        rgb: placed(rgb),
        stderr: pixels(&list, channels::STDERR).and_then(known).map(placed),
    })
}

/// The three channels as pixels, if all are there.
fn pixels(list: &[AnyChannel<FlatSamples>], names: [&str; 3]) -> Option<Vec<[f32; 3]>> {
    let find = |name: &str| list.iter().find(|channel| channel.name.eq(name));
    let [r, g, b] = [find(names[0])?, find(names[1])?, find(names[2])?]
        .map(|channel| channel.sample_data.values_as_f32());
    Some(r.zip(g).zip(b).map(|((r, g), b)| [r, g, b]).collect())
}

fn read_png(path: &Path) -> Result<LinearImage> {
    let image = read_image(path, Some(ImageFormat::Png))
        .map_err(|why| Error::input(path, format!("not readable as PNG: {why}")))?
        .into_rgb32f();
    let linear = |encoded: f32| srgb::decode(encoded.into()) as f32;
    Ok(LinearImage {
        name: path.display().to_string(),
        width: image.width() as usize,
        height: image.height() as usize,
        rgb: image.pixels().map(|pixel| pixel.0.map(linear)).collect(),
        stderr: None,
    })
}
