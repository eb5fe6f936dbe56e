//! The format of a folder by its content, and what can be opened in a folder of none.

use std::fs::DirEntry;
use std::path::{Path, PathBuf};

use super::{DICOM, FORMATS, Format, dicom, named, tiff};
use crate::error::first_of;
use crate::scene::volume::parsed::Parsed;

/// The most names in one message.
const MOST_NAMED: usize = 3;
/// Endings of pictures, which are not read.
const PICTURES: [&str; 4] = [".png", ".jpg", ".jpeg", ".bmp"];

/// The format of a folder: DICOM's, unless another recognises it.
pub(super) fn format_of(path: &Path) -> Parsed<&'static Format> {
    if let Some(format) = FORMATS.iter().find(|format| format.is_of_folder(path)) {
        return Ok(format);
    }
    match openable(path) {
        Some(others) if !dicom::holds_dicom(path) => {
            Err(format!("holds no DICOM image, but {others}"))
        }
        _ => Ok(&DICOM),
    }
}

/// Whether a folder holds TIFF pages, and none of its other files is DICOM: a picture may lie beside a scan's slices, or
/// beside folders of them.
pub fn has_pages(folder: &Path) -> bool {
    let paths = entries(folder).map(|entry| entry.path());
    let (pages, others): (Vec<PathBuf>, Vec<PathBuf>) = paths.partition(|path| tiff::is_page(path));
    match pages.len() {
        0 => false,
        1 => !dicom::holds_dicom(folder),
        _ => !others.iter().any(|path| dicom::begins_as_dicom(path)),
    }
}

fn entries(folder: &Path) -> impl Iterator<Item = DirEntry> {
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    entries.filter_map(Result::ok)
}

/// The files and folders in a folder without DICOM that can be opened alone, or else pictures that cannot, with what to
/// do.
fn openable(folder: &Path) -> Option<String> {
    let name = |entry: DirEntry| entry.file_name().to_string_lossy().into_owned();
    let mut names: Vec<String> = entries(folder).map(name).collect();
    names.retain(|name| !name.starts_with('.'));
    names.sort();
    let is_openable = |name: &&String| match folder.join(name) {
        path if path.is_dir() => FORMATS.iter().any(|format| format.is_of_folder(&path)),
        _ => named(&name.to_lowercase()).is_some_and(|format| format.listing.is_none()),
    };
    let volumes: Vec<&String> = names.iter().filter(is_openable).collect();
    if let [first, ..] = volumes[..] {
        return Some(match volumes.len() {
            1 => format!("{first}; open that"),
            _ => format!("{}; open one of these", first_of(&volumes, MOST_NAMED)),
        });
    }
    let is_picture = |name: &&String| {
        let name = name.to_lowercase();
        PICTURES.iter().any(|end| name.ends_with(end))
    };
    let picture = names.iter().find(is_picture)?;
    Some(format!(
        "pictures such as {picture}; save the slices as TIFF, and open the folder of those"
    ))
}
