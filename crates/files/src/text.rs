//! Text files, past a byte-order mark.

use crate::kind::{kind, stand_in};
use std::fmt;

/// Why bytes are no text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NoText {
    /// They are something else, in words that complete a sentence that begins with the file's name.
    Other(String),
    /// They are not UTF-8 from this byte on, counted without a byte-order mark.
    NotUtf8 {
        /// How many bytes are UTF-8.
        valid_up_to: usize,
    },
}

impl fmt::Display for NoText {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Other(what) => formatter.write_str(what),
            Self::NotUtf8 { valid_up_to } => write!(formatter, "it is not UTF-8 text: byte {valid_up_to} is none"),
        }
    }
}

/// The bytes after a UTF-8 byte-order mark, if there is one.
pub fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// Bytes as UTF-8 text without a byte-order mark, so that line 1 begins where an editor shows it to begin. Text in UTF-16 or UTF-32 is told from bytes
/// that are no text, and what stands in for a file ([`stand_in`]) from both.
pub fn text(bytes: &[u8]) -> Result<&str, NoText> {
    if let Some(what) = stand_in(bytes) {
        return Err(NoText::Other(what));
    }
    if let Some(encoding) = wide(bytes) {
        return Err(NoText::Other(format!("it is {encoding} text; save it as UTF-8")));
    }
    if let Some(kind) = kind(bytes).filter(|_| !bytes.starts_with(b"#")) {
        return Err(NoText::Other(format!("it is {kind}, not text")));
    }
    std::str::from_utf8(without_mark(bytes)).map_err(|error| NoText::NotUtf8 { valid_up_to: error.valid_up_to() })
}

/// The name of an encoding in words of two or four bytes: by its mark, or by the zeros beside two ASCII letters.
fn wide(bytes: &[u8]) -> Option<&'static str> {
    match bytes {
        [0xff, 0xfe, 0, 0, ..] | [0, 0, 0xfe, 0xff, ..] => Some("UTF-32"),
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => Some("UTF-16"),
        [1..=0x7f, 0, 1..=0x7f, 0, ..] | [0, 1..=0x7f, 0, 1..=0x7f, ..] => Some("UTF-16"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_skipped_and_other_encodings_named() {
        assert_eq!(text(b"\xef\xbb\xbf(a: 1)"), Ok("(a: 1)"));
        assert_eq!(text(b"(a: 1)"), Ok("(a: 1)"));
        assert_eq!(text(b"\xef\xbb\xbf"), Ok(""));
        let utf16 = |text: &str| text.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<u8>>();
        for bytes in [utf16("\u{feff}(a: 1)"), utf16("(a: 1)"), vec![0xfe, 0xff, 0, b'(', 0, b')'], vec![0, b'(', 0, b')']] {
            let message = text(&bytes).map_err(|error| error.to_string());
            assert_eq!(message, Err("it is UTF-16 text; save it as UTF-8".into()));
        }
        assert_eq!(text(b"(a: \xff)"), Err(NoText::NotUtf8 { valid_up_to: 4 }));
        assert_eq!(text(b"\xef\xbb\xbf(a: \xff)"), Err(NoText::NotUtf8 { valid_up_to: 4 }));
        let other = |bytes: &[u8]| text(bytes).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(other(b"glTF\x02\0\0\0").contains("a binary glTF file, not text"));
        assert!(other(b"version https://git-lfs.github.com/spec/v1\n").contains("Git LFS pointer"));
        // A comment is text, however it begins.
        assert!(text(b"#?odd").is_ok());
    }
}
