//! The elements that are read, and no others: what an image is, where it lies, and what its values mean.
//!
//! No name, number or birthday of a patient, and no physician or institution is among them.

use std::fmt;

/// Group and element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Tag(pub u16, pub u16);

impl fmt::Display for Tag {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "({:04X},{:04X})", self.0, self.1)
    }
}

/// Types with a length of four bytes, in files that write types.
pub const LONG_TYPES: [&[u8; 2]; 13] = [
    b"OB", b"OD", b"OF", b"OL", b"OV", b"OW", b"SQ", b"SV", b"UC", b"UN", b"UR", b"UT", b"UV",
];

/// All types.
pub const TYPES: [[u8; 2]; 34] = [
    *b"AE", *b"AS", *b"AT", *b"CS", *b"DA", *b"DS", *b"DT", *b"FD", *b"FL", *b"IS", *b"LO", *b"LT",
    *b"OB", *b"OD", *b"OF", *b"OL", *b"OV", *b"OW", *b"PN", *b"SH", *b"SL", *b"SQ", *b"SS", *b"ST",
    *b"SV", *b"TM", *b"UC", *b"UI", *b"UL", *b"UN", *b"UR", *b"US", *b"UT", *b"UV",
];

pub const ITEM: Tag = Tag(0xfffe, 0xe000);
pub const ITEM_END: Tag = Tag(0xfffe, 0xe00d);
pub const SEQUENCE_END: Tag = Tag(0xfffe, 0xe0dd);

pub const FLOAT_PIXELS: Tag = Tag(0x7fe0, 0x0008);
pub const DOUBLE_PIXELS: Tag = Tag(0x7fe0, 0x0009);
/// Tags of the pixels; everything before them is the header.
pub const PIXELS: [Tag; 3] = [FLOAT_PIXELS, DOUBLE_PIXELS, Tag(0x7fe0, 0x0010)];

macro_rules! tags {
    ($($name:ident = ($group:literal, $element:literal)),* $(,)?) => {
        $(pub const $name: Tag = Tag($group, $element);)*
        const KEPT: &[Tag] = &[$($name),*];
    };
}

