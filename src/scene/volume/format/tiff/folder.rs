//! A folder of TIFF files: each of which is one slice, or which are a set whose OME-XML says where each plane is.

use std::cmp::Ordering;
use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::prelude::*;

use super::directory::{Directories, Tag};
use super::meaning::Meaning;
use super::page::{Layout, Page};
use super::{imagej, imagej_meaning, ome, stack};
use crate::scene::volume::format::header::Header;
use crate::scene::volume::overrides::VolumeOverrides;
use crate::scene::volume::parsed::{Keyed, Parsed};
use crate::scene::volume::source::watched::WatchedFile;

/// Whether a file of a folder is a page by its name. Hidden files are not the user's: some systems put one beside each
/// file.
pub fn is_page(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let lower = name.to_lowercase();
    let is_named = (lower.ends_with(".tif") || lower.ends_with(".tiff")) && !lower.starts_with('.');
    is_named && !path.is_dir()
}

/// What is said of a file with reduced copies alone.
const NO_PAGE: &str = "has no page in full resolution";
/// The most bytes of a file of XML that describes a set.
const MOST_XML: u64 = 1 << 28;

pub fn read_folder(path: &Path, overrides: &VolumeOverrides) -> Keyed<Header> {
    let files = files(path)?;
    let name_of = |file: &PathBuf| {
        file.file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    };
    let names: Vec<String> = files.iter().map(name_of).collect();
    let pages = files
        .par_iter()
        .zip(&names)
        .map(|(file, name)| pages(file).map_err(|fault| format!("{name}: {fault}")));
    // All results are collected, so that the first fault is always the one that is reported.
    let pages: Vec<Parsed<Vec<Page>>> = pages.collect();
    let pages: Vec<Vec<Page>> = pages.into_iter().collect::<Parsed<_>>()?;
    let counts: Vec<usize> = pages.iter().map(Vec::len).collect();
    let pages = pages.concat();
    let folder = Folder {
        path,
        names,
        counts,
    };
    let meaning = folder.meaning(&pages)?;
    let size = pages[meaning.places[0]].layout.size;
    stack(path, meaning, vec![size], overrides, |n| {
        Ok(pages[n].clone())
    })
}

/// The TIFF files of a folder, in the order of their numbers.
fn files(folder: &Path) -> Parsed<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(|e| e.to_string())? {
        let path = entry.map_err(|e| e.to_string())?.path();
        if is_page(&path) {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            files.push((name.into_owned(), path));
        }
    }
    files.sort_by(|(a, _), (b, _)| by_number(a, b).then_with(|| a.cmp(b)));
    Ok(files.into_iter().map(|(_, path)| path).collect())
}

/// A remark where the names of a folder's files, in order, speak against their being the slices of one stack.
fn doubt(stems: &[impl AsRef<str>]) -> Option<String> {
    let names: Vec<Name> = stems.iter().map(|stem| Name::of(stem.as_ref())).collect();
    let (first, last) = (names.first()?, names.last()?);
    let is_other =
        |name: &&Name| name.text != first.text || name.numbers.len() != first.numbers.len();
    if let Some(other) = names.iter().find(is_other) {
        return Some(format!(
            "its files are named after each other in several ways, as {} and {}: all are taken as slices of one stack",
            first.stem, other.stem
        ));
    }
    let varies = |n: &usize| {
        names
            .iter()
            .any(|name| name.numbers[*n] != first.numbers[*n])
    };
    let varying: Vec<usize> = (0..first.numbers.len()).filter(varies).collect();
    let [n] = varying[..] else {
        return (varying.len() > 1).then(|| {
            format!(
                "the names of its files, from {} to {}, differ in {} numbers, as those of several channels or times do: all files \
                 are taken as slices of one stack, in the order of their names",
                first.stem,
                last.stem,
                varying.len()
            )
        });
    };
    let pairs = names.windows(2);
    let missing = |pair: &[Name]| {
        pair[1].numbers[n]
            .saturating_sub(pair[0].numbers[n])
            .saturating_sub(1)
    };
    let count = pairs.clone().map(missing).fold(0, u64::saturating_add);
    let steps = pairs.clone().map(|pair| missing(pair) + 1);
    let is_even = steps.clone().min() == steps.max();
    let gap = pairs
        .clone()
        .find(|pair| missing(pair) > 0)
        .filter(|_| !is_even)?;
    Some(format!(
        "the names of its files leave out {count} numbers, the first behind {}: the slices on both sides of a gap are taken \
         as neighbours",
        gap[0].stem
    ))
}

/// A file's name: its numbers, and the text between them.
struct Name<'a> {
    stem: &'a str,
    numbers: Vec<u64>,
    text: Vec<&'a str>,
}

