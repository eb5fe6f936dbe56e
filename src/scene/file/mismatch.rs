//! Turns serde's errors about a value into sentences in the user's words.
//!
//! serde says what it expected only in prose ("invalid type: string \"abc\", expected f64"). The prose is stable, and the
//! sentences that are made of it are tested; what was *found* is looked up in the document, which shows it as typed.

use serde_path_to_error::Segment;
use toml::Value;

/// The dotted key that is wrong, and what is wrong with it. `value_of` looks a key up in the document.
pub fn explain<'a>(
    error: &serde_path_to_error::Error<toml::de::Error>,
    value_of: impl FnOnce(&str) -> Option<&'a Value>,
) -> (String, String) {
    let steps = error.path().iter().filter_map(|segment| match segment {
        Segment::Seq { index } => Some(index.to_string()),
        Segment::Map { key } => Some(key.clone()),
        Segment::Enum { .. } | Segment::Unknown => None,
    });
    let key = steps.collect::<Vec<_>>().join(".");
    let message = error.inner().message();
    let (name, known) = quoted(message);
    if message.starts_with("unknown field") {
        (key, format!("unknown key{}", suggestion(name, &known)))
    } else if message.starts_with("missing field") {
        let key = format!("{key}.{name}");
        (key, "missing, and it has no default".to_string())
    } else if message.starts_with("unknown variant") {
        let suggestion = suggestion(name, &known);
        (key, format!("found \"{name}\"{suggestion}"))
    } else {
        let expected = message
            .rsplit_once("expected ")
            .map_or(message, |(_, what)| what);
        let found = value_of(&key).map_or("nothing".to_string(), shown);
        let problem = format!("found {found}, expected {}", in_words(expected, &key));
        (key, problem)
    }
}

/// The name that a message is about, which is quoted in backticks and may have others in it, and the known names that
/// it lists.
fn quoted(message: &str) -> (&str, Vec<&str>) {
    let (about, list) = message
        .rsplit_once("`, expected ")
        .unwrap_or((message.trim_end_matches('`'), ""));
    let name = about.split_once('`').map_or("", |(_, name)| name);
    (name, list.split('`').skip(1).step_by(2).collect())
}

/// The known name that is most similar to the one found, if any is similar, and all known names.
fn suggestion(found: &str, known: &[&str]) -> String {
    let found = found.to_lowercase();
    let nearness = |name: &&&str| strsim::jaro_winkler(&found, name);
    let nearest = known
        .iter()
        .max_by(|a, b| nearness(a).total_cmp(&nearness(b)));
    let all = known.join(", ");
    match nearest {
        Some(name) if nearness(&name) > 0.7 => {
            format!("; did you mean \"{name}\"? It can be {all}")
        }
        _ => format!("; it can be {all}"),
    }
}

/// A value as it was typed, shortened.
pub fn shown(value: &Value) -> String {
    const LONGEST: usize = 60;
    let text = match value {
        Value::Table(_) => "a table".to_string(),
        Value::Float(number) => format!("{number:?}"),
        other => other.to_string(),
    };
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}

/// What serde says of an array that is too short.
fn length_of(key: &str) -> &'static str {
    match key {
        "volume.crop" | "render.size" => "an array of length 2",
        _ => "an array of length 3",
    }
}

/// What was expected of the value of `key`.
fn in_words(expected: &str, key: &str) -> String {
    match expected {
        "f32" | "f64" => "a number".to_string(),
        "u32" => format!("a whole number from 0 to {}", u32::MAX),
        "fewer elements in array" => in_words(length_of(key), key),
        "string only" => "a word in quotes".to_string(),
        "a sequence" => "an array".to_string(),
        "path string" => "a path in quotes".to_string(),
        "an array of length 2" if key == "volume.crop" => {
            "two corners, as in [[0, 0, 0], [64, 64, 64]]".to_string()
        }
        "an array of length 2" => "two numbers, as in [1, 2]".to_string(),
        "an array of length 3" => "three numbers, as in [1, 2, 3]".to_string(),
        structure if structure.starts_with("struct ") => "a table".to_string(),
        other => other.to_string(),
    }
}
