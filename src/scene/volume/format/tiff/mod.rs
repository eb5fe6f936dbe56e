//! TIFF: a file of pages, or a folder of numbered files with a page each.
//! <https://www.awaresystems.be/imaging/tiff/specification/TIFF6.pdf>, BigTIFF:
//! <https://www.awaresystems.be/imaging/tiff/bigtiff.html>
//!
//! Each page is a slice, and its first row is y = 0. Programs for microscopes put more than a stack into a file, and
//! describe the pages in the first page's description ([`imagej`], [`ome`], [`shaped`]). No file says where a slice is in a body:
//! the axes stay unknown.
//!
//! Strips and tiles are decoded one by one, by all cores at once; pixels that lie plainly one after another are read
//! like those of any other format.

mod directory;
mod folder;
mod imagej;
mod meaning;
mod ome;
mod page;
mod pages;
mod predictor;
mod shaped;
mod voxel_size;

use std::path::Path;
use std::sync::Arc;

use directory::{Directories, Directory, Tag};
use meaning::Meaning;
use page::{Layout, Page};
use pages::{Pages, named};

pub use folder::{is_page, read_folder};

use super::header::Header;
use super::several::pick;
use crate::scene::volume::Source;
use crate::scene::volume::orientation::Orientation;
use crate::scene::volume::overrides::VolumeOverrides;
use crate::scene::volume::parsed::{Keyed, Parsed};
use crate::scene::volume::source::chunked::Chunked;
use crate::scene::volume::source::codec::{Codec, LARGEST_RATIO};
use crate::scene::volume::source::file::{Data, Encoding, Part, Start, shape, voxel_bytes};
use crate::scene::volume::source::watched::WatchedFile;
use crate::scene::volume::storage::{Level, Storage};

pub fn read(path: &Path, overrides: &VolumeOverrides) -> Keyed<Header> {
    let file = Arc::new(WatchedFile::open(path)?);
    let directories = Directories::new(&file)?;
    let full = directories.full_pages()?;
    let first = full.first().ok_or("has no page in full resolution")?;
    let description = directories.text(first, Tag::ImageDescription)?;
    let level = overrides.level.unwrap_or(0);
    let coarser = directories.coarser(first)?;
    let page = |n: usize| {
        let page = directories
            .at_level(&full[n], level)
            .and_then(|directory| match directory {
                None => Page::new(&file, &directories, &full[n]),
                Some(directory) => Page::new(&file, &directories, &directory),
            });
        page.map_err(|fault| match full.len() {
            1 => fault,
            count => format!("page {} of {count}: {fault}", n + 1),
        })
    };
    pick("level", overrides.level, coarser.len() as u32 + 1)?;
    let first_page = page(0)?;
    let images = images_of(&description, &first_page.layout)?;
    let is_one_block = full.len() == 1 && images > 1 && first_page.layout.codec == Codec::Plain;
    let count = if is_one_block {
        check_block(&file, &first_page.layout, images)?;
        images as usize
    } else {
        full.len()
    };
    let meaning = meaning_of(&description, &directories, first, count, &first_page.layout)?;
    let page_bytes = first_page.layout.page_bytes();
    let pages = |n: usize| {
        if is_one_block {
            Ok(first_page.moved(n as u64 * page_bytes))
        } else {
            page(n)
        }
    };
    let mut levels = vec![directories.size(first)?];
    for at in coarser {
        levels.push(directories.size(&directories.read(at)?)?);
    }
    stack(path, meaning, levels, overrides, pages)
}

/// How many images the first page's description speaks of, all of which may lie behind that page.
fn images_of(description: &str, layout: &Layout) -> Parsed<u64> {
    if description.starts_with(imagej::START) {
        imagej::images(description)
    } else {
        Ok(shaped::images(description, layout))
    }
}

/// What the first page's description says of so many pages.
fn meaning_of(
    description: &str,
    directories: &Directories<'_>,
    first: &Directory,
    pages: usize,
    layout: &Layout,
) -> Parsed<Meaning> {
    if description.starts_with(imagej::START) {
        imagej_meaning(description, directories, first, pages, layout)
    } else if ome::is_ome(description) {
        ome::meaning(description, ome::Pages::OfOneFile(pages), layout.samples)
    } else {
        Ok(shaped::meaning(description, pages, layout.samples))
    }
}

