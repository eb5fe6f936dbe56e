//! The character set of DICOM's texts (PS3.3, C.12.1.1.2).

use encoding_rs::{
    EUC_KR, Encoding, GB18030, ISO_2022_JP, ISO_8859_2, ISO_8859_3, ISO_8859_4, ISO_8859_5,
    ISO_8859_6, ISO_8859_7, ISO_8859_8, ISO_8859_15, SHIFT_JIS, UTF_8, WINDOWS_874, WINDOWS_1252,
    WINDOWS_1254,
};

/// A text in the character sets that `terms` names, the value of SpecificCharacterSet, without control characters. Where it
/// names none that is known, or none at all, the text is taken for ASCII or UTF-8.
pub fn decoded(text: &[u8], terms: &[u8]) -> String {
    const ESCAPE: u8 = 0x1b;
    let terms = String::from_utf8_lossy(terms);
    let first = terms.split('\\').find_map(encoding).unwrap_or(UTF_8);
    // An escape sequence switches to another set (ISO 2022).
    let mut parts = text.split(|byte| *byte == ESCAPE);
    let mut decoded = by(first, parts.next().unwrap_or_default());
    for part in parts {
        decoded += &match part {
            [b'$', b'B' | b'@', ..] => by(ISO_2022_JP, &[&[ESCAPE], part].concat()),
            [b'$', b')', b'C', rest @ ..] => by(EUC_KR, rest),
            [b'$', b')', b'A', rest @ ..] => by(GB18030, rest),
            [b'(' | b')' | b'-', _, rest @ ..] => by(first, rest),
            other => by(first, other),
        };
    }
    decoded.replace(char::is_control, "")
}

fn by(encoding: &'static Encoding, text: &[u8]) -> String {
    encoding.decode_without_bom_handling(text).0.into_owned()
}

/// The encoding of a term, with or without code extensions; `None` for ASCII, which all of them contain.
fn encoding(term: &str) -> Option<&'static Encoding> {
    let term = term.trim_matches([' ', '\0']);
    let set = term
        .strip_prefix("ISO_IR ")
        .or(term.strip_prefix("ISO 2022 IR "))
        .unwrap_or(term);
    Some(match set {
        "100" => WINDOWS_1252,
        "101" => ISO_8859_2,
        "109" => ISO_8859_3,
        "110" => ISO_8859_4,
        "144" => ISO_8859_5,
        "127" => ISO_8859_6,
        "126" => ISO_8859_7,
        "138" => ISO_8859_8,
        "148" => WINDOWS_1254,
        "203" => ISO_8859_15,
        "166" => WINDOWS_874,
        "13" => SHIFT_JIS,
        "87" | "159" => ISO_2022_JP,
        "149" => EUC_KR,
        "58" | "GB18030" | "GBK" => GB18030,
        "192" => UTF_8,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of the sets with more than Latin letters, these are the standard's own examples (PS3.5, annexes H to K).
    #[test]
    fn texts_are_decoded_as_their_character_set_says() {
        for (terms, bytes, text) in [
            ("", &b"Sch\xc3\xa4del"[..], "Schädel"),
            ("ISO_IR 100", b"Sch\xe4del", "Schädel"),
            (
                "ISO_IR 144",
                b"\xbb\xee\xda\x63e\xdc\xd1yp\xd3",
                "Люкceмбypг",
            ),
            ("\\ISO 2022 IR 87", b"\x1b$B;3ED\x1b(B", "山田"),
            (
                "ISO 2022 IR 13\\ISO 2022 IR 87",
                b"\xd4\xcf \x1b$B;3ED\x1b(J",
                "ﾔﾏ 山田",
            ),
            ("ISO_IR 13", b"\xd4\xcf\xc0\xde", "ﾔﾏﾀﾞ"),
            ("\\ISO 2022 IR 149", b"\x1b$)C\xfb\xf3", "洪"),
            ("GB18030", b"\xcd\xf5", "王"),
            ("ISO_IR 192 ", "Wang^小東".as_bytes(), "Wang^小東"),
        ] {
            assert_eq!(decoded(bytes, terms.as_bytes()), text, "{terms}");
        }
    }
}
