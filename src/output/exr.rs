//! OpenEXR: all that a render knows about each pixel, without loss.
//!
//! One part with dotted channel names, since every viewer and script reads that, and scan lines rather than tiles for
//! the same reason.

use std::io::{self, Seek, Write};
use std::path::Path;

use ::exr::block::lines::LineRefMut;
use ::exr::image::write::samples::{SamplesWriter, WritableSamples};
use ::exr::math::RoundingMode;
use ::exr::meta::attribute::{LevelMode, SampleType};
use ::exr::meta::header::Header;
use ::exr::prelude::*;

use super::{Continuation, Provenance, channels};
use crate::decoding::exr_meta_data;
use crate::engine::Picture;
use crate::render::Sums;

/// Name of the attribute that holds the resolved scene.
pub const SCENE_ATTRIBUTE: &str = "isolume.scene";
/// Name of the attribute that holds a shard's header.
pub const HEADER_ATTRIBUTE: &str = "isolume.shard";

/// The seed of a picture that this program has rendered; `None` for any other.
pub fn seed_of(path: &Path) -> Option<u32> {
    let meta = exr_meta_data(path).ok()?;
    let own = &meta.headers.first()?.own_attributes;
    let is_ours = own
        .software_name
        .as_ref()?
        .to_string()
        .starts_with("isolume ");
    let comments = own.comments.as_ref()?.to_string();
    let seed = comments.lines().next()?.strip_prefix("seed ")?;
    seed.parse().ok().filter(|_| is_ours)
}

/// Encodes a picture. There is one attribute of our own for the picture and one for its layer: the crate writes
/// several in random order, and the same render must give the same bytes. The rest goes into the standard's
/// "software" and "comments".
pub(super) fn encode(
    file: &mut (impl Write + Seek),
    picture: &Picture,
    provenance: &Provenance,
    continuation: Option<Continuation<'_>>,
) -> io::Result<()> {
    let size = Vec2(picture.width as usize, picture.height as usize);
    let mut channels = layers(picture);
    if let Some(continuation) = &continuation {
        channels.extend(sums(continuation.sums, picture));
    }
    let channels = AnyChannels::sort(channels);
    let is_quick = continuation.as_ref().is_some_and(|c| c.is_quick);
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
    if let Some(continuation) = continuation {
        layer.attributes.other.insert(
            utf8(HEADER_ATTRIBUTE),
            AttributeValue::Text(utf8(&continuation.header)),
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

fn layers(picture: &Picture) -> SmallVec<[AnyChannel<Component<'_>>; 4]> {
    let layers = [
        (channels::RGB, &picture.rgb),
        (channels::STDERR, &picture.stderr),
        (channels::ALBEDO, &picture.albedo),
        (channels::NORMAL, &picture.normal),
    ];
    let mut all = SmallVec::new();
    for (names, pixels) in layers {
        all.extend(layer(names, pixels));
    }
    let depth = Component::alone(&picture.depth);
    all.push(AnyChannel::new(channels::DEPTH, depth));
    if let Some(alpha) = &picture.alpha {
        all.push(AnyChannel::new(channels::ALPHA, Component::alone(alpha)));
    }
    all
}

/// Channels for the sums behind the picture, except what the picture holds already.
fn sums<'a>(sums: &'a Sums, picture: &Picture) -> Vec<AnyChannel<Component<'a>>> {
    let mut all = layer(channels::SQUARES, &sums.squares).to_vec();
    if !is_shown(&sums.mean, picture) {
        all.extend(
            channels::MEAN
                .into_iter()
                .enumerate()
                .map(|(c, name)| AnyChannel::new(name, Component::of(&sums.mean, c))),
        );
    }
    let coverage = Component::of(&sums.mean, 3);
    all.push(AnyChannel::new(channels::COVERAGE, coverage));
    if let Some(halves) = &sums.halves {
        all.extend(layer(channels::HALVES, &halves.mean));
        let ratio = Component::alone(&halves.variance_ratio);
        all.push(AnyChannel::new(channels::VARIANCE_RATIO, ratio));
    }
    all
}

/// Whether the picture is this mean, to the last bit.
fn is_shown(mean: &[[f32; 4]], picture: &Picture) -> bool {
    let pairs = mean.iter().zip(&picture.rgb);
    let mut components = pairs.flat_map(|(mean, rgb)| mean.iter().zip(rgb));
    components.all(|(mean, shown)| mean.to_bits() == shown.to_bits())
}

/// A channel for each component of these texels.
fn layer<'a, const N: usize>(
    names: [&'static str; N],
    texels: &'a [[f32; N]],
) -> [AnyChannel<Component<'a>>; N] {
    std::array::from_fn(|c| AnyChannel::new(names[c], Component::of(texels, c)))
}

/// One component of all texels, where it lies: every `stride`-th of these numbers, from the first. A copy of each would take
/// as much of the host's memory as the whole picture.
#[derive(Clone)]
struct Component<'a> {
    numbers: &'a [f32],
    stride: usize,
}

impl<'a> Component<'a> {
    fn of<const N: usize>(texels: &'a [[f32; N]], component: usize) -> Self {
        Component {
            numbers: &texels.as_flattened()[component..],
            stride: N,
        }
    }

    fn alone(numbers: &'a [f32]) -> Self {
        Component { numbers, stride: 1 }
    }
}

/// Writes a component line by line.
struct Lines<'a> {
    component: Component<'a>,
    width: usize,
}

impl<'a> WritableSamples<'_> for Component<'a> {
    type Writer = Lines<'a>;

    fn sample_type(&self) -> SampleType {
        SampleType::F32
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_samples_writer(&self, header: &Header) -> Lines<'a> {
        Lines {
            component: self.clone(),
            width: header.layer_size.width(),
        }
    }
}

impl SamplesWriter for Lines<'_> {
    fn extract_line(&self, line: LineRefMut<'_>) {
        let Component { numbers, stride } = self.component;
        let first = line.location.position.y() * self.width + line.location.position.x();
        line.write_samples(|sample| numbers[(first + sample) * stride])
            .expect("a line has room for its samples");
    }
}

/// The crate's own conversions panic beyond Latin-1, but header text is UTF-8 by custom: a scene may name its volume
/// in any script.
fn utf8(text: &str) -> Text {
    Text::from_slice_unchecked(text.as_bytes())
}
