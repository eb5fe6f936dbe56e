//! A temporary folder for the program to work in, and the real binary, about to run there.

#![allow(dead_code)] // The window's tests use less of it than the program's.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use exr::prelude::{FlatImage, read_all_flat_layers_from_file};
use serde_json::Value;
use tempfile::TempDir;

pub struct Folder(TempDir);

impl Folder {
    pub fn empty() -> Folder {
        Folder(TempDir::new().expect("a temporary folder"))
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, bytes: &[u8]) {
        fs::write(self.path(name), bytes).expect("a file");
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    pub fn json(&self, name: &str) -> Value {
        serde_json::from_slice(&self.read(name)).expect("JSON")
    }

    pub fn exr(&self, name: &str) -> FlatImage {
        read_all_flat_layers_from_file(self.path(name)).expect("an EXR")
    }

    /// The names of all files, hidden ones too, in order.
    pub fn names(&self) -> Vec<String> {
        self.names_in("")
    }

    /// The same of a folder in this one.
    pub fn names_in(&self, folder: &str) -> Vec<String> {
        let entries = fs::read_dir(self.path(folder)).expect("the folder");
        let name = |entry: std::io::Result<fs::DirEntry>| entry.unwrap().file_name();
        let mut names: Vec<String> = entries
            .map(|e| name(e).into_string().expect("UTF-8"))
            .collect();
        names.sort();
        names
    }

    /// A shell, about to do what `first` says, and then to become the program with these words.
    pub fn shell(&self, first: &str, arguments: &str) -> Command {
        let program = env!("CARGO_BIN_EXE_isolume");
        let mut command = Command::new("sh");
        command
            .args(["-c", &format!("{first} exec {program} {arguments}")])
            .current_dir(self.0.path())
            .env("ISOLUME_VALIDATION", "1");
        command
    }

    /// The program, about to run in this folder with these words.
    pub fn isolume(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_isolume"));
        command
            .args(arguments.split_whitespace())
            .current_dir(self.0.path())
            .env("ISOLUME_VALIDATION", "1");
        command
    }
}
