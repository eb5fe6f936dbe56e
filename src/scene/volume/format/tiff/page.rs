//! One page: how its pixels are cut into strips or tiles, and how those are decoded.

use std::sync::Arc;

use super::directory::{Directories, Directory, Tag, within};
use super::predictor::Predictor;
use crate::scene::volume::parsed::{Parsed, unexpected};
use crate::scene::volume::source::codec::Codec;
use crate::scene::volume::source::watched::WatchedFile;
use crate::scene::volume::voxel_type::{Endian, VoxelType};

/// The most values of a pixel: the tag has 16 bits, although a file may spend more on it.
const MOST_SAMPLES: u32 = 65535;

/// The properties that all pages of one stack share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layout {
    /// Pixels along x and y.
    pub size: [u32; 2],
    pub voxel_type: VoxelType,
    pub endian: Endian,
    /// Values of a pixel.
    pub samples: u32,
    /// Whether samples lie one after another, each in strips or tiles of its own.
    is_planar: bool,
    /// Pixels of a strip or a tile.
    pub chunk: [u32; 2],
    pub is_tiled: bool,
    pub codec: Codec,
    predictor: Predictor,
    /// Whether a pixel's values, each by itself, are shades of grey.
    pub is_grey: bool,
    /// Whether small values are displayed bright.
    pub is_white_zero: bool,
    /// Whether values are displayed in the colours of a palette.
    pub has_palette: bool,
    /// Whether pictures are displayed turned or mirrored.
    pub is_turned: bool,
}

#[derive(Debug, Clone)]
pub struct Page {
    pub layout: Layout,
    pub file: Arc<WatchedFile>,
    /// Offset and length in the file of each strip or tile.
    chunks: Vec<(u64, u64)>,
}

impl Page {
    pub fn new(
        file: &Arc<WatchedFile>,
        directories: &Directories,
        directory: &Directory,
    ) -> Parsed<Page> {
        let number = |tag| directories.number(directory, tag);
        let size = directories.size(directory)?;
        match number(Tag::ImageDepth)? {
            None | Some(1) => {}
            Some(depth) => {
                let expected = "1: a page for each slice";
                return Err(unexpected("ImageDepth", &depth.to_string(), expected));
            }
        }
        if number(Tag::FillOrder)? == Some(2) {
            let expected = "1; in each byte, the lowest bit comes first: reverse the bits with `tiffcp -f msb2lsb OLD NEW`";
            return Err(unexpected("FillOrder", "2", expected));
        }
        let tiles = directories.numbers(directory, Tag::TileOffsets)?;
        let is_tiled = tiles.is_some();
        let chunk = if is_tiled {
            directories.sides(directory, [Tag::TileWidth, Tag::TileLength])?
        } else {
            let rows = number(Tag::RowsPerStrip)?.unwrap_or(u64::from(size[1]));
            let rows = rows.min(u64::from(size[1]));
            [size[0], within(Tag::RowsPerStrip, rows, u32::MAX)?]
        };
        let samples = number(Tag::SamplesPerPixel)?.unwrap_or(1);
        let samples = within(Tag::SamplesPerPixel, samples, MOST_SAMPLES)?;
        let shades = number(Tag::PhotometricInterpretation)?;
        let layout = Layout {
            size,
            voxel_type: voxel_type(directories, directory, samples)?,
            endian: directories.endian,
            samples,
            is_planar: samples > 1 && number(Tag::PlanarConfiguration)? == Some(2),
            chunk,
            is_tiled,
            codec: codec(number(Tag::Compression)?.unwrap_or(1))?,
            predictor: Predictor::of_number(number(Tag::Predictor)?.unwrap_or(1))?,
            is_grey: matches!(shades, None | Some(0 | 1)),
            is_white_zero: shades == Some(0),
            has_palette: shades == Some(3),
            is_turned: number(Tag::Orientation)?.is_some_and(|orientation| orientation != 1),
        };
        layout.check()?;
        Ok(Page {
            layout,
            file: file.clone(),
            chunks: places(directories, directory, tiles, &layout)?,
        })
    }

    pub fn chunks(&self) -> usize {
        self.chunks.len()
    }

    pub fn packed_bytes(&self) -> u64 {
        let counts = self.chunks.iter().map(|(_, count)| *count);
        counts.fold(0, u64::saturating_add)
    }

    /// The same page, `distance` bytes later in the file.
    pub fn moved(&self, distance: u64) -> Page {
        let moved = |(offset, count): &(u64, u64)| (offset.saturating_add(distance), *count);
        Page {
            chunks: self.chunks.iter().map(moved).collect(),
            ..self.clone()
        }
    }

