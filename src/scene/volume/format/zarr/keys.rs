//! The names of chunks' files.

use std::path::Path;

/// How the name of a file is made from the position of its chunk.
#[derive(Debug)]
pub struct Keys {
    pub prefix: &'static str,
    pub separator: char,
}

impl Keys {
    pub fn key(&self, place: &[u64]) -> String {
        let prefix = (!self.prefix.is_empty()).then(|| self.prefix.to_string());
        let numbers = place.iter().map(u64::to_string);
        let parts: Vec<String> = prefix.into_iter().chain(numbers).collect();
        parts.join(&self.separator.to_string())
    }

    /// The position of the chunk whose file, seen from the array's folder, has this path.
    pub fn place(&self, path: &Path) -> Option<Vec<u64>> {
        let parts: Option<Vec<&str>> = path.iter().map(|part| part.to_str()).collect();
        let key = parts?.join("/");
        let numbers = match self.prefix {
            "" => &key,
            prefix => key.strip_prefix(prefix)?.strip_prefix(self.separator)?,
        };
        let numbers = numbers.split(self.separator);
        let place: Vec<u64> = numbers.map(|n| n.parse().ok()).collect::<Option<_>>()?;
        (self.key(&place) == key).then_some(place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_chunk_s_key_is_a_place() {
        for (prefix, separator, path, place) in [
            ("c", '/', "c/0/12/3", Some(vec![0, 12, 3])),
            ("c", '.', "c.0.12", Some(vec![0, 12])),
            ("", '.', "7", Some(vec![7])),
            ("", '/', "1/2", Some(vec![1, 2])),
            ("", '/', "1.2", None),
            ("", '.', "1/2", None),
            ("c", '/', "0/1", None),
            ("", '/', "c/0/1", None),
            ("", '.', "01.2", None),
            ("", '.', "+1.2", None),
            ("", '.', ".zarray", None),
            ("", '.', "", None),
            ("", '/', "thumbnails/1", None),
        ] {
            let keys = Keys { prefix, separator };
            assert_eq!(keys.place(Path::new(path)), place, "{path}");
        }
    }
}
