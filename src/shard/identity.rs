//! The identity of a picture: two files with the same identity hold parts of one picture.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use toml::Value;

use super::Fingerprint;
use crate::engine::Engine;
use crate::error::{Error, Result};
use crate::gpu::Shaders;
use crate::render::shared;
use crate::scene::Scene;
use crate::scene::volume::Volume;

/// Bytes of a volume that are read at a time.
const PIECE_BYTES: u64 = 16 << 20;

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// Fingerprint of the keys of the resolved scene that decide the picture, and of the texels of its sky.
    pub scene: String,
    /// Fingerprint of the stored values, in the order in which they are read, and of their meaning.
    pub volume: String,
    pub size: [u32; 2],
    pub seed: u32,
    /// The variant, with the cache's resolution.
    pub variant: String,
    /// Version of the program and fingerprint of its shaders.
    pub transport: String,
}

/// An identity with the name of its file and its resolved scene, for messages.
#[derive(Debug, Clone, Copy)]
pub struct Named<'a> {
    pub name: &'a str,
    pub identity: &'a Identity,
    pub scene: &'a str,
}

impl Identity {
    /// The identity of pictures that an engine makes of `scene`, which `text` describes. `volume` is the volume's
    /// fingerprint.
    pub fn of(engine: &Engine, scene: &Scene, text: &str, volume: &str) -> Result<Identity> {
        let mut fingerprint = Fingerprint::default();
        for (key, value) in deciding_keys(text)? {
            fingerprint.add(format!("{key} = {value}\n").as_bytes());
        }
        if let Some(sky) = &scene.lights.environment.image {
            fingerprint.add(bytemuck::cast_slice(&sky.size()));
            fingerprint.add(bytemuck::cast_slice(&sky.texels));
        }
        let shaders = Shaders::new(shared::glsl()).text()?;
        Ok(Identity {
            scene: fingerprint.text(),
            volume: volume.into(),
            size: scene.render.size,
            seed: engine.seed(),
            variant: engine.choice().plan.variant.description(),
            transport: format!(
                "{}-{}",
                env!("CARGO_PKG_VERSION"),
                Fingerprint::default().with(shaders.as_bytes()).text()
            ),
        })
    }
}

impl Named<'_> {
    /// The differences, as the end of a sentence: "the seed is 1 in a.exr and 2 in b.exr". `None` if there is
    /// none.
    pub fn difference(&self, other: &Named<'_>) -> Result<Option<String>> {
        let (a, b) = (self.identity, other.identity);
        let [first, second] = [self.name, other.name];
        let both = |what: &str, x: &str, y: &str| {
            (x != y).then(|| format!("the {what} is {x} in {first} and {y} in {second}"))
        };
        let size = |identity: &Identity| {
            let [width, height] = identity.size;
            format!("{width}x{height}")
        };
        let differences = [
            (a.volume != b.volume).then(|| {
                format!(
                    "the volume in {first} has other voxels or another spacing than in {second}, or is \
                     stored in another way"
                )
            }),
            both("size", &size(a), &size(b)),
            both("seed", &a.seed.to_string(), &b.seed.to_string()),
            both("variant", &a.variant, &b.variant),
            both("version of the program", &a.transport, &b.transport),
        ];
        let mut found: Vec<String> = differences.into_iter().flatten().collect();
        // Much of a scene follows from its volume, where it is not written.
        if a.scene != b.scene && a.volume == b.volume {
            found.extend(self.scene_difference(other, a.size != b.size)?);
        }
        Ok((!found.is_empty()).then(|| found.join(", and ")))
    }

    /// Names the first key that differs, if possible one that does not follow from others. `None` where all that differ may
    /// follow from the size.
    fn scene_difference(&self, other: &Named<'_>, has_other_size: bool) -> Result<Option<String>> {
        let [a, b] = [deciding_keys(self.scene)?, deciding_keys(other.scene)?];
        let said = |keys: &BTreeMap<String, String>, key: &str| {
            keys.get(key).cloned().unwrap_or("not set".into())
        };
        let differs = |key: &&String| a.get(*key) != b.get(*key);
        let different = a.keys().chain(b.keys()).filter(differs);
        let also = |key: &str| {
            if follows_from_others(key) {
                ", which --view and camera.view set as well,"
            } else {
                ""
            }
        };
        Ok(match different.min_by_key(|key| follows_from_others(key)) {
            Some(key) if has_other_size && follows_from_others(key) => None,
            Some(key) => Some(format!(
                "{key}{} is {} in {} and {} in {}",
                also(key),
                said(&a, key),
                self.name,
                said(&b, key),
                other.name
            )),
            None => Some(format!(
                "the sky in {} has other texels than in {}",
                self.name, other.name
            )),
        })
    }
}

/// Whether a key of a resolved scene may not have been written: where the camera is follows from the view, and from where it
/// looks, how wide, and the picture's shape.
fn follows_from_others(key: &str) -> bool {
    key.starts_with("camera.eye") || key.starts_with("camera.up")
}

/// The keys of a resolved scene that decide the picture, and their values. The volume counts by its fingerprint, the
/// sky's image by its texels, and the variant by the one that was picked.
fn deciding_keys(scene: &str) -> Result<BTreeMap<String, String>> {
    let table: toml::Table = scene
        .parse()
        .map_err(|error| Error::value(format!("not the scene of a picture: {error}")))?;
    let mut keys = BTreeMap::new();
    flatten("", &Value::Table(table), &mut keys);
    keys.retain(|key, _| {
        let is_image = key.starts_with("light.") && key.ends_with(".image");
        let is_chosen = [
            "render.size",
            "render.variant",
            "render.cache_scale",
            "render.cache_format",
            "render.exposure",
            "render.tone",
        ];
        let is_size = key.starts_with("render.size.");
        !key.starts_with("volume.") && !is_image && !is_size && !is_chosen.contains(&key.as_str())
    });
    Ok(keys)
}

fn flatten(name: &str, value: &Value, keys: &mut BTreeMap<String, String>) {
    let inner = |key: &str| match name {
        "" => key.to_string(),
        _ => format!("{name}.{key}"),
    };
    match value {
        Value::Table(table) => {
            for (key, value) in table {
                flatten(&inner(key), value, keys);
            }
        }
        Value::Array(array) => {
            for (index, value) in array.iter().enumerate() {
                flatten(&inner(&index.to_string()), value, keys);
            }
        }
        value => {
            keys.insert(name.to_string(), value.to_string());
        }
    }
}

/// Fingerprint of a volume's stored values and their meaning. It reads all voxels, in pieces that depend on how they
/// are stored: the same voxels in other chunks, or with the slices in reverse, may have another fingerprint.
///
/// # Errors
///
/// If the volume cannot be read any more.
pub fn volume_fingerprint(volume: &Volume) -> Result<String> {
    let mut fingerprint = Fingerprint::default()
        .with(bytemuck::cast_slice(&volume.dims))
        .with(bytemuck::cast_slice(&volume.spacing))
        .with(format!("{:?}", volume.stored).as_bytes())
        .with(bytemuck::cast_slice(&[volume.scale, volume.offset]));
    let mut reader = volume.reader();
    let mut bytes = Vec::new();
    for piece in volume.pieces(PIECE_BYTES) {
        bytes.resize(piece.voxels() * volume.stored.bytes(), 0);
        reader.read(piece, &mut bytes)?;
        fingerprint.add(&bytes);
    }
    Ok(fingerprint.text())
}
