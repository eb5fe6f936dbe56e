//! OpenEXR: all that a render knows about each pixel, without loss.
//!
//! One part with dotted channel names, since every viewer and script reads that, and scan lines rather than tiles for
//! the same reason.

use std::io::{self, Seek, Write};

use ::exr::prelude::*;

use super::{Continuation, Provenance};
use crate::engine::Picture;
use crate::render::Sums;

/// Name of the attribute that holds the resolved scene.
pub const SCENE_ATTRIBUTE: &str = "isolume.scene";
/// Name of the attribute that holds a shard's header.
pub const HEADER_ATTRIBUTE: &str = "isolume.shard";

/// Encodes a picture. There is one attribute of our own for the picture and one for its layer: the crate writes
/// several in random order, and the same render must give the same bytes. The rest goes into the standard's
/// "software" and "comments".
pub(super) fn encode(
    file: &mut (impl Write + Seek),
    picture: &Picture,
    provenance: &Provenance,
    parts: Option<Continuation<'_>>,
) -> io::Result<()> {
    let size = Vec2(picture.width as usize, picture.height as usize);
    let mut channels = channels(picture);
    if let Some(parts) = &parts {
        channels.extend(sums(parts.sums));
    }
    let channels = AnyChannels::sort(channels);
    let is_quick = parts.as_ref().is_some_and(|parts| parts.is_quick);
    let mut layer = Layer::new(
        size,
        LayerAttributes {
            software_name: Some(utf8(&provenance.software)),
            comments: Some(utf8(&format!(
                "seed {}\ndevice {}",
                provenance.seed, provenance.device
            ))),
            ..LayerAttributes::default()
        },
        if is_quick {
            Encoding::UNCOMPRESSED
        } else {
            Encoding::SMALL_LOSSLESS
        },
        channels,
    );
    if let Some(parts) = parts {
        layer.attributes.other.insert(
            utf8(HEADER_ATTRIBUTE),
            AttributeValue::Text(utf8(parts.header)),
        );
    }
    let mut image = Image::from_layer(layer);
    image.attributes.other.insert(
        utf8(SCENE_ATTRIBUTE),
        AttributeValue::Text(utf8(&provenance.scene)),
    );
    image
        .write()
        .to_buffered(file)
        .map_err(|error| match error {
            Error::Io(error) => error,
            other => io::Error::other(other),
        })
}

fn channels(picture: &Picture) -> SmallVec<[AnyChannel<FlatSamples>; 4]> {
    let layers = [
        (["R", "G", "B"], &picture.rgb),
        (["stderr.R", "stderr.G", "stderr.B"], &picture.stderr),
        (["albedo.R", "albedo.G", "albedo.B"], &picture.albedo),
        (["normal.X", "normal.Y", "normal.Z"], &picture.normal),
    ];
    let mut channels = SmallVec::new();
    for (names, pixels) in layers {
        for (component, name) in names.into_iter().enumerate() {
            let samples = pixels.iter().map(|pixel| pixel[component]).collect();
            channels.push(AnyChannel::new(name, FlatSamples::F32(samples)));
        }
    }
    channels.push(AnyChannel::new(
        "depth.Z",
        FlatSamples::F32(picture.depth.clone()),
    ));
    if let Some(alpha) = &picture.alpha {
        channels.push(AnyChannel::new("A", FlatSamples::F32(alpha.clone())));
    }
    channels
}

/// Channels for the sums behind the picture, except its mean.
fn sums(sums: &Sums) -> Vec<AnyChannel<FlatSamples>> {
    let channel = |name, samples| AnyChannel::new(name, FlatSamples::F32(samples));
    let component = |texels: &[[f32; 4]], c: usize| texels.iter().map(|texel| texel[c]).collect();
    let layer = |names: [&'static str; 4], texels: &[[f32; 4]]| {
        [0, 1, 2, 3].map(|c| channel(names[c], component(texels, c)))
    };
    let squares = ["squares.R", "squares.G", "squares.B", "squares.A"];
    let mut channels = layer(squares, &sums.squares).to_vec();
    channels.push(channel("coverage", component(&sums.mean, 3)));
    if let Some(halves) = &sums.halves {
        channels.extend(layer(
            ["halves.R", "halves.G", "halves.B", "halves.A"],
            &halves.mean,
        ));
        channels.push(channel("halves.left", halves.variance_ratio.clone()));
    }
    channels
}

/// The crate's own conversions panic beyond Latin-1, but header text is UTF-8 by custom: a scene may name its volume
/// in any script.
fn utf8(text: &str) -> Text {
    Text::from_slice_unchecked(text.as_bytes())
}
