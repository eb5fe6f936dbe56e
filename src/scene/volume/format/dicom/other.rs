//! DICOM objects that are no part of a volume: objects of other kinds, localizers, pictures in colour.

use super::data_set::DataSet;
use super::frame::has_geometry;
use super::tags;

/// The reason why an object is no part of a volume.
#[derive(Debug, Clone)]
pub struct Other {
    /// One or two words for a count: "localizer".
    pub kind: &'static str,
    /// The end of a sentence for a user who has named the file: "is a localizer, expected …".
    pub why: String,
}

/// Image types of pictures with which a volume was planned, or which were made for looking at it.
const LOCALIZERS: [&str; 5] = ["LOCALIZER", "SCOUT", "SURVIEW", "REF_SURVIEW", "TOPOGRAM"];

/// Image types of pictures that hold all slices of a volume: those of Siemens, and of United Imaging.
const MOSAICS: [&str; 2] = ["MOSAIC", "VFRAME"];

const CAPTURE: &str = "secondary capture";

/// An image that says nothing of its place in the patient, where others do.
pub const UNPLACED: &str = "image without a place in the patient";

/// An image that cannot be read beside the same one that can be.
pub const UNREADABLE_COPY: &str = "copy that cannot be read";

/// Objects that hold no measured slices, by the beginning of their class's UID.
const OTHER_CLASSES: [(&str, &str); 10] = [
    ("1.2.840.10008.5.1.4.1.1.66.4", "segmentation"),
    ("1.2.840.10008.5.1.4.1.1.66.7", "segmentation"),
    ("1.2.840.10008.5.1.4.1.1.66", "registration or raw data"),
    ("1.2.840.10008.5.1.4.1.1.481.3", "structure set"),
    ("1.2.840.10008.5.1.4.1.1.481.5", "treatment plan"),
    ("1.2.840.10008.5.1.4.1.1.11", "presentation state"),
    ("1.2.840.10008.5.1.4.1.1.7", CAPTURE),
    ("1.2.840.10008.5.1.4.1.1.88", "report"),
    ("1.2.840.10008.5.1.4.1.1.104", "document"),
    ("1.2.840.10008.5.1.4.1.1.9", "waveform"),
];

/// Objects that are the slices of volumes: of CT, MR, PET and nuclear medicine, a dose, a volume of ultrasound.
const SLICE_CLASSES: [&str; 9] = [
    "1.2.840.10008.5.1.4.1.1.2",
    "1.2.840.10008.5.1.4.1.1.2.1",
    "1.2.840.10008.5.1.4.1.1.4",
    "1.2.840.10008.5.1.4.1.1.4.1",
    "1.2.840.10008.5.1.4.1.1.128",
    "1.2.840.10008.5.1.4.1.1.130",
    "1.2.840.10008.5.1.4.1.1.20",
    "1.2.840.10008.5.1.4.1.1.481.2",
    "1.2.840.10008.5.1.4.1.1.6.2",
];

pub const COLOUR_REMEDY: &str = "expected one grey value a pixel (MONOCHROME1 or MONOCHROME2)";

/// The reason why an object is no part of a volume, if its class or its type gives one.
pub fn other(data: &DataSet) -> Option<Other> {
    let class = data.text(tags::SOP_CLASS).unwrap_or_default();
    let is_of = |of: &str| match class.strip_prefix(of) {
        Some(rest) => rest.is_empty() || rest.starts_with('.'),
        None => false,
    };
    let found = OTHER_CLASSES.iter().find(|(of, _)| is_of(of));
    // Converters store volumes as captures; a picture of a screen has no place in the patient.
    let found = found.filter(|(_, kind)| *kind != CAPTURE || !has_geometry(data));
    let types = data.texts(tags::IMAGE_TYPE);
    let is_localizer = types.iter().any(|word| LOCALIZERS.contains(&word.as_str()));
    if types.iter().any(|word| MOSAICS.contains(&word.as_str())) {
        return Some(Other {
            kind: "mosaic",
            why: "is a mosaic, which has all slices side by side in one picture, expected one slice or \
                  frame for each; convert it first: `dcm2niix -z y -o OUT FOLDER`"
                .to_string(),
        });
    }
    let kind = match found {
        Some((_, kind)) => kind,
        None if is_localizer => "localizer",
        None => return None,
    };
    Some(Other {
        kind,
        why: format!("is a {kind}, expected the slices of a volume"),
    })
}

/// Whether an object without pixels has lost them. One that has no class either ends in its first lines.
pub fn should_have_pixels(data: &DataSet) -> bool {
    let class = data.text(tags::SOP_CLASS);
    class.is_none_or(|class| SLICE_CLASSES.contains(&class.as_str()))
}

/// The name of the colours of an image that is not grey, for messages.
pub fn colours(data: &DataSet) -> Option<String> {
    let photometric = data.text(tags::PHOTOMETRIC).unwrap_or_default();
    let is_grey = ["MONOCHROME1", "MONOCHROME2", ""].contains(&photometric.as_str());
    let samples = data.u16(tags::SAMPLES).unwrap_or(1);
    if is_grey && samples == 1 {
        return None;
    }
    let known: String = photometric.chars().take(16).collect();
    Some(match known.as_str() {
        "PALETTE COLOR" => "indices into a palette (PALETTE COLOR)".to_string(),
        name => format!("colours ({name}, {samples} samples a pixel)"),
    })
}
