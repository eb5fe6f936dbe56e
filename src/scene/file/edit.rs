//! The changes that the command line makes to a scene: `--set`, and the flags that are short for it.

use std::str::FromStr;

use toml::Value;

use crate::error::figure;
use crate::scene::Side;

/// A change that the command line makes to the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Edit {
    /// The flag as it was typed, for messages.
    pub(super) flag: String,
    pub(super) change: Change,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Change {
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
        let flag = format!("--iso {}", figure(value));
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