    /// Offset of the pixels, if they lie plainly, row by row, in one place of the file.
    pub fn plain_run(&self) -> Option<u64> {
        let layout = &self.layout;
        let is_plain = layout.codec == Codec::Plain
            && layout.predictor == Predictor::None
            && layout.samples == 1
            && !layout.is_tiled;
        let first = self.chunks.first()?.0;
        let strip = layout.row_bytes() * u64::from(layout.chunk[1]);
        let follows = |(n, (offset, _)): (usize, &(u64, u64))| {
            Some(*offset)
                == (n as u64)
                    .checked_mul(strip)
                    .and_then(|d| d.checked_add(first))
        };
        (is_plain && self.chunks.iter().enumerate().all(follows)).then_some(first)
    }

    /// One sample of the pixels of the strip or tile at this column and row.
    pub fn decode(&self, [column, row]: [u32; 2], sample: u32) -> Parsed<Vec<u8>> {
        let layout = &self.layout;
        let [across, down] = layout.grid();
        let plane = if layout.is_planar { sample } else { 0 };
        let at = (u64::from(plane) * u64::from(down) + u64::from(row)) * u64::from(across);
        let (offset, packed) = self.chunks[(at + u64::from(column)) as usize];
        let rows = if layout.is_tiled {
            layout.chunk[1]
        } else {
            layout.chunk[1].min(layout.size[1] - row * layout.chunk[1])
        };
        let expected = layout.chunk_row_bytes() * u64::from(rows);
        let count = match layout.codec {
            Codec::Plain => expected,
            _ => packed,
        };
        let packed = self.file.read(offset, count)?;
        let mut pixels = layout.codec.decode(packed, expected as usize)?;
        let rows = pixels.chunks_exact_mut(layout.chunk_row_bytes() as usize);
        let samples = layout.samples_in_chunk() as usize;
        for row in rows {
            layout
                .predictor
                .undo(row, layout.voxel_type.bytes(), samples, layout.endian);
        }
        Ok(match layout.samples_in_chunk() {
            1 => pixels,
            samples => {
                let bytes = layout.voxel_type.bytes();
                let pixels = pixels.chunks_exact(samples as usize * bytes);
                let samples = pixels.map(|pixel| &pixel[sample as usize * bytes..][..bytes]);
                samples.flatten().copied().collect()
            }
        })
    }

    /// One sample of all pixels.
    pub fn decode_whole(&self, sample: u32) -> Parsed<Vec<u8>> {
        let layout = &self.layout;
        let bytes = layout.voxel_type.bytes();
        let [width, height] = layout.size.map(|size| size as usize);
        let [across, down] = layout.grid();
        let mut rows: Vec<Vec<u8>> = Vec::new();
        for row in 0..down {
            let begin = rows.len();
            let end = height.min(begin + layout.chunk[1] as usize);
            rows.resize(end, Vec::new());
            for column in 0..across {
                let pixels = self.decode([column, row], sample)?;
                let chunk_row = layout.chunk[0] as usize * bytes;
                for (whole, part) in rows[begin..].iter_mut().zip(pixels.chunks(chunk_row)) {
                    let wanted = part.len().min(width * bytes - whole.len());
                    whole.extend_from_slice(&part[..wanted]);
                }
            }
        }
        Ok(rows.concat())
    }
}

/// Offset and length in the file of each strip, or of each tile, of which `tiles` are the offsets.
fn places(
    directories: &Directories,
    directory: &Directory,
    tiles: Option<Vec<u64>>,
    layout: &Layout,
) -> Parsed<Vec<(u64, u64)>> {
    let offsets = match tiles {
        Some(offsets) => Some(offsets),
        None => directories.numbers(directory, Tag::StripOffsets)?,
    };
    let lengths = if layout.is_tiled {
        Tag::TileByteCounts
    } else {
        Tag::StripByteCounts
    };
    let offsets = offsets.ok_or("has neither `StripOffsets` nor `TileOffsets`")?;
    let lengths = directories.first_numbers(directory, lengths, offsets.len() as u64 + 1)?;
    // Without compression it is known how long they are, and some programs write nothing or nonsense.
    let lengths = match (lengths, layout.codec) {
        (Some(lengths), _) if lengths.len() == offsets.len() => lengths,
        (_, Codec::Plain) => vec![0; offsets.len()],
        _ => return Err("does not say how long its strips or tiles are".into()),
    };
    let expected = layout.chunks();
    if offsets.len() as u64 != expected {
        let [width, height] = layout.size;
        return Err(format!(
            "has {} strips or tiles, expected {expected} for {width}×{height} pixels",
            offsets.len(),
        ));
    }
    // GDAL leaves out strips and tiles of zeros if it is told to; few readers know that.
    if offsets.contains(&0) {
        return Err(
            "is sparse: it has no data for a strip or tile, expected data for each; `gdal_translate -co SPARSE_OK=FALSE` \
             writes such a file"
                .into(),
        );
    }
    Ok(offsets.into_iter().zip(lengths).collect())
}

