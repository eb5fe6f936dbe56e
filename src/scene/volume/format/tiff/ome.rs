//! OME-TIFF: XML in the first page's description describes each page.
//! <https://docs.openmicroscopy.org/ome-model/latest/ome-tiff/specification.html>
//!
//! Only sizes, units and the order of pages are read. The author and the subject of the image are not.

use std::collections::{HashMap, HashSet};
use std::iter::{once, repeat_n};
use std::ops::Range;

use roxmltree::{Document, Node, ParsingOptions};

use super::meaning::Meaning;
use super::voxel_size::VoxelSize;
use crate::scene::volume::parsed::{Parsed, unexpected};
use crate::scene::volume::storage::MOST_NAMES;

/// Nodes for each page of the file, and for everything that is not about pages.
const NODES_FOR_PAGE: u32 = 64;
const MORE_NODES: u32 = 100_000;

pub fn is_ome(description: &str) -> bool {
    description.contains("<OME") || description.contains("<ome:OME")
}

fn parsed(description: &str, pages: usize) -> Parsed<Document<'_>> {
    let options = ParsingOptions {
        nodes_limit: (pages as u32)
            .saturating_mul(NODES_FOR_PAGE)
            .saturating_add(MORE_NODES),
        ..Default::default()
    };
    Document::parse_with_options(description.trim(), options)
        .map_err(|e| format!("its OME-XML cannot be read: {e}"))
}

/// The voxel size that one of a folder's pages states, each of which describes itself, and remarks about it.
pub fn voxel_size(description: &str, pages: usize) -> Parsed<(VoxelSize, Vec<String>)> {
    let document = parsed(description, pages)?;
    match document.descendants().find(|node| is(node, "Pixels")) {
        Some(pixels) => size_of_voxels(&pixels),
        None => Ok((VoxelSize::UNKNOWN, Vec::new())),
    }
}

/// The files in which it says that planes are, each once.
pub fn named_files(description: &str, pages: usize) -> Parsed<HashSet<String>> {
    let document = parsed(description, pages)?;
    let files = document.descendants().filter_map(file_name);
    Ok(files.map(str::to_string).collect())
}

fn file_name<'a>(node: Node<'a, '_>) -> Option<&'a str> {
    node.attribute("FileName").filter(|_| is(&node, "UUID"))
}

/// The file of a set that describes all of them, if it is not the one with this description.
pub fn described_in(description: &str, pages: usize) -> Parsed<Option<String>> {
    let document = parsed(description, pages)?;
    let elsewhere = (document.descendants()).find(|node| is(node, "BinaryOnly"));
    let file = elsewhere.and_then(|node| node.attribute("MetadataFile"));
    Ok(file.map(str::to_string))
}

/// Where pages are: in one file, or in the files of a set, by their names. Planes of which nothing is said are in the file
/// `own`, which describes the set.
#[derive(Clone, Copy)]
pub enum Pages<'a> {
    OfOneFile(usize),
    OfFiles {
        files: &'a HashMap<String, Range<usize>>,
        own: &'a str,
    },
}

impl Pages<'_> {
    fn count(self) -> usize {
        match self {
            Pages::OfOneFile(pages) => pages,
            Pages::OfFiles { files, .. } => files.values().map(Range::len).sum(),
        }
    }

    /// The pages of a file of the set, or of the only one.
    fn of(self, file: Option<&str>) -> Parsed<Range<usize>> {
        match self {
            Pages::OfOneFile(pages) => Ok(0..pages),
            Pages::OfFiles { files, own } => {
                let file = file.unwrap_or(own);
                files.get(file).cloned().ok_or_else(|| {
                    format!(
                        "its OME-XML says that a plane is in {file}, which the folder does not hold"
                    )
                })
            }
        }
    }
}

