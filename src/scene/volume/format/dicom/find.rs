//! Finds the files of a folder, a DICOMDIR or a single path, and classifies them.

use std::collections::{BTreeMap, HashMap};
use std::ffi::OsString;
use std::fmt::Display;
use std::fs::DirEntry;
use std::io::ErrorKind;
use std::path::{Component, Path, PathBuf};

use rayon::prelude::*;

use crate::error::first_of;
use crate::scene::volume::parsed::Parsed;

use super::file::{self, Fault};
use super::frame::Frame;
use super::image::{Content, Image, interpret};
use super::other::{Other, UNPLACED, UNREADABLE_COPY};

/// The most levels of nested folders.
const MOST_NESTED: u32 = 32;
/// The most names in one message.
const MOST_NAMED: usize = 3;

/// The result of a search.
#[derive(Debug, Default)]
pub struct Found {
    /// Images, in the order of their paths.
    pub images: Vec<Image>,
    /// Number of DICOM objects of each kind that are no part of a volume.
    pub others: BTreeMap<&'static str, usize>,
    /// Files that should have been readable but are not.
    pub unreadable: Vec<String>,
    /// The first file that is no part of a volume, with the reason.
    first_other: Option<FirstOther>,
}

/// A file that is no part of a volume.
#[derive(Debug)]
struct FirstOther {
    /// Its path relative to the folder that the user has named; `None` for a file that the user has named.
    name: Option<String>,
    why: String,
}

/// Examines all files below a folder, those that a DICOMDIR lists, or a single file.
pub fn find(path: &Path) -> Parsed<Found> {
    let mut found = examine(path)?;
    found.pass_over_unplaced();
    found.pass_over_unreadable_copies();
    Ok(found)
}

fn examine(path: &Path) -> Parsed<Found> {
    if path.is_dir() {
        let mut files = Vec::new();
        list(path, path, 0, &mut files)?;
        return examine_all(files, path);
    }
    let parsing = file::parse(path)?.ok_or("is no DICOM file")?;
    match interpret(parsing)? {
        Content::Image(image) => Ok(Found {
            images: vec![*image],
            ..Found::default()
        }),
        Content::Other(Other { kind, why }) => Ok(Found {
            others: [(kind, 1)].into(),
            first_other: Some(FirstOther { name: None, why }),
            ..Found::default()
        }),
        Content::Directory(names) => {
            let folder = path.parent().unwrap_or(Path::new(""));
            let mut found = Found::default();
            let mut files = Vec::new();
            for name in names {
                match listed(folder, &name) {
                    Some(file) => files.push(file),
                    None => found
                        .unreadable
                        .push(format!("{} (is not there)", name.join("/"))),
                }
            }
            let missing = found.unreadable;
            found = examine_all(files, folder)?;
            found.unreadable.splice(0..0, missing);
            Ok(found)
        }
    }
}

/// The regular files of a folder, and below it, in the order of their names; `top` is the folder that the user has
/// named. Links to folders are not followed: they may lead in circles.
fn list(folder: &Path, top: &Path, depth: u32, files: &mut Vec<PathBuf>) -> Parsed<()> {
    let entries = std::fs::read_dir(folder).and_then(Iterator::collect);
    let mut entries: Vec<DirEntry> = entries.map_err(|e| unreadable("folder", folder, top, e))?;
    entries.sort_by_key(DirEntry::file_name);
    for entry in entries {
        let path = entry.path();
        let failed = |e| unreadable("file", &path, top, e);
        let kind = entry.file_type().map_err(failed)?;
        if kind.is_dir() {
            if depth < MOST_NESTED {
                list(&path, top, depth + 1, files)?;
            }
        } else if kind.is_file() || kind.is_symlink() && leads_to_file(&path).map_err(failed)? {
            files.push(path);
        }
    }
    Ok(())
}

/// Whether a file, which may also be a folder or unreadable, certainly begins like DICOM.
pub fn begins_as_dicom(path: &Path) -> bool {
    matches!(file::parse(path), Ok(Some(_)) | Err(Fault::Content(_)))
}

