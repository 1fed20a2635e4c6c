//! Where in a RON file something is written.
//!
//! `ron` tells positions of what it cannot parse, not of values that parse and turn out to be wrong. This finds a key again by walking the text's
//! tokens, so that comments and longer words that contain the key are not taken for it.

use std::ops::Range;

/// One step on the way to a place.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Step<'a> {
    /// A field: a word with a colon after it.
    Field(&'a str),
    /// A quoted string.
    Quoted(&'a str),
    /// The field of that name that comes after so many others of it.
    Nth(&'a str, usize),
}

/// Line and column, from 1, of the last step of `path` that is found, each after the step before it.
pub(crate) fn of(text: &str, path: &[Step<'_>]) -> (usize, usize) {
    let mut found = 0;
    let mut steps = path.iter();
    let mut step = steps.next();
    let mut passed = 0;
    for token in tokens(text) {
        let written = &text[token.clone()];
        let is_field = |field: &str| written == field && text[token.end..].trim_start().starts_with(':');
        let fits = match step {
            None => break,
            Some(Step::Field(field)) => is_field(field),
            Some(Step::Nth(field, others)) => {
                passed += usize::from(is_field(field));
                is_field(field) && passed == others + 1
            }
            Some(Step::Quoted(name)) => written.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')) == Some(name),
        };
        if fits {
            found = token.start;
            step = steps.next();
        }
    }
    let before = &text[..found];
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

/// Words and quoted strings, in order; no comments.
fn tokens(text: &str) -> impl Iterator<Item = Range<usize>> + '_ {
    let bytes = text.as_bytes();
    let is_word = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_';
    let mut at = 0;
    std::iter::from_fn(move || {
        while at < bytes.len() {
            let start = at;
            match (bytes[at], bytes.get(at + 1)) {
                (b'/', Some(b'/')) => at = text[at..].find('\n').map_or(bytes.len(), |length| at + length),
                (b'/', Some(b'*')) => at = block_comment_end(bytes, at),
                (b'"', _) => {
                    at += 1;
                    while at < bytes.len() && bytes[at] != b'"' {
                        at += if bytes[at] == b'\\' { 2 } else { 1 };
                    }
                    at = (at + 1).min(bytes.len());
                    return Some(start..at);
                }
                (byte, _) if is_word(byte) => {
                    while at < bytes.len() && is_word(bytes[at]) {
                        at += 1;
                    }
                    return Some(start..at);
                }
                _ => at += 1,
            }
        }
        None
    })
}

/// RON's block comments nest.
fn block_comment_end(bytes: &[u8], start: usize) -> usize {
    let (mut at, mut depth) = (start, 0usize);
    while at + 1 < bytes.len() {
        match &bytes[at..at + 2] {
            b"/*" => (at, depth) = (at + 2, depth + 1),
            b"*/" => (at, depth) = (at + 2, depth - 1),
            _ => at += 1,
        }
        if depth == 0 {
            return at;
        }
    }
    bytes.len()
}

#[cfg(test)]
mod tests {
    use super::{Step::*, of};

    const TEXT: &str = "(\n  // materials: a comment\n  gltf: \"materials\", /* lights /* nested */ lights */\n  materials_more: 1,\n  materials : {\n    \"Göld\": (roughness: 1), \"b\": (roughness: 2),\n  },\n)";

    #[test]
    fn comments_strings_and_longer_words_are_not_the_key() {
        assert_eq!(of("( // b: 1\n/* b: /* b */ b: */ bb: 1, c: b,\n b: 2)", &[Field("b")]), (3, 2));
        assert_eq!(of(TEXT, &[Field("materials")]), (5, 3));
    }

    #[test]
    fn a_path_is_followed_step_by_step() {
        assert_eq!(of(TEXT, &[Field("materials_more")]), (4, 3));
        assert_eq!(of(TEXT, &[Field("gltf"), Quoted("materials")]), (3, 9));
        assert_eq!(of(TEXT, &[Field("materials"), Quoted("b")]), (6, 29));
        assert_eq!(of(TEXT, &[Field("materials"), Quoted("b"), Field("roughness")]), (6, 35));
        assert_eq!(of(TEXT, &[Field("materials"), Quoted("Göld"), Field("roughness")]), (6, 14));
    }

    #[test]
    fn what_is_not_found_is_told_as_the_step_before_it() {
        assert_eq!(of("(\n a: {}, )", &[Field("a"), Quoted("b")]), (2, 2));
        assert_eq!(of("()", &[Field("a")]), (1, 1));
        assert_eq!(of("(\"unfinished \\", &[Quoted("a")]), (1, 1));
        assert_eq!(of("/* unfinished", &[Field("a")]), (1, 1));
        assert_eq!(of("", &[Field("a")]), (1, 1));
    }
}
