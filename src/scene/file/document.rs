//! The TOML as typed by the user, before it is interpreted: keys, values, and their origins.
//!
//! `--set` and its shorthands change this document, so that their values pass the same checks as a line in the file.
//! Every key remembers its line or its flag; an error about a key names that place without any code having to pass it
//! along.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use toml::Value;
use toml::de::{DeTable, DeValue};

use super::{SceneFile, mismatch};
use crate::error::{Error, Origin, Place, Result};
use crate::scene::Side;

/// An upper bound of the names in a key: a document with a deeper one is dropped by recursion, for which the stack
/// may be too small.
const MOST_STEPS: usize = 8;

/// Keys of the camera that a flag may set, and what each replaces in the file.
const RIVALS: [[&str; 2]; 5] = [
    ["camera.view", "eye"],
    ["camera.view", "up"],
    ["camera.eye", "view"],
    ["camera.fov_y", "orthographic"],
    ["camera.orthographic", "fov_y"],
];

/// The keys of which a scene has one table at most.
const TABLES: [&str; 5] = ["volume", "medium", "surfaces", "camera", "render"];
/// The keys of which it has a list of tables.
const LISTS: [&str; 4] = ["medium.transfer", "surfaces.iso", "light", "clip"];

#[derive(Debug, Clone)]
pub struct Document {
    root: Value,
    origins: Origins,
}

/// Where each key of a scene was written.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Origins {
    /// The file's name, which stands for the whole scene.
    name: String,
    /// The folder at which relative paths start.
    folder: PathBuf,
    /// The origin of each dotted key, such as `light.0.direction`.
    places: BTreeMap<String, Origin>,
}

impl Origins {
    /// An input error at a key: its file and line, or its flag, and the key.
    pub fn error(&self, key: &str, problem: impl Display) -> Error {
        Error::input(self.place(key).with_key(key), problem.to_string())
    }

    /// A note about a key, which is no error.
    pub fn sentence(&self, key: &str, problem: impl Display) -> String {
        format!("{}{problem}", self.place(key).with_key(key))
    }

    /// A path as written in the scene, relative to the current directory.
    pub fn path(&self, written: &Path) -> PathBuf {
        self.folder.join(written)
    }

    /// The origin of a key, or of its table if the key was not written.
    fn place(&self, key: &str) -> Place {
        match self.places.get(key) {
            Some(origin) => origin.clone().into(),
            None => match key.rsplit_once('.') {
                Some((table, _)) => self.place(table),
                None => Place::file(&self.name),
            },
        }
    }

    fn record_lines(&mut self, text: &str, prefix: &str, table: &DeTable) {
        for (key, value) in table {
            let path = join(prefix, key.get_ref());
            self.record(text, path, key.span().start, value.get_ref());
        }
    }

    fn record(&mut self, text: &str, path: String, at: usize, value: &DeValue) {
        match value {
            DeValue::Table(table) => self.record_lines(text, &path, table),
            DeValue::Array(items) => {
                for (i, item) in items.iter().enumerate() {
                    let path = join(&path, &i.to_string());
                    self.record(text, path, item.span().start, item.get_ref());
                }
            }
            _ => {}
        }
        let file = self.name.clone();
        let line = line_at(text, at);
        self.places.insert(path, Origin::Line { file, line });
    }
}

fn join(prefix: &str, key: &str) -> String {
    match prefix {
        "" => key.to_string(),
        _ => format!("{prefix}.{key}"),
    }
}

fn line_at(text: &str, at: usize) -> usize {
    let before = &text.as_bytes()[..at.min(text.len())];
    before.iter().filter(|byte| **byte == b'\n').count() + 1
}

impl Document {
    pub fn read(path: &Path) -> Result<Document> {
        let text = std::fs::read_to_string(path).map_err(|error| Error::io(path, error))?;
        Document::parse(&text, path)
    }

    /// `path` gives messages their file name, and relative paths their folder.
    pub fn parse(text: &str, path: &Path) -> Result<Document> {
        let name = path.display().to_string();
        let syntax = |error: toml::de::Error| {
            let line = line_at(text, error.span().map_or(0, |span| span.start));
            let problem = error.message().replace('\n', ", ");
            let file = name.clone();
            Error::input(
                Origin::Line { file, line },
                format!("not valid TOML: {problem}"),
            )
        };
        let spanned = DeTable::parse(text).map_err(syntax)?;
        let root = text.parse().map(Value::Table).map_err(syntax)?;
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let mut document = Document::new(root, name.clone(), folder);
        document.origins.record_lines(text, "", spanned.get_ref());
        document.check_tables()?;
        Ok(document)
    }

