//! A small CT as a scanner would store it, which tests change in one point or another.

#![allow(dead_code)] // The fuzzer uses less of it than the tests of formats.

use std::path::{Path, PathBuf};

use super::dicom_files::{Object, Pixels, Syntax, file};

pub const COLUMNS: usize = 16;
pub const ROWS: usize = 12;
pub const SLICES: usize = 5;

pub const CT_STORAGE: &str = "1.2.840.10008.5.1.4.1.1.2";
const ENHANCED_CT_STORAGE: &str = "1.2.840.10008.5.1.4.1.1.2.1";

/// One slice in a file of its own, or one frame of many.
#[derive(Debug, Clone)]
pub struct Slice {
    pub position: [f64; 3],
    pub words: Vec<u16>,
    pub slope: f64,
    pub intercept: f64,
    /// As its header states it.
    pub thickness: Option<f64>,
}

#[derive(Debug, Clone)]
pub struct Scan {
    pub slices: Vec<Slice>,
    pub columns: usize,
    pub orientation: [f64; 6],
    /// Between rows, and between columns.
    pub pixel_spacing: [f64; 2],
    /// Elements of all files beside those of position, size and values.
    pub common: Object,
}

/// What a slice's voxel stores: 12 bits.
pub fn stored(x: usize, y: usize, z: usize) -> u16 {
    ((x * 7 + y * 13 + z * 29 + x * y * z) * 37 % 4096) as u16
}

/// What every element that could name somebody has in it.
pub const SECRET: &str = "Zyxwvut";

fn joined(numbers: &[f64]) -> String {
    let numbers: Vec<String> = numbers.iter().map(f64::to_string).collect();
    numbers.join("\\")
}

impl Scan {
    pub fn ct() -> Scan {
        let slice = |z| {
            let places = (0..ROWS).flat_map(|y| (0..COLUMNS).map(move |x| (x, y)));
            Slice {
                position: [-10.0, -20.0, 30.0 + 2.5 * z as f64],
                words: places.map(|(x, y)| stored(x, y, z)).collect(),
                slope: 1.0,
                intercept: -1024.0,
                thickness: None,
            }
        };
        let common = Object::default()
            .text((8, 0x08), "CS", "ORIGINAL\\PRIMARY\\AXIAL")
            .text((8, 0x16), "UI", CT_STORAGE)
            .text((8, 0x60), "CS", "CT")
            .text((8, 0x103e), "LO", "Thorax 2.5")
            .text((0x20, 0x0d), "UI", "1.2.3.4")
            .text((0x20, 0x0e), "UI", "1.2.3.4.1")
            .text((0x20, 0x11), "IS", 7)
            .text((0x20, 0x12), "IS", 1)
            .word((0x28, 0x02), 1)
            .text((0x28, 0x04), "CS", "MONOCHROME2")
            .word((0x28, 0x100), 16)
            .word((0x28, 0x101), 12)
            .word((0x28, 0x102), 11)
            .word((0x28, 0x103), 0)
            .text((0x28, 0x1054), "LO", "HU");
        Scan {
            slices: (0..SLICES).map(slice).collect(),
            columns: COLUMNS,
            orientation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
            pixel_spacing: [0.75, 0.5],
            common,
        }
    }

    /// Full of names: of the patient, physicians, institutions, studies and requests.
    pub fn with_names(self) -> Scan {
        let names = [
            (0x08, 0x50, "SH"),
            (0x08, 0x80, "LO"),
            (0x08, 0x81, "ST"),
            (0x08, 0x90, "PN"),
            (0x08, 0x1010, "SH"),
            (0x08, 0x1030, "LO"),
            (0x08, 0x1048, "PN"),
            (0x08, 0x1050, "PN"),
            (0x08, 0x1070, "PN"),
            (0x10, 0x10, "PN"),
            (0x10, 0x20, "LO"),
            (0x10, 0x30, "DA"),
            (0x10, 0x1000, "LO"),
            (0x10, 0x1001, "PN"),
            (0x10, 0x1040, "LO"),
            (0x10, 0x2154, "SH"),
            (0x10, 0x4000, "LT"),
            (0x20, 0x10, "SH"),
            (0x20, 0x4000, "LT"),
            (0x32, 0x1032, "PN"),
            (0x40, 0x253, "SH"),
        ];
        let request =
            Object::default()
                .text((0x40, 0x1001), "SH", SECRET)
                .text((0x10, 0x10), "PN", SECRET);
        self.with(|common| {
            let named = names
                .into_iter()
                .fold(common, |object, (group, element, vr)| {
                    object.text((group, element), vr, format!("{SECRET}^{SECRET}"))
                });
            named.items((0x40, 0x275), vec![request])
        })
    }

    /// The same with other common elements.
    pub fn with(mut self, change: impl FnOnce(Object) -> Object) -> Scan {
        self.common = change(self.common);
        self
    }