impl Name<'_> {
    fn of(stem: &str) -> Name<'_> {
        let is_digit = |c: char| c.is_ascii_digit();
        let numbers = stem
            .split(|c| !is_digit(c))
            .filter(|digits| !digits.is_empty());
        Name {
            stem,
            numbers: numbers
                .map(|digits| digits.parse().unwrap_or(u64::MAX))
                .collect(),
            text: stem
                .split(is_digit)
                .filter(|text| !text.is_empty())
                .collect(),
        }
    }
}

/// A folder's files, in order.
struct Folder<'a> {
    path: &'a Path,
    names: Vec<String>,
    /// The number of pages of each.
    counts: Vec<usize>,
}

/// The description of a set.
struct Set {
    xml: String,
    /// The file that holds it.
    own: String,
    /// The files of the set, if they are named.
    named: HashSet<String>,
}

impl Folder<'_> {
    /// What OME-XML says of a set, in whichever of its files it is, or else what the first file says of all: ImageJ repeats its
    /// description in each, or each file describes itself. If the order of slices is that of the files' names, these may raise
    /// a doubt.
    fn meaning(&self, pages: &[Page]) -> Parsed<Meaning> {
        let first = &self.names[0];
        let mut missing = None;
        if let Some(set) = self.set(pages.len(), &mut missing)? {
            let files = self.pages_of_files();
            let named = set.named.iter().filter_map(|name| files.get(name));
            let first = named.map(|range| range.start).min().unwrap_or(0);
            let samples = pages[first].layout.samples;
            let own = set.own.as_str();
            let from = ome::Pages::OfFiles { files: &files, own };
            let meaning = ome::meaning(&set.xml, from, samples);
            return meaning.map_err(|fault| format!("{own}: {fault}"));
        }
        self.check_counts(missing.as_deref())?;
        let mut meaning = self
            .of_first(&pages[0].layout)
            .map_err(|fault| format!("{first}: {fault}"))?;
        let stems = self
            .names
            .iter()
            .filter_map(|name| Path::new(name).file_stem());
        let stems: Vec<_> = stems.map(|stem| stem.to_string_lossy()).collect();
        let missing = missing.map(|missing| format!("{missing}: each file is taken as a slice"));
        meaning.notes.extend(missing);
        meaning.notes.extend(doubt(&stems));
        Ok(meaning)
    }

    /// The set that the first file with OME-XML belongs to, if it is one. `missing` says that its description is elsewhere.
    fn set(&self, pages: usize, missing: &mut Option<String>) -> Parsed<Option<Set>> {
        for name in &self.names {
            let mut set = Set {
                xml: self.description_in(name)?,
                own: name.clone(),
                named: HashSet::new(),
            };
            if !ome::is_ome(&set.xml) {
                continue;
            }
            let named = |fault| format!("{name}: {fault}");
            if let Some(other) = ome::described_in(&set.xml, pages).map_err(named)? {
                let other = other.strip_prefix("./").unwrap_or(&other);
                if !self.holds(other) {
                    *missing = Some(format!(
                        "the file {other}, which describes its files, is missing"
                    ));
                    return Ok(None);
                }
                (set.xml, set.own) = (self.description_in(other)?, other.into());
            }
            set.named = ome::named_files(&set.xml, pages).map_err(named)?;
            // A file that describes itself alone may have got another name.
            let is_other = |file: &String| *file != set.own && self.holds(file);
            let is_set = set.named.len() > 1 || set.named.iter().any(is_other);
            return Ok(is_set.then_some(set));
        }
        Ok(None)
    }

    /// What the first file says of all, each of which is a slice.
    fn of_first(&self, layout: &Layout) -> Parsed<Meaning> {
        let file = Arc::new(WatchedFile::open(&self.path.join(&self.names[0]))?);
        let directories = Directories::new(&file)?;
        let pages = directories.full_pages()?;
        let first = pages.first().ok_or(NO_PAGE)?;
        let description = directories.text(first, Tag::ImageDescription)?;
        let count = self.names.len();
        if description.starts_with(imagej::START) {
            return imagej_meaning(&description, &directories, first, count, layout);
        }
        let mut meaning = Meaning::stack(count, layout.samples);
        if ome::is_ome(&description) {
            (meaning.size, meaning.notes) = ome::voxel_size(&description, count)?;
        }
        Ok(meaning)
    }

    /// Whether such a file is in the folder itself.
    fn holds(&self, name: &str) -> bool {
        let is_inside = Path::new(name).file_name().is_some_and(|file| file == name);
        is_inside && self.path.join(name).is_file()
    }

    /// The description in a TIFF file's first page, or the XML in a file beside them.
    fn description_in(&self, name: &str) -> Parsed<String> {
        let path = self.path.join(name);
        let described = || {
            let file = Arc::new(WatchedFile::open(&path)?);
            if is_page(&path) {
                let directories = Directories::new(&file)?;
                let pages = directories.full_pages()?;
                let first = pages.first().ok_or(NO_PAGE)?;
                return directories.text(first, Tag::ImageDescription);
            }
            let xml = file.read(0, file.bytes().min(MOST_XML))?;
            String::from_utf8(xml).map_err(|_| "describes the set, expected XML in UTF-8".into())
        };
        described().map_err(|fault| format!("{name}: {fault}"))
    }

    /// The pages of each file, the first file's first.
    fn pages_of_files(&self) -> HashMap<String, Range<usize>> {
        let mut end = 0;
        let ranges = self.counts.iter().map(|count| {
            end += count;
            end - count..end
        });
        self.names.iter().cloned().zip(ranges).collect()
    }

    /// Fails unless each file is one slice. `missing` says what else would tell where pages belong.
    fn check_counts(&self, missing: Option<&str>) -> Parsed<()> {
        let mut counts = self.names.iter().zip(&self.counts);
        match (counts.find(|(_, count)| **count != 1), missing) {
            (None, _) => Ok(()),
            (Some(_), Some(missing)) => Err(missing.into()),
            (Some((name, count)), None) => Err(format!(
                "{name}: has {count} pages, expected 1 in each file of a folder; open it alone"
            )),
        }
    }
}