/// Whether a file in a folder, or below it where [`find`] would look, certainly begins like DICOM. What cannot be read is
/// passed over.
pub fn holds_dicom(folder: &Path) -> bool {
    holds_dicom_at(folder, 0)
}

fn holds_dicom_at(folder: &Path, depth: u32) -> bool {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let is_folder = |entry: &DirEntry| entry.file_type().is_ok_and(|kind| kind.is_dir());
    let (folders, files): (Vec<DirEntry>, Vec<DirEntry>) = entries.partition(is_folder);
    let is_within = |entry: &DirEntry| holds_dicom_at(&entry.path(), depth + 1);
    files.iter().any(|file| begins_as_dicom(&file.path()))
        || depth < MOST_NESTED && folders.iter().any(is_within)
}

/// A refusal of a folder `top` because of a file or folder in it, which may hold a slice.
fn unreadable(kind: &str, path: &Path, top: &Path, fault: impl Display) -> String {
    match path.strip_prefix(top) {
        Ok(name) if name != Path::new("") => format!(
            "its {kind} {} cannot be read: {fault}; make it readable, or move it elsewhere",
            name.display()
        ),
        _ => fault.to_string(),
    }
}

/// Whether a link leads to a file; a broken link does not.
fn leads_to_file(link: &Path) -> std::io::Result<bool> {
    match std::fs::metadata(link) {
        Ok(metadata) => Ok(metadata.is_file()),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// The path of a file in a DICOMDIR, which names it in capitals whatever the letters of its own name are.
fn listed(folder: &Path, name: &[String]) -> Option<PathBuf> {
    let mut path = folder.to_path_buf();
    for part in name {
        let is_plain = matches!(
            Path::new(part).components().collect::<Vec<_>>()[..],
            [Component::Normal(only)] if only == part.as_str()
        );
        if !is_plain {
            return None;
        }
        let exact = path.join(part);
        path = if exact.exists() {
            exact
        } else {
            let entries = std::fs::read_dir(&path).ok()?.flatten();
            let is_it = |name: &OsString| name.eq_ignore_ascii_case(part);
            path.join(entries.map(|entry| entry.file_name()).find(is_it)?)
        };
    }
    path.is_file().then_some(path)
}

/// Examines files. Fails if the system does not return a file's bytes: the volume could lack a slice, which would go
/// unnoticed if it is the first or the last.
fn examine_all(files: Vec<PathBuf>, folder: &Path) -> Parsed<Found> {
    let examined = files.into_par_iter().map(|path| {
        let content = file::parse(&path).and_then(|parsing| {
            let understood = parsing.map(interpret).transpose();
            understood.map_err(Fault::Content)
        });
        (path, content)
    });
    let mut found = Found::default();
    for (path, content) in examined.collect::<Vec<_>>() {
        let name = path
            .strip_prefix(folder)
            .unwrap_or(&path)
            .display()
            .to_string();
        match content {
            Ok(Some(Content::Image(mut image))) => {
                image.place.name = name;
                found.images.push(*image);
            }
            Ok(Some(Content::Other(Other { kind, why }))) => {
                *found.others.entry(kind).or_default() += 1;
                let name = Some(name);
                found.first_other.get_or_insert(FirstOther { name, why });
            }
            Ok(Some(Content::Directory(_))) => {}
            Ok(None) => {
                let fault = called_dicom(&path);
                found
                    .unreadable
                    .extend(fault.map(|fault| format!("{name} ({fault})")));
            }
            Err(Fault::System(fault)) => return Err(unreadable("file", &path, folder, fault)),
            Err(Fault::Content(fault)) => found.unreadable.push(format!("{name} ({fault})")),
        }
    }
    Ok(found)
}

/// The fault of a file that is no DICOM, if it may have been: by its name, or, since slices often have none of the common
/// names, because nothing is in it.
fn called_dicom(path: &Path) -> Option<&'static str> {
    // Hidden files are those of other programs. A Mac writes one beside each file on a disk of another system.
    if path.file_name()?.to_string_lossy().starts_with('.') {
        return None;
    }
    let is_empty = std::fs::metadata(path).is_ok_and(|metadata| metadata.len() == 0);
    let is_called = path.extension().map(|extension| {
        ["dcm", "dicom", "ima"].contains(&&*extension.to_string_lossy().to_lowercase())
    });
    match (is_called, is_empty) {
        (Some(true) | None, true) => Some("is empty"),
        (Some(true), false) => Some("is no DICOM file"),
        _ => None,
    }
}

impl Found {
    /// Frames without a place in the patient are volumes of one slice each, unless there are frames that have one.
    fn pass_over_unplaced(&mut self) {
        let is_placed = |frame: &Frame| frame.plane.is_some();
        let mut frames = self.images.iter().flat_map(|image| &image.frames);
        if !frames.any(is_placed) {
            return;
        }
        for image in &mut self.images {
            let count = image.frames.len();
            image.frames.retain(is_placed);
            if image.frames.len() < count {
                *self.others.entry(UNPLACED).or_default() += 1;
            }
        }
        self.images.retain(|image| !image.frames.is_empty());
    }

    /// An image whose pixels cannot be read is no loss where there is the same one, perhaps unpacked, that can be read.
    fn pass_over_unreadable_copies(&mut self) {
        if self.images.iter().all(|image| image.damage.is_none()) {
            return;
        }
        let number = |image: &Image| Some((image.series_uid.clone(), image.instance?));
        let mut readable: HashMap<_, Vec<&Image>> = HashMap::new();
        for image in self.images.iter().filter(|image| image.damage.is_none()) {
            readable.entry(number(image)).or_default().push(image);
        }
        let is_copy = |image: &Image| {
            let mut alike = readable.get(&number(image)).into_iter().flatten();
            image.damage.is_some()
                && image.instance.is_some()
                && alike.any(|other| other.lies_like(image))
        };
        let is_copy: Vec<bool> = self.images.iter().map(is_copy).collect();
        let count = is_copy.iter().filter(|is_copy| **is_copy).count();
        if count > 0 {
            self.others.insert(UNREADABLE_COPY, count);
            let mut is_copy = is_copy.into_iter();
            self.images.retain(|_| is_copy.next() == Some(false));
        }
    }

    /// The reason why there is no volume.
    pub fn why_empty(&self) -> String {
        if let Some(FirstOther { name: None, why }) = &self.first_other {
            return why.clone();
        }
        let mut parts: Vec<String> = Vec::new();
        if !self.others.is_empty() {
            parts.push(self.counted_others());
        }
        parts.extend(self.named_unreadable());
        // Of several kinds, none stands for the others.
        if let (
            Some(FirstOther {
                name: Some(name),
                why,
            }),
            1,
        ) = (&self.first_other, self.others.len())
        {
            parts.push(format!("{name}: {why}"));
        }
        if parts.is_empty() {
            "holds no DICOM image, expected the slices of at least one series".into()
        } else {
            format!("holds no volume, only {}", parts.join("; "))
        }
    }

    /// "3 × localizer, 1 × segmentation".
    pub fn counted_others(&self) -> String {
        let counted = self
            .others
            .iter()
            .map(|(kind, count)| format!("{count} × {kind}"));
        counted.collect::<Vec<_>>().join(", ")
    }

    /// "there are 2 files that cannot be read: …".
    pub fn told_unreadable(&self) -> Option<String> {
        let are = if self.unreadable.len() == 1 {
            "is"
        } else {
            "are"
        };
        let named = self.named_unreadable()?;
        Some(format!("there {are} {named}"))
    }

    /// The first few files that cannot be read, and how many there are.
    fn named_unreadable(&self) -> Option<String> {
        let count = self.unreadable.len();
        let first = first_of(&self.unreadable, MOST_NAMED);
        let files = if count == 1 { "file" } else { "files" };
        (count > 0).then(|| format!("{count} {files} that cannot be read: {first}"))
    }
}
