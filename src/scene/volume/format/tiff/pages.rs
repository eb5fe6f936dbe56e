//! The pages of a stack as a source of voxels, in the byte order of the first.

use std::path::PathBuf;

use super::page::Page;
use crate::scene::volume::parsed::Parsed;
use crate::scene::volume::source::chunked::{Chunks, Content};

/// A page with its file's name, for messages.
pub fn named(page: &Page, z: usize, depth: usize) -> String {
    let name = page.file.path().file_name().unwrap_or_default();
    format!("page {} of {depth} (in {})", z + 1, name.to_string_lossy())
}

#[derive(Debug)]
pub struct Pages {
    pub pages: Vec<Page>,
    /// Whether the user has named a folder, and each page is a file in it.
    pub is_folder: bool,
    pub sample: u32,
    /// Whether all pages have the same strips or tiles; otherwise pages are decoded as a whole.
    pub is_alike: bool,
}

impl Chunks for Pages {
    fn files(&self) -> Vec<PathBuf> {
        let mut paths: Vec<PathBuf> = Vec::new();
        for page in &self.pages {
            let path = page.file.path();
            // Pages of one file follow one another.
            if paths.last().is_none_or(|last| last != path) {
                paths.push(path.to_path_buf());
            }
        }
        paths
    }

    fn decode(&self, [column, row, z]: [u32; 3]) -> Parsed<Content> {
        let page = &self.pages[z as usize];
        let decoded = if self.is_alike {
            page.decode([column, row], self.sample)
        } else {
            page.decode_whole(self.sample)
        };
        let pixels = decoded.map_err(|fault| match (self.is_folder, self.pages.len()) {
            (true, count) => format!("{}: {fault}", named(page, z as usize, count)),
            (false, 1) => fault,
            (false, count) => format!("page {} of {count}: {fault}", z + 1),
        })?;
        let first = &self.pages[0].layout;
        Ok(Content::Voxels(if page.layout.endian == first.endian {
            pixels
        } else {
            swapped(pixels, first.voxel_type.bytes())
        }))
    }
}

/// The same numbers in the other byte order.
fn swapped(mut pixels: Vec<u8>, size: usize) -> Vec<u8> {
    pixels.chunks_exact_mut(size).for_each(<[u8]>::reverse);
    pixels
}