impl Layout {
    /// Refuses sizes that no contents of the file could justify, so that they can be multiplied later without
    /// overflow.
    fn check(&self) -> Parsed<()> {
        let product = |[width, height]: [u32; 2]| {
            let bytes = u64::from(self.samples) * self.voxel_type.bytes() as u64;
            (u64::from(width) * u64::from(height)).checked_mul(bytes)
        };
        let fits = |bytes: Option<u64>| bytes.is_some_and(|bytes| bytes < 1 << 48);
        if !fits(product(self.size)) || !fits(product(self.chunk)) {
            return Err(format!(
                "is {}×{} pixels in strips or tiles of {}×{}, which is more than any file holds",
                self.size[0], self.size[1], self.chunk[0], self.chunk[1]
            ));
        }
        if self.predictor == Predictor::Float && !self.voxel_type.is_float() {
            return Err(format!(
                "`Predictor` is 3, which is for floating-point numbers, but its pixels are {}",
                self.voxel_type
            ));
        }
        Ok(())
    }

    /// Strips or tiles across and down.
    fn grid(&self) -> [u32; 2] {
        [0, 1].map(|a| self.size[a].div_ceil(self.chunk[a]))
    }

    fn chunks(&self) -> u64 {
        let [across, down] = self.grid();
        let planes = if self.is_planar { self.samples } else { 1 };
        u64::from(across) * u64::from(down) * u64::from(planes)
    }

    fn samples_in_chunk(&self) -> u32 {
        if self.is_planar { 1 } else { self.samples }
    }

    fn chunk_row_bytes(&self) -> u64 {
        let pixel = self.samples_in_chunk() as usize * self.voxel_type.bytes();
        u64::from(self.chunk[0]) * pixel as u64
    }

    /// Bytes of a row of one sample.
    fn row_bytes(&self) -> u64 {
        u64::from(self.size[0]) * self.voxel_type.bytes() as u64
    }

    /// Bytes of a page with all its samples.
    pub fn page_bytes(&self) -> u64 {
        self.row_bytes() * u64::from(self.size[1]) * u64::from(self.samples)
    }
}

fn voxel_type(directories: &Directories, directory: &Directory, samples: u32) -> Parsed<VoxelType> {
    let of_samples = |tag| directories.first_numbers(directory, tag, samples.into());
    let bits = of_samples(Tag::BitsPerSample)?;
    let bits = bits.filter(|bits| !bits.is_empty()).unwrap_or(vec![1]);
    let formats = of_samples(Tag::SampleFormat)?;
    let formats = formats
        .filter(|formats| !formats.is_empty())
        .unwrap_or(vec![1]);
    let is_even = |numbers: &[u64]| numbers.iter().all(|number| *number == numbers[0]);
    if !is_even(&bits) || !is_even(&formats) {
        return Err(
            "its pixels have values of several types, expected one; write it again with one type for all".into(),
        );
    }
    let known = u32::try_from(bits[0])
        .ok()
        .and_then(|bits| match formats[0] {
            1 | 4 => VoxelType::integer(bits, false),
            2 => VoxelType::integer(bits, true),
            3 => VoxelType::float(bits),
            _ => None,
        });
    known.ok_or_else(|| {
        let kind = match formats[0] {
            1 | 4 => "unsigned integers",
            2 => "signed integers",
            3 => "floating-point numbers",
            _ => "complex or unknown numbers",
        };
        format!(
            "its pixels are {kind} of {} bits, expected integers of 8, 16, 32 or 64 bits or \
             floating-point numbers of 16, 32 or 64",
            bits[0]
        )
    })
}

fn codec(number: u64) -> Parsed<Codec> {
    let name = match number {
        1 => return Ok(Codec::Plain),
        5 => return Ok(Codec::Lzw),
        8 | 32946 => return Ok(Codec::Zlib),
        32773 => return Ok(Codec::PackBits),
        50000 => return Ok(Codec::Zstd),
        6 | 7 => "JPEG",
        33003 | 33004 | 33005 | 34712 => "JPEG 2000",
        34887 => "LERC",
        34925 => "LZMA",
        50001 | 34927 => "WebP",
        2..=4 => "fax",
        _ => "an unknown method",
    };
    Err(format!(
        "is compressed with {name} ({number}), expected none, LZW, deflate, PackBits or zstd; write it again \
         with one of these"
    ))
}
