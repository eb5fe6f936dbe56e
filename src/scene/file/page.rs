//! Lines of a scene file: keys, values, and comments that state units.

use serde::Serialize;
use toml::Value;

/// TOML under construction.
#[derive(Default)]
pub(super) struct Page {
    pub text: String,
}

impl Page {
    pub fn table(&mut self, header: &str) {
        self.text += &format!("\n{header}\n");
    }

    pub fn comment(&mut self, comment: &str) {
        self.text += &format!("# {comment}\n");
    }

    pub fn line(&mut self, key: &str, value: impl Serialize, comment: &str) {
        let value = Value::try_from(value).expect("scene values are representable as TOML");
        let line = format!("{key} = {value}");
        match comment {
            "" => self.text += &format!("{line}\n"),
            _ => self.text += &format!("{line:<40} # {comment}\n"),
        }
    }

    /// Writes a key that the user has set, or else a comment with the value from the volume's own file.
    pub fn line_or_comment<T: Serialize>(
        &mut self,
        key: &str,
        given: Option<T>,
        known: T,
        why: &str,
    ) {
        match given {
            Some(value) => self.line(key, value, why),
            None => self.unset(|page| page.line(key, known, why)),
        }
    }

    /// Writes an example of what the user has not set, as comments.
    pub fn unset(&mut self, write: impl FnOnce(&mut Page)) {
        let mut example = Page::default();
        write(&mut example);
        for line in example.text.lines() {
            self.text += &match line {
                "" => "\n".to_string(),
                _ => format!("# {line}\n"),
            };
        }
    }
}