pub fn meaning(description: &str, from: Pages, samples: u32) -> Parsed<Meaning> {
    let pages = from.count();
    let document = parsed(description, pages)?;
    let pixels = document.descendants().find(|node| is(node, "Pixels"));
    let Some(pixels) = pixels else {
        let elsewhere = document.descendants().any(|node| is(&node, "BinaryOnly"));
        return Err(if elsewhere {
            "is a part of a set of OME-TIFF files that another file describes; open the folder that holds the set".into()
        } else {
            "its OME-XML has no `Pixels`".into()
        });
    };
    let [depth, channels, times] = ["SizeZ", "SizeC", "SizeT"].map(|key| size(&pixels, key));
    let (depth, channels, times) = (depth?, channels?, times?);
    let (size, mut notes) = size_of_voxels(&pixels)?;
    let images = document.descendants().filter(|node| is(node, "Pixels"));
    notes.extend(told_others(images.count() - 1));
    if channels % samples != 0 {
        return Err(unexpected(
            "SizeC",
            &channels.to_string(),
            &format!("a multiple of a pixel's {samples} samples"),
        ));
    }
    let planes = [channels / samples, times].map(u64::from);
    let planes = planes
        .iter()
        .fold(depth.into(), |planes, &n| u64::saturating_mul(planes, n));
    if planes > pages as u64 {
        return Err(match from {
            Pages::OfOneFile(_) => format!(
                "has {pages} pages, but its OME-XML speaks of {planes}: the others are in other files, or were never \
                 written; if there are other files, open the folder that holds them"
            ),
            Pages::OfFiles { files, .. } => format!(
                "its OME-XML speaks of {planes} planes, but the {} files of the folder have {pages} pages: some are missing",
                files.len()
            ),
        });
    }
    let names = channel_names(&pixels, samples)
        .take(channels.min(MOST_NAMES) as usize)
        .collect();
    let sizes = [channels / samples, depth, times].map(|size| size as usize);
    let order = order(pixels.attribute("DimensionOrder").unwrap_or("XYZCT"), sizes)?;
    let places = places(&pixels, order, planes as usize, from)?;
    Ok(Meaning {
        size,
        notes,
        depth: depth as usize,
        channels,
        names,
        times,
        order,
        places,
        ..Meaning::stack(pages, samples)
    })
}

/// The name of each channel, where a pixel has so many samples.
fn channel_names(pixels: &Node, samples: u32) -> impl Iterator<Item = String> {
    let described = pixels.children().filter(|node| is(node, "Channel"));
    described.flat_map(move |channel| {
        let name = channel.attribute("Name").unwrap_or_default().to_string();
        let others = match channel.attribute("SamplesPerPixel") {
            Some(_) => samples as usize - 1,
            None => 0,
        };
        // A name for each sample would be as many copies of it as a file likes.
        once(name).chain(repeat_n(String::new(), others))
    })
}

/// What is said of images besides the first.
fn told_others(others: usize) -> Option<String> {
    match others {
        0 => None,
        1 => Some("the file holds another image, which is not shown; write it as a file of its own to see it".into()),
        _ => Some(format!(
            "the file holds {others} other images, which are not shown; write each as a file of its own to see it"
        )),
    }
}

/// Compares a name without its namespace, of which there is one for each year.
fn is(node: &Node, name: &str) -> bool {
    node.is_element() && node.tag_name().name() == name
}

fn size(pixels: &Node, key: &str) -> Parsed<u32> {
    let text = pixels.attribute(key).unwrap_or_default();
    let size = text.parse().ok().filter(|size| *size > 0);
    size.ok_or_else(|| unexpected(key, text, "a whole number from 1 up"))
}

