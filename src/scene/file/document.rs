//! The TOML as typed by the user, before it is interpreted: keys, values, and their origins.
//!
//! `--set` and its shorthands change this document, so that their values pass the same checks as a line in the file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use toml::Value;
use toml::de::DeTable;

use super::edit::{Change, Edit};
use super::origins::{Lines, Origins, first_of_two};
use super::{SceneFile, mismatch};
use crate::error::{Error, Location, Origin, Result, figure};

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

/// What the parser says of a key that it has seen before.
const DUPLICATE: &str = "duplicate key";

#[derive(Debug, Clone)]
pub struct Document {
    root: Value,
    origins: Origins,
}

impl Document {
    pub fn read(path: &Path) -> Result<Document> {
        let bytes = std::fs::read(path).map_err(|error| Error::io(path, error))?;
        let text = String::from_utf8(bytes).map_err(|error| {
            let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
            let line = 1 + valid.iter().filter(|&&byte| byte == b'\n').count();
            let file = path.display().to_string();
            Error::input(
                Location::from(Origin::Line { file, line }),
                "found a byte that is no UTF-8, expected a scene file, which is text in UTF-8",
            )
        })?;
        Document::parse(&text, path)
    }

    /// `path` gives messages their file name, and relative paths their folder.
    pub fn parse(text: &str, path: &Path) -> Result<Document> {
        let name = path.display().to_string();
        let syntax = |error: toml::de::Error| {
            let span = error.span().unwrap_or_default();
            let (file, line) = (name.clone(), Lines::of(text).line_at(span.start));
            let location = Location::from(Origin::Line { file, line });
            let problem = error.message().replace('\n', ", ");
            let is_doubled = problem == DUPLICATE;
            match is_doubled.then(|| first_of_two(text, span)).flatten() {
                Some((key, first)) => Error::input(
                    location.with_key(key),
                    format!("found a second time, expected once; it is on line {first} as well"),
                ),
                None => Error::input(location, format!("not valid TOML: {problem}")),
            }
        };
        let spanned = DeTable::parse(text).map_err(syntax)?;
        let root = text.parse().map(Value::Table).map_err(syntax)?;
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let mut document = Document::new(root, name.clone(), folder);
        document
            .origins
            .record_lines(&Lines::of(text), "", spanned.get_ref());
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
                    Location::flag(&edit.flag),
                    format!(
                        "the scene has {n} isosurfaces: choose one with --set surfaces.iso.0.value={}",
                        figure(*value)
                    ),
                )),
            },
            Change::View(view) => {
                if let Some(Origin::Flag(other)) = self.origins.places.get("camera.eye") {
                    let problem = format!("contradicts {other}: expected one of them");
                    return Err(Error::input(Location::flag(&edit.flag), problem));
                }
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
            return Err(Error::input(Location::flag(&edit.flag), problem));
        }
        let known = |n: &usize| find(&self.root, &steps[..*n].join(".")).is_some();
        let is_known = known(&steps.len());
        let first_new = (1..steps.len()).find(|n| !known(n)).unwrap_or(steps.len());
        put(&mut self.root, &steps, value)
            .map_err(|problem| Error::input(Location::flag(&edit.flag), problem))?;
        let inside = format!("{key}.");
        let places = &mut self.origins.places;
        places.retain(|other, _| !other.starts_with(&inside));
        // Tables that this has added were written by the flag as well.
        for n in first_new..=steps.len() {
            places.insert(steps[..n].join("."), Origin::Flag(edit.flag.clone()));
        }
        // So was the length of an array to which it has added a number.
        if let [array @ .., last] = &steps[..]
            && first_new == steps.len()
            && !is_known
            && last.parse::<usize>().is_ok()
        {
            places.insert(array.join("."), Origin::Flag(edit.flag.clone()));
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
