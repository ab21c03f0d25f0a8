//! Character encoding of a data file: stated, by its byte order mark, or detected from its bytes.
//!
//! Text that is not UTF-8 and has no mark is read as Latin-1, as the WHATWG Encoding Standard defines it
//! (windows-1252). Numbers and the column names of western languages are then correct. UTF-16 without a mark is
//! recognised by the zero bytes of its ASCII letters.

use std::borrow::Cow;

use encoding_rs::{Encoding, UTF_8, UTF_16BE, UTF_16LE, WINDOWS_1252};

/// An encoding by one of its names, in any case: `utf-8`, `latin1`, `utf-16le`, `shift_jis`, …; `None` for an unknown
/// name.
pub(crate) fn of_name(name: &str) -> Option<&'static Encoding> {
    let name = name.trim();
    // `Latin-1` is not a label of the standard, `latin1` is.
    let plain: String = name.to_lowercase().chars().filter(|c| c.is_ascii_alphanumeric()).collect();
    match plain.as_str() {
        "utf16" | "utf16le" => Some(UTF_16LE),
        "utf16be" => Some(UTF_16BE),
        "cp1252" | "ansi" => Some(WINDOWS_1252),
        _ => Encoding::for_label_no_replacement(name.as_bytes())
            .or_else(|| Encoding::for_label_no_replacement(plain.as_bytes())),
    }
}

/// The name of an encoding in messages.
pub(crate) fn name_of(encoding: &'static Encoding) -> &'static str {
    if encoding == WINDOWS_1252 { "Latin-1 (windows-1252)" } else { encoding.name() }
}

/// The encoding by the first bytes of a file, and the length of its byte order mark. A mark overrides a stated
/// encoding.
pub(crate) fn of_start(bytes: &[u8], stated: Option<&'static Encoding>) -> (Option<&'static Encoding>, usize) {
    if let Some((encoding, mark)) = Encoding::for_bom(bytes) {
        return (Some(encoding), mark);
    }
    if stated.is_some() {
        return (stated, 0);
    }
    let is_ascii = |byte: u8| byte == b'\t' || byte == b'\n' || byte == b'\r' || (0x20..0x7f).contains(&byte);
    match bytes {
        [a, 0, b, 0, ..] if is_ascii(*a) && is_ascii(*b) => (Some(UTF_16LE), 0),
        [0, a, 0, b, ..] if is_ascii(*a) && is_ascii(*b) => (Some(UTF_16BE), 0),
        _ => (None, 0),
    }
}

/// Decodes bytes to text and returns the encoding used. The error is the encoding in which the bytes are invalid.
///
/// Without a stated encoding: UTF-8, else Latin-1, in which every byte is a character.
pub(crate) fn decode<'b>(
    bytes: &'b [u8],
    encoding: Option<&'static Encoding>,
) -> Result<(Cow<'b, str>, &'static Encoding), &'static Encoding> {
    let valid = |encoding: &'static Encoding| {
        encoding.decode_without_bom_handling_and_without_replacement(bytes).map(|text| (text, encoding)).ok_or(encoding)
    };
    match encoding {
        Some(encoding) => valid(encoding),
        None => valid(UTF_8).or_else(|_| valid(WINDOWS_1252)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_in_any_case() {
        for name in ["latin1", "Latin-1", "iso-8859-1", "ISO8859-1", "windows-1252", "cp1252"] {
            assert_eq!(of_name(name).map(Encoding::name), Some("windows-1252"), "{name}");
        }
        assert_eq!(of_name("UTF-16").map(Encoding::name), Some("UTF-16LE"));
        assert_eq!(of_name("utf_16be").map(Encoding::name), Some("UTF-16BE"));
        assert_eq!(of_name("utf8").map(Encoding::name), Some("UTF-8"));
        assert_eq!(of_name("klingon"), None);
    }

    #[test]
    fn the_first_bytes_determine_the_encoding() {
        let of = |bytes: &[u8]| {
            let (encoding, mark) = of_start(bytes, None);
            (encoding.map(Encoding::name), mark)
        };
        assert_eq!(of(b"\xff\xfex\0"), (Some("UTF-16LE"), 2));
        assert_eq!(of(b"\xfe\xff\0x"), (Some("UTF-16BE"), 2));
        assert_eq!(of(b"\xef\xbb\xbfx"), (Some("UTF-8"), 3));
        assert_eq!(of(b"x\0y\0"), (Some("UTF-16LE"), 0));
        assert_eq!(of(b"\0x\0y"), (Some("UTF-16BE"), 0));
        assert_eq!(of(b"x,y"), (None, 0));
    }

    #[test]
    fn text_that_is_not_utf_8_is_latin_1_unless_another_encoding_is_stated() {
        let (text, encoding) = decode(b"L\xe4nge", None).unwrap();
        assert_eq!((text.as_ref(), encoding.name()), ("Länge", "windows-1252"));
        let (text, encoding) = decode("Länge".as_bytes(), None).unwrap();
        assert_eq!((text.as_ref(), encoding.name()), ("Länge", "UTF-8"));
        assert_eq!(decode(b"L\xe4nge", Some(UTF_8)).unwrap_err().name(), "UTF-8");
    }
}
