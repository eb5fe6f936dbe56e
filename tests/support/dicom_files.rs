//! Writes small DICOM files, straight from the standard: elements in every transfer syntax that has no codec of its
//! own, run-length packing, and lossless JPEG.

#![allow(dead_code)] // The fuzzer uses less of it than the tests of formats.

use std::collections::BTreeMap;
use std::io::Write;

use flate2::Compression;
use flate2::write::DeflateEncoder;

pub type Tag = (u16, u16);

#[derive(Debug, Clone)]
enum Value {
    Text(String),
    Words(Vec<u16>),
    Long(u32),
    Doubles(Vec<f64>),
    Items(Vec<Object>),
}

/// Elements in the order of their tags.
#[derive(Debug, Clone, Default)]
pub struct Object(BTreeMap<Tag, (&'static str, Value)>);

impl Object {
    pub fn text(mut self, tag: Tag, vr: &'static str, text: impl ToString) -> Object {
        self.0.insert(tag, (vr, Value::Text(text.to_string())));
        self
    }

    pub fn word(mut self, tag: Tag, word: u16) -> Object {
        self.0.insert(tag, ("US", Value::Words(vec![word])));
        self
    }

    pub fn words(mut self, tag: Tag, vr: &'static str, words: &[u16]) -> Object {
        self.0.insert(tag, (vr, Value::Words(words.to_vec())));
        self
    }

    pub fn long(mut self, tag: Tag, long: u32) -> Object {
        self.0.insert(tag, ("UL", Value::Long(long)));
        self
    }

    pub fn double(self, tag: Tag, double: f64) -> Object {
        self.doubles(tag, &[double])
    }

    pub fn doubles(mut self, tag: Tag, doubles: &[f64]) -> Object {
        self.0.insert(tag, ("FD", Value::Doubles(doubles.to_vec())));
        self
    }

    pub fn items(mut self, tag: Tag, items: Vec<Object>) -> Object {
        self.0.insert(tag, ("SQ", Value::Items(items)));
        self
    }

    pub fn without(mut self, tag: Tag) -> Object {
        self.0.remove(&tag);
        self
    }

    fn encode(&self, to: Elements, bytes: &mut Vec<u8>) {
        for (tag, (vr, value)) in &self.0 {
            match value {
                Value::Text(text) => {
                    let mut text = text.clone().into_bytes();
                    if text.len() % 2 == 1 {
                        text.push(if *vr == "UI" { 0 } else { b' ' });
                    }
                    to.element(*tag, vr, text.len() as u32, bytes);
                    bytes.extend(text);
                }
                Value::Words(words) => {
                    to.element(*tag, vr, 2 * words.len() as u32, bytes);
                    words.iter().for_each(|word| bytes.extend(to.u16(*word)));
                }
                Value::Long(long) => {
                    to.element(*tag, vr, 4, bytes);
                    bytes.extend(to.u32(*long));
                }
                Value::Doubles(doubles) => {
                    to.element(*tag, vr, 8 * doubles.len() as u32, bytes);
                    for double in doubles {
                        let mut double = double.to_le_bytes();
                        if to.is_big {
                            double.reverse();
                        }
                        bytes.extend(double);
                    }
                }
                Value::Items(items) => {
                    // Without a length where types are written, and with one where they are not.
                    let mut inner = Vec::new();
                    for item in items {
                        let mut elements = Vec::new();
                        item.encode(to, &mut elements);
                        to.item(elements.len() as u32, &mut inner);
                        inner.extend(elements);
                    }
                    if to.is_explicit {
                        to.element(*tag, vr, u32::MAX, bytes);
                        bytes.extend(inner);
                        bytes.extend([to.u16(0xfffe), to.u16(0xe0dd)].concat());
                        bytes.extend(to.u32(0));
                    } else {
                        to.element(*tag, vr, inner.len() as u32, bytes);
                        bytes.extend(inner);
                    }
                }
            }
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct Elements {
    is_explicit: bool,
    is_big: bool,
}

impl Elements {
    fn u16(self, word: u16) -> [u8; 2] {
        if self.is_big {
            word.to_be_bytes()
        } else {
            word.to_le_bytes()
        }
    }

    fn u32(self, long: u32) -> [u8; 4] {
        if self.is_big {
            long.to_be_bytes()
        } else {
            long.to_le_bytes()
        }
    }

    fn element(self, tag: Tag, vr: &str, length: u32, bytes: &mut Vec<u8>) {
        bytes.extend(self.u16(tag.0));
        bytes.extend(self.u16(tag.1));
        if !self.is_explicit {
            bytes.extend(self.u32(length));
        } else if ["OB", "OW", "OF", "SQ", "UN", "UT"].contains(&vr) {
            bytes.extend(vr.as_bytes());
            bytes.extend([0, 0]);
            bytes.extend(self.u32(length));
        } else {
            bytes.extend(vr.as_bytes());
            bytes.extend(self.u16(length as u16));
        }
    }

    fn item(self, length: u32, bytes: &mut Vec<u8>) {
        bytes.extend(self.u16(0xfffe));
        bytes.extend(self.u16(0xe000));
        bytes.extend(self.u32(length));
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Syntax {
    Explicit,
    Implicit,
    BigEndian,
    Deflated,
    RunLength,
    JpegExtended,
    JpegLossless,
    Jpeg2000,
    JpegLs,
    JpegXl,
}

pub const PLAIN: [Syntax; 4] = [
    Syntax::Explicit,
    Syntax::Implicit,
    Syntax::BigEndian,
    Syntax::Deflated,
];

impl Syntax {
    fn uid(self) -> &'static str {
        match self {
            Syntax::Implicit => "1.2.840.10008.1.2",
            Syntax::Explicit => "1.2.840.10008.1.2.1",
            Syntax::Deflated => "1.2.840.10008.1.2.1.99",
            Syntax::BigEndian => "1.2.840.10008.1.2.2",
            Syntax::JpegExtended => "1.2.840.10008.1.2.4.51",
            Syntax::JpegLossless => "1.2.840.10008.1.2.4.70",
            Syntax::JpegLs => "1.2.840.10008.1.2.4.80",
            Syntax::JpegXl => "1.2.840.10008.1.2.4.110",
            Syntax::Jpeg2000 => "1.2.840.10008.1.2.4.90",
            Syntax::RunLength => "1.2.840.10008.1.2.5",
        }
    }
}

/// Pixels of 16 bits, frame by frame, or frames that are packed already.
pub enum Pixels<'a> {
    Words(&'a [Vec<u16>]),
    Packed(&'a [Vec<u8>]),
}

/// A whole file. `columns` is the frames' width.
pub fn file(object: &Object, syntax: Syntax, pixels: Pixels, columns: usize) -> Vec<u8> {
    let elements = Elements {
        is_explicit: syntax != Syntax::Implicit,
        is_big: syntax == Syntax::BigEndian,
    };
    let mut body = Vec::new();
    object.encode(elements, &mut body);
    let packed = match (&pixels, syntax) {
        (Pixels::Packed(frames), _) => Some(frames.to_vec()),
        (Pixels::Words(frames), Syntax::RunLength) => {
            Some(frames.iter().map(|frame| run_length(frame)).collect())
        }
        (Pixels::Words(frames), Syntax::JpegLossless) => Some(
            frames
                .iter()
                .map(|frame| jpeg_lossless(frame, columns))
                .collect(),
        ),
        _ => None,
    };
    match (packed, pixels) {
        (Some(frames), _) => {
            elements.element((0x7fe0, 0x10), "OB", u32::MAX, &mut body);
            elements.item(0, &mut body);
            for mut frame in frames {
                if frame.len() % 2 == 1 {
                    frame.push(0);
                }
                elements.item(frame.len() as u32, &mut body);
                body.extend(frame);
            }
            body.extend([0xfe, 0xff, 0xdd, 0xe0, 0, 0, 0, 0]);
        }
        (None, Pixels::Words(frames)) => {
            let count: usize = frames.iter().map(Vec::len).sum();
            elements.element((0x7fe0, 0x10), "OW", 2 * count as u32, &mut body);
            let words = frames.iter().flatten();
            words.for_each(|word| body.extend(elements.u16(*word)));
        }
        (None, Pixels::Packed(_)) => unreachable!("packed frames stay packed"),
    }
    if syntax == Syntax::Deflated {
        let mut encoder = DeflateEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(&body).unwrap();
        body = encoder.finish().unwrap();
    }
    let meta = Object::default().text((2, 0x10), "UI", syntax.uid());
    let mut bytes = vec![0; 128];
    bytes.extend(b"DICM");
    let plain = Elements {
        is_explicit: true,
        is_big: false,
    };
    meta.encode(plain, &mut bytes);
    bytes.extend(body);
    bytes
}

/// Part 5, annex G: first the most significant bytes, then the others, each packed by itself.
fn run_length(frame: &[u16]) -> Vec<u8> {
    let segment = |shift: u32| {
        let bytes: Vec<u8> = frame.iter().map(|word| (word >> shift) as u8).collect();
        let mut packed = Vec::new();
        let mut rest = &bytes[..];
        while let Some(first) = rest.first() {
            let same = rest
                .iter()
                .take(128)
                .take_while(|byte| *byte == first)
                .count();
            if same > 1 {
                packed.extend([(1 - same as i32) as i8 as u8, *first]);
                rest = &rest[same..];
            } else {
                let length = rest.len().min(100);
                let different = (1..length).take_while(|n| rest[n - 1] != rest[*n]).count();
                packed.push(different as u8);
                packed.extend(&rest[..=different]);
                rest = &rest[different + 1..];
            }
        }
        if packed.len() % 2 == 1 {
            packed.push(0);
        }
        packed
    };
    let segments = [segment(8), segment(0)];
    let mut bytes = vec![0; 64];
    bytes[0] = 2;
    bytes[4..8].copy_from_slice(&64u32.to_le_bytes());
    bytes[8..12].copy_from_slice(&(64 + segments[0].len() as u32).to_le_bytes());
    [bytes, segments.concat()].concat()
}

/// Process 14, first-order prediction, 16 bits: a code of 5 bits for each of the 17 sizes of a difference.
fn jpeg_lossless(frame: &[u16], columns: usize) -> Vec<u8> {
    let rows = frame.len() / columns;
    let mut bytes = vec![0xff, 0xd8];
    let [high, low] = (rows as u16).to_be_bytes();
    let [left, right] = (columns as u16).to_be_bytes();
    bytes.extend([0xff, 0xc3, 0, 11, 16, high, low, left, right, 1, 1, 0x11, 0]);
    bytes.extend([0xff, 0xc4, 0, 36, 0]);
    bytes.extend([0, 0, 0, 0, 17, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    bytes.extend(0..17);
    bytes.extend([0xff, 0xda, 0, 8, 1, 1, 0, 1, 0, 0]);
    let (mut buffer, mut filled): (u64, u32) = (0, 0);
    let mut put = |value: u32, count: u32, bytes: &mut Vec<u8>| {
        buffer = buffer << count | u64::from(value);
        filled += count;
        while filled >= 8 {
            filled -= 8;
            let byte = (buffer >> filled) as u8;
            bytes.push(byte);
            if byte == 0xff {
                bytes.push(0);
            }
        }
    };
    for (n, word) in frame.iter().enumerate() {
        let predicted = match (n % columns, n / columns) {
            (0, 0) => 1 << 15,
            (0, _) => frame[n - columns],
            _ => frame[n - 1],
        };
        let difference = word.wrapping_sub(predicted) as i16;
        let magnitude = difference.unsigned_abs();
        let size = 16 - magnitude.leading_zeros();
        put(size, 5, &mut bytes);
        if (1..16).contains(&size) {
            let code = if difference < 0 {
                (difference as i32 + (1 << size) - 1) as u32
            } else {
                difference as u32
            };
            put(code, size, &mut bytes);
        }
    }
    put(0x7f, 7, &mut bytes);
    bytes.extend([0xff, 0xd9]);
    bytes
}