/// The size of voxels, and remarks about it.
fn size_of_voxels(pixels: &Node) -> Parsed<(VoxelSize, Vec<String>)> {
    let mut lengths = [None; 3];
    let mut units = [None; 3];
    let mut notes = Vec::new();
    for (a, axis) in ["X", "Y", "Z"].into_iter().enumerate() {
        let key = format!("PhysicalSize{axis}");
        let Some(text) = pixels.attribute(key.as_str()) else {
            continue;
        };
        let length = text.parse().ok().filter(|length: &f64| *length >= 0.0);
        let length = length.ok_or_else(|| unexpected(&key, text, "a length above 0"))?;
        if length == 0.0 {
            notes.push(format!("`{key}` is 0, and counts as not stated"));
            continue;
        }
        lengths[a] = Some(length);
        units[a] = pixels
            .attribute(format!("{key}Unit").as_str())
            .or(Some("µm"));
    }
    // Voxels that are as long along all axes are the best guess.
    let otherwise = lengths.into_iter().flatten().next().unwrap_or(1.0);
    Ok((VoxelSize::new("OME-XML", lengths, units, otherwise), notes))
}

/// Distance, in pages, to the next channel, slice and time.
fn order(name: &str, sizes: [usize; 3]) -> Parsed<[usize; 3]> {
    let letters: Vec<usize> = name
        .strip_prefix("XY")
        .into_iter()
        .flat_map(str::chars)
        .filter_map(|letter| "CZT".find(letter))
        .collect();
    let mut sorted = letters.clone();
    sorted.sort_unstable();
    if sorted != [0, 1, 2] {
        let expected = "XY and then Z, C and T in any order";
        return Err(unexpected("DimensionOrder", name, expected));
    }
    let (mut order, mut step) = ([0; 3], 1);
    for axis in letters {
        order[axis] = step;
        step *= sizes[axis];
    }
    Ok(order)
}

/// The page of each plane, in the order of planes.
fn places(pixels: &Node, order: [usize; 3], planes: usize, from: Pages) -> Parsed<Vec<usize>> {
    // In one file, planes that nothing is said of are where they would be without any word.
    let otherwise = |plane| matches!(from, Pages::OfOneFile(_)).then_some(plane);
    let mut places: Vec<Option<usize>> = (0..planes).map(otherwise).collect();
    let mut files = Vec::new();
    for data in pixels.children().filter(|node| is(node, "TiffData")) {
        let number = |key: &str| -> Parsed<Option<usize>> {
            let Some(text) = data.attribute(key) else {
                return Ok(None);
            };
            let wrong = |_| unexpected(key, text, "a whole number from 0 up");
            text.parse().map(Some).map_err(wrong)
        };
        let file = data.children().find_map(file_name);
        let pages = from.of(file)?;
        let page = number("IFD")?;
        let count = number("PlaneCount")?;
        let count = count.unwrap_or(if page.is_some() { 1 } else { pages.len() });
        let mut plane: usize = 0;
        for (key, step) in ["FirstC", "FirstZ", "FirstT"].into_iter().zip(order) {
            let first = number(key)?.unwrap_or(0);
            plane = plane.saturating_add(first.saturating_mul(step));
        }
        let first = page.unwrap_or(0);
        for n in 0..count.min(planes.saturating_sub(plane)) {
            let page = first.saturating_add(n);
            if page >= pages.len() {
                return Err(beyond(page, pages.len(), from, file));
            }
            places[plane + n] = Some(pages.start + page);
        }
        files.extend(file);
    }
    files.dedup();
    if files.len() > 1 && matches!(from, Pages::OfOneFile(_)) {
        return Err(
            "is a part of a set of OME-TIFF files; open the folder that holds the set".into(),
        );
    }
    let places: Option<Vec<usize>> = places.into_iter().collect();
    places.ok_or_else(|| "its OME-XML does not say of every plane in which file it is".into())
}

/// A refusal of a page, counted from 0, that a file of so many does not have.
fn beyond(page: usize, pages: usize, from: Pages, file: Option<&str>) -> String {
    let number = page.saturating_add(1);
    match (from, file) {
        (Pages::OfFiles { .. }, Some(file)) => {
            format!(
                "its OME-XML says that an image is on page {number} of {file}, which has {pages}"
            )
        }
        _ => format!("has {pages} pages, but its OME-XML says that an image is on page {number}"),
    }
}