/// Fails where the file is shorter than so many images that follow one another.
fn check_block(file: &WatchedFile, layout: &Layout, images: u64) -> Parsed<()> {
    let bytes = layout.page_bytes().checked_mul(images);
    if bytes.is_some_and(|bytes| bytes <= file.bytes()) {
        return Ok(());
    }
    Err(format!(
        "its {} bytes cannot hold the {images} images that its description speaks of: the file is truncated",
        file.bytes()
    ))
}

/// What ImageJ says of pages, in the description of the first of them.
fn imagej_meaning(
    description: &str,
    directories: &Directories<'_>,
    first: &Directory,
    pages: usize,
    layout: &Layout,
) -> Parsed<Meaning> {
    let resolution = [Tag::XResolution, Tag::YResolution];
    let [x, y] = resolution.map(|tag| directories.fraction(first, tag));
    let resolution = imagej::Resolution {
        pixels: [x?, y?],
        unit: directories.number(first, Tag::ResolutionUnit)?,
    };
    imagej::meaning(description, pages, layout, &resolution)
}

impl Directories<'_> {
    /// The directory of a page's coarser copy; `None` for the page itself.
    fn at_level(&self, directory: &Directory, level: u32) -> Parsed<Option<Directory>> {
        if level == 0 {
            return Ok(None);
        }
        match self.coarser(directory)?.get(level as usize - 1) {
            Some(at) => self.read(*at).map(Some),
            None => Err(format!("has no level {level}")),
        }
    }
}

/// The volume of one channel at one time.
fn stack(
    path: &Path,
    meaning: Meaning,
    sizes: Vec<[u32; 2]>,
    overrides: &VolumeOverrides,
    page: impl Fn(usize) -> Parsed<Page>,
) -> Keyed<Header> {
    let channel = pick("channel", overrides.channel, meaning.channels)?;
    let time = pick("time", overrides.time, meaning.times)?;
    let level = pick("level", overrides.level, sizes.len() as u32)?;
    let pages = pages_of(&meaning, channel, time, page)?;
    let layout = pages[0].layout;
    if overrides.channel.is_none() {
        check_grey(&layout)?;
    }
    let dims = [layout.size[0], layout.size[1], pages.len() as u32];
    check_promise(&pages, layout, dims)?;
    let levels = levels(&meaning, &sizes);
    let of_size = meaning
        .size
        .told(dims)
        .filter(|_| overrides.spacing.is_none());
    let spacing = levels[level as usize].spacing;
    let storage = Storage {
        compression: (layout.codec != Codec::Plain).then(|| layout.codec.name().to_string()),
        unit: meaning.size.unit,
        channels: meaning.channels,
        channel_names: meaning.names,
        times: meaning.times,
        levels,
        channel: Some(channel),
        time: Some(time),
        level: Some(level),
        ..Storage::default()
    };
    let source = source(path, pages, dims, channel % meaning.samples)?;
    let mut notes = [storage.notes(), meaning.notes].concat();
    notes.extend(of_size);
    notes.extend(unheeded(&layout));
    Ok(Header {
        geometry: Ok((spacing, Orientation::UNKNOWN)),
        slope: meaning.slope,
        intercept: meaning.intercept,
        storage,
        notes,
        ..Header::of_source(source, dims, layout.voxel_type, layout.endian)
    })
}

/// Fails for pixels in colour.
fn check_grey(layout: &Layout) -> Parsed<()> {
    if layout.samples > 1 && !layout.is_grey {
        return Err(format!(
            "is in colour: its pixels have {} values, expected 1; pick one with `--set \
             volume.channel=0`",
            layout.samples
        ));
    }
    Ok(())
}

/// What is said of how the file wants its values to be shown.
fn unheeded(layout: &Layout) -> impl Iterator<Item = String> {
    let notes = [
        (
            layout.is_white_zero,
            "the file says that 0 is white; its values are taken as they are",
        ),
        (
            layout.has_palette,
            "the file shows its values in the colours of a palette; they are taken as they are",
        ),
        (
            layout.is_turned,
            "the file says that its pictures are turned or mirrored for display; they are taken as they are",
        ),
    ];
    let told = notes.into_iter().filter(|(is_so, _)| *is_so);
    told.map(|(_, note)| note.to_string())
}