    /// A scene that was not read from a file; relative paths start in the current directory.
    pub fn made(scene: &SceneFile, name: String) -> Document {
        let root = Value::try_from(scene).expect("a scene file is representable as TOML");
        Document::new(root, name, PathBuf::new())
    }

    fn new(root: Value, name: String, folder: PathBuf) -> Document {
        let places = BTreeMap::new();
        let origins = Origins {
            name,
            folder,
            places,
        };
        Document { root, origins }
    }

    pub fn apply(&mut self, edits: &[Edit]) -> Result<()> {
        edits.iter().try_for_each(|edit| self.change(edit))
    }

    fn change(&mut self, edit: &Edit) -> Result<()> {
        match &edit.change {
            Change::Set { key, value } => {
                self.drop_rivals(key);
                self.set(edit, key, value.clone())
            }
            Change::Iso(value) => match self.isosurfaces() {
                0 | 1 => self.set(edit, "surfaces.iso.0.value", Value::Float(*value)),
                n => Err(Error::input(
                    Place::flag(&edit.flag),
                    format!(
                        "the scene has {n} isosurfaces: choose one with --set surfaces.iso.0.value={value}"
                    ),
                )),
            },
            Change::View(view) => {
                self.drop_camera_key("eye");
                self.drop_rivals("camera.view");
                self.set(edit, "camera.view", view.clone())
            }
        }
    }

    /// Drops what `key` replaces in the file; what another flag says still counts.
    fn drop_rivals(&mut self, key: &str) {
        for [_, old] in RIVALS.iter().filter(|[new, _]| *new == key) {
            let origin = self.origins.places.get(&format!("camera.{old}"));
            if !matches!(origin, Some(Origin::Flag(_))) {
                self.drop_camera_key(old);
            }
        }
    }

    fn drop_camera_key(&mut self, key: &str) {
        if let Some(camera) = self.root.get_mut("camera").and_then(Value::as_table_mut) {
            camera.remove(key);
        }
    }

    fn isosurfaces(&self) -> usize {
        let iso = find(&self.root, "surfaces.iso");
        iso.and_then(Value::as_array).map_or(0, Vec::len)
    }

    fn set(&mut self, edit: &Edit, key: &str, value: Value) -> Result<()> {
        let steps: Vec<&str> = key.split('.').collect();
        if steps.len() > MOST_STEPS {
            let problem = format!(
                "found a key of {} names, expected at most {MOST_STEPS}, as in surfaces.iso.0.color.1",
                steps.len()
            );
            return Err(Error::input(Place::flag(&edit.flag), problem));
        }
        let known = |n: &usize| find(&self.root, &steps[..*n].join(".")).is_some();
        let first_new = (1..steps.len()).find(|n| !known(n)).unwrap_or(steps.len());
        put(&mut self.root, &steps, value)
            .map_err(|problem| Error::input(Place::flag(&edit.flag), problem))?;
        let inside = format!("{key}.");
        let places = &mut self.origins.places;
        places.retain(|other, _| !other.starts_with(&inside));
        // Tables that this has added were written by the flag as well.
        for n in first_new..=steps.len() {
            places.insert(steps[..n].join("."), Origin::Flag(edit.flag.clone()));
        }
        Ok(())
    }

    /// Fails where an array or a number stands for a table: serde would take an array for the table's values in order.
    fn check_tables(&self) -> Result<()> {
        let wrong = |key: &str, found: &Value, expected: String| {
            let found = mismatch::shown(found);
            let problem = format!("found {found}, expected {expected}");
            Err(self.origins.error(key, problem))
        };
        for key in TABLES {
            match find(&self.root, key) {
                None | Some(Value::Table(_)) => {}
                Some(Value::Array(items)) if items.iter().any(Value::is_table) => {
                    let problem = format!("found [[{key}]], expected [{key}]: there is one {key}");
                    return Err(self.origins.error(key, problem));
                }
                Some(other) => return wrong(key, other, format!("a table: [{key}]")),
            }
        }
        for key in LISTS {
            match find(&self.root, key) {
                None => {}
                Some(Value::Array(items)) => {
                    if let Some(n) = items.iter().position(|item| !item.is_table()) {
                        let item = format!("{key}.{n}");
                        return wrong(&item, &items[n], format!("a table: [[{key}]]"));
                    }
                }
                Some(other) => return wrong(key, other, format!("an array of tables: [[{key}]]")),
            }
        }
        Ok(())
    }

    /// The document with its meaning: every key known, every value of the right kind and in range.
    pub fn typed(self) -> Result<SceneFile> {
        self.check_tables()?;
        let parsed: Result<SceneFile, _> = serde_path_to_error::deserialize(self.root.clone());
        let mut file = parsed.map_err(|error| {
            let (key, problem) = mismatch::explain(&error, |key| find(&self.root, key));
            self.origins.error(&key, problem)
        })?;
        file.origins = self.origins;
        file.check()?;
        Ok(file)
    }
}

