//! OpenEXR: everything a render knows about each pixel, without loss.
//!
//! One part with dotted channel names, since every viewer and script reads that, and scan lines
//! rather than tiles for the same reason.

use std::io::{self, Seek, Write};

use ::exr::prelude::*;

use super::Provenance;
use crate::engine::Picture;

/// The scene is the only attribute of our own: the crate keeps those in random order, and the same
/// render must give the same bytes. The rest goes into the standard's "software" and "comments".
pub(super) fn encode(
    file: &mut (impl Write + Seek),
    picture: &Picture,
    provenance: &Provenance,
) -> io::Result<()> {
    let size = Vec2(picture.width as usize, picture.height as usize);
    let channels = AnyChannels::sort(channels(picture));
    let layer = Layer::new(
        size,
        LayerAttributes {
            software_name: Some(utf8(&provenance.software)),
            comments: Some(utf8(&format!(
                "seed {}\ndevice {}",
                provenance.seed, provenance.device
            ))),
            ..LayerAttributes::default()
        },
        Encoding::SMALL_LOSSLESS,
        channels,
    );
    let mut image = Image::from_layer(layer);
    image.attributes.other.insert(
        utf8("isolume.scene"),
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

/// The crate's own conversions panic beyond Latin-1, but header text is by custom UTF-8: a scene
/// may name its volume in any script.
fn utf8(text: &str) -> Text {
    Text::from_slice_unchecked(text.as_bytes())
}