/// The pages of a file in full resolution.
fn pages(path: &Path) -> Parsed<Vec<Page>> {
    let file = Arc::new(WatchedFile::open(path)?.closed());
    let directories = Directories::new(&file)?;
    let full = directories.full_pages()?;
    if full.is_empty() {
        return Err(NO_PAGE.into());
    }
    let page = |directory| Page::new(&file, &directories, directory);
    full.iter().map(page).collect()
}

/// Orders names as people count: 9 comes before 10, and 009 is 9.
fn by_number(a: &str, b: &str) -> Ordering {
    let [mut a, mut b] = [a, b];
    loop {
        let [(a_number, a_rest), (b_number, b_rest)] = [a, b].map(leading_number);
        match (a_number, b_number) {
            (Some(a_digits), Some(b_digits)) => {
                let order = a_digits.len().cmp(&b_digits.len());
                match order.then_with(|| a_digits.cmp(b_digits)) {
                    Ordering::Equal => (a, b) = (a_rest, b_rest),
                    order => return order,
                }
            }
            _ => match (a.chars().next(), b.chars().next()) {
                (Some(first), Some(second)) if first == second => {
                    (a, b) = (&a[first.len_utf8()..], &b[second.len_utf8()..]);
                }
                (first, second) => return first.cmp(&second),
            },
        }
    }
}

/// The digits at the beginning, without leading zeros, and the text after them.
fn leading_number(text: &str) -> (Option<&str>, &str) {
    let end = text.bytes().take_while(u8::is_ascii_digit).count();
    let (digits, rest) = text.split_at(end);
    ((end > 0).then(|| digits.trim_start_matches('0')), rest)
}

#[cfg(test)]
mod tests {
    use super::{by_number, doubt};

    #[test]
    fn names_that_do_not_count_slices_are_told() {
        for (names, expected) in [
            (&["s1", "s2", "s3"][..], None),
            (&["s8", "s10", "s12"], None),
            (&["slice"], None),
            (&["2024_s1", "2024_s2"], None),
            (
                &["s1", "s2", "s7", "s8"],
                Some("leave out 4 numbers, the first behind s2"),
            ),
            (
                &["z0_ch0", "z0_ch1", "z1_ch0", "z1_ch1"],
                Some("differ in 2 numbers"),
            ),
            (&["a0", "a1", "b0"], Some("as a0 and b0")),
            (&["1s2", "s3"], Some("as 1s2 and s3")),
        ] {
            let said = doubt(names);
            let is_expected = match expected {
                Some(part) => said.as_ref().is_some_and(|said| said.contains(part)),
                None => said.is_none(),
            };
            assert!(is_expected, "{names:?}: {said:?}");
        }
    }

    #[test]
    fn numbers_sort_as_numbers() {
        let mut names = [
            "s10b", "s9", "s010a", "s1_2", "s1_10", "s", "t0", "s1_002", "s11",
        ];
        names.sort_by(|a, b| by_number(a, b));
        let expected = [
            "s", "s1_2", "s1_002", "s1_10", "s9", "s010a", "s10b", "s11", "t0",
        ];
        assert_eq!(names, expected);
    }
}