/// The slices of one channel at one time, all alike.
fn pages_of(
    meaning: &Meaning,
    channel: u32,
    time: u32,
    page: impl Fn(usize) -> Parsed<Page>,
) -> Parsed<Vec<Page>> {
    let [of_channel, of_slice, of_time] = meaning.order;
    let begin = (channel / meaning.samples) as usize * of_channel + time as usize * of_time;
    let mut pages: Vec<Page> = Vec::new();
    let mut chunks = 0;
    for z in 0..meaning.depth {
        let next = page(meaning.places[begin + z * of_slice])?;
        chunks += next.chunks() as u64;
        if chunks > next.file.bytes() && z > 0 && Arc::ptr_eq(&pages[0].file, &next.file) {
            return Err("has more strips and tiles than bytes: the file is damaged".into());
        }
        if next.layout.samples != meaning.samples {
            return Err(format!(
                "{} has {} values in each pixel, expected {} like the file's first page",
                named(&next, z, meaning.depth),
                next.layout.samples,
                meaning.samples
            ));
        }
        if let Some(first) = pages.first() {
            check_alike(&first.layout, &next, z, meaning.depth)?;
        }
        pages.push(next);
    }
    Ok(pages)
}

/// The resolutions of the same extent, of which the first has the voxels that the file describes.
fn levels(meaning: &Meaning, sizes: &[[u32; 2]]) -> Vec<Level> {
    let [x, y, z] = meaning.size.spacing;
    let [width, height] = sizes[0].map(f64::from);
    let level = |size: &[u32; 2]| Level {
        dims: [size[0], size[1], meaning.depth as u32],
        spacing: [
            x * (width / f64::from(size[0])),
            y * (height / f64::from(size[1])),
            z,
        ],
    };
    sizes.iter().map(level).collect()
}

/// The voxels of one of a pixel's values.
fn source(path: &Path, pages: Vec<Page>, dims: [u32; 3], sample: u32) -> Parsed<Box<dyn Source>> {
    let layout = pages[0].layout;
    if let Some(start) = plain_start(&pages) {
        let data = Data {
            path: pages[0].file.path().to_path_buf(),
            start: Start::At(start),
            encoding: Encoding::Raw,
            skip: 0,
            part: Part::WHOLE,
        };
        return data.open(path, dims, layout.voxel_type);
    }
    let is_alike = pages.iter().all(|page| page.layout == layout);
    let [width, height] = if is_alike { layout.chunk } else { layout.size };
    let pages = Pages {
        is_folder: pages[0].file.path() != path,
        pages,
        sample,
        is_alike,
    };
    let chunk = [width, height, 1];
    let bytes = layout.voxel_type.bytes();
    Ok(Box::new(Chunked::new(dims, chunk, bytes, Box::new(pages))))
}

fn check_alike(first: &Layout, page: &Page, z: usize, depth: usize) -> Parsed<()> {
    let name = || named(page, z, depth);
    let here = &page.layout;
    if here.size != first.size {
        return Err(format!(
            "{} is {}×{} pixels, expected {}×{} like the first",
            name(),
            here.size[0],
            here.size[1],
            first.size[0],
            first.size[1]
        ));
    }
    let kinds = |layout: &Layout| (layout.voxel_type, layout.samples);
    if kinds(here) != kinds(first) {
        let describe = |layout: &Layout| {
            let values = if layout.samples == 1 {
                "value"
            } else {
                "values"
            };
            format!("{} {values} a pixel, {}", layout.samples, layout.voxel_type)
        };
        return Err(format!(
            "{} has {}, expected {} like the first",
            name(),
            describe(here),
            describe(first)
        ));
    }
    Ok(())
}

/// Refuses a file that promises more than its bytes can hold, before anything is decoded.
fn check_promise(pages: &[Page], layout: Layout, dims: [u32; 3]) -> Parsed<()> {
    let packed = pages.iter().map(Page::packed_bytes);
    let packed = packed.fold(0, u64::saturating_add);
    let expected = voxel_bytes(dims, layout.voxel_type)?;
    match layout.codec {
        Codec::Plain => Ok(()),
        _ if packed.saturating_mul(LARGEST_RATIO) >= expected => Ok(()),
        _ => Err(format!(
            "its {packed} compressed bytes cannot hold {}: the file is damaged",
            shape(dims, layout.voxel_type)
        )),
    }
}

/// Offset of the voxels, if they lie plainly one after another in one file.
fn plain_start(pages: &[Page]) -> Option<u64> {
    let start = pages[0].plain_run()?;
    let bytes = pages[0].layout.page_bytes();
    let follows = |(n, page): (usize, &Page)| {
        let expected = (n as u64).checked_mul(bytes)?.checked_add(start)?;
        let is_here = Arc::ptr_eq(&page.file, &pages[0].file);
        (is_here && page.plain_run() == Some(expected)).then_some(())
    };
    pages.iter().enumerate().try_for_each(follows)?;
    Some(start)
}
