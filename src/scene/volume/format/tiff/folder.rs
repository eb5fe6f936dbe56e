//! A folder of TIFF files, each of which is one slice.

use std::cmp::Ordering;
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

pub fn read_folder(path: &Path, overrides: &VolumeOverrides) -> Keyed<Header> {
    let files = files(path)?;
    let pages = files.par_iter().map(|file| {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        page(file).map_err(|fault| format!("{name}: {fault}"))
    });
    // All results are collected, so that the first fault is always the one that is reported.
    let pages: Vec<Parsed<Page>> = pages.collect();
    let pages: Vec<Page> = pages.into_iter().collect::<Parsed<_>>()?;
    let layout = pages[0].layout;
    let names = files.iter().filter_map(|file| file.file_name());
    let names: Vec<String> = names.map(|name| name.to_string_lossy().into()).collect();
    let meaning =
        meaning(&files[0], &names, &layout).map_err(|fault| format!("{}: {fault}", names[0]))?;
    stack(path, meaning, vec![layout.size], overrides, |n| {
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

/// What the first file says of all: ImageJ repeats its description in each, OME-XML says in which file each plane is, or each file
/// describes itself. If the order of slices is that of the files' names, these may raise a doubt.
fn meaning(first: &Path, names: &[String], layout: &Layout) -> Parsed<Meaning> {
    let file = Arc::new(WatchedFile::open(first)?);
    let directories = Directories::new(&file)?;
    let full = directories.full_pages()?;
    let pages = names.len();
    let mut meaning = Meaning::stack(pages, layout.samples);
    if let Some(page) = full.first() {
        let description = directories.text(page, Tag::ImageDescription)?;
        if description.starts_with(imagej::START) {
            meaning = imagej_meaning(&description, &directories, page, pages, layout)?;
        } else if ome::is_ome(&description) {
            if ome::names_files(&description, pages)? {
                return ome::meaning(&description, ome::Pages::Files(names), layout.samples);
            }
            (meaning.size, meaning.notes) = ome::voxel_size(&description, pages)?;
        }
    }
    let stems = names.iter().filter_map(|name| Path::new(name).file_stem());
    let stems: Vec<_> = stems.map(|stem| stem.to_string_lossy()).collect();
    meaning.notes.extend(doubt(&stems));
    Ok(meaning)
}

fn page(path: &Path) -> Parsed<Page> {
    let file = Arc::new(WatchedFile::open(path)?.closed());
    let directories = Directories::new(&file)?;
    let pages = directories.full_pages()?;
    match &pages[..] {
        [one] => Page::new(&file, &directories, one),
        _ => Err(format!(
            "has {} pages, expected 1 in each file of a folder; open it alone",
            pages.len()
        )),
    }
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
