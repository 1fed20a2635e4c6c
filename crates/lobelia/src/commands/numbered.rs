//! Names of numbered files: `frame.####.png`, `frame.%04d.png`.

use std::path::{Path, PathBuf};

/// A file name whose number is left open.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Numbered {
    before: String,
    digits: usize,
    after: String,
    folder: PathBuf,
}

/// Where the open number stands in a name, and its least number of digits: two or more `#`, `%d`, or `%0Nd`.
fn places(name: &str) -> Vec<(std::ops::Range<usize>, usize)> {
    let bytes = name.as_bytes();
    let mut found = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let rest = &bytes[at..];
        let hashes = rest.iter().take_while(|byte| **byte == b'#').count();
        let digits = rest.iter().skip(1).take_while(|byte| byte.is_ascii_digit()).count();
        if hashes >= 2 {
            found.push((at..at + hashes, hashes));
            at += hashes;
        } else if rest[0] == b'%' && rest.get(1 + digits) == Some(&b'd') && (digits == 0 || rest[1] == b'0') {
            let least = if digits == 0 { 1 } else { name[at + 1..at + 1 + digits].parse().unwrap_or(usize::MAX) };
            found.push((at..at + digits + 2, least));
            at += digits + 2;
        } else {
            at += 1;
        }
    }
    found
}

impl Numbered {
    /// The pattern in a file name, if it has one; a word where it has several, or asks for more than 20 digits.
    pub fn of(path: &Path) -> Result<Option<Self>, String> {
        let Some(name) = path.file_name().and_then(|name| name.to_str()) else { return Ok(None) };
        match places(name).as_slice() {
            [] => Ok(None),
            [(place, digits)] if *digits <= 20 => Ok(Some(Self {
                before: name[..place.start].to_owned(),
                digits: *digits,
                after: name[place.end..].to_owned(),
                folder: path.parent().map(Path::to_owned).unwrap_or_default(),
            })),
            [_] => Err(format!("{}: the number of a frame has at most 20 digits", path.display())),
            _ => Err(format!("{}: there is more than one place for the number of the frame", path.display())),
        }
    }

    /// The file of a frame, from 0.
    pub fn file(&self, frame: u32) -> PathBuf {
        self.folder.join(format!("{}{frame:0digits$}{}", self.before, self.after, digits = self.digits))
    }
}

/// The file of a frame, if one is written then: numbered files are written for every frame, others for the last.
pub fn file_of(path: &Path, frame: u32, last: bool) -> Option<PathBuf> {
    match Numbered::of(path) {
        Ok(Some(numbered)) => Some(numbered.file(frame)),
        _ => last.then(|| path.to_owned()),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn numbers_go_where_the_pattern_is() {
        let file = |pattern: &str, frame| Numbered::of(Path::new(pattern)).unwrap().map(|numbered| numbered.file(frame));
        for (pattern, frame, name) in [
            ("a/frame.####.png", 7, "a/frame.0007.png"),
            ("frame.%04d.exr", 12, "frame.0012.exr"),
            ("f%d.png", 3, "f3.png"),
            ("##.png", 123, "123.png"),
            ("100%_%03d.png", 5, "100%_005.png"),
        ] {
            assert_eq!(file(pattern, frame), Some(PathBuf::from(name)), "{pattern}");
        }
        for literal in ["shot#1.png", "100%.png", "%4d.png", "%x.png", "####/a.png", "%.png", "%"] {
            assert_eq!(file(literal, 1), None, "{literal}");
        }
        assert!(Numbered::of(Path::new("##.%d.png")).unwrap_err().contains("more than one place"));
        assert!(Numbered::of(Path::new("%099d.png")).unwrap_err().contains("at most 20 digits"));
        assert!(Numbered::of(Path::new("%099999999999999999999999d.png")).is_err());
    }
}