/// The value at a dotted key.
fn find<'a>(root: &'a Value, key: &str) -> Option<&'a Value> {
    key.split('.').try_fold(root, |place, step| match place {
        Value::Array(items) => items.get(step.parse::<usize>().ok()?),
        table => table.get(step),
    })
}

/// Puts `value` at the key `steps`, adding tables and arrays on the way.
fn put(place: &mut Value, steps: &[&str], value: Value) -> Result<(), String> {
    let Some((step, rest)) = steps.split_first() else {
        *place = value;
        return Ok(());
    };
    let next = match place {
        Value::Table(table) => table.entry(*step).or_insert_with(|| container(rest)),
        Value::Array(items) => {
            let index: usize = step
                .parse()
                .map_err(|_| format!("found `{step}`, expected an index, as in surfaces.iso.0"))?;
            match index.cmp(&items.len()) {
                std::cmp::Ordering::Less => {}
                std::cmp::Ordering::Equal => items.push(container(rest)),
                std::cmp::Ordering::Greater => {
                    let n = items.len();
                    return Err(format!(
                        "found index {index}, expected 0 to {n} ({n} adds one)"
                    ));
                }
            }
            &mut items[index]
        }
        other => {
            return Err(format!(
                "`{step}` would be inside {other}, which is no table"
            ));
        }
    };
    put(next, rest, value)
}

fn container(steps: &[&str]) -> Value {
    match steps.first() {
        Some(step) if step.parse::<usize>().is_ok() => Value::Array(Vec::new()),
        _ => Value::Table(toml::Table::new()),
    }
}

/// A change that the command line makes to the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Edit {
    /// The flag as it was typed, for messages.
    flag: String,
    change: Change,
}

#[derive(Debug, Clone, PartialEq)]
enum Change {
    /// `key` is dotted, array indices included.
    Set { key: String, value: Value },
    /// The value of the only isosurface; adds one where there is none.
    Iso(f64),
    /// The named side, in place of the eye in the file.
    View(Value),
}

impl Edit {
    /// `flag` is what the user typed, for messages.
    pub fn set(flag: String, key: &str, value: Value) -> Edit {
        let key = key.to_string();
        let change = Change::Set { key, value };
        Edit { flag, change }
    }

    pub fn iso(value: f64) -> Edit {
        let flag = format!("--iso {value}");
        let change = Change::Iso(value);
        Edit { flag, change }
    }

    pub fn view(view: Side) -> Edit {
        let name = Value::try_from(view).expect("a view is its name");
        let flag = format!("--view {}", name.as_str().unwrap_or_default());
        let change = Change::View(name);
        Edit { flag, change }
    }

    /// What the user typed.
    pub(in crate::scene) fn flag(&self) -> &str {
        &self.flag
    }

    /// The named side that it looks from, if it sets one.
    pub(in crate::scene) fn named_view(&self) -> Option<Side> {
        match &self.change {
            Change::View(name) => name.clone().try_into().ok(),
            Change::Set { key, value } if key == "camera.view" => value.clone().try_into().ok(),
            _ => None,
        }
    }

    pub(in crate::scene) fn sets(&self, wanted: &str) -> bool {
        matches!(&self.change, Change::Set { key, .. } if key == wanted)
    }

    /// Whether it concerns the volume, which is read before a preset can use it.
    pub(in crate::scene) fn is_about_volume(&self) -> bool {
        matches!(&self.change, Change::Set { key, .. } if key.split('.').next() == Some("volume"))
    }
}

/// `KEY=VALUE` of `--set`: the value is TOML, or else a number or a bare string.
impl FromStr for Edit {
    type Err = String;

    fn from_str(text: &str) -> Result<Edit, String> {
        let (key, value) = text
            .split_once('=')
            .ok_or("expected KEY=VALUE, as in medium.g=0.5")?;
        let (key, value) = (key.trim().replace('[', ".").replace(']', ""), value.trim());
        if key.split('.').any(str::is_empty) {
            return Err("expected a dotted key before `=`, as in surfaces.iso.0.value=900".into());
        }
        // Numbers such as `.5` and `1.` are none in TOML.
        let number = || value.parse().ok().filter(|number: &f64| number.is_finite());
        let value = value.parse().unwrap_or_else(|_| match number() {
            Some(number) => Value::Float(number),
            None => Value::String(value.into()),
        });
        Ok(Edit::set(format!("--set {text}"), &key, value))
    }
}
