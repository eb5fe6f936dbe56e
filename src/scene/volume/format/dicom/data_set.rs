//! The kept elements of an object, and their values as texts and numbers.

use crate::scene::volume::parsed::Parsed;

use super::charset::decoded;
use super::syntax::Syntax;
use super::tags::{self, Tag};

/// The kept elements of an object or of a sequence's item.
#[derive(Debug, Clone, Default)]
pub struct DataSet {
    pub(super) elements: Vec<(Tag, Value)>,
}

/// The value of an element.
#[derive(Debug, Clone)]
pub(super) enum Value {
    Plain { bytes: Vec<u8>, syntax: Syntax },
    Items(Vec<DataSet>),
}

impl DataSet {
    fn value(&self, tag: Tag) -> Option<&Value> {
        let found = self.elements.iter().find(|(other, _)| *other == tag);
        found.map(|(_, value)| value)
    }

    fn plain(&self, tag: Tag) -> Option<(&[u8], Syntax)> {
        match self.value(tag)? {
            Value::Plain { bytes, syntax } => Some((bytes, *syntax)),
            Value::Items(_) => None,
        }
    }

    pub fn has(&self, tag: Tag) -> bool {
        self.value(tag).is_some()
    }

    /// The items of a sequence; none if there is no sequence with this tag.
    pub fn items(&self, tag: Tag) -> &[DataSet] {
        match self.value(tag) {
            Some(Value::Items(items)) => items,
            _ => &[],
        }
    }

    /// The first item of a sequence.
    pub fn item(&self, tag: Tag) -> Option<&DataSet> {
        self.items(tag).first()
    }

    /// Text without padding; `None` if it is missing or empty.
    pub fn text(&self, tag: Tag) -> Option<String> {
        let (bytes, _) = self.plain(tag)?;
        let (terms, _) = self
            .plain(tags::CHARACTER_SET)
            .unwrap_or((b"", Syntax::EXPLICIT));
        let text = decoded(bytes, terms);
        let text = text.trim();
        (!text.is_empty()).then(|| text.to_string())
    }

    /// Several texts, which backslashes separate.
    pub fn texts(&self, tag: Tag) -> Vec<String> {
        let text = self.text(tag).unwrap_or_default();
        let parts = text.split('\\').map(|part| part.trim().to_string());
        parts.filter(|_| !text.is_empty()).collect()
    }

    /// Decimal numbers written as text; `None` if they are missing, and a fault if they are no finite numbers.
    pub fn decimals<const N: usize>(&self, tag: Tag, name: &str) -> Parsed<Option<[f64; N]>> {
        let Some(text) = self.text(tag) else {
            return Ok(None);
        };
        // Some writers use a decimal comma.
        let number = |part: &str| part.trim().replace(',', ".").parse::<f64>().ok();
        let numbers: Option<Vec<f64>> = text.split('\\').map(number).collect();
        let finite = numbers.filter(|numbers| numbers.iter().all(|number| number.is_finite()));
        match finite.and_then(|numbers| numbers.try_into().ok()) {
            Some(numbers) => Ok(Some(numbers)),
            None => {
                let found = numeric(&text);
                let expected = match N {
                    1 => "a number".to_string(),
                    _ => format!("{N} numbers"),
                };
                Err(format!("its {name} is `{found}`, expected {expected}"))
            }
        }
    }

    pub fn decimal(&self, tag: Tag, name: &str) -> Parsed<Option<f64>> {
        Ok(self.decimals::<1>(tag, name)?.map(|[number]| number))
    }

    /// All decimal numbers of a list; other entries are left out.
    pub fn decimal_list(&self, tag: Tag) -> Vec<f64> {
        let parts = self.texts(tag).into_iter();
        parts.filter_map(|part| part.parse().ok()).collect()
    }

    pub fn u16(&self, tag: Tag) -> Option<u16> {
        let (bytes, syntax) = self.plain(tag)?;
        bytes.first_chunk().map(|bytes| syntax.endian.u16(*bytes))
    }

    /// Numbers of 16 bits.
    pub fn words(&self, tag: Tag) -> Vec<u16> {
        let Some((bytes, syntax)) = self.plain(tag) else {
            return Vec::new();
        };
        let words = bytes.as_chunks().0.iter();
        words.map(|word| syntax.endian.u16(*word)).collect()
    }

    /// An unsigned number of 16 or 32 bits.
    pub fn whole(&self, tag: Tag) -> Option<u32> {
        let (bytes, syntax) = self.plain(tag)?;
        match bytes {
            [a, b, c, d, ..] => Some(syntax.endian.u32([*a, *b, *c, *d])),
            [a, b, ..] => Some(syntax.endian.u16([*a, *b]).into()),
            _ => None,
        }
    }

    /// A double, or a number written as text.
    pub fn double(&self, tag: Tag) -> Option<f64> {
        let (bytes, syntax) = self.plain(tag)?;
        match bytes.try_into() {
            Ok(bytes) => Some(f64::from_bits(syntax.endian.u64(bytes))),
            Err(_) => self.text(tag)?.parse().ok(),
        }
    }

    /// Exactly so many finite doubles.
    pub fn doubles<const N: usize>(&self, tag: Tag) -> Option<[f64; N]> {
        let numbers: Vec<f64> = self.longs(tag).into_iter().map(f64::from_bits).collect();
        let numbers: [f64; N] = numbers.try_into().ok()?;
        numbers.iter().all(|n| n.is_finite()).then_some(numbers)
    }

    /// Numbers of 64 bits.
    pub fn longs(&self, tag: Tag) -> Vec<u64> {
        let Some((bytes, syntax)) = self.plain(tag) else {
            return Vec::new();
        };
        let longs = bytes.as_chunks().0.iter();
        longs.map(|long| syntax.endian.u64(*long)).collect()
    }
}

/// The part of a text that should be numbers which a message may quote: in a damaged file the rest might be a name.
pub fn numeric(text: &str) -> String {
    let is_numeric = |c: &char| c.is_ascii_digit() || "+-.,eE\\ ".contains(*c);
    let shown = text.chars().take(60);
    shown
        .map(|c| if is_numeric(&c) { c } else { '?' })
        .collect()
}