tags! {
    TRANSFER_SYNTAX = (0x0002, 0x0010),
    DIRECTORY_RECORDS = (0x0004, 0x1220),
    REFERENCED_FILE = (0x0004, 0x1500),
    CHARACTER_SET = (0x0008, 0x0005),
    IMAGE_TYPE = (0x0008, 0x0008),
    SOP_CLASS = (0x0008, 0x0016),
    ACQUISITION_DATE = (0x0008, 0x0022),
    ACQUISITION_DATE_TIME = (0x0008, 0x002a),
    ACQUISITION_TIME = (0x0008, 0x0032),
    MODALITY = (0x0008, 0x0060),
    SERIES_DESCRIPTION = (0x0008, 0x103e),
    FRAME_TYPE = (0x0008, 0x9007),
    SLICE_THICKNESS = (0x0018, 0x0050),
    ECHO_TIME = (0x0018, 0x0081),
    INVERSION_TIME = (0x0018, 0x0082),
    ECHO = (0x0018, 0x0086),
    SLICE_SPACING = (0x0018, 0x0088),
    TRIGGER_TIME = (0x0018, 0x1060),
    FLIP_ANGLE = (0x0018, 0x1314),
    FRAME_ACQUISITION_TIME = (0x0018, 0x9074),
    INVERSION_TIMES = (0x0018, 0x9079),
    EFFECTIVE_ECHO_TIME = (0x0018, 0x9082),
    B_VALUE = (0x0018, 0x9087),
    MR_TIMING = (0x0018, 0x9112),
    MR_ECHO = (0x0018, 0x9114),
    MR_MODIFIER = (0x0018, 0x9115),
    MR_DIFFUSION = (0x0018, 0x9117),
    CARDIAC_SYNCHRONIZATION = (0x0018, 0x9118),
    MR_FRAME_TYPE = (0x0018, 0x9226),
    CT_FRAME_TYPE = (0x0018, 0x9329),
    SERIES_UID = (0x0020, 0x000e),
    SERIES_NUMBER = (0x0020, 0x0011),
    ACQUISITION = (0x0020, 0x0012),
    INSTANCE = (0x0020, 0x0013),
    POSITION = (0x0020, 0x0032),
    ORIENTATION = (0x0020, 0x0037),
    TEMPORAL_POSITION = (0x0020, 0x0100),
    STACK = (0x0020, 0x9056),
    FRAME_CONTENT = (0x0020, 0x9111),
    PLANE_POSITION = (0x0020, 0x9113),
    PLANE_ORIENTATION = (0x0020, 0x9116),
    TEMPORAL_INDEX = (0x0020, 0x9128),
    TRIGGER_DELAY = (0x0020, 0x9153),
    FRAME_ACQUISITION = (0x0020, 0x9156),
    VOLUME_POSITION = (0x0020, 0x9301),
    VOLUME_ORIENTATION = (0x0020, 0x9302),
    PLANE_VOLUME_POSITION = (0x0020, 0x930e),
    PLANE_VOLUME_ORIENTATION = (0x0020, 0x930f),
    SAMPLES = (0x0028, 0x0002),
    PHOTOMETRIC = (0x0028, 0x0004),
    FRAMES = (0x0028, 0x0008),
    FRAME_INCREMENT = (0x0028, 0x0009),
    ROWS = (0x0028, 0x0010),
    COLUMNS = (0x0028, 0x0011),
    PIXEL_SPACING = (0x0028, 0x0030),
    BITS_ALLOCATED = (0x0028, 0x0100),
    BITS_STORED = (0x0028, 0x0101),
    HIGH_BIT = (0x0028, 0x0102),
    PIXEL_REPRESENTATION = (0x0028, 0x0103),
    PADDING = (0x0028, 0x0120),
    PADDING_LIMIT = (0x0028, 0x0121),
    INTERCEPT = (0x0028, 0x1052),
    SLOPE = (0x0028, 0x1053),
    RESCALE_TYPE = (0x0028, 0x1054),
    VALUE_TABLE = (0x0028, 0x3000),
    PIXEL_MEASURES = (0x0028, 0x9110),
    VALUE_TRANSFORMATION = (0x0028, 0x9145),
    ENERGY_WINDOW_VECTOR = (0x0054, 0x0010),
    DETECTOR_VECTOR = (0x0054, 0x0020),
    DETECTORS = (0x0054, 0x0022),
    PHASE_VECTOR = (0x0054, 0x0030),
    ROTATION_VECTOR = (0x0054, 0x0050),
    RR_INTERVAL_VECTOR = (0x0054, 0x0060),
    TIME_SLOT_VECTOR = (0x0054, 0x0070),
    SLICE_VECTOR = (0x0054, 0x0080),
    ANGULAR_VIEW_VECTOR = (0x0054, 0x0090),
    TIME_SLICE_VECTOR = (0x0054, 0x0100),
    UNITS = (0x0054, 0x1001),
    DOSE_UNITS = (0x3004, 0x0002),
    FRAME_OFFSETS = (0x3004, 0x000c),
    DOSE_SCALE = (0x3004, 0x000e),
    SHARED_GROUPS = (0x5200, 0x9229),
    FRAME_GROUPS = (0x5200, 0x9230),
    OFFSET_TABLE = (0x7fe0, 0x0001),
}

/// Numbers of each frame that distinguish frames at one place, in nuclear medicine.
pub const VECTORS: [Tag; 8] = [
    ENERGY_WINDOW_VECTOR,
    DETECTOR_VECTOR,
    PHASE_VECTOR,
    ROTATION_VECTOR,
    RR_INTERVAL_VECTOR,
    TIME_SLOT_VECTOR,
    ANGULAR_VIEW_VECTOR,
    TIME_SLICE_VECTOR,
];

/// Tags of sequences, for files that do not write types.
const SEQUENCES: [Tag; 19] = [
    DIRECTORY_RECORDS,
    MR_TIMING,
    MR_ECHO,
    MR_MODIFIER,
    MR_DIFFUSION,
    CARDIAC_SYNCHRONIZATION,
    MR_FRAME_TYPE,
    CT_FRAME_TYPE,
    FRAME_CONTENT,
    PLANE_POSITION,
    PLANE_ORIENTATION,
    PLANE_VOLUME_POSITION,
    PLANE_VOLUME_ORIENTATION,
    VALUE_TABLE,
    PIXEL_MEASURES,
    VALUE_TRANSFORMATION,
    DETECTORS,
    SHARED_GROUPS,
    FRAME_GROUPS,
];

pub fn is_kept(tag: Tag) -> bool {
    KEPT.contains(&tag)
}

pub fn is_sequence(tag: Tag) -> bool {
    SEQUENCES.contains(&tag)
}