    fn sized(&self, slice: &Slice) -> Object {
        self.common
            .clone()
            .word((0x28, 0x10), (slice.words.len() / self.columns) as u16)
            .word((0x28, 0x11), self.columns as u16)
    }

    /// One slice's header.
    pub fn header(&self, n: usize) -> Object {
        let slice = &self.slices[n];
        let mut sized = self.sized(slice);
        if let Some(thickness) = slice.thickness {
            sized = sized.text((0x18, 0x50), "DS", thickness);
        }
        sized
            .text((8, 0x18), "UI", format!("1.2.3.4.1.{}", n + 1))
            .text((0x20, 0x13), "IS", n + 1)
            .text((0x20, 0x32), "DS", joined(&slice.position))
            .text((0x20, 0x37), "DS", joined(&self.orientation))
            .text((0x28, 0x30), "DS", joined(&self.pixel_spacing))
            .text((0x28, 0x1052), "DS", slice.intercept)
            .text((0x28, 0x1053), "DS", slice.slope)
    }

    pub fn slice_file(&self, n: usize, syntax: Syntax) -> Vec<u8> {
        let words = std::slice::from_ref(&self.slices[n].words);
        file(&self.header(n), syntax, Pixels::Words(words), self.columns)
    }

    /// All slices with these names, one after the other.
    pub fn write(&self, folder: &Path, syntax: Syntax, name: impl Fn(usize) -> String) {
        for n in 0..self.slices.len() {
            let path: PathBuf = folder.join(name(n));
            std::fs::write(path, self.slice_file(n, syntax)).unwrap();
        }
    }

    /// One file with all slices, whose header is that of the first, without groups for each frame.
    pub fn multi_frame(&self, change: impl FnOnce(Object) -> Object) -> Vec<u8> {
        let frames: Vec<Vec<u16>> = self.slices.iter().map(|it| it.words.clone()).collect();
        let header = self.header(0).text((0x28, 0x08), "IS", frames.len());
        let object = change(header);
        file(
            &object,
            Syntax::Explicit,
            Pixels::Words(&frames),
            self.columns,
        )
    }

    /// The same as nuclear medicine has it, with a time slot for each `SLICES` slices.
    pub fn gated(&self) -> Vec<u8> {
        let numbered = |of: fn(usize) -> usize| -> Vec<u16> {
            let frames = 0..self.slices.len();
            frames.map(|n| of(n) as u16 + 1).collect()
        };
        let detector = Object::default()
            .text((0x20, 0x32), "DS", joined(&self.slices[0].position))
            .text((0x20, 0x37), "DS", joined(&self.orientation));
        self.multi_frame(|object| {
            object
                .without((0x20, 0x32))
                .without((0x20, 0x37))
                .text((0x18, 0x88), "DS", 2.5)
                .words((0x28, 0x09), "AT", &[0x54, 0x70, 0x54, 0x80])
                .items((0x54, 0x22), vec![detector])
                .words((0x54, 0x70), "US", &numbered(|n| n / SLICES))
                .words((0x54, 0x80), "US", &numbered(|n| n % SLICES))
        })
    }

    /// One file with all slices, as "enhanced" objects are.
    pub fn enhanced(&self, syntax: Syntax) -> Vec<u8> {
        self.enhanced_with(syntax, |_, group| group)
    }

    /// The same with other groups of each frame.
    pub fn enhanced_with(
        &self,
        syntax: Syntax,
        change: impl Fn(usize, Object) -> Object,
    ) -> Vec<u8> {
        let measures = Object::default().text((0x28, 0x30), "DS", joined(&self.pixel_spacing));
        let orientation = Object::default().text((0x20, 0x37), "DS", joined(&self.orientation));
        let shared = Object::default()
            .items((0x28, 0x9110), vec![measures])
            .items((0x20, 0x9116), vec![orientation]);
        let frame = |(n, slice): (usize, &Slice)| {
            let position = Object::default().text((0x20, 0x32), "DS", joined(&slice.position));
            let values = Object::default()
                .text((0x28, 0x1052), "DS", slice.intercept)
                .text((0x28, 0x1053), "DS", slice.slope)
                .text((0x28, 0x1054), "LO", "HU");
            let group = Object::default()
                .items((0x20, 0x9113), vec![position])
                .items((0x28, 0x9145), vec![values]);
            change(n, group)
        };
        let frames = self.slices.iter().enumerate().map(frame);
        let object = self
            .sized(&self.slices[0])
            .text((8, 0x16), "UI", ENHANCED_CT_STORAGE)
            .text((0x28, 0x08), "IS", self.slices.len())
            .items((0x5200, 0x9229), vec![shared])
            .items((0x5200, 0x9230), frames.collect());
        let words: Vec<Vec<u16>> = self
            .slices
            .iter()
            .map(|slice| slice.words.clone())
            .collect();
        file(&object, syntax, Pixels::Words(&words), self.columns)
    }
}
