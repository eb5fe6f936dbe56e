//! A folder of TIFF files, each of which is one slice.

use std::cmp::Ordering;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::prelude::*;

use super::directory::{Directories, Tag};
use super::page::{Layout, Page};
use super::{Meaning, imagej, imagej_meaning, ome, stack};
use crate::scene::volume::format::header::Header;
use crate::scene::volume::overrides::VolumeOverrides;
use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::source::watched::WatchedFile;

/// Whether a file of a folder is a page by its name. Hidden files are not the user's: some systems put one beside each
/// file.
pub fn is_page(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let lower = name.to_lowercase();
    (lower.ends_with(".tif") || lower.ends_with(".tiff")) && !lower.starts_with('.')
}

pub fn read_folder(path: &Path, overrides: &VolumeOverrides) -> Parsed<Header> {
    let files = files(path)?;
    let pages = files.par_iter().map(|file| {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        page(file).map_err(|fault| format!("{name} {fault}"))
    });
    // All results are collected, so that the first fault is always the one that is reported.
    let pages: Vec<Parsed<Page>> = pages.collect();
    let pages: Vec<Page> = pages.into_iter().collect::<Parsed<_>>()?;
    let layout = pages[0].layout;
    let name = files[0].file_name().unwrap_or_default().to_string_lossy();
    let meaning = meaning(&files[0], pages.len(), &layout, overrides)
        .map_err(|fault| format!("{name} {fault}"))?;
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

/// What the first file says of all: ImageJ repeats its description in each, and a page of OME describes itself.
fn meaning(
    first: &Path,
    pages: usize,
    layout: &Layout,
    overrides: &VolumeOverrides,
) -> Parsed<Meaning> {
    let file = Arc::new(WatchedFile::open(first)?);
    let directories = Directories::new(&file)?;
    let full = directories.full_pages()?;
    let Some(page) = full.first() else {
        return Ok(Meaning::stack(pages, layout.samples));
    };
    let description = directories.text(page, Tag::ImageDescription)?;
    let (mut meaning, states_depth, program) = if description.starts_with(imagej::START) {
        let meaning = imagej_meaning(&directories, page, pages, layout)?;
        (meaning, imagej::states_depth(&description), "ImageJ")
    } else if ome::is_ome(&description)
        && let Some(size) = ome::voxel_size(&description, pages)?
    {
        let meaning = Meaning {
            spacing: size.spacing,
            unit: size.unit,
            notes: size.notes,
            ..Meaning::stack(pages, layout.samples)
        };
        (meaning, size.states_depth, "OME-XML")
    } else {
        return Ok(Meaning::stack(pages, layout.samples));
    };
    let is_silent = pages > 1 && overrides.spacing.is_none() && !states_depth;
    if let Some(unit) = meaning.unit.as_ref().filter(|_| is_silent) {
        let depth = meaning.spacing[2];
        meaning.notes.push(format!(
            "{program} does not say how far apart the slices of a folder are: they are taken as {depth} {unit} apart; set \
             volume.spacing"
        ));
    }
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
    use super::by_number;

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
